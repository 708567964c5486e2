"""Motion statements. Lines and arcs are compared, moment by moment, with the ideal path worked out here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import atan2, cos, hypot, inf, radians, sin, sqrt

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mic488_rig import RUNNING, STOPPED, Rig, controller, programmed

from steptwin.controller import SECOND
from steptwin.mic488.config import AxisConfig
from steptwin.mic488.encoder import Coupling

XY = AxisConfig(gear=100.0, acc=400.0, dec=250.0, vel=60.0)
ON = "M1 = ON\nM2 = ON\n"
DONE = "WAITPOS\nOUT1 = ON\nWAIT 1 = 2\n"


def ready(text: str, rows: str = "", *axes: AxisConfig) -> Rig:
    rig = programmed(text, rows, controller(*(axes or (XY, XY))))
    rig.start()
    return rig


def failed(rig: Rig) -> str:
    assert (rig.state, rig.m_status) == (STOPPED, 2)
    fault = rig.device.program.fault
    assert fault is not None
    return fault.text


# ---------------------------------------------------------------------- single axes


def test_motion_statements_are_in_units() -> None:
    rig = ready(f"{ON}M3 = ON\nM4 = ON\nPABS M1 30\nPREL M2 -20,5\nVABS M3 40\nVABS M4 25\nDELAY 5\nVREL M4 -40\nWAIT 1 = 2\n")
    rig.wait(10)
    assert [rig.position(axis) for axis in (1, 2)] == [30.0, -20.5]
    assert [rig.velocity(axis) for axis in (3, 4)] == [40.0, -15.0]
    assert [rig.status(axis) for axis in (1, 2, 3, 4)] == [4, 4, 2, 2]


def test_home_goes_to_the_switch_its_sign_chooses() -> None:
    axis = replace(XY, in_kl=0, in_kr=1)
    rig = ready(
        "M1 = ON\nPABS M1 10\nWAITPOS\nHOME M1 -20\nWAITPOS\nOUT1 = ON\nHOME M1 20\nWAITPOS\nOUT2 = ON\nWAIT 1 = 2\n", "", axis
    )
    rig.switch(1, None, -500, "IN1")
    rig.switch(1, 2500, None, "IN2")
    rig.wait(1)
    assert rig.pin_until("OUT1", 1.0)
    assert (rig.device.axes[0].profile.count(rig.now), rig.position(1)) == (-500, 0.0)
    rig.pin_until("OUT2", 1.0)
    assert rig.device.axes[0].profile.count(rig.now) == 2500


@pytest.mark.parametrize(("statement", "ramps"), [("BRAKE", True), ("STOP", False)])
def test_brake_ramps_and_stop_does_not(statement: str, *, ramps: bool) -> None:
    rig = ready(f"M1 = ON\nVABS M1 50\nDELAY 1\n{statement} M1\nWAIT 1 = 2\n", "", XY)
    rig.wait(1.0035)
    assert (0 < rig.velocity(1) < 50) is ramps
    rig.wait(1)
    assert (rig.velocity(1), rig.status(1)) == (0, 1)


def test_brake_and_stop_take_position_moves_too() -> None:
    rig = ready(f"M1 = ON\nPABS M1 1000\nDELAY 1\nBRAKE M1\n{DONE}", "", XY)
    rig.wait(3)
    # DEC brakes a position move (MIC-29): 60²/(2·250) units.
    assert rig.changes("OUT1")[0][0] == pytest.approx(1.003 + 60 / 250 + 0.001, abs=0.0015)


def test_a_motion_of_a_drive_that_is_off_is_ignored_and_told() -> None:
    rig = ready(f"M2 = ON\nPABS M1 10\nMOVELIN @A\nWAITPOS\nOUT1 = ON\nWAIT 1 = 2\n{''}", "A;10;10;5;x\n")
    rig.wait(1)
    assert rig.out(1)
    assert (rig.position(1), rig.position(2), len(rig.events("drive-off"))) == (0, 0, 2)


def test_moveptp_starts_all_axes_of_a_row_in_the_same_instant() -> None:
    rig = ready(f"{ON}M4 = ON\nn = 1\nMOVEPTP n\nWAITPOS\nMOVEPTP @A\n{DONE}", "A;1;2;x;4\nB;10;x;30;40\n")
    rig.wait(0.0052)
    starts = [axis.profile.start for axis in rig.device.axes]
    assert starts[0] == starts[3] == 5_000_000
    rig.pin_until("OUT1", 1.0)
    # M3 is off: ignored. M2 was left alone first.
    assert [rig.position(axis) for axis in (1, 2, 3, 4)] == [1, 2, 0, 4]


def test_wbc_8_waitpos_skips_drives_that_are_off_and_never_ends_in_velocity_mode() -> None:
    rig = ready(f"M1 = ON\nM2 = ON\nPABS M1 5\nVABS M2 10\n{DONE}")
    rig.wait(50)
    assert not rig.out(1)
    assert rig.device.program.deadline() is None
    rig.word("M_DISABLE", 2)
    rig.wait(0.01)
    assert rig.out(1)


def test_wbc_8_a_drive_on_its_limit_or_in_error_has_finished() -> None:
    rig = ready(f"M1 = ON\nLimRM1 = 3\nPABS M1 5\n{DONE}")
    rig.wait(5)
    assert (rig.status(1), rig.position(1), rig.out(1)) == (10, 3.0, True)
    axis = replace(XY, pos_ctrl_mode=1, err_ctrl_mode=1)
    rig = ready(f"M1 = ON\nPABS M1 50\n{DONE}", "", axis)
    rig.device.couple_encoder(1, Coupling.BLOCKED, 0)
    rig.wait(5)
    assert (rig.status(1), rig.out(1)) == (5, True)


@pytest.mark.parametrize(("mode", "firmware", "state"), [(2, "1.23", 0), (2, "1.70", 2), (1, "1.70", 1), (3, "1.70", 2)])
def test_a_position_error_stops_the_program_or_from_1_70_pauses_it(mode: int, firmware: str, state: int) -> None:
    axis = replace(XY, pos_ctrl_mode=1, err_ctrl_mode=mode)
    rig = programmed("M1 = ON\nPABS M1 50\nDELAY 9\nOUT1 = ON\nWAIT 1 = 2\n", "", controller(axis), firmware)
    rig.device.couple_encoder(1, Coupling.BLOCKED, 0)
    rig.start()
    rig.wait(5)
    assert (rig.status(1), rig.state, rig.out(8)) == (5, state, mode == 3)


# ---------------------------------------------------------------------- the ideal path

Place = tuple[float, float]
EQUAL = (100.0, 100.0)
Curve = Callable[[float], Place]


def trapezoid(length: float, speed: float, acc: float, dec: float) -> Callable[[float], float]:
    """Way after t seconds: up with ``acc``, at most ``speed``, down with ``dec`` to stop at ``length``."""
    peak = min(speed, sqrt(2 * length * acc * dec / (acc + dec)))
    up, down = peak / acc, peak / dec
    flat = (length - peak * (up + down) / 2) / peak if peak else 0.0

    def travel(t: float) -> float:
        if t < up:
            return acc * t * t / 2
        if t < up + flat:
            return peak * up / 2 + peak * (t - up)
        rest = max(up + flat + down - t, 0.0)
        return length - dec * rest * rest / 2

    return travel


def check_curve(rig: Rig, begin_s: float, curve: Curve, travel: Callable[[float], float], gears: Place = (100.0, 100.0)) -> None:
    """From ``begin_s`` on, each axis' count is within a pulse of the curve at every moment looked at, up to its end."""
    x, y = rig.device.axes[:2]
    end = max(x.profile.end or 0, y.profile.end or 0)
    begin = round(begin_s * SECOND)
    assert end > begin
    assert {x.profile.end, y.profile.end} <= {begin, end}
    for k in range(401):
        at = begin + (end - begin) * k // 400
        ideal = curve(travel((at - begin) / SECOND))
        for axis, place, gear in zip((x, y), ideal, gears, strict=True):
            assert abs((axis.profile.count(at) + axis.offset_p) - place * gear) <= 1.0 + 1e-6


