"""The causes of a change, one before the other."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterator, Sequence
from functools import partial
from typing import Any

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.messages import Message, MessageText, text_of
from steptwin.motion.divisions import profile_of
from steptwin.simulation.components.elementspec import NamedSpec
from steptwin.simulation.components.logic import TerminalComponent
from steptwin.simulation.components.registry import ELEMENTS
from steptwin.simulation.components.touch import JAM
from steptwin.simulation.faults.kinds_physics import IS_BLOCKED, LOSES_PULSES
from steptwin.simulation.kinds.lines import SCRIPTS
from steptwin.simulation.kinds.programs import Resource, ResourceKind, StatementLocation, StatementUse
from steptwin.simulation.logic.expression import parse_condition, parse_expression
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.scheduler.wires import PinName
from steptwin.simulation.script import steps as do
from steptwin.simulation.script.control import Halt
from steptwin.simulation.world.inputs import Download, See, SetVariable
from steptwin.why import points
from steptwin.why.answer import ChainLink, Cover, since_before
from steptwin.why.chain import Cause, FoundCause, Place, covered, nothing, unknown
from steptwin.why.log import LAST, MOST_LOOKED_BACK, OF_MECHANICS, CauseLog, Change, sets
from steptwin.why.roots import Act, Sent
from steptwin.why.sentences import Frames, describe_input, statement

BECAME = Message("why.became", "{signal} became {value:g}{how}")
IS_SINCE = Message("why.is-since", "{signal} is {value:g} {since}{how}")
IS = Message("why.is", "{signal} is {value}")
FAULT = Message("why.fault", "fault {name}: {what}")
FOLLOWS_AFTER = Message("why.follows-after", ", {name} follows after {delay_ms:g} ms")
HAS_ACTED_SINCE = Message("why.has-acted-since", ", on which {name} has acted since")
IS_WIRED_TO = Message("why.is-wired-to", ", which is wired to {pin}")
CONTACT_OF = Message("why.contact-of", ", a contact of {pin}")
CONTACT_BOUNCED = Message("why.contact-bounced", ", and the contact bounced")
GIVES_POWER = Message("why.gives-power", ", which gives {axis} its power")
DRIVES = Message("why.drives", "[[{kind}]] in {where} drives {pin}")
CLIENT = Message("why.client", "client {client}: {meaning}")
REQUEST = Message("why.request", "request: {meaning}")
SCRIPT = Message("why.script", "script {name}: {what}")
FROM_OUTSIDE = Message("why.from-outside", "from outside: {what}")
BEGAN_TO_MOVE = Message("why.began-to-move", "{axis} began to move")
STOPPED = Message("why.stopped", "{axis} stopped")
MOTION_ENDED = Message("why.motion-ended", "the motion of {axis} ended, which began at {time:.6f} s")
WAS_EXECUTED = Message("why.was-executed", "{statement} was executed")
WAS_IN_EXECUTION = Message("why.was-in-execution", "{statement} was in execution before")
ENDED = Message("why.ended", "{statement} ended")
DECIDED = Message("why.decided", "{statement} decided")
PROGRAM_STARTED = Message("why.program-started", "the program started")
LONGEST_REACTION_NS: Nanos = 510 * MILLISECOND
"""Limit of the time after which a statement goes on when what it waits for has come: inputs may be filtered for 500 ms."""
TIME = "time"
"""States of an element that are over at a moment and are no signal."""
POSITION = "position"
OF_WORKPIECES = ("count", "crooked", "mass")
"""Signals of the workpieces on an element."""
MOST_UNDECIDED = 5000
"""Limit of the statements among which the one that decided is looked for."""


class Causes:
    """Finds the causes of changes in what was noted."""

    def __init__(self, log: CauseLog) -> None:
        self._log = log
        self._world = log.world
        self._frames = Frames(log.world)
        self._interrupts: dict[tuple[str, str], Sequence[range]] = {}
        self._uses: dict[tuple[str, StatementLocation], StatementUse] = {}
        built = log.world.objects.elements
        self._at_begin = nothing if log.is_whole else unknown
        self.is_far = False
        """Whether the chain that was followed last ends because nothing older was searched (`MOST_UNDECIDED`)."""
        every = (spec for specs in log.world.spec.elements.values() for spec in specs)
        self._specs = {spec.name: spec for spec in every if isinstance(spec, NamedSpec) and spec.name}
        self._parts: dict[str, TerminalComponent] = {
            name: part for kind, parts in built.items() if ELEMENTS[kind].terminals is not None for name, part in parts.items()
        }
        compare = ("between", "all", "sees")
        self._spatial = {
            name for name in self._parts if name in self._specs and any(getattr(self._specs[name], one, None) for one in compare)
        }

    # ------------------------------------------------------------------ signals

    def change(self, signal: str, change: Change, how: MessageText | None = None) -> Cause:
        """A signal took its value."""
        owner, place = signal.partition(".")[0], Place(change.time, change.order)
        if self._log.is_first(signal, change):
            text = IS_SINCE(signal=signal, value=change.value, since=since_before(self._log.begin), how=how or "")
            return Cause(ChainLink(change.time, owner, text), place, self._at_begin)
        text = BECAME(signal=signal, value=change.value, how=how or "")
        return Cause(ChainLink(change.time, owner, text), place, partial(self._of_change, signal, change))

    def last(self, signals: Sequence[str], until: Nanos, how: MessageText | None = None, before: int = LAST) -> FoundCause:
        """The last change among signals by a moment, before an order."""
        found = [(change, signal) for signal in signals if (change := self._log.last_change(signal, until, before))]
        if not found:
            return None
        change, signal = max(found, key=lambda one: (one[0].time, one[0].order))
        return self.change(signal, change, how)

    def power(self, axis: str, until: Nanos) -> FoundCause:
        """The last change by a moment of the output that gives the motor of an axis power; None for one that always has some."""
        power = self._world.axes[axis].spec.power
        found = None if power is None else self.last((self._name(PinName(*power)),), until, GIVES_POWER(axis=axis))
        return covered(found, Cover.MOTION)

    def moved(self, axis: str, until: Nanos, before: int = LAST, *, is_held: bool = True) -> FoundCause:
        """Cause before an order that moved the load of an axis last, or left it where it is: a motion, the power of its motor
        meanwhile, or what keeps its rotor from following the motion. ``is_held``: also what does so since before the motion."""
        built = self._world.axes[axis]
        controller, number = built.spec.drive[0], built.spec.drive[1].removeprefix("M")
        motion, power = self.motion(controller, number, until, axis, before), self.power(axis, until)
        plan = max(self._log.plans_in_force(controller, number, until, before), default=None)
        began = -1 if plan is None else plan.time
        events = list(self._of_rotor(axis, until, before))
        lasting = [one for one in events if one.time >= began or (is_held and self._holds_rotor(one, events))]
        event = max(lasting, key=lambda one: (one.time, one.order), default=None)
        is_unpowered = power is not None and (motion is None or motion.link.time < power.link.time)
        if power is not None and is_unpowered:
            plans = self._log.plans_in_force(controller, number, power.link.time)
            is_unpowered = built.mechanism.build.coasts_unpowered or any(self._end(one)[0] > power.link.time for one in plans)
        if event is not None and not (is_unpowered and power is not None and power.place > Place(event.time, event.order)):
            return self._rotor_event(axis, event)
        if is_unpowered:
            return power
        lost = self._lost_by_fault(axis, until, before, LOSES_PULSES)
        is_last = lost is not None and (motion is None or (motion.cover is None and lost.place > motion.place))
        return lost if is_last else motion

    def slipped(self, axis: str, until: Nanos, subjects: Collection[str] = OF_MECHANICS) -> FoundCause:
        """The last event by a moment after which the rotor of an axis is elsewhere than counted; its motion, if there is none."""
        events = (one for one in self._of_rotor(axis, until) if self._log.record(one).subject in subjects)
        event = max(events, key=lambda one: (one.time, one.order), default=None)
        found = None if event is None else self._rotor_event(axis, event)
        lost = self._lost_by_fault(axis, until, LAST, LOSES_PULSES, IS_BLOCKED)
        last = max((one for one in (found, lost) if one is not None), key=lambda one: one.place, default=None)
        return self.moved(axis, until) if last is None else last

    def _of_rotor(self, axis: str, until: Nanos, before: int = LAST) -> Iterator[Change]:
        """Events by a moment, before an order, after which a rotor does not follow its motion, or does again: of its motor, its
        stops, and what jams it before its motion has ended."""
        controller, name = self._world.axes[axis].spec.drive
        plans = self._log.plans_in_force(controller, name.removeprefix("M"), until, before)
        end = max((self._end(plan)[0] for plan in plans), default=0)
        jams = (one for one in self._jams(axis) if one.time <= end)
        every = (*self._log.mechanics.get(axis, ()), *jams)
        return (one for one in every if (one.time, one.order) < (until, before))

    def _jams(self, name: str) -> Iterator[Change]:
        """Events of the collisions that jam an axis or element."""
        for one, spec in self._specs.items():
            if getattr(spec, "effect", None) == JAM and f"{name}.{POSITION}" in self._followed(one):
                yield from self._log.mechanics.get(one, ())

    def _holds_rotor(self, event: Change, events: Sequence[Change]) -> bool:
        """Whether a rotor has not followed its motion since an event of it."""
        record = self._log.record(event)
        last = max((one for one in events if self._is_like(self._log.record(one), record)), key=lambda one: (one.time, one.order))
        return last is event and _begins(record)

    def _is_like(self, one: TraceRecord, other: TraceRecord) -> bool:
        return one.subject == other.subject and dict(one.facts)["element"] == dict(other.facts)["element"]

    def _rotor_event(self, axis: str, event: Change) -> Cause:
        """An event of a rotor, whose cause is what led to it."""
        record = self._log.record(event)
        owner = str(dict(record.facts)["element"])
        text = text_of(record.value if isinstance(record.value, str) else str(record.value))
        if owner == axis:
            before = partial(self._of_rotor_event, axis, event, begins=_begins(record))
        else:
            before = partial(self._of_followed, owner, event)
        return Cause(ChainLink(event.time, owner, text), Place(event.time, event.order), before, Cover.MOTION)

    def _of_rotor_event(self, axis: str, event: Change, *, begins: bool) -> FoundCause:
        """The field that a rotor followed no longer, or the command with which it follows again."""
        controller, name = self._world.axes[axis].spec.drive
        wanted = Resource(ResourceKind.AXIS, name.removeprefix("M"))
        motion = self.motion(controller, wanted.name, event.time, axis)
        if begins and motion is not None and motion.place.time == event.time:  # recorded after what it leads to at once
            return motion._replace(place=min(motion.place, Place(event.time, event.order, -1)))
        command = None if begins else self._commanded(controller, event, wanted)
        return command or self.moved(axis, event.time, event.order, is_held=begins)

    def _lost_by_fault(self, axis: str, until: Nanos, before: int, *kinds: Message) -> FoundCause:
        """The last fault by a moment, before an order, that was reported as one of ``kinds`` at an axis."""
        controller, name = self._world.axes[axis].spec.drive
        for change in reversed(self._log.faults.get(controller, ())):
            record = self._log.record(change)
            text = record.value
            if not isinstance(text, MessageText) or text.id not in {kind.id for kind in kinds}:
                continue
            if name == f"M{text.values['axis']}" and (change.time, change.order) < (until, before):
                older = self._of_fault(record, change.order)
                return Cause(self.fault_link(record), Place(change.time, change.order), older, Cover.FAULT)
        return None

    def _of_change(self, signal: str, change: Change) -> FoundCause:
        owner, _, terminal = signal.partition(".")
        fault = self._fault(owner, change, None if owner in self._parts else terminal)
        if fault is not None:
            return fault
        if owner in self._parts:
            return self._of_element(owner, change)
        if owner in self._world.controllers:
            return self._of_pin(PinName(owner, terminal), change)
        if owner in self._world.axes:
            return self.moved(owner, change.time, change.order)
        return self._of_followed(owner, change) if self._followed(owner) else self._operated(owner, change)

    def _fault(self, owner: str, change: Change, named: str | None = None) -> FoundCause:
        """A fault that began or ended at a controller or element at the moment of a change, and is recorded after it; one that
        names a terminal, if that is given."""
        for group in (self._log.group(owner), -1):
            for order, record in self._log.at(group, change.time):
                if (
                    record.kind == "fault"
                    and record.controller == owner
                    and (named is None or named in str(record.value).split())
                ):
                    link = self.fault_link(record)
                    return Cause(link, Place(record.time, change.order, -1), self._of_fault(record, order))
        return None

    def fault_link(self, record: TraceRecord) -> ChainLink:
        """Link of a record of a fault."""
        text = FAULT(name=record.subject, what=record.value)
        return ChainLink(record.time, record.controller, text, self._log.fault_root(record.subject, record.time))

    def _of_fault(self, record: TraceRecord, order: int) -> Callable[[], FoundCause]:
        """Search for the action that set or cleared a fault, unless it belongs to the description."""
        act = self._log.fault_act(record.subject, record.time, order)
        return nothing if act is None else lambda: covered(_acted(act), Cover.FAULT)

    def lasting(self, signals: Sequence[str], at: Nanos, first: FoundCause, before: int = LAST) -> FoundCause:
        """The fault that holds one of these signals at a moment, or the output to which a pin is wired, if it began to after the
        change ``first``, which is the next cause then."""
        pins = [signal for signal in signals if signal.partition(".")[0] in self._world.controllers]
        wired = [source for pin in pins for source in self.drivers(pin, at)]
        named = dict.fromkeys((*signals, *wired))
        holds = [(hold.time, signal, hold) for signal in named if (hold := self._log.hold(signal, at, before)) and hold.held]
        time, signal, hold = max(holds, default=(-1, "", None))
        if hold is None or hold.held is None or (first is not None and time <= first.link.time):
            return first
        held, place = hold.held, Place(time, hold.order)

        text = IS(signal=signal, value=held.description())
        link = ChainLink(time, signal.partition(".")[0], text, self._log.fault_root(held.fault, time))

        older = self._at_begin if first is None else lambda: covered(first, Cover.LEVEL)
        act = self._log.fault_act(held.fault, time, hold.order)
        before_it = older if act is None else partial(Cause, *_acted(act)[:2], older, Cover.FAULT)
        return Cause(link, place, before_it, Cover.FAULT)

    def of_element(self, name: str, signal: str, time: Nanos, before: int = LAST) -> FoundCause:
        """Cause before an order of a change of an element that no record shows: a collision that jams it, what drives a terminal,
        an output at the same moment, or an input."""
        part = self._parts.get(name)
        if part is not None and signal.upper() in _inputs(part):
            return self.last(list(self._sources(PinName(name, signal.upper()))), time)
        group = self._log.group(name)
        change = Change(time, 0.0, group, self._log.position(group, time), LAST)
        workpiece = self._of_workpiece(name, change)
        if workpiece is not None:
            return workpiece
        jams = [one for one in self._jams(name) if (one.time, one.order) < (time, before)] if signal == POSITION else []
        jam = next((one for one in jams if self._holds_rotor(one, jams)), None)
        if jam is not None:
            return self._rotor_event(name, jam)
        removed = next((act for act in self._log.acts_at(time, LAST) if isinstance(act.what, do.Remove)), None)
        if removed is not None and signal in OF_WORKPIECES:
            return _acted(removed)
        if part is None and self._followed(name):
            return self._of_followed(name, change)
        channels = [one for one in self._log.changes if one == name or one.startswith(f"{name}.")]
        found = None if part is None else self._of_element(name, change)
        found = self.last(channels, time) if found is None else found
        return covered(found, Cover.ACTION) if found is not None and found.cover is None else found

    def _at_element(self, name: str, change: Change) -> FoundCause:
        """Cause of an event of an element."""
        return self._fault(name, change) or self._of_element(name, change)

    def _of_workpiece(self, name: str, change: Change) -> FoundCause:
        """Event of a workpiece at an element at the moment of a change, before it, or to the only one anywhere."""
        found = [
            (order, str(dict(record.facts).get("element")), record)
            for order, record in self._log.at(change.group, change.time)
            if order < change.order and record.kind == "event" and record.subject == "workpiece"
        ]
        mine = [one for one in found if one[1] == name] or (found if len(found) == 1 else [])
        if not mine:
            return None
        order, owner, record = mine[0]
        text = text_of(record.value if isinstance(record.value, str) else str(record.value))

        act = next((act for act in self._log.acts_at(record.time, order) if _moves(act, record)), None)
        every = getattr(self._specs.get(owner), "feed_every", None)
        is_fed = act is None and ("what", "on") in record.facts and every and record.time % every == 0

        def before() -> FoundCause:
            if act is not None:
                return _acted(act)
            # What takes a workpiece from an element, or lets go of it there, acts.
            actor = str(getattr(record.value, "values", {}).get("cup", owner))
            cause = self._of_element(actor, change._replace(order=order)) if actor in self._parts else None
            # What comes onto a belt does not by what moves that.
            comes = ("what", "on") in record.facts and cause is not None and cause.place.time < record.time
            return None if comes else cause

        return Cause(ChainLink(record.time, owner, text), Place(record.time, order), nothing if is_fed else before)

    def _of_element(self, name: str, change: Change) -> FoundCause:
        """Cause of a change of an element's output: an input at the same moment, or one before, as much earlier as it delays."""
        part = self._parts[name]
        sources = [source for terminal in _inputs(part) for source in self._sources(PinName(name, terminal))]
        last = [found for source in sources if (found := self._before(source, change, change.time))]
        for delay in (0, *part.delays):
            exact = [found for found in last if found[0].time == change.time - delay]
            exact += [
                found
                for source in sources
                if (found := self._before(source, change, change.time - delay)) and found[0].time == change.time - delay
            ]
            if exact:
                latest, source = max(exact, key=lambda found: found[0].order)
                how = FOLLOWS_AFTER(name=name, delay_ms=delay / SECOND * 1000) if delay else None
                return covered(self.change(source, latest, how), Cover.DELAY)
        workpiece = self._of_workpiece(name, change)
        if workpiece is not None:
            return workpiece
        followed = (
            self._of_followed(name, change)
            if not sources or name in self._spatial or getattr(self._specs[name], "rate", None)
            else None
        )
        if followed is not None and all(followed.place > Place(one.time, one.order) for one, _ in last):
            return followed
        acts = Cover.ACTION if type(part).deadline is not TerminalComponent.deadline else None
        latest, source = max(last, key=lambda found: (found[0].time, found[0].order), default=(None, ""))
        fault = self._log.last_fault(name, change.time, change.order)
        if fault is not None and (latest is None or (fault.time, fault.order) > (latest.time, latest.order)):
            record = self._log.record(fault)
            link = self.fault_link(record)
            return Cause(link, Place(fault.time, fault.order), self._of_fault(record, fault.order), acts)
        if latest is None and len(sources) == 1 and self._log.level(sources[0], change.time):
            text = IS_SINCE(
                signal=sources[0],
                value=self._log.level(sources[0], change.time),
                since=since_before(self._log.begin),
                how=HAS_ACTED_SINCE(name=name),
            )
            link = ChainLink(self._log.begin, sources[0].partition(".")[0], text)
            return Cause(link, Place(self._log.begin), self._at_begin, acts)
        return None if latest is None else covered(self.change(source, latest, HAS_ACTED_SINCE(name=name)), acts)

    def _followed(self, name: str) -> tuple[str, ...]:
        """The signals that an element follows besides its inputs: those of its condition, what it measures, its axes."""
        spec: Any = self._specs.get(name)
        if spec is None:
            return ()
        if name in self._spatial:
            return self._moved_in_space(spec)
        when, of, rate = (getattr(spec, one, None) for one in ("when", "of", "rate"))
        axes = [getattr(spec, one, None) for one in ("axis", "other")] if not (when or of or rate) else []
        turned_by = getattr(spec, "shaft", None)
        found = [*(parse_condition(when).names() if when else ()), *([of] if of else ())]
        found += parse_expression(rate).names() if rate else ()
        found += [f"{axis}.{POSITION}" for axis in axes if axis]
        return (*dict.fromkeys(one for one in found if one != TIME), *(self._followed(turned_by) if turned_by else ()))

    def _moved_in_space(self, spec: Any) -> tuple[str, ...]:
        """The signals that move the bodies that an element compares or sees, or the belt with the workpieces."""
        described = self._world.objects.described
        names = [spec.name] if hasattr(spec, "sees") else []
        names += [name for key, name in spec.others(described) if key != "except"]
        found: dict[str, None] = {}
        for name in names:
            one: Any = self._specs.get(name)
            while one is not None:
                if one.name in self._world.axes or (one.name in self._parts and getattr(one, "moves_others", False)):
                    found[f"{one.name}.{POSITION}"] = None
                elif one.name != spec.name:
                    found |= dict.fromkeys(self._followed(one.name))
                one = self._specs.get(getattr(one, "on", None) or "")
        belts = [name for name in names if hasattr(self._specs.get(name), "feed_every")]
        return tuple(found) or tuple(f"{name}.travel" for name in belts if len(belts) == 1)

    def _of_followed(self, name: str, change: Change) -> FoundCause:
        """The last cause by a moment of what an element follows; that of the same moment, if there is one, or of an axis that
        moves then."""
        found: list[tuple[bool, bool, Cause]] = []
        for signal in self._followed(name):
            owner, _, rest = signal.partition(".")
            before = self._before(signal, change, change.time)
            if before is not None:
                cause = covered(self.change(signal, before[0]), Cover.ACTION)
            elif owner in self._world.axes:
                cause = covered(self.moved(owner, change.time, change.order), Cover.MOTION)
            elif owner in self._world.controllers:
                cause = self.at_moment(owner, change.time, Resource(ResourceKind.AXIS, ""), rest)
            else:
                cause = covered(self.of_element(owner, rest, change.time, change.order), Cover.ACTION)
            if cause is not None and cause.place < Place(change.time, change.order):
                drive = self._world.axes[owner].spec.drive if owner in self._world.axes else None
                moves = drive is not None and self._is_moving(drive[0], drive[1].removeprefix("M"), change.time)
                found.append((cause.place.time == change.time, moves, cause))
        best = max(found, key=lambda one: (one[0], one[1], one[2].place), default=None)
        return None if best is None else best[2]

    def _before(self, signal: str, change: Change, until: Nanos) -> tuple[Change, str] | None:
        """The last change of a signal by a moment and before ``change``."""
        found = self._log.last_change(signal, until, change.order)
        return None if found is None else (found, signal)

    def _sources(self, target: PinName) -> Iterator[str]:
        """The signals that drive an input: an output at the other end of a wire, or contacts."""
        circuit = self._world.objects.circuits.get(target)
        if circuit is not None:
            yield from (contact.channel for contact in circuit.contacts if contact.channel)
        for scheduler in (self._world.objects.scheduler_of[target.controller],):
            wire = scheduler.wire_to(target)
            if wire is not None:
                yield self._name(wire.source)

    def _name(self, pin: PinName) -> str:
        """The signal of a pin or terminal."""
        return str(pin) if pin.controller in self._world.controllers else f"{pin.controller}.{pin.pin.lower()}"

    def _of_pin(self, pin: PinName, change: Change) -> FoundCause:
        wire = self._world.objects.scheduler_of[pin.controller].wire_to(pin)
        if wire is not None:
            found = self._before(self._name(wire.source), change, change.time - wire.delay)
            if found is not None and found[0].time == change.time - wire.delay:
                return covered(self.change(found[1], found[0], IS_WIRED_TO(pin=str(pin))), Cover.DELAY)
        channels = [found for channel in self._sources(pin) if (found := self._before(channel, change, change.time))]
        at_once = [found for found in channels if found[0].time == change.time]
        if at_once:
            latest, channel = max(at_once, key=lambda found: found[0].order)
            return self.change(channel, latest, CONTACT_OF(pin=str(pin)))
        act = next((act for act in self._log.acts_at(change.time, change.order) if sets(act, pin)), None)
        if act is not None:
            return _acted(act)
        path = self._world.objects.driven.get(pin)
        if path is not None:
            where = self._world.spec.text.where(path)
            link = ChainLink(change.time, pin.controller, DRIVES(kind=path[0], where=where, pin=str(pin)))
            name = next((name for name, spec in self._specs.items() if spec.path == path[: len(spec.path)]), "")
            before = partial(self._of_followed, name, change) if self._followed(name) else nothing
            return Cause(link, Place(change.time, change.order, -1), before)
        return self.in_controller(pin.controller, change, Resource(ResourceKind.PIN, pin.pin))

    def _operated(self, name: str, change: Change) -> FoundCause:
        """Who pressed a button."""
        for act in self._log.acts_at(change.time, change.order):
            match act.what:
                case do.Press(button) | do.Release(button) if button == name:
                    return _acted(act)
        earlier = self._log.last_change(name, change.time - 1)
        if earlier is not None and change.time - earlier.time < SECOND:
            return covered(self.change(name, earlier, CONTACT_BOUNCED()), Cover.BOUNCE)
        return None

    def drivers(self, signal: str, at: Nanos) -> list[str]:
        """The signals that a signal follows at a moment: those that drive an input, or the inputs of an element; an input of an
        element that a fault holds stands for what drives it."""
        if self._log.hold(signal, at) is not None:
            return []
        owner, _, terminal = signal.partition(".")
        part = self._parts.get(owner)
        if part is not None:
            return [source for name in _inputs(part) for source in self._held_or_sources(owner, name, at)]
        return list(self._sources(PinName(owner, terminal))) if owner in self._world.controllers else []

    def _held_or_sources(self, owner: str, terminal: str, at: Nanos) -> Iterator[str]:
        signal = f"{owner}.{terminal.lower()}"
        if self._log.hold(signal, at) is None:
            yield from self._sources(PinName(owner, terminal))
        else:
            yield signal

    # ------------------------------------------------------------------ controllers

    def at_moment(self, controller: str, time: Nanos, wanted: Resource | None, point: str = "") -> FoundCause:
        """Cause of a change in a controller that no record shows; ``point``: of that point of it."""
        group = self._log.group(controller)
        found = self.in_controller(controller, Change(time, 0.0, group, self._log.position(group, time), LAST), wanted, point)
        if found is None and wanted is not None:
            return self.motion(controller, wanted.name, time)
        return found

    def in_controller(self, controller: str, change: Change, wanted: Resource | None, point: str = "") -> FoundCause:
        """Cause of a change in a controller at a moment; ``wanted``: the resource, if it is known; ``point``: that changed."""
        commanded = self._commanded(controller, change, wanted, point)
        if commanded is not None:
            return commanded
        return self._asked_before(controller, change) or self._inside(controller, change, wanted)

    def _commanded(self, controller: str, change: Change, wanted: Resource | None, point: str = "") -> FoundCause:
        """A statement, request or action at the moment of a change in a controller."""
        index = self._statement_at(controller, change, wanted)
        since = -1 if index is None else self._log.executed[controller][index].order
        outside = self._from_outside(controller, change, since, point)
        if outside is not None:
            return outside
        if index is not None:
            return self.statement(controller, index)
        act = next((act for act in self._log.acts_at(change.time, change.order) if _changes(act, controller)), None)
        return None if act is None else _acted(act)

    def _statement_at(self, controller: str, change: Change, wanted: Resource | None) -> int | None:
        """The number of the statement that was executed at the moment of a change, before it, and changes what is wanted."""
        executed = self._log.executed[controller]
        for index in range(self._log.last_executed(controller, change.time), -1, -1):
            if executed[index].time < change.time:
                break
            if executed[index].order < change.order:
                return index if _matches(self.use(controller, index).writes, wanted) else None
        return None

    def _from_outside(self, controller: str, change: Change, since: int, point: str) -> FoundCause:
        """A request or another action that reached a controller at the moment of a change, after the order ``since``: the last
        that names the point that changed, or the last of all."""
        found: list[Cause] = []
        on = self._world.objects.line_of.get(controller)
        for order, record in self._log.at(change.group, change.time):
            if order < since:
                break
            if order >= change.order:
                continue
            if (
                on is not None
                and record.kind == "frame"
                and record.controller == on[0].name
                and self._frames.reaches(record, on[1])
            ):
                found.append(self._frame(record, order))
            elif record.controller == controller and record.kind == "input":
                found.append(self._input(record, order))
        return next((one for one in found if point and _name_of(point).search(one.link.text)), next(iter(found), None))

    def _inside(self, controller: str, change: Change, wanted: Resource | None) -> FoundCause:
        """Cause of an act of the controller itself: an input, or the end of what an earlier statement began."""
        inputs: list[tuple[int, str]] = []
        event: tuple[int, TraceRecord] | None = None
        for order, record in self._log.at(change.group, change.time):
            if order >= change.order or record.controller != controller:
                continue
            if record.kind == "edge" and self._is_input(PinName(controller, record.subject)):
                inputs.append((order, f"{controller}.{record.subject}"))
            elif record.kind == "event" and record.subject != "workpiece":
                event = order, record
        limit = change.order if event is None else event[0]
        last = max((one for one in inputs if one[0] < limit), default=None)

        def before() -> FoundCause:
            if last is None:
                return self._earlier(controller, change.time, wanted)
            edge = next(one for one in self._log.changes[last[1]] if one.order == last[0])
            return self.change(last[1], edge)

        if event is None:
            return self._fault(controller, change) or self._ended(controller, change.time, wanted) or before()
        order, record = event
        element = str(dict(record.facts).get("element"))
        if element in self._parts:  # such as a supply that is off
            before = partial(self._at_element, element, change._replace(order=order))
        text = text_of(record.value if isinstance(record.value, str) else str(record.value))
        return Cause(ChainLink(change.time, controller, text), Place(change.time, order), before)

    def _ended(self, controller: str, time: Nanos, wanted: Resource | None) -> FoundCause:
        """The motion of an axis that ended at a moment."""
        if wanted is None or wanted.kind is not ResourceKind.AXIS:
            return None
        ended = (
            self._end(plan)[0] == time for plan in self._log.plans_in_force(controller, wanted.name, time) if plan.time < time
        )
        return self.motion(controller, wanted.name, time) if any(ended) else None

    def _asked_before(self, controller: str, change: Change) -> FoundCause:
        """A request on a line with timing, which is answered later than it came."""
        on = self._world.objects.line_of.get(controller)
        if on is None or not on[0].is_timed:
            return None
        records = self._log.records[change.group]
        for position in range(change.position - 1, max(-1, change.position - MOST_LOOKED_BACK), -1):
            record = records[position]
            if record.kind == "frame" and record.controller == on[0].name:
                found = self._frame(record, self._log.order(change.group, position))
                return covered(found, Cover.FRAME) if self._frames.reaches(record, on[1]) else None
        return None

    def _earlier(self, controller: str, time: Nanos, wanted: Resource | None) -> FoundCause:
        """The last statement before a moment that changes something: what it began has ended."""
        if wanted is None:
            return None
        executed = self._log.executed[controller]
        last = self._log.last_executed(controller, time)
        for index in range(last, max(-1, last - MOST_LOOKED_BACK), -1):
            use = self.use(controller, index)
            if executed[index].time < time and _matches(use.writes, wanted):
                is_waiting = use.waits and (index == last or executed[index + 1].time >= time)
                is_of_axis = wanted.kind is ResourceKind.AXIS and self._is_moving(controller, wanted.name, time)
                return covered(self.statement(controller, index), Cover.WAIT if use.lasts or is_waiting or is_of_axis else None)
        return None

    def _is_moving(self, controller: str, axis: str, time: Nanos) -> bool:
        """Whether an axis moves until a moment, or longer."""
        return any(self._end(plan)[0] >= time for plan in self._log.plans_in_force(controller, axis, time))

    def _is_input(self, pin: PinName) -> bool:
        return pin in self._world.objects.driven or pin in self._world.objects.circuits

    def _frame(self, record: TraceRecord, order: int) -> Cause:
        client, place = record.subject.rpartition("/")[0], Place(record.time, order)
        meaning = self._frames.meaning(record)
        if client == SCRIPTS:
            link = ChainLink(record.time, record.controller, REQUEST(meaning=meaning))
            return Cause(link, place, partial(self._requested, record, order))
        sent = Sent(record.time, record.controller, client)
        return Cause(ChainLink(record.time, record.controller, CLIENT(client=client, meaning=meaning), sent), place, nothing)

    def _requested(self, record: TraceRecord, order: int) -> FoundCause:
        """The step that made a request, which a line with timing carries later."""
        members = {name for name, (line, _) in self._world.objects.line_of.items() if line.name == record.controller}
        meaning = self._frames.meaning(record)
        acts = [act for act in self._log.acts_before(record.time, order) if _requests(act, record.controller, members)]
        act = next((act for act in acts if _names(act, meaning)), next(iter(acts), None))
        return None if act is None else covered(_acted(act), Cover.FRAME)

    def _input(self, record: TraceRecord, order: int) -> Cause:
        act = next(self._log.acts_at(record.time, order), None)
        if act is not None:
            return _acted(act)
        link = ChainLink(record.time, record.controller, FROM_OUTSIDE(what=f"{record.subject} {record.value}"))
        return Cause(link, Place(record.time, order), nothing)

    # ------------------------------------------------------------------ motions

    def motion(self, controller: str, axis: str, until: Nanos, mechanics: str = "", before: int = LAST) -> FoundCause:
        """The motion of an axis at a moment, begun before an order; of all axes the one that ends last, if ``axis`` is empty."""
        plan = max(self._log.plans_in_force(controller, axis, until, before), key=self._end, default=None)
        if plan is None:
            return None
        record = self._log.record(plan)
        profile = profile_of(record.plan())
        name = f"{controller}.M{record.subject}"
        shown = f"{mechanics} ({name})" if mechanics else name
        is_before = not self._log.is_whole and plan.time == self._log.begin
        if is_before and profile.start < plan.time and profile.segments:
            return Cause(
                ChainLink(profile.start, controller, BEGAN_TO_MOVE(axis=shown)), Place(profile.start), unknown, Cover.MOTION
            )
        if is_before and not profile.segments:
            return None
        place = Place(plan.time, plan.order)
        cover: Cover | None = None
        if not profile.segments:
            text = STOPPED(axis=shown)
        elif profile.end is not None and profile.end <= until:
            text, place = MOTION_ENDED(axis=shown, time=plan.time / SECOND), max(place, Place(profile.end))
        else:
            text, cover = BEGAN_TO_MOVE(axis=shown), Cover.MOTION

        def planned() -> FoundCause:
            found = self.in_controller(controller, plan, Resource(ResourceKind.AXIS, record.subject))
            if found is None or found.place.time < plan.time:
                found = self._turned(controller, record.subject, plan) or found
            return covered(found, Cover.MOTION)

        return Cause(ChainLink(place.time, controller, text), place, planned, cover)

    def _turned(self, controller: str, number: str, plan: Change) -> FoundCause:
        """The thing that turned the encoder that an axis follows by the moment of a plan: another axis, a motor, a hand."""
        for axis in self._world.axes.values():
            if axis.spec.drive != (controller, f"M{number}"):
                continue
            follows = getattr(axis.spec.encoder, "follows", None)
            if follows in self._world.axes:
                return self.moved(follows, plan.time, plan.order)
            if follows in self._parts:
                return self.of_element(follows, "", plan.time)
        acts = self._log.acts_before(plan.time, plan.order)
        turned = (
            act
            for act in acts
            if isinstance(act.what, do.Turn) and (act.what.controller, act.what.axis) == (controller, int(number))
        )
        act = next(turned, None)
        return None if act is None else _acted(act)

    def _end(self, plan: Change) -> tuple[float, Nanos]:
        """When the motion of a plan ends, which may be never; of several at once, the one planned last."""
        profile = profile_of(self._log.record(plan).plan())
        if not profile.segments:
            return plan.time, plan.time
        return math.inf if profile.end is None else profile.end, plan.time

    # ------------------------------------------------------------------ programs

    def use(self, controller: str, index: int) -> StatementUse:
        """Reads and changes of an executed statement; none if its text was replaced since."""
        executed = self._log.executed[controller][index]
        if not self._log.is_of_present_text(executed):
            return StatementUse()
        key = controller, executed.location
        found = self._uses.get(key)
        if found is None:
            found = self._uses[key] = self._world.programs[controller].use(key[1])
        return found

    def statement(self, controller: str, index: int) -> Cause:
        """A statement was executed."""
        executed = self._log.executed[controller][index]
        text, place = statement(self._log, executed), Place(executed.time, executed.order, 3 * index + 1)
        if self._log.is_in_progress(executed):
            return Cause(ChainLink(executed.time, controller, WAS_IN_EXECUTION(statement=text)), place, unknown)
        link = ChainLink(executed.time, controller, WAS_EXECUTED(statement=text))
        return Cause(link, place, partial(self._of_executed, controller, index))

    def _of_executed(self, controller: str, index: int) -> FoundCause:
        """Value that a statement reads, if it has changed since the last execution, so that another one was written, or of the
        first execution since that was decided; otherwise what let it be executed."""
        use = self.use(controller, index)
        reads = [one for one in use.reads if one not in use.writes]
        if not reads or not use.writes or use.waits:
            return self._of_statement(controller, index)
        before, decided = self._executed_before(controller, index), None
        here, since = self._log.executed[controller][index], Place(-1)
        if before is None:
            decided = self._of_statement(controller, index)
            since = Place(here.time) if decided is None else decided.place
        else:
            last = self._log.executed[controller][before]
            since = Place(last.time, last.order, 3 * before + 2)
        found = [cause for one in reads if (cause := self.resource(controller, one, index, here.time, here.order))]
        changed = max((cause for cause in found if cause.place > since), key=lambda cause: cause.place, default=None)
        if changed is not None:
            return covered(changed, Cover.LEVEL)
        return self._of_statement(controller, index) if decided is None else decided

    def _executed_before(self, controller: str, index: int) -> int | None:
        """The number of the execution of a statement before this one."""
        locations = self._log.executed[controller].locations
        here = locations[index]
        return next((one for one in range(index - 1, max(-1, index - MOST_LOOKED_BACK), -1) if locations[one] == here), None)

    def _handlers(self, controller: str, text: str) -> Sequence[range]:
        """The statements of each interrupt of a text, with the one that it begins with."""
        key = controller, text
        if key not in self._interrupts:
            programs = self._world.programs[controller]
            found = [programs.use(StatementLocation(text, number)) for number in programs.labels(text).values()]
            self._interrupts[key] = [range(use.governs.start - 1, use.governs.stop) for use in found if use.waits and use.governs]
        return self._interrupts[key]

    def _of_statement(self, controller: str, index: int) -> FoundCause:
        """The wait or condition that let a statement be executed."""
        executed = self._log.executed[controller]
        number = executed[index].location.number
        at_once, after = self._world.programs[controller].statement_time, index
        is_present = self._log.is_of_present_text(executed[index])
        handlers = self._handlers(controller, executed[index].location.text) if is_present else ()
        for earlier in range(index - 1, max(-1, index - MOST_UNDECIDED), -1):
            use, here, ended = self.use(controller, earlier), executed[earlier], executed[after]
            if any(here.location.number in handler and number not in handler for handler in handlers):
                continue  # an interrupt that came and returned
            if use.jumps is not None and ended.location.number == use.jumps <= number:
                number = here.location.number
            if use.waits and ended.time - here.time > at_once:
                return self._decided(controller, earlier, Place(ended.time, ended.order, 3 * after), ENDED)
            if number in use.governs or (use.is_loop and ended.location.number >= use.governs.stop):
                return self._decided(controller, earlier, Place(here.time, here.order, 3 * earlier + 2), DECIDED)
            after = earlier
        self.is_far = index >= MOST_UNDECIDED
        return None if self.is_far else self._started(controller)

    def _decided(self, controller: str, index: int, place: Place, how: Message) -> Cause:
        executed, use = self._log.executed[controller][index], self.use(controller, index)
        if use.is_loop:  # its condition is written where it begins
            executed = executed._replace(location=executed.location._replace(number=use.governs.start - 1))
        link = ChainLink(place.time, controller, how(statement=statement(self._log, executed)))
        ended = self._of_wait if how is ENDED else self._of_decision
        return Cause(link, place, partial(ended, controller, index, place), Cover.PROGRAM)

    def _read(self, controller: str, index: int, place: Place) -> Iterator[Cause]:
        """The last changes of what a statement reads."""
        for resource in self.use(controller, index).reads:
            cause = self.resource(controller, resource, index, place.time, place.order)
            if cause is not None:
                yield cause

    def _of_decision(self, controller: str, index: int, place: Place) -> FoundCause:
        """Change by which what a condition reads has had its value since."""
        last = max(self._read(controller, index, place), key=lambda cause: cause.place, default=None)
        return self._of_statement(controller, index) if last is None else covered(last, Cover.LEVEL)

    def _of_wait(self, controller: str, index: int, place: Place) -> FoundCause:
        """Change that a statement waited for, which came while it did, at most `LONGEST_REACTION_NS` before its end. A wait for a
        time depends on what led to it."""
        reads = self.use(controller, index).reads
        if all(resource.kind is ResourceKind.VALUE for resource in reads):
            began = self._log.executed[controller][index]
            came = [
                cause for cause in self._read(controller, index, place) if cause.place > Place(began.time, began.order, 3 * index)
            ]
            last = max(came, key=lambda cause: cause.place, default=None)
            return covered(last or self._of_statement(controller, index), Cover.WAIT)
        latest = place.time - LONGEST_REACTION_NS
        passes = any(resource.kind is ResourceKind.AXIS and resource.name for resource in reads)  # a place, not the end
        came = [
            cause
            for cause in self._read(controller, index, place)
            if (passes if cause.cover is Cover.MOTION else cause.place.time >= latest)
        ]
        return covered(max(came, key=lambda cause: cause.place, default=None), Cover.WAIT)

    def resource(self, controller: str, resource: Resource, index: int, time: Nanos, before: int = LAST) -> FoundCause:
        """The last change of what a statement reads by a moment, before an order."""
        match resource.kind:
            case ResourceKind.PIN:
                every = [name for name in self._log.changes if name.startswith(f"{controller}.")]
                read = [f"{controller}.{resource.name}"] if resource.name else every
                return self.lasting(read, time, self.last(read, time, before=before), before)
            case ResourceKind.AXIS:
                return self.motion(controller, resource.name, time, before=before)
            case ResourceKind.VALUE:
                written = self._register(controller, resource, time, before)
                if written is not None:
                    return written
                for earlier in range(index - 1, max(-1, index - MOST_LOOKED_BACK), -1):
                    if resource in self.use(controller, earlier).writes:
                        return covered(self.statement(controller, earlier), Cover.LEVEL)
        return None

    def _register(self, controller: str, resource: Resource, time: Nanos, before: int) -> FoundCause:
        """The last change of a register of a controller that a program has a name for, by a moment, before an order."""
        point = self._world.programs[controller].point(resource.name)
        series = None if point is None else self._log.points.series(f"{controller}.{point}")
        since = None if series is None else points.since(series, time)
        if point is None or since is None:
            return None
        group = self._log.group(controller)
        change = Change(since, 0.0, group, self._log.position(group, since), before if since == time else LAST)
        return covered(self.in_controller(controller, change, resource, point), Cover.LEVEL)

    def _started(self, controller: str) -> FoundCause:
        """The statement that was executed first."""
        if not self._log.is_whole:
            return None
        first = self._log.executed[controller][0]
        return Cause(ChainLink(first.time, controller, PROGRAM_STARTED()), Place(first.time, first.order), nothing, Cover.PROGRAM)


