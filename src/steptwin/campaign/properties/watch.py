"""A property on a running world."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from steptwin.campaign.case import Verdict
from steptwin.campaign.properties.evaluate import Evaluation
from steptwin.campaign.properties.formatting import formula_text, found_text
from steptwin.campaign.properties.ready import check_ready, written_out
from steptwin.campaign.properties.records import ComparisonRecords
from steptwin.campaign.properties.slopes import TINY, Shape, Slope, shortest, value_at
from steptwin.campaign.properties.text import parse_property
from steptwin.campaign.properties.tree import Atom, CycleTime, Delayed, Holding, Lasting, PropertyFormula, Tally, measured, nodes
from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.simulation.world.simulation import Simulation


@dataclass(frozen=True, slots=True)
class WatchState:
    """Knowledge of a `PropertyWatch` about the time before a moment, for a branch that begins there. It is plain and pickles."""

    text: str
    now: Nanos
    shapes: tuple[tuple[tuple[Nanos, Nanos, float, float], ...], ...]


@dataclass(frozen=True, slots=True)
class Property:
    """A property of runs; ``name`` is for people. It is plain text and pickles."""

    text: str
    name: str

    def watch(self, world: Simulation, earlier: WatchState | None = None) -> PropertyWatch:
        """Watch a world from its present moment on, or as if from the begin of ``earlier``, which another world with the same
        past has seen. Raises `Misuse` for what this world does not have."""
        return watch_together([self], world, [earlier])[0]


def read_property(text: str, name: str = "") -> Property:
    """A property, or the name of a ready one with what it needs. Raises `Misuse` with column and near names."""
    if not check_ready(text):
        parse_property(text)
    return Property(text, name or text)


def watch_together(
    properties: Sequence[Property], world: Simulation, earlier: Sequence[WatchState | None] | None = None
) -> list[PropertyWatch]:
    """As `Property.watch` of each; what several of them compare is followed once."""
    records = ComparisonRecords(world)
    seen = [None] * len(properties) if earlier is None else earlier
    found = [PropertyWatch(one, world, state, records) for one, state in zip(properties, seen, strict=True)]
    records.begin()
    return found


class PropertyWatch:
    """A property on a world whose comparisons are followed by ``records``. It ends with `close`."""

    def __init__(self, which: Property, world: Simulation, earlier: WatchState | None, records: ComparisonRecords) -> None:
        self.which = which
        self._world = world
        self._records = records
        self._formula, atoms, shaped = _parsed(written_out(which.text, world))
        try:
            self._recordings = records.use(atoms, shaped)
        except Misuse as error:
            raise Misuse(f"property {which.text!r}: {error}") from None
        if earlier is not None:
            self._go_on(earlier)

    def _go_on(self, earlier: WatchState) -> None:
        if earlier.text != self.which.text:
            raise Misuse(f"what was seen of {earlier.text!r} does not serve {self.which.text!r}")
        if earlier.now != self._world.now:
            raise Misuse(
                f"what was seen up to {earlier.now / SECOND:g} s does not serve a world at {self._world.now / SECOND:g} s"
            )
        for recording, shape in zip(self._recordings.values(), earlier.shapes, strict=True):
            recording.record.begin_after([Slope(*one) for one in shape])

    def close(self) -> None:
        """The world is no longer watched."""
        self._records.release()

    # ------------------------------------------------------------------ what it says

    def _shapes(self) -> dict[Atom, Shape]:
        world = self._at_present()
        return {atom: shortest(recording.shape(world.now)) for atom, recording in self._recordings.items()}

    def _at_present(self) -> Simulation:
        """The world, all of which has come to its present moment."""
        self._world.advance(self._world.now)
        self._records.sync(self._world.now)
        return self._world

    def state(self) -> WatchState:
        """For a branch from the present moment."""
        world = self._at_present()
        shapes: Any = tuple(tuple(map(tuple, one.record.state(world.now))) for one in self._recordings.values())
        return WatchState(self.which.text, world.now, shapes)

    def verdict(self) -> Verdict:
        """Verdict on the run up to now, as if it ended."""
        found = Evaluation(self._shapes())
        value = value_at(found.shape(self._formula), found.begin)
        moment, by = found.decided(self._formula, found.begin)
        holds = value > 0.0
        robustness = 0.0 if abs(value) <= TINY else value
        return Verdict(self.which.name, holds, robustness, moment, "" if holds else self._why(found, by, moment))

    def _why(self, found: Evaluation, by: PropertyFormula, moment: Nanos) -> str:
        at = f"{moment / SECOND:.9g} s"
        if isinstance(by, Atom):
            recording = self._recordings[by]
            value = value_at(found.shape(by), moment)
            record = recording.record
            return f"{found_text(recording.node, value, record.scale, record.unit)} at {at}"
        text = formula_text(by)
        if isinstance(by, Lasting | Holding | Delayed):
            return f"{text}: not come true by {at}"
        return f"{text}: not so at {at}"

    def measures(self) -> dict[str, float]:
        """Least, greatest and mean of each cycle time in the property, s, and how many cycles there were."""
        several = list(dict.fromkeys(measured(self._formula)))
        if not several:
            return {}
        evaluation = Evaluation(self._shapes())
        found: dict[str, float] = {}
        for n, node in enumerate(several, 1):
            lengths = [(end - begin) / SECOND for begin, end in evaluation.cycles(node)[0]]
            name = f"{self.which.name} {n}" if len(several) > 1 else self.which.name
            if lengths:
                found |= {f"{name} min": min(lengths), f"{name} max": max(lengths), f"{name} mean": sum(lengths) / len(lengths)}
            found[f"{name} cycles"] = float(len(lengths))
        return found


@lru_cache(maxsize=512)
def _parsed(text: str) -> tuple[PropertyFormula, tuple[Atom, ...], frozenset[Atom]]:
    """A property, its comparisons, and those whose shape counts: every run of a campaign asks for them."""
    formula = parse_property(text)
    return formula, tuple(dict.fromkeys(node for node in nodes(formula) if isinstance(node, Atom))), _shaped(formula)


def _shaped(formula: PropertyFormula) -> frozenset[Atom]:
    """The comparisons whose value between turning points matters, because they meet others or a window. Counts and cycle times
    need only the moments at which they change."""
    counted = {one for node in nodes(formula) if isinstance(node, CycleTime | Tally) for one in nodes(node)}
    atoms = {node for node in nodes(formula) if isinstance(node, Atom)} - counted
    windows = any(isinstance(node, Delayed) or (isinstance(node, Lasting) and node.length is not None) for node in nodes(formula))
    return frozenset(atoms) if windows or len(atoms) > 1 else frozenset()
