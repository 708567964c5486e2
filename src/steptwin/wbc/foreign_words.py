"""Words of BASIC, C and Structured Text, and what WBC has instead of them.

Those, and names that the vendor's manuals give a register elsewhere (`mistaken.py`), are all that is known of other languages.
"""

from __future__ import annotations

from collections.abc import Mapping

from steptwin.messages import Message, MessageText

_LOOP = Message("wbc.count-in-a-while", "count in a WHILE … ENDWHILE")()
_LOOP_OR_JUMP = Message("wbc.count-or-jump-back", "count in a WHILE … ENDWHILE, or JUMP back to a label")()
_SUBROUTINE = Message(
    "wbc.subroutine-is-a-label", "a subroutine is a label: JUMP goes there, RETURN comes back to the line after the JUMP"
)()

INSTEAD: Mapping[str, MessageText] = {
    "FOR": _LOOP,
    "NEXT": Message("wbc.while-ends-with-endwhile", "a WHILE ends with ENDWHILE")(),
    "REPEAT": _LOOP_OR_JUMP,
    "UNTIL": Message("wbc.loop-that-looks-at-its-end", "a loop that looks at its end is a label, an IF and a JUMP")(),
    "DO": _LOOP_OR_JUMP,
    "BREAK": Message("wbc.leave-by-condition", "give its condition another result; a JUMP behind the ENDWHILE is a call")(),
    "EXIT": Message("wbc.leave-by-condition-or-end", "give the condition of the WHILE another result; END ends the program")(),
    "SUB": _SUBROUTINE,
    "FUNCTION": _SUBROUTINE,
    "PRINT": Message("wbc.write-a-user-register", "write a user register such as $I0 or $R2, which a master can read")(),
}

STATEMENTS_ELSEWHERE: Mapping[str, str] = {
    **dict.fromkeys(("GOTO", "GOSUB", "CALL"), "JUMP"),
    **dict.fromkeys(("WEND", "END_WHILE"), "ENDWHILE"),
    "END_IF": "ENDIF",
}
"""Statements, and the one of WBC with that meaning."""

ELSE_IF = frozenset({"ELSEIF", "ELSIF"})

DECLARATIONS = frozenset({"LET", "CONST", "VAR", "DIM", "INT", "FLOAT"})

OPERATOR_WORDS: Mapping[str, tuple[str | None, MessageText]] = {
    "MOD": ("%", Message("wbc.remainder", "the remainder is written %")()),
    "AND": (None, Message("wbc.and", "& is 'and' of bits, && of conditions")()),
    "OR": (None, Message("wbc.bitwise-or", "| is 'or' of bits, || of conditions")()),
    "XOR": (None, Message("wbc.xor", "a - b is not 0 where two values differ")()),
    "^": (None, Message("wbc.multiply-instead", "multiply instead: SET X = Y * Y")()),
}
"""By operator: its equivalent in WBC if there is exactly one, and advice."""

VALUES: Mapping[str, str] = {"TRUE": "ON", "FALSE": "OFF"}
"""Names of values, and the predefined name with that meaning."""

TIME_UNITS: Mapping[str, float] = {"s": 1, "ms": 0.001, "min": 60}
"""In seconds."""

UNITS = frozenset({*TIME_UNITS, "mm", "mm/s", "°", "°/s", "deg", "rpm", "V", "%", "imp"})

_ONE_CHARACTER = Message("wbc.one-character", "one character, WBC writes two")()
_NO_OPERATOR = Message("wbc.not-an-operator", "not an operator of WBC")()
_SPACES = "\u2000\u2001\u2002\u2003\u2004\u2005\u2006\u2007\u2008\u2009\u200a\u202f\u3000"
LOOK_ALIKES: Mapping[str, tuple[MessageText, str]] = {
    **dict.fromkeys("‐‑–—−", (Message("wbc.a-dash", "a dash, not a minus")(), "-")),
    "\u00a0": (Message("wbc.a-no-break-space", "a no-break space, not a blank")(), " "),
    **dict.fromkeys(_SPACES, (Message("wbc.a-wide-or-narrow-space", "a wide or narrow space, not a blank")(), " ")),
    **dict.fromkeys("\u200b\u200c\u200d\u2060\ufeff", (Message("wbc.an-invisible-character", "an invisible character")(), "")),
    "≤": (_ONE_CHARACTER, "<="),
    "≥": (_ONE_CHARACTER, ">="),
    **dict.fromkeys("×·", (_NO_OPERATOR, "*")),
    "÷": (_NO_OPERATOR, "/"),
}
"""Characters that look like one of WBC: their names, and the character of WBC."""
