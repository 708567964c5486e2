"""Encoders: counters, the three position-control modes, and what happens when a drive does not arrive (MIC-19, MIC-26).

Default: 3200 pulses and 400 counts per revolution, so 8 pulses a count; tolerance 4 counts, 32 pulses.
"""

from __future__ import annotations

import pytest
from mic488_rig import EN, Rig, controller, couple, encoder_rig, turn

from steptwin.controller import SECOND
from steptwin.errors import Misuse
from steptwin.mic488.config import AxisConfig
from steptwin.mic488.encoder import Coupling

ON, VELOCITY, POSITION, REACHED, ERROR, HOMING, CORRECTION, LIMIT_R = 1, 2, 3, 4, 5, 6, 8, 10
CONTROL_OFF, ENCODER, ENCFOLLOW = range(3)
NONE, ERRMODE0, ERRMODE1, ERRMODE2 = range(4)


def motor(rig: Rig) -> int:
    return rig.device.axes[0].profile.count(rig.now)


# ---------------------------------------------------------------------- counters


def test_the_encoder_counts_what_the_drive_turns() -> None:
    rig = Rig(controller(AxisConfig(gear=3200.0, enc_offset=10)))
    assert rig.get("ENC_IMP") == 10
    rig.enable(1)
    rig.set("VMAX", 5.0)
    rig.set("ACC", 10.0)
    rig.set("POS_ABS", -2.5)
    rig.until(1, REACHED)
    assert rig.get("ENC_IMP") == 10 - 1000
    rig.set("ENC_IMP", 400)
    assert rig.get("ENC_IMP") == 400
    assert rig.get("ENC_XPOS") == 1.0  # 400 counts are a revolution, 3200 pulses, one unit
    assert rig.position() == -2.5


def test_xpos_is_the_counter_in_drive_position_read_and_written() -> None:
    rig = Rig(controller(AxisConfig(gear=1600.0)))
    rig.set("ENC_XPOS", 3.0)
    assert rig.get("ENC_IMP") == 600
    rig.use_dint()
    assert rig.get("ENC_XPOS") == 4800
    rig.set("ENC_XPOS", 803)  # 100.4 counts
    assert rig.get("ENC_IMP") == 100
    assert rig.get("ENC_XPOS") == 800


def test_every_axis_has_its_encoder_and_its_resolution() -> None:
    rig = Rig(controller(AxisConfig(), AxisConfig(enc_resol=4000), AxisConfig(), AxisConfig(mot_resol=400)))
    rig.enable(1, 2, 3, 4)
    for axis in (1, 2, 3, 4):
        rig.set("POS_ABS", 400.0, axis)
    rig.wait(5.0)
    assert [rig.get("ENC_IMP", axis) for axis in (1, 2, 3, 4)] == [50, 500, 50, 400]


def test_a_hand_turns_the_shaft_and_the_counter_wraps() -> None:
    rig = Rig()
    turn(rig, -7)
    assert rig.get("ENC_IMP") == -7
    rig.set("ENC_IMP", 2**31 - 3)
    turn(rig, 5)
    assert rig.get("ENC_IMP") == -(2**31) + 2


def test_couplings() -> None:
    rig = Rig()
    rig.enable(1)
    for coupling, counted in ((Coupling.DRIVE, 100), (Coupling.BLOCKED, 100), (Coupling.FREE, 100), (Coupling.DRIVE, 200)):
        couple(rig, coupling)
        rig.set("POS_REL", 800.0)
        rig.until(1, REACHED)
        assert rig.get("ENC_IMP") == counted


def test_impossible_turns_and_axes_are_misuse() -> None:
    rig = Rig()
    with pytest.raises(Misuse, match=r"4294967296 encoder counts at once: permitted -2147483648…2147483647"):
        rig.device.turn_encoder(1, 2**32, 0)
    for axis in (0, 5):
        with pytest.raises(Misuse, match=f"no axis M{axis}: axes are M1 to M4"):
            rig.device.turn_encoder(axis, 1, 0)
        with pytest.raises(Misuse, match="axes are M1 to M4"):
            rig.device.couple_encoder(axis, Coupling.FREE, 0)


# ---------------------------------------------------------------------- OFF


def test_without_position_control_a_slip_goes_unnoticed() -> None:
    rig = encoder_rig(CONTROL_OFF)
    couple(rig, Coupling.BLOCKED)
    rig.set("POS_ABS", 3000.0)
    turn(rig, 50)
    rig.wait(10.0)
    assert (rig.status(), rig.position()) == (REACHED, 3000.0)


