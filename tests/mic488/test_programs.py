"""Programs as a user sees them: written, started and stopped over Modbus, looked at through pins and registers."""

from __future__ import annotations

from array import array

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn
from mic488_rig import MM, RUNNING, STOPPED, controller, loaded, programmed, started

from steptwin.errors import Misuse
from steptwin.mic488.config import ProgramConfig
from steptwin.wbc.positions import PositionRow, PositionTable

# ---------------------------------------------------------------------- banks and PROGRAM_CTRL


def test_a_bank_is_chosen_for_the_next_start() -> None:
    rig = programmed("$I0 = 10\nWAIT IN1 = ON\n", "a;1;x;x;x\n")
    rig.load("$I0 = 15\nM1 = ON\nMOVEPTP 0\nWAIT IN1 = ON\n", "b;5;x;x;x\n", bank=5)
    rig.start()
    rig.wait(0.1)
    rig.word("PROG_BANK_SEL", 5)
    assert (rig.i(0), rig.state) == (10, RUNNING)
    rig.start()
    rig.wait(0.1)
    assert rig.i(0) == 10  # 1 while running changes nothing
    rig.halt()
    rig.start()
    rig.wait(0.1)
    assert (rig.i(0), rig.position()) == (15, 1.0)  # POS_BANK_SEL is another choice
    rig.halt()
    rig.word("POS_BANK_SEL", 5)
    rig.start()
    rig.wait(1.0)
    assert rig.position() == 5.0


def test_an_empty_bank_lights_err_and_the_next_start_clears_it() -> None:
    rig = programmed("OUT1 = ON\nWAIT IN1 = ON\n")
    rig.word("PROG_BANK_SEL", 2)
    rig.start()
    assert (rig.state, rig.m_status, rig.pins()["ERR"]) == (STOPPED, 2, 1.0)
    assert [event.text for event in rig.events("program-error")] == ["program bank 2 is empty"]
    rig.word("PROG_BANK_SEL", 0)
    assert rig.m_status == 2
    rig.start()
    rig.wait(0.01)
    assert (rig.state, rig.m_status, rig.pins()["ERR"], rig.out(1)) == (RUNNING, 0, 0.0, True)


def test_wbc_25_a_program_that_uses_positions_needs_a_table() -> None:
    rig = started("M1 = ON\nMOVEPTP $I0\n")
    assert (rig.state, rig.m_status) == (STOPPED, 2)
    assert rig.events("program-error")[0].text == "position bank 0 is empty"
    assert started("M1 = ON\nPABS M1 5\n").state == RUNNING


def test_banks_that_are_not_there_or_in_use() -> None:
    rig = started("WAIT IN1 = ON\n")
    program, table = loaded("END\n")
    with pytest.raises(Misuse, match=r"program bank 6: permitted are 0…5"):
        rig.device.load_program(6, program)
    for load, what in ((rig.device.load_program, program), (rig.device.load_positions, table)):
        with pytest.raises(Misuse, match="bank 0 is in use: stop the program first"):
            load(0, what)  # type: ignore[operator]
    rig.halt()
    rig.device.load_program(0, program)
    rig.start()
    rig.wait(0.01)
    assert rig.state == STOPPED


def test_a_position_bank_holds_227_rows() -> None:
    device = programmed("END\n").device
    rows = tuple(PositionRow(f"P{number}", (1, None, None, None)) for number in range(228))
    device.load_positions(0, PositionTable(rows[:227]))
    with pytest.raises(Misuse, match=r"^228 positions: a bank holds 227$"):
        device.load_positions(0, PositionTable(rows))
    assert len(device.program.banks.positions[0].rows) == 227


def test_power_on_starts_what_the_configuration_says() -> None:
    config = controller(program=ProgramConfig(activate=1, prog_bank=0, pos_bank=0))
    rig = programmed("$I3 = $I3 + 1\nWAIT IN1 = ON\nEND\n", config=config)
    rig.wait(0.01)
    assert (rig.state, rig.i(3)) == (RUNNING, 1)
    rig.device.power_cycle(rig.now)
    rig.wait(0.01)
    assert (rig.state, rig.i(3)) == (RUNNING, 1)  # user registers begin with 0


