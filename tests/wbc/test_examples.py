"""The example machines at work: sensors go in, drives and outputs come out, as their first lines say."""

from __future__ import annotations

from itertools import pairwise
from math import hypot

import pytest
from mic488_rig import RUNNING, STOPPED, Rig, example

from steptwin.mic488.encoder import Coupling

FILTER_S = 0.01
"""Of the inputs that are configured with none longer."""


def place_switch(rig: Rig, axis: int, pin: str, gear: float, at_u: float = -5.0) -> None:
    """A home switch that is on from ``at_u`` downwards."""
    rig.switch(axis, None, round(at_u * gear), pin)


# ---------------------------------------------------------------------- pick and place


@pytest.fixture
def arm() -> Rig:
    rig = example("pick_and_place")
    place_switch(rig, 1, "IN1", 80.0)
    place_switch(rig, 2, "IN2", 160.0)
    rig.start()
    return rig


def arm_waits(rig: Rig) -> None:
    """Homed and at the waiting place, gripper first."""
    rig.wait(0.1)
    assert (rig.status(2), rig.status(1)) == (6, 1)
    rig.until(2, 4)
    rig.wait(0.01)
    assert rig.status(1) == 6
    rig.until(1, 4)
    rig.wait(5.0)
    assert [(rig.status(axis), rig.position(axis)) for axis in (1, 2)] == [(4, 120.0), (4, 20.0)]


def test_pick_and_place_carries_a_part(arm: Rig) -> None:
    arm_waits(arm)
    assert not any(arm.out(n) for n in (1, 2, 3, 8))
    arm.pin("IN7", 1.0)
    offered = arm.now / 1e9
    arm.pin("IN5", 1.0)
    busy = arm.pin_until("OUT2", 1.0)
    assert 0.0 < busy - offered < 0.2
    gripped = arm.pin_until("OUT1", 1.0)
    assert (arm.position(1), arm.position(2)) == (40.5, 85.5)
    arm.pin("IN5", 0.0)
    arm.pin_until("OUT3", 1.0)
    assert arm.now / 1e9 - gripped > 0.2
    assert arm.position(2) == 20.0
    # It waits above the station until there is room.
    arm.wait(10.0)
    assert (arm.position(1), arm.position(2)) == (310.0, 20.0)
    assert arm.out(1)
    arm.pin("IN6", 1.0)
    arm.pin_until("OUT1", 0.0)
    assert (arm.position(1), arm.position(2)) == (310.0, 78.25)
    arm.pin_until("OUT3", 0.0)
    arm.pin_until("OUT2", 0.0)
    assert arm.position(2) == 20.0
    assert (arm.i(10), arm.state) == (1, RUNNING)


def test_pick_and_place_shows_a_missing_part_and_goes_on(arm: Rig) -> None:
    arm_waits(arm)
    arm.pin("IN5", 1.0)
    lit = arm.pin_until("OUT8", 1.0)
    arm.pin("IN5", 0.0)
    assert arm.out(1) is False or arm.pin_until("OUT1", 0.0) - lit < 0.01
    dark = arm.pin_until("OUT8", 0.0)
    assert dark - lit > 1.0
    assert (arm.position(1), arm.position(2)) == (120.0, 20.0)
    arm.wait(5.0)
    assert (arm.i(10), arm.state) == (0, RUNNING)


def test_pick_and_place_ends_when_the_master_has_enough(arm: Rig) -> None:
    arm_waits(arm)
    arm.i(0, 3)
    for pin in ("IN5", "IN6", "IN7"):
        arm.pin(pin, 1.0)
    arm.pin_until("M1_EN", 0.0)
    assert (arm.i(10), arm.state, arm.m_status) == (3, STOPPED, 0)
    assert (arm.position(1), arm.position(2)) == (0.0, 0.0)
    assert not any(value for pin, value in arm.pins().items() if pin.startswith("OUT") or pin.endswith("EN"))
    grips = [time for time, on in arm.changes("OUT1") if on]
    assert len(grips) == 3
    # Every part takes the same time, give or take a look.
    assert grips[2] - grips[1] == pytest.approx(grips[1] - grips[0], abs=0.002)


