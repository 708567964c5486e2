"""Reads and changes of the commands of an M1486, in the terms of all programs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace

from steptwin.m1486.commanduse import NOTHING, ChipState, Control, Motion, Setting, Wait
from steptwin.m1486.functions import CARRY, FUNCTIONS, USER_FLAGS
from steptwin.m1486.lines import RUNSIGN_LINE
from steptwin.m1486.pins import OUTPUT_PINS, WAVEFORM
from steptwin.m1486.registers import GENERAL, REMAINDER_REGISTER
from steptwin.m1486.structure import is_computed
from steptwin.m1486.syntax import ChipCommand
from steptwin.simulation.kinds.programs import Resource, ResourceKind, StatementUse
from steptwin.tables import complete

_AXIS = Resource(ResourceKind.AXIS, "1")
_DISTANCE = Resource(ResourceKind.VALUE, "distance")
_SPEEDS = {
    Motion.MOVE: (Setting.START_STOP, Setting.ACCELERATION, Setting.VELOCITY, Setting.PROFILE),
    Motion.SEEK: (Setting.START_STOP,),
}
"""Settings that decide how fast a motion is."""
_EVERYTHING = range(1 << 16)
"""A jump that depends on something decides about what comes after it, wherever that is."""
_CALCULATIONS = frozenset("+-*/")
OPERANDS = ChipState.LINES | ChipState.REGISTERS
"""State that calculations read while functions 46 and 58 are ON."""
_KEPT = ChipState.FLAGS | ChipState.CARRY


def use_of(command: ChipCommand, operands: ChipState = NOTHING) -> StatementUse:
    """A move holds the program until its end. ``operands``: which of lines and registers calculations may read besides the
    number."""
    use = command.use
    if command.key in _CALCULATIONS:
        use = replace(use, reads=use.reads & ~OPERANDS | operands)
    elif use.control is Control.REPEAT:
        use = replace(use, writes=NOTHING)  # what L began is counted to its end
    # What is sent does not decide how long that waits; which functions are read is not known.
    reads = NOTHING if use.waits is Wait.SENDING else use.reads & ~ChipState.FUNCTIONS
    writes = _resources(use.writes, command)
    return StatementUse(
        _resources(reads, command),
        (*writes, _DISTANCE) if ChipState.DISTANCE in use.writes else writes,
        waits=use.waits is not Wait.NOTHING,
        governs=_EVERYTHING if is_computed(command) or use.control in (Control.BRANCH, Control.REPEAT) else range(0),
        acts_by=(_DISTANCE,) if ChipState.DISTANCE in use.reads else (),
        made_by=tuple(_value(one.value) for one in _SPEEDS.get(use.motion, ())),
        keeps=bool(use.writes & _KEPT),
        sets=float(use.level) if use.level is not None and command.lines and ChipState.LINES in use.writes else None,
    )


def _resources(state: ChipState, command: ChipCommand) -> tuple[Resource, ...]:
    return tuple(dict.fromkeys(one for piece, named in _RESOURCES.items() if piece in state for one in named(command)))


def _always(*found: Resource) -> Callable[[ChipCommand], Iterable[Resource]]:
    return lambda command: found


def _pin(name: str) -> Resource:
    return Resource(ResourceKind.PIN, name)


def _value(name: str) -> Resource:
    return Resource(ResourceKind.VALUE, name)


def _of_number(what: str, numbers: range) -> Callable[[ChipCommand], Iterable[Resource]]:
    """The flag or register of the number; with the internal variable it is not known which."""
    return lambda command: (_value(f"{what}{command.number}"),) if command.number in numbers else ()


def _function(command: ChipCommand) -> Iterable[Resource]:
    """The function that a command switches."""
    number = command.number
    return (function_switch(number),) if number is not None and number in FUNCTIONS and command.use.level is not None else ()


def function_switch(number: int) -> Resource:
    """Whether a function is on."""
    return _value(f"function{number}")


def _lines(command: ChipCommand) -> Iterable[Resource]:
    return [_pin(f"B{line}") for line in command.lines] or (_pin(""),)


_RESOURCES: Mapping[ChipState, Callable[[ChipCommand], Iterable[Resource]]] = complete(
    "state",
    ChipState,
    "resource",
    {
        **dict.fromkeys((ChipState.MOTION, ChipState.POSITION), _always(_AXIS)),
        ChipState.LINES: _lines,
        ChipState.SIGNALS: _always(*map(_pin, (*OUTPUT_PINS, f"B{RUNSIGN_LINE}"))),
        ChipState.WAVEFORM: _always(_pin(WAVEFORM)),
        ChipState.VARIABLE: _always(_value("variable")),
        ChipState.REGISTERS: _of_number("register", GENERAL),
        ChipState.REMAINDER: _always(_value(f"register{REMAINDER_REGISTER}")),
        ChipState.FLAGS: _of_number("flag", USER_FLAGS),
        ChipState.CARRY: _always(_value(f"flag{CARRY}")),
        ChipState.DISTANCE: _always(),  # what a move acts by
        ChipState.FUNCTIONS: _function,
        ChipState.SETTINGS: lambda command: (_value(command.use.sets.value),) if command.use.sets else (),
        # Neither pins nor axes, nor what a program calculates with.
        ChipState.HELD: _always(Resource(ResourceKind.PROGRAM, "")),
        ChipState.LOOPS: _always(_value("loop")),
        **dict.fromkeys((ChipState.CALL, ChipState.SENDING), _always()),
        **dict.fromkeys((ChipState.LISTENING, ChipState.MEMORY), _always()),
    },
)