def line(begin: Place, end: Place) -> tuple[float, Curve]:
    length = hypot(end[0] - begin[0], end[1] - begin[1])
    return length, lambda s: (begin[0] + (end[0] - begin[0]) * s / length, begin[1] + (end[1] - begin[1]) * s / length)


def arc(centre: Place, radius: float, begin_rad: float, sweep_rad: float) -> tuple[float, Curve]:
    """``sweep_rad`` > 0 is counter-clockwise."""
    length = abs(sweep_rad) * radius
    turn = sweep_rad / length

    def curve(s: float) -> Place:
        return centre[0] + radius * cos(begin_rad + turn * s), centre[1] + radius * sin(begin_rad + turn * s)

    return length, curve


# ---------------------------------------------------------------------- lines

place = st.integers(-20000, 20000).map(lambda pulses: pulses / 100)


@settings(max_examples=30, deadline=None)
@given(x=place, y=place, speed=st.floats(0.5, 400).map(lambda v: round(v, 2)), relative=st.booleans())
def test_a_line_stays_within_a_pulse_and_ends_exactly(x: float, y: float, speed: float, *, relative: bool) -> None:
    keyword, begin = ("MOVELIN_REL", (-5.0, 7.0)) if relative else ("MOVELIN", (-5.0, 7.0))
    end = (begin[0] + x, begin[1] + y) if relative else (x, y)
    rig = ready(f"PosM1 = -5\nPosM2 = 7\n{ON}{keyword} @A\n{DONE}", f"A;{x};{y};{speed};x\n")
    rig.wait(0.0051)
    length, curve = line(begin, end)
    if round(length, 6):
        check_curve(rig, 0.005, curve, trapezoid(length, speed, 400, 250))
    rig.pin_until("OUT1", 1.0, 1000)
    assert (rig.position(1), rig.position(2)) == pytest.approx(end, abs=1e-4)
    assert (rig.status(1), rig.status(2)) == (4, 4)


