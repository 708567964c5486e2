"""The range of the position counter in a program, as far as the text determines it: G and H count from it.

The counter has 24 bits without a sign. The manual advises initial values that keep it from passing 0 (chapter VII.2, Equal).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from steptwin.diagnostics import Diagnostic
from steptwin.m1486 import findings
from steptwin.m1486.commands import CLEAR_POSITION, When, find, grouped, when
from steptwin.m1486.microsteps import DEFAULT_DISTANCE_U
from steptwin.m1486.structure import CommandStream
from steptwin.m1486.syntax import ChipCommand, JumpCondition
from steptwin.m1486.variants import Variant

MOST_COMMANDS = 2_000
"""Most commands followed along all paths together, of those that move, jump or are about a position; beyond it the rest of a
program is not followed."""
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
    onward = _onward(stream, variant)
    asking = {index for index, command in enumerate(stream.commands) if command.key in "GH" and onward[index] == index}
    seen: set[_State] = set()
    waiting = deque((_State(onward[0]),))
    while waiting and asking and len(seen) < MOST_COMMANDS:
        state = waiting.popleft()
        index, position = state[:2]
        if state in seen or index >= len(stream.commands):
            continue
        seen.add(state)
        if index in asking and position is not None and position not in _COUNTER:
            asking.remove(index)
            command = stream.commands[index]
            shown = position % len(_COUNTER)
            target = command.number or 0
            message = f"at position {_signed(position)} the counter shows {grouped(shown)}"
            hint = f"the move would be {_signed(target - shown)}; begin with a position that = sets, so that none is below 0"
            yield findings.POSITION_PASSED(command.span, message, hint)
        for after in _after(stream, state):
            waiting.append(_State(onward[after.index], after.position, after.distance, after.back, after.loops))


def _onward(stream: CommandStream, variant: Variant) -> Sequence[int]:
    """For each place, and the end, the first command from there on that changes what is followed, or where it goes on."""
    found = [len(stream.commands)]
    for index in range(len(stream.commands) - 1, -1, -1):
        command = stream.commands[index]
        ends = command.key == "\\" and stream.in_file[index] is None
        acts = command.key in _FOLLOWED and when(command.key, command.number) is When.QUEUED and not _is_refused(command, variant)
        found.append(index if ends or acts else found[-1])
    return found[::-1]


def _signed(number: int) -> str:
    return f"-{grouped(-number)}" if number < 0 else grouped(number)


def _distance_to(target: int | None, position: int | None) -> int | None:
    """The distance of G and H, which count from what the position counter shows."""
    return None if target is None or position is None else target - position % len(_COUNTER)


def _after(stream: CommandStream, state: _State) -> Sequence[_State]:
    """What comes after a command that is followed; places are not brought to the next such command."""
    index, position, distance, back, loops = state
    command = stream.commands[index]
    after = index + 1
    match command.key:
        case "\\":
            return (_State(after),)
        case "J" | "'" | "I":
            return _jumps(stream, state)
        case "L":
            loops = (*loops, (index, command.number or 1))
        case "E":
            after, loops = _end_of_loop(after, loops)
        case "." if back is not None:
            after, back = back, None
        case _:
            position, distance = _moved(command, position, distance)
    return (_State(after, position, distance, back, loops),)


def _moved(command: ChipCommand, position: int | None, distance: int | None) -> tuple[int | None, int | None]:
    """Position and distance after a command that may change them."""
    number = command.number
    match command.key:
        case "F" | "B":
            distance = None if number is None else number if command.key == "F" else -number
        case "D":
            distance = None if distance is None else -distance
        case "G" | "H":
            distance = _distance_to(0 if command.key == "H" else number, position)
        case "G+" | "G-":
            distance = None
        case "=":
            position = number
        case "C" if number == CLEAR_POSITION or command.from_variable:
            position = 0 if number else None
        case "R":
            position = None if position is None or distance is None else position + distance
        case ")" | "(":
            position = None
    return position, distance


_FOLLOWED = frozenset(("F", "B", "D", "G", "H", "G+", "G-", "=", "C", "R", ")", "(", "L", "E", ".", "J", "'", "I"))
"""The commands of `_after`, besides the end of what is typed."""


def _is_refused(command: ChipCommand, variant: Variant) -> bool:
    return command.number is not None and find(command.key, command.number, variant) is None


def _end_of_loop(after: int, loops: tuple[tuple[int, int], ...]) -> tuple[int, tuple[tuple[int, int], ...]]:
    if not loops:
        return after, loops
    begin, left = loops[-1]
    if left > 1:
        return begin + 1, (*loops[:-1], (begin, left - 1))
    return after, loops[:-1]


def _jumps(stream: CommandStream, state: _State) -> Sequence[_State]:
    index, position, distance, back, loops = state
    command = stream.commands[index]
    label = command.argument.label if isinstance(command.argument, JumpCondition) else command.number
    target = None if label is None else stream.resolve(index, label)
    following = _State(index + 1, position, distance, back, loops)
    if target is None:
        return (following,)
    jumped = _State(target, position, distance, index + 1 if command.key == "'" else back, loops)
    return (following, jumped) if command.key == "I" else (jumped,)
