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
from steptwin.messages import Message, MessageText
from steptwin.wbc import findings as f
from steptwin.wbc.foreign_words import DECLARATIONS, ELSE_IF, INSTEAD, OPERATOR_WORDS, TIME_UNITS, UNITS
from steptwin.wbc.lexer import NUMBER, OPERATOR, WORD, Lexeme, is_name
from steptwin.wbc.positions import number_text
from steptwin.wbc.registers import BIT, ROWS, parts
from steptwin.wbc.statements import COMPARISONS, SET, STATEMENTS, OperandKind

_SLASHES = Message("wbc.comments-begin-with", "comments begin with //")()
WRITE_WAITPOS_OR_WAIT = Message("wbc.write-waitpos-or-wait", "write WAITPOS, or WAIT {axis} = 0 for this drive alone")
NO_NOT_EQUAL = Message("wbc.no-not-equal", "WBC has no 'not equal'")
COMPARE_LESS_OR_GREATER = Message("wbc.compare-less-or-greater", "compare with < or with >")
WRITE_SLASHES = Message("wbc.write-slashes", "write // in front of every line of the comment")
WRITE_ELSE_AND_IF = Message("wbc.write-else-and-if", "write ELSE, the IF on the next line, and an ENDIF for each of the two")
VARIABLES_ARE_NOT_DECLARED = Message("wbc.variables-are-not-declared", "variables are not declared")
VARIABLE_IS_REAL = Message("wbc.variable-is-real", "a variable comes into being when it is first set, and is a REAL")
WAITPOS_WAITS_FOR_ALL = Message("wbc.waitpos-waits-for-all", "WAITPOS waits for all enabled drives")
COMPARE_EQUAL = Message("wbc.compare-equal", "compare with =, and write the lines after ELSE; or compare with < or with >")
NO_UNIT = Message("wbc.no-unit", "numbers have no unit")
UNITS_OF_POSITIONS = Message(
    "wbc.units-of-positions", "positions are in the unit of the axis, velocities in that unit per second"
)
SET_WITHOUT_PARENTHESES = Message(
    "wbc.set-without-parentheses", "a SET calculates one operation, without parentheses; give the rest to further SETs"
)
NO_SEMICOLON = Message("wbc.no-semicolon", "no ; at the end of a line")
STATEMENT_ENDS_WITH_ITS_LINE = Message("wbc.statement-ends-with-its-line", "a statement ends with its line")
ONE_STATEMENT_PER_LINE = Message("wbc.one-statement-per-line", "only one statement per line is permitted")
PUT_SECOND_ON_NEXT_LINE = Message("wbc.put-second-on-next-line", "put the second one on the next line")
NAMES_A_NUMBER = Message("wbc.names-a-number", "#name value names a number or a register")
ELSE_AND_IF = Message("wbc.else-and-if", "ELSE and IF are two lines in WBC")
ONE_WORD = Message("wbc.one-word", "END{second} is one word")
END_ALONE = Message("wbc.end-alone", "END alone ends the program, write END{second}")
IS_A_LABEL = Message("wbc.is-a-label", "{name} is a label")
LABEL_HAS_A_COLON = Message("wbc.label-has-a-colon", "a label is written with a ':'")
REGISTER_OF_EACH_DRIVE = Message("wbc.register-of-each-drive", "{text} is a register of each drive")
WRITE_SET_OR_LEAVE_IT_OUT = Message("wbc.write-set-or-leave-it-out", "write SET, or leave it out")
CONDITION_WITHOUT_PARENTHESES = Message("wbc.condition-without-parentheses", "a condition is written without parentheses")
WHILE_LACKS_THE_COMPARISON = Message("wbc.while-lacks-the-comparison", "WHILE lacks the comparison")
WRITE_ENDLESS_WHILE = Message("wbc.write-endless-while", "write WHILE 1 = 1 for a loop without end")
WAIT_WAITS_FOR_A_CONDITION = Message("wbc.wait-waits-for-a-condition", "WAIT waits for a condition")
WRITE_DELAY = Message("wbc.write-delay", "to wait a time, write DELAY with the time in seconds")
IS_IN_SECONDS = Message("wbc.is-in-seconds", "{keyword} is in seconds")
NUMBERS_ARE_DECIMAL = Message("wbc.numbers-are-decimal", "numbers are decimal")
NO_EXPONENT = Message("wbc.no-exponent", "numbers have no exponent")
NO_SEPARATOR = Message("wbc.no-separator", "numbers have no thousands separator")
NUMBERS_BELONG_TO_NAMES = Message("wbc.numbers-belong-to-names", "the number of a register belongs to its name")
VALUE_HAS_NO_PARENTHESES = Message("wbc.value-has-no-parentheses", "a value has no parentheses")
NO_TEXT_AFTER_CONDITION = Message("wbc.no-text-after-condition", "no text is permitted after the condition of {keyword}")
LINES_FOLLOW_BELOW = Message("wbc.lines-follow-below", "the lines of the {keyword} follow below it, up to END{keyword}")
WRITE_A_SECOND_IF = Message("wbc.write-a-second-if", "write a second IF inside the first, with an ENDIF of its own")
CALCULATE_AND_OR = Message("wbc.calculate-and-or", "calculate it before with a SET: && is and, || is or")
TAKES_ONE_COMPARISON = Message("wbc.takes-one-comparison", "{keyword} takes one comparison, {text} cannot join two")
CALCULATE_BEFORE = Message("wbc.calculate-before", "calculate before: {text}")
CALCULATE_BEFORE_WITH_SET = Message("wbc.calculate-before-with-set", "calculate before, with SET")
CONDITION_COMPARES_TWO_VALUES = Message(
    "wbc.condition-compares-two-values", "a condition compares two values and does not calculate"
)
COMPARISON_IS_MISSING = Message("wbc.comparison-is-missing", "the comparison is missing")
NUMBER_BELONGS_TO_NAME = Message("wbc.number-belongs-to-name", "the number of a register belongs to its name: {fix}")
ARGUMENTS_WITHOUT_PARENTHESES = Message("wbc.arguments-without-parentheses", "arguments are written without parentheses")
DRIVES_ARE_NAMED = Message("wbc.drives-are-named", "drives are named M1…M4, not {text}")
VALUE_WITHOUT_PARENTHESES = Message("wbc.value-without-parentheses", "a value is written without parentheses")
WRITTEN_WITHOUT_EQUALS = Message("wbc.written-without-equals", "{keyword} is written without =")
WRITTEN_WITHOUT_THEN = Message("wbc.written-without-then", "{keyword} is written without {then}")


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
    message: MessageText
    hint: MessageText | None = None
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


