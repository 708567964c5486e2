"""The analysis of a WBC program for editors."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from functools import cached_property

from steptwin.diagnostics import Diagnostic, Span
from steptwin.lsp.analysis import Analysis
from steptwin.lsp.answers import (
    TOKEN_KINDS,
    CallEdge,
    Completions,
    Fold,
    FoldKind,
    Hint,
    Hover,
    OutlineItem,
    SemanticToken,
    Signature,
    TokenKind,
)
from steptwin.lsp.folding import NestedFolds, runs
from steptwin.lsp.positions import LineIndex
from steptwin.lsp.table import UsedRows
from steptwin.lsp.wbc import items, names
from steptwin.lsp.wbc.hints import hints
from steptwin.lsp.wbc.names import Names
from steptwin.lsp.wbc.surroundings import ProgramContext
from steptwin.mic488.program_banks import setup_of
from steptwin.symbols import Symbol, SymbolKind, SymbolRole, Use
from steptwin.wbc.check import CheckedProgram
from steptwin.wbc.dialect import MAX_POSITIONS
from steptwin.wbc.events import BY_LABEL, BY_REGISTER
from steptwin.wbc.incremental import Edited
from steptwin.wbc.lexer import COMPARISON, NUMBER, OPERATOR, WORD, tokens
from steptwin.wbc.printer import format_text
from steptwin.wbc.statements import KEYWORDS, OPENING, ROW_MOTIONS
from steptwin.wbc.symbols import name_problem, uses
from steptwin.wbc.tree import Broken, ConstantDefinition, DecimalNumber, Identifier, KeywordStatement, Label, SourceLine

_WORDS = {NUMBER: TokenKind.NUMBER, COMPARISON: TokenKind.OPERATOR, OPERATOR: TokenKind.OPERATOR}
_RENAMED = (SymbolKind.CONSTANT, SymbolKind.VARIABLE, SymbolKind.LABEL, SymbolKind.POSITION)


class WbcAnalysis(Analysis):
    """``edited`` has been given the text, and is given no other one as long as this is asked."""

    def __init__(self, uri: str, lines: LineIndex, edited: Edited, around: ProgramContext) -> None:
        super().__init__(uri, lines)
        self._edited = edited
        self._around = around

    # -- contents of the program

    @cached_property
    def checked(self) -> CheckedProgram:
        around = self._around
        setup = None if around.config is None else setup_of(around.config)
        return self._edited.check(around.positions, setup, around.dialect)[0]

    @cached_property
    def names(self) -> Names:
        """For the present text, also if it has not been checked yet."""
        return Names.of(self._edited.program, self._around)

    def diagnostics(self) -> Sequence[Diagnostic]:
        return self.checked.diagnostics

    def _uses(self) -> Iterator[Use]:
        span = self._edited.span
        for use in uses(self._edited.program, self.names.scope):
            yield Use(use.symbol, span(use.span), use.role)

    def _line(self, place: int) -> int | None:
        """The number of the line of a place, None where the program has none."""
        number = self._edited.line_at(place)
        return number if number < len(self._edited.contents) else None

    @cached_property
    def used_rows(self) -> UsedRows:
        """Used rows of a position table: names, and rows by number; a row by a variable may be any."""
        names: set[str] = {use.symbol.key for use in self.uses if use.symbol.kind is SymbolKind.POSITION}
        numbers: set[int] = set()
        by_variable = False
        for line in self._edited.program.lines:
            statement = line.statement
            if isinstance(statement, KeywordStatement) and statement.keyword in ROW_MOTIONS and statement.operands:
                row = statement.operands[0]
                if isinstance(row, DecimalNumber):
                    numbers.add(int(min(row.value, MAX_POSITIONS)))
                by_variable = by_variable or isinstance(row, Identifier)
        return UsedRows(frozenset(names), frozenset(numbers), by_variable)

    # -- questions about a place

    def hover(self, place: int) -> Hover | None:
        use = self.use_at(place)
        if use is not None:
            text = self._text(use)
            return None if text is None else Hover(use.span, text)
        number = self._line(place)
        if number is None:
            return None
        start = self._edited.starts[number]
        code = self._edited.contents[number].partition("//")[0]
        for word in tokens(code, start):
            if word.kind == WORD and word.start <= place <= word.end:
                text = names.keyword_text(word.text.upper())
                return None if text is None else Hover(Span(word.start, word.end), text + self._step_text(number))
        return None

    def _step_text(self, number: int) -> str:
        """Which executable line it is: that is what memory is counted in."""
        executable = 0
        for line in self._edited.program.lines[: number + 1]:
            executable += is_executable(line)
        if not executable or not is_executable(self._edited.program.lines[number]):
            return ""
        return f"\n\nExecutable line {executable} of at most {self._around.dialect.max_steps}."

    def _text(self, use: Use) -> str | None:
        symbol, key = use.symbol, use.symbol.key
        match symbol.kind:
            case SymbolKind.CONSTANT:
                return names.constant_text(key, self.names)
            case SymbolKind.VARIABLE:
                return names.variable_text(key, self.names)
            case SymbolKind.REGISTER:
                return names.register_text(key, self._around)
            case SymbolKind.VALUE:
                return names.value_text(key)
            case SymbolKind.FUNCTION:
                return names.function_text(key)
            case SymbolKind.POSITION:
                return names.position_text(key, self._around)
            case _:
                jumps = sum(other.symbol == symbol and other.role is SymbolRole.READ for other in self.uses)
                return names.label_text(key, self.names, jumps)

    def items(self, place: int) -> Completions:
        number = self._line(place)
        start = len(self.text) if number is None else self._edited.starts[number]
        line = "" if number is None else self._edited.contents[number]
        column = min(place - start, len(line))
        is_user = line[:column].rpartition(" ")[2].startswith("$")
        used = self._user_registers() if is_user else ()
        return items.items(line, column, start, self.names, used)

    def _user_registers(self) -> Sequence[str]:
        found = Counter(
            use.symbol.key for use in self.uses if use.symbol.kind is SymbolKind.REGISTER and use.symbol.key[0] == "$"
        )
        return [key for key, _ in found.most_common()]

    def signature(self, place: int) -> Signature | None:
        number = self._line(place)
        if number is None:
            return None
        return items.signature(self._edited.contents[number], place - self._edited.starts[number])

    # -- names

    def also_defined(self, symbol: Symbol) -> Sequence[Span]:
        """The label of the interrupt that a register enables."""
        event = BY_REGISTER.get(symbol.key) if symbol.kind is SymbolKind.REGISTER else None
        if event is None:
            return ()
        labels = {key for key, (found, _) in BY_LABEL.items() if found is event}
        return [use.span for use in self.uses if use.role is SymbolRole.DEFINE and use.symbol.key in labels]

    def new_name_problem(self, symbol: Symbol, text: str) -> str | None:
        if symbol.kind not in _RENAMED:
            return f"{symbol.text} is a {symbol.kind.value}: only names a program gives can be changed"
        if symbol.kind is SymbolKind.LABEL and symbol.key in BY_LABEL:
            return f"{symbol.text} is the label of an interrupt, whose name is fixed"
        if text.upper() == symbol.key:
            return None
        table = self._around.positions
        if symbol.kind is SymbolKind.POSITION and table is not None and table.index(text) is not None:
            return f"there is a position {text} already"
        return name_problem(text, self.names.scope, self.names.labels)

    # -- the text as a whole

    def outline(self) -> Sequence[OutlineItem]:
        return list(self._outline())

    def _outline(self) -> Iterator[OutlineItem]:
        """Constants, variables, and the labels each with the lines below it."""
        edited = self._edited
        lines = edited.program.lines
        ends = [number for number, line in enumerate(lines) if isinstance(line.statement, Label)] + [len(lines)]
        following = iter(ends[1:])
        for line in lines:
            statement = line.statement
            if isinstance(statement, ConstantDefinition):
                name = edited.span(statement.name.span)
                yield OutlineItem(
                    statement.name.text, SymbolKind.CONSTANT, edited.span(statement.span), name, statement.value.text
                )
            elif isinstance(statement, Label):
                last = next(following) - 1
                name = edited.span(statement.name.span)
                span = Span(name.start, edited.starts[last] + len(edited.contents[last]))
                detail = "interrupt" if statement.name.key in BY_LABEL else ""
                yield OutlineItem(statement.name.text, SymbolKind.LABEL, span, name, detail)
        for name in self.names.scope.variables.values():
            span = edited.span(name.span)
            yield OutlineItem(name.text, SymbolKind.VARIABLE, span, span)

    def folds(self) -> Sequence[Fold]:
        """Blocks, the lines below labels, and comments and constants of several lines."""
        found: list[Fold] = []
        blocks = NestedFolds()
        lines = self._edited.program.lines
        label: int | None = None
        for number, line in enumerate(lines):
            statement = line.statement
            keyword = statement.keyword if isinstance(statement, KeywordStatement | Broken) else None
            if isinstance(statement, Label):
                _fold(found, label, self._last_code(number))
                label = number
            elif keyword in OPENING:
                blocks.begin(f"END{keyword}", number)
            elif keyword is not None:
                blocks.end(keyword, number)
        _fold(found, label, self._last_code(len(lines)))
        return [*found, *blocks.folds, *runs([_fold_kind(line) for line in lines])]

    def _last_code(self, before: int) -> int:
        """The last line before another that is no comment and not empty."""
        lines = self._edited.program.lines
        return next((number for number in range(before - 1, -1, -1) if lines[number].statement is not None), 0)

    def formatted(self) -> str | None:
        return format_text(self.text)

    def tokens(self) -> Sequence[SemanticToken]:
        return list(self._tokens())

    def _tokens(self) -> Iterator[SemanticToken]:
        by_start = {use.span.start: use for use in self.uses}
        edited = self._edited
        for number, content in enumerate(edited.contents):
            start = edited.starts[number]
            code, slashes, _ = content.partition("//")
            words = tokens(code, start)
            for at, word in enumerate(words):
                span, use = Span(word.start, word.end), by_start.get(word.start)
                if use is not None:
                    yield SemanticToken(
                        span,
                        TOKEN_KINDS[use.symbol.kind],
                        use.role is not SymbolRole.READ,
                        use.symbol.kind is SymbolKind.CONSTANT,
                    )
                elif word.kind in _WORDS:
                    yield SemanticToken(span, _WORDS[word.kind])
                elif (word.kind == WORD and at == 0 and word.text.upper() in KEYWORDS) or (word.text == "#" and at == 0):
                    yield SemanticToken(span, TokenKind.KEYWORD)
            if slashes:
                yield SemanticToken(Span(start + len(code), start + len(content)), TokenKind.COMMENT)

    def hints(self) -> Sequence[Hint]:
        return list(hints(self._edited, self.checked, self.names, self.uses))

    def calls(self) -> Sequence[CallEdge]:
        """Every JUMP: from which label's lines, to which label."""
        found: list[CallEdge] = []
        caller = ""
        for use in self.uses:
            if use.symbol.kind is not SymbolKind.LABEL:
                continue
            if use.role is SymbolRole.DEFINE:
                caller = use.symbol.key
            else:
                found.append(CallEdge(caller, use.symbol.key, use.span))
        return found


def is_executable(line: SourceLine) -> bool:
    """Whether a line takes a place in the memory of a controller."""
    statement = line.statement
    if isinstance(statement, Label):
        return statement.name.key in BY_LABEL
    return statement is not None and not isinstance(statement, ConstantDefinition)


def _fold(found: list[Fold], first: int | None, last: int) -> None:
    if first is not None and last > first:
        found.append(Fold(first, last))


def _fold_kind(line: SourceLine) -> FoldKind | None:
    """Kind of lines that are folded with their neighbours: comments and constants."""
    if isinstance(line.statement, ConstantDefinition):
        return FoldKind.REGION
    return FoldKind.COMMENT if line.statement is None and line.comment is not None else None