# ---------------------------------------------------------------------- feeder


def feeder(speed: float = 80.0, length: float = 25.0) -> Rig:
    rig = example("feeder")
    rig.start()
    rig.wait(0.05)
    rig.r(0, length)
    rig.r(2, speed)
    rig.pin("IN2", 1.0)
    return rig


@pytest.mark.parametrize(("speed", "length"), [(80.0, 25.0), (20.0, 60.5), (110.0, 40.0)])
def test_feeder_cuts_where_the_mark_was_seen(speed: float, length: float) -> None:
    rig = feeder(speed, length)
    rig.wait(1.0)
    assert rig.velocity(1) == pytest.approx(speed)
    before = rig.position(1)
    rig.pin("IN1", 1.0)
    rig.pin_until("OUT1", 1.0)
    # The input passes its filter, the interrupt reads the position within a statement or two.
    earliest = before + speed * FILTER_S + length
    assert earliest - 0.02 <= rig.position(1) <= earliest + speed * 0.002 + 0.02
    assert rig.velocity(1) == 0.0
    on = rig.now / 1e9
    assert rig.pin_until("OUT1", 0.0) - on == pytest.approx(0.15, abs=0.002)
    rig.wait(3.0)
    assert rig.i(10) == 0  # the mark is still there
    rig.pin("IN1", 0.0)
    rig.wait(0.5)
    assert (rig.i(10), rig.velocity(1)) == (1, pytest.approx(speed))
    assert rig.position(1) < speed * 0.5


def test_feeder_reports_material_that_has_run_out() -> None:
    rig = feeder()
    rig.pin_until("OUT8", 1.0)
    assert (rig.i(11), rig.velocity(1)) == (1, 0.0)
    assert 500.0 < rig.position(1) < 510.0
    rig.pin("IN2", 0.0)
    rig.pin_until("OUT8", 0.0)
    rig.wait(2.0)
    assert (rig.i(11), rig.velocity(1), rig.state) == (0, 0.0, RUNNING)
    rig.pin("IN2", 1.0)
    rig.wait(1.0)
    assert rig.velocity(1) == 80.0


# ---------------------------------------------------------------------- plotter

FRAME = ((20.0, 20.0), (180.0, 20.0), (180.0, 120.0), (20.0, 120.0), (20.0, 20.0))
CENTRE, RADIUS = (100.0, 70.0), 30.0
CORNER = ((160.0, 30.0), (170.0, 40.0))


def from_segment(x: float, y: float, begin: tuple[float, float], end: tuple[float, float]) -> float:
    dx, dy = end[0] - begin[0], end[1] - begin[1]
    along = min(max(((x - begin[0]) * dx + (y - begin[1]) * dy) / (dx * dx + dy * dy), 0.0), 1.0)
    return hypot(x - begin[0] - along * dx, y - begin[1] - along * dy)


def crosses() -> list[tuple[tuple[float, float], tuple[float, float]]]:
    strokes = []
    for n in range(4):
        x, y = 40.0 + 15.0 * n, 100.0
        strokes += [((x, y), (x + 4.0, y + 4.0)), ((x + 4.0, y), (x, y + 4.0))]
    return strokes