def _over(
    line: ForeignLine, span: tuple[int, int], message: MessageText, hint: MessageText | None = None, fix: str | None = None
) -> Advice:
    """Advice about the words from the first to the second number in ``span``."""
    return Advice(line.words[span[0]].start, line.words[span[1]].end, message, hint, fix)


def _of_all(
    line: ForeignLine, message: MessageText, hint: MessageText, fix: str | None = None, keyword: str | None = None
) -> Advice:
    return Advice(line.words[0].start, line.words[-1].end, message, hint, fix, keyword)


def _is_bit(text: str) -> bool:
    found = parts(text.upper())
    return found is not None and found[0].reads == BIT


# ---------------------------------------------------------------------- comments and several statements


_COMMENT = re.compile(r"/\*|\(\*|;|(?:^|(?<=\s))'|^\s*(?:REM\b|/)", re.IGNORECASE)


def _comment(line: ForeignLine) -> Advice | None:
    match = _COMMENT.search(line.code)
    if match is None:
        return _hash(line)
    sign = match[0].strip()
    start, end = line.start + match.end() - len(sign), line.start + match.end()
    before, after = line.code[: match.start()].strip(), line.code[match.end() :].strip()
    if sign == ";" and not after:
        return Advice(start, end, NO_SEMICOLON(), STATEMENT_ENDS_WITH_ITS_LINE(), "")
    if sign == ";" and before and line.reads(after):
        return Advice(start, end, ONE_STATEMENT_PER_LINE(), PUT_SECOND_ON_NEXT_LINE(), "\n")
    closing = {"/*": "*/", "(*": "*)"}.get(sign)
    if closing is None:
        return Advice(start, end, _SLASHES, None, "//")
    if after.endswith(closing):
        return Advice(start, line.words[-1].end, _SLASHES, None, f"// {after[: -len(closing)].strip()}")
    return Advice(start, line.words[-1].end, _SLASHES, WRITE_SLASHES())


def _hash(line: ForeignLine) -> Advice | None:
    words = line.words
    if words[0].text == "#" and len(words) > 3 and all(word.kind == WORD for word in words[1:]):
        return _over(line, (0, 0), _SLASHES, NAMES_A_NUMBER(), "//")
    return None


