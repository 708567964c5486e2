"""Tables that the TOML file of a world may contain: every one has rows, those of controllers and
elements in their kinds.

The reader, the messages and the reference page take them from here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache

from steptwin.simulation.components.registry import ELEMENTS
from steptwin.simulation.describe.arrangement import DRAWING, DrawingSpec
from steptwin.simulation.describe.includes import USE, UseSpec
from steptwin.simulation.describe.servicetables import SERVICE_TABLES, inner_tables
from steptwin.simulation.describe.spec import EventSpec, ScriptSpec, WorldTable
from steptwin.simulation.kinds.kind import AnyKind
from steptwin.simulation.kinds.links import LINK_KEYS, TLS_NEED, LineSpec
from steptwin.simulation.kinds.registry import KINDS, line_kinds
from steptwin.simulation.toml.reader import Key
from steptwin.simulation.toml.table import TableRows
from steptwin.simulation.toml.values import word


def tables() -> Mapping[str, TableRows]:
    """Every table, in the order of a description: its name and seed, lines, controllers, elements, scripts, services, drawing."""
    return _tables_with(tuple(map(id, (*KINDS.values(), *ELEMENTS.values(), *LINK_KEYS.values(), *SERVICE_TABLES.values()))))


@lru_cache(maxsize=4)
def _tables_with(registered: tuple[int, ...]) -> Mapping[str, TableRows]:
    """As `tables`, until something else is registered."""
    found = {"world": WorldTable.rows, USE: UseSpec.rows, "line": _line_rows()}
    for kind in KINDS.values():
        found[kind.name] = kind.spec.rows
    for element in ELEMENTS.values():
        found |= {element.name: element.rows, **element.inner}
    services = {name: table.rows for name, table in SERVICE_TABLES.items() if table.rows is not None}
    return found | {"event": EventSpec.rows, "script": ScriptSpec.rows} | services | {DRAWING: DrawingSpec.rows}


def _line_rows() -> TableRows:
    """Keys of lines with the kinds of lines and links that are registered."""
    meaning = " or ".join(kind.meaning for kind in line_kinds().values())
    only = _only_of_lines()
    own = [replace(key, read=word(*line_kinds()), meaning=meaning) if key.name == "kind" else key for key in LineSpec.rows.keys]
    links = (link.key for link in LINK_KEYS.values())
    keys = (*(key for key in own if key.name not in TLS_NEED), *links, *(key for key in own if key.name in TLS_NEED))
    rules = (replace(key, kinds=only.get(key.name, ()), needs=TLS_NEED.get(key.name, "")) for key in keys)
    return TableRows(written=LineSpec.rows.written, keys=tuple(rules))


def all_keys() -> dict[str, tuple[Key, ...]]:
    """The rows of every table."""
    return {name: rows.keys for name, rows in tables().items()}


def written(table: str) -> str:
    """How a table is written."""
    rows = tables().get(table)
    return f"[[{table}]]" if rows is None else rows.written


def written_tables() -> dict[str, tuple[Key, ...]]:
    """The rows of every table by how it is written, those in tables of controllers and services too."""
    found: dict[str, tuple[Key, ...]] = {}
    for name, keys in all_keys().items():
        found[written(name)] = keys
        if name in KINDS:
            found |= _inner_tables(KINDS[name])
    return found | {name: rows.keys for name, rows in inner_tables().items()}


def _inner_tables(kind: AnyKind) -> dict[str, tuple[Key, ...]]:
    """Those that differ by their numbers alone are together."""
    groups: dict[str, list[str]] = {}
    for name in kind.inner_tables:
        groups.setdefault(name.rstrip("0123456789"), []).append(f"[{kind.name}.{name}]")
    return {
        " to ".join(dict.fromkeys((names[0], names[-1]))): kind.inner_tables[names[0][len(kind.name) + 2 : -1]]
        for names in groups.values()
    }


def _only_of_lines() -> Mapping[str, tuple[str, ...]]:
    """Keys of a line that not all kinds of lines have, and the kinds that do."""
    lines = {kind.name: (*kind.opened_by, *kind.keys) for kind in line_kinds().values()}
    keys = dict.fromkeys(key for keys in lines.values() for key in keys)
    having = {key: tuple(name for name, keys in lines.items() if key in keys) for key in keys}
    return {key: kinds for key, kinds in having.items() if len(kinds) < len(lines)}
