"""Ramps that begin at once: which ones lose the field, against Runge and Kutta on the differential equation of a rotor

J·θ″ = −T·sin(50·(θ − field)) − friction·sign(θ′) − load, with T = 1 N·m and J = 5·10⁻⁵ kg·m².

The first table of docs/motors/ramps.md is `LIMITS`.
"""

from __future__ import annotations

from itertools import pairwise
from math import asin, copysign, inf, pi, sin
from pathlib import Path

import pytest

from steptwin.controller import SECOND
from steptwin.files.recording import load, recording_of, save
from steptwin.files.world import World
from steptwin.motion import MotionState, Profile, plan_position, plan_velocity
from steptwin.simulation.mechanics.motor import StepperMotor
from steptwin.simulation.mechanics.trajectory import Build, MechanicalState, Trajectory

TORQUE, INERTIA, POLES = 1.0, 5e-5, 50
TURN_P, PERIOD_P = 3200, 64
LIMITS = {  # rev/min: the share of T, friction included, from which the field is lost with 0, 0.1 and 0.25 N·m of it
    150: (inf, inf, inf),
    300: (inf, inf, inf),
    400: (1.96, 1.09, 0.83),
    500: (0.94, 0.83, 0.77),
    600: (0.81, 0.77, 0.75),
    800: (0.745, 0.736, 0.740),
    1500: (0.725, 0.727, 0.738),
    3000: (0.725, 0.727, 0.738),
}
FRICTIONS = (0.0, 0.1, 0.25)


def integrated(accelerations: list[tuple[float, float]], friction: float, load: float = 0.0, after_s: float = 0.04) -> bool:
    """Whether the rotor is in another period after a field has been accelerated (rad/s² for s) and has gone on for a while."""
    h = 2e-5
    corners = [(0.0, 0.0, 0.0)]
    for rate, duration in accelerations:
        t, p, v = corners[-1]
        corners.append((t + duration, p + v * duration + rate * duration * duration / 2, v + rate * duration))
    phases = [(*begin, rate) for begin, (rate, _) in zip(corners, accelerations, strict=False)] + [(*corners[-1], 0.0)]
    at = 0

    def acceleration(t: float, x: float, v: float) -> float:
        begin, p, w, rate = phases[at]
        u = t - begin
        pull = -TORQUE * sin(POLES * (x - (p + w * u + rate * u * u / 2))) - load
        if abs(v) < 1e-3 and abs(pull) <= friction:
            return 0.0
        return (pull - copysign(friction, v if abs(v) >= 1e-3 else pull)) / INERTIA

    t, x, v = 0.0, -asin(load / TORQUE) / POLES, 0.0
    ends = [begin for begin, *_ in phases[1:]] + [corners[-1][0] + after_s]
    lag = 0.0
    for at, end in enumerate(ends):
        for _ in range(max(1, round((end - phases[at][0]) / h))):
            k = (end - phases[at][0]) / max(1, round((end - phases[at][0]) / h))
            a = acceleration(t, x, v)
            b = acceleration(t + k / 2, x + k / 2 * v, v + k / 2 * a)
            c = acceleration(t + k / 2, x + k / 2 * v + k * k / 4 * a, v + k / 2 * b)
            d = acceleration(t + k, x + k * v + k * k / 2 * b, v + k * c)
            x, v, t = x + k * v + k * k / 6 * (a + b + c), v + k / 6 * (a + 2 * b + 2 * c + d), t + k
            u = t - phases[at][0]
            lag = phases[at][1] + phases[at][2] * u + phases[at][3] * u * u / 2 - x
            if abs(lag) * POLES > 3 * pi:
                return True
    return round(lag * POLES / (2 * pi)) != 0


def rotor(friction: float, load: float = 0.0, start_rpm: float | None = None) -> StepperMotor:
    start = None if start_rpm is None else start_rpm / 60 * TURN_P
    return StepperMotor(((0.0, TORQUE), (1e6, TORQUE)), INERTIA * 2 * pi / TURN_P, friction, load, start)


def loses(motor: StepperMotor, rate: float, rpm: float) -> bool:
    """Whether a ramp of ``rate`` rad/s² to a speed that stays is not followed."""
    pulses = rate / (2 * pi) * TURN_P
    plan = plan_velocity(MotionState(0, 0, 0.0, 0.0), rpm / 60 * TURN_P, pulses, pulses)
    return Trajectory(Build(period_p=PERIOD_P, motor=motor), plan, 0, MechanicalState(0, 0)).at(SECOND).stalled


@pytest.mark.parametrize("rpm", LIMITS)
def test_ramps_lose_the_field_where_the_differential_equation_does(rpm: int) -> None:
    for friction, limit in zip(FRICTIONS, LIMITS[rpm], strict=True):
        for share, lost in ((2.9, False),) if limit == inf else ((limit * 0.985, False), (limit * 1.015, True)):
            rate = (share * TORQUE - friction) / INERTIA
            assert integrated([(rate, rpm / 60 * 2 * pi / rate)], friction) is lost, (friction, share)
            assert loses(rotor(friction), rate, rpm) is lost, (friction, share)