# ---------------------------------------------------------------------- ENCODER: correction


def test_a_slip_is_corrected_after_settling() -> None:
    rig = encoder_rig()
    rig.set("POS_ABS", 2000.0)
    rig.wait(1.0)
    turn(rig, -50)  # 400 pulses lost
    rig.wait(2.0)
    assert rig.status() == CORRECTION
    rig.wait_ns(100_000_000 - 1)
    assert (rig.velocity(), rig.position()) == (0.0, 2000.0)
    rig.wait_ns(1)
    assert rig.position() == 1600.0  # what did not reach the shaft is not counted
    rig.until(1, REACHED)
    assert abs(rig.position() - 2000.0) <= 32
    assert abs(rig.get("ENC_IMP") - 250) <= 4
    assert rig.velocity() == 0.0
    assert motor(rig) == rig.position() + 400
    assert rig.scheduler.deadline() is None


@pytest.mark.parametrize(("counts", "status"), [(4, REACHED), (-4, REACHED), (5, CORRECTION), (-5, CORRECTION)])
def test_mic_19_four_counts_are_tolerated(counts: int, status: int) -> None:
    rig = encoder_rig()
    rig.set("POS_ABS", 800.0)
    rig.wait(0.5)
    turn(rig, counts)
    rig.wait(2.0 * 0.8**0.5 - 0.4)
    assert rig.status() == status


@pytest.mark.parametrize("kp", [0.0, 1.0, 50.0, 100.0, 1000.0, 1e38])
def test_the_gain_changes_how_fast_not_whether(kp: float) -> None:
    rig = encoder_rig(kp=kp)
    rig.set("POS_ABS", 2000.0)
    rig.wait(1.0)
    turn(rig, 60)
    rig.until(1, REACHED, ERROR)
    rig.until(1, REACHED)
    assert abs(rig.get("ENC_IMP") - 250) <= 4


@pytest.mark.parametrize("counts", [60, -60])
def test_without_gain_a_correction_is_as_slow_as_moves_of_one_pulse(counts: int) -> None:
    rig = encoder_rig(kp=0.0)
    rig.set("POS_ABS", 2000.0)
    rig.wait(1.0)
    turn(rig, counts)
    rig.until(1, CORRECTION)
    fastest = 0.0
    for _ in range(100):
        rig.wait(0.005)
        fastest = max(fastest, abs(rig.velocity()))
    assert 20.0 < fastest <= 1000.0**0.5  # half of a pulse with ACC 1000, half of it with DEC 1000


def test_a_new_command_ends_the_correction() -> None:
    rig = encoder_rig()
    rig.set("POS_ABS", 2000.0)
    rig.wait(1.0)
    turn(rig, -50)
    rig.until(1, CORRECTION)
    rig.wait(0.15)
    rig.set("POS_ABS", 0.0)
    assert rig.status() == POSITION
    rig.until(1, REACHED)
    assert abs(rig.get("ENC_IMP")) <= 4


def test_stop_ends_the_correction() -> None:
    rig = encoder_rig()
    rig.set("POS_ABS", 2000.0)
    rig.wait(1.0)
    turn(rig, -50)
    rig.until(1, CORRECTION)
    rig.stop()
    rig.wait(5.0)
    assert rig.status() == ON
    assert rig.scheduler.deadline() is None


def test_mic_13_position_written_during_a_correction_does_not_change_where_it_ends() -> None:
    rig = encoder_rig()
    rig.set("POS_ABS", 2000.0)
    rig.wait(1.0)
    turn(rig, -50)
    rig.until(1, CORRECTION)
    rig.wait(0.15)
    rig.set("POS_ACT", 0.0)
    rig.until(1, REACHED)
    assert abs(rig.get("ENC_IMP") - 250) <= 4


def test_position_written_at_rest_takes_drive_and_encoder_to_agree() -> None:
    rig = encoder_rig()
    turn(rig, 100)
    rig.set("POS_ACT", 0.0)
    rig.set("POS_ABS", 80.0)
    rig.until(1, REACHED, CORRECTION)
    assert rig.status() == REACHED


