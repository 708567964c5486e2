"""Programs in a controller: banks, PROGRAM_CTRL, power-on, snapshots, wires."""

from __future__ import annotations

import pickle
from dataclasses import replace
from functools import partial

import pytest
from mic488_rig import PAUSED, RUNNING, STOPPED, Rig, controller, loaded, programmed, started

from steptwin.controller import MILLISECOND, SECOND, PinEdge
from steptwin.diagnostics import Span
from steptwin.errors import Misuse
from steptwin.mic488.axis import MAX_SPEED_P
from steptwin.mic488.config import AxisConfig, ControllerConfig, ProgramConfig
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.program_banks import load, setup_of
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.wires import PinName, Wire
from steptwin.wbc.check import check
from steptwin.wbc.positions import parse_positions

COUNTER = "n = n + 1\n$R0 = n\nWAIT 1 = 2\n"


# ---------------------------------------------------------------------- banks


@pytest.mark.parametrize(("firmware", "last"), [("1.23", 7), ("1.40", 7), ("1.70", 5)])
def test_mic_28_banks_of_the_firmware(firmware: str, last: int) -> None:
    rig = programmed("OUT1 = ON\nWAIT 1 = 2\n", "", None, firmware)
    rig.load("MOVEPTP @A\nOUT2 = ON\nWAIT 1 = 2\n", "A;1;2;3;4\n", bank=last)
    program, table = loaded("END\n", "A;1;2;3;4\n", firmware)
    with pytest.raises(Misuse, match=rf"program bank {last + 1}: permitted are 0…{last}"):
        rig.device.load_program(last + 1, program)
    with pytest.raises(Misuse, match=rf"position bank -1: permitted are 0…{last}"):
        rig.device.load_positions(-1, table)
    rig.word("PROG_BANK_SEL", last)
    rig.word("POS_BANK_SEL", last)
    rig.start()
    rig.wait(0.1)
    assert (rig.out(1), rig.out(2)) == (False, True)


def test_mic_31_a_bank_chosen_counts_from_the_next_start() -> None:
    rig = programmed("OUT1 = ON\nWAIT 1 = 2\n")
    rig.load("OUT2 = ON\nWAIT 1 = 2\n", bank=1)
    rig.start()
    rig.word("PROG_BANK_SEL", 1)
    rig.wait(0.1)
    rig.pause()
    rig.start()
    rig.wait(0.1)
    assert (rig.out(1), rig.out(2)) == (True, False)
    rig.halt()
    rig.start()
    rig.wait(0.1)
    assert (rig.out(1), rig.out(2)) == (False, True)


def test_a_bank_in_use_cannot_be_loaded() -> None:
    rig = programmed(COUNTER)
    rig.start()
    with pytest.raises(Misuse, match="program bank 0 is in use: stop the program first"):
        rig.load("END\n")
    rig.pause()
    with pytest.raises(Misuse, match="program bank 0 is in use"):
        rig.load("END\n")
    rig.load("END\n", bank=1)
    rig.halt()
    rig.load("END\n")


def test_a_program_with_errors_cannot_be_loaded() -> None:
    with pytest.raises(Misuse, match=r"pick\.prg cannot run: unknown variable y"):
        load(check("x = y\n"), "pick.prg")
    with pytest.raises(Misuse, match="cannot run: its positions are not known without a table"):
        load(check("MOVEPTP @A\n"))


def test_a_program_longer_than_the_firmware_holds_is_refused() -> None:
    long = "OUT1 = ON\n" * 1001
    device = Mic488Device(ControllerConfig(), "1.40")
    with pytest.raises(Misuse, match=r"long\.prg: 1001 executable lines, firmware 1\.40 holds 1000"):
        device.load_program(0, load(check(long), "long.prg"))
    Mic488Device(ControllerConfig(), "1.70").load_program(0, load(check(long)))


@pytest.mark.parametrize("rows", ["", None])
def test_wbc_25_a_program_that_uses_positions_needs_a_position_bank(rows: str | None) -> None:
    table, _ = parse_positions("A;1;2;3;4\n")
    for line in ("MOVEPTP @A", "$R0 = LinX", "PTPM2 = 3\n$I0 = 1\nMOVEPTP $I0", "LinX = 3\nMOVELIN $I0"):
        rig = Rig(programs={0: load(check(f"{line}\nEND\n", table))})
        if rows is not None:
            rig.device.load_positions(0, parse_positions(rows)[0])
        rig.word("PROGRAM_CTRL", 1)
        rig.wait(0.1)
        assert (rig.word("PROGRAM_CTRL"), rig.word("M_STATUS"), rig.pins()["ERR"]) == (0, 2, 1.0)
        assert [event.text for event in rig.events("program-error")] == ["position bank 0 is empty"]
    rig = Rig(programs={0: load(check("OUT1 = ON\nWAIT 1 = 2\n"))})
    rig.word("PROGRAM_CTRL", 1)
    rig.wait(0.1)
    assert rig.word("PROGRAM_CTRL") == 1


