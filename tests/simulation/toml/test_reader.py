"""How values of a description are read, at the edges of what is permitted."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from steptwin.controller import SECOND
from steptwin.diagnostics import Fix, Span
from steptwin.errors import Misuse, SourceErrors
from steptwin.simulation.toml.keypaths import Path
from steptwin.simulation.toml.names import Unknown
from steptwin.simulation.toml.reader import FILE_ERRORS, MOST_FINDINGS, TomlText, WorldError
from steptwin.simulation.toml.values import (
    flag,
    number,
    pair,
    pin_name,
    points,
    positive_time,
    text_value,
    whole,
    whole_seconds,
    word,
)


@pytest.mark.parametrize(
    ("read", "value", "expected"),
    [
        (flag, True, True),
        (flag, 1, "1: expected true or false"),
        (number(), -9.5e299, -9.5e299),
        (number(), 1e300, 1e300),
        (number(), 1e308, r"1e\+308: permitted are numbers from -1e\+300 to 1e\+300$"),
        (number(), float("-inf"), r"-inf: permitted are numbers from -1e\+300 to 1e\+300$"),
        (number(), -(10**400), r"-10+: permitted are numbers from -1e\+300 to 1e\+300$"),
        (number(), float("nan"), "nan: expected a number"),
        (number(), "1", "'1': expected a number"),
        (number(), True, "True: expected a number"),
        (number(2.0), 2, 2.0),
        (number(2.0), 1.99, r"1\.99: permitted are numbers from 2$"),
        (number(2.0, above=True), 2.0, r"2\.0: permitted are numbers above 2$"),
        (number(2.0, above=True), 2.01, 2.01),
        (number(2.0, 3.0), 3.0, 3.0),
        (number(2.0, 3.0), 3.01, r"3\.01: permitted are numbers from 2 to 3$"),
        (text_value, "", "'': expected a text that is not empty"),
        (text_value, 5, "5: expected a text$"),
        (whole(1, 4), 1, 1),
        (whole(1, 4), 4, 4),
        (whole(1, 4), 0, "0: permitted are whole numbers from 1 to 4"),
        (whole(1, 4), 5, "5: permitted are whole numbers from 1 to 4"),
        (whole(0, 4), True, "True: permitted are whole numbers"),
        (whole(1, 4), 2.0, r"2\.0: permitted are whole numbers"),
        (word("sine", "ramp"), "ramp", "ramp"),
        (word("sine", "ramp"), "sin", r"'sin' \(did you mean 'sine'\?\): permitted are sine, ramp$"),
        (word("sine", "ramp"), 3, "3: permitted are sine, ramp$"),
        (positive_time, "1 us", 1000),
        (positive_time, "0 s", "'0 s': must be more than 0"),
        (whole_seconds, "1 s", SECOND),
        (whole_seconds, "1 h", 3600 * SECOND),
        (whole_seconds, "2 s", 2 * SECOND),
        (whole_seconds, "0 s", "'0 s': permitted are whole seconds from 1s to 3600s"),
        (whole_seconds, "3601 s", "'3601 s': permitted are whole seconds from 1s to 3600s"),
        (whole_seconds, "1500 ms", "'1500 ms': permitted are whole seconds from 1s to 3600s"),
        (pair, [1, 2.5], (1.0, 2.5)),
        (pair, [2, 2], r"\[2, 2\]: the first must be below the second"),
        (pair, [1, 2, 3], r"\[1, 2, 3\]: expected \[low, high\]"),
        (pair, "12", r"'12': expected \[low, high\]"),
        (points, [[0, 1], [1, 1.5]], ((0.0, 1.0), (1.0, 1.5))),
        (points, [[0, 1], [0, 2]], "the first numbers must grow"),
        (points, [[1, 1], [0, 2]], "the first numbers must grow"),
        (points, [], r"\[\]: expected \[\[x, y\], \[x, y\], \.\.\.\]"),
        (points, [[1]], r"expected \[\[x, y\], \[x, y\], \.\.\.\]"),
        (points, [3], r"expected \[\[x, y\], \[x, y\], \.\.\.\]"),
        (pin_name, "table.in3", ("table", "IN3")),
        (pin_name, "a.b.c", ("a", "B.C")),
        (pin_name, ".in3", r"'\.in3': expected CONTROLLER\.PIN, such as 'table\.IN3'"),
        (pin_name, "table.", r"'table\.': expected CONTROLLER\.PIN"),
        (pin_name, "table", "'table': expected"),
        (pin_name, 3, "3: expected"),
    ],
)
def test_values_at_their_limits(read: Callable[[Any], Any], value: object, expected: object) -> None:
    if isinstance(expected, str) and expected != value:
        with pytest.raises(Misuse, match=f"^{expected}" if not expected.startswith(("the", "expected")) else expected):
            read(value)
        return
    found = read(value)
    assert (found, type(found)) == (expected, type(expected))


@pytest.mark.parametrize(("text", "path", "start"), [("nmae = 1", ("nmae",), 0), ("[a]\n nmae = 1", ("a", "nmae"), 5)])
def test_the_fix_of_a_misspelt_key_replaces_it_alone(text: str, path: tuple[str, ...], start: int) -> None:
    fix = TomlText("w", text).key_replacement(path, "nmae", ("name", "other"))
    assert fix == Fix(Span(start, start + 4), "name")


@pytest.mark.parametrize(
    ("text", "path", "removed"),
    [
        ("a = 1", ("a",), (0, 5)),
        ("a = 1\n", ("a",), (0, 6)),
        ("\n  a = [\n1]  \nb = 2\n", ("a",), (1, 14)),
        ("a = 1 # why\n", ("a",), None),
        ("x = { a = 1 }\n", ("x", "a"), None),
        ("a = 1\n", ("b",), None),
    ],
)
def test_the_fix_that_removes_a_key_takes_its_whole_line(
    text: str, path: tuple[str, ...], removed: tuple[int, int] | None
) -> None:
    assert TomlText("w", text).removal(path) == (None if removed is None else Fix(Span(*removed), ""))


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("[ab]\n", Fix(Span(0, 4), "[[ab]]")),
        ("x = 1\n \t[ ab ]\n", Fix(Span(8, 14), "[[ ab ]]")),
        ("[[ab]]\n", None),
        ("[ab.c]\n", None),
        ("[abc]\n", None),
    ],
)
def test_the_fix_that_makes_a_table_one_of_several(text: str, found: Fix | None) -> None:
    assert TomlText("w", text).doubled("ab") == found


def test_findings_have_the_place_of_what_holds_them_and_no_more_words_than_anybody_reads() -> None:
    text = TomlText("w", "[a]\nb = 1\n[[c]]\nd = 2\n")
    paths: list[Path] = [("a", "b"), ("a", "b", "x", 3), ("a", "z"), ("c",), ("c", 0, "d"), ("c", 0, "e"), ("q",), ()]
    for path in paths:
        text.wrong(path, "D003", "?")
    starts = [4, 4, 0, 10, 16, 10, 0, 0]
    assert [found.span.start for found in text.findings] == starts
    assert [found.span for found in text.findings[-2:]] == [Span(0, 0)] * 2
    assert [text.line(path) for path in paths] == [2, 2, 1, 1, 4, 3, 1, 1]
    for length, shown in ((400, "x" * 400), (401, f"{'x' * 339}…{'x' * 60}")):
        text.wrong(("q",), "D003", "x" * length)
        assert text.findings[-1].message == shown
    text.wrong(("q",), "D003", "x\n" * 300)
    assert len(text.findings[-1].message) == 600
    for _ in range(MOST_FINDINGS - 1 - len(text.findings)):
        text.wrong(("q",), "D003", "?")
    with pytest.raises(WorldError):
        text.wrong(("q",), "D003", "?")
    assert len(text.findings) == MOST_FINDINGS


def test_a_reference_that_is_probably_another_has_a_fix() -> None:
    text = TomlText("w", 'axis = "tabel"\n')
    text.wrong_reference(("axis",), Unknown("tabel", "no axis is called 'tabel'", "table"))
    (found,) = text.findings
    assert (found.code, found.message, found.fix) == ("D009", "no axis is called 'tabel'", Fix(Span(8, 13), "table"))


def test_errors_of_a_file_are_found_where_it_is_named() -> None:
    def misspelt() -> None:
        raise SourceErrors("p.txt:1:1: no such command\n 1 | x")

    text = TomlText("w", '[[a]]\nb = "p.txt"\n')
    assert text.unless_wrong(("a", 0, "b"), misspelt) is None
    (found,) = text.findings
    assert (found.span.start, found.code) == (6, FILE_ERRORS)
    assert found.message == "a file has errors: p.txt:1:1: no such command"
    assert text.unless_wrong(("a", 0, "b"), pytest.fail) is None