@pytest.mark.parametrize("gears", [(100.0, 25.0), (3.0, 700.0)])
def test_a_line_is_straight_with_different_gears(gears: Place) -> None:
    rig = ready(f"{ON}MOVELIN @A\nWAIT 1 = 2\n", "A;30;-40;20;x\n", *(replace(XY, gear=gear) for gear in gears))
    rig.wait(0.0031)
    length, curve = line((0, 0), (30, -40))
    check_curve(rig, 0.003, curve, trapezoid(length, 20, 400, 250), gears)


def test_an_axis_left_alone_stays_and_wbc_11_vmax_of_m1_is_the_speed() -> None:
    rig = ready(f"{ON}AccM1 = 100\nVmaxM1 = 7\nMOVELIN @A\nWAIT 1 = 2\n", "A;x;30;x;x\n")
    rig.wait(0.0051)
    check_curve(rig, 0.005, line((0, 0), (0, 30))[1], trapezoid(30, 7, 100, 250))


def test_linacc_is_the_acceleration_of_lines_when_it_is_set() -> None:
    rig = ready(f"{ON}$R0 = LinAcc\nLinAcc = 50\n$R2 = LinAcc\nMOVELIN @A\nWAIT 1 = 2\n", "A;30;40;30;x\n")
    rig.wait(0.0061)
    check_curve(rig, 0.006, line((0, 0), (30, 40))[1], trapezoid(50, 30, 50, 50))
    assert (rig.r(0), rig.r(2)) == (400, 50)


def test_wbc_16_row_0_can_be_written_as_line_circle_or_position() -> None:
    rig = ready(
        f"{ON}M3 = ON\nLinX = 3\nLinY = LinX + 1\nLinVel = 10\n$R0 = CircR\nMOVELIN 0\nWAITPOS\n"
        f"PTPM1 = 1\nPTPM3 = 5\nMOVEPTP 0\nWAITPOS\n"
        "OUT1 = ON\nWAIT 1 = 2\n",
        "A;x;x;x;x\n",
    )
    rig.pin_until("OUT1", 1.0)
    assert (rig.r(0), [rig.position(axis) for axis in (1, 2, 3)]) == (10, [1, 4, 5])


