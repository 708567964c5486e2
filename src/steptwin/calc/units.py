"""Units of distance, and how many pulses they are: from the mechanics of an axis, or from its GEAR.

The pulse is what the controller counts: the pulse (imp) of a MIC488, the minimum microstep (full step/64) of an M1486.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from math import isfinite
from types import MappingProxyType

from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.nearmiss import NearMiss
from steptwin.numerals import read_number


class Dimension(Enum):
    """Dimension of a quantity. The value is its unit's suffix behind a unit of distance."""

    DISTANCE = ""
    SPEED = "/s"
    ACCELERATION = "/s²"
    TIME = "s"


PULSE, STEP, REV, DEGREE, MM, CM, M = "imp", "step", "rev", "degree", "mm", "cm", "m"
UNITS = (PULSE, STEP, REV, DEGREE, MM, CM, M)
_ALIASES = {"pulse": PULSE, "pulses": PULSE, "microstep": PULSE, "microsteps": PULSE, "steps": STEP, "deg": DEGREE, "°": DEGREE}
_OF_TIME = {"s": 1.0, "ms": 1e-3, "min": 60.0}
_IN_REV = {REV: 1.0, DEGREE: 1.0 / 360.0}
_IN_MM = {MM: 1.0, CM: 10.0, M: 1000.0}
LARGEST_RATIO = 1e6
_TEXT = re.compile(r"([+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:e[+-]?\d{1,3})?) *(\S*)\Z", re.ASCII | re.IGNORECASE)


RATIO_OUT_OF_RANGE = Message(
    "calc.ratio-out-of-range", "{name} = {value:g}{unit}: permitted are numbers above 0, up to {most:g}{unit}"
)


def _positive(name: str, value: float, unit: str) -> None:
    if not (isfinite(value) and 0.0 < value <= LARGEST_RATIO):
        raise Misuse(RATIO_OUT_OF_RANGE(name=name, value=value, unit=unit, most=LARGEST_RATIO))


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveMechanics:
    """Mechanics that turn pulses into motion."""

    motor_steps: float = 200.0
    """Full steps in a revolution of the motor: 200 for 1.8°."""
    microsteps: float = 1.0
    """Pulses in a full step, as the drive is set; 64 for an M1486."""
    ratio: float = 1.0
    """Revolutions of the motor for one revolution of its load."""
    lead: float | None = None
    """Travel in one revolution of the load [mm]: lead of a screw, teeth × pitch of a pulley. None: a rotary axis."""

    def scale(self) -> UnitScale:
        """Pulses in each unit. Raises `Misuse` for numbers that are out of range."""
        _positive("motor steps", self.motor_steps, " step/rev")
        _positive("microsteps", self.microsteps, "/step")
        _positive("gear ratio", self.ratio, "")
        rev = self.motor_steps * self.microsteps * self.ratio
        pulses = {PULSE: 1.0, STEP: self.microsteps, **{unit: rev * part for unit, part in _IN_REV.items()}}
        if self.lead is not None:
            _positive("lead", self.lead, " mm/rev")
            pulses |= {unit: rev / self.lead * part for unit, part in _IN_MM.items()}
        return UnitScale(MappingProxyType(pulses))


GEAR_OUT_OF_RANGE = Message("calc.gear-out-of-range", "gear = {gear:g} pulses/{unit}: permitted are numbers above 0")
A_LEAD = Message("calc.a-lead", "the lead [mm/rev]")
STEPS = Message("calc.steps", "the motor's steps in a revolution and its microsteps")
UNIT_NEEDS_MECHANICS = Message("calc.unit-needs-mechanics", "{unit} is not known in pulses: give {need}; known are {names}")


@dataclass(frozen=True, slots=True)
class UnitScale:
    """Pulses in each unit of distance that is known."""

    pulses: Mapping[str, float]

    @classmethod
    def of_gear(cls, unit: str, gear: float) -> UnitScale:
        """From GEAR, the pulses in one unit; the units that follow from it are known, too. Raises `Misuse`."""
        unit = unit_of(unit)
        if not (isfinite(gear) and gear > 0.0):
            raise Misuse(GEAR_OUT_OF_RANGE(gear=gear, unit=unit))
        pulses = {PULSE: 1.0, unit: gear}
        for family in (_IN_REV, _IN_MM):
            if unit in family:
                pulses |= {other: gear / family[unit] * part for other, part in family.items()}
        return cls(MappingProxyType(pulses))

    def in_pulses(self, unit: str) -> float:
        """Pulses in one ``unit``: its GEAR. Raises `Misuse` for a unit that is not known, or needs mechanics."""
        known = unit_of(unit)
        if known not in self.pulses:
            raise Misuse(UNIT_NEEDS_MECHANICS(unit=unit, need=A_LEAD() if known in _IN_MM else STEPS(), names=list(self.pulses)))
        return self.pulses[known]


UNKNOWN_UNIT = Message("calc.unknown-unit", "no unit {text!r}{hint}: units are {names}")


def unit_of(text: str) -> str:
    """The unit of distance of a name. Raises `Misuse` with those that there are."""
    name = _ALIASES.get(text.strip().lower(), text.strip().lower())
    if name not in UNITS:
        raise Misuse(UNKNOWN_UNIT(text=text, hint=NearMiss().hint(text, (*UNITS, *_ALIASES)), names=list(UNITS)))
    return name


NO_LENGTH = Message("calc.no-length", "{text!r} is not a length: units are {names}")


def read_lead(text: str) -> float:
    """The travel in one revolution, mm; a number without a unit is in mm. Raises `Misuse`."""
    value, unit = read_quantity(text, Dimension.DISTANCE)
    if unit is not None and unit not in _IN_MM:
        raise Misuse(NO_LENGTH(text=text, names=list(_IN_MM)))
    return value if unit is None else value * _IN_MM[unit]


NO_QUANTITY = Message("calc.no-quantity", "{text!r} is not a number with a unit: expected such as {examples}")
NO_TIME = Message("calc.no-time", "{text!r} is not a time: units are {names}")
OTHER_DIMENSION = Message("calc.other-dimension", "{text!r} has the unit of something else: expected such as {examples}")


def read_quantity(text: str, dimension: Dimension) -> tuple[float, str | None]:
    """A number with its unit of distance (None: none was given), such as ``150 mm``, ``2.5rev/s``, ``600 rpm``; of time in
    seconds. Raises `Misuse` for what is none of this dimension."""
    match = _TEXT.match(text.strip())
    if match is None:
        raise Misuse(NO_QUANTITY(text=text, examples=_EXAMPLES[dimension]))
    value, suffix = read_number(match[1]), match[2].lower().replace("s2", "s²").replace("s^2", "s²")
    if not suffix:
        return value, None
    if dimension is Dimension.TIME:
        if suffix not in _OF_TIME:
            raise Misuse(NO_TIME(text=text, names=list(_OF_TIME)))
        return value * _OF_TIME[suffix], None
    if dimension is Dimension.SPEED and suffix == "rpm":
        return value / 60.0, REV
    name, slash, per = suffix.partition("/")
    if slash + per != dimension.value:
        raise Misuse(OTHER_DIMENSION(text=text, examples=_EXAMPLES[dimension]))
    return value, unit_of(name)


_EXAMPLES = {
    Dimension.DISTANCE: "150mm, 2.5rev, 3200imp",
    Dimension.SPEED: "60mm/s, 2.5rev/s, 600rpm",
    Dimension.ACCELERATION: "300mm/s2, 20rev/s2",
    Dimension.TIME: "2s, 250ms",
}
