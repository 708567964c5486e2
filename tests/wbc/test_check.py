"""The checker beyond its messages: assumptions, time, what it gives to those who run the program."""

from __future__ import annotations

import sys

import pytest

from steptwin.diagnostics import SourceText
from steptwin.wbc import steps as s
from steptwin.wbc.check import check
from steptwin.wbc.conditions import outcome
from steptwin.wbc.dialect import DEFAULT, DIALECTS, dialect_for
from steptwin.wbc.positions import parse_positions
from steptwin.wbc.registers import ROWS


def codes(text: str, firmware: str = "1.70") -> list[str]:
    return [d.code for d in check(text, dialect=DIALECTS[firmware]).diagnostics]


def executable(text: str, table: str = "") -> s.Executable:
    checked = check(text, parse_positions(table)[0])
    assert checked.executable is not None, checked.errors
    return checked.executable


def test_wbc_4_a_variable_read_above_its_assignment_is_known() -> None:
    assert codes("OUT1 = x\nx = 1\n") == []
    assert codes("OUT1 = x\n") == ["W104"]


@pytest.mark.parametrize(("value", "code"), [("nothing", "W141"), ("OUT99", "W140"), ("9" * 40, "W122")])
def test_what_is_wrong_with_a_constant_is_told_once(value: str, code: str) -> None:
    """Not again where it is read or set."""
    assert codes(f"#pump {value}\n") == [code]
    assert codes(f"#pump {value}\nOUT1 = pump\npump = 3\n") == [code]


def test_a_register_of_later_firmware_is_told_whatever_its_number() -> None:
    assert codes("$I0 = CFGINT_M9\n", "1.23") == ["W139"]


def test_a_constant_that_cannot_be_one_is_no_constant() -> None:
    assert codes("#SIN 5\n#SIN 6\n") == ["W103", "W103"]


def test_a_variable_that_cannot_be_one_is_told_where_it_is_set_only() -> None:
    assert codes("INT_IN1 = 3\nOUT1 = INT_IN1\n") == ["W103"]


def test_wbc_7_short_delays_are_told() -> None:
    assert codes("DELAY 0.009\n") == ["W212"]
    assert codes("DELAY 0.01\n") == []


def test_wbc_12_there_are_128_variables() -> None:
    def program(count: int) -> str:
        return "".join(f"v{n} = IN1\nOUT1 = v{n}\n" for n in range(count))

    assert codes(program(128)) == []
    assert codes(program(129)) == ["W123"]


def test_wbc_42_names_have_any_length() -> None:
    name = "n" * 500
    assert codes(f"#c{name} 5\n{name} = c{name}\nL{name}:\nOUT1 = {name}\nJUMP L{name}\n") == []


def test_wbc_13_modbus_master_statements_are_not_invented() -> None:
    assert codes("MODBUS_READ 1 5\n") == ["W137"]


def test_wbc_14_numbers_that_saturate_are_told() -> None:
    assert codes("$I0 = 32767\n$I1 = 32767.5\nOUTPUTS = -1\n$D0 = 2147483648\n") == ["W211", "W211", "W211"]


def test_steps_are_resolved() -> None:
    text = (
        "#pump OUT3\nx = 5\nL:\nIF x <= PosM1\n  pump = ON\nELSE\n  MOVEPTP @b\nENDIF\nJUMP l\nINT_TICK:\nRETURN\nm1 = on\nM2 = 1"
    )
    steps = executable(text, "a;x;x;x;x\nb;1;2;x;x\n")
    x = s.Variable(0, "x")
    assert steps.variables == ("x",)
    assert steps.labels == {"L": 1, "INT_TICK": 7}
    assert [(event.name, number) for event, number in steps.entries.items()] == [("TICK", 7)]
    condition = s.StepCondition(x, "<=", s.RegisterOperand(ROWS["POSM"], 1))
    assert steps.steps[:7] == (
        s.SetStep(0, 0, x, s.Literal(5)),
        s.IfStep(0, 0, condition, 3, 5),
        s.SetStep(0, 0, s.RegisterOperand(ROWS["OUT"], 3), s.Literal(1)),
        s.ElseStep(0, 0, 5),
        s.RowMotionStep(0, 0, "MOVEPTP", s.Literal(1)),
        s.EndIfStep(0, 0),
        s.JumpStep(0, 0, 1),
    )
    assert text[steps.steps[2].start : steps.steps[2].end] == "pump = ON"
    assert isinstance(steps.steps[7], s.InterruptStep)
    assert s.IfStep(0, 0, condition, 3, 5).otherwise == 4
    assert s.IfStep(0, 0, condition, None, 5).otherwise == 6


