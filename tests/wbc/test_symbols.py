"""What every name of a program means, in sound lines and in wrong ones."""

from __future__ import annotations

import pytest

from steptwin.wbc.check import check_program
from steptwin.wbc.dialect import DEFAULT
from steptwin.wbc.symbols import uses
from steptwin.wbc.syntax import parse


def found(text: str) -> list[str]:
    program, diagnostics = parse(text)
    checked, scope = check_program(text, program, diagnostics, None, None, DEFAULT)
    return [
        f"{text[use.span.start : use.span.end]} {use.symbol.kind.name} {use.role.name}" for use in uses(checked.program, scope)
    ]


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("SET $I0 = LEN + 1", ["$I0 REGISTER WRITE", "LEN CONSTANT READ"]),
        ("count = M_POS_OK", ["count VARIABLE DEFINE", "M_POS_OK VALUE READ"]),
        ("SET $R0 = SQRT(LEN)", ["$R0 REGISTER WRITE", "SQRT FUNCTION READ", "LEN CONSTANT READ"]),
        ("WAIT PosM1 > LEN", ["PosM1 REGISTER READ", "LEN CONSTANT READ"]),
        ("JUMP main", ["main LABEL READ"]),
        ("MOVEPTP @a", ["a POSITION READ"]),
        # Wrong lines, by their words.
        ("OUT1 = LEN +", ["OUT1 REGISTER WRITE", "LEN CONSTANT READ"]),
        ("WAIT PosM1 > LEN nothing", ["PosM1 REGISTER READ", "LEN CONSTANT READ"]),
        ("JUMP main now", ["main LABEL READ"]),
        ("JUMP 5 LEN", ["LEN CONSTANT READ"]),
        ("MOVEPTP @ 5 LEN", ["LEN CONSTANT READ"]),
        ("MOVEPTP @a @b", ["a POSITION READ", "b POSITION READ"]),
        ("SET $R0 = SQRT(LEN", ["$R0 REGISTER WRITE", "SQRT FUNCTION READ", "LEN CONSTANT READ"]),
    ],
)
def test_names_of_a_line(line: str, expected: list[str]) -> None:
    names = found(f"#LEN 12\nmain:\n{line}\n")
    assert names == ["LEN CONSTANT DEFINE", "main LABEL DEFINE", *expected]
