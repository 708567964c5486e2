"""Text to tree: spans, spellings, and that nothing at all can make the parser fail."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from steptwin.diagnostics import Diagnostic
from steptwin.wbc.check import check
from steptwin.wbc.positions import parse_positions
from steptwin.wbc.statements import FUNCTIONS, STATEMENTS
from steptwin.wbc.syntax import parse
from steptwin.wbc.tree import (
    Assign,
    Binary,
    Broken,
    ConstantDefinition,
    DecimalNumber,
    FunctionCall,
    Identifier,
    ImageRecord,
    KeywordStatement,
    Label,
    Position,
    PositionRecord,
    Relation,
    StatementNode,
    TreeNode,
)

PLACE = (0, 0)


def name(text: str) -> Identifier:
    return Identifier(*PLACE, text, text.upper())


def number(text: str, value: float) -> DecimalNumber:
    return DecimalNumber(*PLACE, text, value)


def only(text: str) -> StatementNode:
    program, diagnostics = parse(text)
    assert diagnostics == []
    (line,) = program.lines
    assert line.statement is not None
    return line.statement


# fmt: off
STATEMENTS_READ: list[tuple[str, StatementNode]] = [
    ("#speed 60", ConstantDefinition(*PLACE, name("speed"), number("60", 60))),
    ("#home -70", ConstantDefinition(*PLACE, name("home"), number("-70", -70))),
    ("#pump OUT3", ConstantDefinition(*PLACE, name("pump"), name("OUT3"))),
    ("# pump OUT3", ConstantDefinition(*PLACE, name("pump"), name("OUT3"))),
    ("MAIN:", Label(*PLACE, name("MAIN"))),
    ("MAIN :", Label(*PLACE, name("MAIN"))),
    ("SET X = 20,5", Assign(*PLACE, True, name("X"), number("20,5", 20.5))),
    ("set X=20.5", Assign(*PLACE, True, name("X"), number("20.5", 20.5))),
    ("M1 = ON", Assign(*PLACE, False, name("M1"), name("ON"))),
    ("$R10 = $D8", Assign(*PLACE, False, name("$R10"), name("$D8"))),
    ("X = Y-5", Assign(*PLACE, False, name("X"), Binary(*PLACE, name("Y"), "-", number("5", 5)))),
    ("X = Y -5", Assign(*PLACE, False, name("X"), Binary(*PLACE, name("Y"), "-", number("5", 5)))),
    ("X = Y - -5", Assign(*PLACE, False, name("X"), Binary(*PLACE, name("Y"), "-", number("-5", -5)))),
    ("X = -5 << 2", Assign(*PLACE, False, name("X"), Binary(*PLACE, number("-5", -5), "<<", number("2", 2)))),
    ("X = a && b", Assign(*PLACE, False, name("X"), Binary(*PLACE, name("a"), "&&", name("b")))),
    ("X = a & b", Assign(*PLACE, False, name("X"), Binary(*PLACE, name("a"), "&", name("b")))),
    ("X = a || b", Assign(*PLACE, False, name("X"), Binary(*PLACE, name("a"), "||", name("b")))),
    ("X = a % 3", Assign(*PLACE, False, name("X"), Binary(*PLACE, name("a"), "%", number("3", 3)))),
    ("X = sin(30)", Assign(*PLACE, False, name("X"), FunctionCall(*PLACE, name("sin"), (number("30", 30),)))),
    ("X = min(a,b)", Assign(*PLACE, False, name("X"), FunctionCall(*PLACE, name("min"), (name("a"), name("b"))))),
    (
        "X = max(1,5, 2)",
        Assign(*PLACE, False, name("X"), FunctionCall(*PLACE, name("max"), (number("1,5", 1.5), number("2", 2)))),
    ),
    ("X = max(a,1,5)", Assign(*PLACE, False, name("X"), FunctionCall(*PLACE, name("max"), (name("a"), number("1,5", 1.5))))),
    ("IF IN1 = 1", KeywordStatement(*PLACE, "IF", (Relation(*PLACE, name("IN1"), "=", number("1", 1)),))),
    ("while x>=-5", KeywordStatement(*PLACE, "WHILE", (Relation(*PLACE, name("x"), ">=", number("-5", -5)),))),
    ("Wait PosM1 <= y", KeywordStatement(*PLACE, "WAIT", (Relation(*PLACE, name("PosM1"), "<=", name("y")),))),
    ("ELSE", KeywordStatement(*PLACE, "ELSE", ())),
    ("DELAY 0,5", KeywordStatement(*PLACE, "DELAY", (number("0,5", 0.5),))),
    ("JUMP main", KeywordStatement(*PLACE, "JUMP", (name("main"),))),
    ("HOME M1 -20", KeywordStatement(*PLACE, "HOME", (name("M1"), number("-20", -20)))),
    ("PABS M1 x", KeywordStatement(*PLACE, "PABS", (name("M1"), name("x")))),
    ("BRAKE M2", KeywordStatement(*PLACE, "BRAKE", (name("M2"),))),
    ("MOVEPTP @top", KeywordStatement(*PLACE, "MOVEPTP", (Position(*PLACE, name("top")),))),
    ("MOVEPTP @ top", KeywordStatement(*PLACE, "MOVEPTP", (Position(*PLACE, name("top")),))),
    ("MOVEPTP 5", KeywordStatement(*PLACE, "MOVEPTP", (number("5", 5),))),
    ("MOVELIN_REL n", KeywordStatement(*PLACE, "MOVELIN_REL", (name("n"),))),
    ("PULSE(OUT1,0,5)", KeywordStatement(*PLACE, "PULSE", (name("OUT1"), number("0,5", 0.5)))),
    ("pulse ( OUT1 , t )", KeywordStatement(*PLACE, "PULSE", (name("OUT1"), name("t")))),
    ("//!record " + "0a" * 16, ImageRecord(*PLACE, b"\n" * 16)),
    ("//!position 3 " + "0A" * 18, PositionRecord(*PLACE, 3, b"\n" * 18)),
]
# fmt: on


@pytest.mark.parametrize(("text", "expected"), STATEMENTS_READ, ids=[text for text, _ in STATEMENTS_READ])
def test_statement(text: str, expected: StatementNode) -> None:
    assert only(text) == expected
    comment = "" if text.startswith("//") else "  // why"
    assert only(f"\t {text}{comment}").start == 2


def test_every_statement_without_operands_is_read() -> None:
    for row in STATEMENTS.values():
        if not row.operands:
            assert only(row.keyword.lower()) == KeywordStatement(*PLACE, row.keyword, ())


def test_every_function_is_read() -> None:
    for row in FUNCTIONS.values():
        arguments = ", ".join(["a", "b"][: row.arguments])
        statement = only(f"X = {row.name}({arguments})")
        assert isinstance(statement, Assign)
        assert isinstance(statement.value, FunctionCall)


def test_spans_are_the_words() -> None:
    text = "  SET speed = max(count, -2,5) // fast\nMOVEPTP @top"
    first, second = parse(text)[0].lines
    assert isinstance(first.statement, Assign)
    call = first.statement.value
    assert isinstance(call, FunctionCall)
    assert isinstance(second.statement, KeywordStatement)

    def words(node: TreeNode) -> str:
        return text[node.start : node.end]

    assert words(first) == "  SET speed = max(count, -2,5) // fast"
    assert words(first.statement) == "SET speed = max(count, -2,5)"
    assert words(first.statement.target) == "speed"
    assert words(call) == "max(count, -2,5)"
    assert [words(argument) for argument in call.arguments] == ["count", "-2,5"]
    assert first.comment is not None
    assert words(first.comment) == "// fast"
    position = second.statement.operands[0]
    assert isinstance(position, Position)
    assert words(position) == "@top"
    assert words(position.name) == "top"


def test_a_comma_divides_two_numbers_where_two_are_needed() -> None:
    text = "X = min(-1,25)"
    program, diagnostics = parse(text)
    statement = program.lines[0].statement
    assert isinstance(statement, Assign)
    assert isinstance(statement.value, FunctionCall)
    assert [text[a.start : a.end] for a in statement.value.arguments] == ["-1", "25"]
    assert statement.value.arguments == (number("-1", -1), number("25", 25))
    assert [d.code for d in diagnostics] == ["W214"]


def test_a_broken_line_hides_no_other() -> None:
    program, diagnostics = parse("WAIT\nM1 = ON\nPABS 500\nM2 = ON\n")
    kinds = [type(line.statement) for line in program.lines]
    assert kinds == [Broken, Assign, Broken, Assign]
    assert [d.code for d in diagnostics] == ["W113", "W127"]


def test_a_very_long_line_is_refused_without_looking_for_other_languages() -> None:
    found = {
        length: [(d.code, d.message) for d in parse("IF" + " " * (length - len("IF(IN1=1)")) + "(IN1=1)\nJUMP L:\n")[1]]
        for length in (500, 501)
    }
    assert found[500][0] == ("W114", "a condition is written without parentheses")
    assert found[501][0][0] == "W114"
    assert found[501][0] != found[500][0]
    assert [len(diagnostics) for diagnostics in found.values()] == [2, 2]


def test_a_comment_that_is_no_record_is_a_comment() -> None:
    program, diagnostics = parse("//! note\n//!recorded 00\n")
    assert diagnostics == []
    assert [(line.statement, line.comment is not None) for line in program.lines] == [(None, True)] * 2


def test_lines_are_those_of_the_source() -> None:
    program, _ = parse("M1 = ON\r\n\r\n  // end\x0bM2 = ON\rM3 = ON")
    assert [line.start for line in program.lines] == [0, 9, 11, 28], "a vertical tab ends no line, as in editors"


WORDS = st.sampled_from(
    [
        *(*STATEMENTS, *(row.name for row in FUNCTIONS.values()), "SET", "x", "M1", "OUT9", "$I5", "$R3", "INT_IN1", "ON"),
        *("@p", "@", ":", "#", "//", "=", "==", "<", ">=", "<>", "+", "&&", "^", "(", ")", ",", ";"),
        *("1,5", "-", "5", "1.2.3", "ę", "\n", "\n", " "),
        *("THEN", "NOT", "AND", "ELSEIF", "REM", "LET", "FOR", "DEFINE", "MOD", "SUB", "MAIN", "JUMP"),
        *(
            "0x1F",
            "20mm",
            "1e5",
            "9e99",
            "1.234,5",
            "16#F",
            "$FF",
            "[1]",
            "++",
            "+=",
            ":=",
            "!=",
            "'",
            "/*",
            "*/",
            "–",
            "\xa0",
            "≥",
        ),
    ]
)
SOUP = st.lists(WORDS, max_size=40).map(" ".join)
ANYTHING = st.one_of(st.text(max_size=200), SOUP, st.lists(WORDS, max_size=40).map("".join))


def inside(diagnostic: Diagnostic, text: str) -> bool:
    return 0 <= diagnostic.span.start <= diagnostic.span.end <= len(text)


@settings(max_examples=100)
@given(text=ANYTHING, table=ANYTHING)
def test_no_text_makes_the_checker_fail(text: str, table: str) -> None:
    positions, about_table = parse_positions(table)
    checked = check(text, positions)
    assert all(inside(d, text) for d in checked.diagnostics)
    assert all(inside(d, table) for d in about_table)
    assert (checked.executable is None) == bool(checked.errors)