def test_wbc_25_a_row_0_that_the_program_writes_needs_no_position_bank() -> None:
    rig = programmed(
        "M1 = ON\nM2 = ON\nLinX = 5\nLinVel = 50\nMOVELIN 0\nWAITPOS\nPTPM2 = 3\nMOVEPTP 0\nWAITPOS\nOUT1 = ON\nWAIT 1 = 2\n"
    )
    rig.start()
    rig.pin_until("OUT1", 1.0)
    assert [rig.position(axis) for axis in (1, 2)] == [5, 3]


def test_positions_of_an_image_replace_rows_of_the_table() -> None:
    record = "0005" + "0000803f" + "00004040" + "0000a040" + "0000e040"
    moves = "M1 = ON\nM2 = ON\nM3 = ON\nMOVEPTP 1\nWAITPOS\nOUT1 = ON\nWAIT 1 = 2\n"
    rig = programmed(f"//!position 1 {record}\n{moves}", "A;1;2;3;4\nB;9;9;9;9\n")
    rig.start()
    rig.pin_until("OUT1", 1.0)
    # 1 and 5 for M1 and M3: the mask is 0101.
    assert [rig.position(axis) for axis in (1, 2, 3)] == [1, 0, 5]


# ---------------------------------------------------------------------- control


def test_mic_22_the_state_is_read() -> None:
    rig = programmed("WAIT IN1 = ON\nEND\n")
    assert rig.state == STOPPED
    rig.start()
    assert rig.state == RUNNING
    rig.pause()
    assert rig.state == PAUSED
    rig.start()
    rig.pin("IN1", 1)
    rig.wait(1)
    assert rig.state == STOPPED


def test_mic_31_starting_a_running_program_changes_nothing() -> None:
    rig = programmed(COUNTER)
    rig.start()
    rig.wait(1)
    rig.start()
    rig.wait(1)
    assert rig.r(0) == 1


def test_mic_31_program_and_master_command_the_same_axis_and_the_last_wins() -> None:
    rig = programmed("M1 = ON\nPABS M1 5000\nDELAY 2\nPABS M1 100\nWAITPOS\nOUT1 = ON\nWAIT 1 = 2\n")
    rig.start()
    rig.wait(1)
    rig.set("VEL_ABS", -300.0)
    rig.wait(0.5)
    assert rig.status(1) == 2
    rig.pin_until("OUT1", 1.0)
    assert (rig.position(1), rig.status(1)) == (100, 4)


def test_user_registers_are_shared_with_the_master() -> None:
    rig = programmed("WAIT $I10 = 7\n$D12 = $I10 * -100000\n$R14 = $D12 / 3\nWAIT 1 = 2\n")
    rig.start()
    rig.wait(100)
    rig.i(10, 7)
    rig.wait(0.1)
    assert (rig.d(12), rig.r(14)) == (-700_000, pytest.approx(-233333.33, rel=1e-6))


def test_registers_of_axes_and_inputs_as_a_program_sees_them() -> None:
    rig = programmed(
        "M1 = ON\nAccM1 = 250\nDecM1 = 500\nVmaxM1 = 40\nLimLM1 = -7\nLimRM1 = 90\nPosM1 = 10\nENC1 = 55\n"
        "$I0 = StatM1\n$I1 = M1\nPREL M1 20\n$I2 = StatM1\n$I3 = M1\nWAITPOS\n"
        "$R10 = PosM1\n$R12 = VactM1\n$D14 = ENC1\n$R16 = AIN1\n$I18 = INPUTS\n"
        "$I19 = IN3\n$I20 = OUTPUTS\n$I21 = STATUS\nWAIT 1 = 2\n"
    )
    rig.pin("IN3", 1)
    rig.pin("AIN1", 2.5)
    rig.wait(0.1)
    rig.start()
    rig.wait(5)
    assert [rig.i(n) for n in (0, 1, 2, 3, 18, 19, 20, 21)] == [1, 0, 3, 1, 4, 1, 0, 0]
    assert [rig.get(key) for key in ("ACC", "DEC", "VMAX", "POSLIM_L", "POSLIM_R")] == [250, 500, 40, -7, 90]
    assert (rig.r(10), rig.r(12), rig.r(16), rig.position(1)) == (30, 0, 2.5, 30)


