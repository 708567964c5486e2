"""The control endpoint of a running twin: a shell around its dispatcher, over a local socket or over TCP on this computer.

Messages are lines of JSON, as ``docs/control.md`` describes them. Every request has exactly one answer, in order; events of
a ``subscribe`` come after its answer, with its id. Only the user who started the twin can open the local socket; over TCP the
first line is a token that only this user can read. Requests, waiting events and clients are bounded.
"""

from __future__ import annotations

import asyncio
import hmac
import json
import os
import secrets
import socket
from pathlib import Path
from typing import cast

from steptwin.errors import LineFailure, Misuse
from steptwin.files.ownership import InUse, Ownership
from steptwin.files.writing import PRIVATE, new_content
from steptwin.later import start
from steptwin.live.directory import private_directory, runtime_directory
from steptwin.messages import Message
from steptwin.simulation.toml.addresses import Address
from steptwin.subject.commands import Command, Subscribe, Time, Unsubscribe
from steptwin.subject.contract import PlannedSubject, Result
from steptwin.subject.dispatch import FORM, LONGEST_REQUEST, JsonObject, failure, read_message, respond
from steptwin.subject.subscriptions import Subscription, filter_of
from steptwin.system import reason

HAS_LOCAL_SOCKETS = hasattr(socket, "AF_UNIX")
TIMEOUT_S = 10.0
"""Time-out of a request, of a client without requests, and of a client that does not read, s."""
MOST_CLIENTS = 64
MOST_SUBSCRIPTIONS = 16
"""Follows of one client."""
MOST_WAITING_BYTES = 1 << 18
"""Unread answers and events of a client above which nothing more is written, bytes."""
EVENTS_AT_ONCE = 200
"""Events written to one client before others are served."""
SOCKET, ANNOUNCEMENT = ".control", ".twin"
"""Suffixes in the runtime directory: a local socket; a file with the address and token of an endpoint over TCP."""
TOKEN_BYTES = 16


TWIN_IS_RUNNING = Message(
    "live.twin-is-running", "a twin named {name!r} is running already ({owner}): give this one another --name"
)
CONTROL_IS_NOT_OPENED = Message("live.control-is-not-opened", "cannot open the control endpoint {place}: {reason}")


class ControlEndpoint:
    """Listens for requests and passes them to ``subject``; over TCP if there is an ``address`` or no local socket."""

    def __init__(self, name: str, subject: PlannedSubject, address: Address | None = None) -> None:
        self.name = name
        directory = runtime_directory()
        self.path = directory / f"{name}{SOCKET}"
        self.announcement = directory / f"{name}{ANNOUNCEMENT}"
        self._address = address if address is not None or HAS_LOCAL_SOCKETS else Address("127.0.0.1", 0)
        self._subject = subject
        self._owned: Ownership | None = None
        self._servers: list[asyncio.Server] = []
        self._clients: set[_Conversation] = set()
        self._token = ""
        self.listening: Address | None = None
        """The TCP address on which it listens."""

    async def open(self) -> Path:
        """Open the endpoint. Raises `Misuse` if a twin of this name is running."""
        try:
            private_directory(self.path.parent)
            self._owned = Ownership(self.path.with_suffix(".lock"))
            self.path.unlink(missing_ok=True)
            self.announcement.unlink(missing_ok=True)
            loop = asyncio.get_running_loop()
            if HAS_LOCAL_SOCKETS:
                self._servers.append(await loop.create_unix_server(self._conversation, str(self.path)))
                self.path.chmod(0o600)
            if self._address is not None:
                await self._open_tcp(self._address)
        except InUse as taken:
            raise Misuse(TWIN_IS_RUNNING(name=self.name, owner=taken.owner)) from None
        except OSError as error:
            await self.close()
            raise LineFailure(CONTROL_IS_NOT_OPENED(place=self._address or self.path, reason=reason(error))) from error
        return self.path

    async def _open_tcp(self, address: Address) -> None:
        """Listen on TCP, and write address and token to a file that only this user can read."""
        self._token = secrets.token_hex(TOKEN_BYTES)
        loop = asyncio.get_running_loop()
        server = await loop.create_server(lambda: self._conversation(self._token), address.host, address.port)
        self._servers.append(server)
        host, port = server.sockets[0].getsockname()[:2]
        self.listening = Address(host, port)
        said = json.dumps({"name": self.name, "pid": os.getpid(), "host": host, "port": port, "token": self._token})
        with new_content(self.announcement, PRIVATE) as file:
            file.write(f"{said}\n".encode())

    def _conversation(self, token: str = "") -> _Conversation:
        return _Conversation(self._subject, self._clients, token)

    async def close(self) -> None:
        for server in self._servers:
            server.close()
        for client in list(self._clients):
            client.abort()
        for server in self._servers:
            await server.wait_closed()
        if self._servers:
            self.path.unlink(missing_ok=True)
            self.announcement.unlink(missing_ok=True)
        self._servers.clear()
        if self._owned is not None:
            self._owned.release()
            self._owned = None


