"""``[axis.motor]``: the motor of an axis, which loses steps where its torque does not suffice."""

from __future__ import annotations

from typing import Any

from steptwin.controller import MILLISECOND, Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.mechanics.motor import StepperMotor
from steptwin.simulation.mechanics.resonance import Resonance
from steptwin.simulation.mechanics.scale import Loading, Scale, burden_of
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.table import TableSpec, key, table
from steptwin.simulation.toml.values import flag, number, pair, permitting, points, time_value, whole, word

NO_START_SPEED = Message(
    "simulation.no-start-speed",
    "a motor without start_speed follows every jump of the speed, and is caught only at rest once it has lost its field",
)
FOLLOWS_EVERY_JUMP = Message("simulation.follows-every-jump", "a motor without start_speed follows every jump of the speed")
START_SPEED_HINT = Message("simulation.start-speed-hint", "the data sheet has it: pull-in speed, or maximum starting frequency")

_not_negative = number(0.0)
_rate = number(0.001, 10_000.0)


@permitting("[low, high] from 0")
def _band(value: Any) -> tuple[float, float]:
    low, high = pair(value)
    if low < 0.0:
        raise Misuse(f"{value!r}: permitted are speeds of 0 and more")
    return low, high


@table("[axis.motor]")
class MotorSpec(TableSpec):
    """Torques in N·m at the motor, speeds in rev/min; for linear axes mass in kg and forces in N as well."""

    torque: tuple[tuple[float, float], ...] = key(
        points, "pull-out torque: [[rev/min, N·m], ...] from 0 on; none above the last speed"
    )
    inertia: float = key(_not_negative, "kg·m² of rotor and load, at the motor", default=0.0)
    mass: float = key(_not_negative, "kg moved by a linear axis", default=0.0, kinds=("linear",))
    friction: float = key(_not_negative, "N·m against motion", default=0.0)
    friction_force: float = key(_not_negative, "N against motion of a linear axis", default=0.0, kinds=("linear",))
    load: float = key(number(), "constant N·m; positive pulls towards lower positions", default=0.0)
    force: float = key(
        number(), "constant N on a linear axis; positive pulls towards lower positions", default=0.0, kinds=("linear",)
    )
    start_speed: float | None = key(
        _not_negative,
        "rev/min it starts with at once and is caught at; default any, caught at rest (free: by its energy)",
        default=None,
    )
    when_off: str = key(
        word("holds", "free"), "without current: holds (self-locking), or free: its load moves it", default="holds"
    )
    full_steps: int | None = key(whole(4, 10_000), "full steps per revolution; default 200", default=None)
    detent: float = key(_not_negative, "N·m without current, with when_off = 'free': holds the rotor at full steps", default=0.0)
    hold_current: float = key(number(0.0, 1.0), "share of the current at rest; below 1 with when_off = 'free'", default=1.0)
    hold_delay: Nanos = key(
        time_value, "from the last pulse until the current is reduced", default=100 * MILLISECOND, needs="hold_current"
    )
    overruns: bool = key(flag, "whether it runs on after a stop without ramp, as far as its energy goes", default=False)
    resonance: tuple[float, float] | None = key(
        _band, "[low, high] rev/min: the rotor vibrates there, ever more, until it loses the field", default=None
    )
    resonance_growth: float = key(_rate, "1/s with which the vibration grows there", default=20.0, needs="resonance")
    resonance_fading: float = key(_rate, "1/s with which it fades elsewhere", default=20.0, needs="resonance")
    vibration: float = key(
        number(1e-6, 1.0), "full steps: the vibration that there always is, with resonance", default=0.05, needs="resonance"
    )

    def check(self, text: TomlText) -> None:
        if self.start_speed is None:
            without = FOLLOWS_EVERY_JUMP if self.when_off == "free" else NO_START_SPEED
            text.warn(self.path, "D011", without(), START_SPEED_HINT())
        if self.torque[0][0] != 0.0 or any(torque < 0.0 for _, torque in self.torque):
            text.wrong((*self.path, "torque"), "D003", "a torque curve begins at 0 rev/min and is never negative")
        moves = self.inertia or self.mass
        if self.when_off == "free" and not moves:
            text.wrong((*self.path, "when_off"), "D007", "what moves freely needs an inertia or a mass")
        if self.overruns and not moves:
            text.wrong((*self.path, "overruns"), "D007", "what runs on needs an inertia or a mass")
        for name in ("detent", "hold_current"):
            if self.when_off != "free" and text.is_given((*self.path, name)):
                message = f"{name} acts on a rotor that may move: it needs when_off = 'free'"
                text.wrong((*self.path, name), "D007", message)


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
