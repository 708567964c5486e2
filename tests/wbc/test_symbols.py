"""What every name of a program means, in sound lines and in wrong ones."""

from __future__ import annotations

import pytest

from steptwin.wbc.check import check_program
from steptwin.wbc.dialect import DEFAULT
from steptwin.wbc.symbols import name_problem, uses
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
        ("//!record LEN", []),
        ("SUB other\nJUMP other", ["other LABEL DEFINE", "other LABEL READ"]),
        ("//!record " + "0a" * 16, []),
        ("SET $R0 = SQRT(LEN", ["$R0 REGISTER WRITE", "SQRT FUNCTION READ", "LEN CONSTANT READ"]),
    ],
)
def test_names_of_a_line(line: str, expected: list[str]) -> None:
    names = found(f"#LEN 12\nmain:\n{line}\n")
    assert names == ["LEN CONSTANT DEFINE", "main LABEL DEFINE", *expected]


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        ("other", None),
        ("LEN2", None),
        ("Len", "Len is a constant already"),
        ("n", "n is a variable already"),
        ("MAIN", "MAIN is a label already"),
        ("INT_IN3", "INT_IN3 is an interrupt label already"),
        ("2nd", "'2nd' is not a name: letters without accents, digits and _, no digit first"),
        ("żar", "'żar' is not a name: letters without accents, digits and _, no digit first"),
    ],
)
def test_names_that_a_symbol_may_be_given(name: str, problem: str | None) -> None:
    text = "#LEN 12\nmain:\nn = LEN\n"
    program, diagnostics = parse(text)
    _, scope = check_program(text, program, diagnostics, None, None, DEFAULT)
    assert name_problem(name, scope, {"MAIN": 2}) == problem


@pytest.mark.parametrize("word", ["JUMP", "OUT1", "SQRT"])
def test_words_of_the_language_are_no_names(word: str) -> None:
    program, diagnostics = parse("")
    _, scope = check_program("", program, diagnostics, None, None, DEFAULT)
    found = name_problem(word, scope, {})
    assert found is not None
    assert found.startswith(f"{word} is ")
