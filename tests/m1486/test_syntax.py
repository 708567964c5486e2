from __future__ import annotations

import sys
from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from steptwin.diagnostics import Fix, Span
from steptwin.m1486.syntax import ChipCommand, JumpCondition, ParsedProgram, ProgramLine, format_program, parse, parse_line
from steptwin.m1486.variants import Variant, variant

if TYPE_CHECKING:
    from m1486_programs import Programs


def commands(text: str) -> list[ChipCommand]:
    """The commands of a text that is sound."""
    program, diagnostics = parse(text)
    assert diagnostics == []
    return program.commands


def problems(text: str) -> list[tuple[str, str]]:
    return [(d.code, text[d.span.start : d.span.end]) for d in parse(text).diagnostics]


# Every command example of the manual's chapter VII, and what it means.
MANUAL = {
    "@2": ChipCommand("@", 2),
    "J6": ChipCommand("J", 6),
    "U3": ChipCommand("U", 3),
    "W3000": ChipCommand("W", 3000),
    "B640": ChipCommand("B", 640),
    "R": ChipCommand("R"),
    "D": ChipCommand("D"),
    "F640": ChipCommand("F", 640),
    "G10000": ChipCommand("G", 10_000),
    "G+": ChipCommand("G+"),
    "G-": ChipCommand("G-"),
    "H": ChipCommand("H"),
    "=1200": ChipCommand("=", 1200),
    "C100": ChipCommand("C", 100),
    "C75": ChipCommand("C", 75),
    "P2500": ChipCommand("P", 2500),
    "V12500": ChipCommand("V", 12_500),
    ")7": ChipCommand(")", 7),
    "(2": ChipCommand("(", 2),
    "C7": ChipCommand("C", 7),
    "O2": ChipCommand("O", 2),
    "T1": ChipCommand("T", 1),
    "Z3": ChipCommand("Z", 3),
    "\\": ChipCommand("\\"),
    "X3": ChipCommand("X", 3),
    "XG": ChipCommand("XG"),
    "T51": ChipCommand("T", 51),
    "C43": ChipCommand("C", 43),
    "T85": ChipCommand("T", 85),
    "C85": ChipCommand("C", 85),
    "?14": ChipCommand("?", 14),
    "-10": ChipCommand("-", 10),
    "i87H5": ChipCommand("I", JumpCondition(87, True, 5)),
    "i7h3": ChipCommand("I", JumpCondition(7, True, 3)),
    "i1l6": ChipCommand("I", JumpCondition(1, False, 6)),
    "<3": ChipCommand("<", 3),
    "+5": ChipCommand("+", 5),
    "*2": ChipCommand("*", 2),
    "F": ChipCommand("F"),
    "a": ChipCommand("A"),
    "J": ChipCommand("J"),
    "+184": ChipCommand("+", 184),
    "'3": ChipCommand("'", 3),
    ".": ChipCommand("."),
    "[": ChipCommand("["),
    "]": ChipCommand("]"),
    ":0": ChipCommand(":", 0),
    "L5": ChipCommand("L", 5),
    "e": ChipCommand("E"),
    "M64": ChipCommand("M", 64),
    "Q4": ChipCommand("Q", 4),
    "N2": ChipCommand("N", 2),
    "!184": ChipCommand("!", 184),
    ">10": ChipCommand(">", 10),
    "/64": ChipCommand("/", 64),
    "S70": ChipCommand("S", 70),
    "K": ChipCommand("K"),
}


@pytest.mark.parametrize("text", MANUAL)
@pytest.mark.parametrize("form", [str.upper, str.lower], ids=["upper", "lower"])
def test_command_examples_of_the_manual(text: str, form: Callable[[str], str]) -> None:
    assert commands(form(text)) == [MANUAL[text]]


def test_addresses_are_hexadecimal() -> None:
    assert commands("xA\nXf") == [ChipCommand("X", 10), ChipCommand("X", 15)]
    assert str(ChipCommand("X", 10)) == "XA"


def test_m_1_comments_and_line_feeds_are_ignored() -> None:
    assert commands("F640 ; ten steps; forward\r\n;\r\n; R\r\nR") == [ChipCommand("F", 640), ChipCommand("R")]


