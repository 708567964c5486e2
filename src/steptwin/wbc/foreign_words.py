"""Words of BASIC, C and Structured Text, and what WBC has instead of them.

Those, and names that the vendor's manuals give a register elsewhere (`mistaken.py`), are all that is known of other languages.
"""

from __future__ import annotations

from collections.abc import Mapping

_LOOP = "count in a WHILE … ENDWHILE"
_LEAVE = "JUMP to a label behind the ENDWHILE"
_SUBROUTINE = "a subroutine is a label: JUMP goes there, RETURN comes back to the line after the JUMP"

INSTEAD: Mapping[str, str] = {
    "FOR": _LOOP,
    "NEXT": "a WHILE ends with ENDWHILE",
    "REPEAT": f"{_LOOP}, or JUMP back to a label",
    "UNTIL": "a loop that looks at its end is a label, an IF and a JUMP",
    "DO": f"{_LOOP}, or JUMP back to a label",
    "BREAK": _LEAVE,
    "EXIT": f"{_LEAVE}; END ends the program",
    "SUB": _SUBROUTINE,
    "FUNCTION": _SUBROUTINE,
    "PRINT": "write a user register such as $I0 or $R2, which a master can read",
}

STATEMENTS_ELSEWHERE: Mapping[str, str] = {
    **dict.fromkeys(("GOTO", "GOSUB", "CALL"), "JUMP"),
    **dict.fromkeys(("WEND", "END_WHILE"), "ENDWHILE"),
    "END_IF": "ENDIF",
}
"""Statements, and the one of WBC with that meaning."""

ELSE_IF = frozenset({"ELSEIF", "ELSIF"})

DECLARATIONS = frozenset({"LET", "CONST", "VAR", "DIM", "INT", "FLOAT"})

OPERATOR_WORDS: Mapping[str, tuple[str | None, str]] = {
    "MOD": ("%", "the remainder is written %"),
    "AND": (None, "& is 'and' of bits, && of conditions"),
    "OR": (None, "| is 'or' of bits, || of conditions"),
    "XOR": (None, "a - b is not 0 where two values differ"),
    "^": (None, "multiply instead: SET X = Y * Y"),
}
"""By operator: its equivalent in WBC if there is exactly one, and advice."""

VALUES: Mapping[str, str] = {"TRUE": "ON", "FALSE": "OFF"}
"""Names of values, and the predefined name with that meaning."""

TIME_UNITS: Mapping[str, float] = {"s": 1, "ms": 0.001, "min": 60}
"""In seconds."""

UNITS = frozenset({*TIME_UNITS, "mm", "mm/s", "°", "°/s", "deg", "rpm", "V", "%", "imp"})

_SPACES = "\u2000\u2001\u2002\u2003\u2004\u2005\u2006\u2007\u2008\u2009\u200a\u202f\u3000"
LOOK_ALIKES: Mapping[str, tuple[str, str]] = {
    **dict.fromkeys("‐‑–—−", ("a dash, not a minus", "-")),
    "\u00a0": ("a no-break space, not a blank", " "),
    **dict.fromkeys(_SPACES, ("a wide or narrow space, not a blank", " ")),
    **dict.fromkeys("\u200b\u200c\u200d\u2060\ufeff", ("an invisible character", "")),
    "≤": ("one character, WBC writes two", "<="),
    "≥": ("one character, WBC writes two", ">="),
    **dict.fromkeys("×·", ("not an operator of WBC", "*")),
    "÷": ("not an operator of WBC", "/"),
}
"""Characters that look like one of WBC: their names, and the character of WBC."""