def _colon(line: ForeignLine) -> Advice | None:
    """``M1 = ON : M2 = ON``."""
    for number, word in enumerate(line.words[1:-1], 1):
        if word.text == ":" and line.reads(line.text(0, number - 1)) and line.reads(line.text(number + 1)):
            return _over(line, (number, number), ONE_STATEMENT_PER_LINE(), PUT_SECOND_ON_NEXT_LINE(), "\n")
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
        hint = WRITE_ELSE_AND_IF()
        return _of_all(line, ELSE_AND_IF(), hint, keyword=IF_UNKNOWN)
    if key == "END" and second in ("IF", "WHILE") and len(words) == 2:
        return _of_all(line, ONE_WORD(second=second), END_ALONE(second=second), f"END{second}", f"END{second}")
    if key in ("IF", "WHILE"):
        then = "THEN" if key == "IF" else "DO"
        for number, word in enumerate(words):
            if word.text.upper() == then:
                if number == len(words) - 1:
                    return _over(line, (number, number), WRITTEN_WITHOUT_THEN(keyword=key, then=then), None, "")
                message = NO_TEXT_AFTER_CONDITION(keyword=key)
                hint = LINES_FOLLOW_BELOW(keyword=key)
                return Advice(word.start, words[-1].end, message, hint, keyword=IF_UNKNOWN if key == "IF" else None)
    return None


def _label(line: ForeignLine) -> Advice | None:
    words = line.words
    name = words[-1]
    if (len(words) == 1 or (len(words) == 2 and line.key in ("SUB", "FUNCTION"))) and (
        name.text.upper() in line.jumps() and line.reads(f"{name.text}:")
    ):
        return _of_all(line, IS_A_LABEL(name=name.text), LABEL_HAS_A_COLON(), f"{name.text}:", keyword=LABEL)
    return None


def _instead(line: ForeignLine) -> Advice | None:
    """A first word that WBC does not have."""
    words, key = line.words, line.key
    if key in STATEMENTS or key == SET or (len(words) > 1 and words[1].text in ("=", ":")):
        return None
    found = parts(f"{key}M1") or parts(f"{key}1")
    if found is not None and len(words) == 3 and re.fullmatch(r"M[1-4]", words[1].text, re.IGNORECASE):
        fix = f"{found[0].name}{words[1].text[1:]} = {words[2].text}"
        return _of_all(line, REGISTER_OF_EACH_DRIVE(text=words[0].text), f.WRITE(text=fix), fix if line.reads(fix) else None)
    if key in DECLARATIONS:
        return _declaration(line)
    hint = INSTEAD.get(key)
    return None if hint is None else _over(line, (0, 0), f.WBC_HAS_NO(word=key), hint)


def _declaration(line: ForeignLine) -> Advice | None:
    if line.key == "LET" and line.reads(f"SET {line.text(1)}"):
        return _over(line, (0, 0), f.WBC_HAS_NO(word="LET"), WRITE_SET_OR_LEAVE_IT_OUT(), SET)
    if line.key == "CONST" and len(line.words) >= 3:
        value = line.text(3) if line.words[2].text == "=" and len(line.words) > 3 else line.text(2)
        fix = f"#{line.words[1].text} {value}"
        return _of_all(line, f.WBC_HAS_NO(word=line.key), f.WRITE(text=fix), fix if line.reads(fix) else None)
    return _over(line, (0, 0), VARIABLES_ARE_NOT_DECLARED(), VARIABLE_IS_REAL())


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
    hint = WRITE_WAITPOS_OR_WAIT(axis=names[0])
    return Advice(line.words[1].start, line.words[-1].end, WAITPOS_WAITS_FOR_ALL(), hint)


# ---------------------------------------------------------------------- conditions


def _condition(line: ForeignLine) -> Advice | None:
    words, key = line.words, line.key
    row = STATEMENTS.get(key)
    if row is None or len(words) < 2 or not row.operands or row.operands[0].kind is not OperandKind.CONDITION:
        return None
    if words[1].text == "(" and words[-1].text == ")":
        inside = line.text(2, -2)
        fix = inside if line.reads(f"{key} {inside}") else None
        return _over(line, (1, len(words) - 1), CONDITION_WITHOUT_PARENTHESES(), f.WRITE(text=row.usage), fix)
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
    return Advice(
        words[1].start, words[-1].end, f.WBC_HAS_NO(word="NOT"), f.WRITE(text=f"{line.key} {words[2].text} = {off}"), fix
    )