def _begins(record: TraceRecord) -> bool:
    """Whether a rotor does not follow its motion from an event on."""
    return any(dict(record.facts).get(one) is True for one in ("stalled", "pushes", "touches"))


def _inputs(part: TerminalComponent) -> list[str]:
    return [terminal for terminal in part.block.levels if terminal not in part.block.outputs]


def _matches(writes: Sequence[Resource], wanted: Resource | None) -> bool:
    """Whether a statement changes what is wanted. An empty name is any of its kind."""
    if wanted is None:
        return bool(writes)
    return any(one.kind is wanted.kind and (one.name in ("", wanted.name) or not wanted.name) for one in writes)


def _acted(act: Act) -> Cause:
    what = describe_input(act.what)
    text = SCRIPT(name=act.script, what=what) if act.script else FROM_OUTSIDE(what=what)
    return Cause(ChainLink(act.time, act.script or "outside", text, act), Place(act.time, act.order), nothing)


def _names(act: Act, meaning: str) -> bool:
    """Whether an action writes what a request is about."""
    match act.what:
        case do.Write(values):
            return any(_name_of(name).search(meaning) for _, name, _ in values)
    return False


def _name_of(point: str) -> re.Pattern[str]:
    """Pattern of a point in the words of a request."""
    return re.compile(rf"(?<!\w){re.escape(point.partition(':')[0])}(?!\w)", re.IGNORECASE)


def _requests(act: Act, line: str, members: Collection[str]) -> bool:
    """Whether an action sends something over a line."""
    match act.what:
        case do.Write(values):
            return any(controller in members for controller, *_ in values)
        case do.Request() | do.Send() as what:
            return what.line == line
    return False


def _moves(act: Act, record: TraceRecord) -> bool:
    """Whether somebody has put a workpiece there."""
    facts = dict(record.facts)
    return isinstance(act.what, do.Put) and facts["what"] == "on" and str(facts["workpiece"]).startswith(f"{act.what.on}.")


def _changes(act: Act, controller: str) -> bool:
    match act.what:
        case do.PowerCycle() | do.Turn() | SetVariable() | Download() | See() | Halt() as what:
            return what.controller == controller
        case do.Write(values):
            return any(name == controller for name, *_ in values)
    return False
