"""Phases of the cycle of a machine: what is on and what moves, from a recorded run."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from operator import itemgetter

from steptwin.controller import SECOND, Nanos
from steptwin.datasheet import PinDirection
from steptwin.motion.divisions import StepTrain
from steptwin.motion.profile import Profile
from steptwin.simulation.components.button import BUTTON
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.world.simulation import Simulation

MOST_PHASES = 12
SHOWN = 3
"""So many changes are named where a phase begins."""


@dataclass(frozen=True, slots=True)
class CyclePhase:
    """A state of the outputs and axes of a machine. ``begin`` and ``end`` are of its longest time, ``total`` of all its times."""

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


def cycle_phases(world: Simulation, begin: Nanos = 0, most: int = MOST_PHASES) -> list[CyclePhase]:
    """The phases of what a world did from ``begin`` until now, in order; of more than ``most`` those that take longest.

    Two times are of the same phase if the same outputs of controllers, elements and buttons are on and the same axes move. The
    world has kept its trace.
    """
    spans = list(_spans(_changes(world.trace, _acting(world), world.now), begin, world.now))
    totals: dict[frozenset[str], Nanos] = {}
    longest: dict[frozenset[str], tuple[Nanos, Nanos, str]] = {}
    for at, end, state, name in spans:
        totals[state] = totals.get(state, 0) + end - at
        if state not in longest or end - at > longest[state][1] - longest[state][0]:
            longest[state] = at, end, name
    kept = sorted(totals, key=lambda state: -totals[state])[:most]
    ordered = sorted(kept, key=lambda state: longest[state][0])
    return [CyclePhase(n, *longest[state][:2], totals[state], longest[state][2]) for n, state in enumerate(ordered, start=1)]


def _acting(world: Simulation) -> frozenset[str]:
    """The outputs that tell phases apart, as records call them; inputs follow from them."""
    found = {f"{name}.{output.lower()}" for name, one in world.objects.terminals.items() for output in one.outputs}
    for name, controller in world.controllers.items():
        sheet = world.kind(name).datasheet(controller)
        found |= {f"{name}.{pin.name}" for pin in sheet.pins if pin.direction is not PinDirection.INPUT}
    return frozenset(found | set(world.objects.built(BUTTON)))


def _changes(trace: Iterable[TraceRecord], acting: Collection[str], end: Nanos) -> list[tuple[Nanos, str, bool]]:
    """Moments at which an output or axis is on, or off, from then on."""
    found: list[tuple[Nanos, str, bool]] = []
    plans: dict[str, list[tuple[Nanos, Nanos]]] = {}
    for record in trace:
        if record.kind == "edge":
            name = record.subject if record.subject in acting else f"{record.controller}.{record.subject}"
            if name in acting:
                found.append((record.time, name, bool(record.value)))
        elif record.kind == "plan":
            plan = record.value.profile if isinstance(record.value, StepTrain) else record.value
            if isinstance(plan, Profile):
                plans.setdefault(f"{record.controller}.M{record.subject} moving", []).append((record.time, _rests_at(plan, end)))
    for name, moves in plans.items():
        for (at, rest), (then, _) in pairwise([*moves, (end + 1, 0)]):
            found.append((at, name, rest > at))
            if at < rest < then:
                found.append((rest, name, False))
    return sorted(found, key=itemgetter(0))


def _rests_at(plan: Profile, end: Nanos) -> Nanos:
    """When a plan has ended, at most ``end``."""
    return end if plan.end is None or plan.end > end else plan.end


def _spans(
    changes: Iterable[tuple[Nanos, str, bool]], begin: Nanos, end: Nanos
) -> Iterator[tuple[Nanos, Nanos, frozenset[str], str]]:
    """Times without a change, with what is on and what changed before."""
    on: set[str] = set()
    since, news = begin, list[str]()
    for at, name, is_on in changes:
        if (name in on) is is_on:
            continue
        if at > since:
            yield since, at, frozenset(on), _named(news)
            since, news = at, []
        (on.add if is_on else on.discard)(name)
        if at < begin:
            continue
        news.append(f"{name}{'' if is_on else ' off'}")
    if end > since:
        yield since, end, frozenset(on), _named(news)


def _named(news: list[str]) -> str:
    if not news:
        return "at the beginning"
    more = f" and {len(news) - SHOWN} more" if len(news) > SHOWN else ""
    return ", ".join(news[:SHOWN]) + more
