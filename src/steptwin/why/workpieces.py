"""The causes of what happens to workpieces."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from functools import partial
from itertools import islice, takewhile
from typing import Any

from steptwin.controller import Nanos
from steptwin.messages import Message
from steptwin.simulation.components.beltsensor import Sensor
from steptwin.simulation.components.carrier import HELD as HELD_OUT
from steptwin.simulation.components.carrier import PLACE, CarrierSpec
from steptwin.simulation.components.conveyortable import BELT_STOP, FEED, RUN, ConveyorSpec
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.scheduler.wires import PinName
from steptwin.simulation.script import steps as do
from steptwin.why.answer import ChainLink, Cover
from steptwin.why.chain import Cause, FoundCause, Place, covered, nothing
from steptwin.why.log import LAST, Change, words_of
from steptwin.why.movers import FALLS, GOES_ON, PUSHED, STANDS
from steptwin.why.roots import Act

STANDS_BEFORE = Message("why.stands-before", "{name} is in the way of {workpiece}")
HAS_ACTED_SINCE = Message("why.has-acted-since", ", on which {name} has acted since")
IS_WIRED_TO = Message("why.is-wired-to", ", which is wired to {pin}")
NOT_FED_SINCE = Message("why.not-fed-since", ", and {name} was not fed since")
MOST_EVENTS = 1000
"""Limit of the events at a belt that are searched for workpieces on it."""
COMES, HELD = ("on", "crooked", "on the floor"), "held"
STAYS = (STANDS, GOES_ON, "goes back", "collides", "jams", "free again")
"""Events after which a workpiece may still be pushed."""


class WorkpieceCauses:
    """Finds the causes of events of workpieces. ``causes`` has those of everything else."""

    def __init__(self, causes: Any) -> None:  # Causes, which imports this module
        self._all = causes
        self._log = causes.log
        self._world = causes.log.world

    def at(self, name: str, change: Change, signal: str = "") -> FoundCause:
        """Cause for which a workpiece came, went or was taken at the moment of a change, before it: one that a sensor with this
        signal sees or saw, or that touches something; else any at an element."""
        seen = self._log.meetings.seen.get((signal, change.time))
        names = (name,) if seen is None else seen

        def is_there(workpiece: str, event: Change) -> bool:
            return workpiece in names or (seen is None and name in self._places(workpiece, event))

        moves = [one for one in self._log.events_at(change.time) if one.order < change.order and self._what(one) not in STAYS]
        named = (one for one in moves if seen is None and name in self._named(one))
        there = (one for one in moves if is_there(str(dict(self._log.record(one).facts)["workpiece"]), one))
        event = next(named, None) or next(there, None)
        if event is not None:
            return self.event(event)
        for act in self._log.acts_at(change.time, change.order):
            if isinstance(act.what, do.Remove) and is_there(act.what.workpiece, change):
                return self._all.scripts.acted(act)
        return None

    def _places(self, workpiece: str, event: Change) -> Iterator[str]:
        """Where a workpiece was just before an event: on a belt, in a nest, at a cup, on others and what they are on."""
        earlier = self._log.events_before(workpiece, event)
        came = next((one for one in earlier if self._what(one) in (*COMES, HELD)), None)
        if came is None:
            self._log.lack()
            yield workpiece.rpartition(".")[0]
            return
        for one in self._named(came) - {workpiece}:
            yield one
            if "." in one:
                yield from self._places(one, came)

    def _named(self, event: Change) -> set[str]:
        """The elements and workpieces in an event."""
        record = self._log.record(event)
        values = getattr(record.value, "values", {}).values()
        return {str(dict(record.facts)["element"]), *(one for one in values if isinstance(one, str))}

    def last(self, workpiece: str, what: str, change: Change) -> FoundCause:
        """The last event of a kind of a workpiece before a change."""
        event = self._log.last_event(workpiece, change.time, change.order, what)
        if event is None:
            self._log.lack()
        return None if event is None else covered(self.event(event), Cover.ACTION)

    def event(self, event: Change) -> Cause:
        """An event of a workpiece."""
        record = self._log.record(event)
        facts = dict(record.facts)
        text = words_of(record)
        act = next((act for act in self._log.acts_at(event.time, event.order) if _moves(act, record)), None)
        if act is not None:
            before = partial(self._all.scripts.acted, act)
        elif self._is_fed(event, record):
            before = nothing
        else:
            before = partial(self._of_event, event, record)
        link = ChainLink(event.time, str(facts["element"]), text)
        return Cause(link, Place(event.time, event.order), before, besides=partial(self._came, event, record))

    def _came(self, event: Change, record: TraceRecord) -> Iterator[Cause]:
        """The event by which a workpiece came to where it is pushed."""
        facts = dict(record.facts)
        earlier = self._log.events_before(str(facts["workpiece"]), event) if facts["what"] == PUSHED else ()
        came = next((one for one in earlier if self._what(one) in COMES), None)
        if came is None and facts["what"] == PUSHED:
            self._log.lack()
        if came is not None:
            yield self.event(came)._replace(cover=Cover.LEVEL)

    def _is_fed(self, event: Change, record: TraceRecord) -> bool:
        """Whether a workpiece comes into the world by the clock of a feeder."""
        facts = dict(record.facts)
        feeder, workpiece = str(facts["element"]), str(facts["workpiece"])
        every = getattr(self._all.specs.get(feeder), "feed_every", None)
        is_new = facts["what"] == "on" and workpiece.startswith(f"{feeder}.") and self._same(event, workpiece) is None
        return bool(every) and is_new and event.time % every == 0

    def _same(self, event: Change, workpiece: str) -> Change | None:
        """The event of a workpiece before another one of the same moment."""
        found = self._log.last_event(workpiece, event.time, event.order)
        return found if found is not None and found.time == event.time else None

    def _of_event(self, event: Change, record: TraceRecord) -> FoundCause:
        facts = dict(record.facts)
        owner, workpiece, what = str(facts["element"]), str(facts["workpiece"]), facts["what"]
        if getattr(self._all.specs.get(owner), "pushes", False):
            return self._all.elements.of_followed(owner, event)
        same = self._same(event, workpiece)
        if same is not None:
            return self.event(same)
        if what == STANDS:
            return self._holder(workpiece, event)
        if what == FALLS:  # what it lay on is gone
            below = next((one for one in self._log.events_at(event.time) if one.order < event.order), None)
            if below is not None:
                return self.event(below)
        if what in (*COMES, FALLS):
            lasts = next((one for one in self._log.events_before(workpiece, event) if self._what(one) not in STAYS), None)
            if lasts is None:
                self._log.lack()
            elif self._what(lasts) in (PUSHED, FALLS):
                return covered(self.event(lasts), Cover.ACTION)
        # What takes a workpiece from an element, or lets go of it there, acts.
        actor = str(getattr(record.value, "values", {}).get("cup", owner))
        if actor not in self._all.parts:
            return None
        if what in ("leaves", FALLS) and hasattr(self._all.specs.get(actor), "feed_every"):
            found, last = self.travel(actor, event), next(self._log.events_before(workpiece, event), None)
            went = None if last is None or self._what(last) != GOES_ON else covered(self.event(last), Cover.ACTION)
            if went is None or (found is not None and found.place > went.place):
                return found
            return went._replace(along=() if found is None else (found,))
        cause = self._all.elements.of_inputs(actor, event)
        # What comes onto a belt does not by what moves that.
        return None if what == "on" and cause is not None and cause.place.time < event.time else cause

    def _holder(self, workpiece: str, event: Change) -> FoundCause:
        """The workpiece before one that comes to stand, where that stands or moves more slowly, or the pusher or stop that holds
        it."""
        by = self._log.meetings.holders.get((workpiece, event.time), "")
        if getattr(self._all.specs.get(by), "pushes", False):
            time, order, number = event.time, event.order, -1
            moved = partial(covered, self._all.elements.of_followed(by, event), Cover.LEVEL)
            return Cause(ChainLink(time, by, STANDS_BEFORE(workpiece=workpiece, name=by)), Place(time, order, number), moved)
        if by in self._log.events:
            last = next(self._log.events_before(by, event), None)
            return self.rests(by, event) or (None if last is None else covered(self.event(last), Cover.LEVEL))
        owner, _, terminal = by.partition(".")
        stop = PinName(owner, terminal.upper())
        sources = list(self._all.sources(stop)) if by else []
        found = self._all.last(sources, event.time, IS_WIRED_TO(pin=str(stop)), event.order) if sources else None
        return covered(found or (self._all.first(sources[0]) if sources else None), Cover.ACTION)

    def rests(self, workpiece: str, change: Change) -> FoundCause:
        """The reason why a workpiece on a belt does not move before a change: what holds it, or its belt stands; None if that is
        not known, or it moves."""
        last = next(self._log.events_before(workpiece, change), None)
        if last is None:
            self._log.lack()
            return None
        if self._what(last) == STANDS:
            return covered(self.event(last), Cover.LEVEL)
        return self._stopped(str(dict(self._log.record(last).facts)["element"]), change)

    def _stopped(self, belt: str, change: Change) -> FoundCause:
        """The last change by which a belt stands before another one, or that it has never run; None for one that runs."""
        spec = self._all.specs.get(belt)
        if not isinstance(spec, ConveyorSpec):
            return None
        if spec.axis is not None:
            controller, axis = self._world.axes[spec.axis].spec.drive
            is_moving = self._all.axes.is_moving(controller, axis.removeprefix("M"), change.time)
            return None if is_moving else covered(self._all.axes.moved(spec.axis, change.time, change.order), Cover.LEVEL)
        run = PinName(belt, RUN)
        is_on = self._all.holding.level(run, change.time)
        sources = list(self._all.sources(run))
        held = self._all.lasting([f"{belt}.{RUN.lower()}"], change.time, None)
        if held is not None:
            return None if self._log.level(f"{belt}.{RUN.lower()}", change.time) else covered(held, Cover.FAULT)
        if is_on or not sources:
            return next(self._all.holding.faults(belt, change.time, BELT_STOP), None)
        stopped = self._switched(belt, change, runs=False)
        return covered(stopped or self._all.unchanged(sources[0], Place(change.time, change.order, -1)), Cover.LEVEL)

    def keeping(self, signal: str, at: Nanos, since: Nanos) -> Iterator[Cause]:
        """The reason why a beam or the sensor of a belt goes on seeing a workpiece at a moment, or none, as it has since another
        one: that stands, or none comes."""
        changed, change = self._log.since(signal, at), Change(at, 0.0, -1, 0, LAST)
        contact, seen = self._all.contacts.get(signal), self._log.meetings.seen
        belt, found = signal.partition(".")[0], iter(())
        if bool(self._log.level(signal, at)) is not (contact is not None and contact.normally_closed):
            there = None if changed is None else self._all.of(changed)
            names = () if there is None else there.log.meetings.seen.get((signal, changed), ())
            found = (self.rests(one, change) for one in names if "." in one)  # a workpiece
        elif isinstance(contact, Sensor) and contact.of_marks:
            found = iter([self._stopped(belt, change)])
        elif isinstance(contact, Sensor):
            passed = {one for key in seen if key[0] == signal for one in seen[key]}
            found = self._lacking(belt, contact.at_mm, passed, change, since)
        elif self.finds_nothing(signal, at):
            found = self._nothing_to_take(self._all.specs[belt], change, since)
        yield from (one for one in found if one is not None)

    def awaits(self, signal: str) -> bool:
        """Whether a signal says that a workpiece has come to a sensor, or to what takes it."""
        return isinstance(self._all.contacts.get(signal), Sensor) or isinstance(
            self._all.specs.get(signal.partition(".")[0]), CarrierSpec
        )

    def finds_nothing(self, signal: str, at: Nanos) -> bool:
        """Whether a signal says that a carrier holds nothing which is switched on where none of the workpieces of its belt is."""
        name, _, terminal = signal.partition(".")
        spec = self._all.specs.get(name)
        if not isinstance(spec, CarrierSpec) or terminal.upper() != HELD_OUT or self._log.level(signal, at):
            return False
        block, is_belt = self._all.parts[name].block, isinstance(self._all.specs.get(spec.source or ""), ConveyorSpec)
        takes = [PinName(name, one) for one in block.levels if one != PLACE and one not in block.outputs]
        return is_belt and all(self._all.holding.level(one, at) for one in takes) and not self._log.meetings.is_met(name, at)

    def _nothing_to_take(self, spec: CarrierSpec, change: Change, since: Nanos) -> Iterator[FoundCause]:
        """Reasons why no workpiece is where a carrier would take one before a change: what took the last one from its belt, or
        why none comes."""
        belt = spec.source or ""
        lasts = self._last_events(belt, (), change)
        taken = None if lasts is None or self._here(belt, lasts, change) else self._taken(belt, lasts, change, -1)
        yield from self._lacking(belt, spec.pick_at, (), change, since) if taken is None else (taken,)

    def _lacking(
        self, belt: str, place: float, seen: Collection[str], change: Change, since: Nanos, onto: frozenset[str] = frozenset()
    ) -> Iterator[FoundCause]:
        """Reasons why no workpiece comes to a place of a belt, mm, before a change, as none has since a moment, but those that
        have been ``seen``. ``onto``: the belts behind it, of which it may be the next one: belts may lie in a ring."""
        lasts, stopped = self._last_events(belt, seen, change), self._stopped(belt, change)
        here = [] if lasts is None else self._here(belt, lasts, change)
        if stopped is not None and (lasts is None or here):  # an empty belt brings nothing, whether it runs or not
            yield stopped
            return
        if lasts is None:
            return
        held = [one for one in here if self._what(one) == STANDS and self._place(one) < place]
        if held:
            yield self.rests(self._workpiece(max(held, key=self._place)), change)
        if here:
            return
        taken = self._taken(belt, lasts, change, since)
        if taken is not None:
            yield taken
        else:
            feed = list(self._all.sources(PinName(belt, FEED)))
            yield covered(self._all.last(feed, change.time, NOT_FED_SINCE(name=belt)) if feed else None, Cover.LEVEL)
            for name, spec in self._all.specs.items():
                if getattr(spec, "next", None) == belt and name not in onto:
                    yield from self._lacking(name, math.inf, seen, change, since, onto | {belt, name})

    def _last_events(self, belt: str, seen: Collection[str], change: Change) -> list[Change] | None:
        """The last event before a change of each workpiece that has been on a belt, but those that have been ``seen``; None where
        it is not known where some have been."""
        events = list(islice(self._log.events_before(belt, change), MOST_EVENTS))
        came = {self._workpiece(one) for one in events if self._what(one) in COMES}
        if self._log.meetings.there[belt] - came:
            self._log.lack()
            return None
        names = dict.fromkeys(self._workpiece(one) for one in events)
        return [last for one in names if one not in seen and (last := next(self._log.events_before(one, change), None))]

    def _here(self, belt: str, lasts: Collection[Change], change: Change) -> list[Change]:
        """Those of the last events of workpieces after which they are on a belt."""
        here = [one for one in lasts if belt in self._named(one) and self._what(one) not in ("leaves", FALLS, HELD)]
        return [one for one in here if not self._removed(one, change)]

    def _taken(self, belt: str, lasts: Collection[Change], change: Change, since: Nanos) -> FoundCause:
        """The last event since a moment by which a workpiece was taken from a belt, or the action of somebody."""
        gone = [one for one in lasts if one.time > since and self._what(one) != "leaves"]
        gone = [one for one in gone if belt in self._places(self._workpiece(one), one)]
        acts = [act for one in lasts if (act := self._removed(one, change)) is not None and act.time > since]
        if acts:
            return covered(self._all.scripts.acted(max(acts, key=lambda act: (act.time, act.order))), Cover.LEVEL)
        return covered(self.event(max(gone, key=lambda one: (one.time, one.order))), Cover.LEVEL) if gone else None

    def _workpiece(self, event: Change) -> str:
        return str(dict(self._log.record(event).facts)["workpiece"])

    def _place(self, event: Change) -> float:
        """Where a workpiece stands from an event on, in mm of its belt."""
        return float(self._log.record(event).value.values["place"])

    def _removed(self, event: Change, change: Change) -> Act | None:
        """The action after an event of a workpiece and before a change that took it away."""
        name = self._workpiece(event)
        acts = self._log.acts_before(change.time, change.order)
        acts = takewhile(lambda act: (act.time, act.order) > (event.time, event.order), acts)
        return next((act for act in acts if isinstance(act.what, do.Remove) and act.what.workpiece == name), None)

    def _what(self, event: Change) -> str:
        return str(dict(self._log.record(event).facts)["what"])

    def travel(self, belt: str, change: Change) -> FoundCause:
        """The thing that moves a belt at a moment: its axis, or the output that lets it run."""
        axis = getattr(self._all.specs.get(belt), "axis", None)
        if axis is not None:
            return covered(self._all.axes.moved(axis, change.time, change.order), Cover.MOTION)
        return covered(self._switched(belt, change, runs=True), Cover.ACTION)

    def turns(self, drive: str, change: Change) -> FoundCause:
        """The thing by which a belt or motor has come to where it is at a moment: what moves it, along with what ended that."""
        found = self.travel(drive, change)
        stopped = covered(self._switched(drive, change, runs=False), Cover.ACTION)
        is_over = found is not None and stopped is not None and stopped.place > found.place
        return found._replace(along=(stopped,)) if is_over else found

    def _switched(self, drive: str, change: Change, *, runs: bool) -> FoundCause:
        """The last change before another one of the output that lets a belt or motor run, which let it, or did so no longer; if
        there was none, its level from the beginning."""
        how = HAS_ACTED_SINCE(name=drive)
        for signal in self._all.sources(PinName(drive, RUN)):
            for one in self._log.changes_before(signal, change.time, change.order):
                if bool(one.value) is runs:
                    return self._all.change(signal, one, how)
            self._log.lack()
            if runs:
                level = self._log.level(signal, self._log.begin)
                return self._all.first(signal, (None if level else self._all.undriven(signal)) or how)
        return None


def _moves(act: Act, record: TraceRecord) -> bool:
    """Whether somebody has put a workpiece there, or taken it away."""
    facts = dict(record.facts)
    if isinstance(act.what, do.Remove):
        return act.what.workpiece == facts["workpiece"]
    return isinstance(act.what, do.Put) and facts["what"] == "on" and str(facts["workpiece"]).startswith(f"{act.what.on}.")
