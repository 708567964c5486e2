"""Registers, motion statements and position tables as a running program and a master see them."""

from __future__ import annotations

import pytest
from mic488_rig import MM, RUNNING, STOPPED, controller, dint_words, programmed, started

from steptwin.controller import MILLISECOND, SECOND
from steptwin.mic488.config import AxisConfig
from steptwin.mic488.encoder import Coupling
from steptwin.mic488.program_registers import ACCESS, position_p
from steptwin.simulation.scheduler.wires import PinName, Wire
from steptwin.wbc.real import ProgramFault

# ---------------------------------------------------------------------- registers


def test_user_registers_are_one_memory_with_the_low_word_first() -> None:
    rig = programmed("$D10 = $R20 + 0\n$R30 = $I40\n$I50 = $D60\n$I51 = $I41\nWAIT IN9 = ON\n")
    rig.r(20, 70000.4)
    rig.i(40, -5)
    rig.write_words(60, 0x2345, 0x0001)
    rig.start()
    rig.wait(0.1)
    assert rig.read_words(10, 2) == [70000 & 0xFFFF, 1]
    assert rig.r(30) == -5.0
    assert rig.i(50) == 32767  # WBC-14: the nearest it can hold


def test_a_user_register_is_read_in_single_precision_and_one_without_a_number_as_0() -> None:
    rig = programmed("$R10 = $R20\n$R12 = $D22\n$I14 = $I24\nWAIT IN9 = ON\n")
    rig.write_words(20, 0x0000, 0x7FC0)  # a NaN
    rig.write_words(22, *dint_words(2**24 + 1))
    rig.i(24, -32768)
    rig.start()
    rig.wait(0.1)
    assert (rig.r(10), rig.r(12), rig.i(14)) == (0.0, 2.0**24, -32768)


def test_wbc_14_whole_registers_take_the_nearest_number() -> None:
    rig = programmed("$I0 = $R20\n$D2 = $R20\nOUTPUTS = $R20\n$I1 = OUTPUTS\nWAIT IN9 = ON\n")
    for value, word, dint, bits in [
        (2.5, 2, 2, 2), (3.5, 4, 4, 4), (-0.4, 0, 0, 0), (40000.0, 32767, 40000, 0x40), (-1e20, -32768, -(2**31), 0),
    ]:  # fmt: skip
        rig.r(20, value)
        rig.start()
        rig.wait(0.1)
        assert (rig.i(0), rig.d(2), rig.i(1)) == (word, dint, bits), value
        rig.halt()


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("7 / 2", 3.5), ("7 % 4", 3.0), ("-7 % 4", -3.0), ("6 & 3", 2.0), ("6 | 3", 7.0), ("2 && 0", 0.0), ("2 && -1", 1.0),
        ("0 || 0", 0.0), ("0.4 || 0", 0.0), ("3 << 4", 48.0), ("-16 >> 2", -4.0), ("5.6 & 7", 6.0), ("1 << 31", -(2.0**31)),
        ("sin(30)", 0.5), ("cos(60)", 0.5), ("tg(45)", 1.0), ("ctg(45)", 1.0), ("asin(1)", 90.0), ("acos(0)", 90.0),
        ("sqrt(2,25)", 1.5), ("min(2, -3)", -3.0), ("max(2, -3)", 2.0), ("16777216 + 1", 16777216.0),
        ("1 - 0.9", 0.10000002384185791),
    ],
)  # fmt: skip
def test_calculations_in_single_precision(expression: str, expected: float) -> None:
    rig = started(f"$R0 = {expression}\nWAIT IN9 = ON\n")
    rig.wait(0.1)
    assert rig.r(0) == pytest.approx(expected, rel=2e-7)


def test_timers_count_up_and_stop_at_999999() -> None:
    rig = started("TIMA3 = 100\nTIMB16 = 999998\nMAIN:\n$D0 = TIMA3\n$D2 = TIMB16\n$D4 = TIMA1\nDELAY 0.01\nJUMP MAIN\n")
    rig.wait(1.5)
    assert rig.d(0) in (248, 249)
    assert rig.d(2) == 999999
    assert rig.d(4) in (148, 149)
    rig.wait(10.0)
    assert rig.d(2) == 999999


