"""Commands that were downloaded into the command memory of a chip, and how much of it is still there.

The command memory is a ring (M-12): each command that is sent, also a question, overwrites the oldest one. Behind the last
command of a program lies everything that was sent since, in the end the J that starts it.
"""

from __future__ import annotations

from typing import NamedTuple

from steptwin.m1486.commanduse import TO_LABEL
from steptwin.m1486.flow import may_turn_on
from steptwin.m1486.lines import STEP_DIRECTION, Interface
from steptwin.m1486.structure import stream_of, written_label
from steptwin.m1486.successors import flow_of
from steptwin.m1486.syntax import ChipCommand, parse_line
from steptwin.m1486.variants import Variant


class LabelledCommands(NamedTuple):
    """Commands that can be executed from a label on. ``begins_at``: the bits that had been sent before its first command."""

    begins_at: int
    has_end: bool
    """Whether the last command can be reached, and with it what was sent since."""


class SentCommands:
    """The commands that were downloaded since the last reset, with the number of bits that had been sent before each."""

    def __init__(self) -> None:
        self._commands: list[ChipCommand] = []
        self._before: list[int] = []

    def note(self, text: str, stored_bits: int) -> ChipCommand | None:
        """Note a command that is about to be sent, and return it. ``stored_bits``: all that have been sent before it."""
        command = parse_line(text)[0].command
        if command is not None:
            self._commands.append(command)
            self._before.append(stored_bits)
        return command

    def may_turn_on(self, function: int, label: int | None = None) -> bool:
        """Whether what was downloaded may turn a function on when it is executed, at ``label`` if given: also by a jump to
        commands that were not downloaded here."""
        if any(may_turn_on(function, command) for command in self._commands):
            return True
        jumps = [written_label(command) for command in self._commands if command.use.control in TO_LABEL]
        here = {command.number for command in self._commands if command.key == "@"}
        return not here.issuperset(jumps) or (label is not None and label not in here)

    def part(self, label: int, variant: Variant, interface: Interface | None) -> LabelledCommands | None:
        """Commands that can be executed from a label on; None for a label that was not downloaded."""
        stream = stream_of(None, self._commands)
        places = stream.labels.get(label)
        if places is None:
            return None
        reached = flow_of(stream, variant, interface or STEP_DIRECTION).reached((places[-1],))
        end = len(self._commands)
        return LabelledCommands(min(self._before[place] for place in reached - {end}), end in reached)

    def begins_at(self, lost_before: int) -> int | None:
        """The bits that had been sent before the oldest command that can be started again and was sent after ``lost_before``
        bits; None if there is none: one behind a label, or of a file, which a pulse at RST starts (M-23)."""
        return next(
            (
                before
                for command, before in zip(self._commands, self._before, strict=True)
                if command.key in ("@", "[") and before >= lost_before
            ),
            None,
        )
