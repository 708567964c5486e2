"""How far an axis goes with a pulse: from what its description says, else from what its controller is told.

An M1486 counts minimum microsteps, 64 in a full step whatever M and Q are (chapter VII.2, Forward; hints).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from math import floor

from steptwin.errors import Misuse
from steptwin.m1486.chip import M1486
from steptwin.m1486.microsteps import FULL_STEP
from steptwin.mic488.device import Mic488
from steptwin.motion.trig import PI
from steptwin.world.motor import Motor
from steptwin.world.spec import AxisSpec, MotorSpec

FULL_STEPS = 200
"""Of a motor about which nothing is said."""
PULSES = "imp"
"""The unit of an axis about which nothing is said."""
LENGTHS: Mapping[str, Fraction] = {"mm": Fraction(1, 1000), "cm": Fraction(1, 100), "m": Fraction(1)}
"""In metres."""
TURNS: Mapping[str, Fraction] = {"rev": Fraction(1), "degree": Fraction(1, 360)}
"""In revolutions."""


@dataclass(frozen=True, slots=True)
class Scale:
    """Pulses of the drive (M1486: minimum microsteps) in a unit of the axis, and in a revolution of its motor."""

    unit: str
    pulses_per_unit: Fraction
    pulses_per_rev: int
    full_steps: int

    def nearest(self, units: float) -> int:
        """The pulse nearest to a position."""
        return floor(self.pulses(units) + Fraction(1, 2))

    def pulses(self, units: float) -> Fraction:
        return Fraction(str(units)) * self.pulses_per_unit

    @property
    def period_p(self) -> int:
        """Pulses of an electrical period: four full steps."""
        return max(1, round(4 * self.pulses_per_rev / self.full_steps))

    @property
    def turn(self) -> Fraction | None:
        """Pulses in a turn of the axis itself, where its unit says what that is."""
        revs = TURNS.get(self.unit)
        return None if revs is None else self.pulses_per_unit / revs


def scale_of(spec: AxisSpec, machine: Mic488 | M1486, number: int) -> Scale:
    """The scale of an axis that ``machine`` drives as its axis ``number``. Raises `Misuse` where a unit has none."""
    full_steps = None if spec.motor is None else spec.motor.full_steps
    if isinstance(machine, M1486):
        per_rev, full_steps = _chip_motor(spec.pulses_per_rev, full_steps)
    else:
        told = machine.axes[number - 1].config.mot_resol
        per_rev = told if spec.pulses_per_rev is None else spec.pulses_per_rev
        full_steps = FULL_STEPS if full_steps is None else full_steps
    unit, per_unit = _per_unit(spec, machine, number, per_rev)
    return Scale(unit, per_unit, per_rev, full_steps)


def _chip_motor(per_rev: int | None, full_steps: int | None) -> tuple[int, int]:
    """Minimum microsteps and full steps per revolution: each follows from the other."""
    if per_rev is None:
        full_steps = FULL_STEPS if full_steps is None else full_steps
        return full_steps * FULL_STEP, full_steps
    if per_rev % FULL_STEP or (full_steps is not None and per_rev != full_steps * FULL_STEP):
        wanted = f"{FULL_STEP} for each full step"
        motor = "" if full_steps is None else f"; full_steps = {full_steps}: {full_steps * FULL_STEP}"
        raise Misuse(f"pulses_per_rev = {per_rev}: of an M1486 they are minimum microsteps, {wanted}{motor}")
    return per_rev, per_rev // FULL_STEP


def _per_unit(spec: AxisSpec, machine: Mic488 | M1486, number: int, per_rev: int) -> tuple[str, Fraction]:
    """Unit and pulses per unit. What the description says goes before what the controller is told."""
    is_rotary = spec.kind == "rotary"
    usual = "degree" if is_rotary else "mm"
    unit = usual if spec.unit is None else spec.unit
    if spec.pulses_per_unit is not None:
        return unit, Fraction(str(spec.pulses_per_unit))
    if spec.pitch is not None:
        return unit, Fraction(per_rev) / Fraction(str(spec.pitch))
    if isinstance(machine, Mic488) and (spec.pulses_per_rev is None or not is_rotary):
        axis = machine.axes[number - 1]
        told = axis.config.unit_name
        wanted = told if spec.unit is None and not is_rotary else unit
        for kin in (LENGTHS, TURNS, {told: Fraction(1)}):
            if wanted in kin and told in kin:
                return wanted, Fraction(str(axis.gear)) * kin[wanted] / kin[told]
    if is_rotary and unit in TURNS:
        return unit, per_rev * TURNS[unit]
    if spec.unit is None and not is_rotary:
        return PULSES, Fraction(1)
    raise Misuse(f"unit = {unit!r}: say pulses_per_unit or pitch, for {_untold(machine, number, spec)}")


def _untold(machine: Mic488 | M1486, number: int, spec: AxisSpec) -> str:
    if isinstance(machine, M1486):
        return f"{spec.drive[0]} counts minimum microsteps"
    return f"{spec.drive[0]} is told that axis {number} goes in {machine.axes[number - 1].config.unit_name}"


def motor_of(motor: MotorSpec, kind: str, scale: Scale) -> Motor:
    """Torques at the motor; speeds and accelerations in pulses. Raises `Misuse` for masses and forces without a length."""
    per_rev = float(scale.pulses_per_rev)
    arm = 0.0
    if kind == "linear" and (motor.mass or motor.force or motor.friction_force):
        metres = LENGTHS.get(scale.unit)
        if metres is None:
            raise Misuse(f"motor: mass and forces need a unit of {', '.join(LENGTHS)}, not {scale.unit!r}")
        # Metres per radian of the motor.
        arm = float(scale.pulses_per_rev / scale.pulses_per_unit * metres) / (2.0 * PI)
    inertia = motor.inertia + motor.mass * arm * arm
    return Motor(
        curve=tuple((speed / 60.0 * per_rev, torque) for speed, torque in motor.torque),
        inertia=inertia * 2.0 * PI / per_rev,
        friction=motor.friction + motor.friction_force * arm,
        load=motor.load + motor.force * arm,
        start_p=None if motor.start_speed is None else motor.start_speed / 60.0 * per_rev,
    )
