"""Counts what programs of a world execute from now on, by hooks on their statements.

A world that goes back to a snapshot counts what it executes from there on, besides what it had executed before. What is replayed
elsewhere to come to a moment, as a debugger does, is not executed here and does not count.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from steptwin.controller import Nanos
from steptwin.coverage.counts import END, Coverage, TextCoverage, Way
from steptwin.diagnostics import SourceText
from steptwin.simulation.kinds.programs import Programs, StatementLocation
from steptwin.simulation.world.simulation import Simulation


class WorldCoverage:
    """Adds to ``coverage`` until `close`. ``locate`` gives the path of a text by its name in the description."""

    def __init__(self, simulation: Simulation, coverage: Coverage, locate: Callable[[str], str] = str) -> None:
        self._simulation = simulation
        self._counters = [_Counter(programs, coverage, locate, simulation.now) for programs in simulation.programs.values()]

    def close(self) -> None:
        """Closing twice has no effect."""
        for counter in self._counters:
            counter.close(self._simulation.now)
        self._counters.clear()


class _KnownText(NamedTuple):
    """A text of a controller, and what is counted of it. ``starts`` has where each statement begins, by its number."""

    source: SourceText
    starts: tuple[int, ...]
    coverage: TextCoverage

    def start(self, number: int) -> int:
        return self.starts[number] if number < len(self.starts) else END


class _Branch(NamedTuple):
    """A branch that was executed, and where it can go on."""

    text: _KnownText
    location: StatementLocation
    after: tuple[int, ...]


class _Counter:
    """Counter of one controller."""

    def __init__(self, programs: Programs, coverage: Coverage, locate: Callable[[str], str], now: Nanos) -> None:
        self._programs = programs
        self._coverage = coverage
        self._locate = locate
        self._known: dict[str, _KnownText] = {}
        """The present texts, by their places."""
        self._branch: _Branch | None = None
        """The statement that was executed last, if it is a branch."""
        self._last: Nanos = now
        self._know_all()
        for number in programs.begun(now):
            self._begins(now, number)
        programs.add_hook(self._begins)

    def close(self, now: Nanos) -> None:
        self._programs.remove_hook(self._begins)
        self._know_all()
        if self._branch is not None:
            stack = self._programs.stack(now)
            self._went(self._branch, now, stack[0].location if stack else None)

    def _know_all(self) -> None:
        """A text counts as soon as it is there."""
        for name, source in self._programs.texts.items():
            self._text(name, source)

    def _text(self, name: str, source: SourceText) -> _KnownText:
        known = self._known.get(name)
        if known is None or known.source is not source:
            known = self._known[name] = self._new(name, source)
        return known

    def _new(self, name: str, source: SourceText) -> _KnownText:
        statements = self._programs.statements(name)
        starts = tuple(END if one.start == one.end else one.start for one in statements)
        known = _KnownText(source, starts, TextCoverage(self._locate(source.name), source, {}, {}))
        for number, after in self._programs.after(name).items():
            known.coverage.statements[starts[number]] = statements[number]
            known.coverage.after[starts[number]] = tuple(map(known.start, after))
        return known._replace(coverage=self._coverage.add(known.coverage))

    def _begins(self, now: Nanos, number: int) -> None:
        """A statement is executed now."""
        if now < self._last:
            self._branch = None  # the world has gone back: this is not what came after it
        self._last = now
        location = self._programs.location(number)
        if self._branch is not None:
            self._went(self._branch, now, location)
            self._branch = None
        if location is None:
            return
        text = self._text(location.text, self._programs.texts[location.text])
        start = text.start(location.number)
        after = text.coverage.after.get(start)
        if after is not None:
            text.coverage.hits[start] += 1
            if len(after) > 1:
                self._branch = _Branch(text, location, after)

    def _went(self, branch: _Branch, now: Nanos, location: StatementLocation | None) -> None:
        """Count the way that a branch went; ``location`` is executed next, or None, a statement of no text."""
        target = self._target(branch, location)
        if target is None:
            # An interrupt came between: it returns to what would have come next.
            returns = (self._target(branch, frame.location) for frame in self._programs.stack(now)[1:2])
            target = next((there for there in returns if there is not None), None)
        if target is None and END in branch.after and END not in branch.text.starts:
            target = END  # which is no statement in this language
        if target is not None:
            text = branch.text.coverage
            text.taken[Way(branch.text.start(branch.location.number), target)] += 1

    @staticmethod
    def _target(branch: _Branch, location: StatementLocation | None) -> int | None:
        """Where a branch went if ``location`` is executed next; None if it does not lead there."""
        if location is None or location.text != branch.location.text:
            return None
        start = branch.text.start(location.number)
        return start if start in branch.after else None
