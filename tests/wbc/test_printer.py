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
from steptwin.wbc.tree import SourceLine

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


@pytest.mark.parametrize(
    ("text", "printed"),
    [
        ("M1=ON\nEND\n", "M1 = ON\nEND\n"),
        ("M1=ON\r\nEND\r\n", "M1 = ON\r\nEND\r\n"),
        ("M1=ON\rEND\r", "M1 = ON\rEND\r"),
        ("M1=ON\r\nEND\nEND\rEND\n", "M1 = ON\r\nEND\nEND\rEND\n"),
        ("M1=ON\rEND", "M1 = ON\rEND\r"),
        ("M1=ON\nEND\r\nEND", "M1 = ON\nEND\r\nEND\r\n"),
        ("M1=ON", "M1 = ON\n"),
        ("M1=ON\r\n\r\n\n", "M1 = ON\r\n"),
    ],
)
def test_every_line_keeps_its_end(text: str, printed: str) -> None:
    assert format_text(text) == printed


ALIGNED = """#speed     60      // u/s
#pump      OUT3    // hydraulics
#longName  2,5
#a 1
#b 2

M1 = ON            // drive
SET x = 1          // count
                   // of parts
IF IN1 = 1         // start
    OUT1 = ON      // lamp
    DELAY 1
    OUT2 = ON      // valve
ENDIF
OUT1 = OFF  // not aligned
"""


def test_aligned_comments_and_constants_stay_aligned() -> None:
    assert format_text(ALIGNED) == ALIGNED


def test_aligned_comments_move_together_when_a_line_grows() -> None:
    text = "m1=on   // drive\nx=1+2   // sum\nlongName=x // more\n"
    assert format_text(text) == "m1 = on    // drive\nx = 1 + 2  // sum\nlongName = x  // more\n"


def test_two_blanks_align_where_others_have_one() -> None:
    text = "#ab  1\n#abc 2\n"
    assert format_text(text) == text
    assert format_text("#ab 1\n#abc 2\n") == "#ab 1\n#abc 2\n"
    assert format_text("#abc 1\n#ab  2\n") == "#abc 1\n#ab  2\n"


def test_a_value_that_touches_its_name_is_moved_with_those_above() -> None:
    assert format_text("#ab  5\n#pump-5\n") == "#ab   5\n#pump -5\n"


@pytest.mark.parametrize("tab", [4, 8])
def test_what_tabs_align_stays_aligned(tab: int) -> None:
    text = "#a\t\t1\n#longer\t2\n" if tab == 4 else "#a\t1\n#longer\t2\n"
    assert format_text(text) == "#a      1\n#longer 2\n"


BELOW_LABELS = """M1 = ON

MAIN:
    WAIT IN1 = ON
    // inside
    IF IN2 = 1
        JUMP FLAT
    ENDIF
    JUMP MAIN

// of the next label
FLAT:
OUT1 = ON
RETURN
"""


def test_indentation_below_labels_stays() -> None:
    assert format_text(BELOW_LABELS) == BELOW_LABELS
    assert format_text(BELOW_LABELS.replace("    ", "\t")) == BELOW_LABELS
    assert format_text(BELOW_LABELS.replace("    ", "  ")) == BELOW_LABELS


def test_a_section_that_is_not_all_indented_is_not_indented() -> None:
    assert format_text("MAIN:\n  M1 = ON\nM2 = ON\n") == "MAIN:\nM1 = ON\nM2 = ON\n"
    assert format_text("MAIN:\nM1 = ON\n  M2 = ON\n") == "MAIN:\nM1 = ON\nM2 = ON\n"


def test_blocks_that_are_never_opened_are_not_indented() -> None:
    assert format_text("ENDIF\nELSE\nENDWHILE\nEND\n") == "ENDIF\nELSE\nENDWHILE\nEND\n"


def test_raw_records_are_written_in_capitals() -> None:
    assert format_text(f"//!RECORD  {'0a' * 16}\n") == f"//!record {'0A' * 16}\n"


ARRANGED = (
    "M1=1",
    "END",
    "IF x=1",
    "ENDIF",
    "A:",
    "#b 1",
    "#long",
    " 5",
    "// c",
    " ",
    "  ",
    "    ",
    "\t",
    "\n",
    "\n",
    "\r\n",
    "\u2002",
    "\xa0",
)


def said(text: str) -> list[SourceLine]:
    lines = list(parse(text)[0].lines)
    while lines and lines[-1].statement is None and lines[-1].comment is None:
        lines.pop()
    return lines


@settings(max_examples=100)
@given(
    st.one_of(
        st.text(max_size=200),
        st.text(alphabet="IFELSENDWH x=1+-,.()@:#/!\n\r\t", max_size=200),
        st.lists(st.sampled_from(ARRANGED), max_size=40).map("".join),
    )
)
def test_any_text_keeps_its_meaning(text: str) -> None:
    printed = format_text(text)
    assert said(printed) == said(text)
    assert format_text(printed) == printed


@settings(max_examples=60)
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


def test_deep_blocks_do_not_move_right_for_ever() -> None:
    text = format_text("IF IN1 = ON\n" * 2000)
    assert max(map(len, text.splitlines())) < 200
    assert format_text(text) == text
