"""Parses one statement from the tokens of its line, and reports its errors.

Relations between lines (names, blocks, labels) are not checked here.
"""

from __future__ import annotations

import re

from steptwin.diagnostics import Diagnostic, Fix, Span
from steptwin.messages import Message, MessageText
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

WRITE_A_CONSTANT = Message("wbc.write-a-constant", "write #name value, like #speed 60 or #pump OUT3")
LABEL_IS_A_NAME = Message("wbc.label-is-a-name", "a label is a name of letters, digits and _ and a ':', like MAIN:")
LINE_IS_ONE_OF = Message("wbc.line-is-one-of", "a line is a statement, an assignment, #name value, LABEL: or // comment")
WRITE_COMPARISON = Message("wbc.write-comparison", "write {keyword} X = Y with one of {names}")
WRITE_WITH_A_BLANK = Message("wbc.write-with-a-blank", "write {left}, {right} with a blank, or a decimal point in numbers")
READ_AS_TWO_NUMBERS = Message("wbc.read-as-two-numbers", "read as the two numbers {left} and {right}")
IS_A_STATEMENT_AND_CANNOT_BE_SET = Message("wbc.is-a-statement-and-cannot-be-set", "{text} is a statement and cannot be set")
IS_NOT_A_NUMBER = Message("wbc.is-not-a-number", "{text} is not a number")
NUMBERS_ARE_WRITTEN_LIKE = Message("wbc.numbers-are-written-like", "numbers are written like 20, -70, 20.5 or 20,5")
THE_CONSTANT = Message("wbc.the-constant", "the constant {name}")
NOT_DOCUMENTED = Message("wbc.not-documented", "later firmware has it, but its syntax is not documented; use IF or JUMP")
JUMP_GOES_TO_A_LABEL = Message("wbc.jump-goes-to-a-label", "JUMP goes to a label, not to a line")
WRITE_OR_INDEX = Message("wbc.write-or-index", "write {usage} or {keyword} n with the index of a row")
OPERAND_OF_SET = Message("wbc.operand-of-set", "the {text} of SET")
KNOWN_ARE = Message("wbc.known-are", "known are {names}")
ILLEGAL_CHARACTER_IN_THE_NAME = Message("wbc.illegal-character-in-the-name", "illegal character {strange!r} in the name {text}")
DOES_NOT_BEGIN_A_STATEMENT = Message("wbc.does-not-begin-a-statement", "{text!r} does not begin a statement")
ONE_ARGUMENT = Message("wbc.one-argument", "one argument")
ARGUMENTS = Message("wbc.arguments", "{count} arguments")
NOTHING_MAY_FOLLOW_HERE = Message("wbc.nothing-may-follow-here", "nothing may follow {keyword} here")
SET_CALCULATES_ONE_OPERATION = Message(
    "wbc.set-calculates-one-operation", "a SET calculates one operation; give the rest to a second SET"
)
CANNOT_BE_LABEL = Message("wbc.cannot-be-label", "{text!r} cannot be a label")
UNKNOWN_STATEMENT = Message("wbc.unknown-statement", "unknown statement {text}")
CALCULATE_IT_BEFORE = Message("wbc.calculate-it-before", "calculate it before: {text}")
NEEDS_A_NUMBER_OR_A_NAME = Message("wbc.needs-a-number-or-a-name", "{what} needs a number or a name here, not {text!r}")
IS_EXPECTED_BEFORE = Message("wbc.is-expected-before", "{mark} is expected before {text}")
NOTHING_MAY_FOLLOW_THE_CONDITION_OF = Message(
    "wbc.nothing-may-follow-the-condition-of", "nothing may follow the condition of {keyword}"
)
TAKES = Message("wbc.takes", "{keyword} takes {count}")
JUMP_WITHOUT_COLON = Message("wbc.jump-without-colon", "the label of a JUMP is written without ':'")
ASSIGNMENT_IS_WRITTEN_WITH_EQUALS = Message(
    "wbc.assignment-is-written-with-equals", "an assignment is written with =, not {text}"
)
NOTHING_MAY_FOLLOW_THE_VALUE_HERE = Message("wbc.nothing-may-follow-the-value-here", "nothing may follow the value here")
SET_LACKS_THE_NAME_TO_SET = Message("wbc.set-lacks-the-name-to-set", "SET lacks the name to set")
IS_A_NUMBER_AND_CANNOT_BE_SET = Message("wbc.is-a-number-and-cannot-be-set", "{text} is a number and cannot be set")
CANNOT_BE_SET = Message("wbc.cannot-be-set", "{text!r} cannot be set")
CONSTANT_LACKS_ITS_NAME = Message("wbc.constant-lacks-its-name", "a constant lacks its name")
CONSTANT_IS_WRITTEN_WITHOUT_EQUALS = Message("wbc.constant-is-written-without-equals", "a constant is written without =")
NOTHING_MAY_FOLLOW_A_CONSTANT = Message("wbc.nothing-may-follow-a-constant", "nothing may follow the value of a constant")
WRITTEN_WITHOUT_COLON = Message("wbc.written-without-colon", "{keyword} is written without ':'")
LABEL_IS_ON_ITS_OWN_LINE = Message("wbc.label-is-on-its-own-line", "a label must be on a line of its own")
PUT_THIS_ON_THE_NEXT_LINE = Message("wbc.put-this-on-the-next-line", "put this on the next line")
NAME_OF_LABEL_IS_MISSING = Message("wbc.name-of-label-is-missing", "the name of the label is missing before ':'")
IS_A_NUMBER_NOT_A_LABEL = Message("wbc.is-a-number-not-a-label", "{text} is a number, not a label")
IS_NOT_SUPPORTED = Message("wbc.is-not-supported", "{keyword} is not supported")
LABEL_IS_ONE_WORD = Message("wbc.label-is-one-word", "a label is one word")
WRITE_IT_LIKE_MY_LABEL = Message("wbc.write-it-like-my-label", "write it like MY_LABEL:")
LACKS_THE_DRIVE_BEFORE = Message("wbc.lacks-the-drive-before", "{keyword} lacks the drive before {text}")
JUMP_LACKS_THE_LABEL = Message("wbc.jump-lacks-the-label", "JUMP lacks the label")
NAME_OF_POSITION_IS_MISSING = Message("wbc.name-of-position-is-missing", "the name of a position is missing after @")
IS_NOT_A_NAME_OF_A_POSITION = Message("wbc.is-not-a-name-of-a-position", "{text!r} is not a name of a position")
COMPARISON_IS_EXPECTED_BEFORE = Message("wbc.comparison-is-expected-before", "a comparison is expected before {text}")
IS_NOT_AN_OPERATOR_OF_SET = Message("wbc.is-not-an-operator-of-set", "{text} is not an operator of SET")
ONE_OF_OPERATORS = Message("wbc.one-of-operators", "one of {names}")
UNKNOWN_FUNCTION = Message("wbc.unknown-function", "unknown function {text}")
TAKES_OTHER_NUMBER = Message("wbc.takes-other-number", "{name} takes {count}, not {found}")
LACKS = Message("wbc.lacks", "{what} lacks {part}")
HAS_NO_MEANING_IN_WBC = Message("wbc.has-no-meaning-in-wbc", "{text!r} has no meaning in WBC")
IS_MISSING = Message("wbc.is-missing", "{mark} is missing")
CONDITION_HAS_NO = Message("wbc.condition-has-no", "a condition has no {text}")
CALCULATE_BEFORE_IN_A_SET = Message("wbc.calculate-before-in-a-set", "calculate before, in a SET")
CANNOT_COMPARE_WITH = Message("wbc.cannot-compare-with", "{keyword} cannot compare with {text}")
ARGUMENT_OF_IS_MISSING = Message("wbc.argument-of-is-missing", "the argument of {text} is missing")
MINUS_BEFORE_NUMBERS_ONLY = Message("wbc.minus-before-numbers-only", "a minus sign is permitted before numbers only")