def test_row_0_is_that_of_the_table_again_at_the_next_start() -> None:
    rig = ready("$R0 = LinX\nLinX = 8\n$R2 = LinX\nEND\n", "A;3;x;x;x\n")
    for _ in range(2):
        rig.wait(1)
        assert (rig.r(0), rig.r(2)) == (3, 8)
        rig.start()


def test_a_path_faster_than_the_outputs_is_clamped_and_told() -> None:
    rig = ready(f"{ON}MOVELIN @A\nWAIT 1 = 2\n", "A;3000;4000;5000;x\n", replace(XY, acc=9000.0, dec=9000.0))
    rig.wait(1)
    assert max(abs(axis.profile.velocity(rig.now)) for axis in rig.device.axes) == pytest.approx(64_000)
    assert len(rig.events("speed-clamped")) == 1


def test_wbc_26_a_path_begins_at_rest() -> None:
    rig = ready(f"{ON}VABS M1 50\nVABS M2 -20\nDELAY 1\nMOVELIN @A\nWAIT 1 = 2\n", "A;0;0;30;x\n")
    rig.wait(1.0051)
    before = rig.position(1), rig.position(2)
    check_curve(rig, 1.005, line(before, (0, 0))[1], trapezoid(hypot(*before), 30, 400, 250))


@pytest.mark.parametrize(
    ("leaving", "status"),
    [("word M_DISABLE", 0), ("limit switch", 10), ("stop", 1), ("other move", 4)],
)
def test_wbc_26_when_one_axis_leaves_the_path_the_other_ramps_down(leaving: str, status: int) -> None:
    axis = replace(XY, limit_mode=2, in_kr=0)
    rig = ready(f"{ON}MOVELIN @A\n{DONE}", "A;300;400;50;x\n", axis, XY)
    rig.wait(3)
    if leaving == "limit switch":
        rig.pin("IN1", 1)
    elif leaving == "stop":
        rig.stop(1)
    elif leaving == "other move":
        rig.set("POS_ABS", 90.0, 1)
    else:
        rig.word("M_DISABLE", 1)
    at = rig.position(2)
    assert rig.velocity(2) == pytest.approx(40)
    rig.wait(0.05)
    assert 0 < rig.velocity(2) < 40
    rig.pin_until("OUT1", 1.0)
    assert (rig.status(1), rig.status(2)) == (status, 1)
    assert rig.position(2) == pytest.approx(at + 40**2 / (2 * 250), abs=0.02)
    assert len(rig.events("path-left")) == 1


def test_the_end_of_a_path_is_no_leaving() -> None:
    rig = ready(f"{ON}MOVELIN @A\nWAITPOS\nMOVELIN @B\nWAITPOS\nMOVEPTP @A\nWAITPOS\nEND\n", "A;30;40;50;x\nB;30;0;50;x\n")
    rig.wait(30)
    assert (rig.state, rig.events("path-left")) == (STOPPED, [])


@pytest.mark.parametrize(
    ("limits", "stop", "statuses"),
    [
        ("LimRM1 = 15", (15, 20), (10, 1)),
        ("LimRM2 = 20", (15, 20), (1, 10)),
        ("LimRM1 = 15\nLimRM2 = 20", (15, 20), (10, 10)),
        ("LimLM1 = 5", (0, 0), (4, 4)),
    ],
)
def test_a_path_ends_on_the_first_soft_limit(limits: str, stop: Place, statuses: tuple[int, int]) -> None:
    rig = ready(f"{ON}{limits}\nMOVELIN @A\n{DONE}", "A;30;40;50;x\n")
    if statuses == (4, 4):
        # Behind a limit already, the way back is free.
        stop = (30, 40)
    rig.pin_until("OUT1", 1.0)
    assert (rig.position(1), rig.position(2)) == stop
    assert (rig.status(1), rig.status(2)) == statuses


