"""Moments of contact that are calculated by hand, and what a search costs."""

from __future__ import annotations

from math import hypot, inf

import pytest
from space_scenes import bodies_of, motion_of, random_scene

from steptwin.controller import SECOND, Nanos
from steptwin.motion.profile import Profile, cruise, ramp
from steptwin.simulation.space import contacts
from steptwin.simulation.space.bodies import Body, Box, Cylinder
from steptwin.simulation.space.contacts import NEVER, Look, Pair
from steptwin.simulation.space.frames import FLOOR, Direction, Frame, Joint
from steptwin.simulation.space.pieces import standing

MM = 10**6
CUBE = Box((10 * MM, 10 * MM, 10 * MM))


def at_speed(nm_s: float, seconds: float = inf) -> Profile:
    return Profile(0, 0, (cruise(0.0, seconds, 0.0, nm_s),), 0.0 if seconds == inf else nm_s * seconds)


def axis(plan: Profile, name: str = "x", at: tuple[int, int, int] = (0, 0, 0), on: Frame = FLOOR, along: int = 0) -> Frame:
    return Frame(name, on, at, Joint(motion_of(plan), Direction(along, 1)))


def table(turns_s: float) -> Frame:
    return Frame("table", FLOOR, (0, 0, 0), Joint(motion_of(at_speed(4.0 * turns_s)), Direction(2, 1), turns=True))


@pytest.fixture
def looks(monkeypatch: pytest.MonkeyPatch) -> list[Nanos]:
    """The moments at which a search has looked."""
    found: list[Nanos] = []
    look = contacts._Stretch.look

    def count(self: contacts._Stretch, now: Nanos) -> object:
        found.append(now)
        return look(self, now)

    monkeypatch.setattr(contacts._Stretch, "look", count)
    return found


def test_a_cube_enters_another_and_leaves_it() -> None:
    """At 10 mm/s it needs 0.8 s for the gap of 8 mm, and 150 ns for half of the next nm; then it has to go on for 40 mm."""
    pair = Pair(Body("cube", axis(at_speed(10e6, 6.0)), CUBE), Body("wall", FLOOR, CUBE, (28 * MM, 5 * MM, 0)))
    assert pair.next_change(0) == Look(800_000_051, changes=True)
    assert [pair.overlap(800_000_050 + more) for more in (0, 1)] == [False, True]
    assert pair.next_change(800_000_051) == Look(4_799_999_950, changes=True)
    assert pair.next_change(4_799_999_950) == NEVER


def test_a_ramp_reaches_a_wall_at_the_root_of_its_way() -> None:
    """2 · 8 000 000.5 nm / (1 m/s²) = 16.000001 · 10⁻³ s²: after 0.126 491 110 s."""
    plan = Profile(0, 0, (ramp(0.0, 0.0, 0.0, 1e9, 1e9),), 5e8)
    pair = Pair(Body("cube", axis(plan), CUBE), Body("wall", FLOOR, CUBE, (28 * MM, 0, 0)))
    found = pair.next_change(0).at
    assert found is not None
    assert 0.5e9 * (found / SECOND) ** 2 > 8_000_000.5 >= 0.5e9 * ((found - 1) / SECOND) ** 2


def test_an_arm_meets_a_post_at_an_angle() -> None:
    """Half of its width and the radius of the post, 5 + 10 mm, at 150 mm: arcsin 0.1 before a quarter turn."""
    arm = Body("arm", table(0.25), Box((100 * MM, 5 * MM, 5 * MM)), (100 * MM, 0, 0))
    post = Body("post", FLOOR, Cylinder(10 * MM, 20 * MM), (0, 150 * MM, 0))
    pair = Pair(arm, post)
    begins = pair.next_change(0).at or 0
    ends = pair.next_change(begins).at or 0
    assert begins == pytest.approx(936_231_440, abs=3)
    assert (begins + ends) / 2 == pytest.approx(SECOND, abs=2)
    assert pair.next_change(ends).at == pytest.approx(begins + 4 * SECOND, abs=2), "in the next revolution"


