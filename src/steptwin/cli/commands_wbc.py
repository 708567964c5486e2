"""The tables of WBC, the program language of the MIC488, for ``steptwin commands mic488``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from steptwin.cli.pages import PageSection

if TYPE_CHECKING:
    from steptwin.wbc.dialect import Dialect
    from steptwin.wbc.registers import RegisterRow


def sections_of(dialect: Dialect) -> list[PageSection]:
    """The tables of the language, each with its columns, as far as a firmware has them."""
    return [
        _statements(dialect),
        _functions(),
        _operators(),
        _registers(dialect),
        _names(),
        _interrupts(dialect),
        _limits(dialect),
        _findings(),
    ]


def _statements(dialect: Dialect) -> PageSection:
    from steptwin.wbc.statements import ASSIGNMENTS, STATEMENTS

    rows = [*ASSIGNMENTS, *((row.usage, row.meaning) for row in STATEMENTS.values() if dialect.has(row.since))]
    return PageSection("Statements", ("statement", "meaning"), rows)


def _functions() -> PageSection:
    from steptwin.wbc.statements import FUNCTIONS

    rows = [(f"{row.name}({', '.join('XY'[: row.arguments])})", row.meaning) for row in FUNCTIONS.values()]
    return PageSection("Functions", ("function", "meaning"), rows)


def _operators() -> PageSection:
    from steptwin.wbc.statements import COMPARISONS, OPERATORS

    rows = [*((sign, "SET", meaning) for sign, meaning in OPERATORS.items())]
    rows += [(sign, "conditions", meaning) for sign, meaning in COMPARISONS.items()]
    return PageSection("Operators", ("operator", "in", "meaning"), rows)


def _registers(dialect: Dialect) -> PageSection:
    from steptwin.wbc.registers import REGISTERS

    rows = [
        (row.spelling(dialect), row.access, row.unit, str(row.reads), _written(row), row.meaning)
        for row in REGISTERS
        if dialect.has(row.since)
    ]
    return PageSection("Registers", ("register", "access", "unit", "reads", "takes", "meaning"), rows)


def _written(row: RegisterRow) -> str:
    if row.writes is None:
        return ""
    return f"{row.writes}, else the nearest" if row.saturates else str(row.writes)


def _names() -> PageSection:
    from steptwin.wbc.registers import PREDEFINED

    return PageSection("Predefined names", ("name", "value"), [(name, f"{value:g}") for name, value in PREDEFINED.items()])


def _interrupts(dialect: Dialect) -> PageSection:
    from steptwin.wbc.events import EVENTS, HARD_PREFIX, HARD_SINCE, INPUTS, PREFIX

    rows = []
    for event in EVENTS:
        if not dialect.has(event.since) or event.input > INPUTS:
            continue
        hard = HARD_PREFIX + event.name if dialect.has(HARD_SINCE) else ""
        rows.append((PREFIX + event.name, hard, event.register or "configuration only (Int)"))
    return PageSection("Interrupts", ("label", "label that waits for the statement's end", "enabled by"), rows)


def _limits(dialect: Dialect) -> PageSection:
    rows = [
        ("executable lines", str(dialect.max_steps)),
        ("variables", str(dialect.max_variables)),
        ("rows of the position table", str(dialect.max_positions)),
        ("user registers", str(dialect.user_registers)),
    ]
    return PageSection("Limits", ("what", "at most"), rows)


def _findings() -> PageSection:
    from steptwin.wbc.findings import FINDINGS

    rows = [(row.code, row.severity.value, row.title) for row in FINDINGS.values()]
    return PageSection("What the checker finds", ("code", "severity", "finding"), rows)
