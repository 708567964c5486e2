"""Every message about a WBC program, a position table or an image has a row here: code, severity, title.

``W1…`` are errors, ``W2…`` warnings. Codes are stable: a code is never given a new meaning.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from steptwin.diagnostics import Diagnostic, Fix, Severity, Span
from steptwin.messages import Message, MessageText

DID_YOU_MEAN = Message("wbc.did-you-mean", "did you mean {meant}?")
WRITE = Message("wbc.write", "write {text}")
THERE_IS_NO = Message("wbc.there-is-no", "there is no {name}")
TAKE_ANOTHER_NAME = Message("wbc.take-another-name", "take another name")
LACKS_COMPARISON_AFTER = Message("wbc.lacks-comparison-after", "{keyword} lacks the comparison after {text}")
NAMES_HAVE_LETTERS = Message(
    "wbc.names-have-letters", "names have letters without accents, digits and _, and do not begin with a digit"
)
IS_MISSING_AFTER = Message("wbc.is-missing-after", "= is missing after {text}")
WBC_HAS_NO = Message("wbc.wbc-has-no", "WBC has no {word}")
ARGUMENTS_ARE_SEPARATED_BY_BLANKS = Message("wbc.arguments-are-separated-by-blanks", "arguments are separated by blanks")
A_REGISTER = Message("wbc.a-register", "a register")
A_STATEMENT = Message("wbc.a-statement", "a statement")
A_FUNCTION = Message("wbc.a-function", "a function")
A_CONSTANT = Message("wbc.a-constant", "a constant")
CHECKED_FOR = Message("wbc.checked-for", "checked for {firmware}")
NUMBERED_ROWS_OF_TABLE = Message("wbc.numbered-rows-of-table", "the table has {rows}, numbered from 0")


class Spanned(Protocol):
    """Anything with a place in the source: a tree node, a step, a token."""

    @property
    def start(self) -> int: ...
    @property
    def end(self) -> int: ...


@dataclass(frozen=True, slots=True)
class ProgramFinding:
    """A kind of finding. ``title`` describes it in general; `at` makes the message for one place."""

    code: str
    title: str

    @property
    def severity(self) -> Severity:
        return Severity.ERROR if self.code.startswith("W1") else Severity.WARNING

    def at(
        self,
        place: Spanned,
        message: MessageText,
        hint: MessageText | None = None,
        fix: str | Fix | None = None,
        meant: str | None = None,
    ) -> Diagnostic:
        """The message for one place. ``fix`` is the text that replaces it, or a replacement elsewhere. ``meant`` is the name that
        was probably meant: the fix, and the hint asks for it.
        """
        span = Span(place.start, place.end)
        if meant is not None:
            return Diagnostic(self.code, self.severity, span, message, DID_YOU_MEAN(meant=meant), Fix(span, meant, is_named=True))
        return Diagnostic(self.code, self.severity, span, message, hint, Fix(span, fix) if isinstance(fix, str) else fix)


def before(place: Spanned, text: str) -> Fix:
    """Insert ``text`` before a place."""
    return Fix(Span(place.start, place.start), text)


def after(place: Spanned, text: str) -> Fix:
    """Insert ``text`` after a place."""
    return Fix(Span(place.end, place.end), text)


FINDINGS: dict[str, ProgramFinding] = {}


def _row(code: str, title: str) -> ProgramFinding:
    if code in FINDINGS:
        raise ValueError(f"code {code} is given twice")
    return FINDINGS.setdefault(code, ProgramFinding(code, title))


TRAILING = _row("W101", "characters after the end of a command")
ILLEGAL_CHARACTER = _row("W102", "illegal character in a name")
RESERVED = _row("W103", "the name is reserved (register, keyword, predefined name, existing position)")
UNKNOWN_VARIABLE = _row("W104", "the name is used as a value but never given one")
BAD_LABEL = _row("W105", "a label is malformed")
NUMERIC_LABEL = _row("W106", "a label is a number")
RESERVED_LABEL = _row("W107", "a label has a reserved name")
DUPLICATE_LABEL = _row("W108", "a label is defined twice")
MISSING_LABEL = _row("W109", "JUMP without a label")
UNKNOWN_LABEL = _row("W110", "JUMP to a label that is not defined")
LABEL_AT_END = _row("W111", "nothing follows the label")
NO_RETURN = _row("W112", "an interrupt label without RETURN")
MISSING_WAIT = _row("W113", "WAIT or another condition lacks an argument")
WRONG_WAIT = _row("W114", "WAIT or another condition has a wrong argument")
MISSING_EQUALS = _row("W115", "= is missing")
WRONG_OPERATOR = _row("W116", "wrong operator")
UNKNOWN_FUNCTION = _row("W117", "unknown function")
MISSING_VALUE = _row("W118", "a number or a name is missing")
WRONG_NUMBER = _row("W119", "not a number")
TOO_FEW = _row("W120", "too few arguments")
TOO_MANY = _row("W121", "too many arguments")
OUT_OF_RANGE = _row("W122", "number out of range")
TOO_MANY_VARIABLES = _row("W123", "too many variables")
USER_ADDRESS = _row("W124", "user register address out of range")
ODD_ADDRESS = _row("W125", "odd address of a two-word user register")
UNKNOWN_POSITION = _row("W126", "the position is not in the table")
MOTION_WITHOUT_DRIVE = _row("W127", "a motion command without drive")
HALT_WITHOUT_DRIVE = _row("W128", "BRAKE or STOP without drive")
READ_ONLY = _row("W129", "write to a read-only register")
ELSE_WITHOUT_IF = _row("W130", "ELSE without IF")
ENDIF_WITHOUT_IF = _row("W131", "ENDIF without IF")
IF_NOT_CLOSED = _row("W132", "IF is not closed by ENDIF")
SECOND_ELSE = _row("W133", "a second ELSE in one IF")
ENDWHILE_WITHOUT_WHILE = _row("W134", "ENDWHILE without WHILE")
WHILE_NOT_CLOSED = _row("W135", "WHILE is not closed by ENDWHILE")
TOO_MANY_LINES = _row("W136", "too many executable lines")
UNKNOWN_STATEMENT = _row("W137", "unknown statement")
NOT_SUPPORTED = _row("W138", "a statement of later firmware whose syntax is not documented")
NOT_IN_FIRMWARE = _row("W139", "not available in this firmware")
NO_SUCH_REGISTER = _row("W140", "no register with this number")
BAD_CONSTANT = _row("W141", "a constant is malformed")
DUPLICATE_CONSTANT = _row("W142", "a constant is defined twice")
NOT_ASSIGNABLE = _row("W143", "a constant cannot be assigned")
WRONG_ARGUMENT = _row("W144", "wrong argument")
BAD_RECORD = _row("W145", "malformed //!record or //!position")
ROW_PARAMETERS = _row("W146", "a row lacks a parameter of the path, or the path does not exist")

TABLE_COLUMNS = _row("W150", "a row of the position table has too few or too many columns")
TABLE_NUMBER = _row("W151", "a cell of the position table is neither a number nor x")
TABLE_DUPLICATE = _row("W152", "two rows of the position table have one name")
TABLE_TOO_LONG = _row("W153", "too many rows in the position table")
TABLE_BLANK = _row("W154", "an empty line inside the position table")

NOT_ENCODABLE = _row("W160", "the compiled image of firmware 1.25 has no documented form for this")
IMAGE_FULL = _row("W161", "the program is too long for the image")

LEFT_BY_JUMP = _row("W201", "all paths from an interrupt label leave without RETURN")
GEARS_DIFFER = _row("W202", "GEAR of M1 and M2 differ, and a circle is drawn")
RAMPS_DIFFER = _row("W203", "the ramps of M1 and M2 differ, and a line is drawn")
NEVER_REACHED = _row("W204", "code is never reached")
NEVER_ENDS = _row("W205", "a WAIT that can never end")
NEVER_USED = _row("W206", "a variable is assigned but never used")
NEVER_ENABLED = _row("W207", "motion of an axis that the program never enables")
NO_HANDLER = _row("W208", "an interrupt is enabled without a label")
NO_AXIS = _row("W209", "the row names no axis")
INTERRUPT_OFF = _row("W210", "an interrupt label whose interrupt is never enabled")
SATURATES = _row("W211", "the register cannot hold the number and takes the nearest one")
SHORT_DELAY = _row("W212", "DELAY is rounded up")
STATUS_IS_ZERO = _row("W213", "STATUS reads 0 in this firmware")
AMBIGUOUS_COMMA = _row("W214", "a comma read as separator could be a decimal comma")
POSITIONS_UNCHECKED = _row("W215", "positions are not checked without a position table")
NOT_EXECUTABLE = _row("W216", "an unknown record of an image cannot be executed")
STRAY_RETURN = _row("W217", "RETURN can be reached although no JUMP was taken")
ALWAYS_FAILS = _row("W218", "a calculation that always stops the program with an error")
HOME_WITHOUT_SWITCH = _row("W219", "HOME goes to a side for which the configuration has no input")
LIKE_A_REGISTER = _row("W220", "a variable with the name of a register as other controllers write it")
WAITS_FOR_VARIABLE = _row("W221", "a WAIT for variables that no interrupt changes")
LONG_TIME = _row("W222", "a time in seconds that looks like milliseconds")
TOO_FAST = _row("W223", "a velocity above what the pulse outputs give")
NOT_IN_REAL = _row("W224", "a number that REAL cannot hold by half or more")
WAITS_FOR_VELOCITY = _row("W225", "a WAITPOS for an axis that moves with a velocity, without end")
LEFT_BY_CALL = _row("W226", "a JUMP out of a loop to what follows it, from where RETURN comes back into the loop")
TABLE_NAME = _row("W250", "a name of the position table cannot be written after @")
INFERRED = _row("W260", "statements of an image whose form was inferred")
