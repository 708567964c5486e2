"""Lines of M1486 chips, opened by address. Several drivers, tasks or threads may share one."""

from __future__ import annotations

from collections.abc import Callable, Hashable

from steptwin.controller import SECOND, Nanos
from steptwin.drivers.exchange import Exchanger
from steptwin.drivers.lineaddress import parse_line_address
from steptwin.drivers.lineframes import FRAMES, LineFrames
from steptwin.drivers.m1486.decoder import M1486Decoder
from steptwin.drivers.m1486.talk import CharacterTalk, ChipRequest
from steptwin.drivers.tasks import TaskLine
from steptwin.drivers.tcp import Endpoint
from steptwin.drivers.threads import ThreadLine
from steptwin.errors import Misuse
from steptwin.m1486.variants import DEFAULT
from steptwin.wire.line import SerialLine
from steptwin.wire.slave import FrameDirection

BAUD = 4800
"""Baud rate with BR1 and BR0 open, bit/s."""
TALK = "m1486 talk"
"""The key of the `CharacterTalk` in a line's shared state."""


def talking(
    endpoint: Endpoint, baud: int, log: Callable[[str], object] | None
) -> tuple[Exchanger[ChipRequest, bytes], dict[Hashable, object]]:
    """The exchanger of a line of chips, and the shared state of its drivers: with the protocol, `TALK`."""
    talk = CharacterTalk(SerialLine(baud), str(endpoint))
    exchanger = Exchanger(talk, str(endpoint))

    def log_bytes(now: Nanos, direction: FrameDirection, data: bytes) -> None:
        if log is not None:
            log(
                f"{now / SECOND:12.6f} s  {'→' if direction is FrameDirection.IN else '←'} {data.hex(' '):<24}  {described(data)}"
            )

    def observe(followed: bool) -> None:
        if followed:
            decoder = M1486Decoder(lambda line: frames.take(talk.device, line.direction, line.raw, line.meaning), DEFAULT.name)

            def seen(now: Nanos, direction: FrameDirection, data: bytes) -> None:
                log_bytes(now, direction, data)
                decoder.expire(now)
                decoder.feed(data, now, direction)

            talk.on_bytes = seen
        else:
            talk.on_bytes = None if log is None else log_bytes

    frames = LineFrames(exchanger, observe)
    observe(False)
    return exchanger, {TALK: talk, FRAMES: frames}


def described(data: bytes) -> str:
    """Bytes as text, such as ``f12800 CR``; bytes that are not characters as hexadecimal."""
    return "".join(" CR " if byte == 0x0D else chr(byte) if 0x20 <= byte < 0x7F else f" {byte:02X}H " for byte in data).strip()


def line_endpoint(address: str | Endpoint, baud: int) -> Endpoint:
    place = parse_line_address(address, baud)
    if isinstance(address, str) and address.startswith("tcp://") and address.rpartition(":")[2].strip("/").isdecimal() is False:
        raise Misuse(f"{address!r} names no port: expected tcp://HOST:PORT, such as tcp://127.0.0.1:5022")
    return place.endpoint


class AsyncM1486Line(TaskLine[ChipRequest, bytes]):
    """A line of chips for asyncio, at an address (``/dev/ttyUSB0``, ``tcp://host:5022`` raw, ``rfc2217://host:port``), or
    on a serial port that is given."""

    def __init__(self, address: str | Endpoint, *, baud: int = BAUD, log: Callable[[str], object] | None = None) -> None:
        endpoint = line_endpoint(address, baud)
        super().__init__(endpoint, *talking(endpoint, baud, log))


class ThreadM1486Line(ThreadLine[ChipRequest, bytes]):
    """The same for threads, used by `steptwin.drivers.m1486.sync.M1486Line`."""

    def __init__(self, address: str, *, baud: int = BAUD, log: Callable[[str], object] | None = None) -> None:
        endpoint = line_endpoint(address, baud)
        super().__init__(endpoint, *talking(endpoint, baud, log))
