"""M1486 programs as text: commands with their places, and back to text.

A line holds one command, blanks mean nothing (M-2), a semicolon begins a comment (M-1), letters are equal in either case.
In files CR, LF and CR LF all end a line; the chip itself knows CR only. Nothing here depends on the variant: whether a number
is permitted is for `steptwin.m1486.commands.find`.
"""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass, field
from typing import NamedTuple, NoReturn

from steptwin.diagnostics import Diagnostic, Fix, Span
from steptwin.m1486 import findings
from steptwin.m1486.commands import CONDITIONS, LARGEST_LABEL, LETTERS, meant, rows, takes_number, takes_variable, use_of
from steptwin.m1486.commanduse import CommandUse
from steptwin.m1486.findings import ChipFinding
from steptwin.messages import Message, MessageText

SUCH_AS_I2H5 = Message("m1486.such-as-i2h5", "such as I2H5: if line 2 is high, go to label 5")
NO_COMMAND_BEGINS_WITH = Message("m1486.no-command-begins-with", "no command begins with {char!r}")
FOUND = Message("m1486.found", "found {char!r}")
BLANK_INSIDE_A_NUMBER = Message("m1486.blank-inside-a-number", "blank inside a number, read as {digits}")
EXPECTED = Message("m1486.expected", "{expected} expected, {found}")
NO_COMMAND_BEGINS_WITH_NUL = Message(
    "m1486.no-command-begins-with-nul", "no command begins with NUL; the sender ends lines with CR NUL"
)
SECOND_COMMAND = Message("m1486.second-command", "{char!r} begins a second command ({name}) on this line")
FOUND_THE_END_OF_THE_LINE = Message("m1486.found-the-end-of-the-line", "found the end of the line")
NO_BLANK_TO_THE_CHIP = Message("m1486.no-blank-to-the-chip", "{name} (U+{code:04X}), which is not a blank to the chip")
TOO_MANY_DIGITS = Message("m1486.too-many-digits", "a number of {count} digits")
MOST_DIGITS = Message("m1486.most-digits", "no number has more than 8")
A_NUMBER_OR_THE_VARIABLE = Message("m1486.a-number-or-the-variable", "a number, or the end of the line for the internal variable")
A_NUMBER = Message("m1486.a-number", "a number")
IS_NOT_A_NUMBER = Message("m1486.is-not-a-number", "{left} is not a number")
IS_A_LETTER_NOT_A_DIGIT = Message("m1486.is-a-letter-not-a-digit", "{letter!r} is a letter, not a digit")
DIRECTIONS = Message("m1486.directions", "F moves in positive, B in negative direction")
NO_SIGN = Message("m1486.no-sign", "numbers have no sign")
HAS_A_SIGN = Message("m1486.has-a-sign", "{rest} has a sign")
IS_NOT_A_WHOLE_NUMBER = Message("m1486.is-not-a-whole-number", "{number} is not a whole number")
ONE_COMMAND_A_LINE = Message("m1486.one-command-a-line", "one command a line")
ADDRESSES = Message("m1486.addresses", "0 to 9, A to F, or G for all chips")
TAKES_NO_NUMBER = Message("m1486.takes-no-number", "{keyword} takes no number")
EXPECTED_AFTER = Message("m1486.expected-after", "{expected} expected after {command}, {found}")
VARIABLE_CANNOT_REPLACE_IT = Message("m1486.variable-cannot-replace-it", "the internal variable cannot replace it")

