"""What an axis does when it is commanded: drive and stop, velocity and position.

Default configuration: 1 pulse per unit, ACC = DEC = 1000 u/s², VMAX = 1000 u/s.
"""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mic488_rig import EN, STOP, Rig, controller, real_words

from steptwin.controller import SECOND
from steptwin.mic488.config import AxisConfig
from steptwin.motion import Profile
from steptwin.motion.pulses import pulse_runs

# ---------------------------------------------------------------------- drive on and off


def test_enable_and_disable_by_coil_and_by_mask() -> None:
    rig = Rig()
    rig.coil(EN + 1, True)
    assert [rig.status(axis) for axis in (1, 2, 3, 4)] == [0, 1, 0, 0]
    rig.word("M_ENABLE", 0b1001)
    assert [rig.status(axis) for axis in (1, 2, 3, 4)] == [1, 1, 0, 1]
    rig.coil(EN + 1, False)
    rig.word("M_DISABLE", 0b0001)
    assert [rig.status(axis) for axis in (1, 2, 3, 4)] == [0, 0, 0, 1]
    assert [(edge.pin, edge.value) for edge in rig.edges] == [
        ("M2_EN", 1.0), ("M1_EN", 1.0), ("M4_EN", 1.0), ("M2_EN", 0.0), ("M1_EN", 0.0),
    ]  # fmt: skip
    assert rig.pins()["M4_EN"] == 1.0


def test_enabling_what_is_enabled_changes_nothing(rig: Rig) -> None:
    rig.set("VEL_ABS", 500.0)
    rig.wait(1.0)
    rig.coil(EN, True)
    rig.enable(1)
    assert rig.status() == 2
    assert rig.velocity() == 500.0
    assert len(rig.edges) == 1


def test_mic_8_motion_commands_while_off_are_answered_recorded_and_do_nothing() -> None:
    rig = Rig()
    for key in ("VEL_ABS", "VEL_REL", "POS_ABS", "POS_REL", "HOME"):
        rig.set(key, 100.0)
    rig.jog(1, +1, True)
    rig.jog(1, +1, False)
    rig.wait(1.0)
    assert rig.status() == 0
    assert rig.position() == 0.0
    assert len(rig.events("drive-off")) == 6
    rig.enable(1)
    rig.wait(1.0)
    assert rig.status() == 1
    assert rig.position() == 0.0


def test_mic_8_an_axis_whose_en_is_not_wired_moves_without_it() -> None:
    rig = Rig(controller(AxisConfig(en_wired=0), AxisConfig()))
    assert (rig.status(), rig.pins()["M1_EN"]) == (0, 0.0)
    rig.set("POS_ABS", 100.0)
    assert rig.status() == 3
    rig.until(1, 4)
    assert (rig.position(), rig.pins()["M1_EN"]) == (100.0, 0.0)
    assert rig.events("drive-off") == []
    rig.jog(1, +1, True)
    rig.enable(1)
    assert (rig.status(), rig.pins()["M1_EN"]) == (2, 1.0)  # EN changes its output alone
    rig.wait(1.0)
    rig.jog(1, +1, False)
    rig.until(1, 1)
    rig.set("POS_ABS", 0.0, 2)
    assert rig.status(2) == 0


@pytest.mark.parametrize("enabled", [False, True])
def test_mic_9_drives_off_stops_an_axis_whose_en_is_not_wired(enabled: bool) -> None:
    rig = Rig(controller(AxisConfig(en_wired=0)))
    if enabled:
        rig.enable(1)
    rig.set("VEL_ABS", 100.0)
    rig.wait(1.0)
    rig.coil(EN, False)
    assert (rig.status(), rig.velocity(), rig.pins()["M1_EN"]) == (0, 0.0, 0.0)
    assert [edge.value for edge in rig.edges if edge.pin == "M1_EN"] == ([1.0, 0.0] if enabled else [])


