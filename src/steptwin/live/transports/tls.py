"""Modbus/TCP Security (MB-TCP-Security): Modbus TCP over TLS, certificates at both ends, the role of the client in its own."""

from __future__ import annotations

import asyncio
import ssl
from collections.abc import Callable
from contextvars import ContextVar
from pathlib import Path
from typing import Any, NamedTuple, cast
from weakref import WeakSet

from steptwin.access.modbusroles import ROLE_OID, may_ask, role_of
from steptwin.access.roles import Role
from steptwin.controller import Nanos, Port, SendingPort, SourcedPort, sends_by_itself
from steptwin.errors import Misuse
from steptwin.extras import missing
from steptwin.live.clients import BACKLOG
from steptwin.live.tcp import listening_at
from steptwin.live.tcp_asyncio import AsyncioConnection, TurnedAway
from steptwin.live.transports.contract import LinkArguments, OpenLink, Transport
from steptwin.simulation.kinds.links import TlsFiles
from steptwin.simulation.toml.addresses import Address, parse_address
from steptwin.system import reason
from steptwin.wire.mbap import TcpFramer
from steptwin.wire.pdu import ILLEGAL_FUNCTION, READS, REFUSED, WRITES, exception_pdu
from steptwin.wire.rtu import BROADCAST
from steptwin.wire.slave import tcp_response

HANDSHAKE_S = 10.0
"""Time for a client to prove who it is, s."""


class TlsClient(NamedTuple):
    """Who a client is by its certificate: the common name, and its role; None without one that is known here. ``place``: where it
    is."""

    name: str
    role: Role | None
    place: str

    def __str__(self) -> str:
        return f"{self.name} ({'no role' if self.role is None else self.role.title}, {self.place})"


def client_of(certificate: bytes, place: str) -> TlsClient:
    """The owner, at ``place``, of a certificate (DER) that has been verified."""
    from cryptography import x509
    from cryptography.x509.oid import NameOID

    try:
        read = x509.load_der_x509_certificate(certificate)
        names = read.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
        values = [each.value for each in read.extensions if each.oid.dotted_string == ROLE_OID]
    except (ValueError, x509.DuplicateExtension):
        return TlsClient("unnamed", None, place)
    role = role_of(values[0].value) if values and isinstance(values[0], x509.UnrecognizedExtension) else None
    return TlsClient(str(names[0].value) if names else "unnamed", role, place)


_unproved: ContextVar[asyncio.Transport | None] = ContextVar("_unproved", default=None)
"""The connection on which a handshake is begun."""


class _AlertingObject(ssl.SSLObject):
    """Sends the alert with which a handshake fails. asyncio closes the connection without it."""

    outgoing: ssl.MemoryBIO
    plain: asyncio.Transport | None = None

    def do_handshake(self) -> None:
        try:
            super().do_handshake()
        except (ssl.SSLWantReadError, ssl.SSLWantWriteError):
            raise
        except ssl.SSLError:
            if self.plain is not None and (alert := self.outgoing.read()):
                self.plain.write(alert)
            raise


class _AlertingContext(ssl.SSLContext):
    sslobject_class = _AlertingObject

    def wrap_bio(self, incoming: ssl.MemoryBIO, outgoing: ssl.MemoryBIO, *arguments: Any, **named: Any) -> ssl.SSLObject:
        made = super().wrap_bio(incoming, outgoing, *arguments, **named)
        if isinstance(made, _AlertingObject):
            made.outgoing, made.plain = outgoing, _unproved.get()
        return made


