"""Parses one statement from the tokens of its line, and reports its errors.

Relations between lines (names, blocks, labels) are not checked here.
"""

from __future__ import annotations

import re

from steptwin.diagnostics import Diagnostic, Fix, Span
from steptwin.nearmiss import NearMiss
from steptwin.wbc import findings as f
from steptwin.wbc.findings import ProgramFinding
from steptwin.wbc.foreign_words import DECLARATIONS, ELSE_IF, INSTEAD, STATEMENTS_ELSEWHERE
from steptwin.wbc.lexer import COMPARISON, NUMBER, OPERATOR, STRANGE, WORD, WRONG_NUMBER, Lexeme, is_name, plain_name
from steptwin.wbc.registers import parts
from steptwin.wbc.statements import (
    COMPARISONS,
    FUNCTIONS,
    HALTS,
    KEYWORDS,
    MOTIONS,
    NOT_SUPPORTED,
    OPERATORS,
    SET,
    SET_USAGE,
    STATEMENTS,
    OperandKind,
    StatementRow,
)
from steptwin.wbc.statements import Operand as Wanted
from steptwin.wbc.tree import (
    Assign,
    Binary,
    ConstantDefinition,
    DecimalNumber,
    ExpressionNode,
    FunctionCall,
    Identifier,
    KeywordStatement,
    Label,
    OperandNode,
    Position,
    Relation,
    StatementNode,
    ValueNode,
)

_USER_REGISTER = re.compile(r"\$[IDR][0-9]+$", re.IGNORECASE | re.ASCII)
_MEANT = {"==": "=", ":=": "=", "=<": "<=", "=>": ">="}
_EQUALS_ELSEWHERE = ("==", ":=")
_BLOCK_WORDS = frozenset({"ELSE", "ENDIF", "ENDWHILE"})


class Rejected(Exception):
    def __init__(self, diagnostic: Diagnostic) -> None:
        self.diagnostic = diagnostic


