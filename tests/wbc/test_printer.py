"""`fmt` changes how a program looks, never what it says."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.strategies import DataObject, SearchStrategy

from steptwin.wbc.check import check
from steptwin.wbc.positions import parse_positions
from steptwin.wbc.printer import format_text
from steptwin.wbc.syntax import parse
from steptwin.wbc.tree import Line

UGLY = """\
  // feeder
#speed 60 //u/s
#pump    out3
main :
  set   x=y+ 5
m1=on   //drive
\tif in1=1
pump = ON
while x<=  -2,5
  x=min(1.5,x)
pulse( OUT1,0,5 )
endwhile
   // still inside
wait in2 == 1    // broken
lab:
else
moveptp @ top
  endif
jump main


"""

NEAT = """\
// feeder
#speed 60  //u/s
#pump out3
main:
SET x = y + 5
m1 = on  //drive
IF in1 = 1
    pump = ON
    WHILE x <= -2,5
        x = min(1.5, x)
        PULSE(OUT1, 0,5)
    ENDWHILE
    // still inside
    wait in2 == 1  // broken
lab:
ELSE
    MOVEPTP @top
ENDIF
JUMP main
"""


def test_the_one_style() -> None:
    assert format_text(UGLY) == NEAT


def test_neat_text_stays() -> None:
    assert format_text(NEAT) == NEAT


@pytest.mark.parametrize("line_end", ["\n", "\r\n"])
def test_line_ends_stay(line_end: str) -> None:
    assert format_text(f"M1=ON{line_end}END") == f"M1 = ON{line_end}END{line_end}"


def test_blocks_that_are_never_opened_are_not_indented() -> None:
    assert format_text("ENDIF\nELSE\nENDWHILE\nEND\n") == "ENDIF\nELSE\nENDWHILE\nEND\n"


def test_raw_records_are_written_in_capitals() -> None:
    assert format_text(f"//!RECORD  {'0a' * 16}\n") == f"//!record {'0A' * 16}\n"


def said(text: str) -> list[Line]:
    lines = list(parse(text)[0].lines)
    while lines and lines[-1].statement is None and lines[-1].comment is None:
        lines.pop()
    return lines


@settings(max_examples=300)
@given(st.one_of(st.text(max_size=200), st.text(alphabet="IFELSENDWH x=1+-,.()@:#/!\n\r\t", max_size=200)))
def test_any_text_keeps_its_meaning(text: str) -> None:
    printed = format_text(text)
    assert said(printed) == said(text)
    assert format_text(printed) == printed


@settings(max_examples=100)
@given(data=st.data())
def test_valid_programs_check_clean_before_and_after(programs: SearchStrategy, data: DataObject) -> None:
    program = data.draw(programs)
    table, wrong = parse_positions(program.positions)
    assert wrong == []
    before = check(program.text, table)
    assert before.diagnostics == []
    printed = format_text(program.text)
    after = check(printed, table)
    assert after.diagnostics == []
    assert after.executable == before.executable
    assert format_text(printed) == printed
