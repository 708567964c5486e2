"""Phases of the cycle of a machine: what is on, what moves and where programs stand, from a run."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from math import inf
from operator import itemgetter
from typing import TypeAlias

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.datasheet import PinDirection
from steptwin.motion.divisions import StepTrain
from steptwin.motion.profile import Profile
from steptwin.simulation.components.button import BUTTON
from steptwin.simulation.scheduler.scheduler import Source
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.world.simulation import Simulation

MOST_PHASES = 16
SHOWN = 3
"""So many changes are named where a phase begins."""
STANDS_NS = 50 * MILLISECOND
"""A program stands on a statement on which it is so long; on shorter ones it is under way, as in a loop that asks for inputs."""
LONGEST_STATEMENT = 24
ON = "on"
AT_BEGIN = "at the beginning"

_Change: TypeAlias = tuple[Nanos, str, str]
"""Moment, what changes, and its new state in words; empty: nothing to tell of it, as of an output that is off."""


@dataclass(frozen=True, slots=True)
class CyclePhase:
    """A state of the outputs, axes and programs of a machine. ``begin`` and ``end`` are of its longest time, ``total`` of all its
    times."""

    number: int
    begin: Nanos
    end: Nanos
    total: Nanos
    name: str
    """Name of the change at its beginning."""

    @property
    def middle(self) -> Nanos:
        return (self.begin + self.end) // 2

    def to_json(self) -> dict[str, object]:
        """As JSON."""
        return {
            "number": self.number,
            "name": self.name,
            "begin_s": self.begin / SECOND,
            "end_s": self.end / SECOND,
            "at_s": self.middle / SECOND,
            "total_s": self.total / SECOND,
        }


class PhaseWatch:
    """Notes the states of axes and programs of a world, which keeps its trace, from its present moment on. A subscriber
    (`steptwin.simulation.scheduler.worldsubscriber`)."""

    number, entry = 0, 0
    sources: tuple[Source, ...] = ()

    def __init__(self, world: Simulation) -> None:
        self._world = world
        self._begin = world.now
        self._axes: list[_Change] = []
        self._programs: dict[str, list[_Change]] = {name: [] for name in world.programs}
        self._last: dict[str, str] = {}
        world.subscribe(self)

    # ------------------------------------------------------------------ as a subscriber

    def leave(self, moment: Nanos) -> None:
        """Nothing is followed between events."""

    def look(self, now: Nanos) -> tuple[Source, ...]:
        world = self._world
        sources = [scheduler.source(name) for scheduler in world.schedulers for name in scheduler.controllers]
        for source in sources:
            source.scheduler.advance(now)
        for name, controller in world.controllers.items():
            reader = world.kind(name).state
            for axis in reader.datasheet(controller).axes:
                self._note(self._axes, now, f"{name}.{axis.name}", reader.axis(controller, axis, now).status.text)
        for name, changes in self._programs.items():
            self._note(changes, now, name, self._standing(name, now))
        return tuple(sources)

    def rewind(self, now: Nanos) -> None:
        """A run without a fault is never rewound."""

    def _note(self, changes: list[_Change], now: Nanos, what: str, state: str) -> None:
        if self._last.get(what) != state:
            self._last[what] = state
            changes.append((now, what, state))

    def _standing(self, name: str, now: Nanos) -> str:
        programs = self._world.programs[name]
        stack = programs.stack(now)
        if not stack:
            return ""
        location = stack[0].location
        statements = programs.statements(location.text)
        if location.number >= len(statements):
            return ""
        statement = statements[location.number]
        text = " ".join(programs.texts[location.text].text[statement.start : statement.end].split())
        return f"line {statement.line} {text if len(text) <= LONGEST_STATEMENT else f'{text[:LONGEST_STATEMENT]}…'}"

    # ------------------------------------------------------------------ after the run

    def phases(self, most: int = MOST_PHASES) -> list[CyclePhase]:
        """The phases of what the world did meanwhile, in order, at most so many: first those that take longest of which each has
        something that no other has, then the longest.

        Two times are of the same phase if the same outputs of controllers, elements and buttons are on, the axes have the same
        status and move in the same direction, and programs stand on the same statements.
        """
        world = self._world
        changes = [*_edges(world.trace, _acting(world)), *self._motions(), *self._stands()]
        spans = list(_spans(sorted(changes, key=itemgetter(0)), self._begin, world.now))
        totals: dict[frozenset[str], Nanos] = {}
        longest: dict[frozenset[str], tuple[Nanos, Nanos, str]] = {}
        for at, end, state, name in spans:
            totals[state] = totals.get(state, 0) + end - at
            if state not in longest or end - at > longest[state][1] - longest[state][0]:
                longest[state] = at, end, name
        kept = sorted(_telling(sorted(totals, key=lambda state: -totals[state]), most), key=lambda state: longest[state][0])
        return [CyclePhase(n, *longest[state][:2], totals[state], longest[state][2]) for n, state in enumerate(kept, start=1)]

    def _motions(self) -> Iterator[_Change]:
        """States of axes: their status, with the direction in which they move."""
        turns: dict[str, list[tuple[Nanos, str]]] = {}
        for record in self._world.trace.plans():
            plan = record.value.profile if isinstance(record.value, StepTrain) else record.value
            if isinstance(plan, Profile):
                there = turns.setdefault(f"{record.controller}.M{record.subject}", [])
                while there and there[-1][0] >= record.time:
                    there.pop()  # of a motion that this one replaces
                there += _turns(plan, record.time)
        changes = sorted(
            [(at, name, 0, text) for at, name, text in self._axes]
            + [(at, name, 1, text) for name, there in turns.items() for at, text in there]
        )
        parts: dict[str, list[str]] = {}
        for at, name, which, text in changes:
            its = parts.setdefault(name, ["", ""])
            its[which] = text
            yield at, name, " ".join(filter(None, its))

    def _stands(self) -> Iterator[_Change]:
        """Statements on which programs stand."""
        for changes in self._programs.values():
            for (at, name, text), (then, _, _) in pairwise([*changes, (self._world.now, "", "")]):
                yield at, f"{name} program", text if then - at >= STANDS_NS else ""


def _turns(plan: Profile, since: Nanos) -> Iterator[tuple[Nanos, str]]:
    """The directions of a plan from a moment on, and its end."""
    begin, direction = plan.start, 0
    for segment, after in zip(plan.segments, plan.ends, strict=True):
        if segment.direction != direction and plan.start + after > since:
            direction = segment.direction
            yield max(begin, since), "(+)" if direction > 0 else "(−)"
        if after != inf:
            begin = plan.start + int(after)
    if plan.end is not None:
        yield max(plan.end, since), ""


def _telling(states: Iterable[frozenset[str]], most: int) -> list[frozenset[str]]:
    """At most so many, of those that take longest first."""
    told, telling, others = set[str](), list[frozenset[str]](), list[frozenset[str]]()
    for state in states:
        (telling if not told or state - told else others).append(state)
        told |= state
    return [*telling, *others][:most]


def _acting(world: Simulation) -> frozenset[str]:
    """The outputs that tell phases apart, as records call them; inputs follow from them."""
    found = {f"{name}.{output.lower()}" for name, one in world.objects.terminals.items() for output in one.outputs}
    for name, controller in world.controllers.items():
        sheet = world.kind(name).datasheet(controller)
        found |= {f"{name}.{pin.name}" for pin in sheet.pins if pin.direction is not PinDirection.INPUT}
    return frozenset(found | set(world.objects.built(BUTTON)))


def _edges(trace: Iterable[TraceRecord], acting: Collection[str]) -> Iterator[_Change]:
    """Changes of outputs."""
    for record in trace:
        if record.kind == "edge":
            name = record.subject if record.subject in acting else f"{record.controller}.{record.subject}"
            if name in acting:
                yield record.time, name, ON if record.value else ""


def _spans(changes: Iterable[_Change], begin: Nanos, end: Nanos) -> Iterator[tuple[Nanos, Nanos, frozenset[str], str]]:
    """Times without a change, with what is there and what changed before."""
    states: dict[str, str] = {}
    since, news = begin, dict[str, str]()
    for at, name, state in changes:
        if at >= end:
            break
        if states.get(name, "") == state:
            continue
        if at > since:
            yield since, at, _present(states), _named(news) if since > begin else AT_BEGIN
            since, news = at, {}
        if state or states[name] == ON:
            news[name] = state or "off"
        states[name] = state
    if end > since:
        yield since, end, _present(states), _named(news) if since > begin else AT_BEGIN


def _present(states: Mapping[str, str]) -> frozenset[str]:
    return frozenset(f"{name} {state}" for name, state in states.items() if state)


def _named(news: Mapping[str, str]) -> str:
    if not news:
        return "the program goes on"
    named = [name if state == ON else f"{name} {state}" for name, state in news.items()]
    more = f" and {len(named) - SHOWN} more" if len(named) > SHOWN else ""
    return ", ".join(named[:SHOWN]) + more