def test_stopping_and_end_switch_drives_and_outputs_off() -> None:
    for text in ("M1 = ON\nOUT3 = ON\nVABS M1 20\nWAIT IN1 = ON\n", "M1 = ON\nOUT3 = ON\nVABS M1 20\nDELAY 1\nEND\nOUT4 = ON\n"):
        rig = started(text)
        rig.wait(0.5)
        assert (rig.out(3), rig.velocity()) == (True, 20.0)
        if "END" in text:
            rig.wait(1.0)
        else:
            rig.halt()
        assert (rig.state, rig.status(), rig.velocity(), rig.m_status) == (STOPPED, 0, 0.0, 0)
        assert not any(level for pin, level in rig.pins().items())


def test_progreset_begins_again_with_drives_off_and_everything_new() -> None:
    rig = started("n = n + 1\n$I0 = $I0 + n\nOUT2 = ON\nM1 = ON\nVABS M1 20\nTIMA1 = 500\nDELAY 1\nPROGRESET\n")
    rig.wait(1.5)
    # Variables are new every time, user registers and outputs stay.
    assert (rig.i(0), rig.out(2)) == (2, True)
    assert [on for _, on in rig.changes("M1_EN")] == [1.0, 0.0, 1.0]
    assert [on for _, on in rig.changes("OUT2")] == [1.0]


# ---------------------------------------------------------------------- statement time, jumps, returns


def test_wbc_6_a_statement_takes_its_time() -> None:
    rig = started("OUT1 = ON\nOUT2 = ON\nSET x = 1\nOUT3 = x\n")
    rig.wait(1.0)
    assert [rig.changes(f"OUT{n}")[0][0] for n in (1, 2, 3)] == [0.001, 0.002, 0.004]
    slow = started("OUT1 = ON\nOUT2 = ON\n", statement_time=20_000_000)
    slow.wait(1.0)
    assert [slow.changes(f"OUT{n}")[0][0] for n in (1, 2)] == [0.02, 0.04]


def calls(depth: int) -> str:
    """Subroutines that call each other, each writing its number when the next has returned."""
    text = "JUMP S1\n$I0 = 1\nWAIT IN1 = ON\n"
    for n in range(1, depth + 1):
        text += f"S{n}:\n" + (f"JUMP S{n + 1}\n" if n < depth else "") + f"$I{n} = 1\nRETURN\n"
    return text


def test_wbc_1_sixteen_returns_are_remembered() -> None:
    rig = started(calls(16))
    rig.wait(1.0)
    assert [rig.i(n) for n in range(17)] == [1] * 17
    assert rig.state == RUNNING
    # Of seventeen the oldest is forgotten, and the last RETURN has nowhere to go.
    rig = started(calls(17))
    rig.wait(1.0)
    assert [rig.i(n) for n in range(18)] == [0, *[1] * 17]
    assert (rig.state, rig.m_status) == (STOPPED, 2)


def test_wbc_1_looping_by_jump_never_ends_the_memory() -> None:
    text = "SET n = 0\nMAIN:\nn = n + 1\nJUMP SUB\n$I0 = n\nIF n < 500\n    JUMP MAIN\nENDIF\n"
    text += "OUT1 = ON\nWAIT IN1 = ON\nSUB:\nRETURN\n"
    rig = started(text)
    rig.wait(10.0)
    assert (rig.i(0), rig.out(1), rig.state) == (500, True, RUNNING)


