"""Questions about a past: a signal, a condition, or a controller whose program waits."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

from steptwin.errors import Misuse
from steptwin.machine import SECOND, Nanos
from steptwin.why.answer import MOST_LINKS, Answer, Link
from steptwin.why.causes import Cause, Causes
from steptwin.why.log import CauseLog
from steptwin.why.sentences import statement
from steptwin.world import script as do
from steptwin.world.expression import SignalCondition, names, parse
from steptwin.world.history import replay
from steptwin.world.plant import Plant, RecordedInput
from steptwin.world.programs import Operand, OperandKind

_SINGLE_EQUALS = re.compile(r"(?<![<>=!])=(?!=)")
MOST_STATES = 5
"""Limit of the signals whose present levels are shown of what a program waits for."""

_AXIS = re.compile(r"M(\d+)[._]", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class _Level:
    """A signal whose changes were noted. As `steptwin.world.expression.Signal`."""

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

    ``make`` gives the world at its beginning, ``inputs`` are what came from outside, ``end`` is the present, in ns. The past is
    run again when the first question is asked, and once more for a question about what is in no trace, such as a register.
    """

    def __init__(self, make: Callable[[], Plant], inputs: Iterable[RecordedInput], end: Nanos) -> None:
        self._make = make
        self._inputs = tuple(inputs)
        self.end = end

    @cached_property
    def log(self) -> CauseLog:
        log = CauseLog(self._make())
        log.run(self._inputs, self.end)
        return log

    @cached_property
    def causes(self) -> Causes:
        return Causes(self.log)

    def ask(self, question: str, at: Nanos | None = None) -> Answer:
        """The answer for a moment (ns), the end by default. Raises `Misuse` for what is no question here."""
        moment = self.end if at is None else at
        if not 0 <= moment <= self.end:
            raise Misuse(f"at {moment / SECOND:g} s: the past is known from 0 to {self.end / SECOND:g} s")
        text = question.strip().removeprefix("why ").strip()
        if not text:
            raise Misuse("a question is a signal, a condition, or a controller: table.OUT3, 'table.OUT3 == 0', table")
        if text in self.log.world.machines:
            return self._wait(text, moment)
        return self._condition(text, moment)

    # ------------------------------------------------------------------ signals and conditions

    def _condition(self, text: str, at: Nanos) -> Answer:
        asked = self._named(_SINGLE_EQUALS.sub("==", text))
        node = parse(asked)
        found = tuple(dict.fromkeys(names(node)))
        is_bare = asked == found[0] if len(found) == 1 else False
        if is_bare and found[0] not in self.log.changes and self.log.world.signal(found[0]).continuous:
            return self._moving(found[0], at)
        canonical = {name: self._canonical(name) for name in found}
        if all(self.log.is_recorded(name) for name in canonical.values()):
            value, since = self._from_log(asked, canonical, at, is_bare=is_bare)
        else:
            value, since = self._from_run(asked, at, is_bare=is_bare)
        state = f"{asked} is {value:g}" if is_bare else f"{asked} is {'true' if value else 'false'}"
        first = None if since is None else self._changed(tuple(canonical.values()), since)
        return self._answer(text, at, state, since, first)

    def _named(self, text: str) -> str:
        """The condition with names that leave out their controller in full, where there is only one that has it."""
        world = self.log.world
        for name in dict.fromkeys(names(parse(text))):
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
        return name in self.log.changes or self._is_signal(name)

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
        if name in self.log.changes:
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

    def _from_run(self, text: str, at: Nanos, *, is_bare: bool) -> tuple[float, Nanos | None]:
        """As `_from_log`, from another run in which the signals are watched."""
        world, turns = self._make(), list[tuple[Nanos, float]]()
        watch = _values if is_bare else _truths
        world.start("why", partial(watch, world, text, turns), is_external=True)
        for _ in replay(world, self._inputs, at):
            pass
        if not turns:
            raise Misuse(f"{text}: nothing is known of it at {at / SECOND:g} s")
        time, value = turns[-1]
        return value, time if len(turns) > 1 else None

    def _changed(self, signals: Sequence[str], time: Nanos) -> Cause | None:
        """What made one of these signals change at a moment."""
        log, causes = self.log, self.causes
        last = causes.last([name for name in signals if (change := log.last_change(name, time)) and change.time == time], time)
        if last is not None:
            return last
        found = [cause for name in signals if (cause := self._of_unrecorded(name, time))]
        return max(found, key=lambda cause: cause.link.time, default=None)

    def _of_unrecorded(self, signal: str, time: Nanos) -> Cause | None:
        owner, _, rest = signal.partition(".")
        world, causes = self.log.world, self.causes
        if owner in world.axes:
            drive = world.axes[owner].spec.drive
            return causes.motion(drive[0], drive[1].removeprefix("M"), time, owner)
        if owner not in world.machines:
            lanes = [name for name in self.log.changes if name == owner or name.startswith(f"{owner}.")]
            return causes.last(lanes, time)
        axis = _AXIS.match(rest)
        wanted = None if axis is None else Operand(OperandKind.AXIS, axis[1])
        return causes.at_moment(owner, time, wanted)

    def _moving(self, signal: str, at: Nanos) -> Answer:
        """Of a quantity that changes all the time."""
        world = self.log.world
        other = self._make()
        for _ in replay(other, self._inputs, at):
            pass
        state = f"{signal} is {other.read(signal):.6g} {world.signal(signal).unit}".rstrip()
        first = self._of_unrecorded(self._canonical(signal), at)
        return self._answer(signal, at, state, None if first is None else first.link.time, first)

    # ------------------------------------------------------------------ programs

    def _wait(self, machine: str, at: Nanos) -> Answer:
        """What the program of a controller waits for."""
        log = self.log
        index = log.last_executed(machine, at)
        if index < 0:
            raise Misuse(f"{machine} has executed no statement until {at / SECOND:g} s: ask about one of its signals")
        executed = log.executed[machine]
        here = executed[index]
        use = self.causes.use(machine, index)
        text = statement(log, here)
        if not use.waits or at - here.time <= log.world.programs[machine].statement_time:
            return self._answer(machine, at, f"{machine} does not wait: {text}", here.time, self.causes.statement(machine, index))
        links = [link for operand in use.reads for link in self._awaited(machine, operand, at)]
        if not use.reads:
            links.append(Link(here.time, machine, "it waits for a time only"))
        found = [cause for operand in use.reads if (cause := self.causes.operand(machine, operand, at, index))]
        changed = [cause for cause in found if cause.link.time > here.time]
        first = max(changed, key=lambda cause: cause.link.time, default=None) or self.causes.statement(machine, index)
        answer = self._answer(machine, at, f"{machine} waits at {text}", here.time, first)
        return answer._replace(links=(*links, *answer.links)[:MOST_LINKS])

    def _awaited(self, machine: str, operand: Operand, at: Nanos) -> Iterator[Link]:
        """The present state of what a statement waits for, and of what that depends on."""
        if operand.kind is OperandKind.PIN and operand.name:
            yield from self._states(f"{machine}.{operand.name}", at)
        elif operand.kind is OperandKind.AXIS:
            motion = self.causes.motion(machine, operand.name, at)
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
            drivers = self.causes.drivers(name)
            waiting += drivers
            when = "from the beginning" if since is None else f"since {since / SECOND:.6f} s"
            driven = f", driven by {' and '.join(drivers)}" if drivers else ""
            yield Link(at, name.partition(".")[0], f"{name} is {self.log.level(name, at):g} {when}{driven}")

    # ------------------------------------------------------------------ the chain

    @staticmethod
    def _answer(question: str, at: Nanos, state: str, since: Nanos | None, first: Cause | None) -> Answer:
        links: list[Link] = []
        cause = first
        while cause is not None and len(links) < MOST_LINKS:
            if cause.link in links:
                cause = None
                break
            links.append(cause.link)
            cause = cause.before()
        return Answer(question, at, state, since, tuple(links), cause is None)


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
