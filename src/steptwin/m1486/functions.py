"""The auxiliary functions 40 to 63 and the flags 80 to 87 (manual chapter VII.6): ``T`` switches on, ``C`` off."""

from __future__ import annotations

from dataclasses import dataclass

FUNCTIONS = range(40, 64)
USER_FLAGS = range(80, 87)
CARRY = 87

RUNSIGN = 40
RETURN = 41
LIMITOFF = 42
EDGE = 43
CONTINUE = 44
OUTPUTS = 45
INPUT = 46
COMPLEMENT = 47
FULLSTEP = 50
RECOVER = 51
FULLSTEPSS = 52
REPORT = 57
REGISTER = 58
REMAINDER = 59


@dataclass(frozen=True, slots=True)
class Function:
    """One auxiliary function. ``name`` is empty where the manual reserves the number."""

    number: int
    name: str = ""
    on: str = ""
    off: str = ""

    @property
    def default(self) -> bool:
        return default(self.number)


def default(number: int) -> bool:
    """State after power-up: 48 to 55 are ON, the others OFF."""
    return number in range(48, 56)


_NAMED = (
    Function(RUNSIGN, "Runsign", "B1 is low while the motor runs, high at rest", "B1 is a user line"),
    Function(RETURN, "Return", "every character received is sent back", "the chip sends only what was asked for"),
    Function(LIMITOFF, "Limitoff", "LIMIT does nothing", "LIMIT stops the motion"),
    Function(EDGE, "Edge", "LIMIT acts on its falling edge", "LIMIT acts while it is low"),
    Function(CONTINUE, "Continue", "the program goes on after wrong data", "wrong data stop the program"),
    Function(OUTPUTS, "Outputs", "outputs keep their values at shutdown", "shutdown ties all outputs low"),
    Function(INPUT, "Input", "the operand of + - * / is read from lines", "the operand is the number given"),
    Function(COMPLEMENT, "Complement", "what is read from lines is inverted", "lines are read as they are"),
    Function(FULLSTEP, "Fullstep", "after a forced stop the motor goes on to a full step", "a forced stop ends where it ends"),
    Function(RECOVER, "Recover", "the program goes on after Kill or LIMIT", "Kill and LIMIT stop the program"),
    Function(FULLSTEPSS, "Fullstepss", "a seek stops on a multiple of 4 full steps", "a seek stops on any microstep"),
    Function(REPORT, "Report", "sends 7FH when the input buffer is empty, 7EH when three bytes are free", "sends neither"),
    Function(REGISTER, "Register", "the operand of + - * / is read from a register", "the operand is the number given"),
    Function(REMAINDER, "Remainder", "Order puts out the remainder", "Order puts out the internal variable"),
)


def _table() -> tuple[Function, ...]:
    by_number = {f.number: f for f in _NAMED}
    if len(by_number) != len(_NAMED) or not set(by_number) <= set(FUNCTIONS):
        raise ValueError("a function number stands twice or lies outside 40 to 63")
    return tuple(by_number.get(number, Function(number)) for number in FUNCTIONS)


#: Every function from 40 to 63 in order, reserved ones included.
TABLE: tuple[Function, ...] = _table()


def function(number: int) -> Function:
    return TABLE[number - FUNCTIONS.start]


def is_reserved(number: int) -> bool:
    return not function(number).name
