"""The findings of the checker for M1486 programs: one row per code.

M1xx are errors: the chip refuses the command, or the program cannot work as written. M2xx are warnings: undocumented or
without the apparent effect.
"""

from __future__ import annotations

from dataclasses import dataclass

from steptwin.diagnostics import Diagnostic, Fix, Severity, Span
from steptwin.messages import MessageText


@dataclass(frozen=True, slots=True)
class ChipFinding:
    """A kind of diagnostic. Called with a place and a message it makes one."""

    code: str
    title: str
    meaning: str

    @property
    def severity(self) -> Severity:
        return Severity.ERROR if self.code.startswith("M1") else Severity.WARNING

    def __call__(self, span: Span, message: MessageText, hint: MessageText | None = None, fix: Fix | None = None) -> Diagnostic:
        return Diagnostic(self.code, self.severity, span, message, hint, fix)


_F = ChipFinding

UNKNOWN_COMMAND = _F("M101", "unknown command", "No command begins with this character.")
BAD_ARGUMENT = _F("M102", "not a number", "What follows the letter cannot be read as the number it takes.")
SECOND_COMMAND = _F("M103", "second command on a line", "A command ends with its line.")
NO_ARGUMENT_TAKEN = _F("M104", "takes no number", "This command has no argument.")
ARGUMENT_MISSING = _F("M105", "number missing", "The internal variable cannot replace this number.")
BAD_CONDITION = _F("M106", "incomplete condition", "If needs a line or flag, H or L, and a label.")

OUT_OF_RANGE = _F("M110", "number out of range", "The chip drops the command (M-11).")
NOT_A_MULTIPLE = _F("M111", "not a multiple of the microstep", "Distances and positions are multiples of 64 / M (M-11).")
FORBIDDEN_PAIR = _F("M112", "M does not permit this Q", "A move with these divisions does not start (M-11).")
LINE_OCCUPIED = _F("M113", "line taken by the driver interface", "The driver interface needs the pin of this line (M-21).")
DIVIDEND_TOO_LARGE = _F("M114", "dividend too large", "Above 65 000 only 2, 4, 8, 16, 32 and 64 divide.")

NO_SUCH_LABEL = _F("M120", "jump to an undefined label", "No Address command gives this label (M-17).")
LABEL_NOT_THERE_YET = _F("M121", "label not defined yet", "Outside [ ] a command runs before the next one arrives (M-17).")
LABEL_OVERWRITTEN = _F("M122", "label overwritten", "The command memory is a ring; this label has left it (M-12).")
LOOP_OPEN = _F("M123", "L without E", "No E ends this loop.")
LOOP_END_ALONE = _F("M124", "E without L", "There is no loop to end (M-20).")
LOOPS_TOO_DEEP = _F("M125", "too many loops inside one another", "Four levels are the most (M-5).")
NESTED_CALL = _F("M126", "subroutine inside a subroutine", "The chip stores one return address only.")
RETURN_ALONE = _F("M127", "dot outside a subroutine", "No call leads here (M-20).")

FILE_NOT_CLOSED = _F("M130", "[ without ]", "The commands are stored and never run.")
FILE_NOT_OPEN = _F("M131", "] without [", "No file is open.")
FILE_IN_FILE = _F("M132", "[ inside [ ]", "A file cannot hold another.")
RESET_IN_FILE = _F("M133", "reset inside [ ]", "It would delete the [ (chapter II, Memory).")
RESET_WITH_OTHERS = _F("M134", "reset sent with other commands", "What arrives while the EEPROM is erased is lost.")
FILE_TOO_LARGE = _F("M135", "file larger than the command memory", "The chip drops the file (M-12).")

MAY_FAIL = _F("M201", "may be refused", "For some values the internal variable can have here, or on some paths to here.")
BLANK_IN_NUMBER = _F("M202", "blank inside a number", "Blanks are ignored, also between digits (M-2).")
LOOPS_NESTED = _F("M203", "loops inside one another", "Not documented in the manual; up to four levels work (M-5).")
LOOP_CROSSED = _F("M204", "jump into or out of a loop", "Not documented in the manual.")
LABEL_TWICE = _F("M205", "label given twice", "Not documented in the manual; the later one is used.")
LABEL_UNUSED = _F("M206", "label never used", "Nothing jumps to it.")
NEVER_REACHED = _F("M207", "never reached", "No path through the program leads here.")
NEVER_RETURNS = _F("M208", "subroutine without a dot", "No path from the label leads to an End of subroutine.")
RESERVED = _F("M209", "reserved", "The manual reserves this number without a description.")
NO_RAMP = _F("M210", "V not above S", "The move runs at V without a ramp (M-8).")
SPEED_ABOVE_Q = _F("M211", "faster than Q permits", "The move is no faster than its division of the step permits.")
PROFILE_OUT_OF_RANGE = _F("M212", "P out of range", "Above 7000 the manual describes P only as switched off, that is above V.")
NO_ACCELERATION_TABLE = _F("M213", "acceleration large for the start/stop speed", "The table of permitted pairs is lost (M-4).")
LINE_READ_OCCUPIED = _F("M214", "line read is taken by the driver interface", "It shows the interface's signal, not an input.")
RUNSIGN_LINE_USED = _F("M215", "B1 used while function 40 is ON", "Runsign drives this line.")
REGISTERS_SHARED = _F("M216", "registers share the command memory", "Registers 1 to 8 are its last 128 bits.")
BOTH_OPERANDS = _F("M217", "functions 46 and 58 both ON", "Not documented in the manual; the lines are read (M-14).")
NOT_IN_FILE = _F("M218", "not stored in the EEPROM", "Only commands in [ ] run again at power-up.")
SECOND_FILE = _F("M219", "second file for the EEPROM", "The manual describes one file, stored into an erased EEPROM.")
ACTS_AT_ONCE = _F("M220", "acts when received", "It is not part of the stored file: it acts while the file is being sent.")
POSITION_PASSED = _F(
    "M221", "position counter passed its end", "It has 24 bits without a sign; G and H count from what it shows."
)
ENDS_IN_FINE_STEPS = _F("M222", "ends in fine steps at high speed", "The rest of the distance is made in steps of M at S (M-39).")
STARTED_AGAIN = _F(
    "M223", "file started again at its end", "Behind a file lies what was sent since, also the J that starts it (M-12)."
)

TABLE: tuple[ChipFinding, ...] = tuple(value for value in list(globals().values()) if isinstance(value, ChipFinding))

if len({f.code for f in TABLE}) != len(TABLE):
    raise ValueError("a code of the M1486 checker is defined twice")
