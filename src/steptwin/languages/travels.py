"""Switches KL and KR for a MIC488 that runs a single program: placed by ``--travel``, or assumed where homing needs them."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import NamedTuple

from steptwin.errors import Misuse
from steptwin.mic488.config import AxisConfig, ControllerConfig
from steptwin.mic488.registers import AXES, INPUTS
from steptwin.numerals import read_number, read_whole
from steptwin.simulation.describe.generated_mic488 import AxisSwitches
from steptwin.wbc.real import real_text

ASSUMED_TRAVEL_S = 0.1
"""Distance of an assumed homing switch from the position at power-on, as travel time at VMAX, s."""
ASSUMED_FAR_S = 10.0
"""The same for KR if a program homes to both sides, so that there is travel between the switches."""


class SwitchTravel(NamedTuple):
    """Positions of the switches of ``axis`` (from 1) in configured units, relative to that at power-on; None: no switch."""

    axis: int
    low_u: float | None
    high_u: float | None


class PlacedSwitches(NamedTuple):
    """The switches of a run. ``assumed``: texts about switches that were not placed; ``pins``: inputs driven by switches or by
    the run."""

    switches: Sequence[AxisSwitches]
    assumed: Sequence[str]
    pins: frozenset[str]


def place_switches(
    config: ControllerConfig, travels: Sequence[SwitchTravel], homed: Mapping[int, frozenset[int]], driven: Collection[str]
) -> PlacedSwitches:
    """Place switches from ``travels``; for axes not named there, assume those that ``homed`` (`homing_sides`) needs.

    No switch is assumed on a pin in ``driven``. Raises `Misuse` for a switch without an input in the configuration.
    """
    known = {travel.axis: travel for travel in travels}
    switches: list[AxisSwitches] = []
    assumed: list[str] = []
    for number, axis in enumerate(config.axes, start=1):
        travel = known.get(number)
        if travel is None:
            travel = _assumed(number, axis, homed.get(number, frozenset()), driven)
            assumed += _texts(travel, axis)
        if travel.low_u is None and travel.high_u is None:
            continue
        for name, pin, edge in (("KL", axis.in_kl, travel.low_u), ("KR", axis.in_kr, travel.high_u)):
            if edge is not None and pin >= INPUTS:
                without = _without(travel, axis)
                raise Misuse(f"--travel M{number}: the configuration has no {name} for this axis{without}")
        low, high = (_contact(config, pin) for pin in (axis.in_kl, axis.in_kr))
        pins = f"IN{axis.in_kl + 1}", f"IN{axis.in_kr + 1}"
        switches.append(AxisSwitches(number, travel.low_u, travel.high_u, *pins, (low, high)))
    pins = {pin for one in switches for pin, edge in ((one.low_pin, one.low), (one.high_pin, one.high)) if edge is not None}
    return PlacedSwitches(switches, assumed, frozenset(pins | set(driven)))


def _without(travel: SwitchTravel, axis: AxisConfig) -> str:
    """The option without switches that have no input, as the end of a sentence; nothing if none is left."""
    low, high = (
        "" if edge is None or pin >= INPUTS else f"{edge:g}"
        for pin, edge in ((axis.in_kl, travel.low_u), (axis.in_kr, travel.high_u))
    )
    return f"; --travel M{travel.axis}={low}..{high} has the other switch only" if low or high else ""


def _contact(config: ControllerConfig, pin: int) -> str:
    return "NC" if pin < INPUTS and config.inputs[pin].level == 1 else "NO"


def _assumed(number: int, axis: AxisConfig, sides: frozenset[int], driven: Collection[str]) -> SwitchTravel:
    """The assumed positions of KL and KR for an axis that is homed to ``sides``."""
    has_kl, has_kr = (pin < INPUTS and f"IN{pin + 1}" not in driven for pin in (axis.in_kl, axis.in_kr))
    if 0 in sides:
        sides |= {-1 if has_kl else 1}
    low_u = -axis.vel * ASSUMED_TRAVEL_S if has_kl and -1 in sides else None
    high_u = None
    if has_kr and 1 in sides:
        high_u = axis.vel * (ASSUMED_FAR_S if -1 in sides else ASSUMED_TRAVEL_S)
    return SwitchTravel(number, low_u, high_u)


def _texts(travel: SwitchTravel, axis: AxisConfig) -> Iterator[str]:
    for name, pin, edge_u in (("KL", axis.in_kl, travel.low_u), ("KR", axis.in_kr, travel.high_u)):
        if edge_u is not None:
            where = f"{real_text(edge_u)} {axis.unit_name}"
            example = f"--travel M{travel.axis}={'LOW..' if name == 'KL' else '..HIGH'} changes it"
            yield f"M{travel.axis}: {name} on IN{pin + 1} assumed at {where} ({example})"


def parse_travel(text: str) -> list[SwitchTravel]:
    """``M1=-10..250,M2=-5..`` → switches of axes. Raises `Misuse`."""
    travels: list[SwitchTravel] = []
    for part in filter(None, map(str.strip, text.split(","))):
        name, _, ends = part.partition("=")
        low, dots, high = ends.partition("..")
        number = read_whole(name.strip().upper().removeprefix("M"))
        try:
            low_u, high_u = (read_number(end) if end.strip() else None for end in (low, high))
        except Misuse as error:
            raise Misuse(f"--travel {part}: {error}") from None
        if not dots or number is None or not 1 <= number <= AXES:
            raise Misuse(f"--travel {part}: expected Mn=LOW..HIGH, such as M1=-10..250 or M1=-10..")
        if low_u is not None and high_u is not None and low_u >= high_u:
            raise Misuse(f"--travel {part}: {real_text(low_u)} must be below {real_text(high_u)}")
        travels.append(SwitchTravel(number, low_u, high_u))
    return travels