def test_a_path_backwards_ends_on_the_lower_soft_limit() -> None:
    rig = ready(f"{ON}LimLM1 = -15\nMOVELIN @A\n{DONE}", "A;-30;40;50;x\n")
    rig.pin_until("OUT1", 1.0)
    assert (rig.position(1), rig.position(2)) == (-15, 20)
    assert (rig.status(1), rig.status(2)) == (9, 1)


@pytest.mark.parametrize(("beside", "permitted"), [("0.01", True), ("0.02", False)])
def test_a_circle_begins_a_pulse_beside_its_first_point_at_most(beside: str, *, permitted: bool) -> None:
    """At 100 pulses per unit."""
    rig = ready(f"{ON}PREL M1 {beside}\nWAITPOS\nDOCIRC @A\n{DONE}", "A;-10;0;10;90\n")
    rig.wait(5)
    assert rig.state == (RUNNING if permitted else STOPPED)


# ---------------------------------------------------------------------- circles and arcs


@settings(max_examples=25, deadline=None)
@given(
    x=st.integers(-80, 80),
    y=st.integers(-80, 80),
    radius=st.integers(1, 60),
    angle=st.sampled_from((90, -90, 360, -360, 45.5, -720, 1000)),
)
def test_a_circle_stays_within_a_pulse_and_ends_exactly(x: int, y: int, radius: int, angle: float) -> None:
    rig = ready(
        f"{ON}MOVETOCIRC @A\nWAITPOS\nOUT1 = ON\nDOCIRC @A\nWAITPOS\nOUT2 = ON\nWAIT 1 = 2\n", f"A;{x};{y};{radius};{angle}\n"
    )
    rig.pin_until("OUT1", 1.0)
    begin_rad = atan2(-y, -x) if x or y else 0.0
    assert (rig.position(1), rig.position(2)) == pytest.approx(
        (x + radius * cos(begin_rad), y + radius * sin(begin_rad)), abs=0.0051
    )
    begin = rig.now / SECOND + 0.001
    rig.wait(0.0011)
    # Positive angles are clockwise.
    length, curve = arc((x, y), radius, begin_rad, -radians(angle))
    check_curve(rig, begin, curve, trapezoid(length, 60, 400, 250))
    rig.pin_until("OUT2", 1.0, 1000)
    assert (rig.position(1), rig.position(2)) == pytest.approx(curve(length), abs=0.0051)
    assert (rig.status(1), rig.status(2)) == (4, 4)


def test_positive_angles_are_clockwise_with_x_right_and_y_up() -> None:
    # The point of the circle nearest the origin is its left one; from there clockwise goes up.
    rig = ready(f"{ON}MOVETOCIRC @A\nWAITPOS\nDOCIRC @A\n{DONE}", "A;50;0;10;90\n")
    rig.pin_until("OUT1", 1.0)
    assert (rig.position(1), rig.position(2)) == (50, 10)


@settings(max_examples=25, deadline=None)
@given(x=st.integers(1, 60), y=st.integers(1, 60), more=st.floats(0.01, 30).map(lambda v: round(v, 2)), internal=st.booleans())
def test_an_arc_stays_within_a_pulse_and_ends_exactly(x: int, y: int, more: float, *, internal: bool) -> None:
    begin, end = (10.0, 0.0), (-x / 1.0, y / 1.0)
    chord = hypot(end[0] - begin[0], end[1] - begin[1])
    radius = round(chord / 2 + more, 2)
    rig = ready(f"PosM1 = 10\n{ON}DOARC @A\n{DONE}", f"A;{-x};{y};{radius};{int(internal)}\n")
    rig.wait(0.0041)
    # The origin is on the left of the chord, from which it bulges away (external) or towards it.
    middle = ((begin[0] + end[0]) / 2, (begin[1] + end[1]) / 2)
    left = ((begin[1] - end[1]) / chord, (end[0] - begin[0]) / chord)
    origin_is_left = -(left[0] * middle[0] + left[1] * middle[1]) > 0
    bulge_left = origin_is_left is internal
    rise = sqrt(radius**2 - (chord / 2) ** 2) * (-1 if bulge_left else 1)
    centre = (middle[0] + left[0] * rise, middle[1] + left[1] * rise)
    sweep = 2 * atan2(chord / 2, abs(rise)) * (-1 if bulge_left else 1)
    length, curve = arc(centre, radius, atan2(begin[1] - centre[1], begin[0] - centre[0]), sweep)
    assert curve(length) == pytest.approx(end, abs=1e-6)
    check_curve(rig, 0.004, curve, trapezoid(length, 60, 400, 250))
    rig.pin_until("OUT1", 1.0, 1000)
    assert (rig.position(1), rig.position(2)) == end