def server_context(files: TlsFiles, folder: Path) -> ssl.SSLContext:
    """TLS 1.2 or newer, with a certificate of the client that is trusted. Files are relative to ``folder``. Raises `Misuse`."""
    context = _AlertingContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    context.verify_mode = ssl.CERT_REQUIRED
    context.verify_flags |= ssl.VERIFY_X509_PARTIAL_CHAIN  # a certificate that is trusted needs no authority
    context.options |= ssl.OP_NO_TICKET | ssl.OP_NO_RENEGOTIATION  # each connection proves anew who it is
    context.num_tickets = 0
    trusted = sorted((folder / files.trusted).glob("*.pem"))
    if not trusted:
        raise Misuse(f"trusted: {folder / files.trusted} has no certificate (.pem), so no client would be admitted")
    for file in trusted:
        try:
            context.load_verify_locations(file)
        except (OSError, ssl.SSLError) as error:
            raise Misuse(f"trusted: {file} is not a certificate: {reason(error)}") from None
    try:
        context.load_cert_chain(folder / files.certificate, folder / files.key, password="")
    except (OSError, ssl.SSLError, ValueError) as error:
        raise Misuse(f"{files.certificate}, {files.key}: {reason(error)}") from None
    return context


class TlsPort:
    """The port of a client whose certificate has been verified: what its role does not permit is answered with exception 01.

    All but reads is recorded in the audit log, if there is one, when the answer is there.
    """

    def __init__(self, port: Port, client: TlsClient, opening: LinkArguments) -> None:
        self._port = port
        self._client = client
        self._clients = opening.clients
        self._audit = opening.audit
        self._line = opening.line_name
        self._requests = TcpFramer()
        self._waiting: list[bytes] = []
        """Recorded requests whose answers are still to come."""

    @property
    def broken(self) -> str | None:
        return self._requests.broken or self._port.broken

    def exchange(self, data: bytes, now: Nanos) -> bytes:
        return b"".join([self._answer(frame.raw, now) for frame in self._requests.feed(data)])

    def _answer(self, request: bytes, now: Nanos) -> bytes:
        function = request[7]
        if not may_ask(self._client.role, function):
            host = self._client.place.rpartition(":")[0]
            self._clients.tell(host, f"client {self._client}: a request with function {function} is refused")
            self._note(request, "refusal")
            return tcp_response(request, exception_pdu(function, ILLEGAL_FUNCTION))
        if self._audit is None or function in READS:
            return self._seen(self._port.exchange(request, now))
        self._waiting.append(request)
        answer = self._seen(self._port.exchange(request, now))
        if request[6] == BROADCAST and self._waiting[-1:] == [request]:
            self._note(self._waiting.pop(), "sent")
        return answer

    def _seen(self, sent: bytes) -> bytes:
        if self._waiting and sent:
            for answer in TcpFramer().feed(sent):
                asked = next((one for one in self._waiting if one[:2] == answer.raw[:2]), None)
                if asked is not None:
                    self._waiting.remove(asked)
                    self._note(asked, "refusal" if answer.raw[7] >= REFUSED else "done")
        return sent

    def _note(self, request: bytes, outcome: str) -> None:
        if self._audit is not None:
            self._audit(self._client, "request", {"line": self._line, "unit": request[6], "pdu": request[7:].hex()}, outcome)

    def to_send(self, now: Nanos) -> list[tuple[Nanos, bytes]]:
        return [(at, self._seen(data)) for at, data in self._port.to_send(now)]

    def deadline(self) -> Nanos | None:
        return self._port.deadline()

    def close(self) -> None:
        for request in self._waiting:
            self._note(request, "failure")
        self._port.close()


class SendingTlsPort(TlsPort):
    """The same for a port with unsolicited output."""

    def __init__(self, port: SendingPort, client: TlsClient, opening: LinkArguments) -> None:
        super().__init__(port, client, opening)
        self._sending = port

    @property
    def on_output(self) -> Callable[[], None] | None:
        return self._sending.on_output

    @on_output.setter
    def on_output(self, call: Callable[[], None] | None) -> None:
        self._sending.on_output = call


