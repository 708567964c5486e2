"""Coverage as a table for terminals."""

from __future__ import annotations

from steptwin.columns import aligned
from steptwin.coverage.counts import Coverage, Summary
from steptwin.coverage.missing import missing

HEAD = ("file", "statements", "missed", "branches", "missed", "percent", "missing")


def table(coverage: Coverage) -> str:
    """One row for each text, and the sum of several."""
    texts = list(coverage)
    rows = [(text.path, *_numbers(text.summary), missing(text)) for text in texts]
    if len(rows) != 1:
        rows.append(("all", *_numbers(coverage.summary), ""))
    return "\n".join(aligned([HEAD, *rows], right=range(1, len(HEAD) - 1)))


def _numbers(summary: Summary) -> tuple[str, ...]:
    return (*map(str, summary), f"{percent_text(summary)} %")


def percent_text(summary: Summary) -> str:
    """With one decimal, rounded down: 100.0 is all."""
    return f"{int(summary.percent * 10) / 10:.1f}"
