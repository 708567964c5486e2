"""The causes of a change, one before the other."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial, reduce

from steptwin.controller import SECOND, Nanos
from steptwin.messages import Message, MessageText
from steptwin.simulation.components.button import BUTTON
from steptwin.simulation.components.conveyortable import FEED
from steptwin.simulation.components.elementspec import NamedSpec
from steptwin.simulation.components.logic import TerminalComponent
from steptwin.simulation.components.registry import ELEMENTS
from steptwin.simulation.kinds.programs import Resource, ResourceKind
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.scheduler.wires import PinName
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.actions import is_release
from steptwin.why.answer import ChainLink, Cover, since_before
from steptwin.why.attempts import Attempts
from steptwin.why.axes import AxisCauses
from steptwin.why.chain import Cause, FoundCause, Place, covered, nothing, unknown
from steptwin.why.changes import SignalChanges
from steptwin.why.controllers import ControllerCauses
from steptwin.why.elements import ElementCauses, inputs
from steptwin.why.holding import FAULT, HoldingCauses
from steptwin.why.interrupts import InterruptCauses
from steptwin.why.lacking import NEVER
from steptwin.why.log import LAST, CauseLog, Change, sets
from steptwin.why.programs import ProgramCauses
from steptwin.why.roots import Act, SetFault
from steptwin.why.scripts import ScriptCauses, acted
from steptwin.why.workpieces import IS_WIRED_TO, WorkpieceCauses

BECAME = Message("why.became", "{signal} became {value:g}{how}")
BY = Message("why.by", " by {name}{how}")
IS_SINCE = Message("why.is-since", "{signal} is {value:g} {since}{how}")
IS_HELD = Message("why.is-held", "{signal} is {held} since {time:.6f} s")
SINCE = Message("why.since", "since {time:.6f} s")
DRIVEN_BY = Message("why.driven-by", ", driven by {names}")
OVER_INVERTED_WIRE = Message("why.over-inverted-wire", "{driven} over an inverted wire")
IS_WIRED_INVERTED = Message("why.is-wired-inverted", ", which is wired to {pin} and inverted there")
ALTERED = Message("why.altered", "{fault}, in: {request}")
AND = Message("why.and", "{one} and {other}")
IS = Message("why.is", "{signal} is {value}")
NOTHING_IS_WIRED = Message("why.nothing-is-wired", ", to which nothing is wired")
NO_STATEMENT_SETS = Message("why.no-statement-sets", ", which no statement of its program sets")
NOTHING_HAS_SET = Message("why.nothing-has-set", ", which nothing has set")
NOBODY_PRESSED = Message("why.nobody-pressed", ", not pressed until then")
PRESSED_BY = Message("why.pressed-by", ", pressed by script {script}")
PRESSED_FROM_OUTSIDE = Message("why.pressed-from-outside", ", pressed from outside")
CONTACT_OF = Message("why.contact-of", ", a contact of {pin}")
OF = Message("why.of", " of {pin}")
NORMALLY_CLOSED = Message("why.normally-closed", ", a normally closed contact{how}")
INVERTED = Message("why.inverted", ", an inverted input{how}")
CONTACT_BOUNCED = Message("why.contact-bounced", ", and the contact bounced")
DRIVES = Message("why.drives", "[[{kind}]] in {where} drives {pin}")


class Causes:
    """Finds the causes of changes in what was noted. ``others``: those of a moment that another log has."""

    def __init__(self, log: CauseLog, others: Callable[[Nanos], Causes | None] = lambda moment: None) -> None:
        self.log = log
        self._others = others
        world = self._world = log.world
        built = world.objects.elements
        every = (spec for specs in world.spec.elements.values() for spec in specs)
        self.specs = {spec.name: spec for spec in every if isinstance(spec, NamedSpec) and spec.name}
        self.parts: dict[str, TerminalComponent] = {
            name: part for kind, parts in built.items() if ELEMENTS[kind].terminals is not None for name, part in parts.items()
        }
        circuits = world.objects.circuits.values()
        self.contacts = {one.channel: one for circuit in circuits for one in circuit.contacts if one.channel}
        self.axes, self.attempts = AxisCauses(self), Attempts(self)
        self.programs, self.interrupts = ProgramCauses(self), InterruptCauses(self)
        self.controllers, self.elements = ControllerCauses(self), ElementCauses(self)
        self.workpieces, self.scripts, self.changes = WorkpieceCauses(self), ScriptCauses(self), SignalChanges(self)
        self.holding = HoldingCauses(self)

    def of(self, moment: Nanos) -> Causes | None:
        """Causes of what was at a moment; None as long as nothing of it is noted."""
        return self if self.log.covers(moment) else self._others(moment)

    @property
    def at_begin(self) -> Callable[[], FoundCause]:
        """The end of a chain at the beginning of the log."""
        return nothing if self.log.reaches_begin() else unknown

    def change(self, signal: str, change: Change, how: MessageText | None = None) -> Cause:
        """A signal took its value."""
        owner, place = signal.partition(".")[0], Place(change.time, change.order)
        if self.log.is_first(signal, change):
            return self.first(signal, how, place)
        is_forced = any(
            self.log.hold(signal, one) is not None for one in (change.time, change.time - 1)
        )  # a fault began or ended
        seen = () if is_forced else self.log.meetings.seen.get((signal, change.time), ())
        words = self._as_it_is(signal, how)
        words = BY(name=seen[0], how=words) if len(seen) == 1 else words  # of a beam or sensor
        text = BECAME(signal=signal, value=change.value, how=words)
        return Cause(ChainLink(change.time, owner, text), place, partial(self._of_change, signal, change))

    def _as_it_is(self, signal: str, how: MessageText | str | None) -> MessageText | str:
        """Words behind a level, after those for a contact or input that has the other level than usual."""
        owner, _, pin = signal.partition(".")
        if signal in self.contacts:
            return NORMALLY_CLOSED(how=how or "") if self.contacts[signal].normally_closed else how or ""
        is_pin = owner in self._world.controllers
        is_inverted = is_pin and self._world.kind(owner).is_inverted(self._world.controller(owner), pin)
        return INVERTED(how=how or "") if is_inverted else how or ""

    def state(self, signal: str, at: Nanos) -> MessageText:
        """The level of a signal at a moment, since when, and what drives it."""
        hold, drivers, since = self.log.hold(signal, at), self.drivers(signal, at), self.log.since(signal, at)
        if hold is not None and hold.held is not None:
            return IS_HELD(signal=signal, held=hold.held.description(), time=hold.time / SECOND)
        when = since_before(self.log.before(signal).known_from) if since is None else SINCE(time=since / SECOND)
        driven: MessageText | str = ""
        if drivers:
            driven = self._driven_by(signal, drivers)
        elif since is None:
            driven = self.undriven(signal) or ""
        how = self._as_it_is(signal, driven or self._pressed(signal, at))
        return IS_SINCE(signal=signal, value=self.log.level(signal, at), since=when, how=how)

    def _pressed(self, signal: str, at: Nanos) -> MessageText | str:
        """Who presses a button at a moment."""
        button, contact = self._world.objects.built(BUTTON).get(signal), self.contacts.get(signal)
        if button is None or contact is None or bool(self.log.level(signal, at)) is contact.normally_closed:
            return ""
        last = self.last((signal,), at)
        by = None if last is None else last.before()
        act = None if by is None else by.link.root
        if not isinstance(act, Act):
            return ""
        return PRESSED_BY(script=act.by) if act.by else PRESSED_FROM_OUTSIDE()

    def _driven_by(self, signal: str, drivers: Sequence[str]) -> MessageText:
        driven = DRIVEN_BY(names=reduce(lambda one, other: AND(one=one, other=other), drivers))
        return OVER_INVERTED_WIRE(driven=driven) if self._is_inverted_wire(signal) else driven

    def _is_inverted_wire(self, signal: str) -> bool:
        """Whether an inverted wire drives an input of a controller or element."""
        owner, _, terminal = signal.partition(".")
        scheduler = self._world.objects.scheduler_of.get(owner)
        wire = None if scheduler is None else scheduler.wire_to(PinName(owner, terminal.upper()))
        return wire is not None and wire.inverted

    def unchanged(self, signal: str, place: Place) -> Cause:
        """A signal is at a place as it has been from the beginning, along with the contacts that keep it so."""
        time, order, number = place
        link = ChainLink(time, signal.partition(".")[0], self.state(signal, time))
        return Cause(link, place, nothing, besides=partial(self._kept, signal, Place(time, order, number - 1)))

    def _kept(self, signal: str, place: Place) -> Iterator[Cause]:
        """The contacts and outputs from the beginning that keep a signal as it has been from the beginning; of an output what its
        program has not come to; of a switch of an axis what has left that where it is."""
        owner, _, pin = signal.partition(".")
        for name in self.holding.leaves(signal, place.time):
            is_kept = name in self.contacts or name.partition(".")[0] in self._world.controllers
            if is_kept and name != signal and self.log.since(name, place.time) is None:
                yield self.unchanged(name, place)
        found = self.axes.moved(owner, place.time, place.order) if owner in self._world.axes else None
        if owner in self._world.controllers:
            found = self.programs.before(owner, Resource(ResourceKind.PIN, pin), place.time)
        if found is not None:
            yield from (one._replace(cover=one.cover or Cover.LEVEL) for one in (found, *found.along))

    def undriven(self, signal: str) -> MessageText | None:
        """Reason why a signal that has not changed cannot change by itself; None where it can."""
        owner, _, pin = signal.partition(".")
        if owner not in self._world.controllers:
            if owner in self.parts and pin.upper() in inputs(self.parts[owner]):
                return NOTHING_IS_WIRED()
            is_unpressed = signal in self._world.objects.built(BUTTON) and self.log.before(signal) == NEVER
            return NOBODY_PRESSED() if is_unpressed else None
        terminals, programs = self._world.kind(owner).terminals, self._world.programs.get(owner)
        is_written = programs is not None and self.programs.is_written(owner, Resource(ResourceKind.PIN, pin))
        if pin not in self._world.controllers[owner].pins() or is_written or PinName(owner, pin) in self._world.objects.driven:
            return None
        if pin in (*terminals.digital_inputs, *terminals.analog_inputs):
            return NOTHING_IS_WIRED()
        if programs is not None and programs.texts:
            return NO_STATEMENT_SETS()
        return NOTHING_HAS_SET() if self.log.before(signal) == NEVER else None

    def first(self, signal: str, how: MessageText | None = None, place: Place | None = None) -> Cause:
        """A signal has not changed in the log: its last change before that, or its level from the beginning, at a place."""
        known = self.log.before(signal)
        earlier = None if known.since is None else self.last((signal,), known.since, how)
        if earlier is not None:
            return earlier
        value, place = self.log.level(signal, self.log.begin), place or Place(known.known_from)
        drivers = self.drivers(signal, place.time) if how is None else ()
        how = self._driven_by(signal, drivers) if drivers else how
        text = IS_SINCE(signal=signal, value=value, since=since_before(known.known_from), how=self._as_it_is(signal, how))
        link, by = ChainLink(place.time, signal.partition(".")[0], text), place._replace(number=place.number - 1)
        return (
            Cause(link, place, nothing, besides=partial(self._kept, signal, by))
            if known == NEVER
            else Cause(link, place, unknown)
        )

    def last(self, signals: Sequence[str], until: Nanos, how: MessageText | None = None, before: int = LAST) -> FoundCause:
        """The last change among signals by a moment, before an order."""
        there = self.of(until)
        if there is not self:
            return None if there is None else there.last(signals, until, how, before)
        found = [(change, signal) for signal in signals if (change := self.log.last_change(signal, until, before))]
        if not found:
            times = [since for signal in signals if (since := self.log.before(signal).since) is not None]
            return self.last(signals, max(times), how) if times else None
        change, signal = max(found, key=lambda one: (one[0].time, one[0].order))
        return self.change(signal, change, how)

    def _of_change(self, signal: str, change: Change) -> FoundCause:
        owner, _, terminal = signal.partition(".")
        fault = self.fault(owner, change, None if owner in self.parts else terminal)
        ended = self._cleared(signal, change) if fault is None else fault
        if ended is not None:
            older = (one for one in self._older_fault(signal, change.time) if one.link.root != ended.link.root)
            return ended._replace(along=(*ended.along, *older))
        first = self._bounce_of(signal, change)
        if first is not change:
            return covered(self.change(signal, first, CONTACT_BOUNCED()), Cover.BOUNCE)
        if owner in self.parts:
            return self.elements.of_inputs(owner, change, signal)
        if owner in self._world.controllers:
            return self._of_pin(PinName(owner, terminal), change)
        if owner in self._world.axes:
            return self.axes.moved(owner, change.time, change.order)
        return self.elements.of_followed(owner, change) if self.elements.followed(owner) else self._operated(owner, change)

    def fault(self, owner: str, change: Change, named: str | None = None) -> FoundCause:
        """A fault that began or ended at a controller or element at the moment of a change, and is recorded after it; one that
        names a terminal, if that is given."""
        for group in (self.log.group(owner), -1):
            for order, record in self.log.at(group, change.time):
                if (
                    record.kind == "fault"
                    and record.controller == owner
                    and (named is None or named in str(record.value).split())
                ):
                    link = self.fault_link(record)
                    return Cause(link, Place(record.time, change.order, -2), self.of_fault(record, order))
        return None

    def _bounce_of(self, signal: str, change: Change) -> Change:
        """The change of a contact with which it began to bounce, and at whose level it comes to rest; the change itself, where it
        does not bounce then."""
        longest = self.contacts[signal].bounce_ns if signal in self.contacts else 0
        first = change
        while longest and not self._is_pressed_at(signal, first):
            earlier = self.log.last_change(signal, first.time - 1)
            if earlier is None or change.time - earlier.time > longest or self.log.is_first(signal, earlier):
                break
            first = earlier
        return first if self.log.level(signal, first.time + longest) == first.value else change

    def _is_pressed_at(self, button: str, change: Change) -> bool:
        """Whether somebody presses or releases a button at a change."""
        acts = self.log.acts_at(change.time, change.order)
        return any(isinstance(act.what, do.Press | do.Release) and act.what.button == button for act in acts)

    def _cleared(self, signal: str, change: Change) -> FoundCause:
        """The action at the moment of a change that cleared the fault which had held a signal."""
        hold = self.log.hold(signal, change.time - 1)
        held = None if hold is None else hold.held
        acts = self.log.acts_at(change.time, change.order) if held is not None else ()
        act = next((act for act in acts if held is not None and act.what == do.ClearFault(held.fault)), None)
        return None if act is None else self.scripts.acted(act)

    def _older_fault(self, signal: str, at: Nanos) -> Iterator[Cause]:
        """The fault that holds a signal again since a newer one ended at a moment."""
        hold, before = self.log.hold(signal, at), self.log.hold(signal, at - 1)
        now, then = (None if one is None else one.held for one in (hold, before))
        if now is not None and then is not None and now.fault != then.fault:
            yield self.holding.acting(now.fault, at)

    def fault_link(self, record: TraceRecord) -> ChainLink:
        """Link of a record of a fault."""
        return ChainLink(record.time, record.controller, self.of_record(record), self.fault_root(record.subject, record.time))

    def of_record(self, record: TraceRecord) -> MessageText:
        """A fault in words; of one that altered what went over a line, or let a controller refuse a request, with that."""
        what, altered = self.controllers.not_served(record), self.controllers.altered(record)
        text = FAULT(name=record.subject, what=record.value if what is None else what)
        return text if altered is None else ALTERED(fault=text, request=altered)

    def fault_root(self, name: str, until: Nanos) -> SetFault:
        """A fault that acts at a moment, with the act that set it."""
        faults = self._world.objects.faults
        active, acted = faults.find(name), faults.acts.get(name)
        there = None if active is None or active.since > until else self.of(active.since)
        first = until if acted is None else min(until, acted.first)
        return SetFault(first, name, (there or self).log.setting(name, until))

    def of_fault(self, record: TraceRecord, order: int) -> Callable[[], FoundCause]:
        """Search for the action that set or cleared a fault, unless it belongs to the description."""
        act = self.log.fault_act(record.subject, record.time, order) or self.fault_root(record.subject, record.time).by
        return nothing if act is None else lambda: covered(acted(act), Cover.FAULT)

    def lasting(self, signals: Sequence[str], at: Nanos, first: FoundCause, before: int = LAST) -> FoundCause:
        """The fault that holds one of these signals at a moment, or the output to which a pin is wired, if it began to after the
        change ``first``, which is the next cause then."""
        pins = [signal for signal in signals if signal.partition(".")[0] in self._world.controllers]
        wired = [source for pin in pins for source in self.drivers(pin, at)]
        named = dict.fromkeys((*signals, *wired))
        holds = [(hold.time, signal, hold) for signal in named if (hold := self.log.hold(signal, at, before)) and hold.held]
        time, signal, hold = max(holds, default=(-1, "", None))
        if hold is None or hold.held is None or (first is not None and time <= first.link.time):
            return first
        held, there = hold.held, self.of(time) or self
        began = hold if there is self else there.log.hold(signal, time) or hold
        place = Place(time, began.order)

        text = IS(signal=signal, value=held.description())
        link = ChainLink(time, signal.partition(".")[0], text, self.fault_root(held.fault, time))

        older = self.at_begin if first is None else lambda: covered(first, Cover.LEVEL)
        act = there.log.fault_act(held.fault, time, began.order)
        before_it = older if act is None else partial(Cause, *acted(act)[:2], older, Cover.FAULT)
        return Cause(link, place, before_it, Cover.FAULT)

    def before(self, signal: str, change: Change, until: Nanos) -> tuple[Change, str] | None:
        """The last change of a signal by a moment and before ``change``."""
        found = self.log.last_change(signal, until, change.order)
        return None if found is None else (found, signal)

    def sources(self, target: PinName) -> Iterator[str]:
        """The signals that drive an input: an output at the other end of a wire, or contacts."""
        circuit = self._world.objects.circuits.get(target)
        if circuit is not None:
            yield from (contact.channel for contact in circuit.contacts if contact.channel)
        for scheduler in (self._world.objects.scheduler_of[target.controller],):
            wire = scheduler.wire_to(target)
            if wire is not None:
                yield self.name(wire.source)

    def name(self, pin: PinName) -> str:
        """The signal of a pin or terminal."""
        return str(pin) if pin.controller in self._world.controllers else f"{pin.controller}.{pin.pin.lower()}"

    def _of_pin(self, pin: PinName, change: Change) -> FoundCause:
        wire = self._world.objects.scheduler_of[pin.controller].wire_to(pin)
        if wire is not None:
            found = self.before(self.name(wire.source), change, change.time - wire.delay)
            if found is not None and found[0].time == change.time - wire.delay:
                wired = IS_WIRED_INVERTED if wire.inverted else IS_WIRED_TO
                return covered(self.change(found[1], found[0], wired(pin=str(pin))), Cover.DELAY)
        channels = [found for channel in self.sources(pin) if (found := self.before(channel, change, change.time))]
        at_once = [found for found in channels if found[0].time == change.time]
        if at_once:
            latest, channel = max(at_once, key=lambda found: found[0].order)
            of = OF if self.contacts[channel].normally_closed else CONTACT_OF
            return self.change(channel, latest, of(pin=str(pin)))
        act = next((act for act in self.log.acts_at(change.time, change.order) if sets(act, pin)), None)
        if act is not None:
            return self.scripts.acted(act)
        path = self._world.objects.driven.get(pin)
        if path is not None:
            where = self._world.spec.text.where(path)
            link = ChainLink(change.time, pin.controller, DRIVES(kind=path[0], where=where, pin=str(pin)))
            name = self.elements.driving(pin)
            fault = self.fault(name, change)
            followed = partial(self.elements.of_followed, name, change) if self.elements.followed(name) else nothing
            return Cause(link, Place(change.time, change.order, -1), followed if fault is None else lambda: fault)
        return self.controllers.in_controller(pin.controller, change, Resource(ResourceKind.PIN, pin.pin))

    def _operated(self, name: str, change: Change) -> FoundCause:
        """Who pressed a button."""
        for act in self.log.acts_at(change.time, change.order):
            match act.what:
                case do.Press(button) | do.Release(button) if button == name:
                    if is_release(act.by):  # who pressed it was before the log
                        self.log.lack()
                    return self.scripts.acted(act)
        first = change
        while (earlier := self.log.last_change(name, first.time - 1)) is not None and first.time - earlier.time < SECOND:
            first = earlier
            if any(isinstance(act.what, do.Press | do.Release) for act in self.log.acts_at(first.time, first.order)):
                break
        return None if first is change else covered(self.change(name, first, CONTACT_BOUNCED()), Cover.BOUNCE)

    def drivers(self, signal: str, at: Nanos) -> list[str]:
        """The signals that a signal follows at a moment: those that drive an input, or the inputs of an element; an input of an
        element that a fault holds stands for what drives it."""
        if self.log.hold(signal, at) is not None:
            return []
        owner, _, terminal = signal.partition(".")
        part = self.parts.get(owner)
        if part is not None and terminal.upper() in inputs(part):
            return list(self.sources(PinName(owner, terminal.upper())))
        followed = [one for one in self.elements.behind(signal) if self.log.has(one)]
        if part is not None and followed and terminal.upper() not in part.block.outputs:
            return followed
        if part is not None:
            found = [source for name in inputs(part) for source in self._held_or_sources(owner, name, at)]
            return [*found, *self._unwired(owner, part)]
        return list(self.sources(PinName(owner, terminal))) or followed if owner in self._world.controllers else []

    def _unwired(self, owner: str, part: TerminalComponent) -> Iterator[str]:
        """The input without which an element does nothing, if nothing is wired to it."""
        first = next(iter(inputs(part)), FEED)
        if first != FEED and not self.elements.followed(owner) and not any(self.sources(PinName(owner, first))):
            yield f"{owner}.{first.lower()}"

    def _held_or_sources(self, owner: str, terminal: str, at: Nanos) -> Iterator[str]:
        signal = f"{owner}.{terminal.lower()}"
        if self.log.hold(signal, at) is None:
            yield from self.sources(PinName(owner, terminal))
        else:
            yield signal