@pytest.mark.parametrize(("firmware", "status"), [("1.23", 0), ("1.40", 0), ("1.70", 1)])
def test_status_is_that_of_the_controller_from_1_70_on(firmware: str, status: int) -> None:
    rig = programmed("WAIT IN1 = ON\n$I0 = STATUS\nWAIT 1 = 2\n", "", None, firmware)
    rig.start()
    rig.wait(0.1)
    rig.device.command(rig.device.axes[0].position_lost, rig.now)
    rig.start()
    rig.pin("IN1", 1)
    rig.wait(0.1)
    assert rig.i(0) == status


# ---------------------------------------------------------------------- power

AT_POWER_ON = replace(ControllerConfig(), program=ProgramConfig(activate=1, prog_bank=2, pos_bank=3))


def test_the_configuration_starts_a_program_at_power_on() -> None:
    program, table = loaded("M1 = ON\nMOVEPTP @A\nOUT1 = ON\nWAIT 1 = 2\n", "A;10;x;x;x\n")
    rig = Rig(AT_POWER_ON, programs={2: program}, positions={3: table})
    rig.wait(5)
    assert (rig.word("PROGRAM_CTRL"), rig.position(1), rig.word("M_STATUS")) == (1, 10, 0)
    rig.device.power_cycle(rig.now)
    assert [(edge.pin, edge.value) for edge in rig.device.take_edges()] == [("OUT1", 0.0), ("M1_EN", 0.0)]
    rig.wait(5)
    assert (rig.word("PROGRAM_CTRL"), rig.position(1), rig.pins()["OUT1"]) == (1, 10, 1.0)
    assert rig.device.axes[0].profile.count(rig.now) == 20


def test_power_off_ends_a_program_that_nothing_starts_again() -> None:
    rig = programmed("TIMB1 = 7\nOUT1 = ON\nPULSE(OUT2, 1)\nWAIT 1 = 2\n")
    rig.start()
    rig.wait(0.5)
    rig.device.power_cycle(rig.now)
    rig.wait(5)
    assert (rig.state, rig.out(1), rig.out(2), rig.device.deadline()) == (STOPPED, False, False, None)


def test_after_power_off_a_program_does_nothing_more() -> None:
    rig = programmed("OUT1 = ON\nPULSE(OUT2, 1)\nDELAY 1\nOUT3 = ON\nWAIT 1 = 2\n")
    rig.start()
    rig.wait(0.5)
    rig.device.power_off(rig.now)
    assert rig.device.program.state == STOPPED
    rig.wait(5)
    assert (rig.device.deadline(), rig.device.outputs) == (None, [False] * 8)


def test_variables_are_seen_and_set_by_name() -> None:
    rig = programmed("x = 2\ny = 3\nWAIT IN1 = ON\n$R0 = x\n$R2 = y\nWAIT 1 = 2\n")
    control = rig.device.program
    assert control.variables(0) == {}
    with pytest.raises(Misuse, match=r"^the program has no variable 'x': there are none$"):
        control.set_variable("x", 1.0, 0)
    rig.start()
    rig.wait(0.1)
    assert control.variables(rig.now) == {"x": 2.0, "y": 3.0}
    control.set_variable("y", -7.5, rig.now)
    with pytest.raises(Misuse, match=r"^the program has no variable 'z': there are x, y$"):
        control.set_variable("z", 1.0, rig.now)
    for value in (3.5e38, -3.5e38):
        with pytest.raises(Misuse, match=r"^x = -?3\.5e\+38: permitted are -3\.40282e\+38…3\.40282e\+38$"):
            control.set_variable("x", value, rig.now)
    rig.pin("IN1", 1)
    rig.wait(0.1)
    assert (rig.r(0), rig.r(2)) == (2.0, -7.5)


# ---------------------------------------------------------------------- snapshots, sharing, wires

BUSY = "M1 = ON\nL:\nPREL M1 30\nWAITPOS\nDELAY 0.1\nn = n + 1\n$R0 = n\nWHILE TIMA1 < 50\nENDWHILE\nTIMA1 = 0\nJUMP L\n"


