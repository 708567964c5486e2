"""The range of the position counter in a program, as far as the text determines it: G and H count from it.

The counter has 24 bits without a sign. The manual advises initial values that keep it from passing 0 (chapter VII.2, Equal).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple

from steptwin.diagnostics import Diagnostic
from steptwin.m1486 import findings
from steptwin.m1486.commands import CLEAR_POSITION, When, find, grouped, meant, when
from steptwin.m1486.commanduse import TO_LABEL, ChipState, Control, Motion, NextMove
from steptwin.m1486.microsteps import DEFAULT_DISTANCE_U, UNIT
from steptwin.m1486.structure import CommandStream, written_label
from steptwin.m1486.syntax import ChipCommand
from steptwin.m1486.variants import Variant
from steptwin.messages import Message
from steptwin.tables import complete

COUNTER_SHOWS = Message("m1486.counter-shows", "at position {position} the counter shows {shown}")
BEGIN_WITH_A_POSITION = Message(
    "m1486.begin-with-a-position", "the move would be {distance}; begin with a position that = sets, so that none is below 0"
)

MOST_COMMANDS = 2_000
"""Most commands followed along all paths together, of those that move, jump or are about a position; beyond it the rest of a
program is not followed."""
_COUNTER = range(2**24)
_COUNTING = frozenset({NextMove.TO_POSITION, NextMove.TO_ZERO})
"""Moves that count from the position counter."""
_FOLLOWED = ChipState.POSITION | ChipState.DISTANCE | ChipState.LOOPS


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
    asking = {
        index for index, command in enumerate(stream.commands) if command.use.next_move in _COUNTING and onward[index] == index
    }
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
            message = COUNTER_SHOWS(position=_signed(position), shown=grouped(shown))
            distance = _signed(target - shown)
            hint = BEGIN_WITH_A_POSITION(distance=distance)
            yield findings.POSITION_PASSED(command.span, message, hint)
        for after in _after(stream, state):
            waiting.append(_State(onward[after.index], after.position, after.distance, after.back, after.loops))


def _onward(stream: CommandStream, variant: Variant) -> Sequence[int]:
    """For each place, and the end, the first command from there on that changes what is followed, or where it goes on."""
    found = [len(stream.commands)]
    for index in range(len(stream.commands) - 1, -1, -1):
        command = stream.commands[index]
        ends = command.use.control is Control.RESTART and stream.in_file[index] is None
        acts = _is_followed(command) and when(command.key, command.number) is When.QUEUED and not _is_refused(command, variant)
        found.append(index if ends or acts else found[-1])
    return found[::-1]


def _signed(number: int) -> str:
    return f"-{grouped(-number)}" if number < 0 else grouped(number)


def _distance_to(target: int | None, position: int | None) -> int | None:
    """The distance of G and H, which count from what the position counter shows."""
    return None if target is None or position is None else target - position % len(_COUNTER)


def _is_followed(command: ChipCommand) -> bool:
    use = command.use
    return bool(use.writes & _FOLLOWED) or use.control is not Control.NEXT


def _is_refused(command: ChipCommand, variant: Variant) -> bool:
    return command.number is not None and find(command.key, command.number, variant) is None


def _after(stream: CommandStream, state: _State) -> Sequence[_State]:
    """States after a command that is followed; places are not brought to the next such command."""
    return _AFTER[stream.commands[state.index].use.control](stream, state)


def _next(stream: CommandStream, state: _State) -> Sequence[_State]:
    index, position, distance, back, loops = state
    command = stream.commands[index]
    if ChipState.LOOPS in command.use.writes:
        loops = (*loops, (index, command.number or 1))
    position, distance = _moved(command, position, distance)
    return (_State(index + 1, position, distance, back, loops),)


def _moved(command: ChipCommand, position: int | None, distance: int | None) -> tuple[int | None, int | None]:
    """Position and distance after a command that may change them."""
    use = command.use
    if ChipState.POSITION in use.writes:
        position = _set_to(command) if use.motion is Motion.NONE else _POSITIONS[use.motion](position, distance)
    return position, _DISTANCES[use.next_move](command.number, position, distance)


def _set_to(command: ChipCommand) -> int | None:
    """Value that a command without motion gives the position counter, if the text says it."""
    if command.number is None:
        return None
    (spec,) = meant(command.key, command.number)
    return command.number if spec.unit == UNIT else 0 if spec.values == (CLEAR_POSITION,) else None


def _repeat(stream: CommandStream, state: _State) -> Sequence[_State]:
    *outer, (begin, left) = state.loops or ((state.index, 1),)
    if left > 1:
        return (state._replace(index=begin + 1, loops=(*outer, (begin, left - 1))),)
    return (state._replace(index=state.index + 1, loops=tuple(outer)),)


def _jumps(stream: CommandStream, state: _State) -> Sequence[_State]:
    command, following = stream.commands[state.index], state.index + 1
    label = written_label(command)
    target = None if label is None else stream.resolve(state.index, label)
    if target is None:
        return (state._replace(index=following),)
    control = command.use.control
    jumped = state._replace(index=target, back=following if control is Control.CALL else state.back)
    return (state._replace(index=following), jumped) if control is Control.BRANCH else (jumped,)


_AFTER: Mapping[Control, Callable[[CommandStream, _State], Sequence[_State]]] = complete(
    "control",
    Control,
    "way of the position",
    {
        Control.NEXT: _next,
        **dict.fromkeys(TO_LABEL, _jumps),
        Control.RETURN: lambda stream, state: (
            state._replace(index=state.index + 1 if state.back is None else state.back, back=None),
        ),
        Control.REPEAT: _repeat,
        Control.RESTART: lambda stream, state: (_State(state.index + 1),),
    },
)

_POSITIONS: Mapping[Motion, Callable[[int | None, int | None], int | None]] = complete(
    "motion",
    Motion,
    "position after it",
    {
        Motion.NONE: lambda position, distance: position,
        Motion.MOVE: lambda position, distance: None if position is None or distance is None else position + distance,
        **dict.fromkeys((Motion.SEEK, Motion.STORED), lambda position, distance: None),
    },
)

_DISTANCES: Mapping[NextMove, Callable[[int | None, int | None, int | None], int | None]] = complete(
    "next move",
    NextMove,
    "signed distance",
    {
        NextMove.UNCHANGED: lambda number, position, distance: distance,
        NextMove.FORWARD: lambda number, position, distance: number,
        NextMove.BACKWARD: lambda number, position, distance: None if number is None else -number,
        NextMove.REVERSED: lambda number, position, distance: None if distance is None else -distance,
        NextMove.TO_POSITION: lambda number, position, distance: _distance_to(number, position),
        NextMove.TO_ZERO: lambda number, position, distance: _distance_to(0, position),
        NextMove.ENDLESS: lambda number, position, distance: None,
    },
)
"""By number, position and distance before."""