def test_pulse_inverts_without_blocking() -> None:
    rig = started("OUT2 = ON\nPULSE(OUT1, 0.5)\nPULSE(OUT2, 0.25)\nOUT3 = ON\nWAIT IN9 = ON\n")
    rig.wait(2.0)
    assert rig.changes("OUT3") == [(0.004, 1.0)]
    assert rig.changes("OUT1") == [(0.502, 1.0)]
    assert rig.changes("OUT2") == [(0.001, 1.0), (0.253, 0.0)]


def test_drive_registers_as_the_master_sees_them() -> None:
    text = (
        "M1 = ON\nAccM1 = 500\nDecM1 = 250\nVmaxM1 = 20\nLimRM1 = 30\nPABS M1 100\n$I0 = M1\nWAIT M1 = OFF\n"
        "$I1 = M1\n$I2 = StatM1\n$R4 = PosM1\nPosM1 = 7,5\nENC1 = 1234\n$D6 = ENC1\nWAIT IN9 = ON\n"
    )
    rig = started(text)
    rig.wait(5.0)
    assert (rig.get("ACC"), rig.get("DEC"), rig.get("VMAX"), rig.get("POSLIM_R")) == (500.0, 250.0, 20.0, 30.0)
    assert (rig.i(0), rig.i(1), rig.i(2), rig.r(4), rig.d(6)) == (1, 0, 10, 30.0, 1234)
    assert (rig.position(), rig.get("ENC_IMP")) == (7.5, 1234)


def test_status_register_of_the_generations() -> None:
    text = "M1 = ON\nWAIT IN9 = ON\n$I0 = STATUS + 100\nWAIT IN10 = ON\n"
    rig = started(text)
    rig.wait(0.1)
    rig.pin("IN9", 1.0)
    rig.wait(0.1)
    assert rig.i(0) == 100
    assert started(text, firmware="1.40").state == RUNNING


def test_analog_inputs_are_scaled() -> None:
    rig = started("MAIN:\n$R0 = AIN1\n$R2 = AIN2\nDELAY 0.05\nJUMP MAIN\n")
    rig.pin("AIN1", 2.5)
    rig.pin("AIN2", 10.0)
    rig.wait(0.1)
    assert (rig.r(0), rig.r(2)) == (2.5, 10.0)


@pytest.mark.parametrize("gear", [1.0, 4.0])
def test_mic_14_positions_that_the_counter_holds_after_rounding(gear: float) -> None:
    axis = programmed("OUT1 = ON\n", "", controller(AxisConfig(gear=gear))).device.axes[0]
    for pulses, rounded in ((-(2**31) - 0.25, -(2**31)), (2**31 - 0.75, 2**31 - 1), (12.75, 13), (-0.25, 0)):
        assert position_p(axis, pulses / gear, "PABS M1") == rounded
    for pulses in (-(2**31) - 0.5, -(2**31) - 1.25, 2**31 - 0.5, 2**31 + 0.25):
        with pytest.raises(ProgramFault, match=r"PABS M1 = .* imp: permitted are -"):
            position_p(axis, pulses / gear, "PABS M1")


@pytest.mark.parametrize(
    "assignment",
    [
        "OUT1 = ON", "OUT2 = OFF", "OUTPUTS = 5", "M1 = ON", "M2 = OFF", "PosM1 = 2.5", "LimLM1 = -3", "LimRM2 = 40",
        "AccM1 = 20", "DecM3 = 30", "VmaxM4 = 5", "ENC1 = -7", "CFGINT_IN1 = RIS", "CFGINT_MODBUS = HIGH", "CFGINT_M1 = 4",
        "PTPM3 = 9", "CircY = 4", "LinVel = 6", "LinAcc = 3", "VisionX = 1.5", "$I5 = -3", "$D6 = 100000", "$R8 = 0.1",
    ],
)  # fmt: skip
def test_a_loop_that_writes_what_is_there_already_rests(assignment: str) -> None:
    rig = started(f"MAIN:\n{assignment}\nJUMP MAIN\nINT_IN1:\nRETURN\nINT_MODBUS:\nRETURN\nINT_M1:\nRETURN\n")
    rig.wait(0.1)
    assert (rig.state, rig.scheduler.deadline()) == (RUNNING, None)


