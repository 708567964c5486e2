"""Text of what was not executed: lines, and ways out of branches."""

from __future__ import annotations

from collections.abc import Iterator

from steptwin.coverage.counts import TextCoverage, Way


def missing(text: TextCoverage) -> str:
    """Lines with statements that were not executed, then ways that executed branches did not go: ``4-6, 9, 12->15, 20->end``."""
    return ", ".join((*_ranges(text), *(way_text(text, way) for way in missed_ways(text))))


def missed_ways(text: TextCoverage) -> list[Way]:
    """Ways not taken out of branches that were executed."""
    return [way for way in text.ways if text.hits[way.origin] and not text.taken[way]]


def missed_lines(text: TextCoverage) -> list[int]:
    return [line for line, start in text.lines.items() if not text.hits[start]]


def way_text(text: TextCoverage, way: Way) -> str:
    return f"{text.line_of(way.origin)}->{text.line_of(way.target) or 'end'}"


def _ranges(text: TextCoverage) -> Iterator[str]:
    """Lines without statements do not end a range."""
    missed = set(missed_lines(text))
    run: list[int] = []
    for line in (*text.lines, None):
        if line is not None and line in missed:
            run.append(line)
        elif run:
            yield str(run[0]) if len(run) == 1 else f"{run[0]}-{run[-1]}"
            run = []
