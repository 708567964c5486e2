from __future__ import annotations

from steptwin.columns import aligned


def test_columns_are_as_wide_as_their_longest_cell() -> None:
    lines = [("name", "n", "text"), ("a", "10", ""), ("longer", "5", "x")]
    assert aligned(lines, right=[1]) == ["name     n  text", "a       10", "longer   5  x"]
    assert aligned([]) == []
