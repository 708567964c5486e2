"""What programs need of the drivers of the MIC488: `MIC488_DRIVER`."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Callable, Collection, Generator, Sequence
from types import TracebackType
from typing import Any

from steptwin.drivers.blocking import finish
from steptwin.drivers.kind import (
    AddressSelection,
    Decoding,
    DeviceAddress,
    DeviceMotion,
    DeviceSearch,
    DriverKind,
    EndedMotion,
    FoundDevice,
    Log,
    WantedMoves,
)
from steptwin.drivers.line import DriverLine
from steptwin.drivers.mic488 import named
from steptwin.drivers.mic488.conversation import Mic488Terminal
from steptwin.drivers.mic488.decoder import ModbusDecoder
from steptwin.drivers.mic488.driver import TIMEOUT_S, AsyncMic488
from steptwin.drivers.mic488.identify import scan
from steptwin.drivers.mic488.lines import AsyncModbusLine
from steptwin.drivers.mic488.motion import MoveEnd, Reason
from steptwin.drivers.mic488.overview import overview
from steptwin.drivers.mic488.program import ProgramState
from steptwin.drivers.mic488.subject import Mic488Part
from steptwin.drivers.mic488.sync import Mic488, Mic488Axis, Mic488Jog, ModbusLine
from steptwin.drivers.typed import tied
from steptwin.errors import Misuse
from steptwin.machine import SECOND
from steptwin.mic488.registers import AXES, DEFAULT_FIRMWARE

BAUD = 38400
BAUDS = (38400, 9600, 19200, 57600, 115200)
"""Baud rates at which controllers are searched, bit/s."""
EVERY_UNIT = "; every unit number is answered here, so several of them may be one device"
RUNS_ON = "the program in the controller runs on and may move the axes again: --program ends it"


@contextlib.contextmanager
def opened(address: DeviceAddress, observe: bool, log: Log | None) -> Generator[Mic488]:
    """An open driver. ``observe``: DATA_TYPE is left as it is."""
    with Mic488(
        address.place,
        unit_of(address),
        baud=address.baud,
        firmware=address.variant,
        config=address.config,
        scales=address.scales,
        timeout_s=address.timeout,
        observe=observe,
        log=log,
    ) as mic:
        yield mic


def of_mic488(address: DeviceAddress, what: str) -> DeviceAddress:
    """The address, for what only a MIC488 has. Raises `Misuse` for another kind of device."""
    if address.kind != MIC488_DRIVER.name:
        raise Misuse(f"{what} is for {MIC488_DRIVER.title}; {address.place} is of kind {address.kind}")
    return address


def unit_of(address: DeviceAddress) -> int:
    """The slave address; 1 if none is given."""
    return 1 if address.number is None else address.number


# ---------------------------------------------------------------------- as a subject, and the search


def _line(place: str, baud: int) -> DriverLine[Any, Any]:
    return AsyncModbusLine(place, baud=baud)


async def _part(address: DeviceAddress, line: DriverLine[Any, Any]) -> Mic488Part:
    mic = AsyncMic488(
        line,
        unit_of(address),
        firmware=address.variant,
        config=address.config,
        scales=address.scales,
        timeout_s=address.timeout,
        observe=True,
    )
    await mic.open()
    return Mic488Part(mic, address.config)


def _find(
    place: str, baud: int, units: Sequence[int], timeout_s: float, progress: Callable[[int], object]
) -> Sequence[FoundDevice]:
    with ModbusLine(place, baud=baud) as line:
        found = finish(scan(line.line, units, timeout_ns=round(timeout_s * SECOND), progress=progress))
    return [
        FoundDevice(
            one.unit,
            one.firmware,
            f"{'responds, but is not a MIC488' if one.firmware is None else f'MIC488, firmware {one.firmware}'}"
            f"{EVERY_UNIT if one.every_unit else ''}",
        )
        for one in found
    ]


# ---------------------------------------------------------------------- motions


def _ended(end: MoveEnd) -> EndedMotion:
    return EndedMotion(
        end.axis,
        f"M{end.axis}",
        end.ok,
        end.reason.value,
        end.position_u,
        end.unit,
        end.after_s,
        end.detail,
        is_overdue=end.reason is Reason.OVERDUE,
    )


def _move(moves: WantedMoves) -> DeviceMotion[Mic488]:
    targets = moves.targets

    def begin(mic: Mic488, begun: set[int], check: Callable[[], object]) -> None:
        check()
        if moves.velocity is not None:
            for axis in targets:
                mic.axis(axis).set_ramp(velocity=moves.velocity)
        check()
        if len(targets) > 1:
            (mic.move_together_by if moves.is_by else mic.move_together)(targets)
        else:
            ((axis, value),) = targets.items()
            (mic.axis(axis).move_by if moves.is_by else mic.axis(axis).move_to)(value)
        begun.update(targets)

    return DeviceMotion(tuple(targets), begin)


def _home(texts: Sequence[str]) -> DeviceMotion[Mic488]:
    velocities = tied(texts, AXES)

    def begin(mic: Mic488, begun: set[int], check: Callable[[], object]) -> None:
        for axis, velocity in velocities.items():
            check()
            mic.axis(axis).home(velocity)
            begun.add(axis)

    return DeviceMotion(tuple(velocities), begin)


class _AxisJog:
    """See `steptwin.drivers.kind.DeviceHeldJog`."""

    def __init__(self, axis: Mic488Axis, velocity_u: float, hold_s: float) -> None:
        self._axis = axis
        self._jog: Mic488Jog = axis.jog(velocity_u, hold_s=hold_s)

    def __enter__(self) -> object:
        return self._jog.__enter__()

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._jog.__exit__(kind, error, trace)

    ahead_s = 0.0
    """The end of the block makes it brake."""

    @property
    def unit(self) -> str:
        return self._axis.unit

    def hold(self) -> bool:
        return self._jog.hold()

    def ended(self) -> EndedMotion:
        end = self._jog.end
        if end is not None and end.reason is Reason.DIVERTED:
            return _ended(end)  # it goes on with another command, perhaps without end
        rest = self._axis.wait(check=False)
        return _ended(rest if end is None else dataclasses.replace(end, position_u=rest.position_u))


def _jog(mic: Mic488, axis: int, velocity_u: float, hold_s: float) -> _AxisJog:
    return _AxisJog(mic.axis(axis), velocity_u, hold_s)


def _wait(mic: Mic488, axes: Collection[int], timeout_s: float | None) -> Sequence[EndedMotion]:
    return [_ended(end) for end in mic.wait(*axes, timeout_s=timeout_s, check=False).values()]


def _enable(mic: Mic488, axes: Collection[int], on: bool) -> None:
    (mic.enable if on else mic.disable)(*axes)


def _stop(address: DeviceAddress, log: Log | None, axes: Collection[int], program: bool) -> str | None:
    with opened(address, True, log) as mic:
        mic.stop(*axes)
        if program:
            mic.program.stop()
            return None
        return RUNS_ON if mic.program.state() == ProgramState.RUNNING else None


MIC488_DRIVER: DriverKind[Mic488] = DriverKind(
    name="mic488",
    title="a MIC488",
    axes=AXES,
    selection=AddressSelection(
        option="unit", variant="firmware", forms="unit=N, firmware=1.70, config=FILE", usual=1, has_config=True
    ),
    baud=BAUD,
    timeout_s=TIMEOUT_S,
    line=_line,
    part=_part,
    search=DeviceSearch(bauds=BAUDS, numbers=None, title="unit", form="d", find=_find, disturbs=True),
    decoding=Decoding(
        protocol="modbus",
        make=lambda sink, firmware, tcp: ModbusDecoder(sink, DEFAULT_FIRMWARE if firmware is None else firmware, tcp=tcp),
    ),
    opened=opened,
    info=overview,
    names=named.names,
    usual=named.USUAL,
    reading=named.reading,
    followed=named.followed,
    writing=named.writing,
    stop=_stop,
    enable=_enable,
    move=_move,
    home=_home,
    jog=_jog,
    wait=_wait,
    halt=lambda mic, axes: mic.stop(*axes),
    terminal=lambda address, show, log: Mic488Terminal(opened(address, True, log)),
    programs=(".prg", ".wbc"),
    cannot_send="the download protocol of the MIC488 is not documented. Compile it with 'steptwin build' and download the image "
    "with the vendor's tool, or run it in a twin with 'steptwin serve mic488 --program'. To send to an M1486, name it with "
    "--device",
)