def test_writing_the_encoder_counter_moves_nothing() -> None:
    rig = encoder_rig()
    rig.set("POS_ABS", 2000.0)
    rig.wait(1.0)
    rig.set("ENC_IMP", 0)
    rig.until(1, REACHED, CORRECTION)
    assert rig.status() == REACHED


def test_mic_30_the_reference_of_the_encoder_is_the_home_position() -> None:
    rig = encoder_rig(in_kl=0)
    turn(rig, 200)
    rig.set("HOME", -100.0)
    rig.wait(1.0)
    rig.pin("IN1", 1)
    rig.set("POS_ABS", 100.0)
    rig.until(1, REACHED, CORRECTION)
    assert rig.status() == REACHED


# ---------------------------------------------------------------------- ENCODER: giving up


@pytest.mark.parametrize(("key", "value"), [("POS_ABS", 100_000.0), ("VEL_ABS", 500.0), ("VEL_ABS", -0.25)])
def test_a_drive_blocked_for_err_time_is_a_position_error(key: str, value: float) -> None:
    rig = encoder_rig()
    couple(rig, Coupling.BLOCKED)
    rig.set(key, value)
    rig.until(1, ERROR)
    assert 2 * SECOND <= rig.now <= 2 * SECOND + 20_000_000
    assert rig.velocity() == 0.0
    assert rig.word("M_STATUS") == 1
    assert rig.pins()["ERR"] == 1.0
    assert [event.axis for event in rig.events("position-error")] == [1]


def test_a_drive_blocked_in_flight_is_noticed_and_one_that_turns_again_is_not() -> None:
    rig = encoder_rig()
    rig.set("VEL_ABS", 800.0)
    rig.wait(3.0)
    couple(rig, Coupling.BLOCKED)
    rig.wait(1.9)
    couple(rig, Coupling.DRIVE)
    rig.wait(10.0)
    assert rig.status() == VELOCITY
    couple(rig, Coupling.BLOCKED)
    rig.until(1, ERROR)
    assert 16.9 * SECOND <= rig.now <= 16.93 * SECOND


def test_mic_19_a_correction_without_progress_gives_up_after_err_time() -> None:
    rig = encoder_rig()
    rig.set("POS_ABS", 500.0)
    rig.wait(0.7)
    couple(rig, Coupling.BLOCKED)
    rig.until(1, CORRECTION)
    began = rig.now
    rig.until(1, ERROR)
    assert 2 * SECOND <= rig.now - began <= 2.2 * SECOND
    assert rig.position() < 400.0
    rig.wait(10.0)
    assert rig.status() == ERROR


@pytest.mark.parametrize("command", [("POS_ABS", 2000.0), ("POS_ABS", 100.0), ("VEL_ABS", 500.0), ("VEL_ABS", -500.0)])
def test_mic_19_at_status_5_the_coordinate_becomes_the_encoders(command: tuple[str, float]) -> None:
    """Whether it comes after a move, during one, or in velocity mode."""
    rig = encoder_rig()
    rig.set("POS_ABS", 800.0)
    rig.until(1, REACHED)
    couple(rig, Coupling.BLOCKED)
    rig.set(*command)
    rig.until(1, ERROR)
    assert (rig.position(), rig.get("ENC_XPOS")) == (800.0, 800.0)
    couple(rig, Coupling.DRIVE)
    before = motor(rig)
    rig.set("POS_REL", 80.0)
    rig.until(1, REACHED)
    assert (rig.position(), rig.get("ENC_XPOS"), motor(rig) - before) == (880.0, 880.0, 80)


@pytest.mark.parametrize("command", [("POS_ABS", 2000.0), ("POS_ABS", 820.0), ("VEL_ABS", 500.0)])
def test_mic_19_a_difference_at_enabling_stays(command: tuple[str, float]) -> None:
    """EN off keeps the position (MIC-9): what a hand turns meanwhile is no error of the drive, also not at status 5."""
    rig = encoder_rig(enc_tolerance=2)
    rig.set("POS_ABS", 800.0)
    rig.until(1, REACHED)
    rig.coil(EN, False)
    turn(rig, 50)
    rig.coil(EN, True)
    assert (rig.position(), rig.get("ENC_XPOS")) == (800.0, 1200.0)
    rig.set("POS_ABS", 880.0)
    rig.until(1, REACHED, CORRECTION)
    assert (rig.status(), rig.position(), rig.get("ENC_XPOS")) == (REACHED, 880.0, 1280.0)
    couple(rig, Coupling.BLOCKED)
    rig.set(*command)
    rig.until(1, ERROR)
    assert (rig.position(), rig.get("ENC_XPOS")) == (880.0, 1280.0)


