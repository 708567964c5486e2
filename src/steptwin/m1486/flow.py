"""Flow analysis: all paths of a program, with the settings that the program makes.

A command reached with several settings keeps each of them up to `MOST_STATES`; beyond that they are merged, and a value that
differs becomes None, unknown. Lines, registers and flags are unknown, and conditions on them branch. Distances in minimum
microsteps, speeds in full steps/s.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import reduce
from typing import NamedTuple

from steptwin.m1486.commands import find
from steptwin.m1486.functions import CONTINUE, INPUT, REGISTER, RUNSIGN
from steptwin.m1486.lines import Interface, line_group
from steptwin.m1486.microsteps import DEFAULT_DISTANCE_U, DEFAULT_PROFILE, DEFAULT_VELOCITY, microstep_size
from steptwin.m1486.structure import CommandStream
from steptwin.m1486.syntax import ChipCommand, JumpCondition
from steptwin.m1486.variants import Variant

MOST_STATES = 32
"""Enough for a line group of five lines; more settings at one place are merged."""
_MAIN = -1
"""The number of the call for commands outside every call."""


class Settings(NamedTuple):
    """The settings of the chip; None is unknown. Field names are those of the commands."""

    microstep: int | None
    qualification: int | None
    start_stop: int | None
    velocity: int | None
    profile: int | None
    acceleration: int | None
    distance: int | None
    """Of the next move; None also for a move to a position."""
    variable: int | None
    runsign: int | None
    """Functions 40, 46 and 58: 1 is ON, 0 is OFF."""
    lines_operand: int | None
    register_operand: int | None


_SETTING = {
    "M": "microstep",
    "Q": "qualification",
    "S": "start_stop",
    "V": "velocity",
    "P": "profile",
    "A": "acceleration",
    "F": "distance",
    "B": "distance",
    ":": "variable",
}
_FUNCTION_SETTING = {RUNSIGN: "runsign", INPUT: "lines_operand", REGISTER: "register_operand"}


def defaults(variant: Variant, interface: Interface) -> Settings:
    """The settings after power-up and after a reset."""
    return Settings(
        microstep=interface.microstep,
        qualification=1,
        start_stop=variant.start_stop,
        velocity=DEFAULT_VELOCITY,
        profile=DEFAULT_PROFILE,
        acceleration=variant.acceleration,
        distance=DEFAULT_DISTANCE_U,
        variable=None,
        runsign=0,
        lines_operand=0,
        register_operand=0,
    )


@dataclass(slots=True)
class FlowAnalysis:
    """The result: for each command that can be reached the settings it can be reached with, and where jumps lead."""

    states: dict[int, set[Settings]] = field(default_factory=dict)
    targets: dict[int, set[int]] = field(default_factory=dict)
    nested_calls: set[int] = field(default_factory=set)
    """Calls inside a subroutine, dots outside one, calls that no dot ends."""
    lone_returns: set[int] = field(default_factory=set)
    endless_calls: list[int] = field(default_factory=list)


def value(command: ChipCommand, state: Settings) -> int | None:
    """The number of a command: its own or the internal variable; None if unknown or without number."""
    return state.variable if command.from_variable else command.number


def continues_after_wrong_data(stream: CommandStream) -> bool:
    """Whether function 44 may be ON, so that a wrong command is left out and the next one executed (M-11)."""
    return any(command.key == "T" and (command.from_variable or command.number == CONTINUE) for command in stream.commands)


def loop_starts(stream: CommandStream, index: int) -> tuple[int, ...]:
    """Where the E at ``index`` can go back to: after its L; where a jump leads into or out of a loop, after every L, because the
    loops in progress are then not those around it in the text."""
    if stream.are_loops_nested:
        loop = stream.loops.get(index)
        return () if loop is None else (loop + 1,)
    return tuple(loop + 1 for loop in stream.depth)


def follow(stream: CommandStream, variant: Variant, interface: Interface) -> FlowAnalysis:
    """Follow every path of the stream from its beginning and from each reset."""
    return _Walk(stream, variant, interface).run()


class _Point:
    """The settings with which a place has been reached."""

    def __init__(self) -> None:
        self.states: set[Settings] = set()
        self.merged: Settings | None = None

    def add(self, state: Settings) -> Settings | None:
        """The state to continue with from here after ``state``; None if nothing is new."""
        if self.merged is None:
            if state in self.states:
                return None
            self.states.add(state)
            if len(self.states) <= MOST_STATES:
                return state
            self.merged = reduce(_join, self.states)
        else:
            joined = _join(self.merged, state)
            if joined == self.merged:
                return None
            self.merged = joined
        self.states = {self.merged}
        return self.merged


def _join(a: Settings, b: Settings) -> Settings:
    return Settings._make(x if x == y else None for x, y in zip(a, b, strict=True))


class _Walk:
    def __init__(self, stream: CommandStream, variant: Variant, interface: Interface) -> None:
        self.stream = stream
        self.variant = variant
        self.start = defaults(variant, interface)
        self.goes_on = continues_after_wrong_data(stream)
        self.flow = FlowAnalysis()
        self.points: dict[tuple[int, int], _Point] = {}
        self.open: list[tuple[int, int, Settings]] = []
        self.returned: set[int] = set()

    def run(self) -> FlowAnalysis:
        self.arrive(0, _MAIN, self.start)
        for index, command in enumerate(self.stream.commands):
            # A reset ends the running program, also an endless one.
            if command.key == "\\" and self.stream.in_file[index] is None:
                self.arrive(index, _MAIN, self.start)
        while self.open or self.leave_endless_calls():
            index, call, state = self.open.pop()
            self.step(index, call, state)
        for (index, _), point in self.points.items():
            self.flow.states.setdefault(index, set()).update(point.states)
        return self.flow

    def arrive(self, index: int, call: int, state: Settings) -> None:
        if index >= len(self.stream.commands):
            return
        point = self.points.setdefault((index, call), _Point())
        news = point.add(state)
        if news is not None:
            self.open.append((index, call, news))

    def leave_endless_calls(self) -> bool:
        """Continue after calls that never return, so that the commands behind them are analysed."""
        calls = {call for _, call in self.points if call != _MAIN} - self.returned
        for call in calls:
            self.returned.add(call)
            self.flow.endless_calls.append(call)
            for state in tuple(self.points[call, _MAIN].states):
                self.arrive(call + 1, _MAIN, state)
        return bool(self.open)

    def step(self, index: int, call: int, state: Settings) -> None:
        command = self.stream.commands[index]
        match command.key:
            case "J":
                self.jump(index, call, state, value(command, state))
            case "I":
                if isinstance(command.argument, JumpCondition):
                    self.jump(index, call, state, command.argument.label)
                self.arrive(index + 1, call, state)
            case "'" if call != _MAIN:
                self.flow.nested_calls.add(index)
                self.arrive(index + 1, call, state)
            case "'":
                self.jump(index, index, state, value(command, state))
            case ".":
                self.come_back(index, call, state)
            case "E":
                for target in (*loop_starts(self.stream, index), index + 1):
                    self.arrive(target, call, state)
            case "\\" if self.stream.in_file[index] is None:
                self.arrive(index + 1, _MAIN, self.start)
            case _:
                for after in _after(command, state, self.variant):
                    self.arrive(index + 1, call, after)

    def jump(self, index: int, call: int, state: Settings, label: int | None) -> None:
        """Continue at ``label``; at every label if it is unknown; at the next command if it does not exist."""
        if label is None:
            targets = list(self.stream.visible_labels(index).values())
            if self.goes_on:
                self.arrive(index + 1, _MAIN if call == index else call, state)
        else:
            target = self.stream.resolve(index, label)
            targets = [] if target is None else [target]
        self.flow.targets.setdefault(index, set()).update(targets)
        for target in targets:
            self.arrive(target, call, state)
        if not targets:
            self.arrive(index + 1, _MAIN if call == index else call, state)

    def come_back(self, index: int, call: int, state: Settings) -> None:
        if call == _MAIN:
            self.flow.lone_returns.add(index)
            self.arrive(index + 1, call, state)
        else:
            self.returned.add(call)
            self.arrive(call + 1, _MAIN, state)


def _after(command: ChipCommand, state: Settings, variant: Variant) -> Iterable[Settings]:
    """The settings after a command that the next one follows."""
    key = command.key
    number = value(command, state)
    if key in "+-*/":
        return (state._replace(variable=_arithmetic(key, state, number)),)
    if key == "<":
        return (state._replace(variable=None),)
    if key in ("G", "G+", "G-", "H"):
        return (state._replace(distance=None),)
    if number is None:
        return (_after_unknown(command, state),)
    if find(key, number, variant) is None or _is_wrong_multiple(key, number, state):
        return (state,)
    if key == "?":
        return _readings(state, number)
    if key in _SETTING:
        return (state._replace(**{_SETTING[key]: number}),)
    if key in "TC" and number in _FUNCTION_SETTING:
        return (state._replace(**{_FUNCTION_SETTING[number]: int(key == "T")}),)
    return (state,)


def _is_wrong_multiple(key: str, number: int, state: Settings) -> bool:
    return key in "FB" and state.microstep is not None and number % microstep_size(state.microstep) != 0


def _after_unknown(command: ChipCommand, state: Settings) -> Settings:
    if not command.from_variable:
        return state
    if command.key in "TC":
        return state._replace(runsign=None, lines_operand=None, register_operand=None)
    if command.key == "?":
        return state._replace(variable=None)
    return state._replace(**{_SETTING[command.key]: None}) if command.key in _SETTING else state


def _readings(state: Settings, group: int) -> Iterable[Settings]:
    lines = line_group(group)
    if lines is None or 2 ** len(lines) > MOST_STATES:
        return (state._replace(variable=None),)
    return (state._replace(variable=reading) for reading in range(2 ** len(lines)))


def _arithmetic(key: str, state: Settings, operand: int | None) -> int | None:
    """The internal variable after + - * /, modulo 2^24 (M-13); None where operand or variable are unknown."""
    if state.lines_operand != 0 or state.register_operand != 0:
        return None
    if state.variable is None or operand is None:
        return None
    match key:
        case "+":
            result = state.variable + operand
        case "-":
            result = state.variable - operand
        case "*":
            result = state.variable * operand
        case _:
            result = state.variable // operand if operand else state.variable
    return result % 2**24
