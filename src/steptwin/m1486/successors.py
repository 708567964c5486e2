"""The control flow of what one chip receives: the ways out of I, of E, and of jumps whose label is computed."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from typing import NamedTuple

from steptwin.controlflow import ControlFlow
from steptwin.m1486.commanduse import Control
from steptwin.m1486.flow import continues_after_wrong_data, follow, loop_starts
from steptwin.m1486.lines import Interface
from steptwin.m1486.structure import CommandStream, is_computed, written_label
from steptwin.m1486.variants import Variant
from steptwin.tables import complete


def flow_of(stream: CommandStream, variant: Variant, interface: Interface) -> ControlFlow:
    """Statements are the commands of the stream. A jump to a label that is not there leads nowhere."""
    targets = follow(stream, variant, interface).targets if any(map(is_computed, stream.commands)) else {}
    goes_on = continues_after_wrong_data(stream)
    ways = [_Ways(stream, index, targets.get(index, ()), goes_on) for index in range(len(stream.commands))]
    return ControlFlow(
        [tuple(dict.fromkeys(_AFTER[way.control](way))) for way in ways],
        {way.index: (*way.labelled(), *way.dropped()) for way in ways if way.control is Control.CALL},
        frozenset(way.index for way in ways if way.control is Control.RETURN),
    )


class _Ways(NamedTuple):
    """The ways out of a command. ``computed``: where its label leads if that is the internal variable; ``goes_on``: whether the
    next one is executed if this is wrong."""

    stream: CommandStream
    index: int
    computed: Collection[int]
    goes_on: bool

    @property
    def control(self) -> Control:
        return self.stream.commands[self.index].use.control

    def following(self) -> tuple[int, ...]:
        return (self.index + 1,)

    def dropped(self) -> tuple[int, ...]:
        return self.following() if self.goes_on else ()

    def labelled(self) -> tuple[int, ...]:
        label = written_label(self.stream.commands[self.index])
        if label is None:
            return tuple(sorted(self.computed))
        target = self.stream.resolve(self.index, label)
        return () if target is None else (target,)

    def jump(self) -> tuple[int, ...]:
        return (*self.labelled(), *(self.dropped() if is_computed(self.stream.commands[self.index]) else ()))

    def repeat(self) -> tuple[int, ...]:
        """The E of L1 cannot go back."""
        starts = loop_starts(self.stream, self.index)
        can = any(self.stream.commands[start - 1].number != 1 for start in starts)
        return (*starts, *self.following()) if can else self.following()


_AFTER: Mapping[Control, Callable[[_Ways], tuple[int, ...]]] = complete(
    "control",
    Control,
    "successors",
    {
        **dict.fromkeys((Control.NEXT, Control.CALL, Control.RESTART), _Ways.following),
        Control.JUMP: _Ways.jump,
        Control.BRANCH: lambda way: (*way.labelled(), *way.following()),
        Control.RETURN: _Ways.dropped,
        Control.REPEAT: _Ways.repeat,
    },
)
"""Where a command goes on within its level."""
