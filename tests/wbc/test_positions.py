"""Position tables: reading, complaining with row and column, writing back without a change."""

from __future__ import annotations

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.diagnostics import SourceText
from steptwin.errors import Misuse
from steptwin.wbc.dialect import MAX_POSITIONS
from steptwin.wbc.positions import PositionRow, number_text, parse_positions, table_of

TEXT = "home;0;0;x;x\r\nTop ; 10,5; -20.25;X;\t7\r\n;1;2;3;4;\r\n\r\n"


def found(text: str) -> list[tuple[str, int, int]]:
    """Code, row and column of every message."""
    return [(d.code, *SourceText("t", text).position(d.span.start)) for d in parse_positions(text)[1]]


def test_rows() -> None:
    table, wrong = parse_positions(TEXT)
    assert wrong == []
    assert [(row.name, row.values, row.mask) for row in table.rows] == [
        ("home", (0, 0, None, None), 3),
        ("Top", (10.5, -20.25, None, 7), 11),
        ("", (1, 2, 3, 4), 15),
    ]
    assert table.index("HOME") == 0
    assert table.index("top") == 1
    assert table.index("") is None
    assert table.names() == ["home", "Top"]


def test_an_unchanged_table_is_written_as_it_was() -> None:
    assert parse_positions(TEXT)[0].text == TEXT


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("A;1;2;3\n", [("W150", 1, 1)]),
        ("A;1;2;3;4;5\n", [("W150", 1, 1)]),
        ("A;1;2;3;4\nB;1;zwei;3;\n", [("W151", 2, 5), ("W151", 2, 12)]),
        ("A;1;1e3;3;4\n", [("W151", 1, 5)]),
        (f"A;{'9' * 40};x;x;x\n", [("W151", 1, 3)]),
        ("A;1;2;3;4\na;1;2;3;4\n", [("W152", 2, 1)]),
        ("A;1;2;3;4\n\n\nB;1;2;3;4\n\n", [("W154", 2, 1), ("W154", 3, 1)]),
        ("my pos;1;2;3;4\n", [("W250", 1, 1)]),
    ],
)
def test_messages_have_row_and_column(text: str, expected: list[tuple[str, int, int]]) -> None:
    assert found(text) == expected


NUMBER = "write a number like 20, -70, 20.5 or 20,5, or x to leave the axis alone"


@pytest.mark.parametrize(
    ("text", "message", "hint"),
    [
        ("A;1;2;3\n", "4 columns instead of 5", "a row is name;p1;p2;p3;p4"),
        ("A;1;2;3;4;5\n", "6 columns instead of 5", "a row is name;p1;p2;p3;p4"),
        ("A;1;zwei;3;4\n", "p2 is 'zwei', neither a number nor x", NUMBER),
        ("A;1;2;3;\n", "p4 is nothing, neither a number nor x", NUMBER),
        (f"A;{'9' * 40};x;x;x\n", "p1 is beyond the range of REAL, ±3.4e+38", NUMBER),
        ("A;1;2;3;4\na;1;2;3;4\n", "a is already the name of row 0", "names differ in more than case"),
        ("A;1;2;3;4\n\nB;1;2;3;4\n", "an empty line", "remove it: rows are counted by lines"),
        (
            "my pos;1;2;3;4\n",
            "'my pos' cannot be written after @",
            "names have letters without accents, digits and _, and do not begin with a digit",
        ),
        ("A;1;2;3;4\n" + "".join(f"P{n};1;2;3;4\n" for n in range(227)), "more than 227 rows", "the table holds 227"),
    ],
)
def test_messages_and_hints(text: str, message: str, hint: str) -> None:
    assert [(d.message, d.hint) for d in parse_positions(text)[1]] == [(message, hint)]


@pytest.mark.parametrize(
    ("text", "place", "mended"),
    [
        ("A;1;2\nB;1;2;3;4\n", "A;1;2", "A;1;2;x;x\nB;1;2;3;4\n"),
        ("A;1;2;3;4; ;\nB;1;2;3;4\n", "A;1;2;3;4; ;", "A;1;2;3;4\nB;1;2;3;4\n"),
        ("A;1;2;3;4;5\nB;1;2;3;4\n", "A;1;2;3;4;5", None),
        ("A;1;2;3;4\n\nB;1;2;3;4\n", "\n", "A;1;2;3;4\nB;1;2;3;4\n"),
        ("A;1;2;3;4\nmy pos;1;2;3;4\n", "my pos", "A;1;2;3;4\nmy_pos;1;2;3;4\n"),
        ("A;1;2;3;4\n a ;1;2;3;4\n", " a ", None),
        ("A;1;2; 3 4 ;4\n", " 3 4 ", "A;1;2;34;4\n"),
    ],
)
def test_messages_stand_at_what_is_wrong_and_repair_it(text: str, place: str, mended: str | None) -> None:
    (found,) = parse_positions(text)[1]
    assert text[found.span.start : found.span.end] == place
    fix = found.fix
    assert (None if fix is None else text[: fix.span.start] + fix.text + text[fix.span.end :]) == mended


def test_a_row_knows_its_line() -> None:
    assert [TEXT[row.start : row.end] for row in parse_positions(TEXT)[0].rows] == [
        line.rstrip() for line in TEXT.split("\r\n")[:3]
    ]
    assert PositionRow("A", (1, 2, 3, 4), 5, 6) == PositionRow("A", (1, 2, 3, 4))


def test_a_wrong_cell_keeps_its_row() -> None:
    table, _ = parse_positions("A;1;?;3;4\nB;1;2;3;4\n")
    assert table.rows[0].values == (1, None, 3, 4)
    assert table.index("B") == 1


def test_the_table_has_227_rows() -> None:
    text = "".join(f"P{n};1;2;3;4\n" for n in range(MAX_POSITIONS + 1))
    assert MAX_POSITIONS == 227
    assert found(text) == [("W153", 228, 1)]


real = st.floats(width=32, allow_nan=False, allow_infinity=False)


@given(st.lists(st.tuples(real, real, st.none(), real), max_size=5))
def test_values_survive_writing_and_reading(rows: list[tuple[float | None, ...]]) -> None:
    table = table_of([(f"P{n}", row) for n, row in enumerate(rows)])
    assert [row.values for row in parse_positions(table.text)[0].rows] == rows


def test_what_no_table_can_hold_is_refused() -> None:
    for value in (math.inf, -math.inf, math.nan):
        with pytest.raises(Misuse, match=f"^{value} cannot be written as a number: permitted are finite numbers$"):
            number_text(value)
    with pytest.raises(Misuse, match=r"^'my pos' cannot be written after @$"):
        table_of([("P0", (1, None, None, None)), ("my pos", (1, None, None, None)), ("P0", (1, None, None, None))])


@given(real)
def test_numbers_are_written_without_exponent(value: float) -> None:
    text = number_text(value)
    assert set(text) <= set("-0123456789.")
    assert struct.pack("<d", float(text)) == struct.pack("<d", value)