@pytest.mark.parametrize(
    "name",
    [
        "OUT1", "OUTPUTS", "M1", "PosM1", "LimLM1", "LimRM2", "AccM1", "DecM3", "VmaxM4", "ENC1", "TIMA1", "TIMB16",
        "PTPM3", "CircY", "LinVel", "LinAcc", "VisionX", "$I5", "$D6", "$R8",
    ],
)  # fmt: skip
def test_a_loop_that_changes_a_register_and_changes_it_back_does_not_rest(name: str) -> None:
    values = "10" if name in ("OUT1", "M1") else "12"
    rig = started(f"MAIN:\n{name} = {values[0]}\n{name} = {values[1]}\nJUMP MAIN\n")
    rig.wait(0.1)
    deadline = rig.scheduler.deadline()
    assert (rig.state, deadline) == (RUNNING, rig.now + 1_000_000)


COUNT_AT_VELOCITY = "MAIN:\nIF StatM1 = 2\n$I0 = $I0 + 1\nENDIF\nJUMP MAIN\n"
COUNT_WITHOUT_INPUT = "MAIN:\nIF IN1 = 0\n$I0 = $I0 + 1\nENDIF\nJUMP MAIN\n"
COUNT_TICKS = "MAIN:\n$I1 = $I1 + 1\nJUMP MAIN\nINT_TICK:\n$I0 = $I0 + 1\nRETURN\n"


@pytest.mark.parametrize(
    ("text", "count"),
    [
        # 2000 pulses to the limit in velocity mode: 1.5 s and a ramp of 1 s; 4 statements of 1 ms in a round.
        ("LimRM1 = 9000\nM1 = ON\nVABS M1 1000\nDELAY 1.5\nLimRM1 = 3000\n" + COUNT_AT_VELOCITY, 625),
        ("LimLM1 = -9000\nM1 = ON\nVABS M1 -1000\nDELAY 1.5\nLimLM1 = -3000\n" + COUNT_AT_VELOCITY, 625),
        ("LimRM1 = 9000\nM1 = ON\nVABS M1 1000\nDELAY 1.5\nPosM1 = 7000\n" + COUNT_AT_VELOCITY, 625),
        # The drive's own interrupt, and a wire from OUT1 to IN1, whose filter takes 10 ms.
        ("CFGINT_M1 = HIGH\nM1 = ON\nMAIN:\n$I1 = $I1 + 1\nJUMP MAIN\nINT_M1:\n$I0 = $I1 + 7\nRETURN\n", 7),
        ("OUT1 = ON\n" + COUNT_WITHOUT_INPUT, 3),
        ("OUTPUTS = 1\n" + COUNT_WITHOUT_INPUT, 3),
        # Each 10 ms from the write on.
        ("CFGINT_TICK = HIGH\n" + COUNT_TICKS, 599),
    ],
)
def test_what_a_write_leads_to_comes_at_its_moment_although_the_program_could_run_ahead(text: str, count: int) -> None:
    rig = programmed(text)
    rig.scheduler.connect(Wire(PinName("m", "OUT1"), PinName("m", "IN1")))
    rig.start()
    rig.wait(6.0)
    assert rig.i(0) == pytest.approx(count, abs=1)
    assert rig.i(1) < 6000 / 2  # no round with fewer than 2 statements


def test_registers_of_drives_are_read_in_units_and_inputs_are_the_first_sixteen() -> None:
    text = (
        "LimLM1 = -1.5\nLimRM1 = 2.5\nAccM1 = 40\nDecM1 = 30\nVmaxM1 = 20\n"
        "$R0 = LimLM1\n$R2 = LimRM1\n$R4 = INPUTS\n$R6 = AccM1\n$R8 = DecM1\n$R10 = VmaxM1\nWAIT IN9 = ON\n"
    )
    rig = programmed(text, "", controller(MM))
    for pin in ("IN1", "IN16", "IN17", "IN20"):
        rig.pin(pin, 1.0)
    rig.wait(0.1)
    rig.start()
    rig.wait(0.1)
    assert [rig.r(number) for number in range(0, 12, 2)] == [-1.5, 2.5, 0x8001, 40.0, 30.0, 20.0]


