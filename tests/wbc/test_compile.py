"""Compiled programs: every register and statement has its code, and code has no state."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import pytest
from mic488_rig import Rig, loaded

from steptwin.mic488.program_registers import ACCESS
from steptwin.tables import IncompleteTable
from steptwin.wbc import steps as s
from steptwin.wbc.check import check
from steptwin.wbc.compile import compile_program
from steptwin.wbc.controller import RegisterFamily, complete_access
from steptwin.wbc.positions import parse_positions
from steptwin.wbc.registers import REAL, REGISTERS, ROWS, RegisterRow
from steptwin.wbc.statements import STATEMENTS

_NEW = RegisterRow("NEW", 0, REAL, REAL, "")
_READABLE, _WRITABLE = RegisterFamily(lambda number: lambda c, at: 0.0), ACCESS["OUT"]


@pytest.mark.parametrize(
    ("row", "access", "message"),
    [
        (_NEW, None, "register NEW lacks its access"),
        (None, _WRITABLE, "access of NEW: there is no such register"),
        (_NEW, _READABLE, "register NEW (RW) lacks its write"),
        (replace(_NEW, writes=None), _WRITABLE, "register NEW (R) has a write that its row does not permit"),
    ],
)
def test_a_register_of_the_language_that_no_controller_gives_is_refused(
    row: RegisterRow | None, access: RegisterFamily | None, message: str
) -> None:
    rows = ROWS if row is None else {**ROWS, "NEW": row}
    with pytest.raises(IncompleteTable) as caught:
        complete_access(rows, ACCESS if access is None else {**ACCESS, "NEW": access})
    assert str(caught.value) == message


def test_every_statement_of_the_table_can_be_executed() -> None:
    operands = {"drive": "M1", "output": "OUT1", "value": "1", "condition": "IN1 = 1", "label": "L", "position": "@A"}
    table, _ = parse_positions("A;1;2;3;1\n")
    blocks = {"IF": "ENDIF", "WHILE": "ENDWHILE"}
    for row in STATEMENTS.values():
        if row.keyword in ("ELSE", "ENDIF", "ENDWHILE"):
            continue
        given = [operands[operand.kind.value] for operand in row.operands]
        line = f"{row.keyword}({', '.join(given)})" if row.in_parentheses else " ".join([row.keyword, *given])
        checked = check(f"L:\n{line}\n{blocks.get(row.keyword, '')}\nEND\n", table)
        assert checked.errors == []
        executable = checked.executable
        assert executable is not None
        assert len(compile_program(executable, ACCESS).steps) == len(executable.steps) + 1


def test_a_variable_is_compared_and_calculated_like_any_other_value() -> None:
    # Cells have code of their own, written out: it must do what the general code does.
    signs, values = ("=", "<", ">", "<=", ">="), (-1, 2)
    for sign, a, b in product(signs, values, values):
        cells = f"x = {a}\ny = {b}\nIF x {sign} y\n$I0 = 1\nENDIF\n"
        user = _run(f"{cells}$I2 = {a}\nIF $I2 {sign} y\n$I1 = 1\nENDIF\nEND\n")
        holds = {"=": a == b, "<": a < b, ">": a > b, "<=": a <= b, ">=": a >= b}[sign]
        assert (user[0], user[1]) == (holds, holds)
    for operator, a, b in product("+-*", values, values):
        user = _run(f"x = {a}\ny = {b}\nx = x {operator} y\n$I0 = x\n$I2 = {a}\n$I1 = $I2 {operator} y\nEND\n")
        result = {"+": a + b, "-": a - b, "*": a * b}[operator]
        assert (user[0], user[1]) == (result & 0xFFFF,) * 2


def _run(text: str) -> list[int]:
    rig = Rig(programs={0: loaded(text)[0]})
    rig.word("PROGRAM_CTRL", 1)
    rig.wait(0.1)
    return rig.read_words(0, 3)


def test_code_that_writes_a_read_only_register_is_not_made() -> None:
    executable = check("OUT1 = ON\n").executable
    assert executable is not None
    row = next(row for row in REGISTERS if row.key == "INPUTS")
    wrong = s.Executable((s.SetStep(0, 0, s.RegisterOperand(row, 0), s.Literal(1.0)),), (), {}, {}, {})
    with pytest.raises(ValueError, match="INPUTS cannot be written"):
        compile_program(wrong, ACCESS)


def test_calculations_are_executed_at_once_from_where_they_are_entered_to_where_they_branch_or_can_fail() -> None:
    text = """
    n = 0
    a = 1
    MAIN:
        n = n + 1
        b = n * a
        IF n > 3
            a = b
            JUMP SUB
        ENDIF
        a = b / n
        b = PosM1
        b = a
        b = b - 2
    JUMP MAIN
    SUB:
        WHILE a < 2
            a = a + 1
        ENDWHILE
    RETURN
    """
    executable = check(text).executable
    assert executable is not None
    lengths = {first: found.further + 1 for first, found in enumerate(compile_program(executable, ACCESS).straight) if found}
    assert lengths == {0: 2, 2: 3, 10: 2, 14: 2}
