"""First pass over a tree: which statements are steps, where labels are, which blocks belong together."""

from __future__ import annotations

from dataclasses import dataclass, field

from steptwin.diagnostics import Diagnostic
from steptwin.messages import Message
from steptwin.wbc import findings as f
from steptwin.wbc.blocks import BLOCK_WORDS, BlockMatcher, Blocks
from steptwin.wbc.dialect import Dialect
from steptwin.wbc.events import BY_LABEL, HARD_PREFIX, HARD_SINCE, INPUT_LABELS, PREFIX, InterruptEvent
from steptwin.wbc.positions import PositionTable, rows_text
from steptwin.wbc.registers import PREDEFINED, ROW_0, parts
from steptwin.wbc.scope import ProgramScope
from steptwin.wbc.statements import FUNCTIONS, KEYWORDS
from steptwin.wbc.tree import (
    Assign,
    Broken,
    Identifier,
    ImageRecord,
    KeywordStatement,
    Label,
    PositionRecord,
    ProgramTree,
    StatementNode,
)

A_PREDEFINED_NAME = Message("wbc.a-predefined-name", "a predefined name")
NOTHING_FOLLOWS_THE_LABEL = Message("wbc.nothing-follows-the-label", "nothing follows the label {name}")
NOT_AN_INTERRUPT_LABEL = Message(
    "wbc.not-an-interrupt-label", "{name} is not an interrupt label, although it begins with INT_ or HARDINT_"
)
INTERRUPT_LABELS = Message(
    "wbc.interrupt-labels", "{names}; firmware 1.70 also INT_TICK100, INT_TICK1000, INT_M1…INT_M4 and HARDINT_…"
)
EVENT_HAS_ONE_LABEL = Message("wbc.event-has-one-label", "an event has one label")
LINES_OF_FIRMWARE = Message("wbc.lines-of-firmware", "firmware {firmware} holds {limit} executable lines")
CANNOT_BE_A_LABEL = Message("wbc.cannot-be-a-label", "{name} cannot be a label: it is {reason}")
PUT_AFTER_IT = Message("wbc.put-after-it", "put {end} after it")
LABEL_IS_DEFINED_TWICE = Message("wbc.label-is-defined-twice", "the label {name} is defined twice")
GIVE_ONE_OF_THEM_ANOTHER_NAME = Message("wbc.give-one-of-them-another-name", "give one of them another name")
A_VARIABLE = Message("wbc.a-variable", "a variable")
LABEL_NEEDS_FIRMWARE = Message("wbc.label-needs-firmware", "the label {name} needs firmware {since}")
BREAKS_IN = Message("wbc.breaks-in", "checked for {firmware}; {label} breaks into the statement in progress")
LABELS_OF_ONE_EVENT = Message("wbc.labels-of-one-event", "{name} and {other} are labels of one event")
ROW_IS_OUTSIDE_THE_POSITION_TABLE = Message("wbc.row-is-outside-the-position-table", "row {index} is outside the position table")
EXECUTABLE_LINES = Message("wbc.executable-lines", "{count} executable lines")


@dataclass(slots=True)
class ProgramOutline:
    """The structure of a program. Steps are numbered from 0."""

    lines: list[StatementNode] = field(default_factory=list)
    """The statement of each step."""
    labels: dict[str, int] = field(default_factory=dict)
    """Steps at labels, by name in upper case."""
    entries: dict[InterruptEvent, int] = field(default_factory=dict)
    """Steps at labels of interrupts."""
    records: dict[int, bytes] = field(default_factory=dict)
    """Rows of the position table that the text has as records of an image."""
    blocks: Blocks = field(default_factory=Blocks)
    has_broken_labels: bool = False
    """A statement that could not be read may have been a label."""
    writes_row_0: bool = False
    """The program assigns parameters of row 0 (WBC-25)."""


def outline(
    program: ProgramTree, scope: ProgramScope, positions: PositionTable | None, dialect: Dialect, diagnostics: list[Diagnostic]
) -> ProgramOutline:
    """The structure of ``program``; ``diagnostics`` gets the errors of labels, blocks, records and the number of steps."""
    return _Outliner(scope, positions, dialect, diagnostics).outline(program)


