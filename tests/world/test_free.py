"""Rotors that no field holds, against the equation of motion integrated in small steps."""

from __future__ import annotations

from dataclasses import replace
from math import sqrt
from typing import Any

import pytest

from steptwin.machine import SECOND
from steptwin.motion import Profile
from steptwin.world.free import FreeMotion, slow_from
from steptwin.world.wells import Wells

NOW, BASE = 3 * SECOND, 500
BODY = FreeMotion(inertia=0.001, load=0.4, friction=0.1, low=None, high=None)
"""It accelerates by 300 pulses/s² downwards, and brakes upwards with 500."""


def integrated(body: FreeMotion, position: float, velocity: float, seconds: float) -> tuple[float, float]:
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
def test_against_the_equation_of_motion(body: FreeMotion, velocity: float) -> None:
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
    body = replace(BODY, detent=Wells(0.3, 16.0))
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
    body = replace(BODY, detent=Wells(0.3, 16.0), load=0.41)
    assert body.profile(NOW, 500, 0.0, -100.0).end is None


FIELD = Wells(1.0, 64.0)


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