def test_a_soft_limit_that_is_moved_out_of_the_way_leaves_an_arc_as_it_is() -> None:
    def moment_and_place(*, moves: bool) -> tuple[float, float, float]:
        rig = ready(f"{ON}MOVETOCIRC @A\nWAITPOS\nOUT2 = ON\nDOCIRC @A\n{DONE}", "A;50;0;10;90\n")
        rig.pin_until("OUT2", 1.0)
        rig.wait(0.1)
        if moves:
            rig.set("POSLIM_R", 1000.0, 1)
            rig.set("POSLIM_L", -1000.0, 2)
        return rig.pin_until("OUT1", 1.0), rig.position(1), rig.position(2)

    assert moment_and_place(moves=True) == moment_and_place(moves=False)


PATHS = {
    "MOVELIN": ("A;80;40;50;x\n", "", "MOVELIN @A"),
    "MOVELIN_REL": ("A;80;40;50;x\n", "", "MOVELIN_REL @A"),
    "DOCIRC": ("A;50;0;50;180\n", "", "DOCIRC @A"),
    "DOARC": ("A;100;0;50;0\n", "", "DOARC @A"),
}
"""From (0, 0); each goes past X = 30 and Y = 20 outwards within 3 s."""


LIMITS = [("POSLIM_R", 1), ("POSLIM_R", 2), ("POSLIM_L", 1)]


def on_path(keyword: str) -> Rig:
    """A controller half a second after a path began."""
    rows, before, statement = PATHS[keyword]
    rig = ready(f"{ON}{before}OUT2 = ON\n{statement}\n{DONE}", rows)
    rig.pin_until("OUT2", 1.0)
    rig.wait(0.5)
    assert 0 < rig.position(1) < 30
    return rig


def ideal(keyword: str, x: float) -> float:
    """Y of each path at ``x``, before its highest point."""
    return x / 2 if keyword.startswith("MOVELIN") else sqrt(50**2 - (50 - x) ** 2)


@pytest.mark.parametrize("how", ["limit", "coordinate", "limit of both"])
@pytest.mark.parametrize("keyword", PATHS)
def test_mic_40_a_soft_limit_written_on_a_path_ends_it_there(keyword: str, how: str) -> None:
    rig = on_path(keyword)
    limit = 30.0
    if how == "coordinate":
        # The limit is 20 mm ahead of where it was written.
        rig.set("POSLIM_R", 90.0, 1)
        rig.set("POS_ACT", rig.position(1) + 60.0, 1)
        limit = 90.0
    else:
        rig.set("POSLIM_R", limit, 1)
    if how == "limit of both":
        rig.set("POSLIM_R", 1000.0, 2)
    rig.pin_until("OUT1", 1.0)
    assert rig.position(1) == limit
    assert rig.position(2) == pytest.approx(ideal(keyword, 30.0), abs=0.03)
    assert (rig.status(1), rig.status(2), rig.events("overrun"), rig.events("path-left")) == (10, 1, [], [])
    assert not any(axis.profile.moving(rig.device.now) for axis in rig.device.axes)


@pytest.mark.parametrize("keyword", PATHS)
def test_mic_40_a_path_whose_limit_is_moved_out_of_the_way_again_goes_on(keyword: str) -> None:
    rig, undisturbed = on_path(keyword), on_path(keyword)
    rig.set("POSLIM_R", 30.0, 1)
    rig.wait(0.1)
    rig.set("POSLIM_R", 1000.0, 1)
    for one in (rig, undisturbed):
        one.pin_until("OUT1", 1.0)
    assert (rig.position(1), rig.position(2)) == (undisturbed.position(1), undisturbed.position(2))
    assert (rig.status(1), rig.status(2)) == (4, 4)


