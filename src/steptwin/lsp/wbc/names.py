"""Meanings of the names of a program, in words: for hovers, completions and hints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from steptwin.lsp.wbc.surroundings import ProgramContext
from steptwin.wbc import steps as s
from steptwin.wbc.events import BY_LABEL, BY_REGISTER
from steptwin.wbc.positions import PositionRow, number_text
from steptwin.wbc.real import real_text
from steptwin.wbc.registers import PREDEFINED, REAL, VALUE_NAMES, Domain, RegisterRow, parts
from steptwin.wbc.scope import ProgramScope
from steptwin.wbc.statements import ASSIGNMENTS, FUNCTIONS, STATEMENTS, StatementRow
from steptwin.wbc.tree import ConstantDefinition, Label, ProgramTree

_HELP = "Help of the vendor's tool, firmware 1.25"
_STATEMENT_OPTIONAL_WORD = ASSIGNMENTS[1][1]


@dataclass(frozen=True, slots=True)
class Names:
    """The names of a program in its present text. ``labels``: names as written by key; ``values``: the meanings of constants."""

    program: ProgramTree
    scope: ProgramScope
    labels: Mapping[str, str]
    values: Mapping[str, str]
    around: ProgramContext

    @classmethod
    def of(cls, program: ProgramTree, around: ProgramContext) -> Names:
        labels: dict[str, str] = {}
        values: dict[str, str] = {}
        naming = program.naming
        for statement in naming:
            if isinstance(statement, Label):
                labels.setdefault(statement.name.key, statement.name.text)
            elif isinstance(statement, ConstantDefinition):
                values.setdefault(statement.name.key, statement.value.text)
        return cls(program, ProgramScope(program, around.positions, around.dialect, []), labels, values, around)

    def meaning(self, key: str) -> str:
        """Value of a constant, as it is written."""
        return self.values.get(key, "")


def source(since: str | None) -> str:
    return f"*{_HELP}*" if since is None else f"*Manual of firmware {since}*"


def statement_text(row: StatementRow) -> str:
    return f"```wbc\n{row.usage}\n```\n{row.meaning}\n\n{source(row.since)}"


def keyword_text(key: str) -> str | None:
    """The kind of operand of a statement or SET."""
    if key in STATEMENTS:
        return statement_text(STATEMENTS[key])
    if key == "SET":
        ways = "\n".join(form for form, _ in ASSIGNMENTS[1:])
        return f"```wbc\n{ways}\n```\n{_STATEMENT_OPTIONAL_WORD} Calculates one operation at most.\n\n{source(None)}"
    return None


def register_text(key: str, around: ProgramContext) -> str | None:
    found = parts(key)
    if found is None:
        return None
    row, number = found
    dialect = around.dialect
    name = f"{row.name}{number}" if row.last or row.words else row.name
    lines = [f"```wbc\n{name}\n```", _sentence(row.meaning), f"{_access(row)}."]
    unit = unit_of(row, number, around)
    if unit:
        lines.append(f"Unit: {unit}.")
    if row.saturates:
        lines.append("A number outside becomes the nearest one inside.")
    numbers = row.numbers(dialect)
    if numbers:
        lines.append(f"All: {row.spelling(dialect)}.")
    if not dialect.has(row.since):
        lines.append(f"**Needs firmware {row.since}.**")
    event = BY_REGISTER.get(key)
    if event is not None:
        lines.append(f"Enables the interrupt at the label `INT_{event.name}`.")
    return "\n\n".join([*lines, source(row.since)])


def unit_of(row: RegisterRow, number: int, around: ProgramContext) -> str:
    """The unit of a register; with a configuration that of its axis."""
    config = around.config
    if not row.unit or config is None or not row.unit.startswith("u") or row.last != len(config.axes) or number < 1:
        return row.unit
    if number > len(config.axes):
        return row.unit
    axis = config.axes[number - 1]
    return f"{row.unit.replace('u', axis.unit_name, 1)} ({axis.gear:g} pulses per {axis.unit_name})"


def _access(row: RegisterRow) -> str:
    names = VALUE_NAMES.get(row.writes or row.reads, ())
    values = f" ({', '.join(names)})" if names else ""
    reads = _numbers(row.reads)
    if row.writes is None:
        return f"Read-only: reads {reads}{values}"
    if row.writes == row.reads:
        return f"Reads and takes {reads}{values}"
    return f"Reads {reads}, takes {_numbers(row.writes)}{values}"


def _numbers(domain: Domain) -> str:
    return "any number (REAL)" if domain == REAL else f"numbers {domain}"


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}." if text else ""


def value_text(key: str) -> str:
    others = [name for name, value in PREDEFINED.items() if value == PREDEFINED[key] and name != key]
    also = f" Also written {', '.join(others)}." if others else ""
    return f"```wbc\n{key}\n```\nPredefined: {PREDEFINED[key]:g}.{also}"


def function_text(key: str) -> str | None:
    row = FUNCTIONS.get(key)
    if row is None:
        return None
    return f"```wbc\nSET X = {row.name}({', '.join('YZ'[: row.arguments])})\n```\n{_sentence(row.meaning)}\n\n{source(None)}"


def constant_text(key: str, names: Names) -> str:
    value = names.scope.known.get(key)
    written = names.meaning(key)
    lines = [f"```wbc\n#{names.scope.constants[key].text} {written}\n```"]
    if isinstance(value, s.RegisterOperand):
        lines.append(f"Constant: another name of {value.name}.")
        text = register_text(value.name.upper(), names.around)
        lines.append(text or "")
    elif isinstance(value, s.Literal):
        lines.append(f"Constant: {real_text(value.value)}.")
    return "\n\n".join(lines)


def variable_text(key: str, names: Names) -> str:
    scope = names.scope
    count = len(scope.variables)
    number = list(scope.variables).index(key) + 1
    most = names.around.dialect.max_variables
    return f"```wbc\n{scope.variables[key].text}\n```\nVariable (REAL), {number} of {count}; a program has at most {most}."


def label_text(key: str, names: Names, jumps: int) -> str:
    text = f"```wbc\n{names.labels.get(key, key)}:\n```\n"
    event = BY_LABEL.get(key)
    if event is not None:
        hard = " It waits for the end of the statement in progress." if event[1] else ""
        enables = f" `{event[0].register}` enables it." if event[0].register else ""
        return f"{text}Label of the interrupt {event[0].name}.{enables}{hard}"
    count = "no JUMP comes" if jumps == 0 else "1 JUMP comes" if jumps == 1 else f"{jumps} JUMPs come"
    return f"{text}Label: {count} here."


def row_values(row: PositionRow) -> str:
    """``40,5; 60; x; x``."""
    return "; ".join("x" if value is None else number_text(value) for value in row.values)


def position_text(key: str, around: ProgramContext) -> str:
    table = around.positions
    if table is None:
        return "Position: there is no table of the same name beside the program."
    index = table.index(key)
    if index is None:
        return f"There is no position {key} in the table."
    row = table.rows[index]
    cells = [f"p{n} = {'x' if value is None else number_text(value)}" for n, value in enumerate(row.values, 1)]
    return f"```wbc\n@{row.name}\n```\nRow {index} of {len(table.rows)}: {', '.join(cells)}"