def test_plotter_draws_what_it_says() -> None:
    rig = example("xy_plot")
    place_switch(rig, 1, "IN1", 100.0)
    place_switch(rig, 2, "IN2", 100.0)
    rig.start()
    rig.wait(5.0)
    assert [(rig.status(axis), rig.position(axis)) for axis in (1, 2)] == [(4, 0.0), (4, 0.0)]
    rig.pin("IN3", 1.0)
    drawn: list[tuple[float, float]] = []
    for _ in range(6000):
        rig.wait(0.007)
        if rig.out(1):
            drawn.append((rig.position(1), rig.position(2)))
    assert rig.state == RUNNING
    assert (rig.position(1), rig.position(2)) == (20.0, 20.0)
    pulse = 0.01 * 2**0.5 + 1e-4
    left = drawn
    for begin, end in (*pairwise(FRAME), *crosses()):
        on = [place for place in left if from_segment(*place, begin, end) <= pulse]
        assert begin in on
        # The pen goes up as soon as a stroke ends.
        assert min(hypot(x - end[0], y - end[1]) for x, y in on) <= 0.3
        left = [place for place in left if place not in on or place in (begin, end)]
    round_ = [(x, y) for x, y in left if abs(hypot(x - CENTRE[0], y - CENTRE[1]) - RADIUS) <= pulse]
    # The whole circle, clockwise, from the point nearest the origin.
    assert len(round_) > 150
    first = (CENTRE[0] - RADIUS * 100 / hypot(*CENTRE), CENTRE[1] - RADIUS * 70 / hypot(*CENTRE))
    assert round_[0] == pytest.approx(first, abs=0.01)
    assert round_[-1] == pytest.approx(first, abs=0.01)
    turns = [(ax - CENTRE[0]) * (by - CENTRE[1]) - (ay - CENTRE[1]) * (bx - CENTRE[0]) for (ax, ay), (bx, by) in pairwise(round_)]
    assert max(turns) <= 0.0
    ends = {*FRAME, *(place for stroke in crosses() for place in stroke)}
    corner = [place for place in left if place not in round_ and place not in ends]
    assert corner[0] == CORNER[0]
    assert corner[-1] == CORNER[1]
    radii = {centre: max(abs(hypot(x - centre[0], y - centre[1]) - 10.0) for x, y in corner) for centre in ((170, 30), (160, 40))}
    assert min(radii.values()) <= pulse
    rig.pin("IN3", 0.0)
    rig.wait(2.0)
    assert not rig.out(1)


# ---------------------------------------------------------------------- press


@pytest.fixture
def press() -> Rig:
    rig = example("press")
    place_switch(rig, 1, "IN3", 400.0)
    rig.pin("IN4", 1.0)
    rig.wait(0.1)
    rig.start()
    rig.pin_until("OUT3", 1.0)
    assert rig.position(1) == 0.0
    return rig


def both_hands(rig: Rig, apart: float = 0.1) -> None:
    rig.wait(0.2)
    rig.pin("IN1", 1.0)
    rig.wait(apart)
    rig.pin("IN2", 1.0)


def hands_off(rig: Rig) -> None:
    rig.pin("IN1", 0.0)
    rig.pin("IN2", 0.0)


def test_press_makes_a_good_part(press: Rig) -> None:
    both_hands(press)
    press.pin_until("OUT3", 0.0)
    hands_off(press)
    press.pin_until("OUT1", 1.0)
    assert press.position(1) == 42.5
    press.pin_until("OUT3", 1.0)
    assert (press.position(1), press.i(0), press.i(1)) == (0.0, 1, 0)
    assert 0.0 <= press.r(20) <= 0.4
    assert press.out(1)
    assert not press.out(2)


def test_press_rejects_a_part_that_is_too_hard(press: Rig) -> None:
    both_hands(press)
    press.pin_until("OUT3", 0.0)
    hands_off(press)
    press.wait(1.5)
    assert press.position(1) > 30.0
    assert press.velocity(1) == 8.0
    press.device.couple_encoder(1, Coupling.BLOCKED, press.now)
    press.pin_until("OUT2", 1.0)
    assert 30.0 < press.position(1) < 42.5
    assert 0.4 < press.r(20) < 0.6
    press.device.couple_encoder(1, Coupling.DRIVE, press.now)
    press.pin_until("OUT3", 1.0, within=20.0)
    assert (press.i(0), press.i(1)) == (0, 1)


def test_press_refuses_a_hand_that_was_tied_down(press: Rig) -> None:
    both_hands(press, apart=2.0)
    press.wait(3.0)
    assert (press.position(1), press.status(1)) == (0.0, 4)
    assert press.out(3)