def _unequal(line: ForeignLine) -> Advice | None:
    words = line.words
    place = next((n for n, word in enumerate(words) if word.text in ("<>", "!=")), None)
    if place is None:
        return None
    message = NO_NOT_EQUAL()
    opposite = {"ON": "OFF", "OFF": "ON", "1": "0", "0": "1"}
    if place == 2 and len(words) == 4 and _is_bit(words[1].text) and words[3].text.upper() in opposite:
        fix = f"= {opposite[words[3].text.upper()]}"
        return _over(line, (place, 3), message, f.WRITE(text=f"{line.key} {words[1].text} {fix}"), fix)
    hint = COMPARE_LESS_OR_GREATER()
    if line.key == "IF":
        hint = COMPARE_EQUAL()
    return _over(line, (place, place), message, hint)


_AND = frozenset({"AND", "&&", "&"})
_CONNECTING = _AND | {"OR", "XOR", "||", "|"}


def _connected(line: ForeignLine) -> Advice | None:
    for number, word in enumerate(line.words):
        if word.text.upper() in _CONNECTING and number > 1:
            hint = WRITE_A_SECOND_IF() if word.text.upper() in _AND and line.key == "IF" else CALCULATE_AND_OR()
            return _over(line, (number, number), TAKES_ONE_COMPARISON(keyword=line.key, text=word.text), hint)
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
            hint = CALCULATE_BEFORE(text=f"SET x = {side}") if line.reads(f"SET x = {side}") else CALCULATE_BEFORE_WITH_SET()
            return _over(line, (first, last), CONDITION_COMPARES_TWO_VALUES(), hint)
    return None


def _incomplete(line: ForeignLine) -> Advice | None:
    words, key = line.words, line.key
    if len(words) == 3 and words[1].kind == WORD and words[2].kind in (WORD, NUMBER):
        fix = f"{words[1].text} = {words[2].text}"
        return (
            _over(line, (1, 2), COMPARISON_IS_MISSING(), f.WRITE(text=f"{key} {fix}"), fix)
            if line.reads(f"{key} {fix}")
            else None
        )
    if len(words) != 2:
        return None
    value = words[1]
    if _is_bit(value.text):
        fix = f"{value.text} = ON"
        return _over(line, (1, 1), f.LACKS_COMPARISON_AFTER(keyword=key, text=value.text), f.WRITE(text=f"{key} {fix}"), fix)
    if key == "WHILE" and value.text.upper() in ("1", "TRUE", "ON"):
        return _over(line, (1, 1), WHILE_LACKS_THE_COMPARISON(), WRITE_ENDLESS_WHILE(), "1 = 1")
    if key == "WAIT" and value.kind == NUMBER:
        return _over(line, (1, 1), WAIT_WAITS_FOR_A_CONDITION(), WRITE_DELAY())
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
        return Advice(start, end, NO_UNIT(), IS_IN_SECONDS(keyword=line.key), fix)
    fix = None if unit in TIME_UNITS and unit != "s" else match[1]
    return Advice(start, end, NO_UNIT(), UNITS_OF_POSITIONS(), fix)


def _notation(line: ForeignLine) -> Advice | None:
    if match := _OTHER_BASE.search(line.code):
        value = int(match[1], 16) if match[1] else int(match[2], 2)
        return _number(line, match, NUMBERS_ARE_DECIMAL(), str(value))
    if match := _EXPONENT.search(line.code):
        value = float(match[0].replace(",", "."))
        return _number(line, match, NO_EXPONENT(), number_text(value))
    if match := _THOUSANDS.search(line.code):
        return _number(line, match, NO_SEPARATOR(), match[0].replace(match[1], ""))
    return None


def _number(line: ForeignLine, match: re.Match[str], message: MessageText, fix: str) -> Advice | None:
    changed = line.code[: match.start()] + fix + line.code[match.end() :]
    place = line.start + match.start(), line.start + match.end()
    return Advice(*place, message, f.WRITE(text=fix), fix if line.reads(changed) else None)


# ---------------------------------------------------------------------- registers, arguments, assignments