class StatementReader:
    """Reads one statement from the tokens of a line."""

    __slots__ = ("_at", "_diagnostics", "_last", "_near", "_tokens", "keyword", "target")

    def __init__(self, words: list[Lexeme], near: NearMiss, diagnostics: list[Diagnostic]) -> None:
        self._tokens = words
        self._last = len(words)
        self._at = 0
        self._near = near
        self._diagnostics = diagnostics
        self.keyword: str | None = None
        self.target: Identifier | None = None

    # -- statements

    def statement(self) -> StatementNode:
        words = self._tokens
        first = words[0]
        second = words[1] if self._last > 1 else None
        if first.kind == WORD:
            if second and second.text == ":":
                return self._label(first)
            key = first.text.upper()
            if key in STATEMENTS:
                self.keyword = key
                if second and second.kind == COMPARISON:
                    raise Rejected(_reserved_target(first))
                self._at = 1
                return self._command(STATEMENTS[key])
            if key == SET:
                self.keyword = key
                self._at = 1
                return self._assign(first.start, True)
            if second and second.text == "=":
                return self._assign(first.start, False)
            raise self._unknown(first, second)
        if first.text == "#":
            return self._constant()
        if (second and second.text == ":") or first.text == ":":
            raise self._bad_label(first)
        raise Rejected(f.UNKNOWN_STATEMENT.at(first, f"{first.text!r} does not begin a statement"))

    def _command(self, row: StatementRow) -> KeywordStatement:
        start = self._tokens[0].start
        usage = f"write {row.usage}"
        if row.in_parentheses:
            self._mark("(", usage)
        operands: list[OperandNode] = []
        for number, operand in enumerate(row.operands):
            if number and row.in_parentheses:
                self._mark(",", usage)
            operands.append(self._operand(row, operand))
        if row.in_parentheses:
            self._mark(")", usage)
        if self._at < self._last:
            raise self._rest(row)
        return KeywordStatement(start, self._tokens[-1].end, row.keyword, tuple(operands))

    def _rest(self, row: StatementRow) -> Rejected:
        """The error of tokens after a complete statement."""
        token = self._tokens[self._at]
        rest = self._place_of_rest()
        usage = f"write {row.usage}"
        if row.operands and row.operands[0].kind is OperandKind.CONDITION:
            if token.kind == OPERATOR:
                return Rejected(f.TRAILING.at(rest, f"a condition has no {token.text}", "calculate before, in a SET"))
            return Rejected(f.TRAILING.at(rest, f"nothing may follow the condition of {row.keyword}", usage))
        if row.operands and token.kind in (WORD, NUMBER):
            count = "one argument" if len(row.operands) == 1 else f"{len(row.operands)} arguments"
            return Rejected(f.TOO_MANY.at(rest, f"{row.keyword} takes {count}", usage))
        if token.text == ":" and row.keyword == "JUMP":
            return Rejected(f.TRAILING.at(rest, "the label of a JUMP is written without ':'", usage, fix=""))
        return Rejected(f.TRAILING.at(rest, f"nothing may follow {row.keyword} here", usage))

    def _assign(self, start: int, has_set: bool) -> Assign:
        target = self._target()
        self.target = target
        equals = self._take()
        if equals is None or equals.kind != COMPARISON:
            compound = equals is not None and self._at < self._last and self._tokens[self._at].text == "="
            if compound and equals is not None:
                raise Rejected(_compound(target.text, equals, self._tokens[self._at]))
            place = equals or self._end()
            fix = f.before(place, "= ") if equals is not None and equals.kind in (WORD, NUMBER) else None
            raise Rejected(f.MISSING_EQUALS.at(place, f"= is missing after {target.text}", f"write {SET_USAGE}", fix))
        if equals.text != "=":
            fix = "=" if equals.text in _EQUALS_ELSEWHERE else None
            raise Rejected(f.WRONG_OPERATOR.at(equals, f"an assignment is written with =, not {equals.text}", fix=fix))
        value = self._expression()
        if self._at < self._last:
            rest = self._place_of_rest()
            if self._tokens[self._at].kind == OPERATOR:
                hint = "a SET calculates one operation; give the rest to a second SET"
            else:
                hint = f"write {SET_USAGE}"
            raise Rejected(f.TRAILING.at(rest, "nothing may follow the value here", hint))
        return Assign(start, self._tokens[-1].end, has_set, target, value)

    def _target(self) -> Identifier:
        token = self._take()
        if token is None:
            raise Rejected(f.MISSING_VALUE.at(self._end(), "SET lacks the name to set", f"write {SET_USAGE}"))
        if token.kind in (NUMBER, WRONG_NUMBER):
            raise Rejected(f.WRONG_ARGUMENT.at(token, f"{token.text} is a number and cannot be set", f"write {SET_USAGE}"))
        if token.kind != WORD:
            raise Rejected(f.WRONG_ARGUMENT.at(token, f"{token.text!r} cannot be set", f"write {SET_USAGE}"))
        if token.text.upper() in KEYWORDS:
            raise Rejected(_reserved_target(token))
        return self._name(token)

    def _constant(self) -> ConstantDefinition:
        usage = "write #name value, like #speed 60 or #pump OUT3"
        start = self._tokens[0].start
        self._at = 1
        token = self._take()
        if token is None or token.kind != WORD:
            raise Rejected(f.BAD_CONSTANT.at(token or self._end(), "a constant lacks its name", usage))
        name = self._name(token)
        self.target = name
        following = self._tokens[self._at] if self._at < self._last else None
        if following and following.text == "=":
            raise Rejected(f.BAD_CONSTANT.at(following, "a constant is written without =", usage, fix=""))
        value = self._value(f.BAD_CONSTANT, f.BAD_CONSTANT, f"the constant {name.text}", usage)
        if self._at < self._last:
            raise Rejected(f.TRAILING.at(self._place_of_rest(), "nothing may follow the value of a constant", usage))
        return ConstantDefinition(start, self._tokens[-1].end, name, value)

    def _label(self, first: Lexeme) -> Label:
        key = first.text.upper()
        if key in _BLOCK_WORDS:
            self.keyword = key
            raise Rejected(f.TRAILING.at(self._tokens[1], f"{key} is written without ':'", fix=""))
        if not is_name(first.text):
            raise self._bad_label(first)
        if self._last > 2:
            self._at = 2
            rest = self._place_of_rest()
            raise Rejected(
                f.TRAILING.at(rest, "a label must be on a line of its own", "put this on the next line", f.before(rest, "\n"))
            )
        return Label(first.start, self._tokens[-1].end, Identifier(first.start, first.end, first.text, key))

    def _bad_label(self, first: Lexeme) -> Rejected:
        hint = "a label is a name of letters, digits and _ and a ':', like MAIN:"
        if first.text == ":":
            return Rejected(f.BAD_LABEL.at(first, "the name of the label is missing before ':'", hint))
        if first.kind == NUMBER:
            return Rejected(f.NUMERIC_LABEL.at(first, f"{first.text} is a number, not a label", hint, _label_of(first)))
        return Rejected(f.BAD_LABEL.at(first, f"{first.text!r} cannot be a label", hint, plain_name(first.text)))

    def _unknown(self, first: Lexeme, second: Lexeme | None) -> Rejected:
        """A first word that is neither a statement nor followed by =."""
        key = first.text.upper()
        if key in NOT_SUPPORTED:
            hint = "later firmware has it, but its syntax is not documented; use IF or JUMP"
            return Rejected(f.NOT_SUPPORTED.at(first, f"{key} is not supported", hint))
        if second is not None and second.kind == COMPARISON:
            fix = "=" if second.text in _EQUALS_ELSEWHERE else None
            return Rejected(f.WRONG_OPERATOR.at(second, f"an assignment is written with =, not {second.text}", fix=fix))
        if self._tokens[-1].text == ":":
            joined = "_".join(token.text for token in self._tokens[:-1])
            fix = f"{joined}:" if is_name(joined) else None
            return Rejected(f.BAD_LABEL.at(self._place_of_all(), "a label is one word", "write it like MY_LABEL:", fix))
        if parts(key) is not None and second is not None:
            hint = f"write {first.text} = {second.text}"
            return Rejected(f.MISSING_EQUALS.at(first, f"= is missing after {first.text}", hint, fix=f"{first.text} ="))
        if self._last > 2 and second is not None and second.kind == OPERATOR and self._tokens[2].text == "=":
            return Rejected(_compound(first.text, second, self._tokens[2]))
        meant = STATEMENTS_ELSEWHERE.get(key)
        if meant is None and key not in INSTEAD and key not in ELSE_IF:
            meant = self._near.of(first.text, (SET, *STATEMENTS))
        if meant is not None:
            self.keyword = meant
            return Rejected(f.UNKNOWN_STATEMENT.at(first, f"unknown statement {first.text}", meant=meant))
        if key in INSTEAD or key in DECLARATIONS:
            return Rejected(f.UNKNOWN_STATEMENT.at(first, f"WBC has no {key}", INSTEAD.get(key)))
        if self._last == 2 and second is not None and second.kind == NUMBER:
            hint = f"write {first.text} = {second.text}"
            return Rejected(f.MISSING_EQUALS.at(first, f"= is missing after {first.text}", hint, fix=f"{first.text} ="))
        hint = "a line is a statement, an assignment, #name value, LABEL: or // comment"
        return Rejected(f.UNKNOWN_STATEMENT.at(first, f"unknown statement {first.text}", hint))

    # -- operands

    def _operand(self, row: StatementRow, wanted: Wanted) -> OperandNode:
        match wanted.kind:
            case OperandKind.CONDITION:
                return self._condition(row)
            case OperandKind.VALUE:
                return self._value(f.TOO_FEW, f.WRONG_ARGUMENT, row.keyword, f"write {row.usage}", f"the {wanted.name}")
            case OperandKind.ROW:
                return self._row(row)
            case OperandKind.LABEL:
                return self._jump_label(self._take())
            case OperandKind.AXIS:
                return self._named(row, wanted.kind, "M1…M4")
            case OperandKind.OUTPUT:
                return self._named(row, wanted.kind, "OUT1…OUT8")

    def _named(self, row: StatementRow, kind: OperandKind, permitted: str) -> Identifier:
        """A drive or an output."""
        token = self._take()
        if token is not None and token.kind == WORD:
            return self._name(token)
        place = token or self._end()
        usage = f"write {row.usage}, {permitted}"
        if row.keyword in HALTS:
            raise Rejected(f.HALT_WITHOUT_DRIVE.at(place, f"{row.keyword} lacks the drive", usage))
        if row.keyword in MOTIONS and token is not None:
            raise Rejected(f.MOTION_WITHOUT_DRIVE.at(place, f"{row.keyword} lacks the drive before {token.text}", usage))
        finding = f.TOO_FEW if token is None else f.WRONG_ARGUMENT
        raise Rejected(finding.at(place, f"{row.keyword} lacks the {kind.value}", usage))

    def _jump_label(self, token: Lexeme | None) -> Identifier:
        if token is None:
            raise Rejected(f.MISSING_LABEL.at(self._end(), "JUMP lacks the label", "write JUMP LABEL"))
        if token.kind == NUMBER:
            hint = "JUMP goes to a label, not to a line"
            raise Rejected(f.NUMERIC_LABEL.at(token, f"{token.text} is a number, not a label", hint, _label_of(token)))
        if token.kind != WORD or not is_name(token.text):
            fix = plain_name(token.text)
            raise Rejected(f.BAD_LABEL.at(token, f"{token.text!r} cannot be a label", "write JUMP LABEL", fix))
        return Identifier(token.start, token.end, token.text, token.text.upper())

    def _row(self, row: StatementRow) -> OperandNode:
        if self._at == self._last or self._tokens[self._at].text != "@":
            usage = f"write {row.usage} or {row.keyword} n with the index of a row"
            return self._value(f.TOO_FEW, f.WRONG_ARGUMENT, row.keyword, usage, "the position")
        at = self._tokens[self._at]
        self._at += 1
        token = self._take()
        if token is None:
            raise Rejected(f.TOO_FEW.at(at, "the name of a position is missing after @", f"write {row.usage}"))
        if token.kind not in (WORD, WRONG_NUMBER):
            raise Rejected(f.WRONG_ARGUMENT.at(token, f"{token.text!r} is not a name of a position", f"write {row.usage}"))
        name = self._name(token)
        return Position(at.start, token.end, name)

    def _condition(self, row: StatementRow) -> Relation:
        usage = f"write {row.keyword} X = Y with one of {' '.join(COMPARISONS)}"
        left = self._value(f.MISSING_WAIT, f.WRONG_WAIT, row.keyword, usage)
        token = self._take()
        if token is None:
            message = f"{row.keyword} lacks the comparison after {left.text}"
            raise Rejected(f.MISSING_WAIT.at(self._end(), message, usage))
        if token.text not in COMPARISONS:
            if token.kind in (COMPARISON, OPERATOR):
                meant = _MEANT.get(token.text)
                raise Rejected(f.WRONG_OPERATOR.at(token, f"{row.keyword} cannot compare with {token.text}", usage, fix=meant))
            raise Rejected(f.WRONG_WAIT.at(token, f"a comparison is expected before {token.text}", usage))
        right = self._value(f.MISSING_WAIT, f.WRONG_WAIT, row.keyword, usage)
        return Relation(left.start, right.end, left, token.text, right)

    def _expression(self) -> ExpressionNode:
        first = self._tokens[self._at] if self._at < self._last else None
        if first is not None and first.kind == WORD:
            following = self._tokens[self._at + 1] if self._at + 1 < self._last else None
            if following is not None and following.text == "(":
                return self._call()
            if first.text.upper() in FUNCTIONS:
                raise Rejected(f.WRONG_ARGUMENT.at(first, f"the argument of {first.text} is missing", f"write {first.text}(…)"))
        left = self._value(f.MISSING_VALUE, f.WRONG_NUMBER, SET, f"write {SET_USAGE}")
        if self._at == self._last:
            return left
        token = self._tokens[self._at]
        if token.kind == COMPARISON or (token.kind == OPERATOR and token.text not in OPERATORS):
            raise Rejected(f.WRONG_OPERATOR.at(token, f"{token.text} is not an operator of SET", f"one of {' '.join(OPERATORS)}"))
        if token.kind != OPERATOR:
            return left
        self._at += 1
        right = self._value(f.MISSING_VALUE, f.WRONG_NUMBER, f"the {token.text} of SET", f"write {SET_USAGE}")
        return Binary(left.start, right.end, left, token.text, right)

    def _call(self) -> FunctionCall:
        token = self._tokens[self._at]
        row = FUNCTIONS.get(token.text.upper())
        if row is None:
            known = [r.name for r in FUNCTIONS.values()]
            meant = "tg" if token.text.upper() == "TAN" else self._near.of(token.text, known)
            hint = f"known are {', '.join(known)}"
            raise Rejected(f.UNKNOWN_FUNCTION.at(token, f"unknown function {token.text}", hint, meant=meant))
        usage = f"write {row.name}({', '.join('XY'[: row.arguments])})"
        self._at += 2
        arguments = [self._value(f.TOO_FEW, f.WRONG_ARGUMENT, row.name, usage)]
        while self._at < self._last and self._tokens[self._at].text == ",":
            self._at += 1
            arguments.append(self._value(f.TOO_FEW, f.WRONG_ARGUMENT, row.name, usage))
        if len(arguments) < row.arguments:
            arguments = self._divided(arguments[0])
        place = _Place(token.start, self._tokens[min(self._at, self._last - 1)].end)
        if len(arguments) != row.arguments:
            finding = f.TOO_FEW if len(arguments) < row.arguments else f.TOO_MANY
            count = "one argument" if row.arguments == 1 else f"{row.arguments} arguments"
            raise Rejected(finding.at(place, f"{row.name} takes {count}, not {len(arguments)}", usage))
        self._mark(")", usage)
        return FunctionCall(
            place.start, place.end, Identifier(token.start, token.end, token.text, token.text.upper()), tuple(arguments)
        )

    def _divided(self, only: ValueNode) -> list[ValueNode]:
        """``min(1,2)``: the comma looked like a decimal comma, but two numbers are needed."""
        if not isinstance(only, DecimalNumber) or "," not in only.text:
            return [only]
        left, right = only.text.split(",")
        middle = only.end - len(right)
        hint = f"write {left}, {right} with a blank, or a decimal point in numbers"
        message = f"read as the two numbers {left} and {right}"
        self._diagnostics.append(f.AMBIGUOUS_COMMA.at(only, message, hint, f"{left}, {right}"))
        return [
            DecimalNumber(only.start, middle - 1, left, float(left)),
            DecimalNumber(middle, only.end, right, float(right)),
        ]

    def _value(
        self, missing: ProgramFinding, wrong: ProgramFinding, what: str, usage: str, part: str = "a number or a name"
    ) -> ValueNode:
        if self._at == self._last:
            raise Rejected(missing.at(self._end(), f"{what} lacks {part}", usage))
        token = self._tokens[self._at]
        self._at += 1
        kind = token.kind
        if kind == NUMBER:
            text = token.text
            return DecimalNumber(token.start, token.end, text, float(text.replace(",", ".")))
        if kind == WORD:
            return self._name(token)
        if kind == WRONG_NUMBER:
            raise Rejected(_wrong_number(token))
        if token.text == "-" and self._at < self._last:
            following = self._tokens[self._at]
            self._at += 1
            if following.kind == NUMBER:
                text = "-" + following.text
                return DecimalNumber(token.start, following.end, text, float(text.replace(",", ".")))
            if following.kind == WRONG_NUMBER:
                raise Rejected(_wrong_number(following))
            if following.kind == WORD:
                place = _Place(token.start, following.end)
                hint = f"calculate it before: SET X = 0 - {following.text}"
                raise Rejected(wrong.at(place, "a minus sign is permitted before numbers only", hint))
        if token.text == "," and what in STATEMENTS:
            raise Rejected(wrong.at(token, "arguments are separated by blanks", usage))
        if token.kind == STRANGE:
            raise Rejected(f.ILLEGAL_CHARACTER.at(token, f"{token.text!r} has no meaning in WBC", usage))
        raise Rejected(wrong.at(token, f"{what} needs a number or a name here, not {token.text!r}", usage))

    def _name(self, token: Lexeme) -> Identifier:
        text = token.text
        if not is_name(text) and not _USER_REGISTER.match(text):
            strange = next((c for c in text if not (c.isascii() and (c.isalnum() or c == "_"))), text[0])
            hint = "names have letters without accents, digits and _, and do not begin with a digit"
            message = f"illegal character {strange!r} in the name {text}"
            raise Rejected(f.ILLEGAL_CHARACTER.at(token, message, hint, plain_name(text)))
        return Identifier(token.start, token.end, text, text.upper())

    # -- tokens

    def _take(self) -> Lexeme | None:
        if self._at == self._last:
            return None
        self._at += 1
        return self._tokens[self._at - 1]

    def _mark(self, mark: str, usage: str) -> None:
        token = self._take()
        if token is not None and token.text == mark:
            return
        if token is None:
            end = self._end()
            raise Rejected(f.TOO_FEW.at(end, f"{mark} is missing", usage, f.after(end, ")") if mark == ")" else None))
        if token.text == ")":
            raise Rejected(f.TOO_FEW.at(token, f"{mark} is missing", usage))
        raise Rejected(f.WRONG_ARGUMENT.at(token, f"{mark} is expected before {token.text}", usage))

    def _end(self) -> _Place:
        """The last token, as the place of a message about missing text."""
        token = self._tokens[-1]
        return _Place(token.start, token.end)

    def _place_of_rest(self) -> _Place:
        return _Place(self._tokens[self._at].start, self._tokens[-1].end)

    def _place_of_all(self) -> _Place:
        return _Place(self._tokens[0].start, self._tokens[-1].end)


class _Place:
    __slots__ = ("end", "start")

    def __init__(self, start: int, end: int) -> None:
        self.start = start
        self.end = end


def _compound(name: str, operator: Lexeme, equals: Lexeme) -> Diagnostic:
    """``n += 1``."""
    text = f"{name} = {name} {operator.text}"
    fix = Fix(Span(operator.start, equals.end), text.removeprefix(f"{name} "))
    return f.WRONG_OPERATOR.at(operator, f"there is no {operator.text}=", f"write {text} …", fix)


def _label_of(number: Lexeme) -> str | None:
    """The label that is written instead of a number; the same wherever the number stands."""
    return f"L{number.text}" if number.text.isdecimal() else None


def _reserved_target(token: Lexeme) -> Diagnostic:
    return f.RESERVED.at(token, f"{token.text} is a statement and cannot be set", "take another name")


def _wrong_number(token: Lexeme) -> Diagnostic:
    text = token.text
    fix = None
    if re.fullmatch(r"\.[0-9]+", text):
        fix = "0" + text
    elif re.fullmatch(r"[0-9]+\.", text):
        fix = text[:-1]
    return f.WRONG_NUMBER.at(token, f"{text} is not a number", "numbers are written like 20, -70, 20.5 or 20,5", fix=fix)
