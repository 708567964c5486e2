"""The causes of what programs execute."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from functools import cache, partial
from typing import Any

from steptwin.controller import MILLISECOND, Nanos
from steptwin.datasheet import EventSeverity
from steptwin.messages import Message, MessageText
from steptwin.simulation.kinds.programs import ProgramState, Resource, ResourceKind, StatementLocation, StatementUse
from steptwin.why.answer import ChainLink, Cover
from steptwin.why.chain import Cause, FoundCause, Place, along, covered, given, nothing, unknown
from steptwin.why.log import LAST, Change, Executed, words_of
from steptwin.why.programstates import OVER, StateChange
from steptwin.why.sentences import END_OF_PROGRAM, statement

WAS_EXECUTED = Message("why.was-executed", "{statement} was executed")
WAS_IN_EXECUTION = Message("why.was-in-execution", "{statement} was in execution before")
WAITS = Message("why.waits", "{controller} waits at {statement}")
ENDED = Message("why.ended", "{statement} ended")
GAVE_BEFORE = Message("why.gave-before", "{what}, which gave {name} its value before")
DID_NOT_WAIT = Message("why.did-not-wait", "{statement} did not wait: {levels}")
WAS_OVER = Message("why.was-over", "{statement} did not wait")
DECIDED = Message("why.decided", "{statement} decided: {next} came next")
CAME = Message("why.came", "{statement} came")
FARTHER = Message("why.farther", "the last {most} statements did not decide it: those before were not searched")
NEVER_SET = Message("why.never-set", "nothing has set {name}")
NOT_STARTED = Message("why.not-started", "nothing has started the program")
HELD = {
    ProgramState.STOPPED: Message("why.program-is-stopped", "the program is stopped{where}"),
    ProgramState.PAUSED: Message("why.program-is-paused", "the program is paused{where}"),
    ProgramState.KILLED: Message("why.program-is-killed", "the program is stopped by Kill{where}"),
    ProgramState.LIMITED: Message("why.program-is-limited", "the program is stopped by LIMIT{where}"),
    ProgramState.SHUT_DOWN: Message("why.program-is-shut-down", "the controller is off or shut down{where}"),
}
WHERE = Message("why.where", " at {statement}")
CAME_TO_ITS_END = Message("why.came-to-its-end", "the program came to its end{where}")
FILTERED = Message("why.filtered", ", which the filter of the input lets in after {ms:g} ms")
TOO_SHORT = Message("why.too-short", ", for {lasts:g} ms: the filter of the input lets in what lasts {ms:g} ms")
GOES_ON = Message("why.program-goes-on", "the program goes on")
PROGRAM_STARTED = Message("why.program-started", "the program started")
LONGEST_REACTION_NS: Nanos = 510 * MILLISECOND
"""Limit of the time after which a statement goes on when what it waits for has come: inputs may be filtered for 500 ms."""
MOST_BEFORE_WAIT = 20
"""Limit of the statements between the command of a motion and a wait for its end."""
MOST_UNDECIDED = 5000
"""Limit of the statements among which the one that decided is looked for."""


class ProgramCauses:
    """Finds what let statements be executed. ``causes`` has the causes of everything else."""

    def __init__(self, causes: Any) -> None:  # Causes, which imports this module
        self._all = causes
        self._log = causes.log
        self._world = causes.log.world
        self._uses: dict[tuple[str, StatementLocation], StatementUse] = {}

    def use(self, controller: str, index: int) -> StatementUse:
        """Reads and changes of an executed statement; none if its text was replaced since."""
        executed = self._log.executed[controller][index]
        given = self._log.given.get((controller, executed.location))
        if given is not None or not self._log.is_of_present_text(executed):
            return given or StatementUse()
        key = controller, executed.location
        found = self._uses.get(key)
        if found is None:
            found = self._uses[key] = self._world.programs[controller].use(key[1])
        return found

    def is_written(self, controller: str, wanted: Resource) -> bool:
        """Whether a statement of the present programs changes something, other than by ending the program."""
        programs = self._world.programs[controller]
        for text in programs.texts:
            for number in range(len(programs.statements(text))):
                writes = programs.use(StatementLocation(text, number)).writes
                if wanted in writes or (wanted._replace(name="") in writes and not any(_is_program(one) for one in writes)):
                    return True
        return False

    def may_write(self, controller: str, point: str) -> bool:
        """Whether a program of a controller may change a point: of an output, whether a statement does."""
        if point in self._world.controllers[controller].pins():
            return self.is_written(controller, Resource(ResourceKind.PIN, point))
        return bool(self._world.programs[controller].texts)

    def decided_against(self, controller: str, wanted: Resource, at: Nanos) -> FoundCause:
        """The last evaluation by a moment of a condition that decides whether a statement that changes something is executed."""
        programs, governing = self._world.programs[controller], set[StatementLocation]()
        for text in programs.texts:
            uses = [programs.use(StatementLocation(text, number)) for number in range(len(programs.statements(text)))]
            writing = [number for number, use in enumerate(uses) if wanted in use.writes]
            governing |= {
                StatementLocation(text, number)
                for number, use in enumerate(uses)
                if not use.waits and any(one in use.governs for one in writing)
            }
        executed = self._log.executed[controller]
        index = self._log.last_of(controller, governing, self._log.last_executed(controller, at) + 1)
        before = self._log.executed_before(controller, governing) if index is None else None
        if before is not None:
            there = self._all.of(min(before + self._world.programs[controller].statement_time, at))  # with the next one
            return None if there is None else there.programs.decided_against(controller, wanted, before)
        if index is None or not self._log.is_of_present_text(executed[index]):
            return None
        here, place = executed[index], Place(executed[index].time, executed[index].order, 3 * index + 2)
        link, reads = (
            ChainLink(here.time, controller, self._decision(controller, index)),
            self._all_read(controller, index, place),
        )
        before = (lambda: reads[0]) if reads else self._all.at_begin
        besides = lambda: (*reads[1:], *self._unchanged(controller, index, place))  # noqa: E731
        return Cause(link, place, before, Cover.LEVEL, besides)

    def leads_to(self, controller: str, index: int, wanted: Resource, at: Nanos) -> bool:
        """Whether the program can still come from an executed statement to one that changes something, without an interrupt. One
        that gives an output the level that it has at a moment does not change it."""
        location, programs = self._log.executed[controller][index].location, self._world.programs[controller]
        if not self._log.is_of_present_text(self._log.executed[controller][index]):
            return False
        numbers = set(programs.reached(location.text, (location.number,)))
        following = [one for one in programs.after(location.text).get(location.number, ()) if one in numbers]
        if location.number not in programs.reached(location.text, following):
            numbers.discard(location.number)  # it is executed, and does not come again
        others = [one for one in self._all.interrupts.handlers(controller, location.text) if location.number not in one]
        signal = f"{controller}.{wanted.name}"
        level = self._log.level(signal, at) if wanted.kind is ResourceKind.PIN and self._log.has(signal) else None
        uses = [programs.use(StatementLocation(location.text, one)) for one in numbers if not any(one in of for of in others)]
        return any(wanted in use.writes and (level is None or use.sets != level) for use in uses)

    def before(self, controller: str, wanted: Resource, at: Nanos, place: Place | None = None) -> FoundCause:
        """Cause for which no statement has changed something by a moment: the program is held, has decided against it, or waits
        before it, at a place; None if that is not known."""
        if controller not in self._world.programs or not self.is_written(controller, wanted):
            return None
        held = self.prevented(controller, wanted, at)
        index = self._log.last_executed(controller, at)
        is_held = self.stands(controller, at) is not None
        waits = not is_held and index >= 0 and self.use(controller, index).waits
        comes = waits and self.leads_to(controller, index, wanted, at)
        return along(self.waiting(controller, index, place), [held]) if comes else held

    def made_in_vain(self, controller: str, wanted: Resource, at: Nanos) -> FoundCause:
        """The last statement by a moment that would have changed something until what it waited for was there, which it was."""
        if controller not in self._world.programs:
            return None
        writing = self.writing(controller, wanted)
        index = self.last_of(controller, writing, self._log.last_executed(controller, at) + 1)
        if index is None:
            return None
        is_over = self.use(controller, index).waits and index < self._log.last_executed(controller, at)
        return covered(self._did_not_wait(controller, index), Cover.LEVEL) if is_over else None

    def waiting(self, controller: str, index: int, place: Place | None = None) -> Cause:
        """A wait that is not over, and what it waits for, at a place; by default when it began."""
        found, here = self.statement(controller, index), self._log.executed[controller][index]
        text = WAITS(controller=controller, statement=statement(self._log, here))
        at = found.place if place is None else place
        link = ChainLink(at.time, controller, text, is_stand=True)
        besides = partial(self._unchanged, controller, index, at)
        if place is None:
            return found._replace(link=link, cover=Cover.WAIT, besides=besides)
        return Cause(link, place, partial(given, covered(found, Cover.WAIT)), Cover.WAIT, besides)

    def prevented(self, controller: str, wanted: Resource, at: Nanos) -> FoundCause:
        """Cause that holds a program at a moment, or the condition that decided against a statement that changes something; both
        where the program could not come to one any more when it was held."""
        held, index = self.stands(controller, at), self._log.last_executed(controller, at)
        if held is not None and (index < 0 or self.leads_to(controller, index, wanted, at)):
            return held
        against = self.decided_against(controller, wanted, at)
        return held if against is None else against._replace(along=() if held is None else (held,))

    def last_of(self, controller: str, locations: Collection[StatementLocation], before: int) -> int | None:
        """As that of the log, which is to have it."""
        found = self._log.last_of(controller, locations, before)
        if found is None and self._log.executed_before(controller, locations) is not None:
            self._log.lack()
        return found

    def statement(self, controller: str, index: int) -> Cause:
        """A statement was executed."""
        executed = self._log.executed[controller][index]
        text, place = statement(self._log, executed), Place(executed.time, executed.order, 3 * index + 1)
        if self._log.is_in_progress(executed):
            return Cause(ChainLink(executed.time, controller, WAS_IN_EXECUTION(statement=text)), place, unknown)
        link = ChainLink(executed.time, controller, WAS_EXECUTED(statement=text))
        return Cause(link, place, partial(self._of_executed, controller, index), besides=partial(self._values, controller, index))

    def _values(self, controller: str, index: int) -> Iterator[Cause]:
        """Values that an executed statement makes others of, or acts by."""
        use, here = self.use(controller, index), self._log.executed[controller][index]
        for one in (*(use.reads if use.writes and not use.waits else ()), *use.acts_by):
            is_written = (one in use.reads and one in use.writes) or one.kind is ResourceKind.ORIGIN  # that of its motion
            value = None if is_written else self.resource(controller, one, index, here.time, here.order)
            if value is not None:
                yield value._replace(cover=Cover.LEVEL)
            elif is_written and one.kind is ResourceKind.VALUE:
                yield from self._made_of(controller, one, index)

    def _made_of(self, controller: str, value: Resource, index: int) -> Iterator[Cause]:
        """The last change of a value of which an executed statement makes its next one; not what was before that, such as the
        earlier counts of a counter."""
        here = self._log.executed[controller][index]
        found = self.resource(controller, value, index, here.time, here.order)
        if found is not None:
            text = GAVE_BEFORE(name=value.name, what=found.link.text)
            yield found._replace(link=replace(found.link, text=text), cover=Cover.LEVEL, besides=tuple)

    def _of_executed(self, controller: str, index: int) -> FoundCause:
        """Value that a statement reads, if it has changed since the last execution, so that another one was written, or of the
        first execution since that was decided; otherwise what let it be executed."""
        use = self.use(controller, index)
        if self._log.executed[controller].locations[index].number < 0:
            return self._of_statement(controller, index)
        reads = [one for one in use.reads if one not in use.writes]
        if not reads or not use.writes or use.waits:
            return self._of_statement(controller, index)
        before, decided = self._executed_before(controller, index), None
        here, since = self._log.executed[controller][index], Place(-1)
        if before is None:
            decided = self._of_statement(controller, index)
            since = Place(here.time) if decided is None else decided.place
        else:
            since = before
        found = [cause for one in reads if (cause := self.resource(controller, one, index, here.time, here.order))]
        changed = max((cause for cause in found if cause.place > since), key=lambda cause: cause.place, default=None)
        if changed is not None:
            moves = any(one.kind is ResourceKind.AXIS for one in use.writes)  # when it was executed matters, too
            led = self._of_statement(controller, index) if moves else None
            return changed._replace(cover=Cover.LEVEL, along=(*changed.along, *(() if led is None else (led,))))
        return self._of_statement(controller, index) if decided is None else decided

    def _executed_before(self, controller: str, index: int) -> Place | None:
        """The execution of a statement before this one."""
        here = (self._log.executed[controller].locations[index],)
        before = self._log.last_of(controller, here, index)
        if before is not None:
            last = self._log.executed[controller][before]
            return Place(last.time, last.order, 3 * before + 2)
        since = self._log.executed_before(controller, here)
        return None if since is None else Place(since, LAST)

    def conditions_of_loop(self, controller: str, index: int, *, has_waits: bool = False) -> Sequence[int]:
        """The numbers of the conditions that were evaluated since a statement was executed before; none without a loop, or with a
        wait for more than a time in it, unless ``has_waits``."""
        here = (self._log.executed[controller].locations[index],)
        before = self.last_of(controller, here, index)
        loop = [] if before is None else list(range(before, index))
        if not has_waits and any((use := self.use(controller, one)).waits and use.reads for one in loop):
            return []
        last = {self._log.executed[controller].locations[one]: one for one in loop}
        return [one for one in last.values() if (use := self.use(controller, one)).governs or use.is_loop]

    def polling(self, controller: str, index: int) -> int | None:
        """The number of the statement since which a program does nothing but go round in a loop that reads something; None where
        it does not."""
        conditions = self.conditions_of_loop(controller, index)
        executed, programs = self._log.executed[controller], self._world.programs[controller]
        before = self.last_of(controller, (executed.locations[index],), index)
        if before is None or not any(self.use(controller, one).reads for one in conditions):
            return None
        text = executed.locations[index].text
        numbers = [one.number for one in executed.locations[before:index]]
        loop = range(min(numbers), max(numbers) + 1)
        uses = [programs.use(StatementLocation(text, one)) for one in loop]
        if any(one.writes or (one.waits and one.reads) for one in uses):
            return None
        handlers = self._all.interrupts.handlers(controller, text)
        first = index
        for earlier in range(index - 1, max(-1, index - MOST_UNDECIDED), -1):
            where = executed.locations[earlier]
            if where.text == text and where.number in loop:
                first = earlier
            elif not any(where.number in one for one in handlers):
                return first
        if index < MOST_UNDECIDED:
            self._log.lack()
        return first if first == 0 else None

    def loop(self, controller: str, conditions: Sequence[int]) -> MessageText:
        """A loop in words, by the condition that decides about most statements."""
        widest = max(conditions, key=lambda one: len(self.use(controller, one).governs))
        return statement(self._log, self.written_at(controller, widest))

    def written_at(self, controller: str, index: int) -> Executed:
        """An executed statement; the condition of a loop where it is written: at its beginning."""
        executed, use = self._log.executed[controller][index], self.use(controller, index)
        return executed._replace(location=executed.location._replace(number=use.governs.start - 1)) if use.is_loop else executed

    def values_at(self, controller: str, path: str) -> Iterator[Resource]:
        """The values that statements change which are a point of their controller."""
        programs, kind = self._world.programs[controller], self._world.kind(controller)
        every = (StatementLocation(text, one) for text in programs.texts for one in range(len(programs.statements(text))))
        written = dict.fromkeys(one for where in every for one in programs.use(where).writes if one.kind is ResourceKind.VALUE)
        for one in written:
            name = programs.point(one.name)
            point = None if name is None else kind.point(self._world.controller(controller), name)
            if point is not None and point.point.path.lower() == path.lower():
                yield one

    def _of_statement(self, controller: str, index: int) -> FoundCause:
        """The wait or condition that let a statement be executed; of a command that came over the line by itself that, or the
        wait behind which it stood."""
        led = self._led(controller, index)
        came = self._came(controller, index)
        if came is None:
            return led
        is_at_once = came.place.time >= self._log.executed[controller].times[index]
        if is_at_once or led is None or led.place <= came.place or led.link.text == PROGRAM_STARTED():
            return came if is_at_once else self._released(controller, index, came)
        return led._replace(along=(came,))

    def _released(self, controller: str, index: int, came: Cause) -> Cause:
        """The frame with a command, or the one that let it be executed later, such as the end of its file."""
        times = self._log.executed[controller].times
        while index and times[index] - times[index - 1] <= self._world.programs[controller].statement_time:
            index -= 1
        here = self._log.executed[controller][index]
        last = self._all.controllers.frame_at(controller, here.time, here.order)
        return came if last is None or last.link == came.link else last._replace(along=(came,), cover=Cover.FRAME)

    def _came(self, controller: str, index: int) -> FoundCause:
        """The frame with an executed statement that came over a line by itself."""
        is_given = self._log.executed[controller].locations[index].number < 0
        return self._all.controllers.given(controller, index) if is_given else None

    def _led(self, controller: str, index: int) -> FoundCause:
        executed = self._log.executed[controller]
        number = executed[index].location.number
        at_once, after = self._world.programs[controller].statement_time, index
        is_present = self._log.is_of_present_text(executed[index])
        handlers = self._all.interrupts.handlers(controller, executed[index].location.text) if is_present else ()
        begun = self._log.last_begin(controller, executed[index].time, executed[index].order)
        for earlier in range(index - 1, max(-1, index - MOST_UNDECIDED), -1):
            if begun is not None and executed[earlier].order < begun.order:
                return self._began(controller, after, begun)
            use, here, ended = self.use(controller, earlier), executed[earlier], executed[after]
            if any(here.location.number in handler and number not in handler for handler in handlers):
                continue  # an interrupt that came and returned
            if use.jumps is not None and ended.location.number == use.jumps <= number:
                number = here.location.number
            if use.waits and ended.time - here.time > at_once:
                came = self._came(controller, after)
                if came is not None and came.place.time >= ended.time:
                    return came  # the wait was over before that
                return self.decided(controller, earlier, Place(ended.time, ended.order, 3 * after), True)
            resumed = self._resumed(controller, here.order, ended)
            if resumed is not None:
                return resumed
            if use.waits and not use.governs and any(one.kind is not ResourceKind.AXIS for one in use.reads):
                first, there = self.begin_of_wait(controller, earlier), Place(ended.time, ended.order, 3 * after)
                began = Place(executed[first].time, executed[first].order, 3 * first)
                came = any(cause.place > began for cause in self._read(controller, first, there))
                return self.decided(controller, first, there, True) if came else self._did_not_wait(controller, earlier)
            if use.waits and not use.governs and (ignored := self._ignored(controller, earlier)) is not None:
                text = DID_NOT_WAIT(statement=statement(self._log, here), levels=[ignored.link.text])
                place = Place(here.time, here.order, 3 * earlier + 2)
                return Cause(ChainLink(here.time, controller, text), place, lambda: ignored, Cover.PROGRAM)
            if number in use.governs or (use.is_loop and ended.location.number >= use.governs.stop):
                return self.decided(controller, earlier, Place(here.time, here.order, 3 * earlier + 2))
            after = earlier
        if index >= MOST_UNDECIDED:
            here, text = executed[after], FARTHER(most=MOST_UNDECIDED)
            place = Place(here.time, here.order, 3 * after)
            return Cause(ChainLink(here.time, controller, text), place, nothing, Cover.PROGRAM)
        return self._began(controller, after, begun) if begun is not None else self._started(controller)

    def _ignored(self, controller: str, index: int) -> FoundCause:
        """The event by which a command was ignored whose motion a statement would have waited for."""
        executed, here = self._log.executed[controller], self._log.executed[controller][index]
        moves = (one for one in range(index - 1, max(-1, index - MOST_BEFORE_WAIT), -1) if _moves(self.use(controller, one)))
        command = next(moves, None)
        axes = ("", *(str(one) for one in range(1, len(self._world.controllers[controller].axes) + 1)))
        events = (self._log.last_axis_event(controller, one, here.time, here.order) for one in axes)
        event = max((one for one in events if one is not None), key=lambda one: one.order, default=None)
        if event is None or command is None or not executed[command].order < event.order < executed[command + 1].order:
            return None
        return covered(self._all.controllers.axis_event(controller, event, Place(event.time, event.order)), Cover.PROGRAM)

    def begin_of_wait(self, controller: str, index: int) -> int:
        """The number of the statement at which a wait began, which goes on after each interrupt."""
        locations = self._log.executed[controller].locations
        first, earlier = index, index - 1
        here = self._log.executed[controller][index]
        handlers = self._all.interrupts.handlers(controller, here.location.text) if self._log.is_of_present_text(here) else ()
        begun = self._log.last_begin(controller, here.time, here.order)
        orders = self._log.executed[controller].orders
        while (earlier >= 0 and (begun is None or orders[earlier] > begun.order)) and (
            locations[earlier] == locations[index] or any(locations[earlier].number in handler for handler in handlers)
        ):
            first = earlier if locations[earlier] == locations[index] else first
            earlier -= 1
        if earlier < 0:
            self._log.lack()
        return first

    def _decision(self, controller: str, index: int) -> MessageText:
        """A condition, with the statement at which the program went on; the label of an interrupt."""
        executed, use, words = self._log.executed[controller], self.use(controller, index), self.written_at(controller, index)
        if use.waits and use.governs:
            return CAME(statement=statement(self._log, words))
        is_inside = self._all.interrupts.has(controller, index)
        later = (one for one in range(index + 1, len(executed)) if is_inside or not self._all.interrupts.has(controller, one))
        after = next(later, None)
        if after is None:
            return WAS_EXECUTED(statement=statement(self._log, words))
        return DECIDED(statement=statement(self._log, words), next=statement(self._log, executed[after]))

    def decided(self, controller: str, index: int, place: Place, has_ended: bool = False) -> Cause:
        use, words = self.use(controller, index), statement(self._log, self.written_at(controller, index))
        text = ENDED(statement=words) if has_ended else self._decision(controller, index)
        link = ChainLink(place.time, controller, text)
        if has_ended:
            return Cause(link, place, partial(self._of_wait, controller, index, place), Cover.PROGRAM)
        if use.waits and use.governs and not use.reads:  # an interrupt that comes with the time
            return Cause(link, place, nothing, Cover.PROGRAM, partial(self._all.interrupts.enabled, controller, index, place))
        led = cache(partial(self._of_decision, controller, index, place))

        def besides() -> Iterator[Cause]:
            yield from (one for one in led()[1:] if one is not None)
            yield from self._unchanged(controller, index, place)
            if use.waits and use.governs:
                yield from self._all.interrupts.enabled(controller, index, place)

        return Cause(link, place, lambda: led()[0], Cover.PROGRAM, besides)

    def _unchanged(self, controller: str, index: int, place: Place) -> Iterator[Cause]:
        """Causes for all that a condition reads and that has had its value from the beginning."""
        time, order, number = place
        for one in self.use(controller, index).reads if self._log.reaches_begin() else ():
            name = f"{controller}.{one.name}"
            if one.name and self.resource(controller, one, index, time, order) is None:
                is_pin = one.kind is ResourceKind.PIN and self._log.since(name, time) is None
                is_value = one.kind is ResourceKind.VALUE and self._is_variable(controller, one.name)
                if is_pin:
                    yield self._all.unchanged(name, Place(time, order, number - 1))
                elif is_value:
                    yield Cause(ChainLink(time, controller, NEVER_SET(name=one.name)), Place(time, order, number - 1), nothing)
                elif one.kind is ResourceKind.PIN and (short := self.unseen(controller, one.name, time)) is not None:
                    yield short

    def _is_variable(self, controller: str, name: str) -> bool:
        programs = self._world.programs[controller]
        return name in programs.variables(self._world.now) or not programs.has_name(name)

    def _did_not_wait(self, controller: str, index: int) -> Cause:
        """A wait for something that was there already: for that, or for what led to the wait, whichever came later."""
        here, use = self._log.executed[controller][index], self.use(controller, index)
        place = Place(here.time, here.order, 3 * index + 2)
        pins = [f"{controller}.{one.name}" for one in use.reads if one.kind is ResourceKind.PIN and one.name]
        levels, words = [self._all.state(pin, here.time) for pin in pins], statement(self._log, here)
        text = DID_NOT_WAIT(statement=words, levels=levels) if levels else WAS_OVER(statement=words)

        def found() -> Sequence[Cause]:
            there = [cause._replace(cover=Cover.LEVEL) for cause in self._read(controller, index, place)]
            led = self._of_statement(controller, index)
            return sorted((*there, *(() if led is None else (led,))), key=lambda one: one.place, reverse=True)

        def besides() -> Iterator[Cause]:
            yield from found()[1:]
            for one in self._unchanged(controller, index, place):
                yield from one.besides()

        return Cause(ChainLink(here.time, controller, text), place, lambda: next(iter(found()), None), Cover.PROGRAM, besides)

    def _read(self, controller: str, index: int, place: Place) -> Iterator[Cause]:
        """The last changes of what a statement reads."""
        for resource in self.use(controller, index).reads:
            cause = self.resource(controller, resource, place.number // 3, place.time, place.order)
            if cause is not None:
                yield cause

    def _of_decision(self, controller: str, index: int, place: Place) -> Sequence[FoundCause]:
        """The changes by which what a condition reads has had its values since; of one that is new, also what led to it, if that
        came later."""
        if self.use(controller, index).waits and self.use(controller, index).governs:
            reads = list(self._all.interrupts.edges(controller, index, place))
            times, axes = self._log.executed[controller].times, [one for one in self.use(controller, index).reads if one.name]
            before = (one for one in range(index - 1, -1, -1) if times[one] == place.time)
            acted = next((one for one in before if set(axes) & set(self.use(controller, one).writes)), None)
            by = None if acted is None else self.statement(controller, acted)
            late = self._all.interrupts.late(controller, index, reads, place)
            return (*late, *reads) or (by,)  # what it broke into has not led to an interrupt
        reads = self._all_read(controller, index, place)
        before = None if self.use(controller, index).waits else self._executed_before(controller, index)
        latest = place.time - LONGEST_REACTION_NS
        is_recent = reads and (before is None or reads[0].place > before or reads[0].place.time > latest)
        if reads and (self.use(controller, index).waits or (before is not None and is_recent)):
            return reads
        led = self._of_statement(controller, index)
        if reads and before is not None:  # it is evaluated again, and only the time is another one
            return reads if led is None else (*reads, led)
        return (led, *reads) if not reads or (led is not None and led.place > reads[0].place) else reads

    def _all_read(self, controller: str, index: int, place: Place) -> Sequence[Cause]:
        """The last changes of what a condition reads, the latest one first."""
        found = sorted(self._read(controller, index, place), key=lambda one: one.place, reverse=True)
        return [one._replace(cover=Cover.LEVEL) for one in found]

    def _of_wait(self, controller: str, index: int, place: Place) -> FoundCause:
        """Change that a statement waited for, which came while it did, at most `LONGEST_REACTION_NS` before its end. A wait for a
        time depends on what led to it."""
        reads, began = self.use(controller, index).reads, self._log.executed[controller][index]
        resumed = self._resumed(controller, began.order, began._replace(time=place.time, order=place.order))
        led = None if resumed is None else covered(self._of_statement(controller, index), Cover.WAIT)
        others = () if resumed is None else (resumed._replace(along=() if led is None else (led,)),)
        if all(resource.kind is ResourceKind.VALUE for resource in reads):
            came = [
                cause for cause in self._read(controller, index, place) if cause.place > Place(began.time, began.order, 3 * index)
            ]
            last = max((*came, *others), key=lambda cause: cause.place, default=None)
            if last is None:  # a time has passed, since a timer was set or the wait began
                led = self._of_statement(controller, index)
                last = along(next(iter(self._all_read(controller, index, place)), None), [led])
            return covered(last, Cover.WAIT)
        latest = place.time - LONGEST_REACTION_NS
        passes = any(resource.kind is ResourceKind.AXIS and resource.name for resource in reads)  # a place, not the end
        is_turned = any(resource.kind is ResourceKind.ENCODER for resource in reads)
        came = [
            cause
            for cause in self._read(controller, index, place)
            if is_turned or (passes if cause.cover is Cover.MOTION else cause.place.time >= latest)
        ]
        pins = [f"{controller}.{one.name}" for one in reads if one.kind is ResourceKind.PIN and one.name]
        came += others
        if not came and len(pins) == 1 and self._log.since(pins[0], place.time) is None:  # a filter lets it in later
            return covered(self.first(controller, next(one for one in reads if one.kind is ResourceKind.PIN)), Cover.LEVEL)
        last = place.number // 3 - 1
        if not came and last > index:  # the interrupt that it went on after
            came = [self.statement(controller, last)]
        return covered(max(came, key=lambda cause: cause.place, default=None), Cover.WAIT)

    def resource(self, controller: str, resource: Resource, index: int, time: Nanos, before: int = LAST) -> FoundCause:
        """The last change of what a statement reads by a moment, before an order."""
        match resource.kind:
            case ResourceKind.PIN:
                every = [name for name in self._log.first_levels if name.startswith(f"{controller}.")]
                read = [f"{controller}.{resource.name}"] if resource.name else every
                lasts = self.filtering(controller, resource.name)
                seen = self._seen(controller, resource.name, time, before, lasts) if lasts else None
                last = seen if lasts else self._all.last(read, time, before=before)
                return self._all.lasting(read, time, last, before)
            case ResourceKind.AXIS:
                return self._all.axes.motion(controller, resource.name, time, before=before)
            case ResourceKind.ORIGIN:
                return self._all.axes.origin(controller, resource.name, time, before)
            case ResourceKind.ENCODER:
                return self._all.axes.counted(controller, resource.name, time, before, index)
            case ResourceKind.REQUEST:
                return self._all.controllers.written(controller, resource.name, time, before)
            case ResourceKind.VALUE:
                return self._register(controller, resource, time, before) or self.written(controller, resource, index)
        return None

    def written(self, controller: str, resource: Resource, index: int) -> FoundCause:
        """The last statement before one that changed something."""
        writing = self.writing(controller, resource)
        earlier = self._log.last_of(controller, writing, index)
        if earlier is not None:
            return covered(self.statement(controller, earlier), Cover.LEVEL)
        since = self._log.executed_before(controller, writing)
        there = None if since is None else self._all.of(since)
        if since is not None and there is not None:
            number = there.log.last_executed(controller, since) + 1
            if resource.kind is ResourceKind.PIN:  # what a statement gave it, which may have changed nothing
                return there.programs.written(controller, resource, number)
            return there.programs.resource(controller, resource, number, since)
        return None

    def _seen(self, controller: str, pin: str, time: Nanos, before: int, lasts: Nanos) -> FoundCause:
        """The last change of an input by a moment that its filter has let in, which takes a time; None without such a change."""
        signal, how = f"{controller}.{pin}", FILTERED(ms=lasts / MILLISECOND)
        later: Nanos = time
        came: Change | None = None  # the first one since the last that was let in with another level
        is_other = False
        for change in self._log.changes_before(signal, time, before):
            if later - change.time >= lasts:
                is_other = came is not None and change.value != came.value
                if is_other:
                    break
                came = change
            later = change.time
        begin, level = self._log.begin, self._log.first_levels.get(signal, 0.0)
        if came is not None and (is_other or not self._log.reaches_begin() or came.value != level):
            return self._all.change(signal, came, how)
        if came is None and level and self._log.reaches_begin() and later - begin < lasts:
            return self._all.first(signal, how)
        since = None if came is not None else self._log.before(signal).since
        there = None if since is None else self._all.of(since)
        if there is None or there is self._all:
            return None
        return there.programs._seen(controller, pin, later, LAST, lasts)

    def unseen(self, controller: str, pin: str, time: Nanos, after: Nanos = -1) -> FoundCause:
        """The last change of an input by a moment, after another one, that its filter has not let in; of one that bounced the
        longest level."""
        signal, lasts, later = f"{controller}.{pin}", self.filtering(controller, pin), time
        level: float | None = None  # that its filter let in last
        short: list[tuple[Change, Nanos]] = []
        for change in self._log.changes_before(signal, time) if lasts else ():
            length, later = later - change.time, change.time
            if length < lasts:
                short += [(change, length)] if change.time > after else ()
            elif level is None:
                level = change.value
            if length >= lasts and (short or change.time <= after):
                break
        else:
            if lasts and later == time and self._log.begin > max(after, 0):
                since = self._log.before(signal).since
                there = None if since is None or since <= after else self._all.of(since)
                return None if there is None or there is self._all else there.programs.unseen(controller, pin, time, after)
            if later - self._log.begin < lasts:
                self._log.lack()  # what was short may have begun before
        if level is None and short and self._log.reaches_begin():
            level = self._log.first_levels.get(signal, 0.0) if later - self._log.begin >= lasts else 0.0
        others = [one for one in short if level is not None and one[0].value != level]
        found = max(others, key=lambda one: one[1], default=None)
        if found is None:
            return None
        how = TOO_SHORT(lasts=found[1] / MILLISECOND, ms=lasts / MILLISECOND)
        return covered(self._all.change(signal, found[0], how), Cover.LEVEL)

    def first(self, controller: str, pin: Resource) -> Cause:
        """The level of an input before the log, which its filter lets in."""
        lasts = self.filtering(controller, pin.name)
        return self._all.first(f"{controller}.{pin.name}", FILTERED(ms=lasts / MILLISECOND) if lasts else None)

    def filtering(self, controller: str, pin: str) -> Nanos:
        """How long a level must last at an input before a program sees it."""
        return self._world.kind(controller).filter_of(self._world.controllers[controller], pin)

    def writing(self, controller: str, resource: Resource) -> Collection[StatementLocation]:
        """The statements that change something."""
        programs = self._world.programs[controller]
        every = (StatementLocation(text, one) for text in programs.texts for one in range(len(programs.statements(text))))
        given = (location for (owner, location), use in self._log.given.items() if owner == controller and resource in use.writes)
        return {*(one for one in every if resource in programs.use(one).writes), *given}

    def _register(self, controller: str, resource: Resource, time: Nanos, before: int) -> FoundCause:
        """The last change of a register of a controller that a program has a name for, by a moment, before an order."""
        point = self._world.programs[controller].point(resource.name)
        return None if point is None else self._all.controllers.register(controller, point, resource, time, before)

    def held(self, controller: str, at: Nanos, before: int = LAST) -> FoundCause:
        """Since when, and by what, the program of a controller is not executed at a moment, before an order; None if it is."""
        change = self._log.states.last(controller, at, before)
        if change is None or change.state is ProgramState.RUNS:
            return None
        if change.order < 0:
            is_off = self.supply_off(controller, at) is not None
            text = HELD[ProgramState.SHUT_DOWN if is_off else change.state](where="")
            is_stopped = self._log.reaches_begin() and not is_off and change.state is ProgramState.STOPPED
            link, place = ChainLink(change.time, controller, NOT_STARTED() if is_stopped else text), Place(change.time)
            return Cause(link, place, self._all.at_begin, Cover.LEVEL, partial(self._holding, controller, change))
        where = ""
        index = self._log.last_executed(controller, change.time)
        if change.state is not ProgramState.STOPPED and index >= 0 and not self._may_be_over(controller, index, change.time):
            where = WHERE(statement=statement(self._log, self._log.executed[controller][index]))
        text = HELD[change.state](where=where)
        if change.state is ProgramState.STOPPED and index >= 0 and self._is_end(controller, index, change):
            text = self.end(controller, index)
        link = ChainLink(change.time, controller, text)
        by = partial(self._all.controllers.of_program, controller, change)
        return Cause(link, Place(change.time, change.order), by, Cover.LEVEL, partial(self._holding, controller, change))

    def _may_be_over(self, controller: str, index: int, at: Nanos) -> bool:
        """Whether a program may have been over by a moment, with no motion of its last command going on."""
        is_last = self._log.executed[controller].locations[index].number < 0 or self.is_last(controller, index)
        return is_last and not (_moves(self.use(controller, index)) and self._all.axes.is_moving(controller, "", at))

    def _is_end(self, controller: str, index: int, change: StateChange) -> bool:
        """Whether the statement that was executed last ended its program when that was stopped."""
        here = self._log.executed[controller][index]
        is_last = here.time == change.time and here.order < change.order
        return is_last and any(map(_is_program, self.use(controller, index).writes))

    def end(self, controller: str, index: int) -> MessageText:
        """Sentence about a program of which a statement was the last one."""
        words = statement(self._log, self._log.executed[controller][index])
        return CAME_TO_ITS_END(where="" if words.id == END_OF_PROGRAM.id else WHERE(statement=words))

    def is_last(self, controller: str, index: int) -> bool:
        """Whether only the end of its text comes after an executed statement."""
        executed, programs = self._log.executed[controller][index], self._world.programs[controller]
        text, number = executed.location
        if number < 0 or not self._log.is_of_present_text(executed):
            return False
        return tuple(programs.after(text).get(number, ())) == (len(programs.statements(text)),)

    def is_over(self, controller: str, index: int, at: Nanos) -> bool:
        """Whether a program has come to its end by a moment, and is not known to wait there."""
        change, use = self._log.states.last(controller, at, LAST), self.use(controller, index)
        if change is not None and change.state is not ProgramState.RUNS:
            return change.state is ProgramState.STOPPED and self._is_end(controller, index, change)
        is_of_axes = bool(use.reads) and all(one.kind is ResourceKind.AXIS for one in use.reads)
        waits = use.waits and not (is_of_axes and not self._all.axes.is_moving(controller, "", at))
        return not waits and self.is_last(controller, index)

    def ended(self, controller: str, index: int, at: Nanos) -> FoundCause:
        """The alarm by a moment with which a program was ended after the statement that it executed last; None if none was."""
        here = self._log.executed[controller][index]
        for event in reversed(self._log.axis_events.get((controller, ""), ())):
            if event.order < here.order:
                break
            record = self._log.record(event)
            if event.time <= at and dict(record.facts).get("stops") is True:
                link = ChainLink(event.time, controller, words_of(record))
                led = partial(self._of_alarm, controller, index, event)
                return Cause(link, Place(event.time, event.order), led, Cover.LEVEL)
        return None

    def _of_alarm(self, controller: str, index: int, event: Change) -> FoundCause:
        """The line that came after the statement and had to wait for it, if the alarm is about that; else the statement."""
        last = covered(self.statement(controller, index), Cover.WAIT)
        came = self._all.controllers.came(controller, self._log.executed[controller][index], event)
        return last if came is None else covered(came._replace(along=() if last is None else (last,)), Cover.WAIT)

    def _holding(self, controller: str, change: StateChange) -> Iterator[Cause]:
        """The levels and values that hold a program in its state."""
        time, index = change.time, self._log.last_executed(controller, change.time) + 1
        for one in self._world.programs[controller].holding.get(change.state, ()):
            came = self.resource(controller, one, index, time, change.order)
            if came is not None and came.place < Place(time, change.order):
                yield came._replace(cover=Cover.LEVEL)
            elif one.kind is ResourceKind.PIN and self._log.reaches_begin():
                text = self._all.state(f"{controller}.{one.name}", time)
                yield Cause(ChainLink(time, controller, text), Place(time, change.order, -1), nothing)

    def stands(self, controller: str, at: Nanos) -> FoundCause:
        """As `held`, or `ended`; of a program that was never started the attempt to start it, if there was one."""
        held, index = self.held(controller, at), self._log.last_executed(controller, at)
        if held is None and index >= 0:
            return self.ended(controller, index, at)
        if held is None:  # what ended the program of a chip was before
            self._log.lack()
            return None
        if held.place.order >= 0:
            return held
        return self.alarm(controller, at) or held

    def alarm(self, controller: str, at: Nanos) -> FoundCause:
        """The last event of a controller by a moment, if it is an alarm: such as a start that was not possible."""
        event = self._log.last_axis_event(controller, "", at)
        sheet = self._world.kind(controller).datasheet(self._world.controller(controller))
        alarms = {one.code for one in sheet.events if one.severity is EventSeverity.ALARM}
        if event is None or self._log.record(event).subject not in alarms:
            return None
        place = Place(event.time, event.order)
        by = partial(self._all.controllers.commanded, controller, event, None)
        link = ChainLink(event.time, controller, words_of(self._log.record(event)))
        return Cause(link, place, by, Cover.LEVEL, partial(self._started_by, controller, event))

    def _started_by(self, controller: str, event: Change) -> Iterator[Cause]:
        """The registers by which a start acts."""
        registers = self._world.kind(controller).registers
        for use in () if registers is None else registers.uses("").values():
            for one in use.acts_by:
                found = self._all.controllers.register(controller, one.name, None, event.time, event.order)
                if found is not None:
                    yield found

    def supply_off(self, controller: str, at: Nanos) -> str | None:
        """The signal of the supply of a controller that does not feed it at a moment."""
        good = f"{self._world.objects.supplied.get(controller, '')}.good"
        return good if self._log.has(good) and not self._log.level(good, at) else None

    def _resumed(self, controller: str, since: int, until: Executed) -> FoundCause:
        """The end of a pause in a program after an order, before a statement."""
        change = self._log.states.last(controller, until.time, until.order)
        if change is None or change.state is not ProgramState.RUNS or change.order < since:
            return None
        before = self._log.states.last(controller, change.time, change.order)
        held = None if before is None or before.state in OVER else self.held(controller, change.time, change.order)
        if held is None:
            return None
        by, place = partial(self._all.controllers.of_program, controller, change), Place(change.time, change.order)
        return Cause(ChainLink(change.time, controller, GOES_ON()), place, by, Cover.PROGRAM, lambda: [held])

    def _began(self, controller: str, index: int, begin: Change) -> Cause:
        """The first statement of a program since that began anew."""
        first = self._log.executed[controller][index]
        place = Place(first.time, first.order, 3 * index)
        begun = self._all.controllers.begun(controller, begin)
        return Cause(ChainLink(first.time, controller, PROGRAM_STARTED()), place, lambda: begun, Cover.PROGRAM)

    def _started(self, controller: str) -> FoundCause:
        """The statement that was executed first."""
        if not self._log.reaches_begin():
            return None
        first = self._log.executed[controller][0]
        return Cause(ChainLink(first.time, controller, PROGRAM_STARTED()), Place(first.time, first.order), nothing, Cover.PROGRAM)


def _moves(use: StatementUse) -> bool:
    return any(one.kind is ResourceKind.AXIS for one in use.writes)


def _is_program(resource: Resource) -> bool:
    return resource.kind is ResourceKind.PROGRAM
