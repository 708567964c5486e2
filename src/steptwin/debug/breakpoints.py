"""Breakpoints as they are asked for while a world runs."""

from __future__ import annotations

from array import array
from bisect import bisect_left
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import TypeAlias

from steptwin.controller import Nanos
from steptwin.debug.calculation import HitCount, LogText, ResolvedExpression
from steptwin.debug.values import DataPoint, LabelPoint, LinePoint, SetPoint
from steptwin.errors import Misuse
from steptwin.messages import NONE, Message, text_of
from steptwin.nearmiss import NearMiss
from steptwin.simulation.kinds.programs import Programs, StatementLocation
from steptwin.simulation.world.simulation import Simulation

MOST_HITS = 1 << 16
"""Hits of one breakpoint that can be found again in the past; older ones are only counted."""

AnyPoint: TypeAlias = LinePoint | LabelPoint | DataPoint
ResolveExpression: TypeAlias = Callable[[str, str], ResolvedExpression]
"""The calculation for a controller of an expression. Raises `Misuse`."""


class Breakpoint:
    """A breakpoint at statements. Raises `Misuse` for a condition, hit count or log text that is none."""

    def __init__(
        self,
        number: int,
        asked: LinePoint | LabelPoint,
        locations: Mapping[str, Sequence[StatementLocation]],
        calculate: ResolveExpression,
    ) -> None:
        self.number = number
        self.asked = asked
        self.locations = locations
        """By controller."""
        condition = asked.condition
        self._conditions = {} if condition is None else {controller: calculate(controller, condition) for controller in locations}
        self._counts = None if asked.hits is None else HitCount(asked.hits)
        self.log: LogText | None = None
        if isinstance(asked, LinePoint) and asked.log is not None:
            self.log = LogText(asked.log, partial(calculate, asked.controller))
        self._times: array[int] = array("q")
        """When the condition held, as far as hits are counted: the latest of them."""
        self._dropped = 0
        """Number of hits before those."""

    def reads_others(self, controller: str) -> bool:
        """Whether the condition depends on what has no connection to the controller."""
        condition = self._conditions.get(controller)
        return condition is not None and condition.reads_others

    def is_known(self, controller: str, now: Nanos) -> bool:
        """Whether `holds_at_statement` can be asked."""
        condition = self._conditions.get(controller)
        return condition is None or condition.is_known_before_statement(now)

    def holds_at_statement(self, controller: str, now: Nanos) -> bool:
        """Whether the condition holds for a statement of a controller that is about to be executed. One that cannot be calculated
        does: it must not be overlooked."""
        condition = self._conditions.get(controller)
        return condition is None or _holds(condition.value_at_statement, now)

    def holds(self, controller: str, now: Nanos) -> bool:
        """The same for the world as it stands at ``now``."""
        condition = self._conditions.get(controller)
        return condition is None or _holds(condition.value, now)

    def counts(self, time: Nanos) -> bool:
        """Whether this hit, at which the condition holds, is one that is asked for."""
        if self._counts is None:
            return True
        times = self._times
        if not times or time > times[-1]:
            times.append(time)
            if len(times) > MOST_HITS:
                self._dropped += MOST_HITS // 2
                del times[: MOST_HITS // 2]
        at = bisect_left(times, time)
        return times[at] == time and self._counts.counts(self._dropped + at + 1)

    def forget_after(self, time: Nanos) -> None:
        """Forget what is known of the time after a moment: what comes later will be different."""
        del self._times[bisect_left(self._times, time + 1) :]

    def take_hits(self, other: Breakpoint) -> None:
        """Those of the same point, set before."""
        self._times, self._dropped = other._times, other._dropped


class Watch:
    """A data breakpoint: its value, and whether it is hit. Raises `Misuse` for a condition that is none, and for unknown
    names."""

    def __init__(self, number: int, asked: DataPoint, calculate: ResolveExpression) -> None:
        self.number = number
        self.controller = asked.controller
        self.name = asked.name
        text = asked.name if asked.condition is None else with_left_side(asked.name, asked.condition)
        self.has_condition = asked.condition is not None
        self._calculation = calculate(asked.controller, text)
        self._calculation.check_names()
        self.text = text

    def value(self, now: Nanos) -> float | None:
        """None where it is not known now, as a variable of a program that does not run."""
        try:
            return self._calculation.value(now)
        except Misuse:
            return None

    def is_hit(self, before: float | None, after: float | None) -> bool:
        """A value must change, a condition come true."""
        if self.has_condition:
            return bool(after) and not before
        return before is not None and after is not None and before != after


def _holds(value: Callable[[Nanos], float], now: Nanos) -> bool:
    try:
        return value(now) != 0.0
    except Misuse:
        return True


def with_left_side(name: str, condition: str) -> str:
    """``> 5`` as a condition on a value is ``VALUE > 5``."""
    return f"{name} {condition}" if condition.lstrip()[:1] in "<>=!" else condition


HAS_NO_PROGRAM = Message("debug.has-no-program", "{controller!r} has no program: {names} has one")
NO_CONTROLLER = Message("debug.no-controller", "no controller")


def _programs_of(programs: Mapping[str, Programs], controller: str) -> Programs:
    if controller not in programs:
        raise Misuse(HAS_NO_PROGRAM(controller=controller, names=list(programs) or NO_CONTROLLER()))
    return programs[controller]


UNKNOWN_TEXT = Message("debug.unknown-text", "{controller} has no text {text!r}: texts are {names}")
NO_STATEMENT_IN_LINE = Message("debug.no-statement-in-line", "no statement is in line {line} of {name} or after it")


def locations_of_line(programs: Mapping[str, Programs], asked: LinePoint) -> tuple[StatementLocation, int]:
    """The first statement in a line or after it, and its line. Raises `Misuse`."""
    own = _programs_of(programs, asked.controller)
    if asked.text not in own.texts:
        raise Misuse(UNKNOWN_TEXT(controller=asked.controller, text=asked.text, names=list(own.texts)))
    for number, statement in enumerate(own.statements(asked.text)):
        if statement.line >= asked.line and statement.start < statement.end:
            return StatementLocation(asked.text, number), statement.line
    raise Misuse(NO_STATEMENT_IN_LINE(line=asked.line, name=own.texts[asked.text].name))


UNKNOWN_LABEL = Message("debug.unknown-label", "no label is called {label!r}{hint}; there are {names}")


def locations_of_label(programs: Mapping[str, Programs], label: str) -> dict[str, list[StatementLocation]]:
    """The statements at a label, by controller. Raises `Misuse` with the labels there are."""
    found: dict[str, list[StatementLocation]] = {}
    wanted = label.strip().lstrip("@").upper()
    for controller, text, name, number in _labels(programs):
        if name.upper() in (wanted, f"LABEL {wanted}"):
            found.setdefault(controller, []).append(StatementLocation(text, number))
    if not found:
        known = list(dict.fromkeys(name for _, _, name, _ in _labels(programs)))
        raise Misuse(UNKNOWN_LABEL(label=label, hint=NearMiss().hint(wanted, known), names=list(known) or NONE()))
    return found


def _labels(programs: Mapping[str, Programs]) -> Iterator[tuple[str, str, str, int]]:
    for controller, own in programs.items():
        for text in own.texts:
            for name, number in own.labels(text).items():
                yield controller, text, name, number


def _why_not_reached(programs: Programs, location: StatementLocation, standing: Simulation | None, controller: str) -> str:
    """Why a program will not come to a statement; empty where it can."""
    line = programs.statements(location.text)[location.number].line
    if location.number not in programs.reached(location.text, (0,)):
        return f"no way of the program leads to line {line}"
    stack = () if standing is None else standing.programs_of(controller).stack(standing.now)
    here = [frame.location.number for frame in stack if frame.location.text == location.text]
    if here and location.number not in programs.reached(location.text, here):
        return f"from where it is, the program comes to line {line} only if it is started again"
    return ""


class Breakpoints:
    """All breakpoints that are set. ``calculate`` is of the world in which they are looked for."""

    def __init__(self, programs: Mapping[str, Programs], calculate: ResolveExpression) -> None:
        self._programs = programs
        self._calculate = calculate
        self._all: list[Breakpoint] = []
        self.watches: list[Watch] = []
        self.at: dict[str, dict[StatementLocation, list[Breakpoint]]] = {}
        """By controller and statement."""
        self._next = 1

    def set(self, asked: Sequence[AnyPoint], standing: Simulation | None = None) -> list[SetPoint]:
        """Set these and no others. Those that were set before keep their number and their hits. ``standing``: the state
        from which programs continue, if only the debugger can start them."""
        known: dict[AnyPoint, Breakpoint] = {point.asked: point for point in self._all}
        self._all, self.watches, self.at = [], [], {}
        return [self._set(one, known, standing) for one in asked]

    def _set(self, asked: AnyPoint, known: Mapping[AnyPoint, Breakpoint], standing: Simulation | None) -> SetPoint:
        before = known.get(asked)
        number = self._next if before is None else before.number
        self._next += before is None
        try:
            if isinstance(asked, DataPoint):
                _programs_of(self._programs, asked.controller)
                self.watches.append(Watch(number, asked, self._calculate))
                return SetPoint(number)
            line: int | None = None
            if isinstance(asked, LabelPoint):
                locations = locations_of_label(self._programs, asked.label)
            else:
                location, line = locations_of_line(self._programs, asked)
                locations = {asked.controller: [location]}
            point = Breakpoint(number, asked, locations, self._calculate)
        except Misuse as error:
            return SetPoint(number, problem=text_of(error))
        if before is not None:
            point.take_hits(before)
        self._all.append(point)
        for controller, its_locations in locations.items():
            for location in its_locations:
                self.at.setdefault(controller, {}).setdefault(location, []).append(point)
        found = [(controller, location) for controller, its in locations.items() for location in its]
        notes = [_why_not_reached(self._programs[controller], location, standing, controller) for controller, location in found]
        return SetPoint(number, [location for _, location in found], line, note="" if "" in notes else notes[0])

    def reading_others(self) -> list[str]:
        """The controllers with conditions that depend on what has no connection to them."""
        return [controller for controller in self.at if any(point.reads_others(controller) for point in self._all)]

    def forget_after(self, time: Nanos) -> None:
        for point in self._all:
            point.forget_after(time)
