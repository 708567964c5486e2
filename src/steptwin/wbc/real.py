"""REAL arithmetic of running programs: every value is an IEEE-754 single, every operation rounds once.

What cannot be calculated is a `ProgramFault` (WBC-5). A result beyond the range of REAL is the largest one (WBC-21), so that
no value is ever infinite or no number.
"""

from __future__ import annotations

import operator
import struct
from collections.abc import Callable, Mapping
from math import fmod, sqrt

from steptwin.messages import Message
from steptwin.motion.trig import arccosine, arcsine, cosine, sine
from steptwin.tables import complete
from steptwin.wbc.registers import DINT, REAL_MAX
from steptwin.wbc.statements import COMPARISONS as SIGNS
from steptwin.wbc.statements import FUNCTIONS as FUNCTION_ROWS
from steptwin.wbc.statements import OPERATORS

QUARTER_DEG = 90.0
_single = struct.Struct("<f")
_EXACT = 2.0**53
"""Below it every whole number is exact in a float."""


class ProgramFault(Exception):
    """An operation of a running program is impossible; the text names it. It is a program error (WBC-5)."""


def real(value: float) -> float:
    """The nearest REAL (WBC-21)."""
    if -REAL_MAX <= value <= REAL_MAX:
        return _single.unpack(_single.pack(value))[0]
    return REAL_MAX if value > 0.0 else -REAL_MAX


def shortest(value: float) -> float:
    """The number with the fewest digits that is this REAL; ``value`` is finite."""
    single = real(value)
    for digits in range(1, 9):
        candidate = float(f"{single:.{digits}g}")
        if real(candidate) == single and abs(candidate) <= REAL_MAX:
            return candidate
    return float(f"{single:.9g}")


def real_text(value: float) -> str:
    """A number as text: a whole one with all its digits, any other in the shortest form that reads back as the same REAL."""
    if value == round(value) and abs(value) < _EXACT:
        return str(round(value))
    return f"{shortest(value):.9g}"


def whole(value: float) -> int:
    """The nearest 32-bit integer, ties to even (WBC-10)."""
    return round(min(max(value, DINT.low), DINT.high))


DOES_NOT_EXIST = Message("wbc.does-not-exist", "{function}({x}) does not exist")
DIVISION_BY_ZERO = Message("wbc.division-by-zero", "division by zero")


def _quotient(a: float, b: float) -> float:
    if b == 0.0:
        raise ProgramFault(DIVISION_BY_ZERO())
    return a / b


REMAINDER_OF_A_DIVISION_BY_ZERO = Message("wbc.remainder-of-a-division-by-zero", "remainder of a division by zero")


def _remainder(a: float, b: float) -> float:
    if b == 0.0:
        raise ProgramFault(REMAINDER_OF_A_DIVISION_BY_ZERO())
    return fmod(a, b)


def _shift(value: float, by: float) -> int:
    """To the left for positive ``by``; as of 32-bit integers with sign, nothing is left beyond 31 places (WBC-22)."""
    number, places = whole(value), whole(by)
    if places < 0:
        return number >> min(-places, 31)
    shifted = (number << min(places, 32)) & 0xFFFF_FFFF
    return shifted - (1 << 32) if shifted & 0x8000_0000 else shifted


OPERATIONS: Mapping[str, Callable[[float, float], float]] = complete(
    "operator",
    OPERATORS,
    "operation",
    {
        "+": operator.add,
        "-": operator.sub,
        "*": operator.mul,
        "/": _quotient,
        "%": _remainder,
        "&": lambda a, b: whole(a) & whole(b),
        "|": lambda a, b: whole(a) | whole(b),
        "&&": lambda a, b: 1.0 if whole(a) and whole(b) else 0.0,
        "||": lambda a, b: 1.0 if whole(a) or whole(b) else 0.0,
        "<<": _shift,
        ">>": lambda a, b: _shift(a, -whole(b)),
    },
)

COMPARISONS: Mapping[str, Callable[[float, float], bool]] = complete(
    "comparison",
    SIGNS,
    "test",
    {
        "=": operator.eq,
        "<": operator.lt,
        ">": operator.gt,
        "<=": operator.le,
        ">=": operator.ge,
    },
)


def _quarters(degrees: float) -> float:
    return fmod(degrees, 360.0) / QUARTER_DEG


def _tangent(degrees: float) -> float:
    angle_q = _quarters(degrees)
    below = cosine(angle_q)
    if below == 0.0:
        raise ProgramFault(DOES_NOT_EXIST(function="tg", x=real_text(degrees)))
    return sine(angle_q) / below


def _cotangent(degrees: float) -> float:
    angle_q = _quarters(degrees)
    below = sine(angle_q)
    if below == 0.0:
        raise ProgramFault(DOES_NOT_EXIST(function="ctg", x=real_text(degrees)))
    return cosine(angle_q) / below


def _arcsine(x: float) -> float:
    if not -1.0 <= x <= 1.0:
        raise ProgramFault(DOES_NOT_EXIST(function="asin", x=real_text(x)))
    return arcsine(x) * QUARTER_DEG


def _arccosine(x: float) -> float:
    if not -1.0 <= x <= 1.0:
        raise ProgramFault(DOES_NOT_EXIST(function="acos", x=real_text(x)))
    return arccosine(x) * QUARTER_DEG


def _root(x: float) -> float:
    if x < 0.0:
        raise ProgramFault(DOES_NOT_EXIST(function="sqrt", x=real_text(x)))
    return sqrt(x)


FUNCTIONS: Mapping[str, Callable[..., float]] = complete(
    "function",
    FUNCTION_ROWS,
    "calculation",
    {
        "SIN": lambda degrees: sine(_quarters(degrees)),
        "COS": lambda degrees: cosine(_quarters(degrees)),
        "TG": _tangent,
        "CTG": _cotangent,
        "ASIN": _arcsine,
        "ACOS": _arccosine,
        "SQRT": _root,
        "MIN": min,
        "MAX": max,
    },
)
