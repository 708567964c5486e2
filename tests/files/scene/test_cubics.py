from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable
from itertools import islice

import pytest

from steptwin.controller import SECOND, Nanos
from steptwin.files.scene.cubics import Cubic, cubics_of
from steptwin.motion import MotionState, plan_position, plan_velocity
from steptwin.motion.paths import Circular, circle
from steptwin.simulation.space.pieces import Piece, pieces_of_profile


def at(cubics: list[Cubic], now: Nanos) -> float:
    return cubics[bisect_right(cubics, now, key=lambda one: one.begin) - 1].at(now)


def taken(pieces: Iterable[Piece], slack: float) -> list[Cubic]:
    return list(islice(cubics_of(pieces, slack), 10_000))


def test_polynomials_are_exact_with_one_for_each_segment() -> None:
    profile = plan_position(MotionState(0, 0, 0.0, 0.0), 30_000, 5e3, 8e3, 4e3)
    cubics = taken(pieces_of_profile(profile, 0), 0.01)
    assert profile.end is not None
    assert len(cubics) == len(profile.segments) + 1
    for n in range(1001):
        now = profile.end * n // 900  # beyond its end, too
        assert at(cubics, now) == pytest.approx(profile.position(now), abs=1e-6)


def test_arcs_are_divided_until_they_fit() -> None:
    arc = circle(5000.0, 0.0, 5000.0, 4.0)
    curve = Circular(arc.centre_x, arc.radius, arc.begin_q, arc.sweep_q / arc.length)
    profile = curve.profile(plan_position(MotionState(0, 0, 0.0, 0.0), round(arc.length), 1e4, 1e4, 4e3), 0, None)
    cubics = taken(pieces_of_profile(profile, 0), 0.1)
    assert profile.end is not None
    assert max(abs(at(cubics, now) - profile.position(now)) for now in range(0, profile.end, profile.end // 3001)) < 0.15
    assert len(cubics) < 100


def test_what_never_ends_is_one_polynomial() -> None:
    profile = plan_velocity(MotionState(0, 0, 0.0, 0.0), 1000.0, 500.0, 500.0)
    cubics = taken(pieces_of_profile(profile, 0), 0.01)
    assert len(cubics) == 2
    assert at(cubics, 1000 * SECOND) == pytest.approx(profile.position(1000 * SECOND), abs=1e-3)
