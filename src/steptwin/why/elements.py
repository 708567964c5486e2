"""The causes of what happens to elements: gates, cylinders, belts, beams, collisions."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from itertools import islice
from typing import Any

from steptwin.controller import SECOND, Nanos
from steptwin.messages import Message
from steptwin.simulation.components.brake import BrakeSpec
from steptwin.simulation.components.carriage import CarriageSpec
from steptwin.simulation.components.conveyortable import FEED, RUN, ConveyorSpec
from steptwin.simulation.components.counter import DOWN, RESET, UP, Counter
from steptwin.simulation.components.cylinder import Cylinder
from steptwin.simulation.components.follower import FollowerSpec
from steptwin.simulation.components.gantry import GantrySpec
from steptwin.simulation.components.load import LoadSpec
from steptwin.simulation.components.logic import TerminalComponent
from steptwin.simulation.components.shaft import ShaftSpec
from steptwin.simulation.components.tool import ToolSpec
from steptwin.simulation.kinds.programs import Resource, ResourceKind
from steptwin.simulation.logic.expression import parse_condition, parse_expression
from steptwin.simulation.scheduler.wires import PinName
from steptwin.why.answer import ChainLink, Cover
from steptwin.why.axes import EVENTS_OF_ROTORS, POSITION
from steptwin.why.chain import Cause, FoundCause, Place, covered, nothing
from steptwin.why.controllers import axis_of
from steptwin.why.log import LAST, Change
from steptwin.why.movers import FALLS, GOES_ON, PUSHED, TRAVEL
from steptwin.why.workpieces import HAS_ACTED_SINCE

FOLLOWS_AFTER = Message("why.follows-after", ", {name} follows after {delay_ms:g} ms")
ITS_RATE_IS = Message("why.its-rate-is", "the rate of {name} is {rate:g} {unit}")
COMES_WITH_TIME = Message("why.comes-with-time", "the time has come for {name}: {condition}")
MOVED_BY_AXES = CarriageSpec, FollowerSpec, GantrySpec, ShaftSpec, ToolSpec
MOST_COUNTED = 40
"""Limit of the changes at an input of a counter that are searched for what it counted."""
TIME = "time"
"""States of an element that are over at a moment and are no signal."""


class ElementCauses:
    """Finds the causes of changes of elements. ``causes`` has those of everything else."""

    def __init__(self, causes: Any) -> None:  # Causes, which imports this module
        self._all = causes
        self._log = causes.log
        self._world = causes.log.world
        compare = ("between", "all", "sees")
        self._spatial = {
            name
            for name in causes.parts
            if name in causes.specs and any(getattr(causes.specs[name], one, None) for one in compare)
        }

    def of_element(self, name: str, signal: str, time: Nanos, before: int = LAST) -> FoundCause:
        """Cause before an order of a change of an element that no record shows: a collision that jams it, what drives a terminal,
        an output at the same moment, or an input."""
        part = self._all.parts.get(name)
        if part is not None and signal.upper() in inputs(part):
            return self._all.last(list(self._all.sources(PinName(name, signal.upper()))), time)
        group = self._log.group(name)
        change = Change(time, 0.0, group, self._log.position(group, time), before)
        full, is_own = f"{name}.{signal}", signal == POSITION or self._log.rates.has(name)
        workpiece = None if is_own else self._all.workpieces.at(name, change, full)
        if workpiece is not None:
            return workpiece
        jams = [one for one in self._all.axes.jams(name) if (one.time, one.order) < (time, before)] if signal == POSITION else []
        jam = next((one for one in jams if self._all.axes.holds_rotor(one, jams)), None)
        if jam is not None:
            return self._all.axes.rotor_event(name, jam)
        if signal == POSITION and self._all.axes.is_jammed_by(name):
            self._log.never_happened(*EVENTS_OF_ROTORS)
        if part is None and (self.followed(name) or self._is_timed(name)):
            return self.of_followed(name, change)
        channels = [one for one in self._log.first_levels if one == name or one.startswith(f"{name}.")]
        found = None if part is None else self.of_inputs(name, change, full)
        found = self._all.last(channels, time) if found is None else found
        return covered(found, Cover.ACTION) if found is not None and found.cover is None else found

    def at_element(self, name: str, change: Change) -> FoundCause:
        """Cause of an event of an element."""
        return self._all.fault(name, change) or self.of_inputs(name, change)

    def of_inputs(self, name: str, change: Change, signal: str = "") -> FoundCause:
        """Cause of a change of an element's output, ``signal`` if that is given: an input at the same moment, or one before, as
        much earlier as it delays; of a counter, besides it what it had counted before."""
        found = self._of_inputs(name, change, signal)
        if found is None or not isinstance(self._all.parts[name], Counter):
            return found
        return found._replace(besides=partial(self._counted, name, found.place))

    def _counted(self, name: str, last: Place) -> Iterator[Cause]:
        """The changes that a counter had counted before the last one since it was reset."""
        reset = self._all.last(list(self._all.sources(PinName(name, RESET))), last.time)
        since = Place(-1) if reset is None else reset.place
        for terminal in (UP, DOWN):
            for source in self._all.sources(PinName(name, terminal)):
                for one in islice(self._log.changes_before(source, last.time, last.order), MOST_COUNTED):
                    if one.value and since < Place(one.time, one.order):
                        yield self._all.change(source, one)._replace(cover=Cover.LEVEL)
        if reset is None:
            self._log.lack()

    def _of_inputs(self, name: str, change: Change, signal: str) -> FoundCause:
        part = self._all.parts[name]
        sources = [source for terminal in inputs(part) for source in self._all.sources(PinName(name, terminal))]
        last = list(self._that_act(name, signal, change, change.time))
        if change.time - max(part.delays, default=0) <= self._log.begin:
            self._log.lack()
        for delay in (0, *part.delays):
            exact = [found for found in last if found[0].time == change.time - delay]
            exact += [
                found
                for source in (sources if delay else ())
                if (found := self._all.before(source, change, change.time - delay)) and found[0].time == change.time - delay
            ]
            if exact:
                latest, source = max(exact, key=lambda found: found[0].order)
                how = FOLLOWS_AFTER(name=name, delay_ms=delay / SECOND * 1000) if delay else None
                return covered(self._all.change(source, latest, how), Cover.DELAY)
        workpiece = self._all.workpieces.at(name, change, signal)
        if workpiece is not None:
            return workpiece
        followed = self.of_followed(name, change)
        if followed is not None and all(followed.place > Place(one.time, one.order) for one, _ in last):
            return followed
        acts = Cover.ACTION if type(part).deadline is not TerminalComponent.deadline else None
        begun, came = self._log.actions.begun(name, change.time), last
        if begun is not None:  # inputs that came later have not changed what it does
            change = Change(begun, 0.0, change.group, self._log.position(change.group, begun), LAST)
            last = list(self._that_act(name, signal, change, begun))
        elif self._log.actions.has(name):
            self._log.lack()
        latest, source = max(last, key=lambda found: (found[0].time, found[0].order), default=(None, ""))
        in_vain = [self._all.change(one, later) for later, one in came if later.time > change.time]
        fault = self._log.last_fault(name, change.time, change.order)
        if fault is not None and (latest is None or (fault.time, fault.order) > (latest.time, latest.order)):
            record = self._log.record(fault)
            link = self._all.fault_link(record)
            moved = [self._all.change(source, latest, HAS_ACTED_SINCE(name=name))] if latest and not self._log.has(signal) else []
            along = tuple(one._replace(cover=Cover.LEVEL) for one in (*in_vain, *moved))
            return Cause(link, Place(fault.time, fault.order), self._all.of_fault(record, fault.order), acts, along=along)
        is_still = isinstance(part, Cylinder) and latest is not None and not self._log.has(signal)
        still = next(self._all.holding.faults(name, change.time), None) if is_still else None
        if still is not None and latest is not None:  # that came in vain
            return covered(self._all.change(source, latest)._replace(along=(still,)), acts)
        on = [source for source in sources if self._log.level(source, change.time)] if latest is None else []
        if on and self._log.reaches_begin():
            first, *others = [self._all.first(one, HAS_ACTED_SINCE(name=name))._replace(cover=acts) for one in on]
            return first._replace(along=tuple(others))
        how = HAS_ACTED_SINCE(name=name)
        return covered(
            self._all.last(sources, change.time, how) if latest is None else self._all.change(source, latest, how), acts
        )

    def _that_act(self, name: str, signal: str, change: Change, until: Nanos) -> Iterator[tuple[Change, str]]:
        """The last changes by a moment and before ``change`` of the inputs of an element, for a sensor of a belt those by which
        workpieces come to it or go on: a feed that is switched off moves none, nor a stop that is switched on."""
        is_belt = signal in self._log.first_levels and isinstance(self._all.specs.get(name), ConveyorSpec)
        for terminal in inputs(self._all.parts[name]):
            idle = {RUN: None, FEED: False}.get(terminal, True) if is_belt else None
            for source in self._all.sources(PinName(name, terminal)):
                changes = self._log.changes_before(source, until, change.order)
                found = next((one for one in changes if bool(one.value) is not idle), None)
                if found is not None:
                    yield found, source

    def followed(self, name: str) -> tuple[str, ...]:
        """The signals that an element follows besides its inputs: those of its condition, what it measures, its axes."""
        spec: Any = self._all.specs.get(name)
        if spec is None:
            return ()
        if name in self._spatial or getattr(spec, "pushes", False):
            return self._moved_in_space(name, spec)
        when, of, rate = (getattr(spec, one, None) for one in ("when", "of", "rate"))
        acts_on_axis = isinstance(spec, BrakeSpec | LoadSpec)
        axes = [getattr(spec, one, None) for one in ("axis", "other")] if not (when or of or rate or acts_on_axis) else []
        turned_by = getattr(spec, "shaft", None)
        names = [*(parse_condition(when).names() if when else ()), *(parse_expression(of).names() if of else ())]
        names += parse_expression(rate).names() if rate else ()
        found = [moved for one in names for moved in self._that_move(one)]
        found += [f"{axis}.{POSITION}" for axis in axes if axis]
        return (*dict.fromkeys(one for one in found if one != TIME), *(self.followed(turned_by) if turned_by else ()))

    def _that_move(self, signal: str) -> tuple[str, ...]:
        """The positions of the axes that move a coordinate; the signal itself, if it is none."""
        owner = signal.partition(".")[0]
        is_moved = isinstance(self._all.specs.get(owner), MOVED_BY_AXES) and not self._log.has(signal)
        return self.followed(owner) if is_moved else (signal,)

    def _condition(self, name: str) -> str:
        """Text of the condition of an element, or of what it is over; empty for none."""
        spec = self._all.specs.get(name)
        return getattr(spec, "when", None) or getattr(spec, "of", None) or ""

    def _is_timed(self, name: str) -> bool:
        """Whether an element depends on the time."""
        return TIME in re.findall(r"[\w.]+", self._condition(name))

    def behind(self, signal: str) -> tuple[str, ...]:
        """The signals that the element follows that has a signal, or drives a pin."""
        owner, _, pin = signal.partition(".")
        if owner in self._world.controllers:
            owner = self.driving(PinName(owner, pin))
        return self.followed(owner)

    def driving(self, pin: PinName) -> str:
        """The element without terminals that drives an input, such as a transducer; empty for none."""
        path = self._world.objects.driven.get(pin)
        named = (name for name, spec in self._all.specs.items() if path is not None and spec.path == path[: len(spec.path)])
        return next(named, "")

    def _moved_in_space(self, name: str, spec: Any) -> tuple[str, ...]:
        """The signals that move a pusher, or the bodies that an element compares or sees, or the belt with the workpieces."""
        described = self._world.objects.described
        names = [] if hasattr(spec, "between") else [spec.name]
        if name in self._spatial:
            names += [other for key, other in spec.others(described) if key != "except"]
        found: dict[str, None] = {}
        for other in names:
            one: Any = self._all.specs.get(other)
            while one is not None:
                if one.name in self._world.axes or (one.name in self._all.parts and getattr(one, "moves_others", False)):
                    found[f"{one.name}.{POSITION}"] = None
                elif one.name != spec.name:
                    found |= dict.fromkeys(self.followed(one.name))
                one = self._all.specs.get(getattr(one, "on", None) or "")
        belts = [other for other in names if hasattr(self._all.specs.get(other), "feed_every")]
        return tuple(found) or tuple(f"{other}.travel" for other in belts if len(belts) == 1)

    def of_followed(self, name: str, change: Change) -> FoundCause:
        """The last cause by a moment of what an element follows; that of the same moment, if there is one, or of an axis that
        moves then; of a collision, along with what led its other body there."""
        is_integrator = self._log.rates.has(name)
        if is_integrator:
            self._log.lack()  # all its rates count
        moved = self._log.meetings.movers.get((name, change.time))
        moving = self._log.rates.drivers(name, change.time) if is_integrator else moved
        names = moving if is_integrator or moving else self.followed(name)
        found: dict[str, Cause] = {}
        for signal in names or ():
            since = self._log.rates.since(name, signal, change.time) if is_integrator else change.time
            cause = self._of_signal(signal, change, since)
            if cause is not None:
                found[signal] = cause
        if isinstance(self._all.specs.get(name), GantrySpec):
            found |= self._unmoved([signal for signal in names or () if signal not in found], change)
        best = max(found, key=lambda one: self._urgency(one, found[one], change), default=None)
        if self._is_timed(name) and (best is None or found[best].place.time < change.time):
            text = COMES_WITH_TIME(name=name, condition=self._condition(name))
            place = Place(change.time, change.order, -1)
            return Cause(ChainLink(change.time, name, text), place, nothing, along=() if best is None else (found[best],))
        if best is None:
            return self.rate(name, change.time) if is_integrator else None
        others: list[Cause] = []
        spec = self._all.specs.get(name)
        has_parts = hasattr(spec, "effect") or isinstance(spec, MOVED_BY_AXES)
        for signal in names if is_integrator else self.followed(name) if has_parts else ():
            cause = found.get(signal) or (None if is_integrator else self._of_signal(signal, change, change.time))
            if cause is not None and signal != best:
                others.append(cause)
        added = partial(self._added_up, name, names, change, found[best]) if is_integrator else found[best].besides
        return found[best]._replace(along=tuple(others), besides=added)

    def _added_up(self, name: str, drivers: Sequence[str], change: Change, last: Cause) -> Iterator[Cause]:
        """The signals that began to move the value of an integrator as it moved last before a change, and what had moved it
        before, all of them before the ``last`` one."""
        yield from last.besides()
        began = self._log.rates.last(name, change.time).time
        earlier = Change(began, 0.0, change.group, self._log.position(change.group, began), LAST)
        reset = self._all.last(list(self._all.sources(PinName(name, RESET))), change.time)
        if began >= change.time or (reset is not None and reset.place.time >= began):
            return
        found = [self._all.last([one], began) for one in drivers if self._log.has(one)]
        found += [self.of_followed(name, earlier)] if self._log.rates.drivers(name, began) else []
        yield from (one._replace(cover=Cover.LEVEL) for one in found if one is not None and one.place < last.place)

    def _unmoved(self, signals: Iterable[str], change: Change) -> dict[str, Cause]:
        """Reasons why axes have not moved before a change."""
        drives = {signal: self._world.axes[signal.rpartition(".")[0]].spec.drive for signal in signals}
        unmoved = self._all.attempts.unmoved
        found = {one: unmoved(drive[0], drive[1].removeprefix("M"), change.time) for one, drive in drives.items()}
        return {signal: cause for signal, cause in found.items() if cause is not None}

    def rate(self, name: str, until: Nanos) -> Cause:
        """The last rate of an integrator by a moment."""
        rate = self._log.rates.last(name, until)
        unit = f"{self._all.specs[name].unit}/s"
        text = ITS_RATE_IS(name=name, rate=float(rate.rate.value), unit=unit)
        return Cause(ChainLink(rate.time, name, text), Place(rate.time), self._all.at_begin, Cover.LEVEL)

    def _urgency(self, signal: str, cause: Cause, change: Change) -> tuple[bool, bool, Place]:
        """The highest decides among several causes."""
        owner = signal.rpartition(".")[0]
        drive = self._world.axes[owner].spec.drive if owner in self._world.axes else None
        moves = drive is not None and self._all.axes.is_moving(drive[0], drive[1].removeprefix("M"), change.time)
        return cause.place.time == change.time, moves, cause.place

    def _of_signal(self, signal: str, change: Change, since: Nanos) -> FoundCause:
        """The last cause before a change of a signal that an element follows, and that has its value since a moment; if that is
        not known, since the change."""
        owner, _, rest = signal.rpartition(".")
        before = self._all.before(signal, change, change.time)
        at_once = self._at_once(signal, change)
        if at_once is not None:
            cause = at_once
        elif before is not None:
            cause = covered(self._all.change(signal, before[0]), Cover.ACTION)
        elif signal in self._log.first_levels:
            cause = covered(self._all.first(signal), Cover.ACTION)
        elif owner in self._world.axes:
            cause = covered(self._all.axes.moved(owner, change.time, change.order), Cover.MOTION)
        elif owner in self._world.controllers:
            point = self._world.kind(owner).point(self._world.controller(owner), rest)
            path = rest if point is None else point.point.path
            cause = self._all.controllers.at_moment(owner, change.time, axis_of(path) or Resource(ResourceKind.AXIS, ""), path)
        elif owner in self._log.events and rest in (PUSHED, FALLS, GOES_ON):
            cause = self._all.workpieces.last(owner, rest, change)
        elif rest == TRAVEL:
            cause = self._all.workpieces.travel(owner, change)
        else:
            order = change.order if since == change.time else LAST
            cause = covered(self.of_element(owner, rest, since, order), Cover.ACTION)
        return cause if cause is not None and cause.place < Place(change.time, change.order) else None

    def _at_once(self, signal: str, change: Change) -> FoundCause:
        """The change of a pin of a controller that is recorded after what it leads to at once, because elements read its level
        before."""
        last = self._log.last_change(signal, change.time)
        if signal.partition(".")[0] not in self._world.controllers or last is None or last.time < change.time:
            return None
        here, cause = Place(change.time, change.order), self._all.change(signal, last)
        led = cause.before() if last.order > change.order else None
        if led is None or led.place >= here:
            return None
        return cause._replace(place=here._replace(number=-1), before=lambda: led)


def inputs(part: TerminalComponent) -> list[str]:
    return [terminal for terminal in part.block.levels if terminal not in part.block.outputs]
