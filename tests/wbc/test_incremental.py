"""A program checked after every edit, against the same text checked as a whole."""

from __future__ import annotations

import itertools
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from steptwin.wbc.check import check
from steptwin.wbc.dialect import DIALECTS
from steptwin.wbc.incremental import Edited
from steptwin.wbc.positions import parse_positions
from steptwin.wbc.usage import Setup

EXAMPLES = Path(__file__).parents[2] / "examples" / "mic488"
TABLE, _ = parse_positions("P0;1;2;3;1\nTOP;10,5;-20.25;7;0\nempty;x;x;x;x\n")
SETUP = Setup((1, 2, 1, 1), (10, 20, 10, 10), (10, 10, 10, 10), (0,) * 20, ((True, False),) * 4, 1000)
DIALECT = DIALECTS["1.40"]
"""One that has something to say of STATUS."""

LINES = (
    "#speed 60", "#speed OUT3", "#lamp OUT3", "#bad word", "x = 1", "x = speed", "SET y = x + STATUS", "y = STATUS", "lamp = ON",
    "speed = 1", "MAIN:", "PICK:", "INT_IN1:", "JUMP MAIN", "JUMP PICK", "JUMP PIKC", "RETURN", "END", "IF x = 1", "IF IN1 = ON",
    "ELSE", "ENDIF", "WHILE y < 5", "ENDWHILE", "WAIT x = 1", "M1 = ON", "PABS M1 speed", "HOME M1 -500", "MOVEPTP @P0",
    "MOVEPTP @nowhere", "MOVELIN @TOP", "MOVEPTP 0", "CircX = 5", "MOVEPTP @empty", "DELAY 500", "$D1 = 3", "foo(", "OUT9 = 1",
    "a /* b", "b */", "x == 3", "z = mins(1,2)", "z = min(1,2)", "P0 = 3", "// comment", "", "goto MAIN", "END:", "\u2013 5",
    "//!record 00", "CFGINT_IN1 = RIS", "x = y % 0", "CASE 3", "IN1 = 3", "OUT1 = wrong",
)  # fmt: skip
lines = st.lists(st.sampled_from(LINES), max_size=14)
ends = st.sampled_from(("\n", "\r\n", "\r"))


class Both:
    """The same text, edited with a position table and without. Steps are kept from edit to edit while the table stays."""

    def __init__(self) -> None:
        self._edited = (Edited(), TABLE, SETUP), (Edited(), None, None)

    def check_same(self, text: str) -> None:
        for edited, table, setup in self._edited:
            edited.update(text)
            found, _ = edited.check(table, setup, DIALECT)
            whole = check(text, table, setup, DIALECT)
            assert found.diagnostics == whole.diagnostics
            assert found.executable == whole.executable
            assert found.lines == whole.lines
            assert found.program == whole.program


@given(st.lists(st.tuples(st.integers(0, 20), st.integers(0, 4), lines, ends), min_size=1, max_size=8), lines)
@example([(0, 1, [], "\n")], ["SET y = x + STATUS", "y = STATUS", "OUT1 = y"])  # the word about STATUS goes to the next line
@example(
    [(0, 0, ["x = 1"], "\n")], ["MAIN:", "IF IN1 = ON", "OUT1 = ON", "ELSE", "JUMP MAIN", "ENDIF", "WHILE x < 5", "ENDWHILE"]
)
@example([(0, 0, ["x = 1"], "\n"), (0, 1, [], "\n")], ["CircX = 5", "MOVEPTP 0", "MOVELIN @TOP", "MOVEPTP @P0"])
@example([(0, 0, ["a /* b"], "\n"), (3, 0, ["b */"], "\n")], ["x = 1", "x = 2", "OUT1 = x"])
def test_every_edit_gives_what_the_whole_text_gives(edits: list[tuple[int, int, list[str], str]], first: list[str]) -> None:
    edited = Both()
    text = list(first)
    edited.check_same("\n".join(text))
    for place, removed, inserted, end in edits:
        text[place : place + removed] = inserted
        edited.check_same(end.join(text))


@given(st.lists(st.text(st.sampled_from("M1 =\r\n#OUT:@/*x,5(IF"), max_size=40), max_size=5))
def test_any_text_is_taken(texts: list[str]) -> None:
    edited = Both()
    for text in texts:
        edited.check_same(text)


@pytest.mark.parametrize("name", sorted(path.stem for path in EXAMPLES.glob("*.prg")))
def test_an_example_typed_line_by_line(name: str) -> None:
    text = (EXAMPLES / f"{name}.prg").read_text()
    edited = Both()
    for part in itertools.accumulate(text.splitlines(keepends=True)):
        edited.check_same(part)


def test_a_name_that_cannot_be_a_variable_is_refused_everywhere() -> None:
    assert [d.code for d in check("sin = 3\nOUT1 = 1\nsin = 4\nsin = 5\nEND\n").diagnostics] == ["W103"] * 3


def test_a_name_that_means_something_else_now_is_looked_up_again() -> None:
    """Table and setup stay, so that steps are kept."""
    edited = Edited()
    for value in ("60", "70", "OUT3", "bad word"):
        text = f"#speed {value}\nSET x = speed + 1\nOUT1 = x\n"
        edited.update(text)
        found, _ = edited.check(TABLE, SETUP, DIALECT)
        whole = check(text, TABLE, SETUP, DIALECT)
        assert (found.diagnostics, found.executable) == (whole.diagnostics, whole.executable)
        assert found.program == whole.program


def test_only_changed_lines_are_read_again() -> None:
    edited = Edited()
    edited.update("x = 1\nOUT1 = x\nDELAY x\n")
    edited.check()
    before = edited.program.lines
    edited.update("x = 1\n\nOUT2 = x\nDELAY x\n")
    after = edited.program.lines
    assert after[0] is before[0]
    assert after[3] is before[2]
    assert after[3].start == before[2].start  # an address, not the place
    assert edited.place(after[3].start) == len("x = 1\n\nOUT2 = x\n")
    assert edited.address(len("x = 1\n\nOUT2 = x\n")) == after[3].start


def test_steps_of_lines_that_stay_are_kept() -> None:
    edited = Edited()
    found = []
    for text in ("x = 1\nOUT1 = x\nDELAY x\n", "x = 1\nOUT2 = x\nDELAY x\n"):
        edited.update(text)
        found.append(edited.check()[0].executable)
    before, after = found
    assert before is not None
    assert after is not None
    assert [new is old for new, old in zip(after.steps, before.steps, strict=True)] == [True, False, True]


PLACES = [("", 0, 0), ("a\n", 2, 1), ("a\nb", 2, 1), ("a\nb", 3, 1), ("a\r\nb\n", 2, 0)]


@pytest.mark.parametrize(("text", "place", "line"), PLACES)
def test_lines_of_places(text: str, place: int, line: int) -> None:
    edited = Edited()
    edited.update(text)
    assert edited.line_at(place) == line
