"""Rotors that no field holds, against the equation of motion integrated in small steps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import inf, sqrt
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from steptwin.controller import SECOND, Nanos
from steptwin.motion import Profile
from steptwin.simulation.mechanics.coasting import CoastingRotor, slow_from
from steptwin.simulation.mechanics.potential import PeriodicPotential

NOW, BASE = 3 * SECOND, 500
BODY = CoastingRotor(inertia=0.001, load=0.4, friction=0.1, low=None, high=None)
"""It accelerates by 300 pulses/s² downwards, and brakes upwards with 500."""


def integrated(body: CoastingRotor, position: float, velocity: float, seconds: float) -> tuple[float, float]:
    """Position from `BASE` and velocity after a time, without detents."""
    step = 1e-5
    for _ in range(round(seconds / step)):
        if velocity == 0.0 and abs(body.load) <= body.friction:
            break
        direction = 1 if velocity > 0.0 else -1 if velocity < 0.0 else (-1 if body.load > 0.0 else 1)
        after = velocity + step * (-body.load - direction * body.friction) / body.inertia
        velocity, position = (0.0 if after * velocity < 0.0 else after), position + step * 0.5 * (velocity + after)
        for stop, way in ((body.low, -1), (body.high, 1)):
            if stop is not None and (position - (stop - BASE)) * way >= 0.0:
                position, velocity = float(stop - BASE), (0.0 if velocity * way > 0.0 else velocity)
    return position, velocity


@pytest.mark.parametrize(
    ("body", "velocity"),
    [
        (BODY, 0.0),
        (BODY, 400.0),
        (BODY, -200.0),
        (replace(BODY, load=-0.4), 0.0),
        (replace(BODY, load=-0.4), -400.0),
        (replace(BODY, load=0.05), 300.0),
        (replace(BODY, load=-0.05), -300.0),
        (replace(BODY, load=0.0, friction=0.0), 100.0),
        (replace(BODY, load=0.1), -100.0),
        (replace(BODY, low=400), 0.0),
        (replace(BODY, low=400), 300.0),
        (replace(BODY, low=495, high=520), 400.0),
        (replace(BODY, load=-0.4, high=560), 0.0),
        (replace(BODY, load=0.05, high=510), 300.0),
    ],
)
def test_against_the_equation_of_motion(body: CoastingRotor, velocity: float) -> None:
    found = body.profile(NOW, BASE, 0.0, velocity)
    for seconds in (0.05, 0.3, 0.7, 1.0, 1.6):
        position, speed = integrated(body, 0.0, velocity, seconds)
        at = NOW + round(seconds * SECOND)
        assert found.position(at) - BASE == pytest.approx(position, abs=0.6)
        assert found.velocity(at) == pytest.approx(speed, abs=1.0)


def test_how_far_it_goes() -> None:
    """From v against a torque: v²/2a. It rests where friction holds it, else it falls for ever or to its stop."""
    rests = replace(BODY, load=0.05).profile(NOW, BASE, 0.0, 300.0)
    assert rests.end == NOW + 2 * SECOND  # 300 pulses/s less 150 pulses/s²
    assert rests.count(NOW + 2 * SECOND) == BASE + 300
    assert BODY.profile(NOW, BASE, 0.0, 0.0).end is None
    falls = replace(BODY, low=BASE - 600).profile(NOW, BASE, 0.0, 0.0)
    assert falls.end is not None
    assert falls.end == pytest.approx(NOW + 2 * SECOND, abs=10)  # 600 pulses with 300 pulses/s²
    assert falls.count(falls.end) == BASE - 600


@pytest.mark.parametrize(
    ("load", "friction", "moves"), [(0.1, 0.1, False), (-0.1, 0.1, False), (0.1001, 0.1, True), (0.0, 0.0, False)]
)
def test_friction_holds_as_much_as_is_needed(load: float, friction: float, moves: bool) -> None:
    found = replace(BODY, load=load, friction=friction).profile(NOW, BASE, 0.0, 0.0)
    assert bool(found.segments) is moves


@pytest.mark.parametrize(("load", "stop"), [(0.4, "low"), (-0.4, "high")])
def test_at_its_stop_it_stands(load: float, stop: str) -> None:
    at_stop: dict[str, Any] = {stop: BASE}
    found = replace(BODY, load=load, **at_stop).profile(NOW, BASE, 0.0, 0.0)
    assert (found.segments, found.end, found.count(NOW + SECOND)) == ((), NOW, BASE)


def test_a_detent_holds_and_catches() -> None:
    """Wells every 16 pulses with 0.3 N·m: they hold 0.3 and the friction, and catch what has less than their energy."""
    body = replace(BODY, detent=PeriodicPotential(0.3, 16.0))
    assert body.holding == pytest.approx(0.4)
    assert body.profile(NOW, 496, 0.0, 0.0).segments == ()
    assert replace(body, load=0.41).profile(NOW, 496, 0.0, 0.0).segments != ()
    assert replace(BODY, detent=None).holding == pytest.approx(0.1)
    for velocity in (30.0, 100.0, 300.0, -30.0):
        found = replace(body, load=0.05).profile(NOW, 500, 0.0, velocity)
        assert found.end is not None
        assert found.count(found.end) % 16 == 0
        assert (found.count(found.end) - 500) * velocity > 0.0


def test_a_detent_that_is_too_weak_catches_nothing() -> None:
    body = replace(BODY, detent=PeriodicPotential(0.3, 16.0), load=0.41)
    assert body.profile(NOW, 500, 0.0, -100.0).end is None


FIELD = PeriodicPotential(1.0, 64.0)


@pytest.mark.parametrize("direction", [1, -1])
def test_running_on_after_a_stop_of_the_field(direction: int) -> None:
    """It leaves as many periods of the field as its energy is enough for."""
    body = replace(BODY, load=0.0, friction=0.2)
    first, further = FIELD.to_leave(0.2), 0.2 * 64.0
    for periods in (0, 1, 2, 5):
        energy = first + (periods - 0.5) * further if periods else 0.9 * first
        found = body.overrun(FIELD, NOW, BASE, direction * sqrt(2.0 * energy / body.inertia))
        if not periods:
            assert found is None
            continue
        assert found is not None
        assert found.end is not None
        assert found.count(found.end) == BASE + direction * periods * 64
        assert found.velocity(found.end) == 0.0


def test_running_on_ends_at_a_stop() -> None:
    body = replace(BODY, load=0.0, friction=0.2, high=BASE + 100)
    found = body.overrun(FIELD, NOW, BASE, 400.0)
    assert found is not None
    assert found.end is not None
    assert found.count(found.end) == BASE + 100


def test_running_on_downhill_has_no_end() -> None:
    body = replace(BODY, load=0.4, friction=0.2)
    found = body.overrun(FIELD, NOW, BASE, -400.0)
    assert found is not None
    assert found.end is None
    lost = 2.0 * FIELD.deep(-0.2) / body.inertia
    assert found.velocity(NOW) == pytest.approx(-sqrt(160_000.0 - lost))


@pytest.mark.parametrize(
    ("speed", "due_s"),
    [(400.0, 0.0), (401.0, 0.0), (399.0, 1.0 / 500.0), (150.0, 0.5), (0.0, 0.8)],
)
def test_when_it_is_slow_enough(speed: float, due_s: float) -> None:
    """Upwards from 400 pulses/s, braked with 500 pulses/s²."""
    found = BODY.profile(NOW, BASE, 0.0, 400.0)
    due = slow_from(found, NOW, speed)
    assert due == pytest.approx(NOW + due_s * SECOND, abs=3)


def test_what_falls_ever_faster_is_never_slow_enough() -> None:
    falls = BODY.profile(NOW, BASE, 0.0, -10.0)
    assert slow_from(falls, NOW, 5.0) is None
    assert slow_from(falls, NOW, 10.0) == NOW
    lands = replace(BODY, low=BASE - 600).profile(NOW, BASE, 0.0, -10.0)
    assert slow_from(lands, NOW, 5.0) == lands.end
    assert lands.end is not None
    assert slow_from(lands, lands.end + 7, 5.0) == lands.end + 7


def test_a_body_at_rest_is_slow() -> None:
    rest = Profile(NOW, BASE, (), 0.0)
    assert slow_from(rest, NOW + 5, 0.0) == NOW + 5
    assert slow_from(replace(BODY, load=0.0, friction=0.0).profile(NOW, BASE, 0.0, 100.0), NOW, 99.0) is None


# ---------------------------------------------------------------------- energy, without integration


def moments(found: Profile, begin: Nanos) -> Iterator[tuple[Nanos, Nanos]]:
    """The whole nanoseconds at which each segment begins and is there for the last time."""
    for end in found.ends:
        last = begin + SECOND if end == inf else found.start + int(end) - 1
        yield begin, last
        begin = last + 1


@given(
    velocity=st.floats(2.0, 800.0),
    direction=st.sampled_from([1, -1]),
    load=st.integers(-300, 300).map(lambda n: n / 1000.0),
    friction=st.integers(0, 300).map(lambda n: n / 1000.0),
    phase=st.floats(0.01, 0.9),
    stops=st.sampled_from([(None, None), (-7, 5), (-150, 200), (-1, 1)]),
)
@example(velocity=300.0, direction=-1, load=0.0, friction=0.15, phase=0.5, stops=(-100, None))
def test_what_it_loses_is_the_work_of_load_and_friction(
    velocity: float, direction: int, load: float, friction: float, phase: float, stops: tuple[int | None, int | None]
) -> None:
    """In each segment, which ends at rest or at a stop; velocities are those of the positions."""
    low, high = (None if stop is None else BASE + stop for stop in stops)
    body = replace(BODY, load=load, friction=friction, low=low, high=high)
    found = body.profile(NOW, BASE, phase, direction * velocity)
    assert found.position(NOW) == pytest.approx(BASE + phase)
    assert found.velocity(NOW) == pytest.approx(direction * velocity)
    for begin, last in moments(found, NOW):
        x, v = found.position(begin), found.velocity(begin)
        for n in range(1, 5):
            at = begin + (last - begin) * n // 4
            way = found.position(at) - x
            left = v * v - 2.0 * (load * way + friction * abs(way)) / body.inertia
            assert found.velocity(at) ** 2 == pytest.approx(left, abs=1e-3, rel=1e-6)
        if found.end is not None or last < NOW + 100 * SECOND:
            rests = abs(found.velocity(last)) < 1e-3
            stands = any(stop is not None and abs(found.position(last) - stop) < 1e-5 for stop in (low, high))
            assert rests or stands or found.end is None
    if found.end is not None:
        assert low is None or found.count(found.end) >= low
        assert high is None or found.count(found.end) <= high


def test_the_moment_of_rest_and_that_of_a_stop() -> None:
    """300 pulses/s less 150 pulses/s²: after 2 s and 300 pulses. A stop is come to in the nanosecond after."""
    body = replace(BODY, load=0.05)
    for high, end in ((None, 2 * SECOND), (BASE + 300, 2 * SECOND), (BASE + 301, 2 * SECOND)):
        assert replace(body, high=high).profile(NOW, BASE, 0.0, 300.0).end == NOW + end
    before = replace(body, high=BASE + 225).profile(NOW, BASE, 0.0, 300.0)
    assert before.end is not None
    assert before.end - NOW - SECOND in (1, 2)
    assert before.velocity(NOW + SECOND - 1) == pytest.approx(150.0)
    back = replace(BODY, load=-0.05, low=BASE - 225).profile(NOW, BASE, 0.0, -300.0)
    assert back.end == before.end


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("share", [0.04, 0.5, 0.96])
@pytest.mark.parametrize("periods", [1, 2, 5])
def test_how_long_it_runs_on(direction: int, share: float, periods: int) -> None:
    """With its mean energy, which a constant torque takes on the way to the last well, or a part of it up to its edge."""
    body = replace(BODY, load=0.0, friction=0.2)
    energy = FIELD.to_leave(0.2) + (periods - 1 + share) * 0.2 * 64.0
    mean = sqrt(2.0 * (energy - FIELD.deep(0.2)) / body.inertia)
    found = body.overrun(FIELD, NOW, BASE, direction * sqrt(2.0 * energy / body.inertia))
    assert found is not None
    assert found.end is not None
    assert found.velocity(NOW) == pytest.approx(direction * mean)
    way = 64.0 * periods
    rate = min(0.2 / body.inertia, mean * mean / (2.0 * way))
    seconds = (mean - sqrt(max(mean * mean - 2.0 * rate * way, 0.0))) / rate
    assert (found.end - NOW) / SECOND == pytest.approx(seconds, rel=1e-4)
    assert found.count(found.end) == BASE + direction * 64 * periods


def test_it_also_runs_on_slowly() -> None:
    """In a field that hardly holds it."""
    weak = PeriodicPotential(1e-7, 64.0)
    body = replace(BODY, load=0.0, friction=1e-8)
    found = body.overrun(weak, NOW, BASE, 0.5)
    assert found is not None
    assert found.end is not None
    assert found.count(found.end) > BASE


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize(("speed", "load"), [(60.0, 0.0), (200.0, 0.0), (300.0, 0.05), (300.0, -0.05)])
def test_a_detent_catches_it_once_it_is_slow(speed: float, load: float, direction: int) -> None:
    """Before, only load and friction act; from then on it goes evenly slower to the nearest full step."""
    body = replace(BODY, detent=PeriodicPotential(0.3, 16.0), load=load * direction)
    slow = PeriodicPotential(0.3, 16.0).catches_below(body.inertia, 0.1 + load)
    rate = (0.1 + load) / body.inertia
    found = body.profile(NOW, BASE, 0.25, direction * speed)
    assert found.end is not None
    end = found.count(found.end)
    assert end % 16 == 0
    way, time = 0.0, 0.0
    if speed > slow:
        way, time = (speed * speed - slow * slow) / (2.0 * rate), (speed - slow) / rate
    left = (end - BASE - 0.25) * direction - way
    if left <= 0.0:  # the nearest one is passed before, and holds it
        fast = sqrt(speed * speed - 2.0 * rate * (way + left))
        assert (found.end - NOW) / SECOND == pytest.approx((speed - fast) / rate, rel=1e-6)
        return
    half = NOW + round(0.5 * time * SECOND)
    assert abs(found.velocity(half)) == pytest.approx(0.5 * (speed + slow) if way else speed, rel=1e-6)
    assert found.position(half) == pytest.approx(BASE + 0.25 + direction * 0.125 * (3.0 * speed + slow) * time, abs=1e-3)
    assert left <= 24.0
    assert (found.end - NOW) / SECOND == pytest.approx(time + 2.0 * left / min(speed, slow), rel=1e-6)


def test_a_detent_does_not_catch_what_nothing_brakes_or_what_comes_to_a_stop_first() -> None:
    still = replace(BODY, detent=PeriodicPotential(0.3, 16.0), load=0.0, friction=0.0)
    slow = PeriodicPotential(0.3, 16.0).catches_below(still.inertia, 0.0)
    assert still.profile(NOW, BASE, 0.0, slow * 1.01).end is None
    assert still.profile(NOW, BASE, 0.0, slow * 0.99).end is not None
    held = replace(BODY, detent=PeriodicPotential(0.3, 16.0), load=0.0, high=BASE + 100).profile(NOW, BASE, 0.0, 300.0)
    assert held.end is not None
    assert held.count(held.end) == BASE + 100
    assert (held.end - NOW) / SECOND == pytest.approx((300.0 - sqrt(300.0**2 - 2.0 * 100.0 * 100.0)) / 100.0)