_NOWHERE = Span(0, 0)
_LINE_END = re.compile(r"\r\n|\r|\n")
_DIGITS = frozenset("0123456789")
_HEX = frozenset("0123456789ABCDEF")
_WORD = re.compile(r"[A-Za-z]{2}")
_BLANKS = frozenset(" \t")
_LEVELS = frozenset("HL")
_MOST_DIGITS = 18
"""More digits than any number of the language has; longer ones are no numbers."""
_EXPECTED = {
    what: Message(f"m1486.expected.{what.lower().replace(' ', '-')}", what)()
    for what in ("address", "number", "label", "line or flag", "H or L", "end of the line")
}
_MEANT = {"’": "'", "‘": "'", "`": "'", "–": "-", "−": "-", "×": "*", "÷": "/", "1": "L", "|": "L", "0": "O"}
"""Characters that word processors, scanners and eyes put for others."""
_MEANT_DIGIT = {"l": "1", "I": "1", "|": "1", "O": "0", "o": "0"}


@dataclass(frozen=True, slots=True)
class JumpCondition:
    """The argument of ``I``: jump to ``label`` when line or flag ``line`` is ``high``."""

    line: int
    high: bool
    label: int
    label_span: Span = field(default=_NOWHERE, compare=False)


@dataclass(frozen=True, slots=True)
class ChipCommand:
    """One command. ``key`` leads to the command table; ``argument`` is None where no number stands.

    ``argument_span`` is the place of the number, in a condition of the line or flag. Two commands are equal if they say the
    same, wherever they stand.
    """

    key: str
    argument: int | JumpCondition | None = None
    span: Span = field(default=_NOWHERE, compare=False)
    argument_span: Span = field(default=_NOWHERE, compare=False)

    @property
    def number(self) -> int | None:
        """The number given: for ``I`` the line or flag, None where the internal variable stands for it or nothing is taken."""
        return self.argument.line if isinstance(self.argument, JumpCondition) else self.argument

    @property
    def from_variable(self) -> bool:
        """True if the internal variable is the argument."""
        return self.argument is None and takes_variable(self.key)

    @property
    def use(self) -> CommandUse:
        """Its reads, changes and waits."""
        return use_of(self.key, self.number)

    @property
    def lines(self) -> range:
        """The I/O lines that its number names; none for the internal variable."""
        found = () if self.number is None else meant(self.key, self.number)
        return found[0].lines(self.number or 0) if found else range(0)

    def __str__(self) -> str:
        if isinstance(self.argument, JumpCondition):
            return f"I{self.argument.line}{'H' if self.argument.high else 'L'}{self.argument.label}"
        if self.argument is None:
            return self.key
        return f"{self.key}{self.argument:X}" if self.key == "X" else f"{self.key}{self.argument}"


@dataclass(frozen=True, slots=True)
class ProgramLine:
    """One line: a command, a comment, both or nothing; or ``broken``, its whole text, where there is no sound command.

    ``salvaged`` holds what of a broken line could be understood, for checks that would otherwise miss a label or a bracket.
    """

    command: ChipCommand | None = None
    comment: str | None = None
    broken: str | None = None
    salvaged: tuple[ChipCommand, ...] = ()

    def __str__(self) -> str:
        if self.broken is not None:
            return self.broken
        comment = None if self.comment is None else f"; {self.comment}".rstrip()
        if self.command is None:
            return comment or ""
        return str(self.command) if comment is None else f"{self.command!s:<11} {comment}"


@dataclass(frozen=True, slots=True)
class ParsedProgram:
    lines: tuple[ProgramLine, ...]

    @property
    def commands(self) -> list[ChipCommand]:
        """The sound commands in order."""
        return [line.command for line in self.lines if line.command is not None]

    @property
    def all_commands(self) -> list[ChipCommand]:
        """The sound commands and those salvaged from broken lines, in order."""
        return [c for line in self.lines for c in (line.salvaged if line.command is None else (line.command,))]


class Parsed(NamedTuple):
    program: ParsedProgram
    diagnostics: list[Diagnostic]


class ParsedLine(NamedTuple):
    line: ProgramLine
    diagnostics: list[Diagnostic]