@pytest.mark.parametrize(
    "statement",
    ["$R8 = 1 / $I0", "$R8 = 5 % $I0", "$R8 = asin($R2)", "$R8 = acos($R2)", "$R8 = sqrt($R4)", "RETURN", "OUT1 = $I0 / $I0"],
)
def test_wbc_5_what_cannot_be_done_stops_the_program(statement: str) -> None:
    rig = programmed(f"M1 = ON\nVABS M1 40\nOUT2 = ON\nDELAY 1\n{statement}\n$R10 = 1\n", config=controller(MM))
    rig.r(2, 1.01)
    rig.r(4, -0.01)
    rig.start()
    rig.wait(1.02)
    assert (rig.state, rig.m_status, rig.pins()["ERR"]) == (STOPPED, 2, 1.0)
    # Drives ramp down, outputs stay.
    assert 0.0 < rig.velocity() < 40.0
    assert (rig.status(), rig.out(2)) == (2, True)
    rig.wait(1.0)
    assert (rig.velocity(), rig.status()) == (0.0, 1)
    assert rig.events("program-error")[-1].text.startswith("line 5: ")
    rig.halt()
    assert (rig.m_status, rig.pins()["ERR"]) == (0, 0.0)


# ---------------------------------------------------------------------- conditions, against an interpreter of their own


def trees(depth: int) -> st.SearchStrategy[list[object]]:
    """Blocks of IF, ELSE and counted WHILE loops with marks in them."""
    mark = st.integers(1, 9)
    if depth == 0:
        return st.lists(mark, max_size=3)  # type: ignore[return-value]
    sign = st.sampled_from(["=", "<", ">", "<=", ">="])
    condition = st.tuples(st.integers(0, 3), sign, st.integers(0, 3))
    inner = trees(depth - 1)
    branch = st.tuples(st.just("IF"), condition, inner, st.none() | inner)
    loop = st.tuples(st.just("WHILE"), st.integers(0, 3), inner, st.just(depth))
    return st.lists(mark | branch | loop, max_size=4)  # type: ignore[return-value]


def source_of(block: list[object]) -> list[str]:
    lines = []
    for item in block:
        if isinstance(item, int):
            lines.append(f"JUMP MARK{item}")
        elif isinstance(item, tuple) and item[0] == "IF":
            _, (index, sign, value), inside, otherwise = item
            lines += [f"IF $I{100 + index} {sign} {value}", *source_of(inside)]
            lines += ["ELSE", *source_of(otherwise)] if otherwise is not None else []
            lines.append("ENDIF")
        elif isinstance(item, tuple):
            _, times, inside, level = item
            lines += [
                f"SET n{level} = 0",
                f"WHILE n{level} < {times}",
                f"n{level} = n{level} + 1",
                *source_of(inside),
                "ENDWHILE",
            ]
    return lines


HOLDS = {"=": int.__eq__, "<": int.__lt__, ">": int.__gt__, "<=": int.__le__, ">=": int.__ge__}


def marks_of(block: list[object], inputs: list[int]) -> list[int]:
    """What a program of this block marks, in order."""
    marks: list[int] = []
    for item in block:
        if isinstance(item, int):
            marks.append(item)
        elif isinstance(item, tuple) and item[0] == "IF":
            _, (index, sign, value), inside, otherwise = item
            chosen = inside if HOLDS[sign](inputs[index], value) else otherwise or []
            marks += marks_of(chosen, inputs)
        elif isinstance(item, tuple):
            marks += marks_of(item[2], inputs) * item[1]
    return marks


@settings(max_examples=60)
@given(block=trees(3), inputs=st.lists(st.integers(0, 3), min_size=4, max_size=4))
def test_nested_conditions_take_the_path_they_say(block: list[object], inputs: list[int]) -> None:
    marks = marks_of(block, inputs)
    subroutines = [f"MARK{n}:\n$D0 = $D0 * 10\n$D0 = $D0 % 1000000\n$D0 = $D0 + {n}\n$I2 = $I2 + 1\nRETURN" for n in range(1, 10)]
    used = [s for n, s in enumerate(subroutines, 1) if f"JUMP MARK{n}" in source_of(block)]
    rig = programmed("\n".join([*source_of(block), "OUT1 = ON", "WAIT IN1 = ON", *used]) + "\n")
    for index, value in enumerate(inputs):
        rig.i(100 + index, value)
    rig.start()
    rig.wait(100.0)
    assert (rig.out(1), rig.i(2)) == (True, len(marks))
    # $D0 holds the last seven marks; single precision keeps seven digits.
    number = 0
    for mark in marks:
        number = number * 10 % 1_000_000 + mark
    assert rig.d(0) == number


