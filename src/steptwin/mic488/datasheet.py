"""The data sheet of a MIC488, from its register map and its configuration."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache

from steptwin.datasheet import Argument, AxisDescription, CommandDescription, Datasheet, Limits, Pin, PinDirection, PointEffect
from steptwin.mic488.axis import MAX_SPEED_P
from steptwin.mic488.core import ANALOG_PINS, ENABLE_PINS, INPUT_PINS, OUTPUT_PINS
from steptwin.mic488.details import DETAILS
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.events import EVENTS
from steptwin.mic488.points import EFFECTS, limits, points, unit_of
from steptwin.mic488.registermap import RegisterMap
from steptwin.mic488.registers import AXES, register_map
from steptwin.mic488.status import LIMIT

COORDINATES = 2**31
MOST_KEPT = 64
"""Controllers of one firmware with the same units share a data sheet."""
DEFAULT_SCALES = (("imp", 1.0),) * AXES


def datasheet(device: Mic488Device) -> Datasheet:
    """The data sheet of a configured controller."""
    return datasheet_of(device.firmware.name, tuple((axis.config.unit_name, axis.gear) for axis in device.axes))


@lru_cache(MOST_KEPT)
def datasheet_of(firmware: str, scales: tuple[tuple[str, float | None], ...] = DEFAULT_SCALES) -> Datasheet:
    """Data sheet of a firmware; ``scales`` are unit and pulses per unit of each axis, None where these are not known.
    Raises `Misuse` for one that is not known."""
    registers, units = register_map(firmware), [unit for unit, _ in scales]
    return Datasheet(
        kind="mic488",
        title="MIC488",
        variant=registers.firmware.name,
        axes=tuple(_axis(number, unit, gear) for number, (unit, gear) in enumerate(scales, start=1)),
        pins=tuple(PINS.values()),
        points=tuple(points(registers, units)),
        commands=tuple(_commands(registers, units)),
        events=tuple(EVENTS.values()),
        program_actions=("start", "pause", "stop"),
        end_switches_off=True,  # MIC-31
        details=tuple(row.detail for row in DETAILS),
        also_change=_ALSO_CHANGE,
    )


def _axis(number: int, unit: str, gear: float | None) -> AxisDescription:
    """Coordinates are whole numbers of 32 bits with a sign, in pulses (MIC-7); a distance may wrap (MIC-42)."""
    name = f"M{number}"
    axis = AxisDescription(
        number=number,
        name=name,
        unit=unit,
        pulses_per_unit=gear,
        round_p=2 * COORDINATES,
        velocity_point=f"{name}_VMAX",
        ramp_points=(f"{name}_ACC", f"{name}_DEC"),
        limit_codes=(int(LIMIT[-1]), int(LIMIT[1])),
    )
    if gear is None:
        return axis
    coordinates = Limits(-COORDINATES / gear, (COORDINATES - 1) / gear)
    return replace(axis, positions=coordinates, velocities=Limits(-MAX_SPEED_P / gear, MAX_SPEED_P / gear))


def _pins() -> Iterator[Pin]:
    for name in INPUT_PINS:
        yield Pin(name=name, direction=PinDirection.INPUT)
    for name in ANALOG_PINS:
        yield Pin(name=name, direction=PinDirection.INPUT, is_analog=True, unit="V", limits=Limits(0, 10))
    for name in (*OUTPUT_PINS, *ENABLE_PINS, "ERR"):
        yield Pin(name=name, direction=PinDirection.OUTPUT)


PINS: Mapping[str, Pin] = {pin.name: pin for pin in _pins()}
"""By name."""
_AXIS_NAMES = tuple(f"M{number}" for number in range(1, AXES + 1))
_ALSO_CHANGE: Mapping[str, tuple[str, ...]] = {
    **{pin: (f"M{number}",) for number, pin in enumerate(ENABLE_PINS, start=1)},
    **{name: ("status", *(other for other in _AXIS_NAMES if other != name)) for name in _AXIS_NAMES},
    "ERR": ("status",),
}
"""An axis may turn the encoder of another one."""


def _commands(registers: RegisterMap, units: Sequence[str]) -> Iterator[CommandDescription]:
    """Registers whose writing does something at once."""
    for register in registers:
        effect = EFFECTS[register.effect]
        if effect in (PointEffect.ACTS, PointEffect.MOVES):
            argument = Argument(
                name="value",
                type=register.kind.value,
                unit=unit_of(register, units),
                limits=limits(register.permitted),
                values=tuple(register.values),
            )
            yield CommandDescription(
                name=register.name,
                code=register.name,
                meaning=register.meaning,
                arguments=(argument,),
                effect=effect,
                source=register.section,
            )