@pytest.mark.parametrize(("wait", "seconds"), [("VactM1 > 500", 0.5), ("VactM1 = 1000", 1.0), ("PosM1 > 1000", 1.5)])
def test_a_wait_for_what_a_ramp_changes_ends_during_the_motion(wait: str, seconds: float) -> None:
    """At 1000 pulses/s²: 1000 pulses/s after 1 s and 500 pulses."""
    rig = programmed(f"M1 = ON\nVABS M1 1000\nWAIT {wait}\nOUT1 = ON\nWAIT IN9 = ON\n")
    rig.start()
    assert rig.pin_until("OUT1", 1.0) == pytest.approx(0.002 + seconds, abs=0.003)


@pytest.mark.parametrize(
    ("counts", "pulses", "first", "seconds"),
    [(100_000, 1, 0, 2**31 / 1e8), (400, 3200, 2**31 - 1001, 1000 / 125), (-400, 3200, -(2**31) + 1000, 1000 / 125)],
)
def test_a_wait_notices_that_an_encoder_wraps(counts: int, pulses: int, first: int, seconds: float) -> None:
    """At 1000 pulses/s, with as many counts per pulses as the encoder gives, whatever is configured."""
    wait = f"WAIT ENC1 {'<' if counts > 0 else '>'} 0"
    rig = programmed(f"M1 = ON\nVABS M1 1000\n{wait}\nOUT1 = ON\nWAIT IN9 = ON\n")
    rig.device.gear_encoder(1, counts, pulses, 0)
    rig.set("ENC_IMP", first)
    rig.start()
    # A ramp of 1 s is half a second longer than no ramp.
    assert rig.pin_until("OUT1", 1.0) == pytest.approx(seconds + 0.5, abs=0.02)


@pytest.mark.parametrize("direction", [1, -1])
def test_a_wait_notices_that_a_position_wraps(direction: int) -> None:
    """1280 pulses before the end of the counter, at 1000 pulses/s. A ramp of 1 s is half a second longer than none."""
    first = 2**31 - 1280 if direction > 0 else -(2**31) + 1279
    sign = "<" if direction > 0 else ">"
    rig = programmed(f"M1 = ON\nVABS M1 {1000 * direction}\nWAIT PosM1 {sign} 0\nOUT1 = ON\nWAIT 1 = 2\n")
    rig.device.axes[0].set_coordinate(first, 0)
    rig.start()
    assert rig.pin_until("OUT1", 1.0) == pytest.approx(1.28 + 0.5, abs=0.005)
    assert rig.position(1) == pytest.approx(-direction * 2**31, abs=200)


@pytest.mark.parametrize("direction", [1, -1])
def test_a_wait_for_the_last_position_before_the_wrap_ends_there(direction: int) -> None:
    """Single precision: the last 64 positions are read as ±2³¹. The positions behind the wrap are on the other side again."""
    first = 2**31 - 1280 if direction > 0 else -(2**31) + 1279
    rig = programmed(f"M1 = ON\nVABS M1 {1000 * direction}\nWAIT PosM1 = {direction * 2**31}\nOUT1 = ON\nWAIT 1 = 2\n")
    rig.device.axes[0].set_coordinate(first, 0)
    rig.start()
    assert rig.pin_until("OUT1", 1.0) == pytest.approx(1.28 - 0.064 + 0.5, abs=0.005)


@pytest.mark.parametrize("first", [2**31 - 10, -(2**31) + 9])
def test_a_wait_for_an_encoder_near_its_end_looks_at_every_statement_time(first: int) -> None:
    """The counter wraps within the foreseen time, while the axis turns it by 80 counts."""
    speed, sign = (640, "<") if first > 0 else (-640, ">")
    rig = programmed(f"M1 = ON\nVABS M1 {speed}\nWAIT ENC1 {sign} 0\nOUT1 = ON\nWAIT 1 = 2\n")
    rig.set("ENC_IMP", first)
    rig.start()
    # 8 pulses are a count: 80 pulses at 1000 pulses/s².
    assert rig.pin_until("OUT1", 1.0) == pytest.approx(0.4, abs=0.02)


def test_a_wait_for_the_end_of_a_motion_ends_at_its_next_look() -> None:
    """VMAX and ACC are 1000: 1000 pulses take 2 s."""
    rig = programmed("M1 = ON\nPABS M1 1000\nWAIT M1 = 0\nOUT1 = ON\nVABS M1 10\nWAIT M1 = 0\nOUT2 = ON\nWAIT 1 = 2\n")
    rig.start()
    assert rig.pin_until("OUT1", 1.0) == pytest.approx(2.003, abs=0.0015)
    rig.wait(5)
    assert (rig.out(2), rig.device.deadline()) == (False, None)
    rig.stop(1)
    rig.wait(0.1)
    assert rig.out(2)