def test_mic_9_en_off_during_motion_ends_pulses_at_once_and_keeps_the_position(rig: Rig) -> None:
    rig.set("VEL_ABS", 1000.0)
    rig.wait(1.5)
    rig.coil(EN, False)
    assert rig.status() == 0
    assert rig.velocity() == 0.0
    assert rig.position() == 1000.0
    rig.wait(5.0)
    assert rig.position() == 1000.0
    rig.enable(1)
    assert rig.status() == 1
    assert rig.position() == 1000.0


def test_mic_10_stop_has_no_ramp_and_leaves_status_1(rig: Rig) -> None:
    rig.enable(1, 2, 3)
    for axis in (1, 2, 3):
        rig.set("POS_ABS", 10_000.0, axis)
    rig.wait(1.5)
    rig.stop(1)
    rig.coil(2005, False)  # writing OFF is not a stop
    rig.word("M_STOP", 0b0100)
    assert [rig.status(axis) for axis in (1, 2, 3)] == [1, 3, 1]
    assert [rig.velocity(axis) for axis in (1, 2, 3)] == [0.0, 1000.0, 0.0]
    assert [rig.position(axis) for axis in (1, 2, 3)] == [1000.0] * 3
    rig.wait(20.0)
    assert [rig.position(axis) for axis in (1, 2, 3)] == [1000.0, 10_000.0, 1000.0]


def test_mic_10_stop_of_a_drive_at_rest_shows_status_1(rig: Rig) -> None:
    rig.set("POS_ABS", 10.0)
    rig.until(1, 4)
    rig.stop()
    assert rig.status() == 1
    off = Rig()
    off.stop()
    assert off.status() == 0


# ---------------------------------------------------------------------- the outputs' highest frequency


def test_more_than_64_khz_is_clamped_and_reported() -> None:
    rig = Rig(controller(AxisConfig(gear=100.0, acc=10_000.0, dec=10_000.0, vel=1000.0)))
    rig.enable(1)
    rig.set("VEL_ABS", 640.0)
    assert rig.events("speed-clamped") == []
    rig.set("VEL_ABS", -700.0)
    rig.wait(1.0)
    assert rig.velocity() == -640.0
    assert [event.axis for event in rig.events("speed-clamped")] == [1]
    assert "70000" in rig.events("speed-clamped")[0].text
    rig.set("VMAX", 2000.0)
    assert rig.get("VMAX") == 2000.0
    rig.set("POS_ABS", 10_000.0)
    rig.wait(1.0)
    assert rig.velocity() == 640.0
    rig.set("VEL_REL", 0.01)
    rig.wait(1.0)
    assert rig.velocity() == 640.0
    assert len(rig.events("speed-clamped")) == 3


# ---------------------------------------------------------------------- position register


def test_writing_the_position_at_rest_moves_nothing(rig: Rig) -> None:
    rig.set("POS_ABS", 100.0)
    rig.until(1, 4)
    rig.set("POS_ACT", 0.0)
    assert (rig.status(), rig.position()) == (4, 0.0)
    rig.set("POS_ACT", -7.0)
    rig.set("POS_ABS", 3.0)
    rig.until(1, 4)
    assert rig.position() == 3.0
    assert rig.device.axes[0].profile.count(rig.now) == 110


def test_mic_13_position_written_in_motion_shifts_the_coordinate_only(rig: Rig) -> None:
    rig.set("POS_ABS", 2000.0)
    rig.wait(1.5)
    before = rig.device.axes[0].profile
    rig.set("POS_ACT", 0.0)
    assert (rig.status(), rig.position(), rig.velocity()) == (3, 0.0, 1000.0)
    assert rig.device.axes[0].profile is before
    rig.until(1, 4)
    assert rig.position() == 1000.0  # the same place
    assert rig.now == 3 * SECOND


