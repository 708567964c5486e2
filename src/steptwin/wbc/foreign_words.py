"""Words of other languages, and what WBC has instead of them."""

from __future__ import annotations

from collections.abc import Mapping

_LOOP = "count in a WHILE … ENDWHILE"
_LEAVE = "JUMP to a label behind the ENDWHILE"
_SUBROUTINE = "a subroutine is a label: JUMP goes there, RETURN comes back to the line after the JUMP"
_MASTER = "write a user register such as $I0 or $R2, which a master can read"
_G_CODE = "PABS and PREL move one drive, MOVEPTP and MOVELIN go to rows of the position table"

INSTEAD: Mapping[str, str] = {
    "FOR": _LOOP,
    "NEXT": "a WHILE ends with ENDWHILE",
    "REPEAT": f"{_LOOP}, or JUMP back to a label",
    "UNTIL": "a loop that looks at its end is a label, an IF and a JUMP",
    "DO": f"{_LOOP}, or JUMP back to a label",
    "LOOP": "JUMP back to a label, or WHILE 1 = 1 … ENDWHILE",
    "BREAK": _LEAVE,
    "EXIT": f"{_LEAVE}; END ends the program",
    "CONTINUE": "JUMP to a label before the ENDWHILE",
    "SUB": _SUBROUTINE,
    "FUNCTION": _SUBROUTINE,
    "PROC": _SUBROUTINE,
    "PROCEDURE": _SUBROUTINE,
    "ENDSUB": "a subroutine ends with RETURN",
    "LABEL": "a label is its name and a ':' on a line of its own, like MAIN:",
    "PROGRAM": "a program begins with its first line",
    "BEGIN": "a program begins with its first line",
    "HALT": "END ends the program; STOP and BRAKE stop a drive",
    "ABORT": "END ends the program; STOP and BRAKE stop a drive",
    "PRINT": _MASTER,
    "WRITE": _MASTER,
    "SEND": _MASTER,
    "READ": "user registers such as $I0 hold what a master has written",
    "MOVE": _G_CODE,
    "MOVEABS": "PABS Mx position moves a drive to a position",
    "MOVEREL": "PREL Mx distance moves a drive by a distance",
    "MOVA": "PABS Mx position moves a drive to a position",
    "MOVR": "PREL Mx distance moves a drive by a distance",
    "JOG": "VABS Mx velocity runs a drive, BRAKE Mx ends that",
    "SETPOS": "PosM1 = 0 sets the position counter",
    "TIMER": "TIMA1 counts every 10 ms, TIMB1 every second: set one to 0, then compare it",
    **dict.fromkeys(("G0", "G00", "G1", "G01", "G28", "G90", "G91"), _G_CODE),
    "ON": "interrupts are labels such as INT_IN1, switched on by CFGINT_IN1 = RIS",
}

ELSE_IF = frozenset({"ELSEIF", "ELIF", "ELSIF", "ELSE_IF"})

DECLARATIONS = frozenset(
    {"LET", "CONST", "DEFINE", "VAR", "DIM", "INT", "REAL", "FLOAT", "DOUBLE", "BOOL", "WORD", "DWORD", "DINT"}
)

OPERATOR_WORDS: Mapping[str, tuple[str | None, str]] = {
    "MOD": ("%", "the remainder is written %"),
    "DIV": (None, "/ gives a fraction; a register such as $I0 takes the nearest whole number"),
    "AND": (None, "& is 'and' of bits, && of conditions"),
    "OR": (None, "| is 'or' of bits, || of conditions"),
    "XOR": (None, "a - b is not 0 where two values differ"),
    "SHL": ("<<", "shifts are written << and >>"),
    "SHR": (">>", "shifts are written << and >>"),
    "^": (None, "multiply instead: SET X = Y * Y"),
}
"""By operator: its equivalent in WBC if there is exactly one, and advice."""

TIME_UNITS: Mapping[str, float] = {"s": 1, "sec": 1, "sek": 1, "ms": 0.001, "us": 0.000001, "µs": 0.000001, "min": 60, "h": 3600}
"""In seconds."""

UNITS = frozenset(
    {
        *TIME_UNITS,
        *("mm", "cm", "m", "um", "µm", "mm/s", "m/s", "mm/min", "mm/s2", "mm/s²", "deg", "deg/s", "°", "°/s", "rpm", "Hz", "kHz"),
        *("V", "mV", "%", "imp", "imp/s", "pulses", "steps", "obr", "obr/s", "rev", "rev/s"),
    }
)

VALUES: Mapping[str, str] = {
    **dict.fromkeys(("TRUE", "YES", "ENABLE", "ENABLED", "ACTIVE"), "ON"),
    **dict.fromkeys(("FALSE", "NO", "DISABLE", "DISABLED", "INACTIVE", "LOW"), "OFF"),
    **dict.fromkeys(("RISING", "RISE", "POSEDGE"), "RIS"),
    **dict.fromkeys(("FALLING", "NEGEDGE"), "FALL"),
    **dict.fromkeys(("BOTH", "BOTHEDGES"), "RIS_FALL"),
    "CLOSED": "CLOSE",
    "OPENED": "OPEN",
}
"""Names of values, and the predefined name with that meaning."""

_SPACES = "\u2000\u2001\u2002\u2003\u2004\u2005\u2006\u2007\u2008\u2009\u200a\u202f\u3000"
LOOK_ALIKES: Mapping[str, tuple[str, str]] = {
    **dict.fromkeys("‐‑‒–—―−﹣－", ("a dash, not a minus", "-")),
    "\u00a0": ("a no-break space, not a blank", " "),
    **dict.fromkeys(_SPACES, ("a wide or narrow space, not a blank", " ")),
    **dict.fromkeys("\u200b\u200c\u200d\u2060\ufeff", ("an invisible character", "")),
    "≤": ("one character, WBC writes two", "<="),
    "≥": ("one character, WBC writes two", ">="),
    **dict.fromkeys("×·∙⋅", ("not an operator of WBC", "*")),
    **dict.fromkeys("÷∕", ("not an operator of WBC", "/")),
    "＝": ("a wide character", "="),
    "，": ("a wide character", ","),
    "：": ("a wide character", ":"),
}
"""Characters that look like one of WBC: their names, and the character of WBC."""
