"""The kind of the MIC488 for programs that use its drivers: `MIC488_DRIVER`."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Callable, Collection, Generator, Sequence
from types import TracebackType
from typing import Any

from steptwin.controller import SECOND
from steptwin.drivers.blocking import finish
from steptwin.drivers.kind import (
    AddressSelection,
    Decoding,
    DeviceAddress,
    DeviceMotion,
    DeviceOverview,
    DeviceSearch,
    DriverKind,
    EndedMotion,
    FoundDevice,
    Log,
    ReadValues,
    WantedMoves,
)
from steptwin.drivers.line import DriverLine
from steptwin.drivers.mic488 import named
from steptwin.drivers.mic488.conversation import Mic488Terminal
from steptwin.drivers.mic488.decoder import ModbusDecoder
from steptwin.drivers.mic488.driver import TIMEOUT_S, AsyncMic488, Mic488Status
from steptwin.drivers.mic488.identify import scan
from steptwin.drivers.mic488.lines import AsyncModbusLine
from steptwin.drivers.mic488.motion import MoveEnd, Reason, status_text
from steptwin.drivers.mic488.program import ProgramState
from steptwin.drivers.mic488.subject import Mic488Part
from steptwin.drivers.mic488.sync import Mic488, Mic488Axis, Mic488Jog, ModbusLine
from steptwin.drivers.tcp import Endpoint
from steptwin.drivers.typed import tied
from steptwin.errors import Misuse
from steptwin.mic488.registers import AXES, CONTROLLER_STATUS_TEXTS, DEFAULT_FIRMWARE, register_map
from steptwin.wire.frameline import FrameLine

RUNS_ON = "the program in the controller runs on and may move the axes again: --program ends it"
_EVERY_UNIT = "; every unit number is answered here, so several of them may be one device"
_PROGRAM = {0: "stopped", 1: "running", 2: "paused"}


class Mic488Search(DeviceSearch):
    bauds = (38400, 9600, 19200, 57600, 115200)
    numbers = None
    title = "unit"
    form = "d"
    disturbs = True

    def find(
        self, place: str, baud: int, numbers: Sequence[int], timeout_s: float, progress: Callable[[int], object]
    ) -> Sequence[FoundDevice]:
        with ModbusLine(place, baud=baud) as line:
            found = finish(scan(line.line, numbers, timeout_ns=round(timeout_s * SECOND), progress=progress))
        return [
            FoundDevice(
                one.unit,
                one.firmware,
                f"{'responds, but is not a MIC488' if one.firmware is None else f'MIC488, firmware {one.firmware}'}"
                f"{_EVERY_UNIT if one.every_unit else ''}",
            )
            for one in found
        ]


class Mic488Decoding(Decoding):
    protocol = "modbus"

    def make(self, sink: Callable[[FrameLine], None], variant: str | None, tcp: bool) -> ModbusDecoder:
        return ModbusDecoder(sink, DEFAULT_FIRMWARE if variant is None else variant, tcp=tcp)


class Mic488Driver(DriverKind[Mic488]):
    name = "mic488"
    title = "a MIC488"
    axes = AXES
    selection = AddressSelection(
        option="unit", variant="firmware", forms="unit=N, firmware=1.70, config=FILE", usual=1, has_config=True
    )
    baud = 38400
    timeout_s = TIMEOUT_S
    usual = named.USUAL
    search = Mic488Search()
    decoding = Mic488Decoding()
    programs = (".prg", ".wbc")
    cannot_send = (
        "the download protocol of the MIC488 is not documented. Compile it with 'steptwin build' and download the image "
        "with the vendor's tool, or run it in a twin with 'steptwin serve mic488 --program'. To send to an M1486, name it with "
        "--device"
    )

    def line(self, place: str | Endpoint, baud: int) -> DriverLine[Any, Any]:
        return AsyncModbusLine(place, baud=baud)

    async def part(self, address: DeviceAddress, line: DriverLine[Any, Any]) -> Mic488Part:
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

    @contextlib.contextmanager
    def opened(self, address: DeviceAddress, observe: bool, log: Log | None) -> Generator[Mic488]:
        """As `DriverKind.opened`; an observing driver leaves DATA_TYPE as it is."""
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

    def info(self, driver: Mic488, address: DeviceAddress) -> DeviceOverview:
        status = driver.status()
        data_type = "DINT" if driver.get("DATA_TYPE")["DATA_TYPE"] else "REAL"
        firmwares = [driver.firmware] if address.variant is not None else _firmwares(driver.firmware, status)
        program = _PROGRAM.get(status.program, str(status.program))
        axes = [
            {
                "axis": number,
                "position": position,
                "velocity": velocity,
                "unit": unit,
                "status": code,
                "meaning": status_text(code),
            }
            for number, position, velocity, unit, code in zip(
                range(1, 5), status.positions, status.velocities, status.units, status.axes, strict=True
            )
        ]
        data = {
            "device": driver.place,
            "unit": driver.unit,
            "firmware": driver.firmware,
            "firmware_may_be": firmwares,
            "data_type": data_type,
            "status": status.controller,
            "program": program,
            "axes": axes,
            "inputs": list(status.inputs),
            "outputs": list(status.outputs),
        }
        state = "" if status.controller is None else f", {CONTROLLER_STATUS_TEXTS.get(status.controller, status.controller)}"
        head = (
            f"MIC488, unit {driver.unit} at {driver.place}, firmware {' or '.join(firmwares)}{state}",
            f"program {program}, values travel as {data_type}",
        )
        rows = [
            (f"M{a['axis']}", a["position"], a["unit"], a["velocity"], f"{a['unit']}/s", a["status"], a["meaning"]) for a in axes
        ]
        return DeviceOverview(
            data, head, rows, (f"inputs on:  {_on('IN', status.inputs)}", f"outputs on: {_on('OUT', status.outputs)}")
        )

    def names(self) -> Sequence[str]:
        return [register.name for register in register_map()]

    def reading(self, names: Sequence[str]) -> Callable[[Mic488], ReadValues]:
        return lambda mic: named.read(mic, names)

    def followed(self, names: Sequence[str], variant: str | None) -> Sequence[str] | None:
        """The registers of a twin with these names; None if addresses are among them."""
        found = named.expanded(register_map(variant or DEFAULT_FIRMWARE), names or self.usual)
        by_name = [one for one in found if isinstance(one, str)]
        return by_name if len(by_name) == len(found) else None

    def writing(self, changes: Sequence[str]) -> Callable[[Mic488], ReadValues]:
        return named.writing(changes)

    def stop(self, address: DeviceAddress, log: Log | None, axes: Collection[int], program: bool) -> str | None:
        with self.opened(address, True, log) as mic:
            mic.stop(*axes)
            if program:
                mic.program.stop()
                return None
            return RUNS_ON if mic.program.state() == ProgramState.RUNNING else None

    def enable(self, driver: Mic488, axes: Collection[int], on: bool) -> None:
        (driver.enable if on else driver.disable)(*axes)

    def move(self, moves: WantedMoves) -> DeviceMotion[Mic488]:
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

    def home(self, texts: Sequence[str]) -> DeviceMotion[Mic488]:
        velocities = tied(texts, AXES)

        def begin(mic: Mic488, begun: set[int], check: Callable[[], object]) -> None:
            for axis, velocity in velocities.items():
                check()
                mic.axis(axis).home(velocity)
                begun.add(axis)

        return DeviceMotion(tuple(velocities), begin)

    def jog(self, driver: Mic488, axis: int, velocity: float, hold_s: float) -> _AxisJog:
        return _AxisJog(driver.axis(axis), velocity, hold_s)

    def wait(self, driver: Mic488, axes: Collection[int], timeout_s: float | None) -> Sequence[EndedMotion]:
        return [_ended(end) for end in driver.wait(*axes, timeout_s=timeout_s, check=False).values()]

    def halt(self, driver: Mic488, axes: Collection[int]) -> None:
        driver.stop(*axes)

    def terminal(self, address: DeviceAddress, show: Callable[[str], object], log: Log | None) -> Mic488Terminal:
        return Mic488Terminal(self.opened(address, True, log))


def of_mic488(address: DeviceAddress, what: str) -> DeviceAddress:
    """The address, for what only a MIC488 has. Raises `Misuse` for another kind of device."""
    if address.kind != MIC488_DRIVER.name:
        raise Misuse(f"{what} is for {MIC488_DRIVER.title}; {address.place} is of kind {address.kind}")
    return address


def unit_of(address: DeviceAddress) -> int:
    """The slave address; 1 if none is given."""
    return 1 if address.number is None else address.number


def _firmwares(found: str, status: Mic488Status) -> list[str]:
    """The firmwares that answer as the one that was found: 1.40 has the addresses of 1.70, and its M_STATUS is always 0."""
    return ["1.70", "1.40"] if found == "1.70" and not status.controller else [found]


def _on(name: str, states: tuple[bool, ...]) -> str:
    return " ".join(f"{name}{number}" for number, on in enumerate(states, start=1) if on) or "none"


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


class _AxisJog:
    """See `steptwin.drivers.kind.DeviceDeadManJog`."""

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


MIC488_DRIVER = Mic488Driver()
