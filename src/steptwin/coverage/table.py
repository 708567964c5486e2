"""Coverage as a table for terminals."""

from __future__ import annotations

from collections.abc import Sequence

from steptwin.coverage.counts import Coverage, Summary
from steptwin.coverage.missing import missing

HEAD = ("file", "statements", "missed", "branches", "missed", "percent", "missing")


def table(coverage: Coverage) -> str:
    """One row for each text, and the sum of several."""
    texts = list(coverage)
    rows = [(text.path, *_numbers(text.summary), missing(text)) for text in texts]
    if len(rows) != 1:
        rows.append(("all", *_numbers(coverage.summary), ""))
    widths = [max(len(row[column]) for row in (HEAD, *rows)) for column in range(len(HEAD))]
    return "\n".join(_line(row, widths) for row in (HEAD, *rows))


def _numbers(summary: Summary) -> tuple[str, ...]:
    return (*map(str, summary), f"{percent_text(summary)} %")


def percent_text(summary: Summary) -> str:
    """With one decimal, rounded down: 100.0 is all."""
    return f"{int(summary.percent * 10) / 10:.1f}"


def _line(row: Sequence[str], widths: Sequence[int]) -> str:
    first, *numbers, last = row
    cells = [number.rjust(width) for number, width in zip(numbers, widths[1:-1], strict=True)]
    return "  ".join((first.ljust(widths[0]), *cells, last)).rstrip()
