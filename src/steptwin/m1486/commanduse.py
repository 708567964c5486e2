"""Uses of the commands of the M1486: what they read, change, wait for, and do to the course of the program.

Checkers, explanations, the debugger and ``why`` read these facts. Where they have a rule for each member of an enumeration here,
its table is complete: a new member is refused at import until each has one.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass


class ChipState(enum.Flag):
    """The state of a chip, in pieces that commands read or change."""

    LINES = enum.auto()
    """Levels of the user lines that the number names."""
    VARIABLE = enum.auto()
    CARRY = enum.auto()
    """Flag 87."""
    REMAINDER = enum.auto()
    """Register 10."""
    FLAGS = enum.auto()
    """Flags 80 to 86."""
    FUNCTIONS = enum.auto()
    REGISTERS = enum.auto()
    """Registers 1 to 8."""
    POSITION = enum.auto()
    """The position counter, which is register 9."""
    DISTANCE = enum.auto()
    """Distance and direction of the next move."""
    SETTINGS = enum.auto()
    """Speeds, acceleration and microsteps of the next move."""
    WAVEFORM = enum.auto()
    MOTION = enum.auto()
    SIGNALS = enum.auto()
    """The outputs BOOST and DIRECTION, and line B1 while function 40 is ON."""
    HELD = enum.auto()
    """Whether K or LIMIT holds the program."""
    LOOPS = enum.auto()
    CALL = enum.auto()
    SENDING = enum.auto()
    """The bytes on their way to the host."""
    LISTENING = enum.auto()
    MEMORY = enum.auto()
    """Stored commands and labels."""


NOTHING = ChipState(0)
EVERYTHING = ~NOTHING


class Control(enum.Enum):
    """Where a program goes on after a command."""

    NEXT = "at the next command"
    JUMP = "at a label"
    BRANCH = "at a label or at the next command"
    CALL = "at a label, and later at the next command"
    RETURN = "after the last call"
    REPEAT = "after the beginning of the loop or at the next command"
    RESTART = "nowhere; what follows begins with the defaults"


TO_LABEL = frozenset({Control.JUMP, Control.BRANCH, Control.CALL})


class Wait(enum.Enum):
    """Wait of a command besides its own duration. A motion in progress holds what would begin one."""

    NOTHING = "nothing"
    TIME = "a time"
    LINE = "the level of a line"
    MOTION = "the end of the move"
    SEEK = "the end of the seek"
    SENDING = "the serial line, if it is not free"


class Motion(enum.Enum):
    """The motion that a command begins."""

    NONE = "none"
    MOVE = "the next move"
    SEEK = "a seek"
    STORED = "those of the file that it releases"


class NextMove(enum.Enum):
    """Effect of a command on the next move."""

    UNCHANGED = "unchanged"
    FORWARD = "the number in positive direction"
    BACKWARD = "the number in negative direction"
    REVERSED = "the same in the other direction"
    TO_POSITION = "to the position of the number"
    TO_ZERO = "to position 0"
    ENDLESS = "without end"


class Setting(enum.Enum):
    """Setting that a command's number becomes; the values are names of `steptwin.m1486.flow.Settings`, but for the waveform."""

    START_STOP = "start_stop"
    ACCELERATION = "acceleration"
    VELOCITY = "velocity"
    PROFILE = "profile"
    MICROSTEP = "microstep"
    QUALIFICATION = "qualification"
    WAVEFORM = "waveform"
    VARIABLE = "variable"


@dataclass(frozen=True, slots=True)
class CommandUse:
    """Reads and possible changes of a command, for any number, besides the place of the program and its time."""

    reads: ChipState
    writes: ChipState
    control: Control = Control.NEXT
    waits: Wait = Wait.NOTHING
    motion: Motion = Motion.NONE
    next_move: NextMove = NextMove.UNCHANGED
    sets: Setting | None = None
    level: int | None = None
    """The level that it gives to what its number names, or waits for."""