_USER_REGISTER = re.compile(r"\$[IDR][0-9]+$", re.IGNORECASE | re.ASCII)
_MEANT = {"==": "=", ":=": "=", "=<": "<=", "=>": ">="}
_EQUALS_ELSEWHERE = ("==", ":=")
_BLOCK_WORDS = frozenset({"ELSE", "ENDIF", "ENDWHILE"})
# Made once: they are at hand for each statement, and shown of few.
_USAGES = {row.keyword: f.WRITE(text=row.usage) for row in STATEMENTS.values()}
_USAGE_OF_SET = f.WRITE(text=SET_USAGE)
_COMPARISONS = {keyword: WRITE_COMPARISON(keyword=keyword, names=" ".join(COMPARISONS)) for keyword in ("IF", "WHILE", "WAIT")}
_OPERANDS = {sign: OPERAND_OF_SET(text=sign) for sign in OPERATORS}
_PARTS = {
    name: Message(f"wbc.the-{name}", f"the {name}")()
    for name in ("seconds", "velocity", "position", "distance", "drive", "output")
}
_A_NUMBER_OR_A_NAME = Message("wbc.a-number-or-a-name", "a number or a name")()


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
        raise Rejected(f.UNKNOWN_STATEMENT.at(first, DOES_NOT_BEGIN_A_STATEMENT(text=first.text)))

    def _command(self, row: StatementRow) -> KeywordStatement:
        start = self._tokens[0].start
        usage = _USAGES[row.keyword]
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
        usage = _USAGES[row.keyword]
        if row.operands and row.operands[0].kind is OperandKind.CONDITION:
            if token.kind == OPERATOR:
                return Rejected(f.TRAILING.at(rest, CONDITION_HAS_NO(text=token.text), CALCULATE_BEFORE_IN_A_SET()))
            return Rejected(f.TRAILING.at(rest, NOTHING_MAY_FOLLOW_THE_CONDITION_OF(keyword=row.keyword), usage))
        if row.operands and token.kind in (WORD, NUMBER):
            count = ONE_ARGUMENT() if len(row.operands) == 1 else ARGUMENTS(count=len(row.operands))
            return Rejected(f.TOO_MANY.at(rest, TAKES(keyword=row.keyword, count=count), usage))
        if token.text == ":" and row.keyword == "JUMP":
            return Rejected(f.TRAILING.at(rest, JUMP_WITHOUT_COLON(), usage, fix=""))
        return Rejected(f.TRAILING.at(rest, NOTHING_MAY_FOLLOW_HERE(keyword=row.keyword), usage))

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
            raise Rejected(f.MISSING_EQUALS.at(place, f.IS_MISSING_AFTER(text=target.text), _USAGE_OF_SET, fix))
        if equals.text != "=":
            fix = "=" if equals.text in _EQUALS_ELSEWHERE else None
            raise Rejected(f.WRONG_OPERATOR.at(equals, ASSIGNMENT_IS_WRITTEN_WITH_EQUALS(text=equals.text), fix=fix))
        value = self._expression()
        if self._at < self._last:
            rest = self._place_of_rest()
            hint = SET_CALCULATES_ONE_OPERATION() if self._tokens[self._at].kind == OPERATOR else _USAGE_OF_SET
            raise Rejected(f.TRAILING.at(rest, NOTHING_MAY_FOLLOW_THE_VALUE_HERE(), hint))
        return Assign(start, self._tokens[-1].end, has_set, target, value)

    def _target(self) -> Identifier:
        token = self._take()
        if token is None:
            raise Rejected(f.MISSING_VALUE.at(self._end(), SET_LACKS_THE_NAME_TO_SET(), _USAGE_OF_SET))
        if token.kind in (NUMBER, WRONG_NUMBER):
            raise Rejected(f.WRONG_ARGUMENT.at(token, IS_A_NUMBER_AND_CANNOT_BE_SET(text=token.text), _USAGE_OF_SET))
        if token.kind != WORD:
            raise Rejected(f.WRONG_ARGUMENT.at(token, CANNOT_BE_SET(text=token.text), _USAGE_OF_SET))
        if token.text.upper() in KEYWORDS:
            raise Rejected(_reserved_target(token))
        return self._name(token)

    def _constant(self) -> ConstantDefinition:
        usage = WRITE_A_CONSTANT()
        start = self._tokens[0].start
        self._at = 1
        token = self._take()
        if token is None or token.kind != WORD:
            raise Rejected(f.BAD_CONSTANT.at(token or self._end(), CONSTANT_LACKS_ITS_NAME(), usage))
        name = self._name(token)
        self.target = name
        following = self._tokens[self._at] if self._at < self._last else None
        if following and following.text == "=":
            raise Rejected(f.BAD_CONSTANT.at(following, CONSTANT_IS_WRITTEN_WITHOUT_EQUALS(), usage, fix=""))
        value = self._value(f.BAD_CONSTANT, f.BAD_CONSTANT, THE_CONSTANT(name=name.text), usage)
        if self._at < self._last:
            raise Rejected(f.TRAILING.at(self._place_of_rest(), NOTHING_MAY_FOLLOW_A_CONSTANT(), usage))
        return ConstantDefinition(start, self._tokens[-1].end, name, value)

    def _label(self, first: Lexeme) -> Label:
        key = first.text.upper()
        if key in _BLOCK_WORDS:
            self.keyword = key
            raise Rejected(f.TRAILING.at(self._tokens[1], WRITTEN_WITHOUT_COLON(keyword=key), fix=""))
        if not is_name(first.text):
            raise self._bad_label(first)
        if self._last > 2:
            self._at = 2
            rest = self._place_of_rest()
            raise Rejected(f.TRAILING.at(rest, LABEL_IS_ON_ITS_OWN_LINE(), PUT_THIS_ON_THE_NEXT_LINE(), f.before(rest, "\n")))
        return Label(first.start, self._tokens[-1].end, Identifier(first.start, first.end, first.text, key))

    def _bad_label(self, first: Lexeme) -> Rejected:
        hint = LABEL_IS_A_NAME()
        if first.text == ":":
            return Rejected(f.BAD_LABEL.at(first, NAME_OF_LABEL_IS_MISSING(), hint))
        if first.kind == NUMBER:
            return Rejected(f.NUMERIC_LABEL.at(first, IS_A_NUMBER_NOT_A_LABEL(text=first.text), hint, _label_of(first)))
        return Rejected(f.BAD_LABEL.at(first, CANNOT_BE_LABEL(text=first.text), hint, plain_name(first.text)))

    def _unknown(self, first: Lexeme, second: Lexeme | None) -> Rejected:
        """A first word that is neither a statement nor followed by =."""
        key = first.text.upper()
        if key in NOT_SUPPORTED:
            hint = NOT_DOCUMENTED()
            return Rejected(f.NOT_SUPPORTED.at(first, IS_NOT_SUPPORTED(keyword=key), hint))
        if second is not None and second.kind == COMPARISON:
            fix = "=" if second.text in _EQUALS_ELSEWHERE else None
            return Rejected(f.WRONG_OPERATOR.at(second, ASSIGNMENT_IS_WRITTEN_WITH_EQUALS(text=second.text), fix=fix))
        if self._tokens[-1].text == ":":
            joined = "_".join(token.text for token in self._tokens[:-1])
            fix = f"{joined}:" if is_name(joined) else None
            return Rejected(f.BAD_LABEL.at(self._place_of_all(), LABEL_IS_ONE_WORD(), WRITE_IT_LIKE_MY_LABEL(), fix))
        if parts(key) is not None and second is not None:
            hint = f.WRITE(text=f"{first.text} = {second.text}")
            return Rejected(f.MISSING_EQUALS.at(first, f.IS_MISSING_AFTER(text=first.text), hint, fix=f"{first.text} ="))
        if self._last > 2 and second is not None and second.kind == OPERATOR and self._tokens[2].text == "=":
            return Rejected(_compound(first.text, second, self._tokens[2]))
        meant = STATEMENTS_ELSEWHERE.get(key)
        if meant is None and key not in INSTEAD and key not in ELSE_IF:
            meant = self._near.of(first.text, (SET, *STATEMENTS))
        if meant is not None:
            self.keyword = meant
            return Rejected(f.UNKNOWN_STATEMENT.at(first, UNKNOWN_STATEMENT(text=first.text), meant=meant))
        if key in INSTEAD or key in DECLARATIONS:
            return Rejected(f.UNKNOWN_STATEMENT.at(first, f.WBC_HAS_NO(word=key), INSTEAD.get(key)))
        if self._last == 2 and second is not None and second.kind == NUMBER:
            hint = f.WRITE(text=f"{first.text} = {second.text}")
            return Rejected(f.MISSING_EQUALS.at(first, f.IS_MISSING_AFTER(text=first.text), hint, fix=f"{first.text} ="))
        hint = LINE_IS_ONE_OF()
        return Rejected(f.UNKNOWN_STATEMENT.at(first, UNKNOWN_STATEMENT(text=first.text), hint))

    # -- operands

    def _operand(self, row: StatementRow, wanted: Wanted) -> OperandNode:
        match wanted.kind:
            case OperandKind.CONDITION:
                return self._condition(row)
            case OperandKind.VALUE:
                return self._value(f.TOO_FEW, f.WRONG_ARGUMENT, row.keyword, _USAGES[row.keyword], _PARTS[wanted.name])
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
        usage = f.WRITE(text=f"{row.usage}, {permitted}")
        if row.keyword in HALTS:
            raise Rejected(f.HALT_WITHOUT_DRIVE.at(place, LACKS(what=row.keyword, part=_PARTS[kind.value]), usage))
        if row.keyword in MOTIONS and token is not None:
            raise Rejected(f.MOTION_WITHOUT_DRIVE.at(place, LACKS_THE_DRIVE_BEFORE(keyword=row.keyword, text=token.text), usage))
        finding = f.TOO_FEW if token is None else f.WRONG_ARGUMENT
        raise Rejected(finding.at(place, LACKS(what=row.keyword, part=_PARTS[kind.value]), usage))

    def _jump_label(self, token: Lexeme | None) -> Identifier:
        if token is None:
            raise Rejected(f.MISSING_LABEL.at(self._end(), JUMP_LACKS_THE_LABEL(), f.WRITE(text="JUMP LABEL")))
        if token.kind == NUMBER:
            hint = JUMP_GOES_TO_A_LABEL()
            raise Rejected(f.NUMERIC_LABEL.at(token, IS_A_NUMBER_NOT_A_LABEL(text=token.text), hint, _label_of(token)))
        if token.kind != WORD or not is_name(token.text):
            fix = plain_name(token.text)
            raise Rejected(f.BAD_LABEL.at(token, CANNOT_BE_LABEL(text=token.text), f.WRITE(text="JUMP LABEL"), fix))
        return Identifier(token.start, token.end, token.text, token.text.upper())

    def _row(self, row: StatementRow) -> OperandNode:
        if self._at == self._last or self._tokens[self._at].text != "@":
            usage = WRITE_OR_INDEX(usage=row.usage, keyword=row.keyword)
            return self._value(f.TOO_FEW, f.WRONG_ARGUMENT, row.keyword, usage, _PARTS["position"])
        at = self._tokens[self._at]
        self._at += 1
        token = self._take()
        if token is None:
            raise Rejected(f.TOO_FEW.at(at, NAME_OF_POSITION_IS_MISSING(), _USAGES[row.keyword]))
        if token.kind not in (WORD, WRONG_NUMBER):
            raise Rejected(f.WRONG_ARGUMENT.at(token, IS_NOT_A_NAME_OF_A_POSITION(text=token.text), _USAGES[row.keyword]))
        name = self._name(token)
        return Position(at.start, token.end, name)

    def _condition(self, row: StatementRow) -> Relation:
        usage = _COMPARISONS[row.keyword]
        left = self._value(f.MISSING_WAIT, f.WRONG_WAIT, row.keyword, usage)
        token = self._take()
        if token is None:
            message = f.LACKS_COMPARISON_AFTER(keyword=row.keyword, text=left.text)
            raise Rejected(f.MISSING_WAIT.at(self._end(), message, usage))
        if token.text not in COMPARISONS:
            if token.kind in (COMPARISON, OPERATOR):
                meant = _MEANT.get(token.text)
                raise Rejected(
                    f.WRONG_OPERATOR.at(token, CANNOT_COMPARE_WITH(keyword=row.keyword, text=token.text), usage, fix=meant)
                )
            raise Rejected(f.WRONG_WAIT.at(token, COMPARISON_IS_EXPECTED_BEFORE(text=token.text), usage))
        right = self._value(f.MISSING_WAIT, f.WRONG_WAIT, row.keyword, usage)
        return Relation(left.start, right.end, left, token.text, right)

    def _expression(self) -> ExpressionNode:
        first = self._tokens[self._at] if self._at < self._last else None
        if first is not None and first.kind == WORD:
            following = self._tokens[self._at + 1] if self._at + 1 < self._last else None
            if following is not None and following.text == "(":
                return self._call()
            if first.text.upper() in FUNCTIONS:
                raise Rejected(
                    f.WRONG_ARGUMENT.at(first, ARGUMENT_OF_IS_MISSING(text=first.text), f.WRITE(text=f"{first.text}(…)"))
                )
        left = self._value(f.MISSING_VALUE, f.WRONG_NUMBER, SET, _USAGE_OF_SET)
        if self._at == self._last:
            return left
        token = self._tokens[self._at]
        if token.kind == COMPARISON or (token.kind == OPERATOR and token.text not in OPERATORS):
            raise Rejected(
                f.WRONG_OPERATOR.at(
                    token, IS_NOT_AN_OPERATOR_OF_SET(text=token.text), ONE_OF_OPERATORS(names=" ".join(OPERATORS))
                )
            )
        if token.kind != OPERATOR:
            return left
        self._at += 1
        right = self._value(f.MISSING_VALUE, f.WRONG_NUMBER, _OPERANDS[token.text], _USAGE_OF_SET)
        return Binary(left.start, right.end, left, token.text, right)

    def _call(self) -> FunctionCall:
        token = self._tokens[self._at]
        row = FUNCTIONS.get(token.text.upper())
        if row is None:
            known = [r.name for r in FUNCTIONS.values()]
            meant = "tg" if token.text.upper() == "TAN" else self._near.of(token.text, known)
            hint = KNOWN_ARE(names=", ".join(known))
            raise Rejected(f.UNKNOWN_FUNCTION.at(token, UNKNOWN_FUNCTION(text=token.text), hint, meant=meant))
        usage = f.WRITE(text=f"{row.name}({', '.join('XY'[: row.arguments])})")
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
            count = ONE_ARGUMENT() if row.arguments == 1 else ARGUMENTS(count=row.arguments)
            raise Rejected(finding.at(place, TAKES_OTHER_NUMBER(name=row.name, count=count, found=len(arguments)), usage))
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
        hint = WRITE_WITH_A_BLANK(left=left, right=right)
        message = READ_AS_TWO_NUMBERS(left=left, right=right)
        self._diagnostics.append(f.AMBIGUOUS_COMMA.at(only, message, hint, f"{left}, {right}"))
        return [
            DecimalNumber(only.start, middle - 1, left, float(left)),
            DecimalNumber(middle, only.end, right, float(right)),
        ]

    def _value(
        self,
        missing: ProgramFinding,
        wrong: ProgramFinding,
        what: str,
        usage: MessageText,
        part: MessageText = _A_NUMBER_OR_A_NAME,
    ) -> ValueNode:
        if self._at == self._last:
            raise Rejected(missing.at(self._end(), LACKS(what=what, part=part), usage))
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
                hint = CALCULATE_IT_BEFORE(text=f"SET X = 0 - {following.text}")
                raise Rejected(wrong.at(place, MINUS_BEFORE_NUMBERS_ONLY(), hint))
        if token.text == "," and what in STATEMENTS:
            raise Rejected(wrong.at(token, f.ARGUMENTS_ARE_SEPARATED_BY_BLANKS(), usage))
        if token.kind == STRANGE:
            raise Rejected(f.ILLEGAL_CHARACTER.at(token, HAS_NO_MEANING_IN_WBC(text=token.text), usage))
        raise Rejected(wrong.at(token, NEEDS_A_NUMBER_OR_A_NAME(what=what, text=token.text), usage))

    def _name(self, token: Lexeme) -> Identifier:
        text = token.text
        if not is_name(text) and not _USER_REGISTER.match(text):
            strange = next((c for c in text if not (c.isascii() and (c.isalnum() or c == "_"))), text[0])
            hint = f.NAMES_HAVE_LETTERS()
            message = ILLEGAL_CHARACTER_IN_THE_NAME(strange=strange, text=text)
            raise Rejected(f.ILLEGAL_CHARACTER.at(token, message, hint, plain_name(text)))
        return Identifier(token.start, token.end, text, text.upper())

    # -- tokens

    def _take(self) -> Lexeme | None:
        if self._at == self._last:
            return None
        self._at += 1
        return self._tokens[self._at - 1]

    def _mark(self, mark: str, usage: MessageText) -> None:
        token = self._take()
        if token is not None and token.text == mark:
            return
        if token is None:
            end = self._end()
            raise Rejected(f.TOO_FEW.at(end, IS_MISSING(mark=mark), usage, f.after(end, ")") if mark == ")" else None))
        if token.text == ")":
            raise Rejected(f.TOO_FEW.at(token, IS_MISSING(mark=mark), usage))
        raise Rejected(f.WRONG_ARGUMENT.at(token, IS_EXPECTED_BEFORE(mark=mark, text=token.text), usage))

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
    return f.WRONG_OPERATOR.at(operator, f.THERE_IS_NO(name=f"{operator.text}="), f.WRITE(text=f"{text} …"), fix)


def _label_of(number: Lexeme) -> str | None:
    """The label that is written instead of a number; the same wherever the number stands."""
    return f"L{number.text}" if number.text.isdecimal() else None


def _reserved_target(token: Lexeme) -> Diagnostic:
    return f.RESERVED.at(token, IS_A_STATEMENT_AND_CANNOT_BE_SET(text=token.text), f.TAKE_ANOTHER_NAME())


def _wrong_number(token: Lexeme) -> Diagnostic:
    text = token.text
    fix = None
    if re.fullmatch(r"\.[0-9]+", text):
        fix = "0" + text
    elif re.fullmatch(r"[0-9]+\.", text):
        fix = text[:-1]
    return f.WRONG_NUMBER.at(token, IS_NOT_A_NUMBER(text=text), NUMBERS_ARE_WRITTEN_LIKE(), fix=fix)