def test_a_snapshot_in_the_middle_of_any_statement_goes_on_elsewhere() -> None:
    program, table = loaded(BUSY)

    def new() -> Mic488Device:
        return Mic488Device(ControllerConfig(), programs={0: program}, positions={0: table})

    one = new()
    one.command(partial(one.program.command, 1), 0)
    for step in range(60):
        one.advance(step * 17 * MILLISECOND)
        other = new()
        other.restore(pickle.loads(pickle.dumps(one.snapshot())))
        assert other.program.statement(other.now) == one.program.statement(one.now)
        end = one.now + 2 * SECOND
        ahead = new()
        ahead.restore(one.snapshot())
        other.advance(end)
        ahead.advance(end)
        assert other.take_edges() == ahead.take_edges()
        assert other.user == ahead.user
        assert other.axes[0].coordinate_p(end) == ahead.axes[0].coordinate_p(end)


def test_a_snapshot_brings_the_contents_of_the_banks() -> None:
    """Also pickled, where programs have to be made again from their texts; positions have the rows that they had."""
    text = "MOVEPTP @B\nLOOP:\nDELAY 100\nJUMP LOOP\n"
    rig = programmed(text, "A;1;x;x;x\nB;2;x;x;x\n")
    rig.device.load_positions(0, parse_positions("B;7;x;x;x\nA;8;x;x;x\n")[0])
    rig.start()
    rig.wait(0.5)
    snapshot = rig.device.snapshot()
    for copy in (snapshot, pickle.loads(pickle.dumps(snapshot))):
        other = programmed(COUNTER)
        other.start()
        other.device.restore(copy)
        control = other.device.program
        assert control.banks.contents() == rig.device.program.banks.contents()
        assert control.statement(other.device.now) == rig.device.program.statement(rig.device.now)
        assert control.banks.positions[0].rows[1].values[0] == 8.0
        assert control.banks.programs[0].steps == rig.device.program.banks.programs[0].steps
        other.device.restore(copy)


def test_controllers_share_a_program_and_nothing_else() -> None:
    program, table = loaded("L:\nn = n + AIN1\n$R0 = n\nDELAY 1\nJUMP L\n")
    rigs = [Rig(programs={0: program}, positions={0: table}) for _ in range(3)]
    for volts, rig in enumerate(rigs):
        rig.pin("AIN1", float(volts))
        rig.word("PROGRAM_CTRL", 1)
    for rig in rigs:
        rig.wait(5.5)
    assert [rig.device.program.interpreter.cells[0] for rig in rigs] == [0, 6, 12]


def test_outputs_of_programs_travel_over_wires_and_back_in_one_world() -> None:
    ping, table = loaded("L:\nOUT1 = ON\nWAIT IN1 = ON\nOUT1 = OFF\nWAIT IN1 = OFF\nn = n + 1\n$R0 = n\nJUMP L\n")
    pong, _ = loaded("L:\nWAIT IN1 = ON\nOUT1 = ON\nWAIT IN1 = OFF\nOUT1 = OFF\nJUMP L\n")
    scheduler = Scheduler()
    one, other = (Mic488Device(ControllerConfig(), programs={0: program}, positions={0: table}) for program in (ping, pong))
    scheduler.add("one", one)
    scheduler.add("other", other)
    scheduler.connect(Wire(PinName("one", "OUT1"), PinName("other", "IN1")))
    scheduler.connect(Wire(PinName("other", "OUT1"), PinName("one", "IN1")))
    seen: list[PinEdge] = []
    scheduler.edge_subscribers.append(lambda name, edge: seen.append(edge))
    for device in (one, other):
        device.command(partial(device.program.command, 1), 0)
    scheduler.advance(SECOND)
    rounds = one.program.interpreter.cells[0]
    # Every way takes the filter of the input and a statement or two.
    assert 18 <= rounds <= 22
    assert [edge.time for edge in seen] == sorted(edge.time for edge in seen)
    assert len(seen) == pytest.approx(4 * rounds, abs=4)


def test_a_program_without_any_wait_does_not_hang_and_lets_others_work() -> None:
    for statement_time in (0, MILLISECOND):
        rig = programmed("L:\nn = n + 1\n$R0 = n\nJUMP L\n", statement_time=statement_time)
        rig.start()
        for step in range(1, 100):
            rig.wait(0.01)
            due = rig.device.deadline()
            assert due is not None
            assert rig.now < due <= rig.now + MILLISECOND
            rig.i(7, step)
            assert rig.i(7) == step
        assert rig.r(0) > 300


# ---------------------------------------------------------------------- a program at rest and masters


@pytest.mark.parametrize(
    ("name", "key"), [("VmaxM1", "VMAX"), ("AccM1", "ACC"), ("DecM1", "DEC"), ("LimLM1", "POSLIM_L"), ("PosM1", "POS_ACT")]
)
def test_a_waiting_program_notices_what_a_master_writes(name: str, key: str) -> None:
    """It waits without looking all the time; a write of the register lets it look."""
    rig = programmed(f"WAIT {name} = 5\nOUT1 = ON\nWAIT 1 = 2\n")
    rig.start()
    rig.wait(3.0)
    assert not rig.out(1)
    rig.set(key, 5.0)
    rig.wait(0.1)
    assert rig.out(1)


