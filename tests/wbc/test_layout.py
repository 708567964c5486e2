"""Which cells of a program text stand below each other, and where they stand in print."""

from __future__ import annotations

import pytest

from steptwin.wbc.layout import LayoutCell, aligned, columns_of, indentations
from steptwin.wbc.syntax import parse


def cell(text: str, least: int = 1, *, arranged: bool = True, follows: bool = False) -> LayoutCell:
    """What stands behind ``text``."""
    return LayoutCell(columns_of(text, len(text)), least, arranged, follows)


@pytest.mark.parametrize(
    ("cells", "columns"),
    [
        ([cell("    x"), cell("  xxx")], [5, 5]),
        ([cell("    x"), None, cell("  xxx")], [5, None, 5]),
        ([cell("    x"), cell("   xxx")], [None, None]),
        ([cell("x\t"), cell("x   ")], [4, 4]),  # with tabs of 4
        ([cell("x\t"), cell("x       ")], [8, 8]),  # with tabs of 8
        # With one width of a tab for all of them.
        ([cell("x\t"), cell("x   "), cell("x       ")], [4, 4, None]),
        ([cell("x\t"), cell("x       "), cell("x   ")], [8, 8, None]),
        ([cell("x "), cell("y ", least=9)], [9, 9]),
        ([cell("x ", arranged=False), cell("y ", arranged=False)], [None, None]),
        ([cell("x ", follows=True), cell("y "), cell("z ", follows=True), cell("w  ", follows=True)], [None, 2, 2, None]),
    ],
)
def test_cells_of_one_column(cells: list[LayoutCell | None], columns: list[int | None]) -> None:
    assert aligned(cells, [False] * len(cells)) == columns


def test_nothing_is_aligned_over_a_border() -> None:
    cells = [cell("x "), cell("y "), cell("z "), cell("w ")]
    assert aligned(cells, [False, False, True, False]) == [2, 2, 2, 2]
    assert aligned(cells[:2], [False, True]) == [None, None]


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (
            "IF IN1 = 1\nIF IN2 = 1\nOUT1 = ON\nELSE\nOUT2 = ON\nENDIF\nELSE\nOUT3 = ON\nENDIF\n",
            [0, 4, 8, 4, 8, 4, 0, 4, 0],
        ),
        # Below a label in a block: one level more only for what is deeper than the block.
        ("WHILE 1 = 1\nL:\n    OUT1 = ON\nK:\n    OUT2 = ON\nENDWHILE\n", [0, 0, 4, 0, 4, 0]),
        ("WHILE 1 = 1\nL:\n     OUT1 = ON\nK:\n    OUT2 = ON\nENDWHILE\n", [0, 0, 8, 0, 4, 0]),
        ("L:\n OUT1 = ON\n// at the margin\nK:\nOUT2 = ON\n", [0, 4, 0, 0, 0]),
    ],
)
def test_indentation_by_blocks_and_below_labels(text: str, found: list[int]) -> None:
    assert indentations(parse(text)[0].lines, text.split("\n")[:-1]) == found