def parse(text: str) -> Parsed:
    """Read a whole program. Never raises: a broken line is reported, kept as it is, and does not hide the next one."""
    lines: list[ProgramLine] = []
    diagnostics: list[Diagnostic] = []
    start = 0
    for end in (*_LINE_END.finditer(text), None):
        stop = len(text) if end is None else end.start()
        if end is not None or stop > start:
            line, found = parse_line(text[start:stop], start)
            lines.append(line)
            diagnostics += found
        if end is not None:
            start = end.end()
    return Parsed(ParsedProgram(tuple(lines)), diagnostics)


def parse_line(text: str, offset: int = 0) -> ParsedLine:
    """Read one line without its end. ``offset`` is where it begins in the text that spans point into."""
    body, semicolon, rest = text.partition(";")
    reader = _LineReader(body, offset)
    commands: list[ChipCommand] = []
    try:
        if not body.isascii():
            _no_other_blank(reader)
        while reader.left:
            commands.append(_command(reader))
            _end_of_command(reader, commands[-1])
    except _BrokenLine:
        pass
    if reader.is_broken:
        return ParsedLine(ProgramLine(broken=text, salvaged=tuple(commands)), reader.diagnostics)
    return ParsedLine(ProgramLine(commands[0] if commands else None, rest.strip() if semicolon else None), reader.diagnostics)


def format_program(program: ParsedProgram, end: str = "\n") -> str:
    """The program as text in one form: capitals, no blanks, comments in a column, each line followed by ``end``."""
    return "".join(f"{line}{end}" for line in program.lines)


class _BrokenLine(Exception):
    """The rest of the line cannot be read; the error has been reported."""


class _LineReader:
    """The characters of a line that are no blanks, each with its place."""

    def __init__(self, body: str, offset: int) -> None:
        kept = [(place, char) for place, char in enumerate(body, offset) if char not in _BLANKS]
        self.chars = "".join(char for _, char in kept)
        # Only ASCII letters have two cases for the chip; "ı".upper() would be an I.
        self.capitals = "".join(char.upper() if char.isascii() else char for _, char in kept)
        self.places = [place for place, _ in kept]
        self.at = 0
        self.diagnostics: list[Diagnostic] = []
        self.is_broken = False

    @property
    def left(self) -> str:
        return self.chars[self.at :]

    @property
    def next(self) -> str:
        """The next character as a capital, empty at the end."""
        return self.capitals[self.at : self.at + 1]

    @property
    def found(self) -> MessageText:
        """The next character for messages."""
        return FOUND(char=self.chars[self.at]) if self.next else FOUND_THE_END_OF_THE_LINE()

    def take(self) -> str:
        char = self.next
        self.at += 1
        return char

    def span(self, start: int, end: int | None = None) -> Span:
        """From character ``start`` to before character ``end``, by default the one to be read next."""
        end = self.at if end is None else end
        if end > start:
            return Span(self.places[start], self.places[end - 1] + 1)
        place = self.places[start] if start < len(self.places) else self.places[-1] + 1
        return Span(place, place)

    def rest_span(self) -> Span:
        return self.span(self.at, len(self.chars))

    def error(
        self, finding: ChipFinding, span: Span, message: MessageText, hint: MessageText | None = None, fix: Fix | None = None
    ) -> None:
        self.diagnostics.append(finding(span, message, hint, fix))
        self.is_broken = True

    def give_up(
        self, finding: ChipFinding, span: Span, message: MessageText, hint: MessageText | None = None, fix: Fix | None = None
    ) -> NoReturn:
        self.error(finding, span, message, hint, fix)
        raise _BrokenLine


def _no_other_blank(reader: _LineReader) -> None:
    """Blanks of a text system, as a copy of the manual's own text has them, are characters like others to the chip."""
    found = [at for at, char in enumerate(reader.chars) if char.isspace() and char not in _BLANKS]
    if found:
        first = reader.chars[found[0]]
        name = unicodedata.name(first, "a control character").lower()
        span = reader.span(found[0], found[-1] + 1)
        fixed = "".join(" " if char.isspace() else char for char in reader.chars[found[0] : found[-1] + 1])
        reader.give_up(findings.UNKNOWN_COMMAND, span, NO_BLANK_TO_THE_CHIP(name=name, code=ord(first)), None, Fix(span, fixed))


