"""Flow analysis: all paths of a program, with the settings that the program makes.

A command reached with several settings keeps each of them up to `MOST_STATES`; beyond that they are merged, and a value that
differs becomes None, unknown. Lines, registers and flags are unknown, and conditions on them branch. Distances in minimum
microsteps, speeds in full steps/s.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import reduce
from typing import NamedTuple

from steptwin.m1486.commands import CALCULATING, ArgType, CommandSpec, find
from steptwin.m1486.commanduse import ChipState, CommandUse, Control, NextMove
from steptwin.m1486.functions import CONTINUE, INPUT, REGISTER, RUNSIGN
from steptwin.m1486.lines import Interface
from steptwin.m1486.microsteps import DEFAULT_DISTANCE_U, DEFAULT_PROFILE, DEFAULT_VELOCITY, UNIT, microstep_size
from steptwin.m1486.structure import CommandStream, written_label
from steptwin.m1486.syntax import ChipCommand
from steptwin.m1486.variants import Variant
from steptwin.tables import complete

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
    """Distance of the next move; None also for a move to a position."""
    variable: int | None
    runsign: int | None
    """Functions 40, 46 and 58: 1 is ON, 0 is OFF."""
    lines_operand: int | None
    register_operand: int | None


_FUNCTION_SETTING = {RUNSIGN: "runsign", INPUT: "lines_operand", REGISTER: "register_operand"}
_KNOWN = {
    ChipState.SETTINGS: ("microstep", "qualification", "start_stop", "velocity", "profile", "acceleration"),
    ChipState.DISTANCE: ("distance",),
    ChipState.VARIABLE: ("variable",),
    ChipState.FUNCTIONS: tuple(_FUNCTION_SETTING.values()),
}
"""The settings that are followed, by what a command changes."""


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


def may_turn_on(function: int, command: ChipCommand) -> bool:
    """Whether a command turns a function on, or can, with the internal variable."""
    use = command.use
    return ChipState.FUNCTIONS in use.writes and use.level == 1 and command.number in (None, function)


def continues_after_wrong_data(stream: CommandStream) -> bool:
    """Whether function 44 may be ON, so that a wrong command is left out and the next one executed (M-11)."""
    return any(may_turn_on(CONTINUE, command) for command in stream.commands)


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
            if command.use.control is Control.RESTART and self.stream.in_file[index] is None:
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
        _STEPS[self.stream.commands[index].use.control](self, index, call, state)

    def go_on(self, index: int, call: int, state: Settings) -> None:
        for after in _after(self.stream.commands[index], state, self.variant):
            self.arrive(index + 1, call, after)

    def branch(self, index: int, call: int, state: Settings) -> None:
        label = written_label(self.stream.commands[index])
        if label is not None:
            self.jump_to(index, call, state, label)
        self.arrive(index + 1, call, state)

    def call(self, index: int, call: int, state: Settings) -> None:
        if call == _MAIN:
            self.jump(index, index, state)
        else:
            self.flow.nested_calls.add(index)
            self.arrive(index + 1, call, state)

    def repeat(self, index: int, call: int, state: Settings) -> None:
        for target in (*loop_starts(self.stream, index), index + 1):
            self.arrive(target, call, state)

    def restart(self, index: int, call: int, state: Settings) -> None:
        if self.stream.in_file[index] is None:
            self.arrive(index + 1, _MAIN, self.start)
        else:
            self.arrive(index + 1, call, state)

    def jump(self, index: int, call: int, state: Settings) -> None:
        self.jump_to(index, call, state, value(self.stream.commands[index], state))

    def jump_to(self, index: int, call: int, state: Settings, label: int | None) -> None:
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


_STEPS: Mapping[Control, Callable[[_Walk, int, int, Settings], None]] = complete(
    "control",
    Control,
    "way of a flow analysis",
    {
        Control.NEXT: _Walk.go_on,
        Control.JUMP: _Walk.jump,
        Control.BRANCH: _Walk.branch,
        Control.CALL: _Walk.call,
        Control.RETURN: _Walk.come_back,
        Control.REPEAT: _Walk.repeat,
        Control.RESTART: _Walk.restart,
    },
)


def _after(command: ChipCommand, state: Settings, variant: Variant) -> Iterable[Settings]:
    """The settings after a command that the next one follows. What it changes is unknown unless a rule here says more."""
    number = value(command, state)
    if number is None and command.from_variable:
        return (state._replace(**_changed(command.use)),)
    spec = find(command.key, number, variant)
    if spec is None or _is_wrong_multiple(spec, number, state):
        return (state,)
    changed, use = _changed(spec.use), spec.use
    if use.sets is not None:
        changed = dict.fromkeys(changed, number)
    elif use.next_move is not NextMove.UNCHANGED:
        changed["distance"] = _DISTANCES[use.next_move](number, state.distance)
    elif spec.kind is ArgType.FUNCTION:
        changed = {name: use.level for function, name in _FUNCTION_SETTING.items() if function == number}
    elif spec.name in _RESULTS:
        changed["variable"] = _result(spec.name, state, number)
    elif changed and spec.kind is ArgType.LINES:
        return _readings(state, spec.lines(number or 0))
    return (state._replace(**changed),)


def _changed(use: CommandUse) -> dict[str, int | None]:
    """The settings that a command changes, as unknown ones."""
    if use.sets is not None:
        return dict.fromkeys({use.sets.value}.intersection(Settings._fields))
    return dict.fromkeys(name for state, names in _KNOWN.items() if state & use.writes for name in names)


def _is_wrong_multiple(spec: CommandSpec, number: int | None, state: Settings) -> bool:
    return spec.unit == UNIT and state.microstep is not None and (number or 0) % microstep_size(state.microstep) != 0


def _readings(state: Settings, lines: range) -> Iterable[Settings]:
    if 2 ** len(lines) > MOST_STATES:
        return (state._replace(variable=None),)
    return (state._replace(variable=reading) for reading in range(2 ** len(lines)))


_DISTANCES: Mapping[NextMove, Callable[[int | None, int | None], int | None]] = complete(
    "next move",
    NextMove,
    "distance",
    {
        **dict.fromkeys((NextMove.FORWARD, NextMove.BACKWARD), lambda number, distance: number),
        **dict.fromkeys((NextMove.REVERSED, NextMove.UNCHANGED), lambda number, distance: distance),
        **dict.fromkeys((NextMove.TO_POSITION, NextMove.TO_ZERO, NextMove.ENDLESS), lambda number, distance: None),
    },
)
"""Without direction, by number and distance before."""

_RESULTS: Mapping[str, Callable[[int, int], int]] = complete(
    "command that calculates",
    CALCULATING,
    "result",
    {
        "Add": operator.add,
        "Subtract": operator.sub,
        "Multiply": operator.mul,
        "Divide": lambda variable, operand: variable // operand if operand else variable,
    },
)


def _result(name: str, state: Settings, operand: int | None) -> int | None:
    """The internal variable after + - * /, modulo 2^24 (M-13); None where operand or variable are unknown."""
    if state.lines_operand != 0 or state.register_operand != 0 or state.variable is None or operand is None:
        return None
    return _RESULTS[name](state.variable, operand) % 2**24