def test_press_stops_when_the_light_curtain_is_broken(press: Rig) -> None:
    both_hands(press)
    press.pin_until("OUT3", 0.0)
    hands_off(press)
    press.wait(0.35)
    assert press.velocity(1) == 60.0
    before = press.position(1)
    press.pin("IN4", 0.0)
    # 50 ms of filter, then at once.
    press.wait(0.06)
    assert press.velocity(1) == 0.0
    assert press.position(1) - before <= 60.0 * 0.056
    assert press.out(2)
    press.wait(5.0)
    assert press.velocity(1) == 0.0
    press.pin("IN4", 1.0)
    press.pin_until("OUT3", 1.0)
    assert (press.position(1), press.i(0), press.i(1)) == (0.0, 0, 0)


def test_press_lets_a_hand_in_while_the_ram_is_up(press: Rig) -> None:
    press.pin("IN4", 0.0)
    press.wait(0.5)
    press.pin("IN4", 1.0)
    press.wait(0.5)
    assert not press.out(2)
    both_hands(press)
    press.pin_until("OUT1", 1.0)


# ---------------------------------------------------------------------- slave


@pytest.fixture
def served() -> Rig:
    rig = example("slave")
    rig.start()
    rig.wait(0.1)
    return rig


def test_slave_answers_commands_within_a_few_statements(served: Rig) -> None:
    for counted in (1, 2, 3):
        served.i(100, 1)
        served.wait(0.02)
        assert (served.i(100), served.i(101), served.d(102)) == (0, 1, counted)
    served.i(100, 2)
    served.wait(0.02)
    assert (served.i(101), served.d(102)) == (2, 0)
    served.r(104, 1.25)
    served.r(106, -3.5)
    served.i(100, 3)
    served.wait(0.02)
    assert served.r(108) == -2.25


@pytest.mark.parametrize("later_ms", range(15))
def test_slave_hears_a_command_whenever_it_follows_its_operands(served: Rig, later_ms: int) -> None:
    served.r(104, 1.25)
    served.r(106, -3.5)
    served.wait(later_ms / 1000)
    served.i(100, 3)
    served.wait(0.04)
    assert (served.i(100), served.i(101), served.r(108)) == (0, 3, -2.25)


def test_slave_shows_inputs_and_sets_outputs(served: Rig) -> None:
    served.pin("IN2", 1.0)
    served.pin("IN16", 1.0)
    served.pin("IN17", 1.0)  # not one of the first sixteen
    served.wait(0.2)
    assert served.d(110) == 0x8002
    served.i(112, 0b1010_0001)
    served.wait(0.02)
    assert [n for n in range(1, 9) if served.out(n)] == [1, 6, 8]
    served.wait(10.0 - served.now / 1e9)
    assert served.i(120) == 9
    served.set("POS_ACT", 77.0)
    served.wait(0.2)
    assert served.r(114) == 77.0


# ---------------------------------------------------------------------- gate


def test_gate_opens_and_shuts() -> None:
    rig = example("gate")
    place_switch(rig, 1, "IN1", 20.0)
    rig.wait(3.0)
    assert (rig.state, rig.status(1), rig.position(1)) == (RUNNING, 4, 0.0)
    rig.pin("IN5", 1.0)
    lit = rig.pin_until("OUT1", 1.0)
    dark = rig.pin_until("OUT1", 0.0)
    # 850 mm at 200 mm/s with ramps of 150 mm/s².
    assert dark - lit == pytest.approx(850 / 200 + 200 / 150, abs=0.01)
    assert rig.position(1) == 850.0
    rig.pin("IN5", 0.0)
    rig.wait(20.0)
    assert (rig.position(1), rig.out(1)) == (850.0, False)
    rig.pin("IN6", 1.0)
    free = rig.now / 1e9
    assert rig.pin_until("OUT1", 1.0) - free == pytest.approx(5.0 + FILTER_S, abs=0.003)
    rig.pin_until("OUT1", 0.0)
    assert (rig.position(1), rig.state) == (0.0, RUNNING)
