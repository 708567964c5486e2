"""The M1486 command table: one row per command of the manual. Parser, checker, memory accounting, help and reference pages
are projections of it.

A row is found by its ``key`` (the letter, or ``G+``, ``G-``, ``XG`` where a sign or letter follows) and the number that
follows; several rows may share a key when their numbers differ (``C7`` clears a line, ``C43`` a function).
Distances are minimum microsteps (full step / 64), speeds full steps/s, times milliseconds.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass, replace
from functools import lru_cache, reduce

from steptwin.m1486.commanduse import EVERYTHING, NOTHING, ChipState, CommandUse, Control, Motion, NextMove, Setting, Wait
from steptwin.m1486.functions import CARRY, FUNCTIONS, USER_FLAGS, function
from steptwin.m1486.lines import LINES, line_group
from steptwin.m1486.microsteps import MICROSTEPS, QUALIFICATIONS, UNIT
from steptwin.m1486.registers import REGISTERS, UPLOAD_RANGE, register
from steptwin.m1486.variants import Variant
from steptwin.messages import Message, MessageText

LINE_GROUPS = Message(
    "m1486.line-groups", "first line 1 to 21 and count 1 to 9 as one number, such as 14 for lines 1 to 4, up to line 21"
)
CONDITIONS_TEXT = Message("m1486.conditions-text", "line {first} to {last} or flag {flag} to {carry}, then H or L and a label")
PROFILES_TEXT = Message("m1486.profiles-text", "{low} to {high} step/s, or a larger number above V for no parabolic part")

NO_NUMBER = Message("m1486.nothing", "nothing")
RANGES = Message("m1486.ranges", "{ranges}")
TO = Message("m1486.to", "{low} to {high}")
WITH_UNIT = Message("m1486.with-unit", "{range} {unit}")
NAMED = Message("m1486.named", "{range} ({name})")


class ArgType(enum.Enum):
    """The kind of the argument of a command."""

    NONE = "none"
    NUMBER = "number"
    LABEL = "label"
    ADDRESS = "address, hexadecimal"
    CONDITION = "line or flag, H or L, label"
    LINE = "line"
    LINES = "first line and count"
    FUNCTION = "function"
    FLAG = "flag"
    REGISTER = "register"
    UPLOAD = "byte"


class When(enum.Enum):
    """The time at which a command acts."""

    RECEIVED = "when received"
    """As soon as it has been received, ahead of everything that waits (M-27)."""
    COMPRESSED = "when compressed"
    """When it leaves the input buffer; it is not stored."""
    QUEUED = "in program order"
    """In program order, from the command memory."""


@dataclass(frozen=True, slots=True)
class CommandSpec:
    """One command. ``values``, in rising order, are the permitted numbers on every variant; None if they depend on the variant
    or there is no number."""

    key: str
    name: str
    kind: ArgType
    values: range | tuple[int, ...] | None
    effect: str
    section: str
    use: CommandUse
    unit: str = ""
    when: When = When.QUEUED

    @property
    def letter(self) -> str:
        return self.key[0]

    def permitted(self, variant: Variant) -> range | tuple[int, ...]:
        """The numbers this command takes on ``variant``; empty for a command without a number."""
        if self.kind is ArgType.LABEL:
            return range(1, variant.labels + 1)
        if self.kind is ArgType.ADDRESS:
            return variant.addresses
        return () if self.values is None else self.values

    def lines(self, number: int) -> range:
        """The I/O lines that the number names."""
        if self.kind in (ArgType.LINE, ArgType.CONDITION) and number in LINES:
            return range(number, number + 1)
        group = line_group(number) if self.kind is ArgType.LINES else None
        return group or range(0)

    def use_with(self, number: int | None) -> CommandUse:
        """Its use with this number; None: with the internal variable, or without number."""
        named = self._named(number)
        return replace(self.use, reads=self.use.reads & named, writes=self.use.writes & named)

    def _named(self, number: int | None) -> ChipState:
        """State that a command can read and change whose number names one of several things."""
        if number is None:
            return EVERYTHING
        if self.kind is ArgType.REGISTER:
            return ~_ANY_REGISTER | register(number).state
        if self.kind is ArgType.FUNCTION:
            return _S.FUNCTIONS | function(number).acts_on
        if self.kind is ArgType.CONDITION:
            return _S.LINES if number in LINES else _S.CARRY if number == CARRY else _S.FLAGS
        return EVERYTHING


_S = ChipState
_ANY_REGISTER = _S.REGISTERS | _S.POSITION | _S.REMAINDER
_FUNCTION_STATE = _S.FUNCTIONS | _S.SIGNALS | _S.HELD
_24_BIT = range(2**24)
_DISTANCE = range(1, 16_000_001)
_BYTE = range(1, 256)
PROFILE_RANGE = range(20, 7_001)
"""Larger values of P than the range of parabolic acceleration switch it off; two bytes hold no more."""
_PROFILE = range(PROFILE_RANGE.start, 2**16)
_LINE_GROUPS = tuple(n for n in _BYTE if line_group(n) is not None)
CONDITIONS = (*LINES, *USER_FLAGS, CARRY)
"""Arguments of ``I``: a line or a flag."""
CLEAR_KILL = 75
CLEAR_POSITION = 100
DIVIDEND_LIMIT = 65_000
"""Largest internal variable that may be divided, except by these numbers (chapter VII.7, Divide)."""
FREE_DIVISORS = frozenset((2, 4, 8, 16, 32, 64))

_PROGRAM, _MOTION, _IO, _SEQUENCER = "VII.1", "VII.2", "VII.3", "VII.4"
_CONFIGURATION, _AUXILIARY, _NUMERIC = "VII.5", "VII.6", "VII.7"
_C, _U = CommandSpec, CommandUse
_MOVES = _S.MOTION | _S.POSITION | _S.SIGNALS | _S.HELD
"""LIMIT that is low holds the program as soon as a motion begins."""
_STARTS = _S.MOTION | _S.POSITION | _S.SETTINGS | _S.FUNCTIONS
_SEEK = _U(_STARTS | _S.LINES, _MOVES, waits=Wait.SEEK, motion=Motion.SEEK)
_OPERANDS = _S.VARIABLE | _S.FUNCTIONS | _S.LINES | _S.REGISTERS
"""Functions 46 and 58 make lines or a register of the number."""

UNITS = {
    unit: Message(f"m1486.unit.{id_}", unit)()
    for id_, unit in (("ms", "ms"), ("times", "times"), ("speed", "step/s"), ("acceleration", "step/s²"), ("distance", UNIT))
}
_KINDS = {
    kind: Message(f"m1486.kind.{kind.name.lower()}", kind.value)()
    for kind in ArgType
    if kind not in (ArgType.NONE, ArgType.NUMBER, ArgType.ADDRESS, ArgType.LINES, ArgType.CONDITION)
}

_ROWS: tuple[CommandSpec, ...] = (
    # Program control
    _C("@", "Address", ArgType.LABEL, None, "Gives the next command a label.", _PROGRAM,
       _U(NOTHING, _S.MEMORY), when=When.COMPRESSED),
    _C("L", "Loop", ArgType.NUMBER, _BYTE, "Runs the commands up to the matching E this many times.", _PROGRAM,
       _U(_S.LOOPS, _S.LOOPS), "times"),
    _C("E", "End of loop", ArgType.NONE, None, "Goes back to the matching L until its count is done.", _PROGRAM,
       _U(_S.LOOPS, _S.LOOPS, Control.REPEAT)),
    _C("I", "If", ArgType.CONDITION, CONDITIONS, "Jumps to the label when the line or flag has the level named.", _PROGRAM,
       _U(_S.LINES | _S.FLAGS | _S.CARRY, NOTHING, Control.BRANCH)),
    _C("J", "Jump", ArgType.LABEL, None, "Goes on at the label.", _PROGRAM, _U(NOTHING, NOTHING, Control.JUMP)),
    _C("K", "Kill", ArgType.NONE, None, "Stops the motion with its ramp, and the program too while function 51 is OFF.",
       _PROGRAM, _U(_S.MOTION | _S.FUNCTIONS, _S.MOTION | _S.POSITION | _S.HELD), when=When.RECEIVED),
    _C("C", "Clear kill", ArgType.NUMBER, (CLEAR_KILL,), "Lets a program go on that Kill has stopped.",
       _PROGRAM, _U(NOTHING, _S.HELD), when=When.RECEIVED),
    _C("U", "Upload", ArgType.UPLOAD, UPLOAD_RANGE, "Sends one byte to the host.", _PROGRAM,
       _U(_S.POSITION | _S.VARIABLE | _S.FLAGS | _S.CARRY | _S.FUNCTIONS | _S.SENDING, _S.SENDING, waits=Wait.SENDING)),
    _C("W", "Wait", ArgType.NUMBER, _DISTANCE, "Waits.", _PROGRAM, _U(NOTHING, NOTHING, waits=Wait.TIME), "ms"),
    _C("[", "Disable", ArgType.NONE, None, "From here on commands are stored, not run.", _PROGRAM,
       _U(_S.MEMORY, _S.MEMORY), when=When.COMPRESSED),
    _C("]", "Enable", ArgType.NONE, None, "Runs the commands stored since [.", _PROGRAM,
       _U(_S.MEMORY, _S.MEMORY, motion=Motion.STORED), when=When.COMPRESSED),
    _C("'", "Subroutine", ArgType.LABEL, None, "Goes on at the label and comes back at the next dot.", _PROGRAM,
       _U(_S.CALL, _S.CALL, Control.CALL)),
    _C(".", "End of subroutine", ArgType.NONE, None, "Goes back to the command after the call.", _PROGRAM,
       _U(_S.CALL, _S.CALL, Control.RETURN)),
    # Motion control
    _C("B", "Backward", ArgType.NUMBER, _DISTANCE, "Sets distance and negative direction of the next move.",
       _MOTION, _U(_S.SETTINGS, _S.DISTANCE, next_move=NextMove.BACKWARD), UNIT),
    _C("D", "Direction", ArgType.NONE, None, "Reverses the direction of the next move.", _MOTION,
       _U(_S.DISTANCE, _S.DISTANCE, next_move=NextMove.REVERSED)),
    _C("F", "Forward", ArgType.NUMBER, _DISTANCE, "Sets distance and positive direction of the next move.",
       _MOTION, _U(_S.SETTINGS, _S.DISTANCE, next_move=NextMove.FORWARD), UNIT),
    _C("G", "Go absolute", ArgType.NUMBER, _DISTANCE, "Sets distance and direction from the present position to this one.",
       _MOTION, _U(_S.SETTINGS | _S.POSITION, _S.DISTANCE, next_move=NextMove.TO_POSITION), UNIT),
    _C("G+", "Go positive", ArgType.NONE, None, "The next move runs in positive direction until Kill or LIMIT.", _MOTION,
       _U(NOTHING, _S.DISTANCE, next_move=NextMove.ENDLESS)),
    _C("G-", "Go negative", ArgType.NONE, None, "The next move runs in negative direction until Kill or LIMIT.", _MOTION,
       _U(NOTHING, _S.DISTANCE, next_move=NextMove.ENDLESS)),
    _C("H", "Home", ArgType.NONE, None, "Sets distance and direction from the present position to 0.", _MOTION,
       _U(_S.POSITION, _S.DISTANCE, next_move=NextMove.TO_ZERO)),
    _C("=", "Equal", ArgType.NUMBER, _DISTANCE, "Gives the position counter a value.", _MOTION,
       _U(_S.SETTINGS, _S.POSITION), UNIT),
    _C("C", "Clear position counter", ArgType.NUMBER, (CLEAR_POSITION,), "Sets the position counter to 0.", _MOTION,
       _U(NOTHING, _S.POSITION)),
    _C("A", "Acceleration", ArgType.NUMBER, range(1, 65_001), "Sets acceleration and deceleration.", _MOTION,
       _U(NOTHING, _S.SETTINGS, sets=Setting.ACCELERATION), "step/s²"),
    _C("S", "Start/stop", ArgType.NUMBER, range(16, 1_951), "Sets the speed at which a move starts and ends.",
       _MOTION, _U(NOTHING, _S.SETTINGS, sets=Setting.START_STOP), "step/s"),
    _C("P", "Profile", ArgType.NUMBER, _PROFILE,
       "Sets the speed from which the acceleration is parabolic; above 7000 and V there is no such part.",
       _MOTION, _U(NOTHING, _S.SETTINGS, sets=Setting.PROFILE), "step/s"),
    _C("V", "Velocity", ArgType.NUMBER, range(16, 20_001), "Sets the highest speed of a move.", _MOTION,
       _U(NOTHING, _S.SETTINGS, sets=Setting.VELOCITY), "step/s"),
    _C("R", "Run", ArgType.NONE, None, "Makes the move specified last.", _MOTION,
       _U(_STARTS | _S.DISTANCE, _MOVES, waits=Wait.MOTION, motion=Motion.MOVE)),
    _C(")", "Seek positive", ArgType.LINE, LINES,
       "Moves at start/stop speed in positive direction until the line has its end level.", _MOTION, _SEEK),
    _C("(", "Seek negative", ArgType.LINE, LINES,
       "Moves at start/stop speed in negative direction until the line has its end level.", _MOTION, _SEEK),
    # User I/O
    _C("C", "Clear", ArgType.LINE, LINES, "Sets an output low.", _IO, _U(NOTHING, _S.LINES, level=0)),
    _C("O", "One", ArgType.LINE, LINES, "Waits until the line is high.", _IO, _U(_S.LINES, NOTHING, waits=Wait.LINE, level=1)),
    _C("T", "Turn on", ArgType.LINE, LINES, "Sets an output high.", _IO, _U(NOTHING, _S.LINES, level=1)),
    _C("Z", "Zero", ArgType.LINE, LINES, "Waits until the line is low.", _IO, _U(_S.LINES, NOTHING, waits=Wait.LINE, level=0)),
    # Sequencer
    _C("M", "Microstep", ArgType.NUMBER, MICROSTEPS, "Sets the microsteps per full step at low speed.", _SEQUENCER,
       _U(NOTHING, _S.SETTINGS, sets=Setting.MICROSTEP)),
    _C("Q", "Qualification", ArgType.NUMBER, QUALIFICATIONS, "Sets the microsteps per full step at high speed.", _SEQUENCER,
       _U(NOTHING, _S.SETTINGS, sets=Setting.QUALIFICATION)),
    _C("N", "Number of characteristic", ArgType.NUMBER, range(1, 8), "Chooses the waveform of the phase currents.", _SEQUENCER,
       _U(NOTHING, _S.WAVEFORM, sets=Setting.WAVEFORM)),
    # Configuration
    _C("\\", "Reset", ArgType.NONE, None, "Sets everything to its defaults; E types erase the EEPROM too.",
       _CONFIGURATION, _U(NOTHING, ~(_S.LISTENING | _S.SENDING), Control.RESTART), when=When.COMPRESSED),
    _C("X", "indeX", ArgType.ADDRESS, None, "Lets only the chip with this address listen.", _CONFIGURATION,
       _U(NOTHING, _S.LISTENING), when=When.RECEIVED),
    _C("XG", "indeX all", ArgType.NONE, None, "Lets all chips listen.", _CONFIGURATION,
       _U(NOTHING, _S.LISTENING), when=When.RECEIVED),
    # Auxiliary functions and flags
    _C("T", "Function on", ArgType.FUNCTION, FUNCTIONS, "Switches a function on.", _AUXILIARY,
       _U(NOTHING, _S.FUNCTIONS | _S.SIGNALS, level=1)),
    _C("C", "Function off", ArgType.FUNCTION, FUNCTIONS, "Switches a function off.", _AUXILIARY,
       _U(_S.FUNCTIONS, _FUNCTION_STATE, level=0)),
    _C("T", "Flag on", ArgType.FLAG, USER_FLAGS, "Sets a user flag.", _AUXILIARY, _U(NOTHING, _S.FLAGS, level=1)),
    _C("C", "Flag off", ArgType.FLAG, USER_FLAGS, "Clears a user flag.", _AUXILIARY, _U(NOTHING, _S.FLAGS, level=0)),
    # Numeric unit
    _C(":", "Load", ArgType.NUMBER, _24_BIT, "Gives the internal variable a value.", _NUMERIC,
       _U(NOTHING, _S.VARIABLE, sets=Setting.VARIABLE)),
    _C("?", "Query", ArgType.LINES, _LINE_GROUPS, "Reads lines into the internal variable, lowest line = lowest bit.", _NUMERIC,
       _U(_S.LINES | _S.FUNCTIONS, _S.VARIABLE)),
    _C("!", "Order", ArgType.LINES, _LINE_GROUPS, "Puts the internal variable out on lines, lowest line = lowest bit.", _NUMERIC,
       _U(_S.VARIABLE | _S.REMAINDER | _S.FUNCTIONS, _S.LINES)),
    _C(">", "Move to register", ArgType.REGISTER, range(1, len(REGISTERS) + 1),
       "Copies the internal variable to a register.", _NUMERIC, _U(_S.VARIABLE, _ANY_REGISTER)),
    _C("<", "Move from register", ArgType.REGISTER, range(1, len(REGISTERS) + 1),
       "Copies a register to the internal variable.", _NUMERIC, _U(_ANY_REGISTER, _S.VARIABLE)),
    _C("+", "Add", ArgType.NUMBER, _BYTE, "Adds to the internal variable; sets flag 87 on overflow.", _NUMERIC,
       _U(_OPERANDS, _S.VARIABLE | _S.CARRY)),
    _C("-", "Subtract", ArgType.NUMBER, _BYTE, "Subtracts from the internal variable; sets flag 87 when that is too small.",
       _NUMERIC, _U(_OPERANDS, _S.VARIABLE | _S.CARRY)),
    _C("*", "Multiply", ArgType.NUMBER, _BYTE, "Multiplies the internal variable.", _NUMERIC, _U(_OPERANDS, _S.VARIABLE)),
    _C("/", "Divide", ArgType.NUMBER, _BYTE, "Divides the internal variable; the remainder goes to register 10.", _NUMERIC,
       _U(_OPERANDS, _S.VARIABLE | _S.REMAINDER)),
)  # fmt: skip

_STATED_BITS = {"@": 0, "[": 0, "]": 0, "\\": 0, "I": 32}
"""Sizes the manual states by themselves (chapter II, Memory): four commands take no memory; ``I`` holds line, level and label."""
_NEEDS_ARGUMENT = frozenset("@IX")
"""Keys whose number may not be left out: it is not numeric, or the command has no meaning without it."""

LARGEST_LABEL = 80
"""Largest label of all variants; it decides the size of a label in the memory of each."""
_LARGEST_ADDRESS = 15


def argument_bits(largest: int) -> int:
    """The least multiple of 8 bits that holds ``largest``: the chip's rule for the size of an argument."""
    return -(-largest.bit_length() // 8) * 8


def _largest(spec: CommandSpec) -> int:
    if spec.kind is ArgType.LABEL:
        return LARGEST_LABEL
    if spec.kind is ArgType.ADDRESS:
        return _LARGEST_ADDRESS
    return spec.values[-1] if spec.values else 0


def _letter_bits(letter: str) -> int:
    if letter in _STATED_BITS:
        return _STATED_BITS[letter]
    # M-24: the letter decides, so G+ and G- take as much memory as G.
    return 8 + max(argument_bits(_largest(s)) for s in _ROWS if s.letter == letter)


def _index() -> dict[str, tuple[CommandSpec, ...]]:
    index: dict[str, tuple[CommandSpec, ...]] = {}
    for spec in _ROWS:
        index[spec.key] = (*index.get(spec.key, ()), spec)
    return index


TABLE: tuple[CommandSpec, ...] = _ROWS
_BY_KEY = _index()
_BITS = {letter: _letter_bits(letter) for letter in dict.fromkeys(s.letter for s in _ROWS)}

_REFUSED = CommandUse(NOTHING, NOTHING)
_USES_KEPT = 4096

CALCULATING: tuple[str, ...] = tuple(s.name for s in _ROWS if ChipState.VARIABLE in s.use.reads & s.use.writes)
"""Names of the commands that make a new value of the internal variable from the one before."""
LETTERS: frozenset[str] = frozenset(_BITS)
"""Every character that can begin a command; letters stand here as capitals."""


def rows(key: str) -> tuple[CommandSpec, ...]:
    """The rows with this key, none if there is no such command."""
    return _BY_KEY.get(key, ())


def find(key: str, argument: int | None, variant: Variant) -> CommandSpec | None:
    """The row that ``key`` and a number mean on ``variant``, or None where the number is not permitted.

    For a command without a number, and for ``I`` with the line or flag it asks, the same.
    """
    for spec in rows(key):
        if spec.kind is ArgType.NONE:
            return spec if argument is None else None
        if argument is not None and argument in spec.permitted(variant):
            return spec
    return None


def takes_number(key: str) -> bool:
    return any(spec.kind is not ArgType.NONE for spec in rows(key))


def takes_variable(key: str) -> bool:
    """Whether the number may be left out, so that the internal variable is used."""
    return takes_number(key) and key not in _NEEDS_ARGUMENT


def memory_bits(key: str) -> int:
    """Command memory one command takes, in bits: 8 for the letter and the size of the largest argument it may have."""
    return _BITS[key[0]]


def meant(key: str, number: int | None) -> tuple[CommandSpec, ...]:
    """The rows that a command can mean on some variant: all of its key where the internal variable is the number."""
    found = rows(key)
    return found if number is None else tuple(spec for spec in found if spec.values is None or number in spec.values)


def when(key: str, argument: int | None) -> When:
    """When the command acts; one of the commands with the letter C acts at once."""
    found = meant(key, argument)
    return found[0].when if len(found) == 1 else When.QUEUED


@lru_cache(_USES_KEPT)
def use_of(key: str, number: int | None) -> CommandUse:
    """Use of a command with a number; with the internal variable, for which None stands, what any number can make of it."""
    uses = [spec.use_with(number) for spec in meant(key, number)]
    if not uses:
        return _REFUSED
    use = reduce(_either, uses)
    return replace(use, reads=use.reads | ChipState.VARIABLE) if number is None and takes_variable(key) else use


def _either(one: CommandUse, other: CommandUse) -> CommandUse:
    """One of two commands of a letter, which differ in what they name."""
    return CommandUse(one.reads | other.reads, one.writes | other.writes, level=one.level if one.level == other.level else None)


def grouped(number: int) -> str:
    """A number with groups of digits: ``16 000 000``."""
    return f"{number:,}".replace(",", " ") if number >= 10_000 else str(number)


def permitted_text(key: str, variant: Variant) -> MessageText:
    """The numbers that may follow ``key``, as text: ``1 to 21 (line), 40 to 63 (function), 75 (Clear kill)``."""
    specs = [s for s in rows(key) if s.kind is not ArgType.NONE]
    if not specs:
        return NO_NUMBER()
    several = len(specs) > 1
    texts = sorted((s.permitted(variant)[0], range_text(s, variant, named=several)) for s in specs)
    return texts[0][1] if len(texts) == 1 else RANGES(ranges=[text for _, text in texts])


def range_text(spec: CommandSpec, variant: Variant, *, named: bool = False) -> MessageText:
    """The permitted numbers of one row with their unit, followed by what they stand for if ``named``."""
    values = spec.permitted(variant)
    if spec.kind is ArgType.NONE:
        return NO_NUMBER()
    if spec.kind is ArgType.ADDRESS:
        return TO(low=f"{values[0]:X}", high=f"{values[-1]:X}")
    if spec.kind is ArgType.LINES:
        return LINE_GROUPS()
    if spec.kind is ArgType.CONDITION:
        return CONDITIONS_TEXT(first=LINES[0], last=LINES[-1], flag=USER_FLAGS[0], carry=CARRY)
    if values == _PROFILE:
        return PROFILES_TEXT(low=PROFILE_RANGE[0], high=PROFILE_RANGE[-1])
    text = TO(low=grouped(values[0]), high=grouped(values[-1])) if isinstance(values, range) else RANGES(ranges=list(values))
    if spec.unit:
        text = WITH_UNIT(range=text, unit=UNITS[spec.unit])
    return NAMED(range=text, name=spec.name if spec.kind is ArgType.NUMBER else _KINDS[spec.kind]) if named else text
