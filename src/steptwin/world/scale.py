"""The scale of an axis: from its description, otherwise from the configuration of its controller."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

from steptwin.errors import Misuse
from steptwin.motion.trig import PI
from steptwin.world.motor import Burden, StepperMotor
from steptwin.world.resonance import Resonance

if TYPE_CHECKING:
    from steptwin.world.elements.axis import AxisSpec
    from steptwin.world.elements.motor import MotorSpec

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
class DriveScale:
    """How a controller counts the position of an axis."""

    pulses_per_rev: int
    """Of the motor: from the description, otherwise from the configuration of the controller."""
    full_steps: int
    """Of the motor, per revolution."""
    unit: str | None = None
    """The unit in the configuration of the controller; None if it has pulses only."""
    pulses_per_unit: Fraction = Fraction(1)
    text: str
    """The counted quantity, for messages: ``counts minimum microsteps``."""


def scale_of(spec: AxisSpec, drive: DriveScale) -> Scale:
    """The scale of an axis; the description takes precedence over the configuration of the controller. Raises `Misuse` for a unit
    without a scale."""
    unit, per_unit = _per_unit(spec, drive)
    return Scale(unit, per_unit, drive.pulses_per_rev, drive.full_steps)


def _per_unit(spec: AxisSpec, drive: DriveScale) -> tuple[str, Fraction]:
    is_rotary = spec.kind == "rotary"
    usual = "degree" if is_rotary else "mm"
    unit = usual if spec.unit is None else spec.unit
    if spec.pulses_per_unit is not None:
        return unit, exact_fraction(spec.pulses_per_unit)
    if spec.pitch is not None:
        return unit, Fraction(drive.pulses_per_rev) / exact_fraction(spec.pitch)
    if drive.unit is not None and (spec.pulses_per_rev is None or not is_rotary):
        configured = drive.unit
        wanted = configured if spec.unit is None and not is_rotary else unit
        for kin in (LENGTHS, TURNS, {configured: Fraction(1)}):
            if wanted in kin and configured in kin:
                return wanted, drive.pulses_per_unit * kin[wanted] / kin[configured]
    if is_rotary and unit in TURNS:
        return unit, drive.pulses_per_rev * TURNS[unit]
    if spec.unit is None and not is_rotary:
        return PULSES, Fraction(1)
    raise Misuse(f"unit = {unit!r}: give pulses_per_unit or pitch, for {spec.drive[0]} {drive.text}")


def _arm(scale: Scale, what: str) -> float:
    """Metres per radian of the motor. Raises `Misuse` for a unit that is no length."""
    metres = LENGTHS.get(scale.unit)
    if metres is None:
        raise Misuse(f"{what}: mass and forces need a unit of {', '.join(LENGTHS)}, not {scale.unit!r}")
    return float(scale.pulses_per_rev / scale.pulses_per_unit * metres) / (2.0 * PI)


class Loading(NamedTuple):
    """What a motor moves: at the motor in kg·m² and N·m, on a linear axis also in kg and N."""

    inertia: float = 0.0
    mass: float = 0.0
    friction: float = 0.0
    friction_force: float = 0.0
    load: float = 0.0
    force: float = 0.0


def burden_of(loading: Loading, scale: Scale, what: str) -> Burden:
    """What that is for a motor, in pulses. Raises `Misuse` for masses and forces on an axis whose unit is no length."""
    has_forces = loading.mass or loading.force or loading.friction_force
    arm = _arm(scale, what) if has_forces else 0.0
    inertia = loading.inertia + loading.mass * arm * arm
    return Burden(
        inertia=inertia * 2.0 * PI / float(scale.pulses_per_rev),
        friction=loading.friction + loading.friction_force * arm,
        load=loading.load + loading.force * arm,
    )


def motor_of(motor: MotorSpec, scale: Scale) -> StepperMotor:
    """Torques at the motor; speeds and accelerations in pulses. Raises `Misuse` for masses and forces without a length."""
    per_rev = float(scale.pulses_per_rev)
    loading = Loading(motor.inertia, motor.mass, motor.friction, motor.friction_force, motor.load, motor.force)
    own = burden_of(loading, scale, "motor")
    return StepperMotor(
        curve=tuple((speed / 60.0 * per_rev, torque) for speed, torque in motor.torque),
        inertia=own.inertia,
        friction=own.friction,
        load=own.load,
        start_p=None if motor.start_speed is None else motor.start_speed / 60.0 * per_rev,
        detent=motor.detent,
        hold=motor.hold_current,
        hold_ns=motor.hold_delay,
        overruns=motor.overruns,
        resonance=None if motor.resonance is None else _resonance(motor, *motor.resonance, per_rev),
    )


def _resonance(motor: MotorSpec, low: float, high: float, per_rev: float) -> Resonance:
    return Resonance(low / 60.0 * per_rev, high / 60.0 * per_rev, motor.resonance_growth, motor.resonance_fading, motor.vibration)
