"""The causes by which levels stay as they are: inputs that changed since, without which gates, relays and timers would change."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, TypeVar

from steptwin.controller import Nanos
from steptwin.messages import Message
from steptwin.simulation.components.brake import RELEASE, Brake
from steptwin.simulation.components.counter import DOWN, UP, Counter
from steptwin.simulation.components.cylinder import EXTEND, EXTENDED, RETRACT, Cylinder
from steptwin.simulation.components.gate import Gate
from steptwin.simulation.components.latch import RESET, SET, Latch
from steptwin.simulation.components.relay import COIL, NC, Relay
from steptwin.simulation.components.timer import IN, PULSE, Timer
from steptwin.simulation.kinds.programs import Resource, ResourceKind
from steptwin.simulation.scheduler.wires import PinName
from steptwin.why.answer import ChainLink, Cover
from steptwin.why.chain import Cause, Place, covered, nothing
from steptwin.why.lacking import HAPPENED
from steptwin.why.log import LAST
from steptwin.why.scripts import acted

ALTHOUGH = Message("why.although", "{signal} is {value:g} although {other}")
FAULT = Message("why.fault", "fault {name}: {what}")
FAULT_ACTS = Message("why.fault-acts", "fault {name}, there from the beginning, acts: {what}")
FAULT_HAS_NOT_ACTED = Message("why.fault-has-not-acted", "fault {name}, set and without effect until then: {what}")

T = TypeVar("T")
_FOLLOWED = {Relay: COIL, Brake: RELEASE}
"""The input that the outputs of an element follow after a delay."""
_DECISIVE: Mapping[str, float] = {"and": 0.0, "nand": 0.0, "or": 1.0, "nor": 1.0}
"""Level of one input of a gate that decides alone, by kind."""


class HoldingCauses:
    """Finds them. ``causes`` has those of everything else."""

    def __init__(self, causes: Any) -> None:  # Causes, which imports this module
        self._all = causes
        self._log = causes.log
        self._world = causes.log.world

    def depends(self, signals: Iterable[str]) -> bool:
        """Whether one of these signals is made of others alone."""
        parts = (self._all.parts.get(name.partition(".")[0]) for name in signals)
        return any(isinstance(part, Gate | Relay | Brake | Timer) for part in parts)

    def of(self, signals: Iterable[str], at: Nanos, since: Nanos | None) -> Iterator[Cause]:
        """The last changes after ``since`` of what keeps signals as they are at a moment; None: since the beginning."""
        floor = -1 if since is None else since
        names = list(signals)
        unchanged = names[0] if since is not None and len(names) == 1 else None
        for name, behind in self._all_keeping(names, at, floor):
            if name != unchanged and floor < self._log.begin and (behind is None or self.depends((name,))):
                self._log.lack()  # it may have changed before the log, but after that
            is_leaf = behind is None and self._log.has(name) and name.partition(".")[0] not in self._world.axes
            changed = self._log.since(name, at) if is_leaf else None
            if changed is not None and changed > floor:
                cause = covered(self._all.last((name,), at), Cover.LEVEL)
                if cause is not None:
                    yield cause
            if is_leaf:
                yield from self._all.workpieces.keeping(name, at, floor)
            for one in (name, *(self._inputs(name) if behind is None else ())):
                yield from self._although(one, at) if one == name or self._log.hold(one, at) is not None else ()

    def _inputs(self, signal: str) -> Iterator[str]:
        """The sources of the inputs of the element that has a signal."""
        owner = signal.partition(".")[0]
        part = self._all.parts.get(owner)
        for terminal in () if part is None else part.block.levels:
            if terminal not in part.block.outputs:
                yield from self._all.sources(PinName(owner, terminal))

    def _although(self, signal: str, at: Nanos) -> Iterator[Cause]:
        """The coil of a relay whose contact a fault keeps as it is, what releases a brake, or what drives an input that a fault
        holds; the last statement that set an output which one holds."""
        owner, _, terminal = signal.partition(".")
        part, level = self._all.parts.get(owner), bool(self._log.level(signal, at))
        target, closed, delay = PinName(owner, terminal if part is None else terminal.upper()), level, 0
        if part is not None and type(part) in _FOLLOWED and target.pin in part.block.outputs:
            target = PinName(owner, _FOLLOWED[type(part)])
            closed, delay = level is (terminal.upper() != NC), max(part.delays)
        elif self._log.hold(signal, at) is None:
            return
        sources = list(self._all.sources(target))
        if not sources and owner in self._world.programs:
            pin = Resource(ResourceKind.PIN, terminal)
            last = self._all.programs.written(owner, pin, self._log.last_executed(owner, at) + 1)
            if last is None:
                self._log.lack()
            else:
                yield last._replace(cover=Cover.LEVEL)
            return
        last = self._all.last(sources, at)
        if last is not None and self.level(target, at) != closed and last.place.time + delay < at:
            others = [one for one in sources if bool(self._log.level(one, at)) is not closed] or sources
            text = ALTHOUGH(signal=signal, value=self._log.level(signal, at), other=self._all.state(others[0], at))
            besides = partial(self.faults, owner, at)
            yield Cause(ChainLink(at, owner, text), Place(at, LAST, -1), lambda: covered(last, Cover.LEVEL), besides=besides)

    def faults(self, owner: str, at: Nanos, *kinds: str) -> Iterator[Cause]:
        """The fault of an element, of one of these kinds if some are given, that has acted by a moment and holds no terminal, if
        there is one only."""
        faults = self._world.objects.faults
        there = (one for one in faults.of_element(owner) if one.begin <= at and (one.end is None or at < one.end))
        acting = [one for one in there if not one.fault.kind.effect.holds and one.name in faults.acts]
        acting = [one.name for one in acting if not kinds or one.fault.kind.name in kinds]
        if len(acting) == 1 and faults.acts[acting[0]].first <= at:
            yield self.acting(acting[0], at)

    def acting(self, name: str, at: Nanos) -> Cause:
        """A fault that has acted by a moment, with the action that set it."""
        link, act = self.fault_link(name, at), self._all.fault_root(name, at).by
        place = Place(link.time) if act is None else Place(link.time, act.order, 1)
        return Cause(link, place, nothing if act is None else lambda: covered(acted(act), Cover.FAULT), Cover.FAULT)

    def fault_link(self, name: str, until: Nanos) -> ChainLink:
        """A fault as a cause, at a moment by which it has acted, or is at least set: when it began, or acted first, where no
        record says when it began."""
        record, active = self._log.fault_record(name, until), self._world.objects.faults.find(name)
        last = None if record is not None else self._log.before(f"{HAPPENED}fault {name}").since
        if last is not None and (there := self._all.of(last)) is not None:
            record = there.log.fault_record(name, last)
        root = self._all.fault_root(name, until)
        if record is not None:
            return ChainLink(record.time, record.controller, self._all.of_record(record), root)
        subject = "" if active is None else str(active.fault.get("element") or "")
        acts = self._world.objects.faults.acts.get(name)
        if active is not None and (acts is None or acts.first > until):
            return ChainLink(active.begin, subject, FAULT_HAS_NOT_ACTED(name=name, what=str(active.fault)), root)
        text = FAULT if active is None or active.begin else FAULT_ACTS
        return ChainLink(root.time, subject, text(name=name, what="" if active is None else str(active.fault)), root)

    def leaves(self, signal: str, at: Nanos) -> Iterator[str]:
        """The signals at the other ends of wires, gates, relays and timers that keep one as it is from the beginning."""
        return (name for name, behind in self._all_keeping([signal], at, -1) if behind is None)

    def _all_keeping(self, signals: Sequence[str], at: Nanos, floor: Nanos) -> Iterator[tuple[str, list[str] | None]]:
        """Signals and all that keep them as they are at a moment, each with what keeps it (`_keeping`)."""
        waiting, seen = list(signals), set[str]()
        while waiting:
            name = waiting.pop()
            if name not in seen:
                seen.add(name)
                behind = self._keeping(name, at, floor)
                waiting += behind or ()
                yield name, behind

    def _keeping(self, signal: str, at: Nanos, floor: Nanos) -> list[str] | None:
        """The signals that keep another one as it is at a moment; empty where a fault or a delay does; None for one that is not
        made of others alone."""
        owner, _, terminal = signal.partition(".")
        if self._log.hold(signal, at) is not None:
            return []
        if owner in self._world.controllers:
            return self._sources(PinName(owner, terminal), at, floor) or None
        level = bool(self._log.level(signal, at))
        match self._all.parts.get(owner):
            case Gate() as gate:
                return self._of_gate(owner, gate, at, floor)
            case Brake():
                return self._following(PinName(owner, RELEASE), level, at, floor)
            case Relay():
                return self._following(PinName(owner, COIL), level is (terminal.upper() != NC), at, floor)
            case Timer(kind=kind) if kind != PULSE:
                return self._following(PinName(owner, IN), level, at, floor)
        return None

    def _of_gate(self, owner: str, gate: Gate, at: Nanos, floor: Nanos) -> list[str]:
        """The sources of the inputs of a gate without whose levels its output would be another."""
        inputs = [PinName(owner, name) for name in gate.block.levels if name not in gate.block.outputs]
        levels = {one: self.level(one, at) for one in inputs}
        if gate.kind in _DECISIVE and _DECISIVE[gate.kind] in levels.values():
            inputs = [one for one in inputs if levels[one] == _DECISIVE[gate.kind]]
            inputs = self._enough([(one, list(self._all.sources(one))) for one in inputs], at, floor)
        return [source for one in inputs for source in self._sources(one, at, floor)]

    def deciding(self, signal: str, drivers: Sequence[str], at: Nanos) -> Sequence[str]:
        """Those of the drivers of a signal that have a part in its level at a moment: not all inputs of a gate or latch have."""
        owner = signal.partition(".")[0]
        part = self._all.parts.get(owner)
        if part is None or self._log.hold(signal, at) is not None:
            return drivers
        levels = {name: self.level(PinName(owner, name), at) for name in part.block.levels if name not in part.block.outputs}
        sets, resets = self._memory(signal, at)
        if sets or resets:  # one that is on decides; else the other ones, which would change it
            inputs = [name for name in sets if levels[name]] or resets
        elif isinstance(part, Gate) and part.kind in _DECISIVE and _DECISIVE[part.kind] in levels.values():
            inputs = [name for name, level in levels.items() if level == _DECISIVE[part.kind]]
        else:
            return drivers
        own = {source for name in inputs for source in (*self._all.sources(PinName(owner, name)), f"{owner}.{name.lower()}")}
        return [one for one in drivers if one in own]

    def _memory(self, signal: str, at: Nanos) -> tuple[Sequence[str], Sequence[str]]:
        """The inputs of an element that give an output the level that it keeps, and those that would end it; none for one that
        keeps no level by itself."""
        owner, _, terminal = signal.partition(".")
        is_on = bool(self._log.level(signal, at))
        match self._all.parts.get(owner):
            case Latch():
                return ((SET,), (RESET,)) if is_on else ((RESET,), (SET,))
            case Counter():
                return ((), (RESET, DOWN)) if is_on else ((RESET,), (UP,))
            case Cylinder(block=block) if RETRACT in block.levels:
                is_out = is_on is (terminal.upper() == EXTENDED)
                return ((EXTEND,), (RETRACT,)) if is_out else ((RETRACT,), (EXTEND,))
        return (), ()

    def remembers(self, signal: str, at: Nanos, known: dict[str, bool]) -> bool:
        """Whether a signal is as it is because of what was before: a latch, counter, valve with two coils or delay keeps it,
        or relays and gates of a ring keep each other. ``known``: of other signals, and True of those that it keeps."""
        if signal not in known:
            known[signal] = True
            behind, (sets, resets) = self._keeping(signal, at, at), self._memory(signal, at)
            owner, part = signal.partition(".")[0], self._all.parts.get(signal.partition(".")[0])
            each = isinstance(part, Gate) and _DECISIVE.get(part.kind) in [self._log.level(one, at) for one in behind or ()]
            found = (self.remembers(one, at, known) for one in behind or ())
            could_end = any(True for one in resets for _ in self._all.sources(PinName(owner, one)))
            keeps = could_end and not any(self.level(PinName(owner, one), at) for one in sets)
            is_pulse = isinstance(part, Timer) and part.kind == PULSE and self._log.level(signal, at) > 0.0
            is_delayed = is_pulse or (behind == [] and part is not None and self._is_due(owner, at))
            known[signal] = keeps or is_delayed or (bool(behind) and (all if each else any)(found))
        return known[signal]

    def _is_due(self, owner: str, at: Nanos) -> bool:
        """Whether a delay of an element may last at a moment."""
        part = self._all.parts[owner]
        sources = [one for name in part.block.levels for one in self._all.sources(PinName(owner, name))]
        changed = max((since for one in sources if (since := self._log.since(one, at)) is not None), default=None)
        return changed is not None and at < changed + max(part.delays, default=0)

    def _following(self, target: PinName, level: bool, at: Nanos, floor: Nanos) -> list[str]:
        """The sources of an input that an output follows after a delay; none while that lasts."""
        return self._sources(target, at, floor) if self.level(target, at) == float(level) else []

    def _sources(self, target: PinName, at: Nanos, floor: Nanos) -> list[str]:
        """The sources of an input that keep it as it is: of several contacts, those that are enough for its level."""
        sources, circuit = list(self._all.sources(target)), self._world.objects.circuits.get(target)
        if circuit is None or len(sources) < 2:
            return sources
        decisive = 0.0 if circuit.in_series else 1.0
        found = [one for one in sources if self._log.level(one, at) == decisive] or sources
        return self._enough([(one, [one]) for one in found], at, floor) if found is not sources else found

    def _enough(self, found: Sequence[tuple[T, Sequence[str]]], at: Nanos, floor: Nanos) -> list[T]:
        """Those of several, of which each is enough, that have been so for as long as what they keep; otherwise all."""
        lasting = [one for one, signals in found if all((self._log.since(name, at) or -1) <= floor for name in signals)]
        return lasting or [one for one, _ in found]

    def level(self, target: PinName, at: Nanos) -> float:
        """The level of an input of an element at a moment."""
        levels = [self._log.level(source, at) for source in self._all.sources(target)]
        circuit = self._world.objects.circuits.get(target)
        if circuit is not None:
            return float((all if circuit.in_series else any)(levels))
        wire = self._world.objects.scheduler_of[target.controller].wire_to(target)
        level = levels[0] if levels else 0.0
        return level if wire is None else wire.transmitted(level)
