"""A property on a running world."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from steptwin.campaign.case import Verdict
from steptwin.campaign.properties.evaluate import Evaluation
from steptwin.campaign.properties.ready import check_ready, formula_of
from steptwin.campaign.properties.recording import ComparisonRecord
from steptwin.campaign.properties.slopes import TINY, Shape, Slope, shortest, value_at
from steptwin.campaign.properties.text import parse_property
from steptwin.campaign.properties.tree import Atom, CycleTime, Delayed, Holding, Lasting, PropertyFormula, Tally, measured, nodes
from steptwin.campaign.properties.words import formula_text, found_text
from steptwin.errors import Misuse
from steptwin.machine import SECOND, Nanos
from steptwin.world.kernel import Source
from steptwin.world.plant import Plant


@dataclass(frozen=True, slots=True)
class WatchState:
    """What a `PropertyWatch` knows of the time before a moment, for a branch that begins there. It is plain and pickles."""

    text: str
    now: Nanos
    courses: tuple[tuple[tuple[Nanos, Nanos, float, float], ...], ...]


@dataclass(frozen=True, slots=True)
class Property:
    """A property of runs; ``name`` is for people. It is plain text and pickles."""

    text: str
    name: str

    def watch(self, world: Plant, earlier: WatchState | None = None) -> PropertyWatch:
        """Watch a world from its present moment on, or as if from the begin of ``earlier``, which another world with the same
        past has seen. Raises `Misuse` for what this world does not have."""
        return PropertyWatch(self, world, earlier)


def read_property(text: str, name: str = "") -> Property:
    """A property, or the name of a ready one with what it needs. Raises `Misuse` with column and near names."""
    if not check_ready(text):
        parse_property(text)
    return Property(text, name or text)


class PropertyWatch:
    """An observer of a world (`steptwin.world.observing`). It ends with `close`."""

    number, entry = 0, 0
    _begins = True
    sources: tuple[Source, ...] = ()

    def __init__(self, which: Property, world: Plant, earlier: WatchState | None) -> None:
        self.which = which
        self._world = world
        self._formula: PropertyFormula = formula_of(which.text, world)
        fine = _shaped(self._formula)
        atoms = dict.fromkeys(node for node in nodes(self._formula) if isinstance(node, Atom))
        try:
            self._recordings = {atom: ComparisonRecord(world, atom, is_fine=atom in fine) for atom in atoms}
        except Misuse as error:
            raise Misuse(f"property {which.text!r}: {error}") from None
        if earlier is not None:
            self._go_on(earlier)
        self._all = tuple(self._recordings.values())
        self._spread = tuple(one for one in self._all if one.kernel is None)
        """Those that no kernel follows alone."""
        for recording in self._all:
            recording.follow(world)
        world.observe(self)

    def _go_on(self, earlier: WatchState) -> None:
        if earlier.text != self.which.text:
            raise Misuse(f"what was seen of {earlier.text!r} does not serve {self.which.text!r}")
        if earlier.now != self._world.now:
            raise Misuse(
                f"what was seen up to {earlier.now / SECOND:g} s does not serve a world at {self._world.now / SECOND:g} s"
            )
        for recording, course in zip(self._recordings.values(), earlier.courses, strict=True):
            recording.begin_after([Slope(*one) for one in course])

    def close(self) -> None:
        """The world is no longer watched."""
        for recording in self._all:
            recording.unfollow()
        self._world.unobserve(self)

    # ------------------------------------------------------------------ as an observer

    def leave(self, moment: Nanos) -> None:
        for recording in self._spread:
            recording.leave(moment)

    def look(self, now: Nanos) -> tuple[Source, ...]:
        """All look where the watch begins; later only those that no kernel follows."""
        found: dict[Source, None] = {}
        for recording in self._all if self._begins else self._spread:
            sources = recording.bring(now)
            if recording.kernel is None:
                found.update(dict.fromkeys(sources))
            recording.look(now)
        self._begins = False
        return tuple(found)

    def rewind(self, now: Nanos) -> None:
        self._begins = True
        for recording in self._all:
            recording.rewind(now)

    # ------------------------------------------------------------------ what it says

    def _courses(self) -> dict[Atom, Shape]:
        world = self._at_present()
        return {atom: shortest(recording.course(world.now)) for atom, recording in self._recordings.items()}

    def _at_present(self) -> Plant:
        """The world, all of which has come to its present moment."""
        self._world.advance(self._world.now)
        for recording in self._all:
            recording.bring(self._world.now)
        return self._world

    def state(self) -> WatchState:
        """For a branch from the present moment."""
        world = self._at_present()
        courses: Any = tuple(tuple(map(tuple, one.state(world.now))) for one in self._all)
        return WatchState(self.which.text, world.now, courses)

    def verdict(self) -> Verdict:
        """Of the run up to now, as if it ended."""
        found = Evaluation(self._courses())
        value = value_at(found.course(self._formula), found.begin)
        moment, by = found.decided(self._formula, found.begin)
        holds = value > 0.0
        robustness = 0.0 if abs(value) <= TINY else value
        return Verdict(self.which.name, holds, robustness, moment, "" if holds else self._why(found, by, moment))

    def _why(self, found: Evaluation, by: PropertyFormula, moment: Nanos) -> str:
        at = f"{moment / SECOND:.9g} s"
        if isinstance(by, Atom):
            recording = self._recordings[by]
            value = value_at(found.course(by), moment)
            return f"{found_text(recording.node, value, recording.scale, recording.unit)} at {at}"
        text = formula_text(by)
        if isinstance(by, Lasting | Holding | Delayed):
            return f"{text}: not come true by {at}"
        return f"{text}: not so at {at}"

    def measures(self) -> dict[str, float]:
        """Of each cycle time in the property: the least, greatest and mean, s, and how many cycles there were."""
        evaluation = Evaluation(self._courses())
        found: dict[str, float] = {}
        several = list(dict.fromkeys(measured(self._formula)))
        for n, node in enumerate(several, 1):
            lengths = [(end - begin) / SECOND for begin, end in evaluation.cycles(node)[0]]
            name = f"{self.which.name} {n}" if len(several) > 1 else self.which.name
            if lengths:
                found |= {f"{name} min": min(lengths), f"{name} max": max(lengths), f"{name} mean": sum(lengths) / len(lengths)}
            found[f"{name} cycles"] = float(len(lengths))
        return found


def _shaped(formula: PropertyFormula) -> frozenset[Atom]:
    """The comparisons whose value between turns matters, because they meet others or a window. Counts and cycle times need only
    the moments at which they change."""
    counted = {one for node in nodes(formula) if isinstance(node, CycleTime | Tally) for one in nodes(node)}
    atoms = {node for node in nodes(formula) if isinstance(node, Atom)} - counted
    windows = any(isinstance(node, Delayed) or (isinstance(node, Lasting) and node.length is not None) for node in nodes(formula))
    return frozenset(atoms) if windows or len(atoms) > 1 else frozenset()