def test_a_drive_is_said_to_move_up_to_the_last_nanosecond_of_its_motion() -> None:
    """What is foreseen of M1 is what is read of it: the interval ends where the value is another in the next nanosecond."""
    rig = programmed("M1 = ON\nPABS M1 1000\nWAIT 1 = 2\n")
    rig.start()
    rig.wait(0.1)
    register, control = ACCESS["M"], rig.device.program
    assert register.tendency is not None
    (end,) = [*(register.tendency(1)(control, rig.now) or ())]
    assert [register.read(1)(control, at) for at in (rig.now, end, end + 1)] == [1, 1, 0]
    rig.wait(3)
    assert [at for at in register.tendency(1)(control, rig.now) or () if at > rig.now] == []


@pytest.mark.parametrize(("name", "number", "period"), [("TIMA", 2, 10 * MILLISECOND), ("TIMB", 16, SECOND)])
def test_a_timer_is_said_to_count_until_it_stops(name: str, number: int, period: int) -> None:
    rig = started(f"{name}{number} = 999990\nWAIT 1 = 2\n")
    rig.wait(0.001)
    register, control = ACCESS[name], rig.device.program
    assert register.tendency is not None
    (end,) = [*(register.tendency(number)(control, rig.now) or ())]
    assert end == rig.now + 9 * period
    assert [register.read(number)(control, at) for at in (rig.now, end)] == [999_990, 999_999]
    rig.wait(10)
    assert [*(register.tendency(number)(control, rig.now) or ())] == []


def test_switches_of_interrupts_are_read_back() -> None:
    rig = started(
        "CFGINT_IN3 = FALL\nCFGINT_TICK = HIGH\nCFGINT_M2 = HIGH\n$I0 = CFGINT_IN3\n$I1 = CFGINT_IN2\n"
        "$I2 = CFGINT_TICK\n$I3 = CFGINT_TICK100\n$I4 = CFGINT_M2\n$I5 = CFGINT_M1\nWAIT 1 = 2\n"
        + "".join(f"INT_{event}:\nRETURN\n" for event in ("IN3", "TICK", "M2"))
    )
    rig.wait(0.1)
    assert [rig.i(number) for number in range(6)] == [2, 0, 4, 0, 4, 0]


# ---------------------------------------------------------------------- motion statements

ROWS = "here;10;x;x;x\nboth;30;20;x;x\nline;40;0;25;x\ncircle;50;0;10;360\narc;20;40;10;0\nnothing;x;x;x;x\n"


def test_moveptp_starts_all_axes_in_the_same_instant() -> None:
    rig = started("M1 = ON\nM2 = ON\nMOVEPTP @both\nWAITPOS\nOUT1 = ON\nWAIT IN9 = ON\n", ROWS)
    rig.wait(0.1)
    assert [axis.profile.start for axis in rig.device.axes[:2]] == [3_000_000] * 2
    rig.wait(5.0)
    assert (rig.position(1), rig.position(2), rig.out(1)) == (30.0, 20.0, True)


def test_wbc_8_waitpos_skips_drives_that_are_off_and_never_ends_in_velocity_mode() -> None:
    rig = started("M1 = ON\nPABS M1 10\nPABS M2 50\nWAITPOS\nOUT1 = ON\nVABS M1 5\nWAITPOS\nOUT2 = ON\n")
    rig.wait(60.0)
    assert (rig.out(1), rig.out(2)) == (True, False)
    rig.stop()
    rig.wait(0.01)
    assert rig.out(2) or rig.state == STOPPED


def test_waitpos_passes_at_a_limit() -> None:
    rig = started("M1 = ON\nLimRM1 = 15\nPABS M1 100\nWAITPOS\n$R0 = PosM1\n$I2 = StatM1\nWAIT IN9 = ON\n")
    rig.wait(5.0)
    assert (rig.r(0), rig.i(2)) == (15.0, 10)