class _Entrance(asyncio.Protocol):
    """A client that has not yet proved who it is."""

    waiting = 0
    _peer = Address("unknown", 0)

    def __init__(self, link: TlsLink) -> None:
        self._link = link
        self._received = b""
        self._transport: asyncio.Transport | None = None
        self.proof: asyncio.Task[None] | None = None
        link.clients.present.add(self)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = plain = cast(asyncio.Transport, transport)
        plain.pause_reading()  # the first bytes belong to the handshake
        host, port, *_ = transport.get_extra_info("peername") or self._peer
        self._peer = Address(host, port)
        self.proof = asyncio.get_running_loop().create_task(self._prove(plain))

    async def _prove(self, plain: asyncio.Transport) -> None:
        link = self._link
        _unproved.set(plain)
        try:
            encrypted = await asyncio.get_running_loop().start_tls(
                plain, self, link.context, server_side=True, ssl_handshake_timeout=HANDSHAKE_S
            )
        except OSError as error:
            link.clients.made_no_sense(self._peer, f"not admitted: {reason(error)}")
            plain.abort()
        else:
            if encrypted is not None and not encrypted.is_closing():
                link.admit(encrypted, self._received)
        finally:
            link.clients.present.discard(self)
            link.entrances.discard(self)

    def data_received(self, data: bytes) -> None:
        """Take bytes that come with the end of the handshake."""
        self._received += data

    def write(self, data: bytes) -> None:
        """Nothing is sent before the end of the handshake."""

    def close(self) -> None:
        if self.proof is not None:
            self.proof.cancel()
        if self._transport is not None:
            self._transport.abort()


class TlsLink:
    """A listening address for encrypted connections; every client gets a port of its own."""

    def __init__(self, opening: LinkArguments, context: ssl.SSLContext) -> None:
        self.context = context
        self.clients = opening.clients
        self.entrances: set[_Entrance] = set()
        self._opening = opening
        self._connections: WeakSet[AsyncioConnection] = WeakSet()
        self._server: asyncio.Server | None = None

    async def open(self, address: Address) -> Address:
        """Listen; returns the address with the port in use. Raises `LineFailure` naming the address."""
        listener = listening_at(address)
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(self._welcome, sock=listener, backlog=BACKLOG)
        return Address(address.host, listener.getsockname()[1])

    def _welcome(self) -> asyncio.Protocol:
        if not self.clients.have_room():
            return TurnedAway()
        entrance = _Entrance(self)
        self.entrances.add(entrance)
        return entrance

    def admit(self, transport: asyncio.Transport, received: bytes) -> None:
        """Serve a client whose certificate has been verified; ``received`` has come already."""
        host, peer, *_ = transport.get_extra_info("peername") or ("unknown", 0)
        client = client_of(transport.get_extra_info("ssl_object").getpeercert(binary_form=True), str(Address(host, peer)))
        port = made = self._opening.make_port()
        if self._opening.audit is not None or not all(may_ask(client.role, function) for function in WRITES | READS):
            opening = self._opening
            port = SendingTlsPort(made, client, opening) if sends_by_itself(made) else TlsPort(made, client, opening)
        connection = AsyncioConnection(self._opening.realtime, port, self.clients)
        self._connections.add(connection)
        transport.set_protocol(connection)
        connection.connection_made(transport)
        if isinstance(made, SourcedPort):
            made.used_by(str(client))
        if received:
            connection.data_received(received)

    async def close(self) -> None:
        if self._server is not None:
            self._server.close()
            self._server = None
        entrances = list(self.entrances)
        for client in (*entrances, *self._connections):
            client.close()
        await asyncio.gather(*(each.proof for each in entrances if each.proof is not None), return_exceptions=True)


async def _open(opening: LinkArguments) -> OpenLink:
    address = parse_address(opening.where, listen_any=opening.listen_any)
    if opening.tls is None:
        raise Misuse(f"tls_tcp = {opening.where!r}: certificate, key and trusted are missing")
    try:
        import cryptography  # noqa: F401  reads the role of a client
    except ImportError:
        raise missing("tls_tcp of [[line]]", "tls") from None
    link = TlsLink(opening, server_context(opening.tls, opening.folder))
    listening = await link.open(address)
    return OpenLink(link, str(listening), {"host": listening.host, "port": listening.port})


TLS_TCP = Transport(kind="tls", is_address=True, has_several=True, open=_open)