_SPLIT = re.compile(r"(?<![\w$])(\$?[A-Za-z_]+)(?:\s*\[\s*([0-9]+)\s*\]|\s*\(\s*([0-9]+)\s*\)|\s+([0-9]+))(?![\w.,])")


def _register(line: ForeignLine) -> Advice | None:
    """``OUT 1``, ``OUT[1]``, ``$I 5``."""
    found = [match for match in _SPLIT.finditer(line.code) if _is_family(match[1])]
    for match in found:
        fix = _joined(match)
        if line.reads(line.code[: match.start()] + fix + line.code[match.end() :]):
            place = line.start + match.start(), line.start + match.end()
            return Advice(*place, NUMBER_BELONGS_TO_NAME(fix=fix), f.WRITE(text=fix), fix)
    changed = _SPLIT.sub(lambda match: _joined(match) if _is_family(match[1]) else match[0], line.code).strip()
    if len(found) > 1 and line.reads(changed):
        return _of_all(line, NUMBERS_BELONG_TO_NAMES(), f.WRITE(text=changed), changed)
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
            return _over(line, (1, len(words) - 1), ARGUMENTS_WITHOUT_PARENTHESES(), f.WRITE(text=row.usage), fix)
    for number, word in enumerate(words):
        if number and word.text in (",", "="):
            changed = f"{line.text(0, number - 1)} {line.text(number + 1)}" if number + 1 < len(words) else ""
            if changed and line.reads(changed):
                message = f.ARGUMENTS_ARE_SEPARATED_BY_BLANKS() if word.text == "," else WRITTEN_WITHOUT_EQUALS(keyword=line.key)
                return _over(line, (number, number), message, f.WRITE(text=row.usage), "")
    if row.operands and row.operands[0].kind is OperandKind.AXIS and words[1].kind == NUMBER and words[1].text in "1234":
        fix = f"M{words[1].text}"
        if line.reads(f"{line.key} {fix} {line.text(2) if len(words) > 2 else ''}"):
            return _over(line, (1, 1), DRIVES_ARE_NAMED(text=words[1].text), f.WRITE(text=row.usage), fix)
    return None


def _assignment(line: ForeignLine) -> Advice | None:
    words = line.words[1:] if line.key == SET else line.words
    first = len(line.words) - len(words)
    if len(words) < 2 or words[0].kind != WORD:
        return _set_alone(line, words)
    name, sign = words[0].text, words[1].text
    if sign in ("+", "-") and len(words) == 3 and words[2].text == sign:
        return _counted(line, first, f"{name} = {name} {sign} 1", f.THERE_IS_NO(name=f"{sign}{sign}"))
    if words[1].kind == OPERATOR and len(words) > 3 and words[2].text == "=":
        return _counted(line, first, f"{name} = {name} {sign} {line.text(first + 3)}", f.THERE_IS_NO(name=f"{sign}="))
    if sign != "=" or len(words) < 4:
        return None
    if words[2].text == "(" and words[-1].text == ")":
        fix = line.text(first + 3, len(line.words) - 2)
        if line.reads(f"{name} = {fix}"):
            place = first + 2, len(line.words) - 1
            return _over(line, place, VALUE_WITHOUT_PARENTHESES(), f.WRITE(text=f"{name} = {fix}"), fix)
    if any(word.text in "()" for word in words[2:]) and words[3].text != "(":
        hint = SET_WITHOUT_PARENTHESES()
        return Advice(words[2].start, words[-1].end, VALUE_HAS_NO_PARENTHESES(), hint)
    operator = words[3].text.upper()
    if operator in OPERATOR_WORDS and len(words) == 5:
        meant, hint = OPERATOR_WORDS[operator]
        return _over(line, (first + 3, first + 3), f.WBC_HAS_NO(word=operator), hint, meant)
    return None


def _set_alone(line: ForeignLine, words: Sequence[Lexeme]) -> Advice | None:
    if line.key == SET and len(words) == 1 and parts(words[0].text.upper()) and _is_bit(words[0].text):
        fix = f"{words[0].text} = ON"
        return _over(
            line, (1, 1), f.IS_MISSING_AFTER(text=words[0].text), f.WRITE(text=f"SET {fix}"), fix if line.reads(fix) else None
        )
    return None


def _counted(line: ForeignLine, first: int, fix: str, message: MessageText) -> Advice | None:
    return _over(line, (first, len(line.words) - 1), message, f.WRITE(text=fix), fix if line.reads(fix) else None)


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
