"""Coverage as lcov's tracefile, the format of geninfo(1), for genhtml, editors and services.

Ways out of a branch that was never executed have ``-`` as their count. Block numbers are 0, for a line has one statement.
"""

from __future__ import annotations

from collections.abc import Iterator

from steptwin.coverage.counts import Coverage, TextCoverage


def lcov(coverage: Coverage) -> str:
    return "".join(f"{line}\n" for text in coverage for line in _records(text))


def _records(text: TextCoverage) -> Iterator[str]:
    yield from ("TN:", f"SF:{text.path}")
    branches = [(line, *branch) for line, start in text.lines.items() for branch in _branches(text, start)]
    yield from (f"BRDA:{line},0,{way},{count}" for line, way, count in branches)
    yield from (f"BRF:{len(branches)}", f"BRH:{sum(count not in ('0', '-') for *_, count in branches)}")
    counts = {line: text.hits[start] for line, start in text.lines.items()}
    yield from (f"DA:{line},{count}" for line, count in counts.items())
    yield from (f"LF:{len(counts)}", f"LH:{sum(count > 0 for count in counts.values())}", "end_of_record")


def _branches(text: TextCoverage, start: int) -> Iterator[tuple[int, str]]:
    for index, way in enumerate(text.ways_of(start)):
        yield index, str(text.taken[way]) if text.hits[start] else "-"
