"""Lines of M1486 chips, opened by address. Several drivers, tasks or threads may share one."""

from __future__ import annotations

from collections.abc import Callable

from steptwin.drivers.exchange import Exchanger
from steptwin.drivers.m1486.talk import CharacterTalk, ChipRequest
from steptwin.drivers.place import parse_line_address
from steptwin.drivers.tasks import TaskLine
from steptwin.drivers.tcp import Endpoint
from steptwin.drivers.threads import ThreadLine
from steptwin.errors import Misuse
from steptwin.machine import SECOND, Nanos
from steptwin.wire.line import SerialLine
from steptwin.wire.slave import FrameDirection

BAUD = 4800
"""Baud rate with BR1 and BR0 open, bit/s."""
TALK = "m1486 talk"
"""The key of the `CharacterTalk` in a line's notes."""


def talking(
    endpoint: Endpoint, baud: int, log: Callable[[str], object] | None
) -> tuple[Exchanger[ChipRequest, bytes], CharacterTalk]:
    """The exchanger and the protocol of a line of chips."""

    def log_bytes(now: Nanos, direction: FrameDirection, data: bytes) -> None:
        if log is not None:
            log(f"{now / SECOND:12.6f} s  {'→' if direction is FrameDirection.IN else '←'} {data.hex(' '):<24}  {in_words(data)}")

    talk = CharacterTalk(SerialLine(baud), str(endpoint), on_bytes=log_bytes if log is not None else None)
    return Exchanger(talk, str(endpoint)), talk


def in_words(data: bytes) -> str:
    """Bytes as text, such as ``f12800 CR``; bytes that are not characters as hexadecimal."""
    return "".join(" CR " if byte == 0x0D else chr(byte) if 0x20 <= byte < 0x7F else f" {byte:02X}H " for byte in data).strip()


def line_endpoint(address: str, baud: int) -> Endpoint:
    place = parse_line_address(address, baud)
    if address.startswith("tcp://") and address.rpartition(":")[2].strip("/").isdecimal() is False:
        raise Misuse(f"{address!r} names no port: expected tcp://HOST:PORT, such as tcp://127.0.0.1:5022")
    return place.endpoint


class AsyncM1486Line(TaskLine[ChipRequest, bytes]):
    """A line of chips for asyncio, at an address (``/dev/ttyUSB0``, ``tcp://host:5022`` raw, ``rfc2217://host:port``)."""

    def __init__(self, address: str, *, baud: int = BAUD, log: Callable[[str], object] | None = None) -> None:
        endpoint = line_endpoint(address, baud)
        exchanger, talk = talking(endpoint, baud, log)
        super().__init__(endpoint, exchanger, {TALK: talk})


class ThreadM1486Line(ThreadLine[ChipRequest, bytes]):
    """The same for threads, used by `steptwin.drivers.m1486.sync.M1486Line`."""

    def __init__(self, address: str, *, baud: int = BAUD, log: Callable[[str], object] | None = None) -> None:
        endpoint = line_endpoint(address, baud)
        exchanger, talk = talking(endpoint, baud, log)
        super().__init__(endpoint, exchanger, {TALK: talk})
