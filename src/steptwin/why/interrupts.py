"""The causes for which interrupts of programs came, or did not."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

from steptwin.controller import Nanos
from steptwin.messages import Message
from steptwin.simulation.kinds.programs import Resource, ResourceKind, StatementLocation, StatementUse
from steptwin.why.answer import ChainLink, Cover
from steptwin.why.chain import Cause, Place, covered, given
from steptwin.why.sentences import statement_at

OF_INTERRUPT = Message("why.of-interrupt", "{statement} is executed by an interrupt that is off")
OTHER_EDGE = Message("why.other-edge", "{edge}: {label} comes with the other edge")
WHILE_OFF = Message("why.while-off", "{edge}, while {label} was off")
OF_AWAITED_INTERRUPT = Message("why.of-awaited-interrupt", "{statement} is executed by {label}, which has not come")


MOST_EDGES = 6
"""Limit of the changes of an input that are searched for one that an interrupt did not notice."""


class Missed(NamedTuple):
    """A change of an input that an interrupt, by its use and label, may have missed."""

    use: StatementUse
    label: StatementLocation
    signal: str
    edge: Cause


class InterruptCauses:
    """Finds them. ``causes`` has the causes of everything else."""

    def __init__(self, causes: Any) -> None:  # Causes, which imports this module
        self._all = causes
        self._log = causes.log
        self._world = causes.log.world
        self._handlers: dict[tuple[str, str], Sequence[range]] = {}

    def has(self, controller: str, index: int) -> bool:
        """Whether an executed statement stands in an interrupt."""
        executed = self._log.executed[controller][index]
        if not self._log.is_of_present_text(executed):
            return False
        return any(executed.location.number in one for one in self.handlers(controller, executed.location.text))

    def changing(self, controller: str, wanted: Resource) -> Iterator[tuple[StatementUse, StatementLocation, StatementLocation]]:
        """The interrupts in which a statement changes something, each with its label and the first such statement."""
        programs = self._world.programs[controller]
        for text in programs.texts:
            for handler in self.handlers(controller, text):
                places = [StatementLocation(text, number) for number in handler]
                writing = next((one for one in places[1:] if wanted in programs.use(one).writes), None)
                if writing is not None:
                    yield programs.use(places[0]), places[0], writing

    def has_come(self, controller: str, label: StatementLocation, at: Nanos) -> bool:
        """Whether an interrupt has come by a moment."""
        executed, labels = self._log.last_executed(controller, at) + 1, (label,)
        is_noted = self._log.last_of(controller, labels, executed) is not None
        return is_noted or self._log.executed_before(controller, labels) is not None

    def switched(self, controller: str, wanted: Resource, at: Nanos) -> Iterator[tuple[str, Cause]]:
        """The switches, written since, of the interrupt that changed something last and would have changed it again by a moment;
        each with the statement that is not executed while it is off, which leads to who wrote it."""
        writing = self._all.programs.writing(controller, wanted)
        handlers = [(text, one) for text in self._world.programs[controller].texts for one in self.handlers(controller, text)]
        is_changed = any(where.text == text and where.number in one for where in writing for text, one in handlers)
        if not is_changed or self._all.programs.stands(controller, at) is not None:
            return
        last = self._all.programs.last_of(controller, writing, self._log.last_executed(controller, at) + 1)
        if last is None or not self._log.is_of_present_text(self._log.executed[controller][last]):
            return
        text, number = self._log.executed[controller].locations[last]
        handler = next((one for where, one in handlers if where == text and number in one), range(0))
        uses = [self._world.programs[controller].use(StatementLocation(text, one)) for one in handler]
        if not handler or not _changes_again(uses, wanted):
            return
        label, since = StatementLocation(text, handler.start), self._log.executed[controller].times[last]
        words = OF_INTERRUPT(statement=statement_at(self._world.programs[controller], StatementLocation(text, number)))
        for switch in uses[0].acts_by:
            written = self._all.programs.resource(controller, switch, self._log.last_executed(controller, at) + 1, at)
            moment = -1 if written is None else written.place.time
            if written is not None and moment > since and self._comes_again(controller, label, last, moment, at):
                place = written.place._replace(number=written.place.number + 1)
                by = partial(given, covered(written, Cover.LEVEL))
                yield switch.name, Cause(ChainLink(moment, controller, words), place, by, Cover.LEVEL)

    def missed(self, controller: str, wanted: Resource, at: Nanos) -> Iterator[Missed]:
        """The changes by a moment of inputs by which interrupts come that would have changed something since it was changed last,
        the last ones first."""
        programs, index = self._all.programs, self._log.last_executed(controller, at) + 1
        for use, label, _ in self.changing(controller, wanted) if programs.stands(controller, at) is None else ():
            written = programs.written(controller, wanted, index)
            floor = Place(-1) if written is None else written.place
            last = None if written is None else programs.last_of(controller, programs.writing(controller, wanted), index)
            handler = next(one for one in self.handlers(controller, label.text) if label.number in one)
            uses = [self._world.programs[controller].use(StatementLocation(label.text, one)) for one in handler]
            is_own = last is not None and self._log.executed[controller].locations[last] in [
                StatementLocation(label.text, one) for one in handler
            ]
            if is_own and not _changes_again(uses, wanted):
                continue
            for pin in (one for one in use.reads if one.kind is ResourceKind.PIN and one.name):
                edge = programs.resource(controller, pin, index, at)
                for _ in range(MOST_EDGES):
                    if edge is None or edge.place <= floor:
                        break
                    if edge.place.time < self._log.begin:
                        self._log.lack()
                        break
                    yield Missed(use, label, f"{controller}.{pin.name}", edge)
                    edge = programs.resource(controller, pin, index, edge.place.time, edge.place.order)

    def unnoticed(self, controller: str, missed: Missed, how: Message = WHILE_OFF) -> Cause:
        """A change of an input while its interrupt was off, or, with `OTHER_EDGE`, the other way than that with which it comes;
        along with what had switched that."""
        edge = missed.edge
        words = how(edge=edge.link.text, label=statement_at(self._world.programs[controller], missed.label))
        by = [one for one in self.switched_by(controller, missed.use, edge.place.time) if one.place < edge.place]
        return edge._replace(link=replace(edge.link, text=words), cover=Cover.LEVEL, besides=lambda: (*edge.besides(), *by))

    def switched_by(self, controller: str, use: StatementUse, at: Nanos) -> Sequence[Cause]:
        """The last causes by a moment for which an interrupt is on or off."""
        index = self._log.last_executed(controller, at) + 1
        found = [self._all.programs.resource(controller, one, index, at) for one in use.acts_by]
        return [one._replace(cover=Cover.LEVEL) for one in found if one is not None]

    def _comes_again(self, controller: str, label: StatementLocation, index: int, since: Nanos, until: Nanos) -> bool:
        """Whether the event of an interrupt that had come before a statement comes again between two moments."""
        times, reads = self._log.executed[controller].times, self._world.programs[controller].use(label).reads
        came = self._all.programs.last_of(controller, (label,), index)
        if came is None:
            return False
        if not reads:  # it comes with the time
            before = self._all.programs.last_of(controller, (label,), came)
            return before is not None and until - times[came] > times[came] - times[before]
        pins = [f"{controller}.{one.name}" for one in reads if one.kind is ResourceKind.PIN]
        changes = ((self._log.level(pin, times[came]), one) for pin in pins for one in self._log.changes_before(pin, until))
        return any(one.time > since and one.value == level for level, one in changes)

    def edges(self, controller: str, index: int, place: Place) -> Iterator[Cause]:
        """The changes by which an interrupt came: of a pin the last one to the level that its switch makes it notice."""
        programs, use = self._all.programs, self._all.programs.use(controller, index)
        level = self._noticed(controller, use, place)
        for one in use.reads:
            found = programs.resource(controller, one, index, place.time, place.order)
            while (
                found is not None and level is not None and self._log.level(f"{controller}.{one.name}", found.place.time) != level
            ):
                found = programs.resource(controller, one, index, found.place.time, found.place.order)
            if found is not None:
                yield found._replace(cover=Cover.LEVEL)
            elif one.kind is ResourceKind.PIN and self._log.since(f"{controller}.{one.name}", place.time) is None:
                yield programs.first(controller, one)._replace(cover=Cover.LEVEL)  # its filter lets it in at the beginning

    def _noticed(self, controller: str, use: StatementUse, place: Place) -> float | None:
        """The level that a pin had to take so that an interrupt came; None where it may be either, or is not known."""
        now = self._world.now
        for switch in use.acts_by if use.edges else ():
            written = self._all.programs.resource(controller, switch, self._log.last_executed(controller, now) + 1, now)
            value = self._world.programs[controller].read(switch.name, now)
            if value is not None and (written is None or written.place < place):
                return dict(use.edges).get(value)
        return None

    def enabled(self, controller: str, index: int, place: Place) -> Iterator[Cause]:
        """Causes for which an interrupt was enabled."""
        for one in self._all.programs.use(controller, index).acts_by:
            found = self._all.programs.resource(controller, one, index, place.time, place.order)
            if found is not None:
                yield found

    def late(self, controller: str, index: int, reads: Sequence[Cause], place: Place) -> Iterator[Cause]:
        """The statement for whose end an interrupt waited after its event."""
        programs = self._all.programs
        pins = (one.name for one in programs.use(controller, index).reads if one.name)
        lasting = max((programs.filtering(controller, one) for one in pins), default=0)
        soon = lasting + 2 * self._world.programs[controller].statement_time
        lasted = index > 0 and self._log.executed[controller].times[index - 1] < place.time - soon
        if lasted and programs.use(controller, index - 1).waits and reads and reads[0].place.time < place.time - soon:
            yield programs.decided(controller, index - 1, Place(place.time, place.order, 3 * index), True)

    def handlers(self, controller: str, text: str) -> Sequence[range]:
        """The statements of each interrupt of a text, with the one that it begins with."""
        key = controller, text
        if key not in self._handlers:
            programs = self._world.programs[controller]
            found = [programs.use(StatementLocation(text, number)) for number in programs.labels(text).values()]
            self._handlers[key] = [range(use.governs.start - 1, use.governs.stop) for use in found if use.waits and use.governs]
        return self._handlers[key]


def _changes_again(handler: Sequence[StatementUse], wanted: Resource) -> bool:
    """Whether an interrupt that has changed something changes it when it comes again."""
    changing, made = [one for one in handler if wanted in one.writes], {one for use in handler for one in use.writes}
    return len(changing) > 1 or any(not made.isdisjoint(one.reads) for one in changing)
