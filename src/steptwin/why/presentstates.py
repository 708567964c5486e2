"""The present states on which something depends that has not come: levels, what drives them, waits, motions without end."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import replace
from typing import TypeAlias

from steptwin.controller import SECOND, Nanos
from steptwin.messages import Message, MessageText
from steptwin.motion.divisions import profile_of
from steptwin.simulation.components.brake import Brake
from steptwin.simulation.components.carrier import HELD, PLACE, Carrier, CarrierSpec
from steptwin.simulation.components.conveyor import CONVEYOR
from steptwin.simulation.components.counter import Counter
from steptwin.simulation.components.cylinder import EXTENDED, RETRACTED, Cylinder
from steptwin.simulation.components.relay import Relay
from steptwin.simulation.components.timer import Timer
from steptwin.simulation.kinds.programs import Resource, ResourceKind, StatementLocation, StatementUse
from steptwin.simulation.mechanics.belt import NANOMETRES
from steptwin.simulation.world.simulation import Simulation
from steptwin.why.answer import ChainLink
from steptwin.why.causes import IS, Causes
from steptwin.why.interrupts import OF_AWAITED_INTERRUPT, OF_INTERRUPT
from steptwin.why.programs import NEVER_SET, WAITS
from steptwin.why.sentences import statement, statement_at

WAITS_FOR_A_TIME = Message("why.waits-for-a-time", "it waits for a time only")
DEPENDS_ON = Message("why.depends-on", "it depends on {name}")
IS_NOT_SET = Message("why.is-not-set", "{name} is {value:g}: nothing has set it")
IS_STILL = Message("why.is-still", "{name} is {value:g} since {time:.6f} s")
IS_DEFERRED = Message("why.is-deferred", "{statement} has come, and waits for the end of what is in execution")
NOT_REACHED = Message("why.not-reached", "no way leads from {here} to {there}")
ANY_PIN = Message("why.any-pin", "any pin")
NO_AXIS_HAS_MOVED = Message("why.no-axis-has-moved", "no axis has moved until {time:g} s")
MOVES_WITHOUT_TARGET = Message("why.moves-without-target", "{axis} moves without a target")
MOVES_UNTIL = Message("why.moves-until", "{axis} moves until {pin} ends it")
IS_IN_A_LOOP = Message("why.is-in-a-loop", "{controller} is in the loop of {statement}")
DELAY_LASTS = Message("why.delay-lasts", "the time of {name} runs until {time:.6f} s")
HAS_COUNTED = Message("why.has-counted", "{name} has counted {count} of {preset}")
IS_ELSEWHERE = Message("why.is-elsewhere", "{workpiece} is at {place:.6g} mm of {belt}, and {name} takes one at {at:g} mm")
NONE_IS_ON = Message("why.none-is-on", "no workpiece is on {belt}, and {name} takes one at {at:g} mm")
HAS_NO_INPUT = Message("why.has-no-input", "{axis} homes without end: no input is configured that could end it")

_Asked: TypeAlias = "str | tuple[str, Resource]"
"""A signal, or what a statement of a controller reads."""
_Links: TypeAlias = Generator[ChainLink, None, Sequence[_Asked]]


class PresentStates:
    """Finds present states. ``world`` is at the moment; ``most``: limit of the number of signals."""

    def __init__(self, causes: Causes, world: Simulation, most: int) -> None:
        self._causes = causes
        self._log = causes.log
        self._world = world
        self._at: Nanos = world.now
        self._most = most
        self._off: set[tuple[str, StatementLocation]] = set()
        """Statements of interrupts that are off, of which that is known."""
        self.has_all = True
        """Whether none have been left out because of ``most``."""

    def of(self, asked: Sequence[_Asked], waits: str = "") -> Iterator[ChainLink]:
        """The states of these and, one after the other, of what they depend on. ``waits``: the controller that waits for them, of
        which that is known."""
        waiting, seen = list(asked), set[_Asked]()
        while waiting and sum(isinstance(one, str) for one in seen) < self._most:
            one = waiting.pop(0)
            if one not in seen:
                seen.add(one)
                waiting += yield from (self._signal(one, waits) if isinstance(one, str) else self._resource(*one))
        self.has_all &= seen.issuperset(waiting)

    def interrupted(self, controller: str, wanted: Resource) -> Iterator[ChainLink]:
        """The switches of the interrupts that change something, who set them, and the states of the events that they wait for."""
        yield from self.of((yield from self._interrupts(controller, wanted)))

    def _disabled(self, controller: str, use: StatementUse, writing: StatementLocation) -> Iterator[ChainLink]:
        """The switches of an interrupt that are off, who set them, and the statement that is not executed therefore."""
        programs = self._world.programs[controller]
        off = [switch for switch in use.acts_by if not programs.read(switch.name, self._at)]
        if off:
            yield ChainLink(self._at, controller, OF_INTERRUPT(statement=statement_at(programs, writing)))
        for switch in off:
            yield from self._switch(controller, switch)

    def waits(self, controller: str, use: StatementUse) -> bool:
        """Whether a program waits at a statement that it has executed last, which may be over."""
        return use.waits and not self._world.kind(controller).is_idle(self._world.controller(controller), self._at)

    def awaited(self, controller: str) -> Iterator[ChainLink]:
        """Those for which the program of a controller waits, or which the loop reads in which it is."""
        programs, last = self._causes.programs, self._log.last_executed(controller, self._at)
        use = programs.use(controller, last)
        is_waiting = self.waits(controller, use) and programs.polling(controller, last) is None
        loop = [] if is_waiting else programs.conditions_of_loop(controller, last, has_waits=True)
        reads = use.reads if is_waiting else [one for number in loop for one in programs.use(controller, number).reads]
        if is_waiting and not reads:
            yield ChainLink(self._at, controller, WAITS_FOR_A_TIME())
        yield from self.of([(controller, one) for one in reads], controller)
        for where in self._world.programs[controller].deferred():
            label = self._world.programs[controller].use(where)
            yield ChainLink(self._at, controller, IS_DEFERRED(statement=statement_at(self._world.programs[controller], where)))
            yield from self.of([(controller, one) for one in label.reads], controller)

    def motion(self, controller: str, number: str) -> Iterator[ChainLink]:
        """Motions of an axis, of all if ``number`` is empty, that need something to end."""
        for axis, pin in self._endless(controller, number):
            text = MOVES_UNTIL(axis=axis, pin=f"{controller}.{pin}") if pin else HAS_NO_INPUT(axis=axis) if pin == "" else None
            yield ChainLink(self._at, controller, text or MOVES_WITHOUT_TARGET(axis=axis))

    def ending(self, controller: str, number: str) -> list[str]:
        """The inputs that can end those motions."""
        return [f"{controller}.{pin}" for _, pin in self._endless(controller, number) if pin]

    def _endless(self, controller: str, number: str) -> Iterator[tuple[str, str | None]]:
        for plan in self._log.plans_in_force(controller, number, self._at):
            record = self._log.record(plan)
            profile = profile_of(record.plan())
            if profile.segments and profile.end is None:
                pin = self._world.kind(controller).ends_motion(self._world.controller(controller), int(record.subject))
                yield f"{controller}.M{record.subject}", pin

    def _signal(self, name: str, waits: str) -> _Links:
        owner = name.partition(".")[0]
        yield ChainLink(self._at, owner, self._causes.state(name, self._at))
        is_held = self._log.hold(name, self._at) is not None
        if not is_held:
            yield from self._ended(name) if owner in self._world.controllers else self._under_way(name)
        others = () if owner == waits or is_held else (yield from self._not_written(name, is_of_other=bool(waits)))
        drivers = self._causes.drivers(name, self._at)
        return (*self._causes.holding.deciding(name, drivers, self._at), *others)

    def _ended(self, name: str) -> Iterator[ChainLink]:
        """The statement of which the level of an output is the end, such as that of a pulse."""
        changed = None if self._causes.drivers(name, self._at) else self._log.since(name, self._at)
        last = None if changed is None else self._causes.last((name,), self._at)
        by = None if last is None else last.before()
        if last is not None and by is not None and by.place.time < last.place.time and by.link.subject == last.link.subject:
            yield by.link

    def _under_way(self, name: str) -> Iterator[ChainLink]:
        """The delay of an element that lasts, or what a cylinder stands at before the end to which its valve sends it."""
        owner, _, terminal = name.partition(".")
        part = next((parts[owner] for parts in self._world.objects.elements.values() if owner in parts), None)
        match part:
            case Relay() | Brake() | Timer():
                due = part.deadline()
                if due is not None and due > self._at and terminal.upper() in part.block.outputs:
                    yield ChainLink(self._at, owner, DELAY_LASTS(name=owner, time=due / SECOND))
            case Counter() if not self._log.level(name, self._at):
                yield ChainLink(self._at, owner, HAS_COUNTED(name=owner, count=part.count, preset=part.preset))
            case Cylinder() if part.blockers and terminal.upper() == (EXTENDED if part.wanted > 0 else RETRACTED):
                jams = [one for one in self._causes.axes.jams(owner) if one.time <= self._at]
                axes = self._causes.axes
                yield from (axes.rotor_event(owner, one).link for one in jams if axes.holds_rotor(one, jams))
            case Carrier() if terminal.upper() == HELD and not self._log.level(name, self._at):
                yield from self._not_there(owner, part)

    def _not_there(self, owner: str, carrier: Carrier) -> Iterator[ChainLink]:
        """Where the next workpiece of a belt is that something would take which is switched on."""
        spec, inputs = self._causes.specs[owner], [one for one in carrier.block.levels if one not in carrier.block.outputs]
        belt = self._world.objects.built(CONVEYOR).get(getattr(spec, "source", None) or "")
        is_on = all(carrier.block.is_on(one) for one in inputs if one != PLACE)
        if not isinstance(spec, CarrierSpec) or belt is None or not is_on or carrier.is_occupied(self._at):
            return
        places = {
            one.workpiece.name: belt.belt.to_nm(one.front(belt.belt.position(self._at))) / NANOMETRES
            for one in belt.belt.workpieces
        }
        before = {name: place for name, place in places.items() if place < spec.pick_at}
        if places:
            next_one = max(before, key=before.__getitem__) if before else min(places, key=places.__getitem__)
            words = IS_ELSEWHERE(workpiece=next_one, place=places[next_one], belt=belt.spec.name, name=owner, at=spec.pick_at)
        else:
            words = NONE_IS_ON(belt=belt.spec.name, name=owner, at=spec.pick_at)
        yield ChainLink(self._at, belt.spec.name, words)

    def _resource(self, controller: str, resource: Resource) -> _Links:
        """Links and signals of the thing that a statement waits for."""
        if resource.kind is ResourceKind.PIN and resource.name:
            return [f"{controller}.{resource.name}"]
        if resource.kind is ResourceKind.ENCODER:
            value = self._world.programs[controller].read(f"ENC{resource.name}", self._at)
            if value is not None:
                yield ChainLink(self._at, controller, IS(signal=f"ENC{resource.name}", value=f"{value:g}"))
            counted = self._causes.axes.counted(controller, resource.name, self._at)
            if counted is not None:
                yield counted.link
            return ()
        if resource.kind is ResourceKind.AXIS:
            motion = self._causes.axes.motion(controller, resource.name, self._at)
            if motion is None and self._log.reaches_begin():
                yield ChainLink(self._at, controller, NO_AXIS_HAS_MOVED(time=self._at / SECOND))
            elif motion is not None:
                yield motion.link
            yield from self.motion(controller, resource.name)
            return self.ending(controller, resource.name)
        if resource.kind is ResourceKind.REQUEST and self._log.reaches_begin():
            if self._causes.controllers.written(controller, resource.name, self._at) is None:
                yield ChainLink(self._at, controller, NEVER_SET(name=resource.name))
        elif resource.kind not in (ResourceKind.ORIGIN, ResourceKind.REQUEST):
            yield ChainLink(self._at, controller, self._value(controller, resource))
        return (yield from self._interrupts(controller, resource))

    def _interrupts(self, controller: str, wanted: Resource) -> _Links:
        """The switches of the interrupts that change something, and who set them. Returns the events of those that are on."""
        events: list[_Asked] = []
        for use, label, writing in self._causes.interrupts.changing(controller, wanted):
            disabled = list(self._disabled(controller, use, writing)) if wanted not in use.acts_by else []
            if disabled:
                yield from disabled
                for switch in use.acts_by if (controller, writing) not in self._off else ():
                    self._off.add((controller, writing))
                    events += yield from self._before(controller, switch)
                continue
            programs, events = self._world.programs[controller], [*events, *((controller, one) for one in use.reads)]
            has_come = label in programs.deferred() or self._causes.interrupts.has_come(controller, label, self._at)
            if not has_come and wanted not in use.acts_by:
                words = OF_AWAITED_INTERRUPT(statement=statement_at(programs, writing), label=statement_at(programs, label))
                yield ChainLink(self._at, controller, words)
            for switch in use.acts_by:
                yield from self._switch(controller, switch)
        return events

    def _switch(self, controller: str, switch: Resource) -> Iterator[ChainLink]:
        """The switch of an interrupt, and who set it."""
        yield ChainLink(self._at, controller, self._value(controller, switch))
        last = self._log.last_executed(controller, self._at)
        written = self._causes.programs.resource(controller, switch, last + 1, self._at)
        if written is not None:
            yield written.link

    def _value(self, controller: str, resource: Resource) -> MessageText:
        programs, at = self._world.programs[controller], self._at
        point = programs.point(resource.name)
        known = f"{controller}.{point}" if point else ""
        if self._log.points.series(known) is not None:
            return self._causes.state(known, at)
        value = programs.read(resource.name, at) if resource.name else None
        if value is None:
            return DEPENDS_ON(name=resource.name or ANY_PIN())
        written = self._causes.programs.resource(controller, resource, self._log.last_executed(controller, at) + 1, at)
        if written is None:
            return (
                IS_NOT_SET(name=resource.name, value=value)
                if self._log.reaches_begin()
                else IS(signal=resource.name, value=value)
            )
        return IS_STILL(name=resource.name, value=value, time=written.place.time / SECOND)

    def _not_written(self, signal: str, *, is_of_other: bool) -> _Links:
        """Reason why a program has not changed an output that it can change; the supply that its controller lacks.
        ``is_of_other``: another program waits for the output."""
        owner, _, pin = signal.partition(".")
        programs, at = self._causes.programs, self._at
        if owner not in self._world.controllers or self._causes.drivers(signal, at):
            return ()
        supply = programs.supply_off(owner, at)
        if supply is not None:
            return [supply]
        stands = programs.stands(owner, at)
        if stands is not None and not programs.may_write(owner, pin):
            if stands.place.order >= 0 and not self._world.programs[owner].texts:  # what it would go on with is not known
                yield stands.link
            return ()
        waiting, wanted = self._log.last_executed(owner, at), Resource(ResourceKind.PIN, pin)
        comes = waiting < 0 or programs.leads_to(owner, waiting, wanted, at)
        if is_of_other and not comes and programs.is_written(owner, wanted):
            yield from self._stands(owner, waiting)
        return (yield from self._before(owner, wanted))

    def _stands(self, controller: str, index: int) -> Iterator[ChainLink]:
        """The end to which a program has come, or the wait at which it stands."""
        here, programs = self._log.executed[controller][index], self._causes.programs
        use = programs.use(controller, index)
        if programs.stands(controller, self._at) is not None:
            return
        if programs.is_over(controller, index, self._at):
            yield ChainLink(here.time, controller, programs.end(controller, index))
        elif use.reads and self.waits(controller, use):
            words = WAITS(controller=controller, statement=statement(self._log, here))
            yield ChainLink(self._at, controller, words, is_stand=True)

    def _unreached(self, controller: str, index: int, wanted: Resource) -> Iterator[ChainLink]:
        """The statement that would change something, if no way leads there."""
        here, programs = self._log.executed[controller][index], self._world.programs[controller]
        if here.location.text in programs.texts:
            places = [StatementLocation(here.location.text, one) for one in range(len(programs.statements(here.location.text)))]
            writing = next((one for one in places if wanted in programs.use(one).writes), None)
            if writing is not None:
                words = NOT_REACHED(here=statement(self._log, here), there=statement_at(programs, writing))
                yield ChainLink(self._at, controller, words)

    def before(self, controller: str, wanted: Resource) -> Iterator[ChainLink]:
        """Reason why a program has not changed something, and the states on which that depends."""
        waiting = yield from self._before(controller, wanted)
        yield from self.of(waiting)

    def _before(self, owner: str, wanted: Resource) -> _Links:
        """Wait or loop that stands between a program and what it can change, or what holds the program. Returns what it waits
        for."""
        log, programs, at = self._log, self._causes.programs, self._at
        held, index = programs.stands(owner, at), log.last_executed(owner, at)
        comes = index >= 0 and programs.leads_to(owner, index, wanted, at)
        if held is not None:
            yield held.link if held.place.order >= 0 or log.reaches_begin() else replace(held.link, time=at)
            by = held.before()
            if by is not None:
                yield by.link
            if comes or index < 0:
                return ()
        elif owner in self._world.programs and not comes:
            is_missed = index >= 0 and programs.written(owner, wanted, index + 1) is None
            if (
                is_missed
                and not any(self._causes.interrupts.changing(owner, wanted))
                and not programs.decided_against(owner, wanted, at)
            ):
                yield from self._unreached(owner, index, wanted)
            return (yield from self._interrupts(owner, wanted))
        if index < 0:
            return ()
        here, use = log.executed[owner][index], programs.use(owner, index)
        against = None if use.reads and comes else programs.decided_against(owner, wanted, at)
        if against is not None:
            yield against.link
            there = self._causes.of(against.place.time) or self._causes
            reads = [(owner, one) for one in there.programs.use(owner, (against.place.number - 2) // 3).reads]
            return [*reads, *(yield from self._interrupts(owner, wanted))]
        if held is not None:
            return ()
        conditions = () if use.waits and use.reads else programs.conditions_of_loop(owner, index)
        if not conditions and self.waits(owner, use) and at - here.time > self._world.programs[owner].statement_time:
            yield ChainLink(at, owner, WAITS(controller=owner, statement=statement(log, here)), is_stand=True)
            return [*((owner, one) for one in use.reads), *(yield from self._interrupts(owner, wanted))]
        if conditions:
            words = programs.loop(owner, conditions)
            yield ChainLink(at, owner, IS_IN_A_LOOP(controller=owner, statement=words), is_stand=True)
        return [(owner, one) for number in conditions for one in programs.use(owner, number).reads]
