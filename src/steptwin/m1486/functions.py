"""The auxiliary functions 40 to 63 and the flags 80 to 87 (manual chapter VII.6): ``T`` switches on, ``C`` off."""

from __future__ import annotations

from dataclasses import dataclass

from steptwin.m1486.commanduse import NOTHING, ChipState

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
class AuxiliaryFunction:
    """One auxiliary function. ``name`` is empty where the manual reserves the number."""

    number: int
    name: str = ""
    on: str = ""
    off: str = ""
    acts_on: ChipState = NOTHING
    """State that changes at once when it is switched, besides the function itself."""

    @property
    def default(self) -> bool:
        return default(self.number)


def default(number: int) -> bool:
    """State after power-up: 48 to 55 are ON, the others OFF."""
    return number in range(48, 56)


_LIMIT = ChipState.HELD
"""LIMIT that is low already holds the program."""
_NAMED = (
    AuxiliaryFunction(RUNSIGN, "Runsign", "B1 is low while the motor runs, high at rest", "B1 is a user line", ChipState.SIGNALS),
    AuxiliaryFunction(RETURN, "Return", "every character received is sent back", "the chip sends only what was asked for"),
    AuxiliaryFunction(LIMITOFF, "Limitoff", "LIMIT does nothing", "LIMIT stops the motion", _LIMIT),
    AuxiliaryFunction(EDGE, "Edge", "LIMIT acts on its falling edge", "LIMIT acts while it is low", _LIMIT),
    AuxiliaryFunction(CONTINUE, "Continue", "the program goes on after wrong data", "wrong data stop the program"),
    AuxiliaryFunction(OUTPUTS, "Outputs", "outputs keep their values at shutdown", "shutdown ties all outputs low"),
    AuxiliaryFunction(INPUT, "Input", "the operand of + - * / is read from lines", "the operand is the number given"),
    AuxiliaryFunction(COMPLEMENT, "Complement", "what is read from lines is inverted", "lines are read as they are"),
    AuxiliaryFunction(
        FULLSTEP, "Fullstep", "after a forced stop the motor goes on to a full step", "a forced stop ends where it ends"
    ),
    AuxiliaryFunction(
        RECOVER,
        "Recover",
        "the program goes on after Kill or LIMIT",
        "Kill stops the program until C, LIMIT until it is high",
        _LIMIT,
    ),
    AuxiliaryFunction(FULLSTEPSS, "Fullstepss", "a seek stops on a multiple of 4 full steps", "a seek stops on any microstep"),
    AuxiliaryFunction(
        REPORT, "Report", "sends 7FH when the input buffer is empty, 7EH when three bytes are free", "sends neither"
    ),
    AuxiliaryFunction(REGISTER, "Register", "the operand of + - * / is read from a register", "the operand is the number given"),
    AuxiliaryFunction(REMAINDER, "Remainder", "Order puts out the remainder", "Order puts out the internal variable"),
)


_BY_NUMBER = {function.number: function for function in _NAMED}

TABLE: tuple[AuxiliaryFunction, ...] = tuple(_BY_NUMBER.get(number, AuxiliaryFunction(number)) for number in FUNCTIONS)
"""Every function from 40 to 63 in order, reserved ones included."""


def function(number: int) -> AuxiliaryFunction:
    return TABLE[number - FUNCTIONS.start]


def is_reserved(number: int) -> bool:
    return not function(number).name
