"""Questions about a past: a signal, a condition, or a controller whose program waits."""

from __future__ import annotations

import re
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

from steptwin.errors import Misuse
from steptwin.machine import SECOND, Nanos
from steptwin.why.answer import MOST_LINKS, Answer, Link, since_before
from steptwin.why.causes import Cause, Causes, nothing
from steptwin.why.log import MOST_NOTED, CauseLog, in_parts
from steptwin.why.sentences import statement
from steptwin.why.states import StatesOnTheWay
from steptwin.world import script as do
from steptwin.world.condition import SignalCondition
from steptwin.world.expression import parse_condition
from steptwin.world.history import outside_past
from steptwin.world.plant import Plant, RecordedInput
from steptwin.world.programs import Operand, OperandKind

MOST_STATES = 5
"""Limit of the signals whose present levels are shown of what a program waits for."""

_AXIS = re.compile(r"M(\d+)[._]", re.IGNORECASE)

Asking: TypeAlias = Generator[None, None, Answer]
"""In parts: after each of them something else can be done, or the question be given up by `close`."""
Found: TypeAlias = Generator[None, None, tuple[float, Nanos | None]]


@dataclass(frozen=True, slots=True)
class _Level:
    """A signal whose changes were noted. As `steptwin.world.condition.Signal`."""

    log: CauseLog
    name: str
    unit: str
    continuous: bool = False

    def bring(self, now: Nanos) -> tuple[()]:
        return ()

    def value(self, now: Nanos) -> float:
        return self.log.level(self.name, now)

    def turns(self, now: Nanos) -> Iterator[Nanos]:
        yield from ()

    def version(self) -> object:
        return None