@pytest.mark.parametrize(("load", "limit"), [(0.3, 0.814), (-0.3, 0.626)])
def test_a_load_moves_the_limit(load: float, limit: float) -> None:
    """It holds the rotor behind, or ahead, before the ramp; the limit is a share of the torque with it."""
    for share, lost in ((limit * 0.99, False), (limit * 1.01, True)):
        rate = (share * TORQUE - load) / INERTIA
        assert integrated([(rate, 0.04)], 0.0, load, after_s=1e-5) is lost, share
        assert loses(rotor(0.0, load), rate, rate * 0.04 / (2 * pi) * 60) is lost, share


def test_a_short_move_speeds_up_and_brakes() -> None:
    """A turn from one to the other within a swing: to 600 rev/min, with 0.54 of the torque for each."""
    for share, lost in ((0.53, False), (0.55, True)):
        rate = share * TORQUE / INERTIA
        speed = 600 / 60 * 2 * pi
        assert integrated([(rate, speed / rate), (-rate, speed / rate)], 0.0) is lost
        pulses = TURN_P / (2 * pi)
        plan = plan_position(MotionState(0, 0, 0.0, 0.0), round(speed * speed / rate * pulses), rate * pulses, rate * pulses, 1e9)
        assert stalls(plan) is lost


def stalls(plan: Profile) -> bool:
    found = Trajectory(Build(period_p=PERIOD_P, motor=rotor(0.0)), plan, 0, MechanicalState(0, 0))
    return any(section.stalled for section in found.sections)


def test_a_swing_has_faded_before_the_next_ramp_and_never_fades_in_the_equation() -> None:
    """The difference that docs/motors/ramps.md names: to 1500 rev/min and back, by chance of the phase, and from 0.537."""
    speed, pulses = 1500 / 60 * 2 * pi, TURN_P / (2 * pi)
    for share, integrates, twin in ((0.43, False, False), (0.47, True, False), (0.52, False, False), (0.55, False, True)):
        rate = share * TORQUE / INERTIA
        plan = plan_position(MotionState(0, 0, 0.0, 0.0), round(speed * speed / rate * pulses), rate * pulses, rate * pulses, 1e9)
        assert (integrated([(rate, speed / rate), (-rate, speed / rate)], 0.0), stalls(plan)) == (integrates, twin), share


def test_the_limit_falls_with_the_length_of_a_ramp() -> None:
    for column in zip(*LIMITS.values(), strict=True):
        assert all(short >= long - 0.005 for short, long in pairwise(column))


TEXT = """
[[mic488]]
name = "c"
[mic488.M1]
acc = {acc}
dec = {acc}
vel = {vel}
mot_resol = 3200
[[axis]]
name = "x"
drive = "c.M1"
pulses_per_rev = 3200
[axis.motor]
torque = [[0, 1.0], [3000, 1.0]]
inertia = 0.00005
{start}
"""


def moved(share: float, rpm: float, start: str = "") -> World:
    text = TEXT.format(acc=share / INERTIA / (2 * pi) * TURN_P, vel=rpm / 60 * TURN_P, start=start)
    found = World.from_toml(text, name="w.toml")
    found.mic488["c"].write("M1_EN", 1)
    found.mic488["c"].write("M1_POS_ABS", 12_800.0)
    return found


def test_a_ramp_of_half_a_millisecond_to_a_slow_speed_loses_nothing() -> None:
    """To 150 rev/min with 1.5 of the torque; by the jump that it is, where the motor has a start speed."""
    for start, lost in (("", 0.0), ("start_speed = 151", 0.0), ("start_speed = 149", 12_800.0)):
        found = moved(1.5, 150, start)
        found.run(until="idle")
        assert found.read("x.lost") == lost, start


def test_a_long_ramp_says_why_it_stalls() -> None:
    found = moved(0.8, 1500)
    found.run(until="idle")
    (words,) = [str(record.value) for record in found.trace.of("event") if record.subject == "stall"][:1]
    assert words == "x stalls: the motion needs 0.8 N·m at once, more than the rotor can follow of 1 N·m"
    assert found.read("x.lost") > 12_000


def test_a_world_goes_on_alike_from_the_middle_of_a_short_ramp(tmp_path: Path) -> None:
    found = moved(1.9, 400)
    found.at(0.1, lambda: found.mic488["c"].write("M1_POS_ABS", 0.0))
    found.run(until=1.0)
    place = f"{tmp_path}/s.json"
    save(recording_of(found), place)
    for moment in (500_000, 100_700_000):
        part = load(place).replay(moment)
        snapshot = part.snapshot()
        again = load(place).replay(0)
        again.restore(snapshot)
        for one in (part, again):
            one.run(until=1.0)
        assert again.trace.digest() == part.trace.digest()
    assert load(place).replay().trace.digest() == found.trace.digest()
