"""The data sheet of an M1486, from its command table, points and pins."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache

from steptwin.datasheet import (
    Argument,
    AxisDescription,
    CommandDescription,
    Datasheet,
    Limits,
    Pin,
    PinDirection,
    PointEffect,
)
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.commands import TABLE, ArgType, CommandSpec
from steptwin.m1486.commanduse import Motion
from steptwin.m1486.details import DETAILS
from steptwin.m1486.events import EVENTS
from steptwin.m1486.microsteps import FULL_STEP, UNIT
from steptwin.m1486.pins import CONTROL_PINS, LINE_PINS, OUTPUT_PINS, WAVEFORM
from steptwin.m1486.points import POINTS
from steptwin.m1486.variants import Variant

MOTION_SECTION = "VII.2"
_ALSO_CHANGE = {
    "M1": ("status", "program", "pins", "details"),
    WAVEFORM: ("pins",),
    "LIMIT": ("status", "program"),
    "SD": ("status", "program"),
}
"""Signals of the driver are pins without edges, and the counter is a detail."""
ACTIVE_LOW = frozenset({"JOG", "LIMIT", "SD", "S&D", "DUAL", "BOOST"})


def datasheet(chip: M1486Chip) -> Datasheet:
    return datasheet_of(chip.variant)


@cache
def datasheet_of(variant: Variant) -> Datasheet:
    return Datasheet(
        kind="m1486",
        title="M1486",
        variant=variant.name,
        axes=(axis(variant, UNIT, 1.0),),
        pins=tuple(pins_of(variant).values()),
        points=tuple(POINTS.values()),
        commands=tuple(_command(spec, variant) for spec in TABLE),
        events=tuple(EVENTS.values()),
        program_actions=("stop",),
        details=tuple(row.detail for row in DETAILS),
        also_change=_ALSO_CHANGE,
    )


@cache
def pins_of(variant: Variant) -> Mapping[str, Pin]:
    """By name."""
    return {pin.name: pin for pin in _pins(variant)}


def axis(variant: Variant, unit: str, pulses_per_unit: float) -> AxisDescription:
    """The axis in a unit of some minimum microsteps: positions of G, distances of F and B, velocities of V."""
    numbers = {spec.key: spec.permitted(variant) for spec in TABLE}
    fastest = numbers["V"][-1] * FULL_STEP * variant.clock / pulses_per_unit
    farthest = numbers["F"][-1] / pulses_per_unit
    return AxisDescription(
        number=1,
        name="M1",
        unit=unit,
        pulses_per_unit=pulses_per_unit,
        positions=Limits(0, numbers["G"][-1] / pulses_per_unit),
        distances=Limits(-farthest, farthest),
        velocities=Limits(-fastest, fastest),
    )


def _pins(variant: Variant) -> Iterator[Pin]:
    numbers = {spec.key: spec.permitted(variant) for spec in TABLE}
    for name in LINE_PINS:
        yield Pin(name=name, direction=PinDirection.BOTH, is_active_low=True)
    for name in CONTROL_PINS:
        yield Pin(name=name, direction=PinDirection.INPUT, is_active_low=name in ACTIVE_LOW)
    for name in OUTPUT_PINS:
        yield Pin(name=name, direction=PinDirection.OUTPUT, is_active_low=name in ACTIVE_LOW)
    waveforms = numbers[WAVEFORM]
    yield Pin(name=WAVEFORM, direction=PinDirection.OUTPUT, is_analog=True, limits=Limits(waveforms[0], waveforms[-1]))


def _command(spec: CommandSpec, variant: Variant) -> CommandDescription:
    permitted = spec.permitted(variant)
    arguments: tuple[Argument, ...] = ()
    if spec.kind is not ArgType.NONE:
        is_range = isinstance(permitted, range)
        arguments = (
            Argument(
                name=spec.kind.value,
                type="whole number",
                unit=spec.unit,
                limits=Limits(permitted[0], permitted[-1]) if permitted else None,
                values=() if is_range else tuple(permitted),
            ),
        )
    # The others of the section on motions set the next motion.
    effect = PointEffect.PARAMETER if spec.section == MOTION_SECTION else PointEffect.ACTS
    if spec.use.motion is not Motion.NONE:
        effect = PointEffect.MOVES
    return CommandDescription(
        name=spec.name,
        code=spec.key,
        meaning=f"{spec.effect} ({spec.when.value})",
        arguments=arguments,
        effect=effect,
        source=spec.section,
    )
