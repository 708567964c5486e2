"""Suggestions for misspelt names: how many typing mistakes are forgiven, and which candidate is taken."""

from __future__ import annotations

import pytest

from steptwin.nearmiss import NearMiss, alike


@pytest.mark.parametrize(
    ("word", "candidates", "meant"),
    [
        ("ab", "ac", None),  # too short to say
        ("abx", "abc", "abc"),
        ("ABX", "abc", "abc"),
        ("abc", "abc", None),  # no mistake
        ("axx", "abc", None),
        ("bac", "abc", "abc"),  # swapped neighbours are one mistake
        ("acb", "abc", "abc"),
        ("abcd", "abc", "abc"),
        ("abc", "abcd", "abcd"),
        ("bacxe", "abcde", None),  # one mistake in words of five, two in words of six
        ("bacxef", "abcdef", "abcdef"),
        ("badcef", "abcdef", "abcdef"),
        ("badcfe", "abcdef", None),
        ("baxxef", "abcdef", None),
        ("baxdxf", "abcdef", None),
        ("abcdefgh", "abcdef", "abcdef"),
        ("abcdefghi", "abcdef", None),
        ("bcdefa", "abcdef", "abcdef"),
        ("bacdef", "abxdef abcdef", "abcdef"),  # the one with fewer mistakes, wherever it stands
        ("bacdef", "abcdef abxdef", "abcdef"),
        ("abcdex", "abcdef abcdeg", "abcdef"),  # of equal ones the first
        ("cab", "abc", None),
    ],
)
def test_what_was_probably_meant(word: str, candidates: str, meant: str | None) -> None:
    assert NearMiss().of(word, candidates.split()) == meant


def test_the_longest_word_and_the_most_words_that_are_looked_up() -> None:
    assert NearMiss().of("x" * 39 + "y", ["x" * 40]) == "x" * 40
    assert NearMiss().of("x" * 40 + "y", ["x" * 41]) is None
    near = NearMiss()
    assert [near.of(f"abc{n:02d}x", [f"abc{n:02d}"]) for n in range(41)] == [*(f"abc{n:02d}" for n in range(40)), None]
    assert near.of("abc00x", []) == "abc00"  # known already


def test_names_of_several_parts_are_compared_as_a_whole() -> None:
    assert alike("M1_POSACT", ["M2_POS_ACT", "M1_POS_ACT", "M1_VEL_ACT", "OUT1"], 2) == ["M1_POS_ACT", "M2_POS_ACT"]
    assert alike("M1_POSACT", ["OUT1"]) == []
