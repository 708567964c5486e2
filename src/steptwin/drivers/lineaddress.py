"""Addresses of lines: ``/dev/ttyUSB0``, ``COM3``, ``tcp://host:5020``, ``rtu-tcp://host:5021``, ``rfc2217://host:port``,
``tls://host:8802?certificate=FILE&key=FILE&trusted=FILE``."""

from __future__ import annotations

import asyncio
import contextlib
import errno
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, cast
from urllib.parse import parse_qsl, urlsplit

from steptwin.drivers.exchange import LineLost
from steptwin.drivers.tcp import READ_BYTES, Channel, Endpoint, TcpEndpoint
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.system import reason
from steptwin.wire.line import SerialLine

if TYPE_CHECKING:
    from serialx import BaseSerial, BaseSerialTransport

MODBUS_PORT, SECURE_PORT = 502, 802
BAUDS = (300, 1_000_000)
FORMS = Message(
    "drivers.forms-of-addresses",
    "expected a serial port such as /dev/ttyUSB0 or COM3, tcp://HOST:PORT, rtu-tcp://HOST:PORT, rfc2217://HOST:PORT or "
    "tls://HOST:PORT?certificate=FILE&key=FILE&trusted=FILE",
)
TLS_FILES = ("certificate", "key", "trusted")


@dataclass(frozen=True, slots=True)
class LineAddress:
    """A parsed address. ``framed``: Modbus TCP rather than the bytes of a serial line."""

    endpoint: Endpoint
    framed: bool = False
    serial: SerialLine | None = None
    """The settings of a line on which bytes take time; else None."""


WRONG_BAUD = Message("drivers.wrong-baud", "{baud} bit/s is outside {least} to {most}")
NO_ADDRESS = Message("drivers.no-address", "{text!r} is not an address: {forms}")
SERIAL_PORT_IS_NOT_OPENED = Message(
    "drivers.serial-port-is-not-opened", "cannot open serial port {device} at {baud} bit/s: {why}"
)
SERIAL_PORT_WAS_LOST = Message("drivers.serial-port-was-lost", "serial port {place} was lost: {reason}")
NO_PORT = Message("drivers.no-port", "{text!r} names no port: {forms}")


def parse_line_address(text: str | Endpoint, baud: int) -> LineAddress:
    """Parse an address; an end point instead of one is a serial port. ``baud`` is for serial ports. Raises `Misuse`."""
    if not BAUDS[0] <= baud <= BAUDS[1]:
        raise Misuse(WRONG_BAUD(baud=baud, least=BAUDS[0], most=BAUDS[1]))
    if not isinstance(text, str):
        return LineAddress(text, serial=SerialLine(baud))
    scheme, separator, _ = text.partition("://")
    if not separator:
        if not text or (":" in text and "/" not in text):
            raise Misuse(NO_ADDRESS(text=text, forms=FORMS()))
        return LineAddress(SerialEndpoint(text, baud), serial=SerialLine(baud))
    if scheme == "rfc2217":
        return LineAddress(SerialEndpoint(text, baud), serial=SerialLine(baud))
    if scheme not in ("tcp", "rtu-tcp", "tls"):
        raise Misuse(NO_ADDRESS(text=text, forms=FORMS()))
    try:
        parts = urlsplit(text)
        host, port = parts.hostname, parts.port
        files = parse_qsl(parts.query, keep_blank_values=True, strict_parsing=True) if parts.query else []
        rest = parts.path.strip("/") + parts.fragment
    except ValueError:
        host, port, files, rest = None, None, [], ""
    if not host or rest or sorted(name if value else "" for name, value in files) != sorted(TLS_FILES if scheme == "tls" else ()):
        raise Misuse(NO_ADDRESS(text=text, forms=FORMS()))
    if port is None:
        if scheme == "rtu-tcp":
            raise Misuse(NO_PORT(text=text, forms=FORMS()))
        port = MODBUS_PORT if scheme == "tcp" else SECURE_PORT
    if scheme == "tls":
        from steptwin.drivers.tls import TlsEndpoint  # its library takes a while to import

        return LineAddress(TlsEndpoint(scheme, host, port, **dict(files)), framed=True)
    return LineAddress(TcpEndpoint(scheme, host, port), framed=scheme == "tcp")


# ---------------------------------------------------------------------- serial ports


@dataclass(frozen=True, slots=True)
class SerialEndpoint:
    """A serial port, 8N1. Only one process at a time can open it."""

    device: str
    baud: int

    def __str__(self) -> str:
        return self.device

    @property
    def is_network(self) -> bool:
        return self.device.startswith("rfc2217://")

    def open(self) -> Channel:
        import serialx

        try:
            if self.is_network:
                from steptwin.drivers.rfc2217 import NetworkSerial

                port: BaseSerial = NetworkSerial(self.device, self.baud)
            else:
                port = serialx.serial_for_url(self.device, self.baud)
            port.open()
        except (OSError, serialx.SerialException, ValueError) as error:
            raise self._failed(error) from error
        return SerialChannel(port, str(self))

    async def connect(self, make: Callable[[], asyncio.Protocol]) -> asyncio.Transport:
        import serialx

        loop = asyncio.get_running_loop()
        kind: type[BaseSerialTransport] | None = None
        if self.is_network:
            from steptwin.drivers.rfc2217 import NetworkSerialTransport

            kind = NetworkSerialTransport
        try:
            transport, _ = await serialx.create_serial_connection(loop, make, self.device, self.baud, transport_cls=kind)
        except (OSError, serialx.SerialException, ValueError) as error:
            raise self._failed(error) from error
        return cast(asyncio.Transport, transport)

    def _failed(self, error: Exception) -> LineLost:
        why = "in use by another program" if getattr(error, "errno", None) == errno.EBUSY else reason(error)
        return LineLost(SERIAL_PORT_IS_NOT_OPENED(device=self.device, baud=self.baud, why=why))


class SerialChannel:
    def __init__(self, port: BaseSerial, place: str) -> None:
        self._port = port
        self._place = place
        self._buffer = bytearray(READ_BYTES)

    def write(self, data: bytes) -> None:
        try:
            self._port.write(data, timeout=1.0)
        except Exception as error:  # platforms raise different errors; after any of them the port is unusable
            raise self._gone(error) from error

    def read(self, timeout_s: float) -> bytes:
        try:
            count = self._port.readinto(self._buffer, timeout=max(timeout_s, 0.0))
        except Exception as error:
            raise self._gone(error) from error
        return bytes(self._buffer[:count])

    def _gone(self, error: Exception) -> LineLost:
        return LineLost(SERIAL_PORT_WAS_LOST(place=self._place, reason=reason(error)))

    def close(self) -> None:
        with contextlib.suppress(Exception):
            self._port.close()