def test_one_that_overtakes_another_for_a_moment_touches_it(looks: list[Nanos]) -> None:
    """One begins slowly behind one that goes steadily: halfway it has lost 1 m/s² · (1 s)² / 8, no more. Both ends are alike."""
    slow = Profile(0, 0, (ramp(0.0, 0.0, 0.0, 1e9, 1e9),), 5e8)
    behind = 20 * MM + 125 * MM
    for gap, touches in ((-1, True), (0, False)):
        rear = Body("rear", axis(at_speed(5e8, 1.0), "rear"), CUBE)
        pair = Pair(rear, Body("front", axis(slow, "front", (behind + gap, 0, 0)), CUBE))
        found = pair.next_change(0)
        assert found.changes is touches
        assert not touches or abs((found.at or 0) - SECOND // 2) < 100_000
    assert len(looks) < 200


@pytest.mark.parametrize(("reach", "touches"), [(100 * MM - 1, True), (100 * MM, False)])
def test_a_tip_that_passes_a_wall_on_its_highest_point_touches_it(reach: int, touches: bool) -> None:
    """From 45° before the wall to 45° behind it in one piece: both of its ends are as far away."""
    turning = Frame("arm", FLOOR, (0, 0, 0), Joint(motion_of(at_speed(1.0, 1.0)), Direction(2, 1), turns=True))
    tip = Body(
        "tip", Frame("start", turning, (0, 0, 0), Joint(standing(-0.5), Direction(2, 1), turns=True)), Box((100 * MM, 0, 5 * MM))
    )
    found = Pair(tip, Body("wall", FLOOR, CUBE, (reach + 10 * MM, 0, 0))).next_change(0)
    assert found.changes is touches
    assert not touches or abs((found.at or 0) - SECOND // 2) < 100_000


def test_no_point_of_a_body_bends_or_goes_faster_than_its_bounds() -> None:
    """Differences over 20 µs of all corners, seen from the frame of the search; the bounds are not all far above them."""
    nearest = 0.0
    for seed in range(80):
        pair = Pair(*bodies_of(random_scene(seed)))
        motions = list(pair.moving.values())
        begin, end = 1_000_000, 4_000_000
        pieces = [next(motion.pieces(begin)) for motion in motions]
        if not motions or any(piece.end is None or piece.end <= end for piece in pieces):
            continue
        interval = contacts._Stretch(pair, pieces, begin, end)
        for body in range(2) if interval._turns else ():
            bounds, step = interval._bounds(body, begin, end), 20_000
            s = step / SECOND
            for now in range(begin, end - 2 * step, 300_000):
                looks = [interval.look(now + n * step).placed[body].corners() for n in range(3)]
                for places in zip(*looks, strict=True):
                    (u0, v0), (u1, v1), (u2, v2) = places
                    bend = hypot(u2 - 2 * u1 + u0, v2 - 2 * v1 + v0) / s / s
                    assert bend <= bounds.bend * (1.0 + 1e-6) + 1e4
                    assert hypot(u1 - u0, v1 - v0) / s <= bounds.speed * (1.0 + 1e-6) + 1.0
                    assert hypot(u1, v1) <= bounds.far + 1e-3
                    nearest = max(nearest, bend / bounds.bend if bounds.bend > 1e7 else 0.0)
    assert nearest > 0.7


def test_two_that_move_alike_are_apart_however_near_they_are(looks: list[Nanos]) -> None:
    plan = Profile(0, 0, (ramp(0.0, 0.0, 0.0, 1e9, 2e9), cruise(0.5, 2.0, 2.5e8, 1e9), ramp(2.0, 1.75e9, 1e9, 0.0, 2e9)), 2e9)
    front = Body("front", axis(plan, "front", (20 * MM, 0, 0)), CUBE)
    pair = Pair(Body("rear", axis(plan, "rear"), CUBE), front)
    assert pair.next_change(0) == NEVER
    assert len(looks) < 20


def test_one_that_slides_along_a_wall_does_not_touch_it(looks: list[Nanos]) -> None:
    wall = Body("wall", FLOOR, Box((1000 * MM, 10 * MM, 10 * MM)), (0, 20 * MM, 0))
    assert Pair(Body("cube", axis(at_speed(1e9, 2.0)), CUBE), wall).next_change(0) == NEVER
    assert Pair(Body("can", axis(at_speed(1e9, 2.0)), Cylinder(10 * MM, 10 * MM)), wall).next_change(0) == NEVER
    assert len(looks) < 12


@pytest.mark.parametrize(("shape", "most"), [(CUBE, 14), (Cylinder(10 * MM, 10 * MM), 40)], ids=["cube", "can"])
@pytest.mark.parametrize(("beside", "changes"), [(19 * MM, True), (20 * MM, False), (21 * MM, False)])
def test_what_a_belt_that_goes_on_for_ever_brings_costs_as_much_as_its_contact_takes(
    looks: list[Nanos], shape: Box | Cylinder, most: int, beside: int, changes: bool
) -> None:
    """Faces that only touch cost one look, an edge that comes near a few, and no search a year of halves."""
    piece = Body("piece", axis(at_speed(0.1e9)), shape)
    pair = Pair(piece, Body("post", FLOOR, CUBE, (10_000 * MM, beside, 0)))
    came = pair.next_change(0)
    assert came.changes is changes
    assert len(looks) < (most if changes else 4)
    if came.at is not None:
        assert [pair.overlap(came.at - 1), pair.overlap(came.at)] == [False, True]
        went = pair.next_change(came.at)
        assert went.at is not None
        assert [pair.overlap(went.at - 1), pair.overlap(went.at)] == [True, False]
    del looks[:]
    assert Pair(piece, Body("above", FLOOR, CUBE, (10_000 * MM, 0, 20 * MM))).next_change(0) == NEVER
    assert len(looks) < 4


def test_one_that_circles_a_column_at_a_constant_gap_does_not_touch_it(looks: list[Nanos]) -> None:
    """For ever, a hundredth of a mm away: seen from the table the column stands."""
    shoe = Body("shoe", table(3.0), CUBE, (60 * MM, 0, 0))
    assert Pair(shoe, Body("column", FLOOR, Cylinder(49_990_000, 10 * MM))).next_change(0) == NEVER
    assert len(looks) < 10


def test_what_an_arm_that_turns_for_ever_does_not_reach_costs_nothing(looks: list[Nanos]) -> None:
    arm = Body("arm", table(3.0), Box((100 * MM, 5 * MM, 5 * MM)), (100 * MM, 0, 0))
    assert Pair(arm, Body("post", FLOOR, Cylinder(10 * MM, 20 * MM), (150 * MM, 152 * MM, 0))).next_change(0) == NEVER
    assert Pair(arm, Body("below", FLOOR, CUBE, (150 * MM, 0, -15 * MM))).next_change(0) == NEVER
    assert len(looks) < 10


def test_a_pair_between_which_nothing_moves_is_constant(looks: list[Nanos]) -> None:
    gantry = axis(at_speed(1e9))
    pair = Pair(Body("one", gantry, CUBE), Body("other", Frame("plate", gantry, (5, 5, 5)), CUBE))
    assert pair.is_constant
    assert pair.next_change(0) == NEVER
    assert not looks


@pytest.mark.parametrize("seed", [3, 12, 25, 41, 77, 106])
def test_what_is_found_does_not_depend_on_when_and_how_far_was_looked(seed: int) -> None:
    def changes(most: int, also: list[Nanos]) -> list[Nanos]:
        pair, now, found = Pair(*bodies_of(random_scene(seed))), 0, []
        while True:
            at, is_change = pair.next_change(now, most)
            if at is None:
                return found
            between = [moment for moment in also if now < moment < at]
            now = between[0] if between else at
            found += [now] if is_change and not between else []

    expected = changes(10**6, [])
    assert changes(7, []) == expected
    assert changes(10**6, [n * 7_654_321 for n in range(60)]) == expected


def test_an_end_of_the_looks_gives_a_moment_to_go_on_from() -> None:
    """Nothing is left out silently."""
    arm = Body("arm", table(3.0), Box((100 * MM, 5 * MM, 5 * MM)), (100 * MM, 0, 0))
    ring = Body("ring", FLOOR, CUBE, (-14 * MM, 1 * MM, 14 * MM))
    look = Pair(arm, ring).next_change(0, 3)
    assert look.at is not None
    assert not look.changes
    assert look.at > 0