# ---------------------------------------------------------------------- robustness


def test_a_program_without_any_wait_keeps_the_controller_alive() -> None:
    for statement_time in (1_000_000, 0):
        rig = started("MAIN:\nn = n + 1\n$R0 = n\nJUMP MAIN\n", statement_time=statement_time)
        rig.wait(0.5)
        before = rig.r(0)
        rig.wait(0.5)
        assert rig.r(0) > before > 0.0
        rig.halt()
        assert rig.state == STOPPED


def test_a_snapshot_in_the_middle_goes_on_alike() -> None:
    text = "M1 = ON\nCFGINT_IN1 = RIS\nMAIN:\nPABS M1 20\nWAITPOS\nn = n + 1\n$I0 = n\nDELAY 0.3\nPABS M1 0\nWAITPOS\n"
    text += "JUMP MAIN\nINT_IN1:\nOUT1 = ON\nDELAY 0.1\nOUT1 = OFF\nRETURN\n"
    rig = started(text)
    rig.wait(1.23)
    rig.pin("IN1", 1.0)
    rig.wait(0.05)
    taken = rig.device.snapshot()

    def play() -> tuple[list[object], array[int]]:
        rig.device.advance(rig.device.now)
        begin = len(rig.edges)
        end = rig.device.now + 7_000_000_000
        rig.device.advance(end)
        rig.edges += rig.device.take_edges()
        return [*rig.edges[begin:]], rig.device.user[:]

    first = play()
    rig.device.restore(taken)
    assert play() == first
    assert first[0]


@st.composite
def disturbed(draw: DrawFn) -> list[tuple[float, str]]:
    """Moments and what a master or a hand does at them."""
    acts = st.sampled_from(["pause", "start", "halt", "IN1", "IN2", "enable", "write", "stop"])
    return draw(st.lists(st.tuples(st.sampled_from([0.0, 0.001, 0.0137, 0.4, 3.0]), acts), max_size=25))


@settings(max_examples=40)
@given(acts=disturbed())
def test_whatever_is_done_to_a_running_program_the_controller_answers(acts: list[tuple[float, str]]) -> None:
    text = (
        "CFGINT_IN1 = RIS_FALL\nCFGINT_MODBUS = HIGH\nCFGINT_M1 = HIGH\nM1 = ON\nMAIN:\nPABS M1 5\nWAITPOS\nDELAY 0.05\n"
        "PREL M1 -3\nWHILE M1 = 1\n    $R0 = PosM1\nENDWHILE\nWAIT IN2 = ON\nPULSE(OUT1, 0.02)\nJUMP MAIN\n"
        "INT_IN1:\nSTOP M1\nJUMP MAIN\nINT_MODBUS:\n$I5 = $I5 + 1\nRETURN\nINT_M1:\n$I6 = $I6 + 1\nRETURN\n"
    )
    rig = started(text, axes=1)
    for seconds, act in acts:
        rig.wait(seconds)
        if act in ("IN1", "IN2"):
            rig.pin(act, 1.0 - rig.pins()[act])
        elif act == "write":
            rig.i(9, 1)
        elif act == "enable":
            rig.enable(1)
        elif act == "stop":
            rig.stop(1)
        else:
            getattr(rig, act)()
    rig.halt()
    assert (rig.state, rig.velocity(1), rig.out(1)) == (STOPPED, 0.0, False)
    rig.start()
    rig.wait(0.001)
    assert rig.state == RUNNING
