"""The statements of WBC as a table. Parser, checker, printer, hover texts and reference pages are projections of it."""

from __future__ import annotations

import enum
from dataclasses import dataclass


class OperandKind(enum.Enum):
    """The kind of an operand."""

    AXIS = "drive"
    OUTPUT = "output"
    VALUE = "value"
    CONDITION = "condition"
    LABEL = "label"
    ROW = "position"


@dataclass(frozen=True, slots=True)
class Operand:
    kind: OperandKind
    name: str


@dataclass(frozen=True, slots=True)
class StatementRow:
    """``since`` is the firmware generation it came with; ``in_parentheses``: it is written like a function."""

    keyword: str
    operands: tuple[Operand, ...]
    meaning: str
    since: str | None = None
    in_parentheses: bool = False

    @property
    def usage(self) -> str:
        """The syntax of the statement: ``PABS Mx position``."""
        names = [operand.name for operand in self.operands]
        if self.in_parentheses:
            return f"{self.keyword}({', '.join(names)})"
        return " ".join([self.keyword, *names])


_AXIS = Operand(OperandKind.AXIS, "Mx")
_CONDITION = Operand(OperandKind.CONDITION, "X = Y")
_ROW = Operand(OperandKind.ROW, "@name")


def _value(name: str) -> Operand:
    return Operand(OperandKind.VALUE, name)


_ROWS = (
    StatementRow("IF", (_CONDITION,), "Runs the lines up to ELSE or ENDIF when the condition is true, else those after ELSE."),
    StatementRow("ELSE", (), "Begins the lines that run when the condition of the IF is false."),
    StatementRow("ENDIF", (), "Ends an IF."),
    StatementRow("WHILE", (_CONDITION,), "Repeats the lines up to ENDWHILE as long as the condition is true."),
    StatementRow("ENDWHILE", (), "Ends a WHILE."),
    StatementRow("WAIT", (_CONDITION,), "Waits until the condition is true."),
    StatementRow("DELAY", (_value("seconds"),), "Waits this many seconds, at least 0.01."),
    StatementRow("JUMP", (Operand(OperandKind.LABEL, "LABEL"),), "Goes on at the label and remembers the next line for RETURN."),
    StatementRow("RETURN", (), "Goes to the line after the last JUMP taken; ends an interrupt."),
    StatementRow("END", (), "Ends the program; drives and outputs are switched off."),
    StatementRow("PROGRESET", (), "Switches the drives off and starts the program again from its first line."),
    StatementRow("HOME", (_AXIS, _value("velocity")), "Homes the drive at this velocity: negative to KL, positive to KR."),
    StatementRow("VABS", (_AXIS, _value("velocity")), "Runs the drive at this velocity."),
    StatementRow("VREL", (_AXIS, _value("velocity")), "Changes the velocity of the drive by this much."),
    StatementRow("PABS", (_AXIS, _value("position")), "Starts the drive towards this position."),
    StatementRow("PREL", (_AXIS, _value("distance")), "Starts the drive over this distance."),
    StatementRow("BRAKE", (_AXIS,), "Slows the drive down to standstill with its ramp."),
    StatementRow("STOP", (_AXIS,), "Stops the drive at once, without ramp."),
    StatementRow("MOVEPTP", (_ROW,), "Starts every axis the row of the position table names towards it, all in one instant."),
    StatementRow("MOVELIN", (_ROW,), "Moves M1 and M2 on a straight line to (p1, p2) at path velocity p3."),
    StatementRow("MOVELIN_REL", (_ROW,), "Moves M1 and M2 on a straight line by (p1, p2) at path velocity p3."),
    StatementRow("MOVETOCIRC", (_ROW,), "Moves M1 and M2 to the starting point of the circle: its point nearest the origin."),
    StatementRow("DOCIRC", (_ROW,), "Runs the circle with centre (p1, p2), radius p3, angle p4 in degrees, positive clockwise."),
    StatementRow("DOARC", (_ROW,), "Runs an arc to (p1, p2) with radius p3; p4 is 0 for the external, 1 for the internal one."),
    StatementRow("WAITPOS", (), "Waits until every enabled drive has finished its motion."),
    StatementRow(
        "PULSE",
        (Operand(OperandKind.OUTPUT, "OUTn"), _value("seconds")),
        "Inverts the output after this many seconds without waiting for it.",
        since="1.70",
        in_parentheses=True,
    ),
)

STATEMENTS = {row.keyword: row for row in _ROWS}

SET = "SET"
SET_USAGE = "SET X = Y, SET X = Y op Z or SET X = function(Y)"
ASSIGNMENTS = (
    ("#name value", "Names a number or a register."),
    ("SET X = Y", "Gives a variable or register a value. The word SET may be left out."),
    ("SET X = Y op Z", "Calculates one operation."),
    ("SET X = function(Y)", "Calculates a function."),
)

# WBC-13: later firmware has them, but only their names are known.
NOT_SUPPORTED = frozenset({"SWITCH", "CASE"})

KEYWORDS = frozenset(STATEMENTS) | {SET}


def _taking(*kinds: OperandKind) -> frozenset[str]:
    return frozenset(row.keyword for row in _ROWS if tuple(operand.kind for operand in row.operands) == kinds)


MOTIONS = _taking(OperandKind.AXIS, OperandKind.VALUE)
HALTS = _taking(OperandKind.AXIS)
ROW_MOTIONS = _taking(OperandKind.ROW)
FLOW = frozenset(
    row.keyword
    for row in _ROWS
    if not {operand.kind for operand in row.operands} & {OperandKind.AXIS, OperandKind.OUTPUT, OperandKind.ROW}
)
"""Statements that act on neither drives nor outputs."""
LINES = frozenset({"MOVELIN", "MOVELIN_REL"})
CIRCLES = frozenset({"MOVETOCIRC", "DOCIRC", "DOARC"})
OPENING = frozenset({"IF", "WHILE"})
CLOSING = frozenset({"ENDIF", "ENDWHILE"})

COMPARISONS = {
    "=": "equal",
    "<": "less",
    ">": "greater",
    "<=": "less or equal",
    ">=": "greater or equal",
}

OPERATORS = {
    "+": "sum",
    "-": "difference",
    "*": "product",
    "/": "quotient; dividing by zero is a program error",
    "%": "remainder; dividing by zero is a program error",
    "&": "bits set in both",
    "|": "bits set in one or both",
    "&&": "1 when neither is 0, else 0",
    "||": "1 when one or both are not 0, else 0",
    "<<": "bits shifted to the left",
    ">>": "bits shifted to the right",
}


@dataclass(frozen=True, slots=True)
class FunctionRow:
    name: str
    arguments: int
    meaning: str


_FUNCTION_ROWS = (
    FunctionRow("sin", 1, "sine of an angle in degrees"),
    FunctionRow("cos", 1, "cosine of an angle in degrees"),
    FunctionRow("tg", 1, "tangent of an angle in degrees"),
    FunctionRow("ctg", 1, "cotangent of an angle in degrees"),
    FunctionRow("asin", 1, "angle in degrees whose sine is given; outside -1…1 a program error"),
    FunctionRow("acos", 1, "angle in degrees whose cosine is given; outside -1…1 a program error"),
    FunctionRow("sqrt", 1, "square root; of a negative number a program error"),
    FunctionRow("min", 2, "the smaller of two numbers"),
    FunctionRow("max", 2, "the larger of two numbers"),
)

FUNCTIONS = {row.name.upper(): row for row in _FUNCTION_ROWS}
