"""The command table against a transcription of the manual's command summary and section headings."""

from __future__ import annotations

import pytest

from steptwin.m1486.commands import (
    LETTERS,
    TABLE,
    When,
    argument_bits,
    find,
    grouped,
    memory_bits,
    permitted_text,
    rows,
    takes_number,
    takes_variable,
    when,
)
from steptwin.m1486.lines import line_group
from steptwin.m1486.variants import VARIANTS, Variant, variant

MILLIONS = 16_000_000
POWERS = [1, 2, 4, 8, 16, 32, 64]


def numbers(low: int, high: int) -> tuple[list[int], list[int]]:
    """A range of the manual: its ends and middle are taken, what lies next to it is not."""
    return [low, (low + high) // 2, high], [low - 1, high + 1]


def only(values: list[int], among: range) -> tuple[list[int], list[int]]:
    return values, [n for n in among if n not in values]


# letter: (accepted, refused), bits of memory. Labels and addresses follow below.
SUMMARY = {
    "L": (numbers(1, 255), 16),
    "U": (numbers(1, 20), 16),
    "W": (numbers(1, MILLIONS), 32),
    "B": (numbers(1, MILLIONS), 32),
    "F": (numbers(1, MILLIONS), 32),
    "G": (numbers(1, MILLIONS), 32),
    "=": (numbers(1, MILLIONS), 32),
    "A": (numbers(1, 65_000), 24),
    "S": (numbers(16, 1_950), 24),
    # 20 to 7000; above it "the user can set data out of range ... to disable", as far as two bytes go
    "P": (([20, 7_000, 7_001, 25_000, 65_535], [0, 19, 65_536]), 24),
    "V": (numbers(16, 20_000), 24),
    ")": (numbers(1, 21), 16),
    "(": (numbers(1, 21), 16),
    "O": (numbers(1, 21), 16),
    "Z": (numbers(1, 21), 16),
    "C": (only([*range(1, 22), *range(40, 64), 75, *range(80, 87), 100], range(257)), 16),
    "T": (only([*range(1, 22), *range(40, 64), *range(80, 87)], range(257)), 16),
    "M": (only(POWERS, range(130)), 16),
    "Q": (only([1, 2, 4], range(130)), 16),
    "N": (numbers(1, 7), 16),
    ":": (numbers(0, 2**24 - 1), 32),
    ">": (numbers(1, 10), 16),
    "<": (numbers(1, 10), 16),
    "+": (numbers(1, 255), 16),
    "-": (numbers(1, 255), 16),
    "*": (numbers(1, 255), 16),
    "/": (numbers(1, 255), 16),
    "I": (only([*range(1, 22), *range(80, 88)], range(257)), 32),
    "?": (([11, 12, 14, 19, 184, 211, 139], [0, 4, 10, 20, 149, 185, 212, 220, 221]), 16),
    "!": (([11, 12, 14, 19, 184, 211, 139], [0, 4, 10, 20, 149, 185, 212, 220, 221]), 16),
}
LABELS = {"A": 15, "B": 80, "C": 15, "E1": 80, "E2": 80}
LABEL_COMMANDS = {"@": 0, "J": 16, "'": 16}
NO_NUMBER = {
    "E": 8, "K": 8, "[": 0, "]": 0, ".": 8, "D": 8, "G+": 32, "G-": 32, "H": 8, "R": 8, "\\": 0, "XG": 16,
}  # fmt: skip

every_variant = pytest.mark.parametrize("v", VARIANTS, ids=lambda v: v.name)


def test_the_transcription_names_every_command() -> None:
    assert {*SUMMARY, *LABEL_COMMANDS, *NO_NUMBER, "X"} == {spec.key for spec in TABLE}
    assert frozenset("\\@ABCDEFGHIJKLMNOPQRSTUVWXZ[]()=:?!+-/*<>'.") == LETTERS


@every_variant
@pytest.mark.parametrize("key", SUMMARY)
def test_numbers_and_memory(key: str, v: Variant) -> None:
    (accepted, refused), bits = SUMMARY[key]
    assert [n for n in accepted if find(key, n, v) is None] == []
    assert [n for n in refused if find(key, n, v) is not None] == []
    assert memory_bits(key) == bits


@every_variant
@pytest.mark.parametrize("key", LABEL_COMMANDS)
def test_labels_and_their_memory(key: str, v: Variant) -> None:
    highest = LABELS[v.name.removesuffix("2x")]
    assert [n for n in range(257) if find(key, n, v)] == list(range(1, highest + 1))
    assert memory_bits(key) == LABEL_COMMANDS[key]


@every_variant
def test_addresses(v: Variant) -> None:
    lowest = 1 if v.name.startswith("E") else 0
    assert [n for n in range(257) if find("X", n, v)] == list(range(lowest, 16))
    assert memory_bits("X") == 16


@every_variant
@pytest.mark.parametrize("key", NO_NUMBER)
def test_commands_without_a_number(key: str, v: Variant) -> None:
    assert find(key, None, v) is not None
    assert find(key, 1, v) is None
    assert not takes_number(key)
    assert memory_bits(key) == NO_NUMBER[key]


@pytest.mark.parametrize(("key", "bits"), [("R", 8), ("L", 16), ("A", 24), ("W", 32), ("I", 32)])
def test_memory_examples_of_the_manual(key: str, bits: int) -> None:
    assert memory_bits(key) == bits


def test_m_24_going_on_takes_the_memory_of_going_somewhere() -> None:
    assert memory_bits("G+") == memory_bits("G-") == memory_bits("G") == 32


@pytest.mark.parametrize(
    ("largest", "bits"), [(0, 0), (1, 8), (255, 8), (256, 16), (65_535, 16), (65_536, 24), (2**24 - 1, 24), (2**24, 32)]
)
def test_an_argument_takes_whole_bytes(largest: int, bits: int) -> None:
    assert argument_bits(largest) == bits


@pytest.mark.parametrize(
    ("key", "number", "name"),
    [
        ("C", 7, "Clear"), ("C", 43, "Function off"), ("C", 75, "Clear kill"), ("C", 85, "Flag off"),
        ("C", 100, "Clear position counter"), ("T", 1, "Turn on"), ("T", 51, "Function on"), ("T", 85, "Flag on"),
        ("G", 10_000, "Go absolute"), ("G+", None, "Go positive"), ("G-", None, "Go negative"),
        ("X", 3, "indeX"), ("XG", None, "indeX all"),
    ],
)  # fmt: skip
def test_the_number_chooses_among_commands_of_one_letter(key: str, number: int | None, name: str) -> None:
    found = find(key, number, variant("A"))
    assert found is not None
    assert found.name == name


def test_m_27_kill_index_and_clear_kill_do_not_wait() -> None:
    immediate = {(spec.key, spec.name) for spec in TABLE if spec.when is When.RECEIVED}
    assert immediate == {("K", "Kill"), ("X", "indeX"), ("XG", "indeX all"), ("C", "Clear kill")}
    assert when("C", 75) is When.RECEIVED
    assert when("C", 7) is when("C", None) is When.QUEUED


def test_what_takes_no_memory_acts_when_compressed() -> None:
    assert {spec.key for spec in TABLE if spec.when is When.COMPRESSED} == {"@", "[", "]", "\\"}
    assert {spec.key for spec in TABLE if memory_bits(spec.key) == 0} == {"@", "[", "]", "\\"}


def test_the_internal_variable_stands_for_every_number_but_labels_addresses_and_conditions() -> None:
    assert {spec.key for spec in TABLE if takes_number(spec.key) and not takes_variable(spec.key)} == {"@", "X", "I"}


@pytest.mark.parametrize(
    ("argument", "lines"),
    [(14, range(1, 5)), (184, range(18, 22)), (12, range(1, 3)), (211, range(21, 22)), (10, None), (4, None), (212, None)],
)
def test_line_groups(argument: int, lines: range | None) -> None:
    assert line_group(argument) == lines


def test_permitted_numbers_in_words() -> None:
    a = variant("A")
    assert permitted_text("W", a) == "1 to 16 000 000 ms"
    assert permitted_text("M", a) == "1, 2, 4, 8, 16, 32, 64"
    assert permitted_text("X", variant("E1")) == "1 to F"
    assert permitted_text("R", a) == "nothing"
    assert [grouped(number) for number in (9_999, 10_000)] == ["9999", "10 000"]
    assert permitted_text("C", a) == (
        "1 to 21 (line), 40 to 63 (function), 75 (Clear kill), 80 to 86 (flag), 100 (Clear position counter)"
    )


def test_every_row_says_what_it_does_and_where_it_stands() -> None:
    assert all(spec.effect.endswith(".") and spec.section.startswith("VII.") for spec in TABLE)
    assert len({spec.name for spec in TABLE}) == len(TABLE)
    assert all(spec in rows(spec.key) for spec in TABLE)


def test_no_two_commands_share_a_letter_and_a_number() -> None:
    """Where a letter has several rows, all of them say which numbers are theirs."""
    shared = {key: of for key in {spec.key for spec in TABLE} if len(of := rows(key)) > 1}
    assert "C" in shared
    for key, of in shared.items():
        assert all(spec.values for spec in of), key
        numbers = [number for spec in of for number in spec.values or ()]
        assert len(numbers) == len(set(numbers)), key
