"""What can be executed after each command of a program: the ways out of I, of E, and of jumps whose label is computed."""

from __future__ import annotations

from collections.abc import Mapping

from steptwin.m1486.flow import follow
from steptwin.m1486.lines import Interface
from steptwin.m1486.structure import CommandStream, written_label
from steptwin.m1486.variants import Variant

_JUMPS = ("J", "'")


def successors(stream: CommandStream, variant: Variant, interface: Interface) -> list[tuple[int, ...]]:
    """For each command of the stream the indices of those that can come next; one past the end is the end.

    A jump to a label that is not there leads nowhere.
    """
    computed = [i for i, command in enumerate(stream.commands) if command.key in _JUMPS and command.from_variable]
    targets = follow(stream, variant, interface).targets if computed else {}
    return [_after(stream, index, targets) for index in range(len(stream.commands))]


def _after(stream: CommandStream, index: int, targets: Mapping[int, set[int]]) -> tuple[int, ...]:
    command, following = stream.commands[index], index + 1
    label = written_label(command)
    target = None if label is None else stream.resolve(index, label)
    labelled = () if target is None else (target,)
    match command.key:
        case "I":
            return tuple(dict.fromkeys((*labelled, following)))
        case "J" | "'":
            return tuple(sorted(targets.get(index, ()))) if command.from_variable else labelled
        case "E" if index in stream.loops:
            loop = stream.loops[index]
            return (following,) if stream.commands[loop].number == 1 else (loop + 1, following)
    return (following,)