def test_mic_19_tolerance_settling_and_giving_up_are_configured() -> None:
    rig = encoder_rig(enc_tolerance=0, enc_settle_ms=700, err_time_ms=300)
    rig.set("POS_ABS", 800.0)
    rig.wait(0.7)
    turn(rig, -2)
    rig.until(1, CORRECTION)
    rig.wait_ns(700_000_000 - 1)
    assert rig.position() == 800.0
    rig.until(1, REACHED)
    assert rig.get("ENC_IMP") == 100
    couple(rig, Coupling.BLOCKED)
    rig.set("POS_ABS", 5000.0)
    began = rig.now
    rig.until(1, ERROR)
    assert 0.3 * SECOND <= rig.now - began <= 0.32 * SECOND
    rig = encoder_rig(enc_tolerance=50)
    rig.set("POS_ABS", 500.0)
    rig.wait(0.7)
    turn(rig, -50)
    rig.until(1, REACHED)


def test_reaction_none_never_gives_up() -> None:
    rig = encoder_rig(ENCODER, NONE)
    rig.set("POS_ABS", 500.0)
    rig.wait(0.7)
    couple(rig, Coupling.BLOCKED)
    rig.wait(30.0)
    assert rig.status() == CORRECTION
    couple(rig, Coupling.DRIVE)
    rig.until(1, REACHED)
    assert abs(rig.position() - 500.0) <= 32


@pytest.mark.parametrize(("reaction", "interrupts", "out8"), [(ERRMODE0, 0, 0.0), (ERRMODE1, 1, 0.0), (ERRMODE2, 1, 1.0)])
def test_error_reactions(reaction: int, interrupts: int, out8: float, monkeypatch: pytest.MonkeyPatch) -> None:
    rig = encoder_rig(ENCODER, reaction)
    told: list[int] = []
    monkeypatch.setattr(type(rig.device.program), "interrupt_by_position_error", lambda program, now: told.append(now))
    couple(rig, Coupling.BLOCKED)
    rig.set("VEL_ABS", 500.0)
    rig.until(1, ERROR)
    assert told == [rig.now] * interrupts
    assert rig.pins()["OUT8"] == out8
    assert ("OUT8" in [edge.pin for edge in rig.edges]) is (out8 == 1.0)


def failed() -> Rig:
    rig = encoder_rig(in_kl=0)
    couple(rig, Coupling.BLOCKED)
    rig.set("VEL_ABS", 500.0)
    rig.until(1, ERROR)
    couple(rig, Coupling.DRIVE)
    return rig


@pytest.mark.parametrize(
    ("command", "status"), [(("POS_REL", 10.0), POSITION), (("VEL_ABS", 10.0), VELOCITY), (("HOME", -10.0), HOMING)]
)
def test_mic_26_a_position_error_is_cleared_by_motion_and_homing(command: tuple[str, float], status: int) -> None:
    rig = failed()
    rig.set(*command)
    assert rig.status() == status
    assert rig.word("M_STATUS") == 0
    assert rig.pins()["ERR"] == 0.0
    assert [edge.value for edge in rig.edges if edge.pin == "ERR"] == [1.0, 0.0]


def test_mic_26_a_position_error_is_cleared_by_disabling_and_by_nothing_less() -> None:
    rig = failed()
    rig.stop()
    rig.coil(EN, True)
    rig.set("POS_ACT", 0.0)
    rig.set("ACC", 5.0)
    rig.jog(1, +1, False)
    assert rig.status() == ERROR
    assert rig.word("M_STATUS") == 1
    rig.coil(EN, False)
    assert (rig.status(), rig.word("M_STATUS"), rig.pins()["ERR"]) == (0, 0, 0.0)


@pytest.mark.parametrize(("counts", "corrected"), [(4, False), (-4, False), (5, True), (-5, True)])
def test_the_tolerance_itself_is_not_corrected(counts: int, corrected: bool) -> None:
    """The shaft slips by counts of 8 pulses during a move; 4 are permitted."""
    rig = encoder_rig()
    rig.set("POS_ABS", 160.0)
    turn(rig, counts)
    rig.until(1, REACHED)
    rig.wait(3.0)
    assert rig.status() == REACHED
    assert (motor(rig) == 160) is not corrected