def test_a_counter_wraps_as_32_bits_do_and_relative_moves_cross_the_border(rig: Rig) -> None:
    rig.use_dint()
    rig.set("POS_ACT", 2**31 - 10)
    rig.set("POS_REL", 30)
    rig.until(1, 4)
    assert rig.position() == -(2**31) + 20
    rig.set("POS_ABS", -(2**31))
    rig.until(1, 4)
    assert rig.position() == -(2**31)
    assert rig.device.axes[0].profile.count(rig.now) == 10
    rig.set("VEL_ABS", -1000)
    rig.wait(1.0)
    assert rig.position() == 2**31 - 500


# ---------------------------------------------------------------------- pulses are whole

COMMANDS = st.one_of(
    st.tuples(st.sampled_from(["POS_ABS", "POS_REL"]), st.floats(-3000.0, 3000.0, width=32)),
    st.tuples(st.sampled_from(["VEL_ABS", "VEL_REL"]), st.floats(-70_000.0, 70_000.0, width=32)),
    st.tuples(st.sampled_from(["ACC", "DEC", "VMAX"]), st.floats(1.0, 1e6, width=32)),
    st.tuples(st.sampled_from(["POSLIM_L", "POSLIM_R", "POS_ACT"]), st.floats(-2000.0, 2000.0, width=32)),
    st.tuples(st.just("STOP"), st.just(0.0)),
    st.tuples(st.just("OFF"), st.just(0.0)),
)


def pulses_of(profile: Profile, after: int, until: int) -> int:
    return sum(direction * len(times) for direction, times in pulse_runs(profile, after, until))


@settings(max_examples=80)
@given(st.lists(st.tuples(COMMANDS, st.integers(0, 3 * SECOND)), max_size=15))
def test_the_count_is_the_sum_of_the_pulses_of_replaced_profiles(steps: list[tuple[tuple[str, float], int]]) -> None:
    rig = Rig()
    axis = rig.device.axes[0]
    rig.enable(1)
    given_p, profile, since, revision = 0, axis.profile, 0, axis.revision

    def look() -> None:
        """Count the pulses of each profile up to the moment it was replaced."""
        nonlocal given_p, profile, since, revision
        if axis.revision != revision:
            at = axis.profile.start
            given_p += pulses_of(profile, since, at)
            profile, since, revision = axis.profile, at, axis.revision

    for (key, value), pause in steps:
        end = rig.now + pause
        while (due := rig.scheduler.deadline()) is not None and due <= end:
            rig.wait_ns(due - rig.now)
            look()
        rig.wait_ns(end - rig.now)
        if key == "STOP":
            rig.stop()
        elif key == "OFF":
            rig.coil(EN, False)
            rig.enable(1)
        else:
            rig.set(key, value)
        look()
    rig.wait(2.0)
    look()
    count = axis.profile.count(rig.now)
    assert count == given_p + pulses_of(profile, since, rig.now)


# ---------------------------------------------------------------------- MIC-40 to MIC-42


@pytest.mark.parametrize("key", ["ACC", "DEC", "VMAX", "JOG_SPEED"])
@pytest.mark.parametrize("command", [("POS_ABS", 5000.0), ("VEL_ABS", 900.0), ("HOME", 900.0), ("JOG", 1.0)])
def test_mic_40_parameters_written_during_a_motion_act_on_the_next_command(key: str, command: tuple[str, float]) -> None:
    undisturbed, rig = Rig(), Rig()
    for one in (undisturbed, rig):
        one.enable(1)
        one.jog(1, +1, True) if command[0] == "JOG" else one.set(*command)
        one.wait(0.3)
    if key == "JOG_SPEED":
        rig.write_words(rig.base + 17, *real_words(123.0))
    else:
        rig.set(key, 123.0)
    for one in (undisturbed, rig):
        one.set("POSLIM_R", 100_000.0)  # far away: the motion is planned anew and goes on as it was
    for _ in range(40):
        for one in (undisturbed, rig):
            one.wait(0.2)
        assert (rig.position(), rig.velocity(), rig.status()) == (
            undisturbed.position(),
            undisturbed.velocity(),
            undisturbed.status(),
        )
    rig.coil(STOP, True)
    rig.set("POS_ACT", 0.0)
    if key == "JOG_SPEED":
        rig.jog(1, +1, True)
        rig.wait(1.0)
        assert rig.velocity() == 123.0
    else:
        rig.set("POS_ABS", 2000.0)
        rig.wait(0.5)
        assert rig.velocity() == {"ACC": 61.5, "DEC": 500.0, "VMAX": 123.0}[key]


