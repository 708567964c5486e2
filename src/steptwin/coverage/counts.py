"""Counts of what was executed, by text: the same text under the same path adds up, whichever controller or world executed it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from steptwin.diagnostics import SourceText
from steptwin.simulation.kinds.programs import Statement

END = -1
"""Stands for the end of a program, which comes next after its last statement."""


class Way(NamedTuple):
    """One way out of a branch: where its statement begins, and the one that comes next."""

    origin: int
    target: int


@dataclass
class TextCoverage:
    """Counts of one text, whose statements are known by their first characters.

    ``statements`` are those that count, ``after`` has where each goes on, a branch at several. ``hits`` counts executions,
    ``taken`` the ways out of branches.
    """

    path: str
    source: SourceText
    statements: dict[int, Statement]
    after: dict[int, tuple[int, ...]]
    hits: Counter[int] = field(default_factory=Counter)
    taken: Counter[Way] = field(default_factory=Counter)

    @property
    def ways(self) -> list[Way]:
        """All ways out of branches, in the order of the text."""
        return [way for start in sorted(self.after) for way in self.ways_of(start)]

    def ways_of(self, start: int) -> list[Way]:
        """Those of one statement; empty unless it is a branch."""
        after = self.after[start]
        return [Way(start, target) for target in after] if len(after) > 1 else []

    @property
    def lines(self) -> dict[int, int]:
        """Where the statements that count begin, by line: no line of either language has two."""
        return {statement.line: start for start, statement in sorted(self.statements.items())}

    @property
    def summary(self) -> Summary:
        ways = self.ways
        missed = sum(not self.hits[start] for start in self.statements)
        return Summary(len(self.statements), missed, len(ways), sum(not self.taken[way] for way in ways))

    def line_of(self, start: int) -> int | None:
        """The line of a statement; None for the end of the program."""
        return None if start == END else self.source.position(start)[0]

    def add(self, other: TextCoverage) -> None:
        """Count what is counted there, too. Chips of a chain execute different statements of the same text."""
        self.statements |= other.statements
        for start, after in other.after.items():
            self.after[start] = tuple(dict.fromkeys((*self.after.get(start, ()), *after)))
        self.hits.update(other.hits)
        self.taken.update(other.taken)


class Summary(NamedTuple):
    """``branches`` counts the ways out of all branches."""

    statements: int = 0
    missed: int = 0
    branches: int = 0
    missed_branches: int = 0

    def __add__(self, other: Any) -> Summary:
        return Summary(*(one + more for one, more in zip(self, other, strict=True)))

    @property
    def percent(self) -> float:
        """Percentage of statements and ways that were executed; 100 where there are none."""
        total = self.statements + self.branches
        return 100.0 if total == 0 else 100.0 * (total - self.missed - self.missed_branches) / total


class Coverage:
    """The counts of all texts, in the order of their paths."""

    def __init__(self, texts: Iterable[TextCoverage] = ()) -> None:
        self._texts: dict[tuple[str, str], TextCoverage] = {}
        for text in texts:
            self.add(text)

    def __iter__(self) -> Iterator[TextCoverage]:
        return iter(sorted(self._texts.values(), key=lambda text: text.path))

    @property
    def summary(self) -> Summary:
        return sum((text.summary for text in self), Summary())

    def add(self, text: TextCoverage) -> TextCoverage:
        """Count what is counted there, too; gives where it is counted from now on. Another text under the same path is counted
        apart."""
        found = self._texts.get((text.path, text.source.text))
        if found is not None:
            found.add(text)
            return found
        self._texts[text.path, text.source.text] = text
        return text

    # ------------------------------------------------------------------ as plain values

    def to_json(self) -> list[Any]:
        """For another process, which continues with `from_json`."""
        return [
            {
                "path": text.path,
                "name": text.source.name,
                "text": text.source.text,
                "statements": [[one.start, one.end, one.line] for one in text.statements.values()],
                "after": [[start, list(after)] for start, after in text.after.items()],
                "hits": [list(item) for item in text.hits.items()],
                "taken": [[*way, count] for way, count in text.taken.items()],
            }
            for text in self
        ]

    @classmethod
    def from_json(cls, data: Iterable[Any]) -> Coverage:
        return cls(
            TextCoverage(
                one["path"],
                SourceText(one["name"], one["text"]),
                {start: Statement(start, end, line) for start, end, line in one["statements"]},
                {start: tuple(after) for start, after in one["after"]},
                Counter(dict(one["hits"])),
                Counter({Way(origin, target): count for origin, target, count in one["taken"]}),
            )
            for one in data
        )
