"""Every field of the tables of the language, reviewed once against the reference: golden/tables.txt.

Regenerate with ``python tests/wbc/test_tables_golden.py`` and read the diff.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from steptwin.wbc.dialect import DIALECTS
from steptwin.wbc.events import BY_LABEL, EVENTS
from steptwin.wbc.findings import FINDINGS
from steptwin.wbc.registers import PREDEFINED, REAL, REGISTERS, ROW_0, VALUE_NAMES, Domain
from steptwin.wbc.statements import FUNCTIONS, STATEMENTS

GOLDEN = Path(__file__).parent / "golden" / "tables.txt"


def domain(values: Domain | None) -> str:
    if values is None:
        return "–"
    if values == REAL:
        return "REAL"
    return f"{values}{' whole' if values.whole else ''} ({values.low:.9g} to {values.high:.9g})"


def tables() -> Iterator[str]:
    for dialect in DIALECTS.values():
        sizes = f"{dialect.user_registers} user registers, {dialect.max_steps} steps"
        yield f"firmware {dialect.firmware}: {sizes}, {dialect.max_positions} positions, {dialect.max_variables} variables"
    yield f"REAL is {REAL.low!r} to {REAL.high!r}"
    for row in REGISTERS:
        names = ", ".join(dict.fromkeys(row.spelling(dialect) for dialect in DIALECTS.values()))
        marks = f"{'saturates ' if row.saturates else ''}{'row 0 ' if row.key in ROW_0 else ''}{row.since or ''}"
        values = " ".join(VALUE_NAMES.get(row.writes or row.reads, ()))
        yield f"register {names} | {domain(row.reads)} | {domain(row.writes)} | {row.unit} | {row.words} | {marks}| {values}"
    yield from (f"name {name} = {value:g}" for name, value in PREDEFINED.items())
    for statement in STATEMENTS.values():
        kinds = " ".join(operand.kind.name for operand in statement.operands)
        yield f"statement {statement.usage} | {kinds} | {statement.in_parentheses} | {statement.since}"
    yield from (f"function {row.name} of {row.arguments}" for row in FUNCTIONS.values())
    for event in EVENTS:
        labels = " ".join(label + (" hard" if hard else "") for label, (one, hard) in BY_LABEL.items() if one is event)
        yield f"event {event.name} | {event.register} | {event.since} | {event.input} {event.axis} {event.period} | {labels}"
    yield from (f"message {code} {finding.severity.value}" for code, finding in FINDINGS.items())


def test_tables_are_the_reviewed_ones() -> None:
    assert list(tables()) == GOLDEN.read_text(encoding="utf-8").splitlines()


if __name__ == "__main__":
    GOLDEN.write_text("".join(line + "\n" for line in tables()), encoding="utf-8")
