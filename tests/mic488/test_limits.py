"""Soft limits and limit switches (MIC-12): where motions end, and how one gets away again."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mic488_rig import VALUES, Rig, controller, real_words, word_pdu, words_pdu

from steptwin.controller import SECOND
from steptwin.mic488.config import AxisConfig, InputConfig

OFF, ON, VELOCITY, POSITION, REACHED, LIMIT_L, LIMIT_R = 0, 1, 2, 3, 4, 9, 10
KL, KR = "IN1", "IN2"


def with_switches(limit_mode: int = 3, **config: float) -> Rig:
    rig = Rig(controller(AxisConfig(limit_mode=limit_mode, in_kl=0, in_kr=1, **config)))  # type: ignore[arg-type]
    rig.enable(1)
    return rig


# ---------------------------------------------------------------------- soft limits


def test_mic_12_nothing_limits_at_power_on(rig: Rig) -> None:
    rig.use_dint()
    assert rig.get("POSLIM_L") == -(2**31)
    assert rig.get("POSLIM_R") == 2**31 - 1
    rig.set("POS_ABS", 2**31 - 1)
    assert rig.status() == POSITION
    rig.stop()
    rig.set("POS_ACT", 2**31 - 100)
    rig.set("VEL_ABS", 1000)
    rig.wait(10.0)
    assert rig.status() == VELOCITY


@pytest.mark.parametrize("gear", [1.0, 100.0, 0.3, 12800.0, 1e-20, 1e6])
def test_mic_12_limits_that_do_not_limit_are_written_back_as_they_were_read(gear: float) -> None:
    rig = Rig(controller(AxisConfig(gear=gear)))
    for limit in ("POSLIM_L", "POSLIM_R"):
        rig.set(limit, rig.get(limit))
    rig.use_dint()
    assert (rig.get("POSLIM_L"), rig.get("POSLIM_R")) == (-(2**31), 2**31 - 1)


@pytest.mark.parametrize("value", [2147484160.0, -2147484160.0, 3e9])
def test_mic_7_positions_beyond_what_is_counted_are_refused(rig: Rig, value: float) -> None:
    for register in ("POSLIM_R", "POS_ABS", "POS_ACT"):
        assert rig.exception(words_pdu(rig.base + VALUES[register], *real_words(value))) == 3


@pytest.mark.parametrize(("sign", "limit", "reached"), [(1, "POSLIM_R", LIMIT_R), (-1, "POSLIM_L", LIMIT_L)])
def test_mic_12_moves_are_planned_to_stop_on_the_limit(rig: Rig, sign: int, limit: str, reached: int) -> None:
    rig.set(limit, sign * 1500.0)
    rig.set("POS_ABS", sign * 9000.0)
    rig.wait(2.0)
    assert (rig.status(), rig.velocity()) == (POSITION, pytest.approx(sign * 500.0))
    rig.wait(0.5)
    assert (rig.status(), rig.position(), rig.velocity()) == (reached, sign * 1500.0, 0.0)
    assert rig.events("overrun") == []


@pytest.mark.parametrize(("sign", "limit", "reached"), [(1, "POSLIM_R", LIMIT_R), (-1, "POSLIM_L", LIMIT_L)])
def test_mic_12_velocity_mode_brakes_with_acc_to_stop_on_the_limit(rig: Rig, sign: int, limit: str, reached: int) -> None:
    rig.set("ACC", 500.0)
    rig.set(limit, sign * 2000.0)
    rig.set("VEL_ABS", sign * 1000.0)
    rig.wait(2.0)
    assert (rig.status(), rig.velocity(), rig.position()) == (VELOCITY, sign * 1000.0, sign * 1000.0)
    rig.wait(1.0)
    assert rig.velocity() == pytest.approx(sign * 500.0)
    rig.wait(1.0)
    assert (rig.status(), rig.position()) == (reached, sign * 2000.0)


def test_mic_12_jog_stops_on_the_limit_and_goes_back(rig: Rig) -> None:
    rig.set("POSLIM_R", 300.0)
    rig.jog(1, +1, True)
    rig.until(1, LIMIT_R)
    assert rig.position() == 300.0
    rig.jog(1, +1, False)
    assert rig.status() == LIMIT_R
    rig.jog(1, -1, True)
    rig.wait(0.5)
    assert rig.status() == VELOCITY
    rig.jog(1, -1, False)
    rig.until(1, ON)
    assert rig.position() == pytest.approx(300.0 - 250.0)


def test_a_target_on_the_limit_is_reached(rig: Rig) -> None:
    rig.set("POSLIM_R", 100.0)
    rig.set("POS_ABS", 100.0)
    rig.until(1, REACHED)
    assert rig.position() == 100.0


def test_at_the_limit_only_the_way_back_is_open(rig: Rig) -> None:
    rig.set("POSLIM_R", 100.0)
    rig.set("POS_ABS", 200.0)
    rig.until(1, LIMIT_R)
    for key, value in (("POS_ABS", 500.0), ("POS_REL", 1.0), ("VEL_ABS", 10.0)):
        rig.set(key, value)
        assert (rig.status(), rig.velocity()) == (LIMIT_R, 0.0)
    rig.wait(1.0)
    assert rig.position() == 100.0
    rig.set("POS_REL", -30.0)
    rig.until(1, REACHED)
    assert rig.position() == 70.0
    rig.set("VEL_ABS", -10.0)
    assert rig.status() == VELOCITY


@pytest.mark.parametrize(("sign", "limit", "reached"), [(1, "POSLIM_R", LIMIT_R), (-1, "POSLIM_L", LIMIT_L)])
def test_outside_the_limits_nothing_moves_farther_out_and_everything_back_in(
    rig: Rig, sign: int, limit: str, reached: int
) -> None:
    rig.set("POS_ABS", sign * 200.0)
    rig.until(1, REACHED)
    rig.set(limit, sign * 100.0)
    assert rig.status() == REACHED
    for key, value in (("POS_ABS", 250.0), ("POS_REL", 1.0), ("VEL_ABS", 10.0)):
        rig.set(key, sign * value)
        assert rig.status() == reached, key
        rig.wait(1.0)
        assert rig.position() == sign * 200.0, key
    rig.set("POS_ABS", sign * 150.0)  # still outside, but nearer
    rig.until(1, REACHED)
    assert rig.position() == sign * 150.0
    rig.set("VEL_ABS", sign * -10.0)
    assert rig.status() == VELOCITY
    rig.set("POS_ABS", sign * 50.0)
    rig.until(1, REACHED)
    rig.set("POS_ABS", sign * 150.0)
    rig.until(1, reached)
    assert rig.position() == sign * 100.0


def test_outward_while_still_outside_and_moving_in_comes_to_rest(rig: Rig) -> None:
    rig.set("POS_ABS", 1000.0)
    rig.until(1, REACHED)
    rig.set("POSLIM_R", 100.0)
    rig.set("POS_ABS", 0.0)
    rig.wait(0.2)  # 200 u/s: braking takes 20 u
    assert rig.position() == 980.0
    rig.set("POS_ABS", 2000.0)
    rig.until(1, LIMIT_R)
    assert rig.position() == pytest.approx(960.0, abs=1.0)


def test_outward_while_moving_in_fast_returns_to_the_limit(rig: Rig) -> None:
    rig.set("POS_ABS", 1000.0)
    rig.until(1, REACHED)
    rig.set("POSLIM_R", 500.0)
    rig.set("VEL_ABS", -800.0)
    rig.wait(0.9)  # at 600, coming to rest takes 320 u
    rig.set("VEL_ABS", 300.0)
    rig.wait(1.0)
    assert rig.position() < 500.0
    rig.until(1, LIMIT_R)
    assert rig.position() == 500.0


def test_a_limit_put_before_a_motion_in_flight_is_respected(rig: Rig) -> None:
    rig.set("VEL_ABS", 1000.0)
    rig.wait(2.0)
    rig.set("POSLIM_R", 3000.0)
    assert rig.velocity() == 1000.0
    rig.until(1, LIMIT_R)
    assert rig.position() == 3000.0
    rig.set("POS_ABS", 0.0)
    rig.wait(0.5)
    rig.set("POSLIM_L", 1000.0)
    rig.until(1, LIMIT_L)
    assert rig.position() == 1000.0


def test_a_limit_moved_away_from_a_motion_in_flight_lets_it_go_on(rig: Rig) -> None:
    rig.set("POSLIM_R", 1000.0)
    rig.set("POS_ABS", 2000.0)
    rig.wait(1.5)
    rig.set("POSLIM_R", 5000.0)
    rig.until(1, REACHED)
    assert rig.position() == 2000.0
    rig.set("VEL_ABS", 1000.0)
    rig.wait(2.0)
    rig.set("POSLIM_R", 8000.0)
    rig.until(1, LIMIT_R)
    assert rig.position() == 8000.0


def test_writing_the_limit_that_is_there_changes_no_pulse(rig: Rig) -> None:
    rig.set("POSLIM_R", 1500.0)
    rig.set("POS_ABS", 2000.0)
    for _ in range(49):
        rig.wait(0.0499)
        rig.set("POSLIM_R", 1500.0)
    rig.until(1, LIMIT_R)
    assert rig.position() == 1500.0
    assert rig.events("overrun") == []
    assert rig.now == pytest.approx(2.5 * SECOND, abs=2 * 10**6)


def test_too_late_to_brake_takes_the_hardest_ramp_and_reports_the_overrun(rig: Rig) -> None:
    rig.set("DEC", 4000.0)
    rig.set("VEL_ABS", 1000.0)
    rig.wait(1.5)
    assert rig.position() == 1000.0
    rig.set("POSLIM_R", 1100.0)  # ACC needs 500 u, DEC 125 u
    assert [event.axis for event in rig.events("overrun")] == [1]
    rig.until(1, LIMIT_R)
    assert rig.position() == 1125.0
    assert rig.now == 1_750_000_000


def test_the_harder_ramp_is_taken_without_overrun_where_it_is_enough(rig: Rig) -> None:
    rig.set("DEC", 4000.0)
    rig.set("VEL_ABS", 1000.0)
    rig.wait(1.5)
    rig.set("POSLIM_R", 1200.0)
    rig.until(1, LIMIT_R)
    assert rig.position() == 1200.0
    assert rig.events("overrun") == []


@pytest.mark.parametrize("command", [("VEL_ABS", 0.0), ("VEL_ABS", -500.0), ("POS_ABS", 0.0)])
def test_a_ramp_that_would_pass_the_limit_is_made_harder(rig: Rig, command: tuple[str, float]) -> None:
    """DEC planned the stop on the limit; ACC alone, or a reversal, would pass it."""
    rig.set("DEC", 4000.0)
    rig.set("POSLIM_R", 2000.0)
    rig.set("POS_ABS", 3000.0)
    rig.wait(2.3)
    assert rig.velocity() == 1000.0
    rig.set(*command)
    highest = 0.0
    for _ in range(100):
        rig.wait(0.01)
        highest = max(highest, rig.position())
    assert 1900.0 < highest <= 2000.0
    assert rig.events("overrun") == []


def test_jog_released_before_the_limit_cannot_pass_it(rig: Rig) -> None:
    rig.set("POSLIM_R", 1500.0)
    rig.jog(1, +1, True)
    rig.wait(1.95)
    rig.jog(1, +1, False)
    rig.until(1, ON, LIMIT_R)
    assert rig.position() <= 1500.0


def test_a_reversal_too_late_to_turn_before_the_limit_overruns_and_comes_back(rig: Rig) -> None:
    rig.set("VEL_ABS", 1000.0)
    rig.wait(1.5)
    rig.set("VEL_ABS", 1000.0)
    rig.set("POSLIM_R", 1100.0)
    rig.set("POS_ABS", 500.0)
    assert len(rig.events("overrun")) == 2
    rig.wait(1.0)
    assert rig.position() == pytest.approx(1500.0, abs=1)
    rig.until(1, REACHED)
    assert rig.position() == 500.0


@pytest.mark.parametrize(("limit", "sign", "status"), [("POSLIM_R", 1, LIMIT_R), ("POSLIM_L", -1, LIMIT_L)])
def test_mic_13_a_shifted_coordinate_shifts_the_way_to_the_soft_limit(rig: Rig, limit: str, sign: int, status: int) -> None:
    rig.set(limit, sign * 3000.0)
    rig.set("VEL_ABS", sign * 1000.0)
    rig.wait(1.5)
    rig.set("POS_ACT", sign * 2000.0)
    rig.until(1, status)
    assert rig.position() == sign * 3000.0
    assert rig.device.axes[0].profile.count(rig.now) == sign * 2000


def test_mic_13_a_position_move_ends_at_the_same_place_unless_a_limit_is_nearer(rig: Rig) -> None:
    rig.set("POSLIM_R", 3000.0)
    rig.set("POS_ABS", 2500.0)
    rig.wait(1.5)
    rig.set("POS_ACT", 0.0)
    rig.until(1, REACHED)
    assert rig.position() == 1500.0
    rig.set("POS_ABS", 2900.0)
    rig.wait(0.5)
    rig.set("POS_ACT", 2800.0)
    rig.until(1, LIMIT_R)
    assert rig.position() == 3000.0


@settings(max_examples=60)
@given(
    limits=st.tuples(st.integers(-3000, 0), st.integers(0, 3000)),
    steps=st.lists(
        st.tuples(
            st.sampled_from(["POS_ABS", "POS_REL", "VEL_ABS", "VEL_REL"]), st.integers(-4000, 4000), st.integers(0, 2 * SECOND)
        ),
        max_size=12,
    ),
    ramps=st.tuples(st.integers(100, 5000), st.integers(100, 5000)),
)
def test_no_command_leaves_the_limits(limits: tuple[int, int], steps: list[tuple[str, int, int]], ramps: tuple[int, int]) -> None:
    rig = Rig()
    rig.use_dint()
    rig.enable(1)
    rig.set("POSLIM_L", limits[0])
    rig.set("POSLIM_R", limits[1])
    rig.set("ACC", ramps[0])
    rig.set("DEC", ramps[1])
    for key, value, pause in steps:
        rig.set(key, value)
        for part in (pause // 3, pause - pause // 3):
            rig.wait_ns(part)
            assert limits[0] <= rig.position() <= limits[1]
    rig.wait(60.0)
    assert limits[0] <= rig.position() <= limits[1]
    assert rig.events("overrun") == []


# ---------------------------------------------------------------------- limit switches


@pytest.mark.parametrize(("sign", "pin", "reached"), [(1, KR, LIMIT_R), (-1, KL, LIMIT_L)])
@pytest.mark.parametrize("command", ["VEL_ABS", "POS_ABS"])
def test_mic_12_a_switch_stops_at_once(sign: int, pin: str, reached: int, command: str) -> None:
    rig = with_switches()
    rig.set(command, sign * 1000.0)
    rig.wait(0.5)
    rig.pin(pin, 1)
    assert (rig.status(), rig.velocity(), rig.position()) == (reached, 0.0, sign * 125.0)
    assert [event.axis for event in rig.events("limit")] == [1]
    rig.wait(5.0)
    assert rig.position() == sign * 125.0


def test_a_switch_does_not_stop_the_motion_away_from_it() -> None:
    rig = with_switches()
    rig.pin(KL, 1)
    rig.set("VEL_ABS", 1000.0)
    rig.wait(1.0)
    assert (rig.status(), rig.velocity()) == (VELOCITY, 1000.0)
    rig.pin(KL, 0)
    rig.pin(KL, 1)
    assert rig.status() == VELOCITY


def test_leaving_a_limit_switch_is_allowed_going_on_is_not() -> None:
    rig = with_switches()
    rig.set("VEL_ABS", 1000.0)
    rig.wait(1.0)
    rig.pin(KR, 1)
    for key, value in (("VEL_ABS", 10.0), ("POS_REL", 5.0)):
        rig.set(key, value)
        assert rig.status() == LIMIT_R
    rig.wait(1.0)
    assert rig.position() == 500.0
    rig.set("POS_REL", -100.0)
    assert rig.status() == POSITION
    rig.wait(0.1)
    rig.pin(KR, 0)
    rig.until(1, REACHED)
    assert rig.position() == 400.0
    rig.set("POS_REL", 50.0)
    rig.until(1, REACHED)


@pytest.mark.parametrize(("mode", "stops"), [(0, ""), (1, KL), (2, KR), (3, KL + KR)])
def test_the_limit_mode_chooses_the_switches(mode: int, stops: str) -> None:
    for sign, pin in ((-1, KL), (1, KR)):
        rig = with_switches(mode)
        rig.set("VEL_ABS", sign * 100.0)
        rig.pin(pin, 1)
        assert (rig.status() in (LIMIT_L, LIMIT_R)) == (pin in stops)


def test_a_reversal_into_an_active_switch_stops_where_it_turns() -> None:
    rig = with_switches()
    rig.set("VEL_ABS", 1000.0)
    rig.wait(1.0)
    rig.pin(KL, 1)
    assert rig.status() == VELOCITY
    rig.set("POS_ABS", -300.0)
    rig.wait_ns(SECOND - 1)
    assert rig.status() == POSITION
    rig.wait_ns(1)
    assert (rig.status(), rig.velocity()) == (LIMIT_L, 0.0)
    assert rig.position() == pytest.approx(1000.0, abs=1.0)
    turned = rig.position()
    rig.wait(5.0)
    assert rig.position() == turned


def test_a_switch_that_opens_before_the_turn_lets_the_reversal_pass() -> None:
    rig = with_switches()
    rig.set("VEL_ABS", 1000.0)
    rig.wait(1.0)
    rig.pin(KL, 1)
    rig.set("POS_ABS", 0.0)
    rig.wait(0.5)
    rig.pin(KL, 0)
    rig.until(1, REACHED)
    assert rig.position() == 0.0


def test_a_switch_that_closes_in_flight_stops_the_reversal_that_was_planned() -> None:
    rig = with_switches()
    rig.set("VEL_ABS", 1000.0)
    rig.wait(1.0)
    rig.set("POS_ABS", 0.0)
    rig.wait(0.5)
    rig.pin(KL, 1)
    assert rig.status() == POSITION
    rig.until(1, LIMIT_L)
    assert rig.now == 2 * SECOND


def test_mic_30_limits_see_the_input_after_polarity_and_before_the_filter() -> None:
    inputs = (InputConfig(filter=4), InputConfig(level=1), *(InputConfig(),) * 18)
    rig = Rig(controller(AxisConfig(limit_mode=3, in_kl=0, in_kr=1), inputs=inputs))
    rig.enable(1)
    rig.set("VEL_ABS", -100.0)
    rig.wait(0.1)
    rig.pin(KL, 1)
    assert rig.status() == LIMIT_L
    assert rig.bits(2, 5000, 2) == [0, 1]  # IN1 not yet through its 500 ms, IN2 active low
    rig.set("VEL_ABS", 100.0)
    assert rig.status() == LIMIT_R  # KR lies low, so it is active
    rig.pin(KR, 1)
    rig.set("VEL_ABS", 100.0)
    assert rig.status() == VELOCITY


def test_one_switch_may_serve_several_axes() -> None:
    config = AxisConfig(limit_mode=2, in_kr=7)
    rig = Rig(controller(config, config, AxisConfig(limit_mode=2, in_kr=6)))
    rig.enable(1, 2, 3)
    for axis in (1, 2, 3):
        rig.set("VEL_ABS", 100.0, axis)
    rig.pin("IN8", 1)
    assert [rig.status(axis) for axis in (1, 2, 3)] == [LIMIT_R, LIMIT_R, VELOCITY]


def test_switches_of_the_machine_stop_the_axis_where_they_stand() -> None:
    rig = with_switches()
    rig.switch(1, None, -500, KL)
    rig.switch(1, 800, None, KR, normally_closed=False)
    rig.set("VEL_ABS", 700.0)
    rig.until(1, LIMIT_R)
    assert rig.position() == 800.0
    rig.set("VEL_ABS", -700.0)
    rig.until(1, LIMIT_L)
    assert rig.position() == -500.0


def test_a_disabled_axis_shows_no_limit() -> None:
    rig = with_switches()
    rig.pin(KL, 1)
    rig.word("M_DISABLE", 1)
    rig.pin(KR, 1)
    assert rig.status() == OFF
    rig.enable(1)
    assert rig.status() == ON


def test_soft_limit_and_switch_the_nearer_one_counts() -> None:
    rig = with_switches()
    rig.switch(1, 300, None, KR)
    rig.set("POSLIM_R", 200.0)
    rig.set("VEL_ABS", 100.0)
    rig.until(1, LIMIT_R)
    assert rig.position() == 200.0
    rig.set("POSLIM_R", 1000.0)
    rig.ask(word_pdu(rig.base + 17, 100))
    rig.jog(1, +1, True)
    rig.until(1, LIMIT_R)
    assert rig.position() == 300.0
