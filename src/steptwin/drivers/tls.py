"""Encrypted lines: Modbus/TCP Security, with certificates at both ends."""

from __future__ import annotations

import asyncio
import socket
import ssl
from collections.abc import Callable
from dataclasses import dataclass

from steptwin.drivers.tcp import CONNECT_S, Channel, TcpEndpoint, TimedSocketChannel
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.system import reason

WRONG_TRUSTED = Message("drivers.wrong-trusted", "{address}: trusted={trusted}: {why}")
WRONG_CERTIFICATE = Message("drivers.wrong-certificate", "{address}: certificate={certificate}, key={key}: {why}")


@dataclass(frozen=True, slots=True)
class TlsEndpoint(TcpEndpoint):
    """PEM files: ``certificate`` and ``key`` of this program, ``trusted`` of the other end or of who signs its certificate."""

    certificate: str
    key: str
    trusted: str

    def _context(self) -> ssl.SSLContext:
        """Raises `Misuse` for files that cannot be used."""
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        context.minimum_version = ssl.TLSVersion.TLSv1_2
        context.verify_flags |= ssl.VERIFY_X509_PARTIAL_CHAIN  # a certificate that is trusted needs no authority
        try:
            context.load_verify_locations(self.trusted)
        except (OSError, ssl.SSLError) as error:
            raise Misuse(WRONG_TRUSTED(address=self, trusted=self.trusted, why=reason(error))) from None
        try:
            context.load_cert_chain(self.certificate, self.key, password="")
        except (OSError, ssl.SSLError, ValueError) as error:
            raise Misuse(WRONG_CERTIFICATE(address=self, certificate=self.certificate, key=self.key, why=reason(error))) from None
        return context

    def open(self) -> Channel:
        context = self._context()
        try:
            plain = socket.create_connection((self.host, self.port), CONNECT_S)
            return TlsChannel(context.wrap_socket(plain, server_hostname=self.host), str(self))
        except OSError as error:
            raise self._failed(error) from error

    async def connect(self, make: Callable[[], asyncio.Protocol]) -> asyncio.Transport:
        context = self._context()
        try:
            async with asyncio.timeout(CONNECT_S):
                transport, _ = await asyncio.get_running_loop().create_connection(
                    make, self.host, self.port, ssl=context, server_hostname=self.host
                )
        except OSError as error:
            raise self._failed(error) from error
        return transport


class TlsChannel(TimedSocketChannel):
    """Reads and writes of an encrypted connection have no flags: it waits by time-outs."""

    def _send(self, data: bytes) -> int:
        try:
            return super()._send(data)
        except ssl.SSLWantWriteError as error:
            raise BlockingIOError(*error.args) from None

    def _receive(self, timeout_s: float) -> bytes:
        try:
            return super()._receive(timeout_s)
        except ssl.SSLWantReadError as error:
            raise BlockingIOError(*error.args) from None
