"""The records of the comparisons of properties that are watched together: equal ones are followed once."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from steptwin.campaign.properties.recording import ComparisonRecord
from steptwin.campaign.properties.slopes import Shape, negative
from steptwin.campaign.properties.tree import OPPOSITE, Atom
from steptwin.controller import Nanos
from steptwin.simulation.logic.expression import Comparison
from steptwin.simulation.scheduler.scheduler import Source
from steptwin.simulation.world.simulation import Simulation


class SharedRecord:
    """Source of one comparison: a record, which may be that of the opposite, whose distance is the negative."""

    __slots__ = ("_is_opposite", "record")

    def __init__(self, record: ComparisonRecord, *, is_opposite: bool) -> None:
        self.record = record
        self._is_opposite = is_opposite

    @property
    def node(self) -> Comparison:
        node = self.record.node
        return replace(node, sign=OPPOSITE[node.sign]) if self._is_opposite else node

    def shape(self, now: Nanos) -> Shape:
        found = self.record.shape(now)
        return negative(found) if self._is_opposite else found


class ComparisonRecords:
    """A subscriber of a world (`steptwin.simulation.scheduler.worldsubscriber`). It ends once all who use it have released it."""

    number, entry = 0, 0
    _begins = True
    sources: tuple[Source, ...] = ()

    def __init__(self, world: Simulation) -> None:
        self._world = world
        self._known: dict[tuple[Comparison, bool], ComparisonRecord] = {}
        self._spread: list[ComparisonRecord] = []
        """Those that no scheduler follows alone."""
        self._users = 0

    def use(self, atoms: Iterable[Atom], fine: frozenset[Atom]) -> dict[Atom, SharedRecord]:
        """The records of these, before `begin`. ``fine``: those whose shape counts. Raises `Misuse` as `ComparisonRecord`."""
        self._users += 1
        return {atom: self._of(atom, is_fine=atom in fine) for atom in atoms}

    def _of(self, atom: Atom, *, is_fine: bool) -> SharedRecord:
        key = atom.comparison, is_fine
        if key not in self._known:
            sign = atom.comparison.sign
            if sign in ("==", "!="):  # the others are no opposites where there is no number
                opposite = self._known.get((replace(atom.comparison, sign=OPPOSITE[sign]), is_fine))
                if opposite is not None:
                    return SharedRecord(opposite, is_opposite=True)
            self._known[key] = ComparisonRecord(self._world, atom, is_fine=is_fine)
        return SharedRecord(self._known[key], is_opposite=False)

    def begin(self) -> None:
        """Follow the world from its present moment on."""
        for record in self._known.values():
            if record.scheduler is None:
                self._spread.append(record)
            record.subscribe(self._world)
        if self._known:
            self._world.subscribe(self)

    def release(self) -> None:
        """One who used it does so no longer."""
        self._users -= 1
        if not self._users:
            for record in self._known.values():
                record.unsubscribe()
            self._world.unsubscribe(self)

    def sync(self, now: Nanos) -> None:
        for record in self._known.values():
            record.sync(now)

    # ------------------------------------------------------------------ as a subscriber

    def leave(self, moment: Nanos) -> None:
        for record in self._spread:
            record.leave(moment)

    def look(self, now: Nanos) -> tuple[Source, ...]:
        """All look where the watch begins; later only those that no scheduler follows."""
        found: dict[Source, None] = {}
        for record in self._known.values() if self._begins else self._spread:
            sources = record.sync(now)
            if record.scheduler is None:
                found.update(dict.fromkeys(sources))
            record.look(now)
        self._begins = False
        return tuple(found)

    def rewind(self, now: Nanos) -> None:
        self._begins = True
        for record in self._known.values():
            record.rewind(now)
