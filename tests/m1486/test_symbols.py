"""Names of a program: what an editor finds, follows and renames."""

from __future__ import annotations

import pytest

from steptwin.m1486.symbols import label_key, uses
from steptwin.m1486.syntax import parse


def found(text: str) -> list[tuple[str, str, str, str, str]]:
    """Each use: kind, key, name, role, and the text at its place."""
    return [
        (use.symbol.kind.value, use.symbol.key, use.symbol.text, use.role.value, text[use.span.start : use.span.end])
        for use in uses(parse(text).program)
    ]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("@5", [("label", "5", "5", "define", "5")]),
        ("J 5", [("label", "5", "5", "read", "5")]),
        ("'12", [("label", "12", "12", "read", "12")]),
        ("i2h5", [("line", "B2", "B2", "read", "2"), ("label", "5", "5", "read", "5")]),
        ("i87l15", [("variable", "flag 87", "flag 87", "read", "87"), ("label", "15", "15", "read", "15")]),
        ("c21", [("line", "B21", "B21", "write", "21")]),
        ("T1", [("line", "B1", "B1", "write", "1")]),
        ("o4\nz5", [("line", "B4", "B4", "read", "4"), ("line", "B5", "B5", "read", "5")]),
        (")4\n(5", [("line", "B4", "B4", "read", "4"), ("line", "B5", "B5", "read", "5")]),
        ("t40\nc63", [("function", "F40", "function 40", "write", "40"), ("function", "F63", "function 63", "write", "63")]),
        ("t80\nc86", [("variable", "flag 80", "flag 80", "write", "80"), ("variable", "flag 86", "flag 86", "write", "86")]),
        (">3", [("register", "R3", "register 3", "write", "3")]),
        ("<10", [("register", "R10", "register 10", "read", "10")]),
        ("c75\nc100\nf64\nj\nr\n@\nu20\n?14", []),
    ],
)
def test_names_and_what_is_done_with_them(text: str, expected: list[tuple[str, str, str, str, str]]) -> None:
    assert found(text) == expected


def test_labels_belong_to_the_chip_that_listens() -> None:
    labels = [(key, role) for kind, key, _, role, _ in found("@1\nX3\n@1\nJ1\nXA\nJ1\nXG\nJ1") if kind == "label"]
    assert labels == [("1", "define"), ("3:1", "define"), ("3:1", "read"), ("A:1", "read"), ("1", "read")]
    assert label_key(None, 80) == "80"
