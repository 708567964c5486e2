from __future__ import annotations

import json
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.diagnostics import MOST_SHOWN, Diagnostic, Fix, Severity, SourceText, Span, diagnostics_to_json, in_order, render


def found(start: int, end: int, code: str = "W101", hint: str | None = None, fix: Fix | None = None) -> Diagnostic:
    return Diagnostic(code, Severity.ERROR, Span(start, end), "unknown statement", hint, fix)


@pytest.mark.parametrize(
    ("text", "offset", "place"),
    [
        ("", 0, (1, 1)),
        ("abc", 0, (1, 1)),
        ("abc", 3, (1, 4)),  # after the last character
        ("ab\ncd", 2, (1, 3)),  # the line end belongs to the line it ends
        ("ab\ncd", 3, (2, 1)),
        ("ab\r\ncd", 4, (2, 1)),  # two characters, one line end
        ("ab\rcd", 3, (2, 1)),
        ("ab\n", 3, (2, 1)),  # where an editor puts the cursor after the final line end
        ("a\n\nb", 2, (2, 1)),
        ("a\x0cb\u2028c\x85d", 6, (1, 7)),  # separators for splitlines, not for editors
    ],
)
def test_position(text: str, offset: int, place: tuple[int, int]) -> None:
    assert SourceText("p", text).position(offset) == place


@pytest.mark.parametrize(
    ("text", "lines"),
    [("", [""]), ("a", ["a"]), ("a\n", ["a", ""]), ("a\r\n\r\nb\rc", ["a", "", "b", "c"]), ("\t x \n", ["\t x ", ""])],
)
def test_line(text: str, lines: list[str]) -> None:
    source = SourceText("p", text)
    assert [source.line(number) for number in range(1, len(lines) + 1)] == lines


@given(st.text(alphabet="ab\t\r\n\x0c\u2028"))
def test_every_offset_is_found_again(text: str) -> None:
    source = SourceText("p", text)
    lines = re.split(r"\r\n|\n|\r", text)
    for offset in range(len(text) + 1):
        line, column = source.position(offset)
        assert source.line(line) == lines[line - 1]
        if column <= len(lines[line - 1]):
            assert lines[line - 1][column - 1] == text[offset]


def test_sources_compare_by_name_and_text() -> None:
    assert SourceText("p", "a\nb") == SourceText("p", "a\nb") != SourceText("p", "a")


def test_in_order_follows_the_text_then_the_code() -> None:
    shuffled = [found(5, 6), found(0, 9), found(0, 3, "W202"), found(0, 3, "W102")]
    assert in_order(shuffled) == [shuffled[3], shuffled[2], shuffled[1], shuffled[0]]


def test_render_shows_the_place_the_hint_and_the_suggestion() -> None:
    source = SourceText("feed.prg", "SPEED 60\nMOVEE 10 // out\n")
    diagnostic = found(9, 14, hint="statements: MOVE, MOVER", fix=Fix(Span(9, 14), "MOVE"))
    assert render(source, [diagnostic]) == (
        "feed.prg:2:1: error W101: unknown statement\n"
        "  2 | MOVEE 10 // out\n"
        "    | ^^^^^\n"
        "    = statements: MOVE, MOVER\n"
        "    = suggestion: MOVE"
    )


def test_render_says_remove_it_for_an_empty_replacement() -> None:
    assert render(SourceText("p", "END END"), [found(4, 7, fix=Fix(Span(3, 7), ""))]).endswith("= suggestion: remove it")


@pytest.mark.parametrize(
    ("text", "span", "carets"),
    [
        ("\tGO 1", Span(1, 3), "    |     ^^"),  # a tab before
        ("GO\t1", Span(0, 4), "    | ^^^^^"),  # a tab inside: the carets reach as far as the text does
        ("GO\nEND", Span(0, 6), "    | ^^"),  # more than a line: to the end of the first
        ("GO", Span(2, 2), "    |   ^"),  # nothing to mark: one caret where it is missing
        ("GO\n", Span(3, 3), "    | ^"),
    ],
)
def test_render_puts_carets_under_the_text(text: str, span: Span, carets: str) -> None:
    assert render(SourceText("p", text), [found(span.start, span.end)]).split("\n")[2] == carets


def test_render_keeps_the_gutter_as_wide_as_the_number() -> None:
    source = SourceText("p", "\n" * 99 + "GO")
    assert render(source, [found(99, 101, hint="h")]).split("\n")[1:] == ["  100 | GO", "      | ^^", "      = h"]


def test_render_joins_several_and_of_none_is_empty() -> None:
    source = SourceText("p", "GO\nGO")
    assert render(source, []) == ""
    assert [row for row in render(source, [found(0, 2), found(3, 5)]).split("\n") if row.startswith("p:")] == [
        "p:1:1: error W101: unknown statement",
        "p:2:1: error W101: unknown statement",
    ]


def test_diagnostics_to_json_has_places_from_one() -> None:
    source = SourceText("feed.prg", "GO\nEND\n")
    rows = diagnostics_to_json(
        source, [found(3, 6, fix=Fix(Span(2, 6), "")), Diagnostic("W300", Severity.NOTE, Span(0, 2), "m", "h")]
    )
    assert json.loads(json.dumps(rows)) == [
        {
            "file": "feed.prg",
            "line": 2,
            "column": 1,
            "end_line": 2,
            "end_column": 4,
            "severity": "error",
            "code": "W101",
            "message": "unknown statement",
            "hint": None,
            "fix": {"line": 1, "column": 3, "end_line": 2, "end_column": 4, "text": ""},
        },
        {
            "file": "feed.prg",
            "line": 1,
            "column": 1,
            "end_line": 1,
            "end_column": 3,
            "severity": "note",
            "code": "W300",
            "message": "m",
            "hint": "h",
            "fix": None,
        },
    ]


def test_a_suggestion_that_the_text_makes_already_is_shown_once() -> None:
    span = Span(0, 1)
    for message, hint in (("unknown; did you mean speed?", None), ("unknown", "did you mean speed?")):
        fix = Fix(span, "speed", is_named=True)
        shown = render(SourceText("p", "x"), [Diagnostic("W104", Severity.ERROR, span, message, hint, fix)])
        assert shown.count("speed") == 1, shown


def test_control_characters_do_not_reach_the_terminal() -> None:
    text = "a\x1b]0;title\x07 \x9b2J\x7f\t\u202eb"
    shown = render(
        SourceText("x\x1b[1m.prg", text),
        [Diagnostic("W1", Severity.ERROR, Span(1, 2), "odd \x1b", "hint \x07", Fix(Span(1, 2), "\x1bc"))],
    )
    assert shown.split("\n") == [
        "x␛[1m.prg:1:2: error W1: odd ␛",
        "  1 | a␛]0;title␇ \ufffd2J␡    \ufffdb",
        "    |  ^",
        "    = hint ␇",
        "    = suggestion: ␛c",
    ]


def test_long_words_and_many_findings_are_cut() -> None:
    word = "A" * 2_000_000
    one = [Diagnostic("W1", Severity.ERROR, Span(0, len(word)), f"unknown {word}", word, Fix(Span(0, 1), word))]
    assert len(render(SourceText("x", word), one)) < 3_000
    many = one * 20_000
    shown = render(SourceText("x", "ab"), [Diagnostic("W1", Severity.ERROR, Span(0, 1), "odd")] * 20_000)
    assert shown.count("odd") == MOST_SHOWN
    assert shown.endswith("\nx: 19900 more are not shown")
    assert len(diagnostics_to_json(SourceText("x", "ab"), many)) == 20_000