def test_brake_ramps_and_stop_does_not() -> None:
    rig = started("M1 = ON\nM2 = ON\nVABS M1 40\nVABS M2 40\nDELAY 1\nBRAKE M1\nSTOP M2\nWAIT IN9 = ON\n")
    rig.wait(1.06)
    assert 0.0 < rig.velocity(1) < 40.0
    assert rig.velocity(2) == 0.0
    rig.wait(1.0)
    assert rig.velocity(1) == 0.0


def test_a_line_from_the_registers_of_row_0() -> None:
    rows = "scratch;x;x;x;x\n"
    rig = started("M1 = ON\nM2 = ON\nLinX = 30\nLinY = 40\nLinVel = 25\nMOVELIN 0\nWAITPOS\nOUT1 = ON\nWAIT IN9 = ON\n", rows)
    rig.wait(1.0)
    # WBC-16: what was left alone counts now; WBC-11: speed along the line.
    assert (rig.velocity(1), rig.velocity(2)) == (pytest.approx(15.0), pytest.approx(20.0))
    rig.pin_until("OUT1", 1.0)
    assert (rig.position(1), rig.position(2)) == (30.0, 40.0)
    # 50 mm at 25 mm/s with ramps of 200 mm/s².
    assert rig.now / 1e9 == pytest.approx(0.006 + 50 / 25 + 25 / 200, abs=0.003)


@pytest.mark.parametrize(
    ("statement", "rows", "problem"),
    [
        ("MOVEPTP $I0", ROWS, "row"),
        ("DOARC @far", "far;500;500;10;0\n", "arc"),
        ("DOCIRC @circle", ROWS, "begins at"),
        ("CircR = 0\nMOVETOCIRC 0", "c;10;10;5;360\n", "radius"),
        ("LinVel = 0\nMOVELIN 0", "c;10;10;5;x\n", "velocity"),
    ],
)
def test_paths_that_cannot_be_run_are_program_errors(statement: str, rows: str, problem: str) -> None:
    rig = programmed(f"M1 = ON\nM2 = ON\n{statement}\nWAIT IN9 = ON\n", rows, controller(MM, MM))
    rig.i(0, 99)
    rig.start()
    rig.wait(0.1)
    assert (rig.state, rig.m_status) == (STOPPED, 2)
    (error,) = rig.events("program-error")
    assert problem in error.text.lower()


def test_velocities_of_programs_are_in_units() -> None:
    rig = started("M2 = ON\nVABS M2 -12.5\nDELAY 1\n$R0 = VactM2\nWAIT IN9 = ON\n")
    rig.wait(1.5)
    assert rig.r(0) == rig.velocity(2) == -12.5


@pytest.mark.parametrize("coupling", [Coupling.FREE, Coupling.BLOCKED])
def test_a_wait_for_an_encoder_that_nothing_turns_ends_when_a_hand_does(coupling: Coupling) -> None:
    """WBC-18: nothing happens by itself meanwhile; after the hand the program looks at its next statement time, 1 ms."""
    rig = programmed("WAIT ENC1 >= 100\nOUT1 = ON\nWAIT IN9 = ON\n")
    rig.device.couple_encoder(1, coupling, 0)
    rig.start()
    rig.wait(0.5)
    assert rig.device.deadline() is None
    rig.wait_ns(300_000)
    rig.device.turn_encoder(1, 99, rig.now)
    rig.wait(0.5)
    assert not rig.out(1)
    rig.device.turn_encoder(1, 1, rig.now)
    looks = rig.now // MILLISECOND + 1
    assert rig.pin_until("OUT1", 1.0) == pytest.approx((looks + 1) / 1000)


class Roller:
    """Mechanics that turn a shaft by 1600 pulses a second from the first second on."""

    def count(self, now: int) -> int:
        return max(0, now - SECOND) * 1600 // SECOND


def test_a_wait_for_an_encoder_that_mechanics_turn_looks_at_every_statement_time() -> None:
    """400 counts in 3200 pulses (the defaults): 100 counts are 800 pulses, reached 0.5 s after the first second."""
    rig = programmed("WAIT ENC1 >= 100\nOUT1 = ON\nWAIT IN9 = ON\n")
    rig.device.follow_shaft(1, Roller(), 0)
    rig.start()
    assert rig.pin_until("OUT1", 1.0) == pytest.approx(1.501, abs=1e-9)
