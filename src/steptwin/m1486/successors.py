"""The control flow of what one chip receives: the ways out of I, of E, and of jumps whose label is computed."""

from __future__ import annotations

from collections.abc import Mapping

from steptwin.controlflow import ControlFlow
from steptwin.m1486.flow import continues_after_wrong_data, follow, loop_starts
from steptwin.m1486.lines import Interface
from steptwin.m1486.structure import CommandStream, written_label
from steptwin.m1486.variants import Variant

_JUMPS = ("J", "'")


def flow_of(stream: CommandStream, variant: Variant, interface: Interface) -> ControlFlow:
    """Statements are the commands of the stream. A jump to a label that is not there leads nowhere."""
    computed = [i for i, command in enumerate(stream.commands) if command.key in _JUMPS and command.from_variable]
    targets = follow(stream, variant, interface).targets if computed else {}
    goes_on = continues_after_wrong_data(stream)
    return ControlFlow(
        [_after(stream, index, targets, goes_on=goes_on) for index in range(len(stream.commands))],
        {
            index: (*_labelled(stream, index, targets), *((index + 1,) if goes_on else ()))
            for index, command in enumerate(stream.commands)
            if command.key == "'"
        },
        frozenset(index for index, command in enumerate(stream.commands) if command.key == "."),
    )


def _after(stream: CommandStream, index: int, targets: Mapping[int, set[int]], *, goes_on: bool) -> tuple[int, ...]:
    command, following = stream.commands[index], index + 1
    match command.key:
        case "I":
            return tuple(dict.fromkeys((*_labelled(stream, index, targets), following)))
        case "J":
            dropped = (following,) if goes_on and command.from_variable else ()
            return tuple(dict.fromkeys((*_labelled(stream, index, targets), *dropped)))
        case ".":
            return (following,) if goes_on else ()
        case "E":
            return tuple(dict.fromkeys((*loop_starts(stream, index), following))) if _repeats(stream, index) else (following,)
    return (following,)


def _labelled(stream: CommandStream, index: int, targets: Mapping[int, set[int]]) -> tuple[int, ...]:
    label = written_label(stream.commands[index])
    if label is None:
        return tuple(sorted(targets.get(index, ())))
    target = stream.resolve(index, label)
    return () if target is None else (target,)


def _repeats(stream: CommandStream, index: int) -> bool:
    """Whether an E can go back; that of L1 cannot."""
    return any(stream.commands[start - 1].number != 1 for start in loop_starts(stream, index))
