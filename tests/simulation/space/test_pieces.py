"""Pieces of all that moves, against the positions that mechanics give, and their bounds against differences."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from math import inf

import pytest

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.motion import Profile, Segment
from steptwin.motion.elastic import Response, Spring
from steptwin.motion.paths import Circular
from steptwin.motion.profile import cruise, ramp
from steptwin.simulation.mechanics.cam import Cam
from steptwin.simulation.mechanics.loadmotion import load_intervals
from steptwin.simulation.mechanics.trajectory import Build, MechanicalState, Trajectory
from steptwin.simulation.mechanics.travel import Travel
from steptwin.simulation.space.pieces import (
    Gear,
    Piece,
    falling,
    geared,
    pieces_of_cam,
    pieces_of_profile,
    pieces_of_response,
    pieces_of_trajectory,
    pieces_of_travel,
    span,
    standing,
    summed,
)

THERE = Profile(
    0, 0, (ramp(0.0, 0.0, 0.0, 800.0, 4000.0), cruise(0.2, 0.5, 80.0, 800.0), ramp(0.5, 320.0, 800.0, 0.0, 1600.0)), 520.0
)
BACK = Profile(
    0, 0, (ramp(0.0, 0.0, 0.0, 400.0, 4000.0), ramp(0.1, 20.0, 400.0, 0.0, 4000.0), ramp(0.2, 40.0, 0.0, -300.0, 900.0)), -10.0
)
CUBIC = Profile(0, 0, (Segment(0.4, 0.0, 0.0, 10.0, 500.0, -300.0, 1),), 64.8)
WAY = Profile(0, 0, (ramp(0.0, 0.0, 0.0, 50.0, 200.0), cruise(0.25, 1.0, 6.25, 50.0)), 43.75)
ARC = Circular(0.0, 1000.0, 0.3, 0.1).profile(WAY, 890, None)
END: Nanos = SECOND + 200 * MILLISECOND
TRAJECTORY = Trajectory(Build(high=300, play=7, period_p=16, zero=4), THERE, 0, MechanicalState(4, 4))
RESPONSE = Response(Spring(17.0, 0.08), load_intervals(TRAJECTORY, 0), 0.0, 0.0)
CAM = Cam([(Fraction(0), Fraction(0)), (Fraction(50), Fraction(9)), (Fraction(120), Fraction(3))], Fraction(160))


def extended() -> Travel:
    travel = Travel(300 * MILLISECOND, 400 * MILLISECOND, is_forth=False, now=0)
    travel.send(1, 0)
    return travel


def summing(now: Nanos) -> Iterator[Piece]:
    return summed([geared(pieces_of_profile(one, now), Gear(1.0, 2.0, 0.25)) for one in (THERE, BACK, ARC)])


TRAVEL = extended()
MOTIONS: dict[str, tuple[Callable[[Nanos], Iterator[Piece]], Callable[[Nanos], float], float]] = {
    "profile": (lambda now: pieces_of_profile(THERE, now), THERE.position, 1e-9),
    "cubic": (lambda now: pieces_of_profile(CUBIC, now), CUBIC.position, 1e-9),
    "arc": (lambda now: pieces_of_profile(ARC, now), ARC.position, 1e-9),
    "trajectory": (lambda now: pieces_of_trajectory(TRAJECTORY, now), TRAJECTORY.position, 1e-9),
    "response": (lambda now: pieces_of_response(RESPONSE, now), lambda now: RESPONSE.at(now)[0], 1e-9),
    "travel": (lambda now: pieces_of_travel(TRAVEL, now), lambda now: float(TRAVEL.grid_position(now)), 0.0),
    "cam": (
        lambda now: pieces_of_cam(CAM, pieces_of_profile(THERE, now)),
        lambda now: float(CAM.lift(THERE.count(now))),
        9 / 40 + 1e-9,  # the most that it lifts in a pulse
    ),
    "fall": (
        falling(0, 800 * MILLISECOND, 9806.65).pieces,
        lambda now: 4903.325 * (min(now, 800 * MILLISECOND) / SECOND) ** 2,
        1e-9,
    ),
    "sum": (summing, lambda now: 0.5 * (THERE.position(now) + BACK.position(now) + ARC.position(now)) + 0.75, 1e-9),
}


@pytest.mark.parametrize("name", MOTIONS)
@pytest.mark.parametrize("begin", [0, 123_456_789, 700_000_001])
def test_pieces_follow_each_other_and_give_the_position(name: str, begin: Nanos) -> None:
    pieces_from, position, near = MOTIONS[name]
    now = begin
    for piece in pieces_from(begin):
        assert piece.begin == now
        last = max(END, now) if piece.end is None else piece.end - 1
        for moment in (now, (now + last) // 2, last):
            assert piece.at(moment) == pytest.approx(position(moment), abs=near)
        if piece.end is None:
            return
        now = piece.end
        assert now > piece.begin
    pytest.fail("the last piece has no end")


@pytest.mark.parametrize("name", MOTIONS)
def test_what_is_found_does_not_depend_on_where_a_piece_begins(name: str) -> None:
    """Bit by bit: otherwise a contact would be another nanosecond after somebody has looked."""
    pieces_from = MOTIONS[name][0]

    def at(begin: Nanos, now: Nanos) -> float:
        return next(piece for piece in pieces_from(begin) if piece.end is None or piece.end > now).at(now)

    for now in (333_333_333, 651_234_567, 1_150_000_000):
        assert at(0, now) == at(now - 100_000, now) == at(now, now)


@pytest.mark.parametrize("name", MOTIONS)
def test_bounds_hold(name: str) -> None:
    """Differences of positions, between moments 1 ms apart, are within the bounds of the whole piece and not all far below."""
    nearest = 0.0
    for piece in MOTIONS[name][0](0):
        last = END if piece.end is None else piece.end - 1
        step = min((last - piece.begin) // 40, MILLISECOND)
        if step < 10_000:
            continue
        speed, (least, most) = piece.speed(piece.begin, last), piece.bend(piece.begin, last)
        s, noise = step / SECOND, 1e-9 * (1.0 + abs(piece.at(last)))
        for n in range(38):
            now = piece.begin + n * (last - piece.begin - 2 * step) // 38
            p, q, r = (piece.at(now + k * step) for k in range(3))
            assert abs(q - p) <= speed * s + noise
            assert least * s * s - 4 * noise <= r - 2.0 * q + p <= most * s * s + 4 * noise
            nearest = max(nearest, abs(q - p) / (speed * s) if speed else 0.0)
    assert nearest > 0.3


def test_an_endless_cam_has_endless_pieces() -> None:
    turning = Profile(0, 0, (cruise(0.0, inf, 0.0, -640.0),), 0.0)
    pieces = pieces_of_cam(CAM, pieces_of_profile(turning, 0))
    assert [next(pieces).end for _ in range(4)] == [62_500_001, 171_875_001, 250_000_001, 312_500_001]


@pytest.mark.parametrize(
    ("name", "expected"), [("profile", (0.0, 520.0)), ("trajectory", (4.0, 300.0)), ("travel", (0.0, float(TRAVEL.full)))]
)
def test_a_span_holds_all_positions_and_hardly_more(name: str, expected: tuple[float, float]) -> None:
    low, high = span(MOTIONS[name][0](0))
    room = 0.1 * (expected[1] - expected[0])
    assert expected[0] - room <= low <= expected[0]
    assert expected[1] <= high <= expected[1] + room


def test_the_span_of_what_does_not_end_is_infinite() -> None:
    assert span(pieces_of_profile(Profile(0, 0, (cruise(0.0, inf, 0.0, 1.0),), 0.0), 0)) == (-inf, inf)
    assert span(standing(7.0).pieces(0)) == (7.0, 7.0)