def test_a_program_with_errors_or_unknown_positions_is_not_given_out() -> None:
    assert check("WAIT\n").executable is None
    assert check("M1 = ON\nMOVEPTP @a\n").executable is None
    assert check("M1 = ON\nMOVEPTP @a\n", parse_positions("a;1;x;x;x\n")[0]).executable is not None


@pytest.mark.parametrize(
    ("sign", "value", "expected"),
    [("=", 1, None), ("=", 2, False), ("=", 0.5, False), ("<", 0, False), ("<", 2, True), (">=", 0, True), (">", 0, None)],
)
def test_conditions_on_an_input(sign: str, value: float, expected: bool | None) -> None:
    mirrored = {"=": "=", "<": ">", ">": "<", "<=": ">=", ">=": "<="}
    bit = s.RegisterOperand(ROWS["IN"], 1)
    assert outcome(s.StepCondition(bit, sign, s.Literal(value))) is expected
    assert outcome(s.StepCondition(s.Literal(value), mirrored[sign], bit)) is expected


def long_program(lines: int) -> str:
    block = "L{n}:\nSET x{v} = x{w} + {n}\nIF IN1 = 1\nPABS M1 x3\nELSE\nDELAY 0,5\nENDIF\nJUMP L{m}  // and so on\n"
    count = lines // 8
    return "M1 = ON\n" + "".join(block.format(n=n, m=(n + 1) % count, v=n % 100, w=(n + 1) % 100) for n in range(count))


def calls(text: str) -> int:
    """What a check costs, in calls of functions: the same number on every machine, however busy."""
    count = 0

    def note(frame: object, event: str, argument: object) -> None:
        nonlocal count
        count += event.endswith("call")

    sys.setprofile(note)
    try:
        check(text)
    finally:
        sys.setprofile(None)
    return count


def test_a_long_program_costs_a_bounded_number_of_calls_per_line() -> None:
    text = long_program(4000)
    assert check(text).diagnostics == []
    assert calls(text) < 150 * 4000


@pytest.mark.parametrize(
    "line",
    ["wrong{n} line", "x = y{n}", "JUMP L{n}", "L{n}:", "ENDIF", "IF IN1 = 1", "WHILE IN1 = 1\nENDIF", "INT_IN{n}:", "@@ {n}"],
)
def test_the_cost_grows_with_the_length_only(line: str) -> None:
    short, long = ("".join(line.format(n=n) + "\n" for n in range(count)) for count in (200, 1600))
    assert calls(long) < 8 * calls(short) * 1.25


def test_the_line_limit_is_that_of_the_firmware() -> None:
    text = "OUT1 = ON\n" * DEFAULT.max_steps
    assert codes(text) == []
    assert codes(text + "OUT1 = ON\n") == ["W136"]
    (found,) = check("OUT1 = ON\n" * 1001, dialect=dialect_for("1.23")).diagnostics
    assert (found.code, found.hint) == ("W136", "firmware 1.23 holds 1000 executable lines")


def test_the_limit_of_variables() -> None:
    count = DEFAULT.max_variables
    numbers = range(count + 1)
    text = "".join([*(f"v{number} = IN1\n" for number in numbers), *(f"OUT1 = v{number}\n" for number in numbers)])
    (found,) = check(text).diagnostics
    assert (found.code, found.message) == ("W123", f"there are too many variables: v{count}")
    assert SourceText("", text).position(found.span.start) == (count + 1, 1)


@pytest.mark.parametrize(
    ("written", "seconds"),
    [
        ("20 s", "20"), ("2,5s", "2,5"), ("20 ms", "0.02"), ("1500ms", "1.5"), ("20 min", "1200"), ("20 mm", None),
    ],
)  # fmt: skip
def test_times_with_a_unit_are_repaired_into_seconds(written: str, seconds: str | None) -> None:
    for statement, fixed in ((f"DELAY {written}", f"DELAY {seconds}"), (f"PULSE(OUT1, {written})", f"PULSE(OUT1, {seconds})")):
        (found,) = (d for d in check(f"{statement}\n").diagnostics if d.code.startswith("W1"))
        assert found.message == "numbers have no unit"
        if seconds is None:
            assert found.fix is None
            continue
        assert found.fix is not None
        repaired = statement[: found.fix.span.start] + found.fix.text + statement[found.fix.span.end :]
        assert repaired == fixed
        assert [code for code in codes(repaired) if code.startswith("W1")] == []


@pytest.mark.parametrize("condition", ["- a b > c", "a > - b c"])
def test_a_minus_sign_at_the_beginning_of_a_side_calculates_nothing(condition: str) -> None:
    (found,) = [one for one in check(f"a = 1\nb = 1\nc = 1\nIF {condition}\nENDIF\n").diagnostics if one.code == "W114"]
    assert found.message == "a minus sign is permitted before numbers only"
