"""Advice for wrong lines with elements of other languages.

Only lines that the reader has refused are analysed, so this module cannot make a correct program wrong. It knows BASIC, C and
Structured Text.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

from steptwin.diagnostics import Diagnostic, Fix, Span
from steptwin.wbc.foreign_words import DECLARATIONS, ELSE_IF, INSTEAD, OPERATOR_WORDS, TIME_UNITS, UNITS
from steptwin.wbc.lexer import NUMBER, OPERATOR, WORD, Lexeme, is_name
from steptwin.wbc.positions import number_text
from steptwin.wbc.registers import BIT, ROWS, parts
from steptwin.wbc.statements import COMPARISONS, SET, STATEMENTS, OperandKind


class ForeignLine(NamedTuple):
    """A refused line: its words, its text without comment and where that begins; ``jumps`` gives the labels named by JUMPs.

    ``reads`` returns whether a text would be accepted in place of the line.
    """

    words: Sequence[Lexeme]
    code: str
    start: int
    jumps: Callable[[], frozenset[str]]
    reads: Callable[[str], bool]

    @property
    def key(self) -> str:
        """The first word in upper case."""
        return self.words[0].text.upper()

    def text(self, first: int, last: int | None = None) -> str:
        """The text from one word to another, both included; to the last one where none is given. Empty where there is no word."""
        if first >= len(self.words):
            return ""
        return self.code[self.words[first].start - self.start : self.words[-1 if last is None else last].end - self.start]


class Advice(NamedTuple):
    """A message that replaces the reader's own. ``fix`` replaces the text from ``start`` to ``end``.

    ``keyword``: the block statement that was meant, so that its block is known.
    """

    start: int
    end: int
    message: str
    hint: str | None = None
    fix: str | None = None
    keyword: str | None = None


def explain(line: ForeignLine, found: Diagnostic) -> tuple[Diagnostic, str | None]:
    """The best message for a refused line, and the intended keyword if it differs from the one read."""
    for look in _LOOKS:
        advice = look(line)
        if advice is not None:
            span = Span(advice.start, advice.end)
            fix = None if advice.fix is None else Fix(span, advice.fix)
            return replace(found, span=span, message=advice.message, hint=advice.hint, fix=fix), advice.keyword
    return found, None


def _over(line: ForeignLine, span: tuple[int, int], message: str, hint: str | None = None, fix: str | None = None) -> Advice:
    """Advice about the words from the first to the second number in ``span``."""
    return Advice(line.words[span[0]].start, line.words[span[1]].end, message, hint, fix)


def _of_all(line: ForeignLine, message: str, hint: str, fix: str | None = None, keyword: str | None = None) -> Advice:
    return Advice(line.words[0].start, line.words[-1].end, message, hint, fix, keyword)


def _is_bit(text: str) -> bool:
    found = parts(text.upper())
    return found is not None and found[0].reads == BIT


# ---------------------------------------------------------------------- comments and several statements


_COMMENT = re.compile(r"/\*|\(\*|;|(?:^|(?<=\s))'|^\s*(?:REM\b|/)", re.IGNORECASE)
_SLASHES = "comments begin with //"


def _comment(line: ForeignLine) -> Advice | None:
    match = _COMMENT.search(line.code)
    if match is None:
        return _hash(line)
    sign = match[0].strip()
    start, end = line.start + match.end() - len(sign), line.start + match.end()
    before, after = line.code[: match.start()].strip(), line.code[match.end() :].strip()
    if sign == ";" and not after:
        return Advice(start, end, "no ; at the end of a line", "a statement ends with its line", "")
    if sign == ";" and before and line.reads(after):
        return Advice(start, end, "only one statement per line is permitted", "put the second one on the next line", "\n")
    closing = {"/*": "*/", "(*": "*)"}.get(sign)
    if closing is None:
        return Advice(start, end, _SLASHES, None, "//")
    if after.endswith(closing):
        return Advice(start, line.words[-1].end, _SLASHES, None, f"// {after[: -len(closing)].strip()}")
    return Advice(start, line.words[-1].end, _SLASHES, "write // in front of every line of the comment")


def _hash(line: ForeignLine) -> Advice | None:
    words = line.words
    if words[0].text == "#" and len(words) > 3 and all(word.kind == WORD for word in words[1:]):
        return _over(line, (0, 0), _SLASHES, "#name value names a number or a register", "//")
    return None


def _colon(line: ForeignLine) -> Advice | None:
    """``M1 = ON : M2 = ON``."""
    for number, word in enumerate(line.words[1:-1], 1):
        if word.text == ":" and line.reads(line.text(0, number - 1)) and line.reads(line.text(number + 1)):
            return _over(
                line, (number, number), "only one statement per line is permitted", "put the second one on the next line", "\n"
            )
    return None


# ---------------------------------------------------------------------- blocks, labels, other statements


IF_UNKNOWN = "IF?"
"""The keyword of a line that may open or close an IF. After it, the IF that an ENDIF closes is not known."""
LABEL = "LABEL"
"""The keyword of a line that means a label."""


def _blocks(line: ForeignLine) -> Advice | None:
    words, key = line.words, line.key
    second = words[1].text.upper() if len(words) > 1 else ""
    if key in ELSE_IF or (key == "ELSE" and second == "IF"):
        hint = "write ELSE, the IF on the next line, and an ENDIF for each of the two"
        return _of_all(line, "ELSE and IF are two lines in WBC", hint, keyword=IF_UNKNOWN)
    if key == "END" and second in ("IF", "WHILE") and len(words) == 2:
        return _of_all(
            line, f"END{second} is one word", f"END alone ends the program, write END{second}", f"END{second}", f"END{second}"
        )
    if key in ("IF", "WHILE"):
        then = "THEN" if key == "IF" else "DO"
        for number, word in enumerate(words):
            if word.text.upper() == then:
                if number == len(words) - 1:
                    return _over(line, (number, number), f"{key} is written without {then}", None, "")
                message = f"no text is permitted after the condition of {key}"
                hint = f"the lines of the {key} follow below it, up to END{key}"
                return Advice(word.start, words[-1].end, message, hint, keyword=IF_UNKNOWN if key == "IF" else None)
    return None


def _label(line: ForeignLine) -> Advice | None:
    words = line.words
    name = words[-1]
    if (len(words) == 1 or (len(words) == 2 and line.key in ("SUB", "FUNCTION"))) and (
        name.text.upper() in line.jumps() and line.reads(f"{name.text}:")
    ):
        return _of_all(line, f"{name.text} is a label", "a label is written with a ':'", f"{name.text}:", keyword=LABEL)
    return None


def _instead(line: ForeignLine) -> Advice | None:
    """A first word that WBC does not have."""
    words, key = line.words, line.key
    if key in STATEMENTS or key == SET or (len(words) > 1 and words[1].text in ("=", ":")):
        return None
    found = parts(f"{key}M1") or parts(f"{key}1")
    if found is not None and len(words) == 3 and re.fullmatch(r"M[1-4]", words[1].text, re.IGNORECASE):
        fix = f"{found[0].name}{words[1].text[1:]} = {words[2].text}"
        return _of_all(line, f"{words[0].text} is a register of each drive", f"write {fix}", fix if line.reads(fix) else None)
    if key in DECLARATIONS:
        return _declaration(line)
    hint = INSTEAD.get(key)
    return None if hint is None else _over(line, (0, 0), f"WBC has no {key}", hint)


def _declaration(line: ForeignLine) -> Advice | None:
    if line.key == "LET" and line.reads(f"SET {line.text(1)}"):
        return _over(line, (0, 0), "WBC has no LET", "write SET, or leave it out", SET)
    if line.key == "CONST" and len(line.words) >= 3:
        value = line.text(3) if line.words[2].text == "=" and len(line.words) > 3 else line.text(2)
        fix = f"#{line.words[1].text} {value}"
        return _of_all(line, f"WBC has no {line.key}", f"write {fix}", fix if line.reads(fix) else None)
    return _over(line, (0, 0), "variables are not declared", "a variable comes into being when it is first set, and is a REAL")


def declared(words: Sequence[Lexeme]) -> Lexeme | None:
    """The name that a refused line would have given a value in another language."""
    known = words[0].text.upper() in DECLARATIONS | {"FOR"}
    return words[1] if known and len(words) > 1 and is_name(words[1].text) else None


def _waitpos(line: ForeignLine) -> Advice | None:
    if line.key != "WAITPOS" or len(line.words) < 2:
        return None
    names = [word.text for word in line.words[1:] if re.fullmatch(r"M[1-4]", word.text, re.IGNORECASE)]
    if not names:
        return None
    hint = f"write WAITPOS, or WAIT {names[0]} = 0 for this drive alone"
    return Advice(line.words[1].start, line.words[-1].end, "WAITPOS waits for all enabled drives", hint)


# ---------------------------------------------------------------------- conditions


def _condition(line: ForeignLine) -> Advice | None:
    words, key = line.words, line.key
    row = STATEMENTS.get(key)
    if row is None or len(words) < 2 or not row.operands or row.operands[0].kind is not OperandKind.CONDITION:
        return None
    if words[1].text == "(" and words[-1].text == ")":
        inside = line.text(2, -2)
        fix = inside if line.reads(f"{key} {inside}") else None
        return _over(line, (1, len(words) - 1), "a condition is written without parentheses", f"write {row.usage}", fix)
    for look in (_negation, _unequal, _connected, _calculated, _incomplete):
        advice = look(line)
        if advice is not None:
            return advice
    return None


def _negation(line: ForeignLine) -> Advice | None:
    words = line.words
    if words[1].text.upper() not in ("NOT", "!") or len(words) < 3:
        return None
    off = "OFF" if _is_bit(words[2].text) else "0"
    fix = f"{words[2].text} = {off}" if len(words) == 3 and off == "OFF" else None
    return Advice(words[1].start, words[-1].end, "WBC has no NOT", f"write {line.key} {words[2].text} = {off}", fix)


def _unequal(line: ForeignLine) -> Advice | None:
    words = line.words
    place = next((n for n, word in enumerate(words) if word.text in ("<>", "!=")), None)
    if place is None:
        return None
    message = "WBC has no 'not equal'"
    opposite = {"ON": "OFF", "OFF": "ON", "1": "0", "0": "1"}
    if place == 2 and len(words) == 4 and _is_bit(words[1].text) and words[3].text.upper() in opposite:
        fix = f"= {opposite[words[3].text.upper()]}"
        return _over(line, (place, 3), message, f"write {line.key} {words[1].text} {fix}", fix)
    hint = "compare with < or with >"
    if line.key == "IF":
        hint = "compare with =, and write the lines after ELSE; or compare with < or with >"
    return _over(line, (place, place), message, hint)


_AND = frozenset({"AND", "&&", "&"})
_CONNECTING = _AND | {"OR", "XOR", "||", "|"}


def _connected(line: ForeignLine) -> Advice | None:
    for number, word in enumerate(line.words):
        if word.text.upper() in _CONNECTING and number > 1:
            if word.text.upper() in _AND and line.key == "IF":
                hint = "write a second IF inside the first, with an ENDIF of its own"
            else:
                hint = "calculate it before with a SET: && is and, || is or"
            return _over(line, (number, number), f"{line.key} takes one comparison, {word.text} cannot join two", hint)
    return None


def _calculated(line: ForeignLine) -> Advice | None:
    """``IF a + 1 > 2``."""
    words = line.words
    sign = next((n for n, word in enumerate(words) if word.text in COMPARISONS), None)
    if sign is None or sign < 2 or sign == len(words) - 1:
        return None
    for first, last in ((1, sign - 1), (sign + 1, len(words) - 1)):
        if last - first >= 2 and any(word.kind == OPERATOR for word in words[first + 1 : last + 1]):
            side = line.text(first, last)
            hint = f"calculate before: SET x = {side}" if line.reads(f"SET x = {side}") else "calculate before, with SET"
            return _over(line, (first, last), "a condition compares two values and does not calculate", hint)
    return None


def _incomplete(line: ForeignLine) -> Advice | None:
    words, key = line.words, line.key
    if len(words) == 3 and words[1].kind == WORD and words[2].kind in (WORD, NUMBER):
        fix = f"{words[1].text} = {words[2].text}"
        return _over(line, (1, 2), "the comparison is missing", f"write {key} {fix}", fix) if line.reads(f"{key} {fix}") else None
    if len(words) != 2:
        return None
    value = words[1]
    if _is_bit(value.text):
        fix = f"{value.text} = ON"
        return _over(line, (1, 1), f"{key} lacks the comparison after {value.text}", f"write {key} {fix}", fix)
    if key == "WHILE" and value.text.upper() in ("1", "TRUE", "ON"):
        return _over(line, (1, 1), "WHILE lacks the comparison", "write WHILE 1 = 1 for a loop without end", "1 = 1")
    if key == "WAIT" and value.kind == NUMBER:
        return _over(line, (1, 1), "WAIT waits for a condition", "to wait a time, write DELAY with the time in seconds")
    return None


# ---------------------------------------------------------------------- numbers


_NUMBER = r"(?<![\w.,$])([0-9]{1,15}(?:[.,][0-9]{1,15})?)"
_WITH_UNIT = re.compile(rf"{_NUMBER}\s*({'|'.join(sorted(map(re.escape, UNITS), key=len, reverse=True))})(?![\w])")
_THOUSANDS = re.compile(r"(?<![\w.,])[0-9]{1,3}(?:([.,' ])[0-9]{3})(?:\1[0-9]{3})*(?:[.,][0-9]+)?(?![\w.,])")
_OTHER_BASE = re.compile(r"(?<!\w)(?:(?:0x|&H|16#)([0-9A-F]+)|(?:0b|2#)([01]+))(?!\w)", re.IGNORECASE)
_EXPONENT = re.compile(r"(?<![\w.,])[0-9]{1,15}(?:[.,][0-9]{1,15})?E[+-]?[0-9]{1,2}(?![\w.])", re.IGNORECASE)


def _unit(line: ForeignLine) -> Advice | None:
    match = _WITH_UNIT.search(line.code)
    if match is None:
        return None
    number, unit = float(match[1].replace(",", ".")), match[2]
    start, end = line.start + match.start(1), line.start + match.end()
    if line.key in ("DELAY", "PULSE"):
        factor = TIME_UNITS.get(unit)
        fix = None if factor is None else match[1] if factor == 1 else number_text(float(f"{number * factor:.10g}"))
        return Advice(start, end, "numbers have no unit", f"{line.key} is in seconds", fix)
    fix = None if unit in TIME_UNITS and unit != "s" else match[1]
    return Advice(
        start, end, "numbers have no unit", "positions are in the unit of the axis, velocities in that unit per second", fix
    )


def _notation(line: ForeignLine) -> Advice | None:
    if match := _OTHER_BASE.search(line.code):
        value = int(match[1], 16) if match[1] else int(match[2], 2)
        return _number(line, match, "numbers are decimal", str(value))
    if match := _EXPONENT.search(line.code):
        value = float(match[0].replace(",", "."))
        return _number(line, match, "numbers have no exponent", number_text(value))
    if match := _THOUSANDS.search(line.code):
        return _number(line, match, "numbers have no thousands separator", match[0].replace(match[1], ""))
    return None


def _number(line: ForeignLine, match: re.Match[str], message: str, fix: str) -> Advice | None:
    changed = line.code[: match.start()] + fix + line.code[match.end() :]
    place = line.start + match.start(), line.start + match.end()
    return Advice(*place, message, f"write {fix}", fix if line.reads(changed) else None)


# ---------------------------------------------------------------------- registers, arguments, assignments


_SPLIT = re.compile(r"(?<![\w$])(\$?[A-Za-z_]+)(?:\s*\[\s*([0-9]+)\s*\]|\s*\(\s*([0-9]+)\s*\)|\s+([0-9]+))(?![\w.,])")


def _register(line: ForeignLine) -> Advice | None:
    """``OUT 1``, ``OUT[1]``, ``$I 5``."""
    found = [match for match in _SPLIT.finditer(line.code) if _is_family(match[1])]
    for match in found:
        fix = _joined(match)
        if line.reads(line.code[: match.start()] + fix + line.code[match.end() :]):
            place = line.start + match.start(), line.start + match.end()
            return Advice(*place, f"the number of a register belongs to its name: {fix}", f"write {fix}", fix)
    changed = _SPLIT.sub(lambda match: _joined(match) if _is_family(match[1]) else match[0], line.code).strip()
    if len(found) > 1 and line.reads(changed):
        return _of_all(line, "the number of a register belongs to its name", f"write {changed}", changed)
    return None


def _is_family(name: str) -> bool:
    row = ROWS.get(name.upper())
    return row is not None and bool(row.last or row.words)


def _joined(match: re.Match[str]) -> str:
    return match[1] + (match[2] or match[3] or match[4])


def _arguments(line: ForeignLine) -> Advice | None:
    """Parentheses, commas and signs around the arguments of a statement, and drives by number."""
    row, words = STATEMENTS.get(line.key), line.words
    if row is None or len(words) < 2:
        return None
    inside = line.text(1).strip()
    if not row.in_parentheses and inside.startswith("(") and inside.endswith(")"):
        fix = " ".join(inside[1:-1].replace(",", " ").split())
        if line.reads(f"{line.key} {fix}"):
            return _over(line, (1, len(words) - 1), "arguments are written without parentheses", f"write {row.usage}", fix)
    for number, word in enumerate(words):
        if number and word.text in (",", "="):
            changed = f"{line.text(0, number - 1)} {line.text(number + 1)}" if number + 1 < len(words) else ""
            if changed and line.reads(changed):
                message = "arguments are separated by blanks" if word.text == "," else f"{line.key} is written without ="
                return _over(line, (number, number), message, f"write {row.usage}", "")
    if row.operands and row.operands[0].kind is OperandKind.AXIS and words[1].kind == NUMBER and words[1].text in "1234":
        fix = f"M{words[1].text}"
        if line.reads(f"{line.key} {fix} {line.text(2) if len(words) > 2 else ''}"):
            return _over(line, (1, 1), f"drives are named M1…M4, not {words[1].text}", f"write {row.usage}", fix)
    return None


def _assignment(line: ForeignLine) -> Advice | None:
    words = line.words[1:] if line.key == SET else line.words
    first = len(line.words) - len(words)
    if len(words) < 2 or words[0].kind != WORD:
        return _set_alone(line, words)
    name, sign = words[0].text, words[1].text
    if sign in ("+", "-") and len(words) == 3 and words[2].text == sign:
        return _counted(line, first, f"{name} = {name} {sign} 1", f"there is no {sign}{sign}")
    if words[1].kind == OPERATOR and len(words) > 3 and words[2].text == "=":
        return _counted(line, first, f"{name} = {name} {sign} {line.text(first + 3)}", f"there is no {sign}=")
    if sign != "=" or len(words) < 4:
        return None
    if words[2].text == "(" and words[-1].text == ")":
        fix = line.text(first + 3, len(line.words) - 2)
        if line.reads(f"{name} = {fix}"):
            place = first + 2, len(line.words) - 1
            return _over(line, place, "a value is written without parentheses", f"write {name} = {fix}", fix)
    if any(word.text in "()" for word in words[2:]) and words[3].text != "(":
        hint = "a SET calculates one operation, without parentheses; give the rest to further SETs"
        return Advice(words[2].start, words[-1].end, "a value has no parentheses", hint)
    operator = words[3].text.upper()
    if operator in OPERATOR_WORDS and len(words) == 5:
        meant, hint = OPERATOR_WORDS[operator]
        return _over(line, (first + 3, first + 3), f"WBC has no {operator}", hint, meant)
    return None


def _set_alone(line: ForeignLine, words: Sequence[Lexeme]) -> Advice | None:
    if line.key == SET and len(words) == 1 and parts(words[0].text.upper()) and _is_bit(words[0].text):
        fix = f"{words[0].text} = ON"
        return _over(line, (1, 1), f"= is missing after {words[0].text}", f"write SET {fix}", fix if line.reads(fix) else None)
    return None


def _counted(line: ForeignLine, first: int, fix: str, message: str) -> Advice | None:
    return _over(line, (first, len(line.words) - 1), message, f"write {fix}", fix if line.reads(fix) else None)


_LOOKS: tuple[Callable[[ForeignLine], Advice | None], ...] = (
    _comment,
    _blocks,
    _label,
    _notation,
    _unit,
    _register,
    _condition,
    _waitpos,
    _arguments,
    _assignment,
    _instead,
    _colon,
)
