"""Modbus lines, opened by address. Several controllers, drivers, tasks or threads may share one."""

from __future__ import annotations

from collections.abc import Callable, Hashable

from steptwin.controller import SECOND, Nanos
from steptwin.drivers.exchange import Exchanger
from steptwin.drivers.lineaddress import LineAddress, parse_line_address
from steptwin.drivers.lineframes import FRAMES, LineFrames
from steptwin.drivers.mic488.frames import FrameLog
from steptwin.drivers.modbus import ModbusQuery, RtuMaster, TcpMaster
from steptwin.drivers.tasks import TaskLine
from steptwin.drivers.tcp import Endpoint
from steptwin.drivers.threads import ThreadLine
from steptwin.errors import Misuse
from steptwin.wire.slave import FrameDirection

FRAMES_PER_SECOND = 100.0
"""Frames per second that a MIC488 serves (manual 2)."""


def modbus_exchanger(
    place: LineAddress, frames_per_second: float | None, log: Callable[[str], object] | None
) -> tuple[Exchanger[ModbusQuery, bytes], dict[Hashable, object]]:
    """The exchanger of a Modbus line, and the shared state of its drivers. ``frames_per_second`` to each device; None: any."""
    if frames_per_second is not None and frames_per_second <= 0.0:
        raise Misuse(f"{frames_per_second:g} frames per second: must be above 0")
    interval: Nanos = 0 if frames_per_second is None else round(SECOND / frames_per_second)
    words = FrameLog(tcp=place.framed)
    where = str(place.endpoint)
    discipline = TcpMaster(where) if place.framed else RtuMaster(place.serial)
    exchanger = Exchanger(discipline, where, interval)

    def observe(followed: bool) -> None:
        discipline.on_frame = words.observe if followed or log is not None else None

    frames = LineFrames(exchanger, observe)
    if log is not None:
        words.sinks.append(lambda frame: log(str(frame)))
        observe(False)
    words.sinks.append(lambda one: frames.take(one.unit, one.direction or FrameDirection.OUT, one.raw, one.meaning))
    return exchanger, {"tcp": place.framed, "frames": words, FRAMES: frames}


class AsyncModbusLine(TaskLine[ModbusQuery, bytes]):
    """A Modbus line for tasks, at an address, or on a serial port that is given. ``async with`` opens and closes it."""

    def __init__(
        self,
        address: str | Endpoint,
        *,
        baud: int = 38400,
        frames_per_second: float | None = FRAMES_PER_SECOND,
        log: Callable[[str], object] | None = None,
    ) -> None:
        place = parse_line_address(address, baud)
        super().__init__(place.endpoint, *modbus_exchanger(place, frames_per_second, log))


class ThreadModbusLine(ThreadLine[ModbusQuery, bytes]):
    """The same for threads, used by `steptwin.drivers.mic488.sync.ModbusLine`."""

    def __init__(
        self,
        address: str,
        *,
        baud: int = 38400,
        frames_per_second: float | None = FRAMES_PER_SECOND,
        log: Callable[[str], object] | None = None,
    ) -> None:
        place = parse_line_address(address, baud)
        super().__init__(place.endpoint, *modbus_exchanger(place, frames_per_second, log))
