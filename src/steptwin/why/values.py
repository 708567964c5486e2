"""The values of what questions are about, and since when they are so."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

from steptwin.controller import Nanos
from steptwin.simulation.logic.condition import Signal, SignalCondition
from steptwin.simulation.logic.expression import parse_condition
from steptwin.why import points
from steptwin.why.lacking import EXECUTED, HAPPENED
from steptwin.why.notedpast import NotedPast, text_of_question, without_not
from steptwin.why.replayed import ReplayedSignals, TimeSeries, watch_truth, watch_value
from steptwin.why.search import Asked, executed, happened
from steptwin.why.states import Interval

FoundValue: TypeAlias = Generator[None, None, tuple[float, Nanos | None]]


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


class SignalValues:
    """Values in a past. What is in no trace, such as a register, is found by running it again, and remembered."""

    def __init__(self, past: NotedPast) -> None:
        self._past = past
        self._log = past.log
        self._names = past.names
        self._replayed = ReplayedSignals(past.make, past.inputs)

    def asked(self, question: str) -> Asked | None:
        """The change that `LastChanges` searches for; None for a controller, for a bare quantity that moves all the time, and for
        `idle`. Raises `Misuse`."""
        text = text_of_question(question)
        if text.startswith(HAPPENED):
            return happened(text)
        if text.startswith(EXECUTED):
            return executed(text)
        if not text or self._names.is_script(text):
            return None
        if without_not(text) in self._log.world.controllers or self._names.variable(text) is not None:
            return None
        text = self._names.named(text)
        names = tuple(dict.fromkeys(parse_condition(text).names()))
        is_bare = len(names) == 1 and text == names[0]
        moving = {name for name in names if not self._log.has(name) and self._log.world.signal(name).continuous}
        if (is_bare and self._names.takes_values_between(text)) or "idle" in names:
            return None
        canonical = {name: self._names.canonical(name) for name in names}
        edges = frozenset(full for full in canonical.values() if self._has_edges(full))
        # Elements know their signals by the names in the question only.
        signals = {name: full if full in edges or self._names.is_signal(full) else name for name, full in canonical.items()}

        def flip(noted: Mapping[str, TimeSeries], at: Nanos) -> Nanos | None:
            series = {name: noted[signal] for name, signal in signals.items()}
            if is_bare:
                return points.since(series[text], at)
            condition = SignalCondition(text, lambda name: _Level(partial(points.level, series[name]), self._names.unit(name)))
            times = {time for one in series.values() for time in points.changes(one, -1, at)}
            return _last_flip(condition, times, at)

        moving = frozenset(signals[name] for name in moving)
        return Asked(text, frozenset(signals.values()), edges, moving, flip)

    def _has_edges(self, signal: str) -> bool:
        return self._log.has(signal) or signal.partition(".")[2] in self._past.pins(signal)

    def from_log(self, text: str, canonical: dict[str, str], at: Nanos, *, is_bare: bool) -> tuple[float, Nanos | None]:
        """The value at a moment, and when it became so."""
        log = self._log
        if is_bare:
            (name,) = canonical.values()
            return log.level(name, at), log.since(name, at)
        condition = SignalCondition(text, lambda name: _Level(partial(log.level, canonical[name]), self._names.unit(name)))
        times = {time for name in canonical.values() for time in log.changes_in(name, -1, at)}
        return float(condition.holds(at)), _last_flip(condition, times, at)

    def from_run(self, text: str, canonical: dict[str, str], at: Nanos, *, is_bare: bool) -> FoundValue:
        """As `from_log`, from values that are in no trace: from interval to interval back to the last change."""
        log, replayed, controllers = self._log, self._replayed, self._log.world.controllers
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
        intervals = list(self._past.on_the_way.intervals(at, self._past.end))
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
        log = self._log
        for interval in intervals:
            begin, levels = interval.state.snapshot.now, dict[str, float]()
            for name, full in canonical.items():
                if not log.is_recorded(full):
                    rest = self._past.on_the_way.rest(full, interval)
                    if rest is None:
                        break
                    levels[name] = rest
                elif any(log.changes_in(full, begin - 1, interval.end)):
                    break
                else:
                    levels[name] = log.level(full, begin)
            else:
                at_rest = SignalCondition(
                    text, lambda name, levels=levels: _Level(lambda now: levels[name], self._names.unit(name))
                )
                self._replayed.remember(text, interval, float(at_rest.holds(begin)))

    def _level_in(self, interval: Interval, recorded: Mapping[str, str], watched: Mapping[str, str], name: str) -> Signal:
        """A signal of a condition in an interval."""
        if name in recorded:
            return _Level(partial(self._log.level, recorded[name]), self._names.unit(name))
        return _Level(partial(self._replayed.level, watched[name], interval), self._names.unit(name))


def _last_flip(condition: SignalCondition, times: Iterable[Nanos], at: Nanos) -> Nanos | None:
    """The last of the moments at which something changed that made a condition what it is at a moment."""
    value = condition.holds(at)
    return next((time for time in sorted(times, reverse=True) if condition.holds(time - 1) is not value), None)