def test_mic_40_a_soft_limit_written_during_a_motion_acts_at_once(rig: Rig) -> None:
    rig.set("POS_ABS", 5000.0)
    rig.wait(0.3)
    rig.set("POSLIM_R", 2000.0)
    rig.until(1, 10)
    assert rig.position() == 2000.0


def test_mic_42_a_relative_move_across_the_end_of_dint_wraps() -> None:
    rig = Rig(controller(AxisConfig(acc=1e9, dec=1e9, vel=64_000.0)))
    rig.use_dint()
    rig.enable(1)
    rig.set("POS_ACT", 2**31 - 11)
    assert rig.exception(rig.set_pdu("POS_ABS", 2**31 - 1)) == 0
    rig.until(1, 4)
    rig.set("POS_REL", 20)
    rig.until(1, 4)
    assert rig.position() == -(2**31) + 19
    rig.set("POS_REL", -20)
    rig.until(1, 4)
    assert rig.position() == 2**31 - 1


@pytest.mark.parametrize("value", [0.25, 0.5, 1.4, 3.0])
@pytest.mark.parametrize("key", ["ACC", "DEC", "VMAX"])
def test_mic_42_what_is_read_in_dint_mode_can_be_written_back(rig: Rig, key: str, value: float) -> None:
    rig.set(key, value)
    rig.use_dint()
    shown = rig.get(key)
    assert shown == max(1, round(value))
    assert rig.exception(rig.set_pdu(key, shown)) == 0


# ---------------------------------------------------------------------- soft limits


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize(("missing", "overruns"), [(0, 0), (1, 1)])
def test_an_axis_that_cannot_brake_by_a_pulse_overruns(rig: Rig, side: int, missing: int, overruns: int) -> None:
    """1000 pulses/s after 1 s and 500 pulses; after 2 s it needs as many again behind 1500."""
    rig.set("VEL_ABS", side * 1000.0)
    rig.wait(2.0)
    rig.set("POSLIM_R" if side > 0 else "POSLIM_L", side * (2000.0 - missing))
    rig.until(1, 10 if side > 0 else 9)
    assert (rig.position(), len(rig.events("overrun"))) == (side * 2000.0, overruns)


@pytest.mark.parametrize("side", [-1, 1])
def test_a_soft_limit_holds_where_the_counter_has_wrapped(rig: Rig, side: int) -> None:
    """30 pulses over the border are 20 behind it; the limit is 5 behind it."""
    rig.use_dint()
    end, other_end = (2**31 - 1, -(2**31)) if side > 0 else (-(2**31), 2**31 - 1)
    rig.set("POS_ACT", end - side * 9)
    rig.set("POS_REL", side * 30)
    rig.until(1, 4)
    assert rig.position() == other_end + side * 20
    rig.set("POSLIM_L" if side > 0 else "POSLIM_R", other_end + side * 5)
    rig.set("VEL_ABS", -side * 10)
    rig.until(1, 9 if side > 0 else 10)
    assert rig.position() == other_end + side * 5


@pytest.mark.parametrize("side", [-1, 1])
def test_no_overrun_from_standstill(rig: Rig, side: int) -> None:
    """An axis at rest beyond a limit has nothing to brake."""
    rig.set("POS_ACT", side * 1000.0)
    rig.set("POSLIM_R" if side > 0 else "POSLIM_L", side * 500.0)
    for key, value in (("VEL_ABS", side * 100.0), ("POS_ABS", side * 2000.0), ("POS_ABS", 0.0)):
        rig.set(key, value)
    rig.until(1, 4)
    assert rig.events("overrun") == []
    assert rig.position() == 0.0