class _Outliner:
    def __init__(
        self, scope: ProgramScope, positions: PositionTable | None, dialect: Dialect, diagnostics: list[Diagnostic]
    ) -> None:
        self._scope = scope
        self._positions = positions
        self._dialect = dialect
        self._diagnostics = diagnostics
        self._matcher = BlockMatcher(diagnostics)
        self._defined: set[str] = set()
        self._outline = ProgramOutline()

    def outline(self, program: ProgramTree) -> ProgramOutline:
        result = self._outline
        assigned: dict[str, Identifier] = {}
        last: Label | None = None
        for line in program.lines:
            statement = line.statement
            if isinstance(statement, Label):
                self._define_label(statement)
                last = statement
            elif statement is not None and self._take(statement):
                result.lines.append(statement)
                last = None
            if isinstance(statement, Assign):
                assigned.setdefault(statement.target.key, statement.target)
        result.writes_row_0 = any(self._scope.family(name) in ROW_0 for name in assigned.values())
        if last is not None:
            end = "RETURN" if last.name.key in BY_LABEL else "END"
            message = NOTHING_FOLLOWS_THE_LABEL(name=last.name.text)
            self._report(f.LABEL_AT_END.at(last.name, message, PUT_AFTER_IT(end=end), f.after(last, f"\n{end}")))
        self._check_length()
        result.blocks = self._matcher.finish()
        return result

    def _take(self, statement: StatementNode) -> bool:
        """Take in a statement other than a label. Result: whether it is a step."""
        result = self._outline
        if isinstance(statement, KeywordStatement):
            if statement.keyword in BLOCK_WORDS:
                self._matcher.take(statement.keyword, len(result.lines), statement)
            return True
        if isinstance(statement, Broken):
            if statement.label is not None:
                result.labels.setdefault(statement.label.key, len(result.lines))
                return False
            if statement.keyword is not None:
                self._matcher.take(statement.keyword, len(result.lines), statement)
            if ":" in statement.text:
                result.has_broken_labels = True
            return True
        if isinstance(statement, PositionRecord):
            result.records[statement.index] = statement.data
            self._check_record(statement)
        return isinstance(statement, Assign | ImageRecord)

    def _define_label(self, label: Label) -> None:
        name, key = label.name, label.name.key
        if key in self._defined:
            self._report(f.DUPLICATE_LABEL.at(name, LABEL_IS_DEFINED_TWICE(name=name.text), GIVE_ONE_OF_THEM_ANOTHER_NAME()))
            return
        self._defined.add(key)
        self._outline.labels[key] = len(self._outline.lines)
        interrupt = BY_LABEL.get(key)
        if interrupt is None:
            self._check_name(name)
        else:
            self._define_entry(label, *interrupt)

    def _check_name(self, name: Identifier) -> None:
        """Report a label that looks like that of an interrupt, or that has another meaning."""
        key = name.key
        reason = _reserved_label(key)
        if key.startswith((PREFIX, HARD_PREFIX)) and key not in PREDEFINED:
            message = NOT_AN_INTERRUPT_LABEL(name=name.text)
            known = f"INT_IN1…INT_IN{INPUT_LABELS}, INT_MODBUS, INT_TICK"
            hint = INTERRUPT_LABELS(names=known)
            self._report(f.RESERVED_LABEL.at(name, message, hint))
        elif key in self._scope.constants or key in self._scope.variables:
            reason = f.A_CONSTANT() if key in self._scope.constants else A_VARIABLE()
            message = CANNOT_BE_A_LABEL(name=name.text, reason=reason)
            self._report(f.RESERVED_LABEL.at(name, message, GIVE_ONE_OF_THEM_ANOTHER_NAME()))
        elif reason is not None:
            self._report(f.RESERVED_LABEL.at(name, CANNOT_BE_A_LABEL(name=name.text, reason=reason), f.TAKE_ANOTHER_NAME()))

    def _define_entry(self, label: Label, event: InterruptEvent, hard: bool) -> None:
        """The label of an interrupt is a step of its own."""
        name, entries = label.name, self._outline.entries
        since = HARD_SINCE if hard else event.since
        if not self._dialect.has(since):
            soft = PREFIX + event.name if hard and self._dialect.has(event.since) else None
            firmware = self._dialect.firmware
            hint = f.CHECKED_FOR(firmware=firmware) if soft is None else BREAKS_IN(firmware=firmware, label=soft)
            self._report(f.NOT_IN_FIRMWARE.at(name, LABEL_NEEDS_FIRMWARE(name=name.text, since=since), hint, fix=soft))
        if event in entries:
            other = (PREFIX if hard else HARD_PREFIX) + event.name
            hint = EVENT_HAS_ONE_LABEL()
            self._report(f.DUPLICATE_LABEL.at(name, LABELS_OF_ONE_EVENT(name=name.text, other=other), hint))
        else:
            entries[event] = len(self._outline.lines)
        self._outline.lines.append(label)

    def _check_record(self, record: PositionRecord) -> None:
        rows = self._dialect.max_positions if self._positions is None else len(self._positions.rows)
        if record.index >= rows:
            hint = f.NUMBERED_ROWS_OF_TABLE(rows=rows_text(rows))
            self._report(f.OUT_OF_RANGE.at(record, ROW_IS_OUTSIDE_THE_POSITION_TABLE(index=record.index), hint))

    def _check_length(self) -> None:
        lines, limit = self._outline.lines, self._dialect.max_steps
        if len(lines) > limit:
            hint = LINES_OF_FIRMWARE(firmware=self._dialect.firmware, limit=limit)
            self._report(f.TOO_MANY_LINES.at(lines[limit], EXECUTABLE_LINES(count=len(lines)), hint))

    def _report(self, diagnostic: Diagnostic) -> None:
        self._diagnostics.append(diagnostic)


def _reserved_label(key: str) -> str | None:
    if key in KEYWORDS:
        return f.A_STATEMENT()
    if parts(key) is not None:
        return f.A_REGISTER()
    if key in PREDEFINED:
        return A_PREDEFINED_NAME()
    if key in FUNCTIONS:
        return f.A_FUNCTION()
    return None
