"""The statements by which programs last switched or moved something, noted from now on."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from steptwin.controller import Nanos
from steptwin.diagnostics import SourceText
from steptwin.simulation.kinds.programs import Programs, ResourceKind, StatementLocation, StatementUse
from steptwin.simulation.world.simulation import Simulation


class LastActs:
    """Notes for each controller of ``world`` when it last executed a statement that acts, and which."""

    def __init__(self, world: Simulation) -> None:
        self.begin = world.now
        self._of = {name: _OfProgram(programs) for name, programs in world.programs.items()}

    def last(self, controller: str) -> tuple[Nanos, StatementLocation] | None:
        """The moment and location of the last one; None without one since this began, or since another program is there."""
        return self._of[controller].last()

    def went_back(self, now: Nanos) -> None:
        """Time has gone back to a moment: what came then and later has not happened."""
        for one in self._of.values():
            one.went_back(now)


class _OfProgram:
    """Those of one controller, whose texts may become others."""

    def __init__(self, programs: Programs) -> None:
        self._programs = programs
        self._texts: Mapping[str, SourceText] = {}
        self._last: tuple[Nanos, StatementLocation] | None = None
        self._watch()

    def last(self) -> tuple[Nanos, StatementLocation] | None:
        self._watch()
        return self._last

    def went_back(self, now: Nanos) -> None:
        self._last = None if self._last is None or self._last[0] >= now else self._last

    def _watch(self) -> None:
        """Follow the present texts."""
        texts = dict(self._programs.texts)
        if texts != self._texts:
            self._texts, self._last = texts, None
            self._programs.remove_hook(self._acted)
            self._programs.add_hook(self._acted, self._acting())

    def _acting(self) -> Collection[StatementLocation]:
        everywhere = (
            StatementLocation(text, number) for text in self._texts for number in range(len(self._programs.statements(text)))
        )
        return frozenset(one for one in everywhere if acts(self._programs.use(one)))

    def _acted(self, now: Nanos, number: int) -> None:
        location = self._programs.location(number)
        self._last = None if location is None else (now, location)


def acts(use: StatementUse) -> bool:
    """Whether a statement switches or moves something, or ends a wait for something; not one that calculates or decides."""
    return any(one.kind is not ResourceKind.VALUE for one in use.writes) or (use.waits and bool(use.reads))
