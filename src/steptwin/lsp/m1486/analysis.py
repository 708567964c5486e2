"""The analysis of an M1486 program for editors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import pairwise

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
from steptwin.lsp.m1486 import items, texts
from steptwin.lsp.m1486.hints import hints
from steptwin.lsp.positions import LineIndex
from steptwin.m1486.check import CheckedChipProgram, check_parsed
from steptwin.m1486.commands import find
from steptwin.m1486.lines import Interface
from steptwin.m1486.structure import written_label
from steptwin.m1486.symbols import by_chip, label_key, uses
from steptwin.m1486.syntax import ChipCommand, JumpCondition, Parsed, ParsedProgram, format_program, parse
from steptwin.m1486.variants import Variant
from steptwin.symbols import Symbol, SymbolKind, SymbolRole, Use

_OPENING = {"[": "]", "L": "E"}


class M1486Analysis(Analysis):
    """For one variant and driver interface."""

    def __init__(self, uri: str, lines: LineIndex, variant: Variant, interface: Interface) -> None:
        super().__init__(uri, lines)
        self._variant = variant
        self._interface = interface

    @cached_property
    def _parsed(self) -> Parsed:
        return parse(self.text)

    @property
    def _program(self) -> ParsedProgram:
        return self._parsed.program

    @cached_property
    def _checked(self) -> CheckedChipProgram:
        return check_parsed(self._parsed, self._variant, self._interface)

    @cached_property
    def _commands(self) -> Sequence[tuple[int | None, ChipCommand]]:
        """With the chip that listens."""
        return tuple(by_chip(self._program))

    def diagnostics(self) -> Sequence[Diagnostic]:
        return self._checked.diagnostics

    def _uses(self) -> Iterator[Use]:
        yield from uses(self._program)

    def _command_at(self, place: int) -> tuple[int | None, ChipCommand] | None:
        return next(((chip, c) for chip, c in self._commands if c.span.start <= place <= c.span.end), None)

    # -- questions about a place

    def hover(self, place: int) -> Hover | None:
        found = self._command_at(place)
        if found is None:
            return None
        _, command = found
        text = texts.command_text(command, self._variant)
        use = self.use_at(place)
        if use is not None and use.symbol.kind is not SymbolKind.LABEL:
            return Hover(use.span, f"{texts.number_text(use, command, self._interface)}\n\n---\n\n{text}")
        return Hover(command.span, text) if text else None

    def _labels(self, place: int) -> dict[str, str]:
        """The labels of the chip that is selected at a place, each with its following command."""
        here = None
        for chip, command in self._commands:
            if command.span.start > place:
                break
            here = chip
        found: dict[str, str] = {}
        for (chip, command), (_, following) in pairwise((*self._commands, (None, ChipCommand("")))):
            if command.key == "@" and command.number is not None and chip == here:
                found.setdefault(str(command.number), str(following))
        return found

    def items(self, place: int) -> Completions:
        number = self.lines.line_of(place)
        start = self.lines.starts[number]
        around = self._variant, self._interface
        return items.items(self.lines.line(number), place - start, start, self._labels(place), around)

    def signature(self, place: int) -> Signature | None:
        number = self.lines.line_of(place)
        return items.signature(self.lines.line(number), place - self.lines.starts[number], self._variant)

    def new_name_problem(self, symbol: Symbol, text: str) -> str | None:
        if symbol.kind is not SymbolKind.LABEL:
            return f"{symbol.text} is fixed: only labels have numbers of their own"
        if not (text.isascii() and text.isdecimal() and len(text) < 9) or find("J", int(text), self._variant) is None:
            return f"{text!r} is not a label: permitted are 1 to {self._variant.labels} on {self._variant.title}"
        chip = symbol.key.rpartition(":")[0]
        key = f"{chip}:{int(text)}" if chip else str(int(text))
        if key != symbol.key and any(use.symbol.key == key for use in self.uses if use.symbol.kind is SymbolKind.LABEL):
            return f"there is a label {int(text)} already"
        return None

    # -- the text as a whole

    def outline(self) -> Sequence[OutlineItem]:
        """The chips, and the labels each with the commands up to the next."""
        marks = [command for _, command in self._commands if command.key in ("@", "X", "XG")]
        last = max((command.span.end for _, command in self._commands), default=0)
        ends = [self.lines.end(max(self.lines.line_of(command.span.start) - 1, 0)) for command in marks[1:]]
        return [self._section(command, end) for command, end in zip(marks, [*ends, last], strict=False)]

    def _section(self, command: ChipCommand, end: int) -> OutlineItem:
        span = Span(command.span.start, max(end, command.span.end))
        if command.key == "@":
            return OutlineItem(f"@{command.number}", SymbolKind.LABEL, span, command.argument_span)
        name = "all chips" if command.number is None else f"chip {command.number:X}"
        return OutlineItem(name, SymbolKind.CONTROLLER, span, command.span)

    def folds(self) -> Sequence[Fold]:
        blocks = NestedFolds()
        for _, command in self._commands:
            line = self.lines.line_of(command.span.start)
            if command.key in _OPENING:
                blocks.begin(_OPENING[command.key], line)
            else:
                blocks.end(command.key, line)
        texts = (self.lines.line(number) for number in range(len(self.lines.starts)))
        comments = [FoldKind.COMMENT if text.lstrip().startswith(";") else None for text in texts]
        return [*blocks.folds, *runs(comments)]

    def formatted(self) -> str | None:
        """Capitals, no blanks, comments in a column; a last line end stays as it is."""
        text = format_program(self._program)
        return text if self.lines.starts[-1] == len(self.text) else text.removesuffix("\n")

    def tokens(self) -> Sequence[SemanticToken]:
        by_start = {use.span.start: use for use in self.uses}
        found: list[SemanticToken] = []
        for _, command in self._commands:
            letter = Span(command.span.start, command.span.start + 1)
            found.append(SemanticToken(letter, TokenKind.KEYWORD))
            spans = [command.argument_span]
            if isinstance(command.argument, JumpCondition):
                spans.append(command.argument.label_span)
            for span in spans:
                if span.end > span.start >= letter.end and self.lines.line_of(span.start) == self.lines.line_of(span.end):
                    use = by_start.get(span.start)
                    kind = TokenKind.NUMBER if use is None else TOKEN_KINDS[use.symbol.kind]
                    found.append(SemanticToken(span, kind, use is not None and use.role is not SymbolRole.READ))
        for number, start in enumerate(self.lines.starts):
            content = self.lines.line(number)
            if ";" in content:
                found.append(SemanticToken(Span(start + content.index(";"), start + len(content)), TokenKind.COMMENT))
        return sorted(found, key=lambda token: token.span)

    def hints(self) -> Sequence[Hint]:
        return list(hints(self._program, self._checked.memory, self._variant, self._interface))

    def calls(self) -> Sequence[CallEdge]:
        """Every jump, condition and call: from which label's commands, to which label."""
        found: list[CallEdge] = []
        caller, before = "", None
        for chip, command in self._commands:
            if chip != before:
                caller, before = "", chip
            label = written_label(command)
            if command.key == "@" and command.number is not None:
                caller = label_key(chip, command.number)
            elif label is not None:
                span = command.argument.label_span if isinstance(command.argument, JumpCondition) else command.argument_span
                found.append(CallEdge(caller, label_key(chip, label), span))
        return found
