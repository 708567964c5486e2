"""Descriptions of generated worlds: controllers on one line, as a text that a person can go on with.

What the controllers of a kind are given is made beside the kind: `steptwin.simulation.describe.generated_mic488`.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from typing import Any, NamedTuple

from steptwin.controller import Nanos
from steptwin.durations import duration_text
from steptwin.simulation.describe.tables import all_keys, written
from steptwin.simulation.faults.table import Fault, value_text

LINE = "bus"
"""Name of the line."""
_COMMENT = 44
"""The column of comments."""
MOST_IN_A_ROW = 8
"""A longer list has a line for each element."""
_BARE = re.compile(r"[A-Za-z0-9_-]+\Z")


@dataclass(frozen=True, slots=True)
class TomlTable:
    """A table of a description. Values that are None are left out; ``header`` where it is not that of its kind."""

    kind: str
    values: Mapping[str, object]
    _: KW_ONLY
    header: str = ""
    remark: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Whole:
    """Parts of a generated world besides its controllers. ``line`` are values of ``[[line]]``."""

    name: str
    line: Mapping[str, object] = field(default_factory=dict)
    seed: int = 0
    state: str | None = None
    trace: str | None = None
    faults: Sequence[Fault] = ()


class InputChange(NamedTuple):
    """An input of a controller takes a level at a moment; ``note`` goes into the trace before it."""

    time: Nanos
    pin: str
    """``CONTROLLER.PIN``."""
    level: float
    note: str


def generated_world(
    whole: Whole, line_kind: str, tables: Iterable[TomlTable], changes: Iterable[InputChange] = (), example: str = ""
) -> str:
    """The description: the world, a line of a kind, what is on it and around it (``tables``), and at the end an example of what
    may follow."""
    return _text([_world(whole), _line(whole, line_kind), *tables, *_changes(changes), *_faults(whole.faults)]) + example


def _world(whole: Whole) -> TomlTable:
    values = {"name": whole.name, "seed": whole.seed or None, "state": whole.state, "trace": whole.trace}
    return TomlTable("world", values, remark="Run it with 'steptwin up FILE'; 'steptwin up --keys' shows what else it may have.")


def _line(whole: Whole, kind: str) -> TomlTable:
    return TomlTable("line", {"name": LINE, "kind": kind, **whole.line})


def _changes(changes: Iterable[InputChange]) -> Iterator[TomlTable]:
    for change in changes:
        steps = [{"note": change.note}, {"set": {change.pin: change.level}}]
        yield TomlTable("event", {"at": duration_text(change.time), "steps": steps})


def _faults(faults: Iterable[Fault]) -> Iterator[TomlTable]:
    for fault in faults:
        given = {key: value_text(value) if isinstance(value, tuple) else value for key, value in fault.given.items()}
        values = {"kind": fault.kind.name, "name": fault.name or None, **given}
        yield TomlTable("fault", values, header="[[fault]]")


# ---------------------------------------------------------------------- text


def _text(tables: Iterable[TomlTable]) -> str:
    """TOML; keys are explained where they stand for the first time."""
    explained: set[str] = set()
    return "\n".join(_table_text(table, explained) for table in tables)


def _table_text(table: TomlTable, explained: set[str]) -> str:
    lines = [f"# {table.remark}"] if table.remark else []
    lines.append(table.header or written(table.kind))
    meanings = {key.name: key.meaning for key in all_keys().get(table.kind, ())}
    for name, value in table.values.items():
        if value is not None:
            line = f"{name} = {_value(value)}"
            meaning = meanings.get(name) if (place := f"{table.kind}.{name}") not in explained else None
            explained.add(place)
            lines.append(line if meaning is None or "\n" in line else f"{line:<{_COMMENT}}  # {meaning}")
    return "\n".join(lines) + "\n"


def _value(value: Any) -> str:
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(str(key))} = {_value(item)}" for key, item in value.items()) + " }"
    if isinstance(value, tuple | list) and len(value) > MOST_IN_A_ROW:
        return "[\n" + "".join(f"  {_value(item)},\n" for item in value) + "]"
    if isinstance(value, tuple | list):
        return "[" + ", ".join(map(_value, value)) + "]"
    return repr(value)


def _key(name: str) -> str:
    return name if _BARE.match(name) else _value(name)