def _command(reader: _LineReader) -> ChipCommand:
    start = reader.at
    if reader.next not in LETTERS:
        _unknown(reader)
    key = reader.take()
    if key + reader.next in ("G+", "G-", "XG"):
        key += reader.take()
    argument_start = reader.at
    argument: int | JumpCondition | None = None
    argument_end: int | None = None
    if key == "I":
        argument, argument_end = _condition(reader)
    elif key == "X":
        if reader.next not in _HEX:
            hint = ADDRESSES()
            reader.give_up(
                findings.ARGUMENT_MISSING,
                reader.span(reader.at),
                EXPECTED(expected=_EXPECTED["address"], found=reader.found),
                hint,
            )
        argument = int(reader.take(), 16)
    elif takes_number(key):
        argument = _number(reader)
        _no_word(reader, key, argument)
        _no_other_notation(reader, key, argument_start)
        if argument is None and not takes_variable(key):
            hint = VARIABLE_CANNOT_REPLACE_IT()
            reader.give_up(
                findings.ARGUMENT_MISSING,
                reader.span(reader.at),
                EXPECTED(expected=_EXPECTED["number"], found=reader.found),
                hint,
            )
    return ChipCommand(key, argument, reader.span(start), reader.span(argument_start, argument_end))


def _number(reader: _LineReader) -> int | None:
    """The digits that come next as a number, None if there are none."""
    start = reader.at
    while reader.next in _DIGITS:
        reader.at += 1
    digits = reader.chars[start : reader.at]
    if not digits:
        return None
    span = reader.span(start)
    if len(digits) > _MOST_DIGITS:
        reader.give_up(findings.BAD_ARGUMENT, span, TOO_MANY_DIGITS(count=len(digits)), MOST_DIGITS())
    if span.end - span.start > len(digits):
        message = BLANK_INSIDE_A_NUMBER(digits=digits)
        reader.diagnostics.append(findings.BLANK_IN_NUMBER(span, message, None, Fix(span, digits)))
    return int(digits)


def _no_word(reader: _LineReader, key: str, number: int | None) -> None:
    """Letters in the place of a number are no row of commands."""
    if number is None and _WORD.match(reader.chars, reader.at):
        hint = A_NUMBER_OR_THE_VARIABLE() if takes_variable(key) else A_NUMBER()
        reader.give_up(findings.BAD_ARGUMENT, reader.rest_span(), IS_NOT_A_NUMBER(left=reader.left), hint)


def _no_other_notation(reader: _LineReader, key: str, start: int) -> None:
    """After the digits of a number: refuse a letter meant as a digit, a sign and a fraction, each with what would be right."""
    rest, has_digits = reader.left, reader.at > start
    if not rest:
        return
    span = reader.rest_span()
    apart = reader.places[reader.at] > reader.places[reader.at - 1] + 1
    # Most commands end here after one character: a line of many commands is read in a time proportional to its length.
    all_meant = rest[0] in _MEANT_DIGIT and all(char in _DIGITS or char in _MEANT_DIGIT for char in rest)
    if all_meant and not apart and not _DIGITS.isdisjoint(reader.chars[start:]):
        digits = "".join(_MEANT_DIGIT.get(char, char) for char in rest)
        fix = Fix(Span(reader.places[start], span.end), reader.chars[start : reader.at] + digits)
        reader.give_up(findings.BAD_ARGUMENT, span, IS_A_LETTER_NOT_A_DIGIT(letter=rest[0]), None, fix)
    if rest[1:2] not in _DIGITS:
        return
    if not has_digits and rest[0] in "+-":
        hint = DIRECTIONS() if key in "FB" else NO_SIGN()
        reader.give_up(findings.BAD_ARGUMENT, span, HAS_A_SIGN(rest=rest), hint, _without_sign(reader, key, start))
    if has_digits and rest[0] in ".,":
        number = reader.chars[start:]
        reader.give_up(findings.BAD_ARGUMENT, reader.span(start, len(reader.chars)), IS_NOT_A_WHOLE_NUMBER(number=number))


