"""Questions about a past: a signal, a condition, or a controller whose program waits."""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message, MessageText
from steptwin.simulation.kinds.programs import ProgramState, Resource, ResourceKind
from steptwin.simulation.logic.condition import Signal, SignalCondition
from steptwin.simulation.logic.expression import deciding, parse_condition
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.simulation import Simulation
from steptwin.simulation.world.snapshot import RecordedInput
from steptwin.simulation.world.snapshotlog import outside_past
from steptwin.why import points
from steptwin.why.answer import ALL_LINKS, MOST_LINKS, Answer, ChainLink, Cover
from steptwin.why.axes import POSITION
from steptwin.why.causes import FAULT, IS, Causes
from steptwin.why.chain import Cause, Chain, FoundCause, Place, covered
from steptwin.why.controllers import axis_of
from steptwin.why.lacking import EXECUTED, HAPPENED
from steptwin.why.lacking import Lacking as Before
from steptwin.why.log import LAST, MOST_NOTED, CauseLog, in_parts
from steptwin.why.names import SLIPS, QuestionNames
from steptwin.why.presentstates import PresentStates
from steptwin.why.programs import WAITS
from steptwin.why.replayed import ReplayedSignals, TimeSeries, watch_truth, watch_value
from steptwin.why.search import Asked, executed, happened
from steptwin.why.sentences import statement
from steptwin.why.states import Interval, StatesOnTheWay, is_constant, rest_of

MOST_SNAPSHOTS = 5
"""Limit of the signals whose present levels are shown of what a program waits for."""

VALUE = "value"
"""The signal of an integrator that is what it has in it."""
WHY_NOT = "not "
"""Beginning of a question for what a condition lacks."""
LONGEST_AHEAD_NS: Nanos = 60 * SECOND
"""How far ahead it is tried whether a condition becomes true by itself."""


Asking: TypeAlias = Generator[None, None, Answer]
"""In parts: after each of them something else can be done, or the question be given up by `close`."""
Lacking: TypeAlias = Generator[None, None, tuple[ChainLink, ...]]
Resting: TypeAlias = "Generator[None, None, Cause | None]"
FoundValue: TypeAlias = Generator[None, None, tuple[float, Nanos | None]]


def finish(asking: Asking) -> Answer:
    """The answer, after all parts."""
    while True:
        try:
            next(asking)
        except StopIteration as end:
            return end.value


@dataclass(frozen=True, slots=True)
class _Level:
    """A signal whose values are known. As `steptwin.simulation.logic.condition.Signal`."""

    level: Callable[[Nanos], float]
    unit: str
    continuous: bool = False

    def sync(self, now: Nanos) -> tuple[()]:
        return ()

    def value(self, now: Nanos) -> float:
        return self.level(now)

    def turning_points(self, now: Nanos) -> Iterator[Nanos]:
        yield from ()

    def version(self) -> object:
        return None


def _led_to(effect: Cause) -> Cause | None:
    """The causes of something that is asked for itself."""
    found = [covered(one, Cover.LEVEL) or one for one in (effect.before(), *effect.besides()) if one is not None]
    return found[0]._replace(along=(*found[0].along, *found[1:])) if found else None


def _text_of(question: str) -> str:
    return question.strip().removeprefix("why ").strip()


def _without_not(text: str) -> str:
    return text.removeprefix(WHY_NOT).strip()


def _given(cause: Cause) -> Cause:
    return cause


def _along(first: Cause | None, others: Sequence[Cause]) -> Cause | None:
    """A cause along with others, of which each is there once."""
    every = [one for one in (first, *others) if one is not None]
    if not every:
        return None
    others = [one for one in every[1:] if one.link != every[0].link]
    return every[0]._replace(along=(*every[0].along, *others))


def _note_when(world: Simulation, condition: str, found: list[Nanos]) -> do.Steps:
    yield do.Until(condition)
    found.append(world.now)


def _last_flip(condition: SignalCondition, times: Iterable[Nanos], at: Nanos) -> Nanos | None:
    """The last of the moments at which something changed that made a condition what it is at a moment."""
    value = condition.holds(at)
    return next((time for time in sorted(times, reverse=True) if condition.holds(time - 1) is not value), None)


IS_NUMBER = Message("why.is-number", "{name} is {value:g}")
IS_TRUE = Message("why.is-true", "{name} is true")
IS_FALSE = Message("why.is-false", "{name} is false")
IS_IN_UNIT = Message("why.is-in-unit", "{name} is {value:.6g} {unit}")
DOES_NOT_WAIT = Message("why.does-not-wait", "{controller} does not wait: {statement}")
SCRIPT_WAITS = Message("why.script-waits", "script {name} waits until {condition}: that is false")
SCRIPT_DOES_NOT_WAIT = Message("why.script-does-not-wait", "script {name} waits for no condition at {at:g} s: ask about a signal")
PROGRAM_IS = Message("why.program-is", "{controller}: {held}")
BECOMES_TRUE = Message("why.becomes-true", "it becomes true at {time:.6f} s if nothing comes from outside")
ONLY_FROM_OUTSIDE = Message(
    "why.only-from-outside", "it does not become true within {time:g} s if nothing comes from outside: only from outside"
)
GOES_ON = Message("why.goes-on", "it goes on at {time:.6f} s if nothing comes from outside")
DOES_NOT_GO_ON = Message(
    "why.does-not-go-on", "it does not go on within {time:g} s if nothing comes from outside: only from outside"
)
FORM_OF_A_QUESTION = Message(
    "why.form-of-a-question", "a question is a signal, a condition, or a controller: table.OUT3, 'table.OUT3 == 0', table"
)
NOTHING_EXECUTED_YET = Message(
    "why.nothing-executed-yet", "{controller} has executed no statement until {at:g} s: ask about one of its signals"
)
NOTHING_EXECUTED_SINCE = Message("why.nothing-executed-since", "{controller} has executed no statement since {begin:g} s")


