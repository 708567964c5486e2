"""The range of the position counter in a program, as far as the text determines it: G and H count from it.

The counter has 24 bits without a sign. The manual advises initial values that keep it from passing 0 (chapter VII.2, Equal).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from typing import NamedTuple

from steptwin.diagnostics import Diagnostic
from steptwin.m1486 import findings
from steptwin.m1486.commands import CLEAR_POSITION, When, find, grouped, when
from steptwin.m1486.microsteps import DEFAULT_DISTANCE_U
from steptwin.m1486.structure import CommandStream
from steptwin.m1486.syntax import ChipCommand, JumpCondition
from steptwin.m1486.variants import Variant

#: Most commands followed along all paths together; beyond it the rest of a program is not followed.
MOST_COMMANDS = 5_000
_COUNTER = range(2**24)


class _State(NamedTuple):
    """At the command ``index``: signed position, distance of the next move (None: unknown), the call and loops in progress."""

    index: int
    position: int | None = 0
    distance: int | None = DEFAULT_DISTANCE_U
    back: int | None = None
    loops: tuple[tuple[int, int], ...] = ()


def position_rules(stream: CommandStream, variant: Variant) -> Iterator[Diagnostic]:
    """A warning for each G and H that some path reaches while the position counter has passed its end."""
    reported: set[int] = set()
    seen: set[_State] = set()
    waiting = deque((_State(0),))
    while waiting and len(seen) < MOST_COMMANDS:
        state = waiting.popleft()
        if state in seen or state.index >= len(stream.commands):
            continue
        seen.add(state)
        command, position = stream.commands[state.index], state.position
        if command.key in "GH" and position is not None and position not in _COUNTER and state.index not in reported:
            reported.add(state.index)
            shown = position % len(_COUNTER)
            target = command.number or 0
            message = f"at position {_signed(position)} the counter shows {grouped(shown)}"
            hint = f"the move would be {_signed(target - shown)}; begin with a position that = sets, so that none is below 0"
            yield findings.POSITION_PASSED(command.span, message, hint)
        waiting += _after(stream, state, variant)


def _signed(number: int) -> str:
    return f"-{grouped(-number)}" if number < 0 else grouped(number)


def _distance_to(target: int | None, position: int | None) -> int | None:
    """The distance of G and H, which count from what the position counter shows."""
    return None if target is None or position is None else target - position % len(_COUNTER)


def _after(stream: CommandStream, state: _State, variant: Variant) -> list[_State]:
    index, position, distance, back, loops = state
    command = stream.commands[index]
    following = state._replace(index=index + 1)
    if command.key == "\\" and stream.in_file[index] is None:
        return [_State(index + 1)]
    if when(command.key, command.number) is not When.QUEUED or _is_refused(command, variant):
        return [following]
    match command.key:
        case "F" | "B":
            number = command.number
            return [following._replace(distance=None if number is None else number if command.key == "F" else -number)]
        case "D":
            return [following._replace(distance=None if distance is None else -distance)]
        case "G" | "H":
            target = 0 if command.key == "H" else command.number
            return [following._replace(distance=_distance_to(target, position))]
        case "G+" | "G-":
            return [following._replace(distance=None)]
        case "=":
            return [following._replace(position=command.number)]
        case "C" if command.number == CLEAR_POSITION or command.from_variable:
            return [following._replace(position=0 if command.number else None)]
        case "R":
            moved = None if position is None or distance is None else position + distance
            return [following._replace(position=moved)]
        case ")" | "(":
            return [following._replace(position=None)]
        case "L":
            return [following._replace(loops=(*loops, (index, command.number or 1)))]
        case "E":
            return [_end_of_loop(following, loops)]
        case "J" | "'" | "I":
            return _jumps(stream, following, index)
        case "." if back is not None:
            return [state._replace(index=back, back=None)]
    return [following]


def _is_refused(command: ChipCommand, variant: Variant) -> bool:
    return command.number is not None and find(command.key, command.number, variant) is None


def _end_of_loop(following: _State, loops: tuple[tuple[int, int], ...]) -> _State:
    if not loops:
        return following
    begin, left = loops[-1]
    if left > 1:
        return following._replace(index=begin + 1, loops=(*loops[:-1], (begin, left - 1)))
    return following._replace(loops=loops[:-1])


def _jumps(stream: CommandStream, following: _State, index: int) -> list[_State]:
    command = stream.commands[index]
    label = command.argument.label if isinstance(command.argument, JumpCondition) else command.number
    target = None if label is None else stream.resolve(index, label)
    if target is None:
        return [following]
    jumped = following._replace(index=target)
    if command.key == "'":
        return [jumped._replace(back=index + 1)]
    return [jumped] if command.key == "J" else [following, jumped]