TOO_MANY_CLIENTS = Message("live.too-many-clients", "there are {most} clients already, the most possible")
REQUEST_TOOK_TOO_LONG = Message("live.request-took-too-long", "no complete request within {timeout_s:g} s: {form}")
REQUEST_WITHOUT_END = Message("live.request-without-end", "the request has no end of line: {form}")
TOKEN_COMES_FIRST = Message(
    "live.token-comes-first", 'the first line of a connection is {{"token": TOKEN}}, with the token of this twin'
)
UNKNOWN_SUBSCRIPTION = Message("live.unknown-subscription", "no subscription has the id {name!r}")
SUBSCRIPTION_WITHOUT_ID = Message("live.subscription-without-id", "subscribe: an id is required; its events carry it")
SUBSCRIPTION_ID_IN_USE = Message("live.subscription-id-in-use", "subscribe: the id {name!r} is in use")
TOO_MANY_SUBSCRIPTIONS = Message("live.too-many-subscriptions", "subscribe: too many: the limit for a client is {most}")


class _Conversation(asyncio.Protocol):
    """One client: its requests in order, their answers, and the events of its subscriptions."""

    def __init__(self, subject: PlannedSubject, clients: set[_Conversation], token: str) -> None:
        self._subject = subject
        self._clients = clients
        self._token = token
        """The required first line; empty: none."""
        self._received = b""
        self._has_asked = False
        self._has_ended = False
        """Whether the client has closed its sending side."""
        self._is_full = False
        """Whether writing waits for the client to read."""
        self._is_asked = False
        """Whether the answer to a request is still to come; the next one is read after it."""
        self._subscriptions: dict[object, Subscription] = {}
        self._timer: asyncio.TimerHandle | None = None
        self._is_due = False

    # ------------------------------------------------------------------ the connection

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.Transport, transport)
        self._transport.set_write_buffer_limits(high=MOST_WAITING_BYTES)
        if len(self._clients) >= MOST_CLIENTS:
            self._end(failure(LineFailure(TOO_MANY_CLIENTS(most=MOST_CLIENTS))))
            return
        self._clients.add(self)
        self._wait()

    def _wait(self) -> None:
        """Start the time-out within which the client must send, complete its request, or read."""
        self._calm()
        self._timer = asyncio.get_running_loop().call_later(TIMEOUT_S, self._late)

    def _calm(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _late(self) -> None:
        if self._is_full or self._transport.is_closing():
            self.abort()
        else:
            self._end(failure(Misuse(REQUEST_TOOK_TOO_LONG(timeout_s=TIMEOUT_S, form=FORM()))))

    def connection_lost(self, exc: Exception | None) -> None:
        self._calm()
        self._clients.discard(self)
        self._unsubscribe_all()

    def _unsubscribe_all(self) -> None:
        for subscription in self._subscriptions.values():
            subscription.close()
        self._subscriptions.clear()

    def abort(self) -> None:
        self._calm()
        self._transport.abort()

    def eof_received(self) -> bool:
        """Answer the remaining requests after the client has closed its sending side, and end its subscriptions."""
        self._has_ended = True
        self._unsubscribe_all()
        if self._received and not self._is_full:
            self._end(failure(Misuse(REQUEST_WITHOUT_END(form=FORM()))))
        return self._is_full or self._is_asked

    def pause_writing(self) -> None:
        self._is_full = True
        self._transport.pause_reading()
        self._wait()

    def resume_writing(self) -> None:
        self._is_full = False
        self._calm()
        if not self._has_ended and not self._is_asked:
            self._transport.resume_reading()
        self._take_lines()
        self._send_events()
        if self._has_ended and not self._is_full:
            self._transport.close()

    # ------------------------------------------------------------------ requests

    def data_received(self, data: bytes) -> None:
        self._received += data
        self._take_lines()

    def _take_lines(self) -> None:
        while not self._is_full and not self._is_asked and not self._transport.is_closing():
            line, newline, rest = self._received.partition(b"\n")
            if not newline:
                break
            if len(line) > LONGEST_REQUEST:
                self._end(_too_long())
                return
            self._received = rest
            self._has_asked = True
            self._take(line)
        if self._transport.is_closing() or self._is_full or self._is_asked:
            return
        if len(self._received) > LONGEST_REQUEST:
            self._end(_too_long())
        elif self._received and self._timer is None:
            self._wait()
        elif not self._received and self._has_asked:
            self._calm()

    def _take(self, line: bytes) -> None:
        if self._token:
            self._check_token(line)
        else:
            self._is_asked = True
            answer = start(respond(self._do, line, _report))
            is_late = not answer.is_done
            if is_late:
                self._calm()
                self._transport.pause_reading()
            answer.then(lambda: self._answered(answer.result(), is_late=is_late))

    def _answered(self, message: JsonObject, *, is_late: bool) -> None:
        self._is_asked = False
        if self._transport.is_closing():
            return
        self._write(message)
        if is_late:
            if not self._has_ended and not self._is_full:
                self._transport.resume_reading()
            self._take_lines()
            if self._has_ended and not self._is_full and not self._is_asked:
                self._transport.close()

    def _check_token(self, line: bytes) -> None:
        try:
            given = read_message(line, "token")["token"]
        except Misuse:
            given = ""
        if not hmac.compare_digest(str(given).encode("utf-8", "replace"), self._token.encode()):
            self._end(failure(Misuse(TOKEN_COMES_FIRST())))
            return
        self._token = ""
        self._write({"ok": None})

    async def _do(self, wanted: Command, identity: object) -> Result:
        if isinstance(wanted, Subscribe):
            return self._subject.do(Time())._replace(value=self._subscribe(wanted, identity))
        if isinstance(wanted, Unsubscribe):
            subscription = self._subscriptions.pop(wanted.id, None)
            if subscription is None:
                raise Misuse(UNKNOWN_SUBSCRIPTION(name=wanted.id))
            subscription.close()
            return self._subject.do(Time())._replace(value=None)
        return await self._subject.answer(wanted)

    def _subscribe(self, wanted: Subscribe, identity: object) -> object:
        if identity is None:
            raise Misuse(SUBSCRIPTION_WITHOUT_ID())
        if identity in self._subscriptions:
            raise Misuse(SUBSCRIPTION_ID_IN_USE(name=identity))
        if len(self._subscriptions) >= MOST_SUBSCRIPTIONS:
            raise Misuse(TOO_MANY_SUBSCRIPTIONS(most=MOST_SUBSCRIPTIONS))
        what = filter_of(wanted.kinds, wanted.controllers, wanted.axes)
        plans = [plan.to_json() for plan in self._subject.plans(what)]
        subscription = self._subscriptions[identity] = self._subject.subscribe(what, wanted.bound)
        subscription.on_event = self._events_came
        return {"plans": plans}

    # ------------------------------------------------------------------ what is sent

    def _write(self, message: JsonObject) -> None:
        self._transport.write(json.dumps(message).encode() + b"\n")

    def _end(self, message: JsonObject) -> None:
        """Send the last answer; further input is not read."""
        self._received = b""
        self._write(message)
        self._wait()
        self._transport.close()

    def _events_came(self) -> None:
        if not self._is_due:
            self._is_due = True
            asyncio.get_running_loop().call_soon(self._send_events)

    def _send_events(self) -> None:
        """Write events until the client has to read first; the bound of each subscription limits the rest."""
        self._is_due = False
        for identity, subscription in self._subscriptions.items():
            if self._is_full or self._transport.is_closing():
                return
            missed, events = subscription.take(EVENTS_AT_ONCE)
            for event in events:
                lost: JsonObject = {"missed": missed} if missed else {}
                self._write({"id": identity, "event": event.to_json(), **lost})
                missed = 0
            if len(subscription):
                self._events_came()


REQUEST_IS_TOO_LONG = Message("live.request-is-too-long", "a request has at most {most} bytes")


def _too_long() -> JsonObject:
    return failure(Misuse(REQUEST_IS_TOO_LONG(most=LONGEST_REQUEST)))


def _report(error: Exception) -> None:
    asyncio.get_running_loop().call_exception_handler({"message": "a control request failed", "exception": error})
