"""Questions about a past: a signal, a condition, or a controller whose program waits."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from functools import partial
from itertools import islice
from typing import TypeAlias

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.later import finish
from steptwin.messages import Message, MessageText
from steptwin.simulation.kinds.programs import Resource, ResourceKind, StatementLocation, StatementUse
from steptwin.simulation.logic.expression import deciding, parse_condition
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.world.simulation import Simulation
from steptwin.simulation.world.snapshotlog import outside_past
from steptwin.why.answer import ALL_LINKS, MOST_LINKS, Answer, ChainLink, Cover
from steptwin.why.attempts import NOTHING_HAS_COMMANDED
from steptwin.why.causes import Causes
from steptwin.why.chain import Cause, Chain, FoundCause, Place, along, covered, nothing
from steptwin.why.controllers import axis_of
from steptwin.why.interrupts import OTHER_EDGE, Missed
from steptwin.why.log import LAST
from steptwin.why.notedpast import NotedPast, text_of_question, without_not
from steptwin.why.presentstates import IS_IN_A_LOOP, PresentStates
from steptwin.why.programs import WAITS
from steptwin.why.resting import RestingCauses
from steptwin.why.sentences import IS_NUMBER, statement, value_with_unit
from steptwin.why.states import is_constant, rest_of
from steptwin.why.values import SignalValues

MOST_BEFORE = 5
"""Limit of the causes between a workpiece that stays and the output that keeps it, with both."""
MOST_SNAPSHOTS = 8
"""Limit of the signals whose present levels are shown of what a program waits for."""


Asking: TypeAlias = Generator[None, None, Answer]
"""In parts: after each of them something else can be done, or the question be given up by `close`."""


def back_from(cause: FoundCause) -> Iterator[Cause]:
    """A cause and those before it, one after the other."""
    while cause is not None:
        yield cause
        cause = cause.before()


def _led_to(effect: Cause) -> Cause | None:
    """The causes of something that is asked for itself."""
    found = [covered(one, Cover.LEVEL) or one for one in (effect.before(), *effect.besides()) if one is not None]
    return found[0]._replace(along=(*found[0].along, *found[1:])) if found else None


IS_QUEUED = Message("why.is-queued", "`{command}` waits for the end of what is in execution")
IS_FILED = Message("why.is-filed", "`{command}` is in a file that has not ended")
IS_TRUE = Message("why.is-true", "{name} is true")
IS_FALSE = Message("why.is-false", "{name} is false")
DOES_NOT_WAIT = Message("why.does-not-wait", "{controller} does not wait: {statement}")
SCRIPT_WAITS = Message("why.script-waits", "script {name} waits until {condition}: that is false")
SCRIPT_DOES_NOT_WAIT = Message("why.script-does-not-wait", "script {name} waits for no condition at {at:g} s")
PROGRAM_IS = Message("why.program-is", "{controller}: {held}")
FORM_OF_A_QUESTION = Message(
    "why.form-of-a-question", "a question is a signal, a condition, or a controller: table.OUT3, 'table.OUT3 == 0', table"
)
NOTHING_EXECUTED = Message("why.nothing-executed", "{controller} has executed no statement")


class Why:
    """Answers questions about a past, which is run again when the first one is asked, and from the last change on once more for
    one about what is in no trace, such as a register."""

    def __init__(self, past: NotedPast) -> None:
        self.past, self.log, self.names, self.world = past, past.log, past.names, past.log.world
        self.values, self.resting = SignalValues(past), RestingCauses(past)
        self._most_links = MOST_LINKS

    @property
    def causes(self) -> Causes:
        """Those of the present programs."""
        return self.past.causes

    def fault_link(self, name: str, until: Nanos) -> ChainLink:
        """A fault that has acted by a moment, as a cause."""
        return self.causes.holding.fault_link(name, until)

    def ask(self, question: str, at: Nanos | None = None) -> Answer:
        """The answer for a moment (ns), the end by default. Raises `Misuse` for what is no question here."""
        return finish(self.asking(question, at))

    def asking(self, question: str, at: Nanos | None = None, most_links: int = MOST_LINKS) -> Asking:
        """As `ask`, in parts; the answer has at most so many links."""
        self._most_links = most_links
        moment, begin = self.past.end if at is None else at, self.log.begin
        if not begin <= moment <= self.past.end:
            raise Misuse(outside_past(moment, begin, self.past.end))
        text = text_of_question(question) or self._only_program()
        yield from self.past.running()
        if without_not(text) in self.world.controllers:
            return (yield from self._wait(without_not(text), moment))
        if self.names.is_script(text):
            return (yield from self._script(text, moment))
        variable = self.names.variable(text)
        if variable is not None:
            return (yield from self._of_variable(text, *variable, moment))
        return (yield from self._condition(text, moment))

    def _only_program(self) -> str:
        """The controller that is meant without a question."""
        controllers = [name for name, programs in self.world.programs.items() if programs.texts]
        if len(controllers) != 1:
            raise Misuse(FORM_OF_A_QUESTION())
        return controllers[0]

    def _condition(self, text: str, at: Nanos) -> Asking:
        asked = self.names.named(text)
        found = tuple(dict.fromkeys(parse_condition(asked).names()))
        is_bare = asked == found[0] if len(found) == 1 else False
        if is_bare and self.names.takes_values_between(asked):
            return (yield from self._moving(asked, at))
        canonical = {name: self.names.canonical(name) for name in found}
        if all(self.log.is_recorded(name) for name in canonical.values()):
            value, since = self.values.from_log(asked, canonical, at, is_bare=is_bare)
        else:
            value, since = yield from self.values.from_run(asked, canonical, at, is_bare=is_bare)
        since = self.log.before(asked).since if since is None else since
        state = IS_NUMBER(name=asked, value=value) if is_bare else IS_TRUE(name=asked) if value else IS_FALSE(name=asked)
        changed = None if since is None else self.causes.changes.of((*canonical.values(),), since)
        shown = [pin for full in canonical.values() if (pin := self.names.pin(full)) != full]
        canonical = {name: self.names.pin(full) for name, full in canonical.items()}
        signals = tuple(canonical.values())
        first = self.causes.lasting(signals, at, changed)
        first = self._with_refused(signals, at, since, first)
        first = along(first, [*self._unstopped(signals, at, since)])
        if first is not None or since is not None:
            holding = self.causes.holding.of(self._deciding(asked, canonical, at), at, since)
            others = (*self._unseen(shown, at, -1 if since is None else since), *self._again(signals, since, at))
            off = yield from self._switched_off(self.past.changeable(signals, at), at)
            queued = yield from self._queued(signals, at)
            present = yield from self._present(at)
            endless, pins = self._endless(present, signals, at)
            moved = (yield from self.resting.moved(pins, at)) if pins else None
            first = along(first, [*holding, *others, *off, *queued, moved])
            holding = self.causes.holding
            owners = {one: self.world.axes.get(one.removesuffix(".power")) for one in signals}
            given = [one if owners[one] is None else self.causes.axes.power_of(one.removesuffix(".power")) for one in signals]
            finds_nothing = partial(self.causes.workpieces.finds_nothing, at=at)
            told = [
                one for one in given if holding.remembers(one, at, {}) or any(map(finds_nothing, self.past.behind((one,), at)))
            ]
            states = [*endless, *present.of([one for one in (*told, *pins) if self.log.has(one)])]
            return self._after(present, states, (yield from self._answer(text, at, state, since, first)))
        waited = (*signals, *self.resting.awaited_pins(signals, at))
        resting = (yield from self.resting.moved(waited, at)) or self.resting.held(waited, at)
        resting = resting or (yield from self.resting.standing(signals, at))
        behind = self.past.behind(waited, at)
        is_kept = any(self.log.rates.has(name.partition(".")[0]) for name in behind)
        is_kept = is_kept or any(map(self.causes.workpieces.awaits, behind))
        is_kept = is_kept or self.causes.holding.depends(behind) or any(self.log.hold(name, at) for name in behind)
        if is_kept and self.log.reaches_begin():  # otherwise it is not known what was before
            decides = self._deciding(asked, canonical, at)
            holding = self.causes.holding.of((*decides, *self.resting.awaited_pins(decides, at)), at, None)
            resting = along(resting, list(holding))
        again = [*self._again(signals, None, at), *self._at_begin(signals, at)]
        awaited = list(self.resting.awaited(signals, at)) if resting is None else []
        came = [self.causes.programs.resource(*one, self.log.last_executed(one[0], at) + 1, at) for one in awaited]
        unseen = list(self._unseen((*shown, *waited[len(signals) :]), at, -1))
        off = yield from self._switched_off(dict.fromkeys((*awaited, *self.past.changeable(signals, at))), at)
        queued = yield from self._queued(signals, at)
        resting = self._commanded(resting, queued)
        resting = along(resting, [*(covered(one, Cover.LEVEL) for one in came), *off, *queued, *again, *unseen])
        answer = yield from self._answer(text, at, state, None, resting)
        present, named = (yield from self._present(at)), [name for name in signals if self.log.has(name)]
        states = [link for name in named for link in present.of([name])]
        says_more = resting is not None or len(states) > len(signals)
        says_more |= any(self.causes.drivers(name, at) or self.causes.undriven(name) is not None for name in signals)
        return self._after(present, states if says_more else [], answer)

    def _endless(self, present: PresentStates, signals: Sequence[str], at: Nanos) -> tuple[list[ChainLink], Sequence[str]]:
        """The motions at a moment of the axes that signals are about which do not end by themselves, and the inputs that end
        them."""
        links, pins = list[ChainLink](), list[str]()
        for controller, wanted in self.past.changeable(signals, at):
            if wanted.kind is ResourceKind.AXIS:
                links += present.motion(controller, wanted.name)
                pins += present.ending(controller, wanted.name)
        return links, pins

    def _again(self, signals: Sequence[str], since: Nanos | None, at: Nanos) -> Iterator[Cause]:
        """Events that began controllers anew, could have changed signals since, and have led to nothing."""
        for controller, wanted in self.past.changeable(signals, at):
            changed = self._changed_since(controller, wanted, since, at)
            found = self.causes.controllers.begun_in_vain(controller, wanted, changed, at)
            if found is not None:
                yield found

    def _at_begin(self, signals: Sequence[str], at: Nanos) -> Iterator[Cause]:
        """The statements at the very beginning that gave signals the values that they have from then on, and those that gave all
        outputs their values and did not change these."""
        for controller, wanted in self.past.changeable(signals, at):
            index, of_all = self.log.last_executed(controller, at) + 1, wanted._replace(name="")
            written = self.causes.programs.written(controller, wanted, index)
            if written is not None and not written.place.time:
                yield written
            elif written is None and self.causes.programs.is_written(controller, wanted):
                yield from filter(None, [self.causes.programs.written(controller, of_all, index)])

    def _switched_off(self, changeable: Iterable[tuple[str, Resource]], at: Nanos) -> Generator[None, None, Sequence[Cause]]:
        """The switches that are off of the interrupts that would have changed something again, and what they did not notice."""
        wanted = list(changeable)
        every = [(owner, *found) for owner, one in wanted for found in self.causes.interrupts.switched(owner, one, at)]
        missed = [(owner, found) for owner, one in wanted for found in self.causes.interrupts.missed(owner, one, at)]
        if not every and not missed:
            return ()
        other = yield from self.past.world_at(at)
        off = [cause for owner, switch, cause in every if not other.programs[owner].read(switch, at)]
        return [*off, *(yield from self._unnoticed(missed, other))]

    def _unnoticed(self, missed: Sequence[tuple[str, Missed]], other: Simulation) -> Generator[None, None, Sequence[Cause]]:
        """The last change that each interrupt did not notice, as it was off or waits for the other edge, and what has switched it
        on since. ``other``: a world in the state of the moment."""
        found: dict[tuple[str, StatementLocation], Sequence[Cause]] = {}
        levels: dict[tuple[str, StatementLocation], float | None] = {}
        others: dict[tuple[str, StatementLocation], tuple[str, Missed]] = {}  # changes the other way, of those that never came
        at = other.now
        for owner, one in missed:
            key, time = (owner, one.label), one.edge.place.time
            switched = self.causes.interrupts.switched_by(owner, one.use, at)
            if key not in levels:
                levels[key] = yield from self._noticed(owner, one.use, switched, other)
            if key in found or levels[key] not in (None, self.log.level(one.signal, time)):
                is_first = key not in others and not self.causes.interrupts.has_come(owner, one.label, at)
                others |= {key: (owner, one)} if is_first else {}
                continue
            came = min(at, time + self.causes.programs.filtering(owner, one.signal.partition(".")[2]))
            then = yield from self.past.world_at(came)
            if not _is_on(then, owner, one.use):
                later = [cause for cause in switched if cause.place.time > came] if _is_on(other, owner, one.use) else []
                found[key] = (self.causes.interrupts.unnoticed(owner, one), *later)
        wrong = [self.causes.interrupts.unnoticed(*one, OTHER_EDGE) for key, one in others.items() if key not in found]
        return [*wrong, *(cause for causes in found.values() for cause in causes)]

    def _noticed(
        self, controller: str, use: StatementUse, switched: Sequence[Cause], other: Simulation
    ) -> Generator[None, None, float | None]:
        """The level that an input has to take so that an interrupt comes, by its switch now or before that was written last: 1
        where that was off, too; None where it may be either."""
        levels = dict(use.edges)
        for time in (other.now, *(cause.place.time - 1 for cause in switched if cause.place.time)) if levels else ():
            if time < self.log.begin:
                self.log.lack()
                return None
            world = other if time == other.now else (yield from self.past.world_at(time))
            value = next((world.programs[controller].read(one.name, time) for one in use.acts_by), None)
            if value in levels:
                return levels[value]
        return 1.0 if levels else None

    def _queued(self, signals: Sequence[str], at: Nanos) -> Generator[None, None, Sequence[Cause]]:
        """Commands that would have changed something otherwise than it was changed last, and wait behind others, or that its
        controller did not hear."""
        found: list[Cause] = []
        programs = self.causes.programs
        for controller, wanted in self.past.changeable(signals, at):
            index = self.log.last_executed(controller, at)
            since = self.log.since(f"{controller}.{wanted.name}", at) if wanted.kind is ResourceKind.PIN else None
            unheard = self.causes.controllers.unheard(controller, wanted, at, -1 if since is None else since)
            found += [] if unheard is None else [unheard]
            if wanted.kind is ResourceKind.VALUE or controller not in self.world.objects.line_of:
                continue
            other = yield from self.past.world_at(at)
            waiting = next((one for one in reversed(other.programs[controller].queued()) if wanted in one.use.writes), None)
            last = programs.written(controller, wanted, index + 1)
            if waiting is None or (last is not None and waiting.code in str(last.link.text).upper()):
                continue
            if index < 0 and not waiting.is_filed:  # what it waits behind was before
                self.log.lack()
            elif waiting.is_filed or programs.use(controller, index).waits:
                ahead = None if waiting.is_filed else programs.held(controller, at)
                ahead = ahead or (None if waiting.is_filed else programs.waiting(controller, index, Place(at, LAST, -3)))
                sent = self.causes.controllers.sent(controller, waiting.code, index + 1, at)
                text = (IS_FILED if waiting.is_filed else IS_QUEUED)(command=waiting.code)
                led = partial(along, sent, [ahead])
                found.append(Cause(ChainLink(at, controller, text), Place(at, LAST, -1), led, Cover.LEVEL))
        return found

    def _commanded(self, cause: FoundCause, queued: Sequence[Cause]) -> FoundCause:
        """A cause that an axis was not commanded to move, unless a command waits."""
        if cause is None or not queued:
            return cause
        if cause.link.text.id == NOTHING_HAS_COMMANDED.id:
            return None
        before = cause.before()
        is_none = before is not None and before.link.text.id == NOTHING_HAS_COMMANDED.id
        return cause._replace(before=nothing) if is_none else cause

    def _unseen(self, pins: Iterable[str], at: Nanos, after: Nanos) -> Iterator[Cause]:
        """The last changes of inputs after a moment that were too short for their filters."""
        for owner, _, pin in (one.partition(".") for one in pins):
            found = self.causes.programs.unseen(owner, pin, at, after)
            if found is not None:
                yield found

    def _with_refused(self, signals: Iterable[str], at: Nanos, since: Nanos | None, first: FoundCause) -> FoundCause:
        """A cause along with the requests that would have written one of these registers since, and were refused."""
        for name in signals:
            owner, _, rest = name.partition(".")
            if owner in self.world.controllers and self.world.kind(owner).registers is not None:
                refused = self.causes.controllers.refused(owner, (rest,), at, after=-1 if since is None else since)
                if refused is None and owner in self.world.objects.line_of and (since is None or since < self.log.begin):
                    self.log.lack()
                elif refused is not None:
                    first = refused if first is None else first._replace(along=(*first.along, refused))
        return first

    def _unstopped(self, signals: Sequence[str], at: Nanos, since: Nanos | None) -> Iterator[Cause]:
        """The requests since a moment that would have changed the motions of axes that are under way, and were not served."""
        for controller, wanted in self.past.changeable(signals, at):
            registers = self.world.kind(controller).registers if wanted.kind is ResourceKind.AXIS else None
            if registers is not None and self.causes.axes.is_moving(controller, wanted.name, at):
                after = -1 if since is None else since
                names = registers.uses(wanted.name)
                yield from filter(None, [self.causes.controllers.refused(controller, names, at, after=after)])

    def _deciding(self, asked: str, canonical: Mapping[str, str], at: Nanos) -> tuple[str, ...]:
        """The signals of a condition without whose values it would be otherwise; none where some are not noted."""
        signals = tuple(canonical.values())
        if len(signals) < 2 or not all(map(self.log.is_recorded, signals)):
            return signals if len(signals) < 2 else ()

        def value(name: str) -> float:
            return self.log.level(canonical[name], at)

        node = parse_condition(asked).in_unit("", self.names.unit)
        parts = deciding(node, value, wanted=not node.value(value))
        return tuple(dict.fromkeys(canonical[name] for one in parts for name in one.names()))

    def standing(self, answer: Answer) -> Mapping[str, bool]:
        """The controllers whose programs would else have changed what an answer is about since: True for those that are held,
        False for those that wait for something before statements that would change its output or variable. `asking` comes
        first."""
        text, at, log, programs = text_of_question(answer.question), answer.at, self.log, self.causes.programs
        found: dict[str, bool] = {}
        if self.names.is_script(text) or without_not(text) in log.world.controllers:
            return found
        names = self.past.names_in(text)
        waiting = {*self.past.changeable([one for one in names if self._is_set(one) or self.causes.holding.depends([one])], at)}
        waiting |= set(self._kept(names, at))
        for controller, wanted in self.past.changeable(names, at):
            index, since = log.last_executed(controller, at), self._changed_since(controller, wanted, answer.since, at)
            if index < 0 and wanted.kind is ResourceKind.AXIS and log.world.programs[controller].texts:
                log.lack()  # the program may have come to its end before
            is_over = (
                wanted.kind is ResourceKind.AXIS and since is not None and index >= 0 and programs.is_over(controller, index, at)
            )
            if index < 0 or not (is_over or programs.leads_to(controller, index, wanted, at)) or self._is_unpowered(names, at):
                continue
            held = programs.held(controller, at) or programs.ended(controller, index, at)
            if is_over and held is None and programs.is_written(controller, wanted):
                found[controller] = False
            elif held is not None:
                is_later = since is None or held.place.order < 0 or held.place.time > since
                if (is_later or wanted.kind is ResourceKind.AXIS) and self.past.tried(controller, wanted, at) is None:
                    found[controller] = True
            elif (controller, wanted) in waiting and wanted.kind is (ResourceKind.VALUE if since is None else ResourceKind.PIN):
                use = programs.use(controller, index)
                begin = index if use.waits and use.reads else programs.polling(controller, index)
                begun = at if begin is None else log.executed[controller][begin].time
                if (since or 0) <= begun < at - log.world.programs[controller].statement_time:
                    found.setdefault(controller, False)
        return found

    def is_undriven(self, question: str) -> bool:
        """Whether a question is about signals that nothing can change but from outside."""
        text = text_of_question(question)
        if self.names.is_script(text) or without_not(text) in self.world.controllers:
            return False
        return all(self.causes.undriven(name) is not None for name in self.past.names_in(text))

    def _is_unpowered(self, names: Sequence[str], at: Nanos) -> bool:
        """Whether all signals are those of axes without current: no program moves them."""
        axes = [name.partition(".")[0] for name in names]
        powers = [self.causes.axes.power_of(axis) if axis in self.world.axes else "" for axis in axes]
        return bool(powers) and all(power and not self.log.level(power, at) for power in powers)

    def _kept(self, names: Sequence[str], at: Nanos) -> Iterator[tuple[str, Resource]]:
        """The outputs whose last changes keep workpieces where signals are as they are because of them."""
        causes = self.causes
        held = [
            one for name in names if name in self.log.changes for one in causes.holding.of((name,), at, self.log.since(name, at))
        ]
        led = {one.place for cause in held for one in islice(back_from(cause), MOST_BEFORE)}
        for controller, wanted in self.past.changeable(names, at) if led else ():
            last = causes.last((f"{controller}.{wanted.name}",), at) if wanted.kind is ResourceKind.PIN else None
            if last is not None and last.place in led:
                yield controller, wanted

    def _is_set(self, name: str) -> bool:
        """Whether it is an output that a program sets, or a variable."""
        owner, _, pin = name.partition(".")
        is_output = owner in self.world.programs and pin in self.past.pins(name) and self.causes.programs.may_write(owner, pin)
        return is_output or self.names.variable(name) is not None

    def _changed_since(self, controller: str, wanted: Resource, since: Nanos | None, at: Nanos) -> Nanos | None:
        """Since when something is so at a moment, or an output that it follows later."""
        changed = self.log.since(f"{controller}.{wanted.name}", at) if wanted.kind is ResourceKind.PIN else None
        return since if changed is None or since is None else min(changed, since)

    def _of_variable(self, text: str, controller: str, name: str, at: Nanos) -> Asking:
        """The statement, or somebody, that wrote a variable last."""
        other = yield from self.past.world_at(at)
        number = self.log.last_executed(controller, at) + 1
        written = self.causes.programs.resource(controller, Resource(ResourceKind.VALUE, name), number, at)
        by_hand = self.causes.controllers.variable_set(controller, name, at)
        last = max((one for one in (written, by_hand) if one is not None), key=lambda one: one.place, default=None)
        state = IS_NUMBER(name=text, value=other.programs[controller].variables(at).get(name, 0.0))
        present, wanted = (yield from self._present(at)), Resource(ResourceKind.VALUE, name)
        there = None if written is None else self.causes.of(written.place.time)  # it may be numbered in the log of another moment
        came = there is not None and written is not None and there.interrupts.has(controller, written.place.number // 3)
        states = [] if came else list(present.interrupted(controller, wanted))
        since, off = None if last is None else last.place.time, (yield from self._switched_off([(controller, wanted)], at))
        events = self._awaited_events(controller, wanted, other)
        return self._after(present, states, (yield from self._answer(text, at, state, since, along(last, [*off, *events]))))

    def _awaited_events(self, controller: str, wanted: Resource, other: Simulation) -> Iterator[Cause]:
        """The last changes of what the interrupts wait for that would change something, are on and have not come. ``other``: a
        world in the state of the moment."""
        programs, interrupts, at = self.causes.programs, self.causes.interrupts, other.now
        index = self.log.last_executed(controller, at) + 1
        for use, label, _ in interrupts.changing(controller, wanted):
            is_on = all(other.programs[controller].read(switch.name, at) for switch in use.acts_by)
            if not is_on or interrupts.has_come(controller, label, at):
                continue
            switched = [programs.resource(controller, switch, index, at) for switch in use.acts_by]
            since = max((one.place for one in switched if one is not None), default=Place(-1))
            for one in use.reads:
                found = programs.resource(controller, one, index, at)
                if found is not None and found.place > since:
                    yield found._replace(cover=Cover.LEVEL)

    def _moving(self, signal: str, at: Nanos) -> Asking:
        """Cause of a quantity that changes all the time: the motion, or since when it stands."""
        world = self.world
        other = yield from self.past.world_at(at)
        value, full = other.read(signal), self.names.canonical(signal)
        state = value_with_unit(signal, value, world.signal(signal).unit)
        standing = other.signal(signal)
        is_value = f"{signal} == {value!r}"
        if isinstance(standing, SignalOf) and (self.names.is_of_rotor(full) or rest_of(standing, at) is not None):
            _, since = yield from self.values.from_run(is_value, {signal: full}, at, is_bare=False)
            since = self.log.before(is_value).since if since is None else since
            if self.names.is_of_rotor(full):
                changed = None if since is None else covered(self.causes.changes.unrecorded(full, since), Cover.LEVEL)
            elif self.names.point(signal) is None or self.names.is_coordinate(full):
                # What left it where it is may have come a moment after it was there.
                is_moved = full.partition(".")[0] in self.causes.parts and since is not None
                moment = since if is_moved and since is not None else at
                changed = covered(self.causes.changes.unrecorded(full, moment, since), Cover.LEVEL)
                changed = changed or self.resting.ignored((full,), at)
            else:
                is_turned = (axis_of(full.partition(".")[2]) or (None,))[0] is ResourceKind.ENCODER
                changed = self.resting.ignored((full,), at) if since is None else self.causes.changes.of((full,), since)
                changed = self.causes.changes.unrecorded(full, at) if changed is None and is_turned else changed
            queued = yield from self._queued((full,), at)
            meanwhile = (*self._again((full,), since, at), *self.causes.holding.of((full,), at, since))
            changed = along(self._commanded(changed, queued), [*queued, *meanwhile])
            return (yield from self._answer(signal, at, state, since, changed))
        since: Nanos | None = at
        if isinstance(standing, SignalOf) and is_constant(standing, at):
            _, since = yield from self.values.from_run(is_value, {signal: full}, at, is_bare=False)
            since = self.log.before(is_value).since if since is None else since
        first = self.causes.changes.unrecorded(full, at)
        first = along(first, [*self._unstopped((full,), at, None if first is None else first.place.time)])
        return (yield from self._answer(signal, at, state, since, first))

    def _wait(self, controller: str, at: Nanos) -> Asking:
        """Cause for which the program of a controller waits."""
        log, causes = self.log, self.causes
        index, held = log.last_executed(controller, at), causes.programs.held(controller, at)
        if held is not None:
            since = held.link.time if held.place.order >= 0 else None
            first = causes.programs.stands(controller, at) if since is None else _led_to(held)
            alarm = None if since is None else causes.programs.alarm(controller, at)
            first = along(alarm, [first] if first is not None else []) if alarm and alarm.place > held.place else first
            first = along(first, [causes.controllers.begun_in_vain(controller, None, since, at)])
            supply, present = causes.programs.supply_off(controller, at), (yield from self._present(at))
            states = list(present.of([supply])) if supply is not None and since is None else []
            state = PROGRAM_IS(controller=controller, held=held.link.text)
            return self._after(present, states, (yield from self._answer(controller, at, state, since, first)))
        if index < 0:
            log.lack()
            unheard = causes.controllers.unheard(controller, None, at)
            return (yield from self._answer(controller, at, NOTHING_EXECUTED(controller=controller), None, unheard))
        here, begun = log.executed[controller][index], log.last_begin(controller, at, LAST)
        if begun is not None and begun.order > here.order:
            led, state = causes.controllers.begun(controller, begun), NOTHING_EXECUTED(controller=controller)
            return (yield from self._answer(controller, at, state, begun.time, led))
        use = causes.programs.use(controller, index)
        if use.waits and (first_index := causes.programs.begin_of_wait(controller, index)) != index:
            index, here = first_index, log.executed[controller][first_index]
        text, since = statement(log, here), None if log.is_in_progress(here) else here.time
        ended = causes.programs.ended(controller, index, at)
        if ended is not None:
            state = PROGRAM_IS(controller=controller, held=ended.link.text)
            return (yield from self._answer(controller, at, state, ended.link.time, _led_to(ended)))
        present = yield from self._present(at)
        links, is_done = list(present.awaited(controller)), at - here.time > log.world.programs[controller].statement_time
        polling = causes.programs.polling(controller, index)
        if polling is not None:
            loop = causes.programs.conditions_of_loop(controller, index)
            state = IS_IN_A_LOOP(controller=controller, statement=causes.programs.loop(controller, loop))
            since = log.executed[controller][polling].time
        elif is_done and use.waits and present.waits(controller, use):
            state = WAITS(controller=controller, statement=text)
        elif is_done and causes.programs.is_last(controller, index):
            state = PROGRAM_IS(controller=controller, held=causes.programs.end(controller, index))
        else:
            state = DOES_NOT_WAIT(controller=controller, statement=text)
        unheard = None if present.waits(controller, use) else causes.controllers.unheard(controller, None, at, here.time)
        if polling is not None or not use.waits or not is_done:
            going_on = yield from self._going_on(controller, index, index if polling is None else polling, at)
            return self._after(
                present, links, (yield from self._answer(controller, at, state, since, along(going_on, [unheard])))
            )
        found = {one: cause for one in use.reads if (cause := causes.programs.resource(controller, one, index, at))}
        waiting = causes.programs.statement(controller, index)
        known = {one: cause for one, cause in found.items() if cause.place < waiting.place}
        others = [cause._replace(cover=Cover.LEVEL) for one, cause in known.items() if not self._is_held(controller, one, at)]
        pins = [f"{controller}.{resource.name}" for resource in use.reads if resource.kind is ResourceKind.PIN and resource.name]
        changed = (cause for cause in found.values() if cause.link.time > here.time)
        last = max(changed, key=lambda cause: cause.link.time, default=None)
        if state.id == PROGRAM_IS.id:
            last = last if not pins else (yield from self._that_ended(controller, use, pins, here.time, at))
            since = since if last is None else last.link.time
        resting = ((yield from self.resting.moved(pins, at)) or self.resting.held(pins, at)) if last is None else None
        holding = [one for pin in pins for one in self.causes.holding.of((pin,), at, self.log.since(pin, at))]
        waiting = waiting._replace(cover=Cover.WAIT, besides=lambda: others)
        first = covered(last, Cover.LEVEL) or resting or waiting
        standing = (yield from self.resting.standing(pins, at)) if last is None and resting is None else None
        off = yield from self._switched_off([(controller, one) for one in use.reads], at)
        lasting = (*(() if standing is None else (standing, *standing.along)), *holding, *off)
        lasting = (*lasting, *self._unseen(pins, at, here.time))
        first = along(first, [waiting, *lasting, unheard])
        return self._after(present, links, (yield from self._answer(controller, at, state, since, first)))

    def _that_ended(
        self, controller: str, use: StatementUse, pins: Sequence[str], since: Nanos, at: Nanos
    ) -> Generator[None, None, FoundCause]:
        """The change with which a wait since a moment was over that a program executed last; None where it did not wait."""
        begun = min(at, since + self.world.programs[controller].statement_time)
        is_waiting = (yield from self._present(begun)).waits(controller, use)
        changes = [(one, pin) for pin in pins for one in self.log.changes_before(pin, at) if one.time > since]
        for one, pin in sorted(changes, key=lambda change: change[0].order) if is_waiting else ():
            if not (yield from self._present(one.time)).waits(controller, use):
                return self.causes.change(pin, one)
        return None

    def _going_on(self, controller: str, index: int, begun: int, at: Nanos) -> Generator[None, None, FoundCause]:
        """Cause for which a program that waits at no statement has come to one, or to the loop in which it is since ``begun``,
        with what the conditions of the loop read."""
        programs = self.causes.programs
        loop = programs.conditions_of_loop(controller, index, has_waits=True)
        read = [(one, number) for number in loop for one in programs.use(controller, number).reads]
        off = yield from self._switched_off([(controller, one) for one, _ in read], at)
        led = [programs.resource(controller, one, number, at) for one, number in read]
        first = covered(programs.statement(controller, begun), Cover.PROGRAM)
        return along(first, [*(covered(one, Cover.LEVEL) for one in led), *off])

    def _is_held(self, controller: str, resource: Resource, at: Nanos) -> bool:
        """Whether a fault holds a pin, or what drives it: the run without the fault proves it."""
        pin = [f"{controller}.{resource.name}"] if resource.kind is ResourceKind.PIN else []
        holds = [self.log.hold(name, at) for name in self.past.behind(pin, at) if self.names.is_signal(name)]
        return any(hold is not None for hold in holds)

    def _after(self, present: PresentStates, states: Sequence[ChainLink], answer: Answer) -> Answer:
        """An answer after present states, which take no place of its causes."""
        known = {(link.subject, link.text) for link in states}
        later = [link for link in answer.links if (link.subject, link.text) not in known]
        return answer._replace(links=tuple(dict.fromkeys((*states, *later))), has_all_states=present.has_all)

    def _script(self, name: str, at: Nanos) -> Asking:
        """Cause for which a script waits: what its condition depends on."""
        other = yield from self.past.world_at(at)
        waiting = next((one.waiting for one in other.scripts if one.name == name), None)
        if waiting is None or not waiting.condition:
            raise Misuse(SCRIPT_DOES_NOT_WAIT(name=name, at=at / SECOND))
        answer = yield from self._condition(waiting.condition, at)
        return answer._replace(question=name, state=SCRIPT_WAITS(name=name, condition=waiting.condition))

    def _present(self, at: Nanos) -> Generator[None, None, PresentStates]:
        most = MOST_SNAPSHOTS if self._most_links == MOST_LINKS else ALL_LINKS
        return PresentStates(self.causes, (yield from self.past.world_at(at)), most)

    def _answer(self, question: str, at: Nanos, state: MessageText, since: Nanos | None, first: Cause | None) -> Asking:
        # What it is lasts since then.
        first = covered(first, Cover.LEVEL if first is not None and first.link.time == since else None)
        effect = ChainLink(at if since is None else since, question.partition(".")[0], state)

        def is_whole(moment: Nanos) -> bool:
            there = self.causes.of(moment)
            return there is not None and there.log.reaches_begin()

        is_owed = first is None and since is not None
        chain = Chain(effect, Place(at, LAST), first, is_whole=is_whole, is_owed=is_owed, most=self._most_links)
        while not chain.is_over:
            chain.go_on()
            yield
        is_complete = chain.is_followed and not chain.is_cut
        return Answer(
            question, at, state, since, tuple(chain.links), is_complete, self.log.begin, chain.is_cut, broken=chain.broken
        )


def _is_on(world: Simulation, controller: str, use: StatementUse) -> bool:
    """Whether a switch of an interrupt is on in a world."""
    return any(world.programs[controller].read(one.name, world.now) for one in use.acts_by)