class Why:
    """Answers questions about the past of a world.

    ``make`` gives the world at its beginning, or where its past is known from; ``inputs`` are what came from outside since then,
    ``end`` is the present, in ns. The past is run again when the first question is asked, and from the last change on once more
    for a question about what is in no trace, such as a register; what that showed is remembered. ``most``: limit of what is
    noted; ``before``: takes what lacks because it was before; ``others``: causes of a moment before, if they are noted.
    """

    def __init__(
        self,
        make: Callable[[], Simulation],
        inputs: Iterable[RecordedInput],
        end: Nanos,
        most: int = MOST_NOTED,
        before: Before | None = None,
        others: Callable[[Nanos], Causes | None] = lambda moment: None,
    ) -> None:
        self._make = make
        self._inputs = list(inputs)
        self.end = end
        self.log = CauseLog(make(), most, before)
        self._others = others
        self.names = QuestionNames(self.log)
        self.causes = Causes(self.log, others)
        self._on_the_way = StatesOnTheWay(self.log.world)
        self._replayed = ReplayedSignals(make, self._inputs)
        self._most_links = MOST_LINKS

    def go_on(self, inputs: Iterable[RecordedInput], end: Nanos) -> None:
        """The present is a later one: what came from outside since."""
        self._inputs += inputs
        self.end = end

    def fault_link(self, name: str, until: Nanos) -> ChainLink:
        """A fault that has acted by a moment, as a cause."""
        record, active = self.log.fault_record(name, until), self.log.world.objects.faults.find(name)
        last = None if record is not None else self.log.before(f"{HAPPENED}fault {name}").since
        if last is not None and (there := self.causes.of(last)) is not None:
            record = there.log.fault_record(name, last)
        what = record.value if record is not None else "" if active is None else str(active.fault)
        subject = "" if record is None else record.controller
        root = self.causes.fault_root(name, until)
        return ChainLink(root.time if record is None else record.time, subject, FAULT(name=name, what=what), root)

    def ask(self, question: str, at: Nanos | None = None) -> Answer:
        """The answer for a moment (ns), the end by default. Raises `Misuse` for what is no question here."""
        return finish(self.asking(question, at))

    def asking(self, question: str, at: Nanos | None = None, most_links: int = MOST_LINKS) -> Asking:
        """As `ask`, in parts; the answer has at most so many links."""
        self._most_links = most_links
        moment, begin = self.end if at is None else at, self.log.begin
        if not begin <= moment <= self.end:
            raise Misuse(outside_past(moment, begin, self.end))
        text = _text_of(question) or self._only_program()
        yield from self.running()
        if _without_not(text) in self.log.world.controllers:
            return (yield from self._wait(_without_not(text), moment))
        if self.names.is_script(text):
            return (yield from self._script(text, moment))
        variable = self.names.variable(text)
        if variable is not None:
            return (yield from self._of_variable(text, *variable, moment))
        return (yield from self._condition(text, moment))

    def running(self) -> Generator[None, None, None]:
        """Note what happened until the present, in parts."""
        for _ in self.log.run(self._inputs, self.end):
            self._on_the_way.pass_by(self.log.inputs)
            yield
        self.causes = Causes(self.log, self._others)  # programs may be others by now

    def _only_program(self) -> str:
        """The controller that is meant without a question."""
        controllers = [name for name, programs in self.log.world.programs.items() if programs.texts]
        if len(controllers) != 1:
            raise Misuse(FORM_OF_A_QUESTION())
        return controllers[0]

    # ------------------------------------------------------------------ signals and conditions

    def asked(self, question: str) -> Asked | None:
        """The change that `LastChanges` searches for; None for a controller, for a bare quantity that moves all the time, and for
        `idle`. Raises `Misuse`."""
        text = _text_of(question)
        if text.startswith(HAPPENED):
            return happened(text)
        if text.startswith(EXECUTED):
            return executed(text)
        if not text or self.names.is_script(text):
            return None
        if _without_not(text) in self.log.world.controllers or self.names.variable(text) is not None:
            return None
        text = self.names.named(text)
        names = tuple(dict.fromkeys(parse_condition(text).names()))
        is_bare = len(names) == 1 and text == names[0]
        moving = {name for name in names if not self.log.has(name) and self.log.world.signal(name).continuous}
        if (is_bare and self.names.takes_values_between(text)) or "idle" in names:
            return None
        canonical = {name: self.names.canonical(name) for name in names}
        edges = frozenset(full for full in canonical.values() if self._has_edges(full))
        # Elements know their signals by the names in the question only.
        signals = {name: full if full in edges or self.names.is_signal(full) else name for name, full in canonical.items()}

        def flip(noted: Mapping[str, TimeSeries], at: Nanos) -> Nanos | None:
            series = {name: noted[signal] for name, signal in signals.items()}
            if is_bare:
                return points.since(series[text], at)
            condition = SignalCondition(text, lambda name: _Level(partial(points.level, series[name]), self.names.unit(name)))
            times = {time for one in series.values() for time in points.changes(one, -1, at)}
            return _last_flip(condition, times, at)

        moving = frozenset(signals[name] for name in moving)
        return Asked(text, frozenset(signals.values()), edges, moving, flip)

    def _has_edges(self, signal: str) -> bool:
        owner, _, pin = signal.partition(".")
        return self.log.has(signal) or (owner in self.log.world.controllers and pin in self.log.world.controllers[owner].pins())

    def _condition(self, text: str, at: Nanos) -> Asking:
        asked = self.names.named(text)
        found = tuple(dict.fromkeys(parse_condition(asked).names()))
        is_bare = asked == found[0] if len(found) == 1 else False
        if is_bare and self.names.takes_values_between(asked):
            return (yield from self._moving(asked, at))
        canonical = {name: self.names.canonical(name) for name in found}
        if all(self.log.is_recorded(name) for name in canonical.values()):
            value, since = self._from_log(asked, canonical, at, is_bare=is_bare)
        else:
            value, since = yield from self._from_run(asked, canonical, at, is_bare=is_bare)
        since = self.log.before(asked).since if since is None else since
        state = IS_NUMBER(name=asked, value=value) if is_bare else IS_TRUE(name=asked) if value else IS_FALSE(name=asked)
        changed = None if since is None else self._changed((*canonical.values(),), since)
        shown = [pin for full in canonical.values() if (pin := self.names.pin(full)) != full]
        canonical = {name: self.names.pin(full) for name, full in canonical.items()}
        signals = tuple(canonical.values())
        first = self.causes.lasting(signals, at, changed)
        first = self._with_refused(signals, at, since, first)
        if first is not None or since is not None:
            holding = self.causes.holding.of(self._deciding(asked, canonical, at), at, since)
            first = _along(first, [*holding, *self._unseen(shown, at, -1 if since is None else since)])
            return (yield from self._answer(text, at, state, since, first))
        waited = (*signals, *self._awaited(signals, at))
        resting = (yield from self._resting(waited, at)) or self._held(signals, at)
        resting = resting or (yield from self._standing(signals, at))
        behind = self._behind(waited, at)
        is_kept = any(self.log.rates.has(name.partition(".")[0]) for name in behind) or self.causes.holding.depends(behind)
        if is_kept and self.log.reaches_begin():  # otherwise it is not known what was before
            decides = self._deciding(asked, canonical, at)
            holding = self.causes.holding.of((*decides, *self._awaited(decides, at)), at, None)
            resting = _along(resting, list(holding))
        resting = _along(resting, list(self._unseen((*shown, *waited[len(signals) :]), at, -1)))
        answer = yield from self._answer(text, at, state, None, resting)
        present, named = (yield from self._present(at)), [name for name in signals if self.log.has(name)]
        states = [link for name in named for link in present.of([name])]
        says_more = resting is not None or len(states) > len(signals)
        says_more |= any(self.causes.drivers(name, at) or self.causes.undriven(name) is not None for name in signals)
        return self._after(present, states if says_more else [], answer)

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
            if owner in self.log.world.controllers and self.log.world.kind(owner).registers is not None:
                refused = self.causes.controllers.refused(owner, (rest,), at, after=-1 if since is None else since)
                if refused is None and owner in self.log.world.objects.line_of and (since is None or since < self.log.begin):
                    self.log.lack()
                elif refused is not None:
                    first = refused if first is None else first._replace(along=(*first.along, refused))
        return first

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

    def lacking(self, question: str, at: Nanos) -> Lacking:
        """Lines of a question that begins with ``not`` and is true: the present values of what would have to be otherwise, with
        what drives it, and when it becomes so by itself, or when a program that waits goes on, in parts; none for another one.
        `asking` comes first."""
        text = _text_of(question)
        if not text.startswith(WHY_NOT):
            return ()
        other = yield from self._world_at(at)
        if _without_not(text) in other.programs:
            return (yield from self._going_on(other, _without_not(text), at))
        condition = self.names.named(_without_not(text))
        node = parse_condition(condition).in_unit("", self.names.unit)

        def value(name: str) -> float:
            return other.read(name) if self.names.is_signal(name) else self.log.level(name, at)

        if node.value(value):
            return ()
        links: list[ChainLink] = []
        states = PresentStates(self.causes, other, ALL_LINKS)
        for name in dict.fromkeys(name for one in deciding(node, value, wanted=True) for name in one.names()):
            full, unit = self.names.canonical(name), self.names.unit(name)
            if self.log.is_recorded(full):
                links += states.of([full])
            else:
                text = IS_IN_UNIT(name=name, value=value(name), unit=unit) if unit else IS_NUMBER(name=name, value=value(name))
                links.append(ChainLink(at, name.partition(".")[0], text))
            is_kept = full.partition(".")[0] in self.log.world.controllers and full.partition(".")[2] not in self._pins(full)
            for controller, wanted in self._changeable([full], at) if is_kept else ():
                tried = self._tried(controller, wanted, at)
                links += states.before(controller, wanted) if tried is None else (one.link for one in (tried, *tried.along))
        if all(map(self.names.is_signal, node.names())):
            found: list[Nanos] = []
            other.start("why", partial(_note_when, other, condition, found), is_external=True)
            for _ in in_parts(other, (), at + LONGEST_AHEAD_NS):
                if found:
                    break
                yield
            ahead = BECOMES_TRUE(time=found[0] / SECOND) if found else ONLY_FROM_OUTSIDE(time=LONGEST_AHEAD_NS / SECOND)
            links.append(ChainLink(at, "", ahead))
        return tuple(dict.fromkeys(links))

    def standing(self, answer: Answer) -> Mapping[str, bool]:
        """The controllers whose programs would else have changed what an answer is about since: True for those that are held,
        False for those that wait for something before statements that would change its output. `asking` comes first."""
        text, at, log, programs = _text_of(answer.question), answer.at, self.log, self.causes.programs
        found: dict[str, bool] = {}
        if self.names.is_script(text) or _without_not(text) in log.world.controllers:
            return found
        names = self._names_in(text)
        waiting = {*self._changeable([one for one in names if self._is_output(one) or self.causes.holding.depends([one])], at)}
        for controller, wanted in self._changeable(names, at):
            index, since = log.last_executed(controller, at), self._since(controller, wanted, answer)
            if index < 0 or not programs.leads_to(controller, index, wanted):
                continue
            held = programs.held(controller, at) or programs.ended(controller, index, at)
            if held is not None:
                is_later = since is not None and (held.place.order < 0 or held.place.time > since)
                if (is_later or wanted.kind is ResourceKind.AXIS) and self._tried(controller, wanted, at) is None:
                    found[controller] = True
            elif wanted.kind is ResourceKind.PIN and (controller, wanted) in waiting and since is not None:
                use, begun = programs.use(controller, index), log.executed[controller][index].time
                if use.waits and use.reads and since <= begun < at - log.world.programs[controller].statement_time:
                    found.setdefault(controller, False)
        return found

    def _is_output(self, name: str) -> bool:
        """Whether it is an output that a program sets."""
        owner, _, pin = name.partition(".")
        return owner in self.log.world.programs and pin in self._pins(name) and self.causes.programs.may_write(owner, pin)

    def _since(self, controller: str, wanted: Resource, answer: Answer) -> Nanos | None:
        """Since when an answer is so, or an output that what it is about follows later."""
        since = self.log.since(f"{controller}.{wanted.name}", answer.at) if wanted.kind is ResourceKind.PIN else None
        return answer.since if since is None or answer.since is None else min(since, answer.since)

    def _tried(self, controller: str, wanted: Resource, at: Nanos) -> Cause | None:
        """The last command to an axis that stands which moved nothing."""
        motion = self.causes.axes.motion(controller, wanted.name, at) if wanted.kind is ResourceKind.AXIS else None
        if wanted.kind is not ResourceKind.AXIS or (motion is not None and motion.cover is not None):
            return None
        after = -1 if motion is None else motion.place.time
        return self.causes.attempts.last(controller, wanted.name, at, after=after)

    def _names_in(self, text: str) -> Sequence[str]:
        """The signals of a question, or the variable."""
        if self.names.variable(text) is not None:
            return [text]
        return [self.names.canonical(name) for name in parse_condition(self.names.named(_without_not(text))).names()]

    def _changeable(self, names: Sequence[str], at: Nanos) -> Iterator[tuple[str, Resource]]:
        """Resources on which signals depend and that programs can change, with their controllers: outputs, axes, values."""
        world = self.log.world
        variable = self.names.variable(names[0]) if len(names) == 1 else None
        if variable is not None:
            yield variable[0], Resource(ResourceKind.VALUE, variable[1])
            return
        for name in self._behind(names, at):
            owner, _, rest = name.partition(".")
            if owner in world.axes and rest == POSITION:
                drive = world.axes[owner].spec.drive
                yield drive[0], Resource(ResourceKind.AXIS, drive[1].removeprefix("M"))
            elif owner in world.programs and rest in self._pins(name):
                yield owner, Resource(ResourceKind.PIN, rest)
            elif owner in world.programs:
                axis = axis_of(rest)
                is_moving = self.names.is_signal(name) and world.signal(name).continuous
                if axis is not None or (is_moving and len(world.controllers[owner].axes) == 1):
                    yield owner, Resource(ResourceKind.AXIS, "1") if axis is None else axis._replace(name=axis.name or "1")
                yield from ((owner, one) for one in self.causes.programs.values_at(owner, rest))

    def _pins(self, name: str) -> Collection[str]:
        """The pins of the controller that has a signal."""
        controller = self.log.world.controllers.get(name.partition(".")[0])
        return () if controller is None else controller.pins()

    def _going_on(self, other: Simulation, controller: str, at: Nanos) -> Lacking:
        """When a program that waits goes on by itself."""
        programs = other.programs[controller]
        stand, depth, found = programs.stand(at), programs.depth(), list[Nanos]()
        if stand is None or stand.state is not ProgramState.RUNS:
            return ()

        def hook(now: Nanos, number: int) -> None:
            if programs.depth() <= depth and programs.location(number) != stand.location:
                found.append(now)

        programs.add_hook(hook)
        for _ in in_parts(other, (), at + LONGEST_AHEAD_NS):
            if found:
                break
            yield
        ahead = GOES_ON(time=found[0] / SECOND) if found else DOES_NOT_GO_ON(time=LONGEST_AHEAD_NS / SECOND)
        return (ChainLink(at, controller, ahead),)

    def _world_at(self, at: Nanos) -> Generator[None, None, Simulation]:
        """Another world in the state of a moment of the past."""
        other, state = self._make(), next(self._on_the_way.until(at))
        other.restore(state.snapshot)
        for _ in in_parts(other, self._inputs[state.inputs :], at):
            yield
        return other

    def _of_variable(self, text: str, controller: str, name: str, at: Nanos) -> Asking:
        """The statement, or somebody, that wrote a variable last."""
        other = yield from self._world_at(at)
        number = self.log.last_executed(controller, at) + 1
        written = self.causes.programs.resource(controller, Resource(ResourceKind.VALUE, name), number, at)
        by_hand = self.causes.controllers.variable_set(controller, name, at)
        last = max((one for one in (written, by_hand) if one is not None), key=lambda one: one.place, default=None)
        state = IS_NUMBER(name=text, value=other.programs[controller].variables(at).get(name, 0.0))
        present, wanted = (yield from self._present(at)), Resource(ResourceKind.VALUE, name)
        there = None if written is None else self.causes.of(written.place.time)  # it may be numbered in the log of another moment
        came = there is not None and written is not None and there.programs.is_of_interrupt(controller, written.place.number // 3)
        states = [] if came else list(present.disabled(controller, wanted))
        return self._after(
            present, states, (yield from self._answer(text, at, state, None if last is None else last.place.time, last))
        )

    def _from_log(self, text: str, canonical: dict[str, str], at: Nanos, *, is_bare: bool) -> tuple[float, Nanos | None]:
        """The value at a moment, and when it became so."""
        log = self.log
        if is_bare:
            (name,) = canonical.values()
            return log.level(name, at), log.since(name, at)
        condition = SignalCondition(text, lambda name: _Level(partial(log.level, canonical[name]), self.names.unit(name)))
        times = {time for name in canonical.values() for time in log.changes_in(name, -1, at)}
        return float(condition.holds(at)), _last_flip(condition, times, at)

    def _from_run(self, text: str, canonical: dict[str, str], at: Nanos, *, is_bare: bool) -> FoundValue:
        """As `_from_log`, from values that are in no trace: from interval to interval back to the last change."""
        log, replayed, controllers = self.log, self._replayed, self.log.world.controllers
        replayed.begin()
        if any(log.world.signal(name).continuous for name in canonical if not log.has(name)):
            recorded, watched = dict[str, str](), {text: text}
            watch, is_followed = watch_truth, True
        else:
            recorded = {name: full for name, full in canonical.items() if log.is_recorded(full)}
            named = {name: full for name, full in canonical.items() if name not in recorded}
            watched = {name: full if full.partition(".")[0] in controllers else name for name, full in named.items()}
            watch, is_followed = watch_value, is_bare
        value: float | None = None
        intervals = list(self._on_the_way.intervals(at, self.end))
        if watch is watch_truth:
            self._remember_rests(text, canonical, intervals)
        for number, interval in enumerate(intervals):
            # As many as have shown no change: what lasts for long is found with few states to restore.
            yield from replayed.prepare(watched.values(), watch, intervals[number : number + max(1, number)], at)

            def level(moment: Nanos, interval: Interval = interval) -> float:
                if is_followed:
                    return replayed.level(watched[text], interval, moment)
                signals = partial(self._level_in, interval, recorded, watched)
                return float(SignalCondition(text, signals).holds(moment))

            value = level(at) if value is None else value
            times = {time for full in watched.values() for time in replayed.changes(full, interval, at)}
            for full in recorded.values():
                times.update(log.changes_in(full, interval.state.snapshot.now, min(at, interval.end)))
            for time in sorted(times, reverse=True):
                if is_followed or level(time - 1) != value:
                    return value, time
        return value or 0.0, None

    def _remember_rests(self, text: str, canonical: Mapping[str, str], intervals: Iterable[Interval]) -> None:
        """The truth of a condition in the intervals in which nothing changes that it depends on."""
        log = self.log
        for interval in intervals:
            begin, levels = interval.state.snapshot.now, dict[str, float]()
            for name, full in canonical.items():
                if not log.is_recorded(full):
                    rest = self._on_the_way.rest(full, interval)
                    if rest is None:
                        break
                    levels[name] = rest
                elif any(log.changes_in(full, begin - 1, interval.end)):
                    break
                else:
                    levels[name] = log.level(full, begin)
            else:
                at_rest = SignalCondition(
                    text, lambda name, levels=levels: _Level(lambda now: levels[name], self.names.unit(name))
                )
                self._replayed.remember(text, interval, float(at_rest.holds(begin)))

    def _level_in(self, interval: Interval, recorded: Mapping[str, str], watched: Mapping[str, str], name: str) -> Signal:
        """A signal of a condition in an interval."""
        if name in recorded:
            return _Level(partial(self.log.level, recorded[name]), self.names.unit(name))
        return _Level(partial(self._replayed.level, watched[name], interval), self.names.unit(name))

    def _changed(self, signals: Sequence[str], time: Nanos) -> Cause | None:
        """Cause of a change of one of these signals at a moment."""
        causes = self.causes.of(time)
        if causes is None:
            return None
        log = causes.log
        last = causes.last([name for name in signals if (change := log.last_change(name, time)) and change.time == time], time)
        if last is not None:
            return last
        found = [cause for name in signals if (cause := self._of_unrecorded(name, time))]
        return max(found, key=lambda cause: cause.link.time, default=None)

    def _of_unrecorded(self, signal: str, time: Nanos, since: Nanos | None = None) -> Cause | None:
        """Cause of what is in no trace at a moment; ``since``: since when it stands."""
        owner, _, rest = signal.partition(".")
        world, causes = self.log.world, self.causes.of(time)
        if causes is None:
            return None
        if owner in world.axes and rest in SLIPS:
            return causes.axes.slipped(owner, time, SLIPS[rest])
        if owner in world.axes and rest != "power":
            return causes.axes.moved(owner, time, since=since)
        if owner in world.axes:
            drive, switched = world.axes[owner].spec.drive, causes.axes.power(owner, time)
            wanted = Resource(ResourceKind.AXIS, drive[1].removeprefix("M"))
            is_switched = switched is not None and switched.link.time == time
            return switched if is_switched else causes.controllers.at_moment(drive[0], time, wanted)
        if owner not in world.controllers:
            return causes.elements.of_element(owner, rest, time)
        shown = self.names.pin(signal)
        if shown != signal:
            pin = Resource(ResourceKind.PIN, shown.partition(".")[2])
            return covered(causes.programs.resource(owner, pin, 0, time) or causes.programs.first(owner, pin), Cover.LEVEL)
        wanted = axis_of(rest)
        if wanted is None and self.names.is_signal(signal) and world.signal(signal).continuous:
            wanted = Resource(ResourceKind.AXIS, "")
        if wanted is not None and wanted.kind is ResourceKind.AXIS and self.names.is_coordinate(signal):
            return causes.axes.coordinate(owner, wanted.name or "1", time)
        found = causes.controllers.at_moment(owner, time, wanted, rest)
        if found is None or wanted is None or "vel" not in rest.lower():
            return found
        besides, until = found.besides, found.place.time
        return found._replace(besides=lambda: (*besides(), *causes.axes.settings(owner, wanted.name, until)))

    def _moving(self, signal: str, at: Nanos) -> Asking:
        """Cause of a quantity that changes all the time: the motion, or since when it stands."""
        world = self.log.world
        other = yield from self._world_at(at)
        value, full = other.read(signal), self.names.canonical(signal)
        unit = world.signal(signal).unit
        state = IS_IN_UNIT(name=signal, value=value, unit=unit) if unit else IS(signal=signal, value=f"{value:.6g}")
        standing = other.signal(signal)
        is_value = f"{signal} == {value!r}"
        if isinstance(standing, SignalOf) and (self.names.is_of_rotor(full) or rest_of(standing, at) is not None):
            _, since = yield from self._from_run(is_value, {signal: full}, at, is_bare=False)
            since = self.log.before(is_value).since if since is None else since
            if self.names.is_of_rotor(full):
                changed = None if since is None else covered(self._of_unrecorded(full, since), Cover.LEVEL)
            elif self.names.point(signal) is None or self.names.is_coordinate(full):
                # What left it where it is may have come a moment after it was there.
                is_moved = full.partition(".")[0] in self.causes.parts and since is not None
                moment = since if is_moved and since is not None else at
                changed = covered(self._of_unrecorded(full, moment, since), Cover.LEVEL) or self._ignored((full,), at)
            else:
                is_turned = (axis_of(full.partition(".")[2]) or (None,))[0] is ResourceKind.ENCODER
                changed = self._ignored((full,), at) if since is None else self._changed((full,), since)
                changed = self._of_unrecorded(full, at) if changed is None and is_turned else changed
            return (yield from self._answer(signal, at, state, since, changed))
        since: Nanos | None = at
        if isinstance(standing, SignalOf) and is_constant(standing, at):
            _, since = yield from self._from_run(is_value, {signal: full}, at, is_bare=False)
            since = self.log.before(is_value).since if since is None else since
        first = self._of_unrecorded(full, at)
        return (yield from self._answer(signal, at, state, since, first))

    # ------------------------------------------------------------------ programs

    def _wait(self, controller: str, at: Nanos) -> Asking:
        """Cause for which the program of a controller waits."""
        log, causes = self.log, self.causes
        index, held = log.last_executed(controller, at), causes.programs.held(controller, at)
        if held is not None:
            since = held.link.time if held.place.order >= 0 else None
            first = causes.programs.stands(controller, at) if since is None else _led_to(held)
            alarm = None if since is None else causes.programs.alarm(controller, at)
            first = _along(alarm, [first] if first is not None else []) if alarm and alarm.place > held.place else first
            supply, present = causes.programs.supply_off(controller, at), (yield from self._present(at))
            states = list(present.of([supply])) if supply is not None and since is None else []
            state = PROGRAM_IS(controller=controller, held=held.link.text)
            return self._after(present, states, (yield from self._answer(controller, at, state, since, first)))
        if index < 0 and log.reaches_begin():
            raise Misuse(NOTHING_EXECUTED_YET(controller=controller, at=at / SECOND))
        if index < 0:
            state = NOTHING_EXECUTED_SINCE(controller=controller, begin=log.begin / SECOND)
            return (yield from self._answer(controller, at, state, None, None))
        executed = log.executed[controller]
        here = executed[index]
        use = causes.programs.use(controller, index)
        text, since = statement(log, here), None if log.is_in_progress(here) else here.time
        ended = causes.programs.ended(controller, index, at)
        if ended is not None:
            state = PROGRAM_IS(controller=controller, held=ended.link.text)
            return (yield from self._answer(controller, at, state, ended.link.time, _led_to(ended)))
        present = yield from self._present(at)
        links = list(present.awaited(controller))
        if not present.waits(controller, use) or at - here.time <= log.world.programs[controller].statement_time:
            state = DOES_NOT_WAIT(controller=controller, statement=text)
            first = covered(causes.programs.statement(controller, index), Cover.PROGRAM)
            return self._after(present, links, (yield from self._answer(controller, at, state, since, first)))
        found = {one: cause for one in use.reads if (cause := causes.programs.resource(controller, one, index, at))}
        waiting = causes.programs.statement(controller, index)
        known = {one: cause for one, cause in found.items() if cause.place < waiting.place}
        others = [cause._replace(cover=Cover.LEVEL) for one, cause in known.items() if not self._is_held(controller, one, at)]
        changed = [cause for cause in found.values() if cause.link.time > here.time]
        last = max(changed, key=lambda cause: cause.link.time, default=None)
        pins = [f"{controller}.{resource.name}" for resource in use.reads if resource.kind is ResourceKind.PIN and resource.name]
        resting = ((yield from self._resting(pins, at)) or self._held(pins, at)) if last is None else None
        holding = [one for pin in pins for one in self.causes.holding.of((pin,), at, self.log.since(pin, at))]
        waiting = waiting._replace(cover=Cover.WAIT, besides=lambda: others)
        first = covered(last, Cover.LEVEL) or resting or waiting
        standing = (yield from self._standing(pins, at)) if last is None and resting is None else None
        lasting = (*(() if standing is None else (standing, *standing.along)), *holding, *self._unseen(pins, at, here.time))
        first = _along(first, [waiting, *lasting])
        answer = yield from self._answer(controller, at, WAITS(controller=controller, statement=text), since, first)
        return self._after(present, links, answer)

    def _is_held(self, controller: str, resource: Resource, at: Nanos) -> bool:
        """Whether a fault holds a pin, or what drives it: the run without the fault proves it."""
        pin = [f"{controller}.{resource.name}"] if resource.kind is ResourceKind.PIN else []
        holds = [self.log.hold(name, at) for name in self._behind(pin, at) if self.names.is_signal(name)]
        return any(hold is not None for hold in holds)

    def _after(self, present: PresentStates, states: Sequence[ChainLink], answer: Answer) -> Answer:
        """An answer after present states, which take no place of its causes."""
        known = {(link.subject, link.text) for link in states}
        later = [link for link in answer.links if (link.subject, link.text) not in known]
        return answer._replace(links=tuple(dict.fromkeys((*states, *later))), has_all_states=present.has_all)

    def _behind(self, signals: Iterable[str], at: Nanos) -> set[str]:
        """Signals, and those that drive one of them."""
        waiting, seen = list(signals), set[str]()
        while waiting:
            name = waiting.pop()
            if name not in seen:
                seen.add(name)
                waiting += (*self.causes.drivers(name, at), *self.causes.elements.behind(name))
        return seen

    def _awaited(self, signals: Iterable[str], at: Nanos) -> Iterator[str]:
        """The pins for which programs wait before they change signals, or those that drive them."""
        programs = self.causes.programs
        for name in self._behind(signals, at):
            owner, _, pin = name.partition(".")
            index = self.log.last_executed(owner, at) if owner in self.log.world.programs else -1
            if index >= 0 and programs.leads_to(owner, index, Resource(ResourceKind.PIN, pin)):
                reads = programs.use(owner, index).reads if programs.use(owner, index).waits else ()
                yield from (f"{owner}.{one.name}" for one in reads if one.kind is ResourceKind.PIN and one.name)

    def _axes_of(self, signals: Iterable[str], at: Nanos) -> set[str]:
        """The axes whose position or switch is among signals, or drives one of them."""
        return {name.partition(".")[0] for name in self._behind(signals, at)} & set(self.log.world.axes)

    def _held(self, signals: Iterable[str], at: Nanos) -> Cause | None:
        """Cause for which a program does not change signals, or those that drive them: it is held, or has decided against it."""
        found: list[FoundCause] = []
        programs = self.causes.programs
        for name in self._behind(signals, at):
            owner, _, pin = name.partition(".")
            if owner in self.log.world.programs and not self.causes.drivers(name, at) and programs.may_write(owner, pin):
                held = programs.stands(owner, at)
                found.append(held or programs.decided_against(owner, Resource(ResourceKind.PIN, pin), at))
        return max((one for one in found if one is not None), key=lambda one: one.place, default=None)

    def _ignored(self, signals: Iterable[str], at: Nanos) -> Cause | None:
        """Cause for which an axis of a controller has not moved: a command that was ignored, or that there was none."""
        for name in signals:
            owner, _, rest = name.partition(".")
            drive = self.log.world.axes[owner].spec.drive if owner in self.log.world.axes else (owner, rest)
            axis = axis_of(f"{drive[1]}.")
            moves = name == f"{owner}.position" or (self.names.is_signal(name) and self.log.world.signal(name).continuous)
            controller = self.log.world.controllers.get(drive[0])
            is_only = moves and controller is not None and len(controller.axes) == 1
            number = axis.name or "1" if axis is not None else "1" if is_only else ""
            if controller is not None and number and (moves or rest.lower().endswith("status")):
                return self.causes.attempts.unmoved(drive[0], number, at)
        return None

    def _resting(self, signals: Sequence[str], at: Nanos) -> Resting:
        """Where an axis of `_axes_of` is, and what brought it there, or left it; of several the one moved last. None if nothing
        moved any."""
        axes = self._axes_of(signals, at)
        moved = [(cause.place, axis, cause) for axis in axes if (cause := self.causes.axes.moved(axis, at))]
        if not moved:
            return None
        _, axis, cause = max(moved, key=lambda one: one[:2])
        other, name = (yield from self._world_at(at)), f"{axis}.position"
        text = IS_IN_UNIT(name=name, value=other.read(name), unit=other.signal(name).unit)
        return Cause(ChainLink(at, axis, text), Place(at, LAST, -1), lambda: covered(cause, Cover.LEVEL))

    def _standing(self, signals: Sequence[str], at: Nanos) -> Resting:
        """The places of axes and values of integrators that nothing has moved, on which signals depend, and of the signals
        themselves. None if there are none."""
        behind = self._behind(signals, at)
        owners = {name.partition(".")[0] for name in behind}
        names = [f"{axis}.{POSITION}" for axis in sorted(owners & set(self.log.world.axes))]
        names += [f"{owner}.{VALUE}" for owner in sorted(owners) if self.log.rates.has(owner)]
        names += [
            one
            for one in signals
            if not self.log.has(one) and self.names.is_signal(one) and self.log.world.signal(one).continuous
        ]
        if not names:
            return self._ignored(signals, at)
        other, found = (yield from self._world_at(at)), list[Cause]()
        for number, name in enumerate(dict.fromkeys(names)):
            unit, value = other.signal(name).unit, other.read(name)
            text = IS_IN_UNIT(name=name, value=value, unit=unit) if unit else IS_NUMBER(name=name, value=value)
            place = Place(at, LAST, -1 - number)
            cause = self._of_standing(name, at)
            before = self.causes.at_begin if cause is None else partial(_given, cause)
            found.append(Cause(ChainLink(at, name.partition(".")[0], text), place, before))
        return _along(found[0], found[1:])

    def _of_standing(self, name: str, at: Nanos) -> FoundCause:
        """Cause for which a quantity has a value that it has from the beginning."""
        if name.partition(".")[0] in self.log.world.axes:
            return self._ignored((name,), at)
        if self.log.rates.has(name.partition(".")[0]):
            return self.causes.elements.rate(name.partition(".")[0], at)
        ignored = self._ignored((name,), at)
        return ignored if ignored is not None else covered(self._of_unrecorded(name, at), Cover.LEVEL)

    def _script(self, name: str, at: Nanos) -> Asking:
        """Cause for which a script waits: what its condition depends on."""
        other = yield from self._world_at(at)
        waiting = next((one.waiting for one in other.scripts if one.name == name), None)
        if waiting is None or not waiting.condition:
            raise Misuse(SCRIPT_DOES_NOT_WAIT(name=name, at=at / SECOND))
        answer = yield from self._condition(waiting.condition, at)
        return answer._replace(question=name, state=SCRIPT_WAITS(name=name, condition=waiting.condition))

    def _present(self, at: Nanos) -> Generator[None, None, PresentStates]:
        most = MOST_SNAPSHOTS if self._most_links == MOST_LINKS else ALL_LINKS
        return PresentStates(self.causes, (yield from self._world_at(at)), most)

    # ------------------------------------------------------------------ the chain

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