class Why:
    """Answers questions about the past of a world.

    ``make`` gives the world at its beginning, or where its past is known from; ``inputs`` are what came from outside since then,
    ``end`` is the present, in ns. The past is run again when the first question is asked, and once more for a question about what
    is in no trace, such as a register. ``most``: limit of what is noted of it.
    """

    def __init__(self, make: Callable[[], Plant], inputs: Iterable[RecordedInput], end: Nanos, most: int = MOST_NOTED) -> None:
        self._make = make
        self._inputs = list(inputs)
        self.end = end
        self.log = CauseLog(make(), most)
        self._causes = Causes(self.log)
        self._on_the_way = StatesOnTheWay(self.log.world)

    def go_on(self, inputs: Iterable[RecordedInput], end: Nanos) -> None:
        """The present is a later one: what came from outside since."""
        self._inputs += inputs
        self.end = end

    def ask(self, question: str, at: Nanos | None = None) -> Answer:
        """The answer for a moment (ns), the end by default. Raises `Misuse` for what is no question here."""
        asking = self.asking(question, at)
        while True:
            try:
                next(asking)
            except StopIteration as end:
                return end.value

    def asking(self, question: str, at: Nanos | None = None) -> Asking:
        """As `ask`, in parts."""
        moment, begin = self.end if at is None else at, self.log.begin
        if not begin <= moment <= self.end:
            raise Misuse(outside_past(moment, begin, self.end))
        text = question.strip().removeprefix("why ").strip()
        text = text or self._only_program()
        for _ in self.log.run(self._inputs, self.end):
            self._on_the_way.pass_by(self.log.inputs)
            yield
        self._causes = Causes(self.log)  # programs may be others by now
        if text in self.log.world.machines:
            return (yield from self._wait(text, moment))
        return (yield from self._condition(text, moment))

    def _only_program(self) -> str:
        """The controller that is meant without a question."""
        machines = [name for name, programs in self.log.world.programs.items() if programs.texts]
        if len(machines) != 1:
            raise Misuse("a question is a signal, a condition, or a controller: table.OUT3, 'table.OUT3 == 0', table")
        return machines[0]

    # ------------------------------------------------------------------ signals and conditions

    def _condition(self, text: str, at: Nanos) -> Asking:
        asked = self._named(text)
        found = tuple(dict.fromkeys(parse_condition(asked).names()))
        is_bare = asked == found[0] if len(found) == 1 else False
        if is_bare and not self.log.has(found[0]) and self.log.world.signal(found[0]).continuous:
            return (yield from self._moving(found[0], at))
        canonical = {name: self._canonical(name) for name in found}
        if all(self.log.is_recorded(name) for name in canonical.values()):
            value, since = self._from_log(asked, canonical, at, is_bare=is_bare)
        else:
            value, since = yield from self._from_run(asked, at, is_bare=is_bare)
        state = f"{asked} is {value:g}" if is_bare else f"{asked} is {'true' if value else 'false'}"
        first = None if since is None else self._changed(tuple(canonical.values()), since)
        return (yield from self._answer(text, at, state, since, first))

    def _named(self, text: str) -> str:
        """The condition with names that leave out their controller in full, where there is only one that has it."""
        world = self.log.world
        for name in dict.fromkeys(parse_condition(text).names()):
            if not self._has(name):
                having = [machine for machine in world.machines if self._has(f"{machine}.{name}")]
                if len(having) > 1:
                    raise Misuse(f"{name} is of {' and '.join(having)}: ask with the controller, such as {having[0]}.{name}")
                if not having:
                    world.signal(name)
                for _ in having:
                    text = re.sub(rf"(?<![\w.]){re.escape(name)}(?![\w.])", f"{having[0]}.{name}", text)
        return text

    def _has(self, name: str) -> bool:
        """Whether there is a signal with this name, or a contact."""
        return self.log.has(name) or self._is_signal(name)

    def _is_signal(self, name: str) -> bool:
        try:
            self.log.world.signal(name)
        except Misuse:
            return False
        return True

    def _unit(self, name: str) -> str:
        """Contacts have none."""
        return self.log.world.signal(name).unit if self._is_signal(name) else ""

    def _canonical(self, name: str) -> str:
        if self.log.has(name):
            return name
        owner, _, rest = name.partition(".")
        world = self.log.world
        if owner in world.machines:
            point = (
                None if self.log.is_recorded(f"{owner}.{rest.upper()}") else world.kind(owner).point(world.machine(owner), rest)
            )
            return f"{owner}.{rest.upper() if point is None else point.point.path}"
        return f"{owner}.{rest.lower()}"

    def _from_log(self, text: str, canonical: dict[str, str], at: Nanos, *, is_bare: bool) -> tuple[float, Nanos | None]:
        """The value at a moment, and when it became so."""
        log = self.log
        if is_bare:
            (name,) = canonical.values()
            return log.level(name, at), log.since(name, at)
        condition = SignalCondition(text, lambda name: _Level(log, canonical[name], self._unit(name)))
        changes = [
            change for name in canonical.values() for change in log.changes.get(name, []) if not log.is_first(name, change)
        ]
        times = sorted({change.time for change in changes if change.time <= at})
        value = condition.holds(at)
        for time in reversed(times):
            if condition.holds(time - 1) is not value:
                return float(value), time
        return float(value), None

    def _from_run(self, text: str, at: Nanos, *, is_bare: bool) -> Found:
        """As `_from_log`, from another run in which the signals are watched: from state to state back to the last change."""
        world, watch, end = self._make(), _values if is_bare else _truths, at
        value: float | None = None
        for state in self._on_the_way.until(at):
            turns: list[tuple[Nanos, float]] = []
            world.restore(state.snapshot)
            world.start("why", partial(watch, world, text, turns), is_external=True)
            for _ in in_parts(world, self._inputs[state.inputs :], end):
                yield
            if not turns:
                raise Misuse(f"{text}: nothing is known of it at {at / SECOND:g} s")
            value = turns[-1][1] if value is None else value
            if len(turns) > 1:
                return value, turns[-1][0]
            end = state.snapshot.now
        return value or 0.0, None

    def _changed(self, signals: Sequence[str], time: Nanos) -> Cause | None:
        """What made one of these signals change at a moment."""
        log, causes = self.log, self._causes
        last = causes.last([name for name in signals if (change := log.last_change(name, time)) and change.time == time], time)
        if last is not None:
            return last
        found = [cause for name in signals if (cause := self._of_unrecorded(name, time))]
        return max(found, key=lambda cause: cause.link.time, default=None)

    def _of_unrecorded(self, signal: str, time: Nanos) -> Cause | None:
        owner, _, rest = signal.partition(".")
        world, causes = self.log.world, self._causes
        if owner in world.axes:
            drive = world.axes[owner].spec.drive
            return causes.motion(drive[0], drive[1].removeprefix("M"), time, owner)
        if owner not in world.machines:
            lanes = [name for name in self.log.changes if name == owner or name.startswith(f"{owner}.")]
            return causes.last(lanes, time)
        axis = _AXIS.match(rest)
        wanted = None if axis is None else Operand(OperandKind.AXIS, axis[1])
        return causes.at_moment(owner, time, wanted)

    def _moving(self, signal: str, at: Nanos) -> Asking:
        """Of a quantity that changes all the time."""
        world = self.log.world
        other, state = self._make(), next(self._on_the_way.until(at))
        other.restore(state.snapshot)
        for _ in in_parts(other, self._inputs[state.inputs :], at):
            yield
        state = f"{signal} is {other.read(signal):.6g} {world.signal(signal).unit}".rstrip()
        first = self._of_unrecorded(self._canonical(signal), at)
        return (yield from self._answer(signal, at, state, None if first is None else first.link.time, first))

    # ------------------------------------------------------------------ programs

    def _wait(self, machine: str, at: Nanos) -> Asking:
        """What the program of a controller waits for."""
        log, causes = self.log, self._causes
        index = log.last_executed(machine, at)
        if index < 0:
            raise Misuse(f"{machine} has executed no statement until {at / SECOND:g} s: ask about one of its signals")
        executed = log.executed[machine]
        here = executed[index]
        use = causes.use(machine, index)
        text, since = statement(log, here), None if log.is_in_progress(here) else here.time
        if not use.waits or at - here.time <= log.world.programs[machine].statement_time:
            state = f"{machine} does not wait: {text}"
            return (yield from self._answer(machine, at, state, since, causes.statement(machine, index)))
        links = [link for operand in use.reads for link in self._awaited(machine, operand, at)]
        if not use.reads:
            links.append(Link(here.time, machine, "it waits for a time only"))
        found = [cause for operand in use.reads if (cause := causes.operand(machine, operand, at, index))]
        changed = [cause for cause in found if cause.link.time > here.time]
        first = max(changed, key=lambda cause: cause.link.time, default=None) or causes.statement(machine, index)
        answer = yield from self._answer(machine, at, f"{machine} waits at {text}", since, first)
        return answer._replace(links=tuple(dict.fromkeys((*links, *answer.links)))[:MOST_LINKS])

    def _awaited(self, machine: str, operand: Operand, at: Nanos) -> Iterator[Link]:
        """The present state of what a statement waits for, and of what that depends on."""
        if operand.kind is OperandKind.PIN and operand.name:
            yield from self._states(f"{machine}.{operand.name}", at)
        elif operand.kind is OperandKind.AXIS:
            motion = self._causes.motion(machine, operand.name, at)
            yield Link(at, machine, f"no axis has moved until {at / SECOND:g} s") if motion is None else motion.link
        else:
            yield Link(at, machine, f"it depends on {operand.name or 'any pin'}")

    def _states(self, signal: str, at: Nanos) -> Iterator[Link]:
        """The level of a signal and, one after the other, of the signals that drive it."""
        waiting, seen = [signal], set[str]()
        while waiting and len(seen) < MOST_STATES:
            name = waiting.pop(0)
            if name in seen:
                continue
            seen.add(name)
            since = self.log.since(name, at)
            drivers = self._causes.drivers(name)
            waiting += drivers
            when = since_before(self.log.begin) if since is None else f"since {since / SECOND:.6f} s"
            driven = f", driven by {' and '.join(drivers)}" if drivers else ""
            yield Link(at, name.partition(".")[0], f"{name} is {self.log.level(name, at):g} {when}{driven}")

    # ------------------------------------------------------------------ the chain

    def _answer(self, question: str, at: Nanos, state: str, since: Nanos | None, first: Cause | None) -> Asking:
        links: list[Link] = []
        cause, last = first, None
        while cause is not None and len(links) < MOST_LINKS and cause.link not in links:
            links.append(cause.link)
            cause, last = cause.before(), cause
            yield
        is_followed = cause is None or cause.link in links
        is_cut = is_followed and not self.log.is_whole and (last is None or last.before is not nothing)
        return Answer(question, at, state, since, tuple(links), is_followed and not is_cut, self.log.begin, is_cut)


def _truths(world: Plant, text: str, turns: list[tuple[Nanos, float]]) -> do.Steps:
    """Notes when a condition becomes true and false."""
    negated = f"not ({text})"
    is_true = world.holds(world.condition(text))
    turns.append((world.now, float(is_true)))
    while True:
        yield do.Until(negated if is_true else text)
        is_true = not is_true
        turns.append((world.now, float(is_true)))


def _values(world: Plant, name: str, turns: list[tuple[Nanos, float]]) -> do.Steps:
    """Notes when a signal takes another value."""
    value = world.read(name)
    turns.append((world.now, value))
    while True:
        yield do.Until(f"{name} != {value!r}")
        value = world.read(name)
        turns.append((world.now, value))