@pytest.mark.parametrize("keyword", PATHS)
def test_mic_40_a_path_that_cannot_brake_before_a_limit_overruns_on_its_curve(keyword: str) -> None:
    rig = on_path(keyword)
    here = rig.position(1)
    rig.set("POSLIM_R", here, 1)
    rig.pin_until("OUT1", 1.0)
    assert here < rig.position(1) < here + 25
    assert rig.position(2) == pytest.approx(ideal(keyword, rig.position(1)), abs=0.03)
    assert (rig.status(1), rig.status(2), len(rig.events("overrun"))) == (10, 1, 1)


def test_mic_40_a_limit_behind_a_path_lets_it_go_on() -> None:
    rig = on_path("MOVELIN")
    rig.set("POSLIM_L", 50.0, 1)
    rig.pin_until("OUT1", 1.0)
    assert (rig.position(1), rig.position(2), rig.status(1), rig.status(2)) == (80, 40, 4, 4)


@settings(max_examples=40, deadline=None)
@given(
    keyword=st.sampled_from(sorted(PATHS)),
    written=st.lists(
        st.tuples(
            st.integers(1, 400), st.sampled_from([("POSLIM_R", 1), ("POSLIM_R", 2), ("POSLIM_L", 1)]), st.integers(-20, 120)
        ),
        min_size=1,
        max_size=4,
    ),
)
def test_mic_40_a_path_stays_on_its_course_whatever_limits_are_written(
    keyword: str, written: list[tuple[int, tuple[str, int], int]]
) -> None:
    """The counts stay within a pulse of the path, and what is restored on the way goes on alike."""
    rig, other = on_path(keyword), on_path(keyword)
    for wait_ms, (key, axis), value in written:
        rig.set(key, float(value), axis)
        other.device.restore(rig.device.snapshot())
        for one in (rig, other):
            one.wait(wait_ms / 1000)
        x, y = rig.position(1), rig.position(2)
        assert (other.position(1), other.position(2)) == (x, y)
        if keyword.startswith("MOVELIN"):
            assert y == pytest.approx(x / 2, abs=0.02)
        else:
            assert hypot(x - 50, y) == pytest.approx(50, abs=0.02)
    rig.pin_until("OUT1", 1.0)
    statuses = {rig.status(1), rig.status(2)}
    assert statuses == {4} or statuses <= {1, 9, 10}
    assert statuses != {1}


def test_an_arc_ends_on_a_soft_limit() -> None:
    rig = ready(f"{ON}LimRM2 = 8\nMOVETOCIRC @A\nWAITPOS\nDOCIRC @A\n{DONE}", "A;50;0;10;180\n")
    rig.pin_until("OUT1", 1.0)
    assert (rig.position(1), rig.position(2)) == pytest.approx((44, 8), abs=0.011)
    assert (rig.status(1), rig.status(2)) == (1, 10)


def test_wbc_17_encoder_correction_is_off_on_circles_and_on_on_lines() -> None:
    axis = replace(XY, pos_ctrl_mode=1, err_ctrl_mode=1, mot_resol=400)
    text = f"{ON}MOVETOCIRC @A\nWAITPOS\nOUT1 = ON\nDELAY 1\nDOCIRC @A\nWAITPOS\nOUT2 = ON\nMOVELIN @B\nWAITPOS\nWAIT 1 = 2\n"
    rig = ready(text, "A;50;0;10;180\nB;60;50;20;x\n", axis, XY)
    rig.pin_until("OUT1", 1.0)
    rig.wait(0.1)
    rig.device.turn_encoder(1, -30, rig.now)
    rig.pin_until("OUT2", 1.0)
    assert rig.status(1) == 4
    statuses = set()
    for _ in range(300):
        rig.wait(0.02)
        statuses.add(rig.status(1))
    assert 8 in statuses


