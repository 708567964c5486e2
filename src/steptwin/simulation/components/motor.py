"""``[axis.motor]``: the motor of an axis, which loses steps where its torque does not suffice."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from steptwin.errors import Misuse
from steptwin.machine import MILLISECOND, Nanos
from steptwin.simulation.mechanics.motor import StepperMotor
from steptwin.simulation.mechanics.resonance import Resonance
from steptwin.simulation.mechanics.scale import Loading, Scale, burden_of
from steptwin.simulation.toml.reader import Key, Table, TomlText, optional, read_table
from steptwin.simulation.toml.sense import TableRows, check_sense
from steptwin.simulation.toml.tomlplaces import Path
from steptwin.simulation.toml.values import flag, number, pair, permitting, points, time_value, whole, word

_not_negative = number(0.0)
_rate = number(0.001, 10_000.0)


@permitting("[low, high] from 0")
def _band(value: Any) -> tuple[float, float]:
    low, high = pair(value)
    if low < 0.0:
        raise Misuse(f"{value!r}: permitted are speeds of 0 and more")
    return low, high


@dataclass(frozen=True, slots=True, kw_only=True)
class MotorSpec:
    """Torques in N·m at the motor, speeds in rev/min; for linear axes mass in kg and forces in N as well."""

    torque: tuple[tuple[float, float], ...]
    inertia: float
    mass: float
    friction: float
    friction_force: float
    load: float
    force: float
    start_speed: float | None
    full_steps: int | None
    when_off: str
    detent: float
    hold_current: float
    hold_delay: Nanos
    overruns: bool
    resonance: tuple[float, float] | None
    resonance_growth: float
    resonance_fading: float
    vibration: float
    path: Path = ()


MOTOR = TableRows(
    written="[axis.motor]",
    keys=(
        Key("torque", points, "pull-out torque: [[rev/min, N·m], ...] from 0 on; none above the last speed"),
        optional(_not_negative, "inertia", "kg·m² of rotor and load, at the motor", 0.0),
        optional(_not_negative, "mass", "kg moved by a linear axis", 0.0),
        optional(_not_negative, "friction", "N·m against motion", 0.0),
        optional(_not_negative, "friction_force", "N against motion of a linear axis", 0.0),
        optional(number(), "load", "constant N·m; positive pulls towards lower positions", 0.0),
        optional(number(), "force", "constant N on a linear axis; positive pulls towards lower positions", 0.0),
        optional(_not_negative, "start_speed", "rev/min it starts with at once and is caught at; default any, caught at rest"),
        optional(word("holds", "free"), "when_off", "without current: holds (self-locking), or free: its load moves it", "holds"),
        optional(whole(4, 10_000), "full_steps", "full steps per revolution; default 200"),
        optional(_not_negative, "detent", "N·m without current, with when_off = 'free': holds the rotor at full steps", 0.0),
        optional(number(0.0, 1.0), "hold_current", "share of the current at rest; below 1 with when_off = 'free'", 1.0),
        optional(time_value, "hold_delay", "from the last pulse until the current is reduced", 100 * MILLISECOND),
        optional(flag, "overruns", "whether it runs on after a stop without ramp, as far as its energy goes", False),
        optional(_band, "resonance", "[low, high] rev/min: the rotor vibrates there, ever more, until it loses the field"),
        optional(_rate, "resonance_growth", "1/s with which the vibration grows there", 20.0),
        optional(_rate, "resonance_fading", "1/s with which it fades elsewhere", 20.0),
        optional(number(1e-6, 1.0), "vibration", "full steps: the vibration that there always is, with resonance", 0.05),
    ),
    need={
        "hold_delay": "hold_current",
        "resonance_growth": "resonance",
        "resonance_fading": "resonance",
        "vibration": "resonance",
    },
    only={"mass": ("linear",), "friction_force": ("linear",), "force": ("linear",)},
)


def read_motor(text: TomlText, axis: Path, table: Table) -> MotorSpec | None:
    """The motor in the table of an axis; None where there is none, or it is wrong."""
    if "motor" not in table:
        return None
    path = (*axis, "motor")
    values = read_table(text, path, table["motor"], MOTOR.keys)
    if "torque" not in values:
        return None
    motor = MotorSpec(**values, path=path)
    check_sense(text, path, MOTOR, table["motor"], table.get("kind", "linear"))
    if motor.torque[0][0] != 0.0 or any(torque < 0.0 for _, torque in motor.torque):
        text.wrong((*path, "torque"), "D003", "a torque curve begins at 0 rev/min and is never negative")
    if motor.when_off == "free" and not motor.inertia and not motor.mass:
        text.wrong((*path, "when_off"), "D007", "what moves freely needs an inertia or a mass")
    if motor.overruns and not motor.inertia and not motor.mass:
        text.wrong((*path, "overruns"), "D007", "what runs on needs an inertia or a mass")
    for key in ("detent", "hold_current"):
        if key in table["motor"] and motor.when_off != "free":
            text.wrong((*path, key), "D007", f"{key} acts on a rotor that may move: it needs when_off = 'free'")
    return motor


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
