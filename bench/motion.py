"""How fast motion is planned, looked at and turned into pulses; one processor, best of several rounds."""

from __future__ import annotations

import random
import time
from collections.abc import Callable

from steptwin.motion import MotionState, Profile, plan_position, plan_velocity
from steptwin.motion.divisions import Microstepping, step_train
from steptwin.motion.pulses import pulse_times, step_times
from steptwin.motion.ramps import SpeedCurve, plan_distance, plan_endless

ROUNDS = 25
LOOKS = 1000
MILLION = 1_000_000
STEP = 64
"""Minimum microsteps in a full step of the M1486."""


def best_s(work: Callable[[], object]) -> float:
    times: list[float] = []
    for _ in range(ROUNDS):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    return min(times)


def calls() -> None:
    rest = MotionState(0, 0, 0.0, 0.0)
    move = plan_position(rest, MILLION, 20_000.0, 20_000.0, 32_000.0)
    curve = SpeedCurve(200.0 * STEP, 5000.0 * STEP, 1000.0 * STEP, 4000.0 * STEP)
    chance = random.Random(1)
    assert move.end is not None
    moments = [chance.randrange(move.end) for _ in range(LOOKS)]
    rows: list[tuple[str, Callable[[int], object]]] = [
        ("plan a position move", lambda _: plan_position(rest, 100_000, 20_000.0, 20_000.0, 32_000.0)),
        ("plan a velocity", lambda _: plan_velocity(rest, 32_000.0, 20_000.0, 20_000.0)),
        ("plan a start/stop move", lambda _: plan_distance(0, 0, 64_000, curve)),
        ("take the state of a motion", lambda now: MotionState.of(move, now)),
        ("position", move.position),
        ("count", move.count),
        ("velocity", move.velocity),
        ("time of one pulse", lambda now: move.pulse_time(now % MILLION, 0)),
    ]
    for name, call in rows:
        seconds = best_s(lambda call=call: [call(now) for now in moments]) / LOOKS
        print(f"{name:<34}{seconds * 1e9:>10.0f} ns {1 / seconds / 1e6:>10.2f} M/s")


def first_million(profile: Profile) -> tuple[int, Callable[[], object]]:
    """The first million pulses, all of them in the first segment of ``profile``."""
    until = profile.pulse_time(MILLION, 0)
    assert until is not None
    assert until <= profile.ends[0]
    return MILLION, lambda: pulse_times(profile, 0, until)


def pulses() -> None:
    move = plan_position(MotionState(0, 0, 0.0, 0.0), MILLION, 2000.0, 2000.0, 64_000.0)
    cruise = plan_position(MotionState(0, 0, 0.0, 0.0), MILLION, 200_000.0, 200_000.0, 40_000.0)
    from_rest = plan_velocity(MotionState(0, 0, 0.0, 0.0), 1e9, 2000.0, 2000.0)
    linear = plan_endless(0, 0, 1, SpeedCurve(200.0 * STEP, 5000.0 * STEP, 1e9, 40_000.0 * STEP))
    parabolic = plan_endless(0, 0, 1, SpeedCurve(20.0 * STEP, 5000.0 * STEP, 20.0 * STEP, 40_000.0 * STEP))
    steps = plan_distance(0, 0, 100_000 * STEP, SpeedCurve(200.0 * STEP, 20_000.0 * STEP, 2500.0 * STEP, 12_500.0 * STEP))
    train = step_train(steps, 0, Microstepping(STEP // 8, STEP, 1500.0 * STEP))
    move_end, cruise_end, steps_end = move.end, cruise.end, steps.end
    assert move_end is not None
    assert cruise_end is not None
    assert steps_end is not None
    rows: list[tuple[str, tuple[int, Callable[[], object]]]] = [
        ("whole move, ramps from rest", (MILLION, lambda: pulse_times(move, 0, move_end))),
        ("whole move, a long cruise", (MILLION, lambda: pulse_times(cruise, 0, cruise_end))),
        ("linear ramp from rest", first_million(from_rest)),
        ("linear ramp from a start speed", first_million(linear)),
        ("parabolic ramp", first_million(parabolic)),
        ("STEP, M8 to Q1 and back", (len(step_times(train, 0, steps_end)), lambda: step_times(train, 0, steps_end))),
    ]
    for name, (count, work) in rows:
        print(f"{name:<34}{count:>10,} {count / best_s(work) / 1e6:>13.0f} M/s")


def main() -> None:
    print(f"{'motion, one call':<34}{'time':>13}")
    calls()
    print(f"{'pulse times, int64 ns':<34}{'pulses':>10}")
    pulses()


if __name__ == "__main__":
    main()