def test_m_2_blanks_are_ignored() -> None:
    assert commands("  F\t640 \n i 2 H 3\nG +\nX G") == [
        ChipCommand("F", 640),
        ChipCommand("I", JumpCondition(2, True, 3)),
        ChipCommand("G+"),
        ChipCommand("XG"),
    ]


def test_m_2_a_blank_between_digits_is_ignored_too_and_reported() -> None:
    program, diagnostics = parse("F 12 800")
    assert program.commands == [ChipCommand("F", 12_800)]
    assert [(d.code, d.fix) for d in diagnostics] == [("M202", Fix(Span(2, 8), "12800"))]


@pytest.mark.parametrize("end", ["\r", "\n", "\r\n"])
def test_cr_lf_and_both_end_a_line(end: str) -> None:
    text = end.join(["F640", "R", "", "D", ""])
    assert commands(text) == [ChipCommand("F", 640), ChipCommand("R"), ChipCommand("D")]
    assert len(parse(text).program.lines) == 4


def test_spans_point_into_the_text() -> None:
    text = "; go\n F 640 ;x\nI2H13\n"
    forward, condition = parse(text).program.commands
    assert text[forward.span.start : forward.span.end] == "F 640"
    assert text[forward.argument_span.start : forward.argument_span.end] == "640"
    assert isinstance(condition.argument, JumpCondition)
    assert text[condition.argument.label_span.start : condition.argument.label_span.end] == "13"


def test_a_line_by_itself_has_spans_of_the_text_it_is_part_of() -> None:
    line, diagnostics = parse_line("F640", 100)
    assert diagnostics == []
    assert line.command is not None
    assert line.command.span == Span(100, 104)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("&5", [("M101", "&")]),
        ("é", [("M101", "é")]),
        ("ı2H3", [("M101", "ı")]),  # its capital is an ASCII I
        ("F12&", [("M102", "&")]),
        ("W2.5", [("M102", "2.5")]),
        ("W2,5", [("M102", "2,5")]),
        ("W.5", [("M103", ".5"), ("M104", "5")]),
        ("Wlong", [("M102", "long")]),
        ("F-640", [("M102", "-640")]),
        ("Fl2800", [("M102", "l2800")]),
        ("f1O", [("M102", "O")]),
        ("f1O.", [("M103", "O."), ("M103", ".")]),
        ("F" + "1" * 5000, [("M102", "1" * 5000)]),
        ("F640 R", [("M103", "R")]),
        ("F6+4", [("M103", "+4")]),
        ("[ ]", [("M103", "]")]),
        ("R5", [("M104", "5")]),
        ("G+5", [("M104", "5")]),
        ("@", [("M105", "")]),
        ("X", [("M105", "")]),
        ("XH", [("M105", "")]),
        ("I", [("M106", "")]),
        ("I2", [("M106", "")]),
        ("I2X5", [("M106", "")]),
        ("I2H", [("M106", "")]),
        ("i116", [("M106", "116")]),
        ("X55", [("M102", "5")]),
    ],
)
def test_what_cannot_be_read_is_pointed_at(text: str, found: list[tuple[str, str]]) -> None:
    assert problems(text) == found
    assert parse(text).program.commands == []


@pytest.mark.parametrize(
    ("text", "message", "hint"),
    [
        ("Wlong", "long is not a number", "a number, or the end of the line for the internal variable"),
        ("@one", "one is not a number", "a number"),
        ("F-640", "-640 has a sign", "F moves in positive, B in negative direction"),
        ("V-640", "-640 has a sign", "numbers have no sign"),
        ("F" + "1" * 5000, "a number of 5000 digits", "no number has more than 8"),
        ("F" + "1" * 19, "a number of 19 digits", "no number has more than 8"),
    ],
)
def test_what_is_no_number_is_explained(text: str, message: str, hint: str) -> None:
    (found,) = parse(text).diagnostics
    assert (found.message, found.hint) == (message, hint)


@pytest.mark.parametrize(
    ("text", "mended"),
    [
        ("i7180", "i7L80"),
        ("i116", "i1L6"),  # printed so in the manual's example of Subroutine
        ("Fl28O0", "F12800"),
        ("120", "L20"),
        ("12", "L2"),
        ("’3", "'3"),
        ("×2", "*2"),
        ("R5", "R"),
        ("F640R", "F640\nR"),
        ("I111", "I1L1"),
    ],
)
def test_suggestions_mend_the_line(text: str, mended: str) -> None:
    (diagnostic,) = parse(text).diagnostics
    fix = diagnostic.fix
    assert fix is not None
    assert text[: fix.span.start] + fix.text + text[fix.span.end :] == mended
    assert parse(mended).diagnostics == []