def _without_sign(reader: _LineReader, key: str, start: int) -> Fix | None:
    """F-640 is B640. A negative number of another command has no such form, and neither has what is more than a number."""
    sign, digits = reader.chars[start], reader.chars[start + 1 :]
    if not digits.isdecimal() or (sign == "-" and key not in "FB"):
        return None
    other = {"F": "B", "B": "F"}[key] if sign == "-" else key
    return Fix(reader.span(start - len(key), len(reader.chars)), f"{other}{digits}")


def _condition(reader: _LineReader) -> tuple[JumpCondition, int]:
    """The condition and where its first number ends."""
    start = reader.at
    line = _number(reader)
    line_end = reader.at
    if line is None:
        _bad_condition(reader, "line or flag")
    if reader.next not in _LEVELS:
        _bad_condition(reader, "H or L", _level_read_as_one(reader.span(start), str(line)) if not reader.left else None)
    high = reader.take() == "H"
    label_start = reader.at
    label = _number(reader)
    if label is None:
        _bad_condition(reader, "label")
    return JumpCondition(line, high, label, reader.span(label_start)), line_end


def _bad_condition(reader: _LineReader, expected: str, fix: Fix | None = None) -> NoReturn:
    hint = SUCH_AS_I2H5()
    span = reader.span(reader.at) if fix is None else fix.span
    reader.give_up(findings.BAD_CONDITION, span, EXPECTED(expected=_EXPECTED[expected], found=reader.found), hint, fix)


def _level_read_as_one(span: Span, digits: str) -> Fix | None:
    """``i116`` is ``i1l6`` on paper: a letter l read as the digit 1. The replacement that makes the condition whole."""
    for i in range(1, len(digits) - 1):
        line, label = int(digits[:i]), int(digits[i + 1 :])
        if digits[i] == "1" and line in CONDITIONS and 1 <= label <= LARGEST_LABEL:
            return Fix(span, f"{line}L{label}")
    return None


def _unknown(reader: _LineReader) -> NoReturn:
    char = reader.chars[reader.at]
    span = reader.span(reader.at, reader.at + 1)
    meant = _MEANT.get(char)
    # A digit alone is worth a suggestion only where a number follows, as in 120 for l20.
    fix = Fix(span, meant) if meant and (char not in _DIGITS or len(reader.left) > 1) else None
    message = NO_COMMAND_BEGINS_WITH(char=char)
    if char == "\0":
        message = NO_COMMAND_BEGINS_WITH_NUL()
    reader.give_up(findings.UNKNOWN_COMMAND, span, message, None, fix)


def _end_of_command(reader: _LineReader, command: ChipCommand) -> None:
    """Nothing may follow a command on its line. A second command is reported and may be read; anything else ends the line."""
    rest = reader.left
    if not rest:
        return
    span = reader.rest_span()
    if reader.next in LETTERS:
        message = SECOND_COMMAND(char=rest[0], name=rows(reader.next)[0].name)
        reader.error(findings.SECOND_COMMAND, span, message, ONE_COMMAND_A_LINE(), Fix(Span(span.start, span.start), "\n"))
    elif rest[0] in _DIGITS and not takes_number(command.key):
        reader.give_up(findings.NO_ARGUMENT_TAKEN, span, TAKES_NO_NUMBER(keyword=command.key), None, Fix(span, ""))
    else:
        what = "number" if command.from_variable else "end of the line"
        reader.give_up(findings.BAD_ARGUMENT, span, EXPECTED_AFTER(expected=_EXPECTED[what], command=command, found=reader.found))