@pytest.mark.parametrize("paused", [False, True])
def test_mic_31_program_control_0_ends_a_program_with_drives_and_outputs_off(paused: bool) -> None:
    rig = programmed("M1 = ON\nVABS M1 100\nOUT1 = ON\nWAIT 1 = 2\n")
    rig.start()
    rig.wait(0.1)
    if paused:
        rig.pause()
    assert (rig.status(), rig.out(1)) == (2, True)
    rig.halt()
    assert (rig.status(), rig.out(1), rig.word("PROGRAM_CTRL")) == (0, False, 0)


def test_mic_8_a_program_stops_and_moves_an_axis_whose_en_is_not_wired() -> None:
    rig = programmed(
        "VABS M1 100\nDELAY 1\nM1 = OFF\nWAIT IN1 = ON\nM2 = ON\nLinX = 5\nLinY = 5\nLinVel = 50\nMOVELIN 0\nWAITPOS\nOUT1 = ON\n"
        "WAIT 1 = 2\n",
        "",
        controller(AxisConfig(en_wired=0)),
    )
    rig.start()
    rig.wait(0.9)
    assert rig.status() == 2
    rig.wait(0.3)
    assert (rig.status(), rig.velocity()) == (0, 0.0)
    rig.pin("IN1", 1)
    rig.wait(5.0)
    assert (rig.out(1), rig.position(1), rig.position(2)) == (True, 5.0, 5.0)


def test_behind_the_last_line_a_program_stands_at_the_end_of_its_text() -> None:
    text = "OUT1 = ON\nOUT2 = ON\n"
    rig = programmed(text)
    rig.start()
    places = []
    for _ in range(4):
        places.append(rig.device.program.statement(rig.device.now))
        rig.wait(0.001)
    assert places == [Span(0, 9), Span(10, 19), Span(len(text), len(text)), None]


@pytest.mark.parametrize(
    ("axis", "ends"),
    [
        (AxisConfig(), (False, False)),
        (AxisConfig(in_kl=3), (True, False)),
        (AxisConfig(in_kr=4), (False, True)),
        (AxisConfig(in_kl=3, in_kr=4), (True, True)),
        (AxisConfig(home_mode=3), (True, True)),
        (AxisConfig(home_mode=2), (False, False)),
    ],
)
def test_what_the_checker_is_told_of_a_configuration(axis: AxisConfig, ends: tuple[bool, bool]) -> None:
    """A homing ends at a switch that has an input; HOME3 looks for the index only."""
    plain = AxisConfig()
    inputs = tuple(replace(one, interrupt=n % 4) for n, one in enumerate(ControllerConfig().inputs))
    first = replace(axis, gear=2.5, acc=30.0, dec=40.0)
    setup = setup_of(ControllerConfig(axes=(first, plain, plain, plain), inputs=inputs))
    assert setup.gears == (2.5, *[plain.gear] * 3)
    assert setup.accelerations == (30.0, *[plain.acc] * 3)
    assert setup.decelerations == (40.0, *[plain.dec] * 3)
    assert setup.input_interrupts == tuple(n % 4 for n in range(20))
    assert setup.homing_ends == (ends, *[(False, False)] * 3)
    assert setup.most_speed_p == MAX_SPEED_P


def test_a_program_says_when_it_acted_on_the_rest_of_the_controller() -> None:
    """Axes and outputs are looked at only then: what merely computes runs on to the end of its time."""
    control = started("x = 0\nMAIN:\nx = x + 1\nJUMP MAIN\n").device.program
    due = control.deadline()
    assert due is not None
    assert control.advance(due, due + 10 * MILLISECOND) is None
    control = started("x = 0\nx = x + 1\nOUT1 = ON\nx = 3\n").device.program
    due = control.deadline()
    assert due is not None
    assert control.advance(due, due + 10 * MILLISECOND) == 3 * MILLISECOND  # WBC-6: each statement takes 1 ms
    assert control.advance(4 * MILLISECOND, 4 * MILLISECOND) is None
    control = started("x = 0\nDELAY 0.05\nx = 1\nDELAY 0.05\nOUT1 = ON\n").device.program
    due = control.deadline()
    assert due is not None
    assert control.advance(due, due + SECOND) == 103 * MILLISECOND  # nothing happens in a DELAY
