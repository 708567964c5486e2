"""The scale of an axis: from its description, otherwise from the configuration of its controller."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

from steptwin.errors import Misuse
from steptwin.motion.trig import PI
from steptwin.simulation.mechanics.motor import Burden

FULL_STEPS = 200
"""Default full steps per revolution of a motor."""
PULSES = "imp"
"""Default unit of an axis."""
LENGTHS: Mapping[str, Fraction] = {"mm": Fraction(1, 1000), "cm": Fraction(1, 100), "m": Fraction(1)}
"""In metres."""
TURNS: Mapping[str, Fraction] = {"rev": Fraction(1), "degree": Fraction(1, 360)}
"""In revolutions."""


@lru_cache(maxsize=4096)
def exact_fraction(units: float) -> Fraction:
    """A number as it is written."""
    return Fraction(str(units))


@dataclass(frozen=True, slots=True)
class Scale:
    """Pulses of the drive per unit of the axis, and per revolution of its motor."""

    unit: str
    pulses_per_unit: Fraction
    pulses_per_rev: int
    full_steps: int

    def nearest(self, units: float) -> int:
        """The pulse nearest to a position."""
        scale, exact = self.pulses_per_unit, exact_fraction(units)
        below = scale.denominator * exact.denominator
        return (2 * scale.numerator * exact.numerator + below) // (2 * below)

    def pulses(self, units: float) -> Fraction:
        return exact_fraction(units) * self.pulses_per_unit

    @property
    def period_p(self) -> int:
        """Pulses of an electrical period: four full steps."""
        return max(1, round(4 * self.pulses_per_rev / self.full_steps))

    @property
    def turn(self) -> Fraction | None:
        """Pulses per revolution of the axis itself; None if its unit is not an angle."""
        revs = TURNS.get(self.unit)
        return None if revs is None else self.pulses_per_unit / revs


@dataclass(frozen=True, slots=True, kw_only=True)
class GivenScale:
    """Scale as the table of an axis gives it; None for the rest."""

    controller: str
    """The controller of the axis, for messages."""
    is_rotary: bool
    unit: str | None
    pulses_per_unit: float | None
    pitch: float | None
    pulses_per_rev: int | None
    full_steps: int | None
    """Full steps of its motor per revolution."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveScale:
    """How a controller counts the position of an axis."""

    pulses_per_rev: int
    """Pulses per revolution of the motor: from the description, otherwise from the configuration of the controller."""
    full_steps: int
    """Full steps of the motor per revolution."""
    unit: str | None = None
    """The unit in the configuration of the controller; None if it has pulses only."""
    pulses_per_unit: Fraction = Fraction(1)
    text: str
    """The counted quantity, for messages: ``counts minimum microsteps``."""


def scale_of(given: GivenScale, drive: DriveScale) -> Scale:
    """The scale of an axis; the description takes precedence over the configuration of the controller. Raises `Misuse` for a unit
    without a scale."""
    unit, per_unit = _per_unit(given, drive)
    return Scale(unit, per_unit, drive.pulses_per_rev, drive.full_steps)


def _per_unit(given: GivenScale, drive: DriveScale) -> tuple[str, Fraction]:
    is_rotary = given.is_rotary
    usual = "degree" if is_rotary else "mm"
    unit = usual if given.unit is None else given.unit
    if given.pulses_per_unit is not None:
        return unit, exact_fraction(given.pulses_per_unit)
    if given.pitch is not None:
        return unit, Fraction(drive.pulses_per_rev) / exact_fraction(given.pitch)
    if drive.unit is not None and (given.pulses_per_rev is None or not is_rotary):
        configured = drive.unit
        wanted = configured if given.unit is None and not is_rotary else unit
        for kin in (LENGTHS, TURNS, {configured: Fraction(1)}):
            if wanted in kin and configured in kin:
                return wanted, drive.pulses_per_unit * kin[wanted] / kin[configured]
    if is_rotary and unit in TURNS:
        return unit, drive.pulses_per_rev * TURNS[unit]
    if given.unit is None and not is_rotary:
        return PULSES, Fraction(1)
    raise Misuse(f"unit = {unit!r}: give pulses_per_unit or pitch, for {given.controller} {drive.text}")


def _arm(scale: Scale, what: str) -> float:
    """Metres per radian of the motor. Raises `Misuse` for a unit that is not a length."""
    metres = LENGTHS.get(scale.unit)
    if metres is None:
        raise Misuse(f"{what}: mass and forces need a unit of {', '.join(LENGTHS)}, not {scale.unit!r}")
    return float(scale.pulses_per_rev / scale.pulses_per_unit * metres) / (2.0 * PI)


class Loading(NamedTuple):
    """Load of a motor: at the motor in kg·m² and N·m, on a linear axis also in kg and N."""

    inertia: float = 0.0
    mass: float = 0.0
    friction: float = 0.0
    friction_force: float = 0.0
    load: float = 0.0
    force: float = 0.0


def burden_of(loading: Loading, scale: Scale, what: str) -> Burden:
    """Burden of a motor, in pulses. Raises `Misuse` for masses and forces on an axis whose unit is not a length."""
    has_forces = loading.mass or loading.force or loading.friction_force
    arm = _arm(scale, what) if has_forces else 0.0
    inertia = loading.inertia + loading.mass * arm * arm
    return Burden(
        inertia=inertia * 2.0 * PI / float(scale.pulses_per_rev),
        friction=loading.friction + loading.friction_force * arm,
        load=loading.load + loading.force * arm,
    )