def test_no_suggestion_where_nothing_sensible_is_near() -> None:
    assert [d.fix for d in parse("1\nI199\nfoo").diagnostics[:2]] == [None, None]


def test_a_broken_line_does_not_hide_the_next() -> None:
    text = "F640\n%%\nI2\nR\nR5\nD"
    program, diagnostics = parse(text)
    assert program.commands == [ChipCommand("F", 640), ChipCommand("R"), ChipCommand("D")]
    assert [d.code for d in diagnostics] == ["M101", "M106", "M104"]


def test_what_can_be_understood_of_a_broken_line_is_kept() -> None:
    program, _ = parse("@1 F640\nR5")
    assert program.commands == []
    assert program.all_commands == [ChipCommand("@", 1), ChipCommand("F", 640), ChipCommand("R")]


def test_one_form_in_print() -> None:
    text = " f 12800;go\n;\nr\n\n i2h3 ; if\nzz zz\n"
    assert format_program(parse(text).program) == "F12800      ; go\n;\nR\n\nI2H3        ; if\nzz zz\n"
    assert format_program(parse("f1\nr").program, end="\r") == "F1\rR\r"


@pytest.mark.parametrize("number", range(1, 7))
def test_examples_of_the_manual_survive_print(manual_examples: dict[int, str], number: int) -> None:
    program, diagnostics = parse(manual_examples[number])
    assert diagnostics == []
    assert program.commands
    assert parse(format_program(program)).program == program


@pytest.mark.parametrize("v", [variant("A"), variant("E1")], ids=lambda v: v.name)
@given(data=st.data())
def test_permitted_programs_survive_print(v: Variant, permitted_programs: Programs, data: st.DataObject) -> None:
    program = data.draw(permitted_programs(v))
    again, diagnostics = parse(format_program(program))
    assert diagnostics == []
    assert again == program


@given(data=st.data())
def test_commands_are_read_however_they_are_written(permitted_programs: Programs, data: st.DataObject) -> None:
    program = data.draw(permitted_programs(variant("B")))
    texts = []
    for command in program.commands:
        cased = "".join(data.draw(st.sampled_from([c.lower(), c.upper()])) for c in str(command))
        blanks = [data.draw(st.sampled_from(["", "", " ", "\t "])) for _ in cased]
        tail = data.draw(st.sampled_from(["", ";", " ; R", ";F640;"]))
        end = data.draw(st.sampled_from(["\r", "\n", "\r\n"]))
        texts.append("".join(b + c for b, c in zip(blanks, cased, strict=True)) + tail + end)
    found, diagnostics = parse("".join(texts))
    assert {d.code for d in diagnostics} <= {"M202"}
    assert found.commands == program.commands


@given(st.text(st.characters(codec="utf-8"), max_size=80) | st.text("@FGIJXRhl12;:-+. \t\r\n'", max_size=80))
@example("I" + "1" * 20 + "H3")
@example("\x85F1\u2028R")
def test_any_text_is_read_and_survives_print(text: str) -> None:
    program, diagnostics = parse(text)
    assert all(0 <= d.span.start <= d.span.end <= len(text) for d in diagnostics)
    assert any(line.broken is not None for line in program.lines) == any(d.code.startswith("M1") for d in diagnostics)
    assert parse(format_program(program)).program == program


def test_equality_is_about_meaning_not_place() -> None:
    assert parse("F640").program == parse("  f 640").program == ParsedProgram((ProgramLine(ChipCommand("F", 640)),))
    assert parse("I2H3").program != parse("I2L3").program


@pytest.mark.parametrize("command", ["F1", "F1O", "a.", "I1H1", "["])
def test_a_line_of_many_commands_takes_time_in_proportion(command: str) -> None:
    assert calls_to_read(command * 800) < 5 * calls_to_read(command * 200)


def calls_to_read(text: str) -> int:
    """Calls of Python functions and steps of generators."""
    count = 0

    def call(frame: object, event: str, argument: object) -> None:
        nonlocal count
        count += event == "call"

    sys.setprofile(call)
    try:
        parse(text)
    finally:
        sys.setprofile(None)
    return count