# ---------------------------------------------------------------------- what cannot be


@pytest.mark.parametrize(
    ("lines", "rows", "text"),
    [
        ("DOARC n", "A;0;0;1;x\nB;100;0;10;0\n", "radius = 10: must be at least 50, half the distance of the ends"),
        ("DOARC n", "A;0;0;1;x\nB;0;0;10;0\n", "an arc needs an end point other than its beginning"),
        ("DOARC n", "A;0;0;1;x\nB;5;0;10;2\n", "p4 is 2 and must be 0 (external arc) or 1 (internal arc)"),
        ("DOARC n", "A;0;0;1;x\nB;5;0;10;x\n", "p4 missing"),
        ("MOVETOCIRC n", "A;0;0;1;x\nB;5;0;0;x\n", "the radius p3 is 0 and must be greater than 0"),
        ("MOVETOCIRC n", "A;0;0;1;x\nB;5;x;1;x\n", "p2 missing"),
        ("DOCIRC n", "A;0;0;1;x\nB;x;x;1;x\n", "p1, p2, p4 missing"),
        (
            "DOCIRC n",
            "A;0;0;1;x\nB;50;0;10;360\n",
            "DOCIRC begins at (40, 0), but the axes are at (0, 0): go there with",
        ),
        ("DOCIRC n", "A;0;0;1;x\nB;10;0;10;400000\n", "angle = -400000°: must be within ±360000°"),
        ("MOVELIN n", "A;0;0;1;x\nB;5;5;-1;x\n", "the path velocity p3 must be greater than 0"),
        ("n = 2\nMOVEPTP n", "A;0;0;1;x\nB;5;5;-1;x\n", "MOVEPTP 2: the position table has rows 0…1"),
        ("n = -1\nMOVEPTP n", "A;0;0;1;x\nB;5;5;-1;x\n", "MOVEPTP -1: the position table has rows 0…1"),
        ("n = 0.5\nMOVEPTP n", "A;0;0;1;x\nB;5;5;-1;x\n", "MOVEPTP 0.5: the position table has rows 0…1"),
        ("MOVEPTP n", "A;0;0;1;x\nB;99999999999;5;-1;x\n", "permitted are -21474836.48…21474836.47 imp"),
        ("MOVELIN_REL n", "A;0;0;1;x\nB;99999999999;5;1;x\n", "permitted are -21474836.48…21474836.47 imp"),
    ],
)
def test_rows_that_cannot_be_a_path_are_program_errors(lines: str, rows: str, text: str) -> None:
    rig = ready(f"{ON}n = 1\n{lines}\nWAITPOS\nEND\n", rows)
    rig.wait(0.1)
    assert text in failed(rig)


@pytest.mark.parametrize(("radius", "permitted"), [(4.995, True), (4.99, True), (4.985, False)])
def test_a_radius_may_be_a_pulse_smaller_than_half_the_distance(radius: float, *, permitted: bool) -> None:
    """10 units apart, at 100 pulses per unit."""
    rig = ready(f"{ON}DOARC @A\n{DONE}", f"A;10;0;{radius};0\n")
    rig.wait(5)
    assert rig.state == (RUNNING if permitted else STOPPED)
    assert rig.position(1) == (10 if permitted else 0)


def test_an_angle_of_0_moves_nothing_and_goes_on() -> None:
    rig = ready(
        f"{ON}MOVETOCIRC @A\nWAITPOS\nDOCIRC @A\nWAITPOS\nMOVELIN @B\n{DONE}",
        "A;50;0;10;0\nB;40;x;5;x\n",
    )
    rig.wait(5)
    assert (rig.state, rig.out(1), rig.position(1)) == (RUNNING, True, 40)


def test_the_ideal_trapezoid_of_these_tests_is_one() -> None:
    travel = trapezoid(50, 20, 100, 50)
    speeds = [(travel(t / 1000 + 1e-6) - travel(t / 1000)) / 1e-6 for t in range(3000)]
    assert max(speeds) == pytest.approx(20, rel=1e-4)
    assert travel(inf) == 50
