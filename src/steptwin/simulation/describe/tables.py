"""What the TOML file of a world may contain: every table has rows, those of controllers and
elements in their kinds.

The reader, the messages and the reference page take them from here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Any

from steptwin.durations import duration
from steptwin.errors import Misuse
from steptwin.machine import MILLISECOND, Nanos
from steptwin.simulation.components.registry import ELEMENTS
from steptwin.simulation.describe.arrangement import DRAWING, DRAWING_TABLE
from steptwin.simulation.describe.pieces import USE, USES
from steptwin.simulation.describe.servicetables import SERVICE_TABLES, inner_tables
from steptwin.simulation.describe.steptable import STEPS
from steptwin.simulation.kinds.kind import AnyKind
from steptwin.simulation.kinds.links import LINK_KEYS, TLS_KEYS, TLS_NEED
from steptwin.simulation.kinds.registry import KINDS, line_kinds
from steptwin.simulation.toml.reader import Key, optional
from steptwin.simulation.toml.table import TableRows
from steptwin.simulation.toml.values import (
    flag,
    name_value,
    number,
    permitting,
    positive_time,
    text_value,
    time_value,
    whole,
    word,
)

MOST_GAP_MS = 10_000


@permitting("more than 0 to 10000 ms: number of ms, or text with unit")
def _gap(value: Any) -> Nanos:
    """Milliseconds, as the command line takes them, or a text such as ``"5 ms"``."""
    found = duration(value) if isinstance(value, str) else round(number(0.0, MOST_GAP_MS, above=True)(value) * MILLISECOND)
    if not 0 < found <= MOST_GAP_MS * MILLISECOND:
        raise Misuse(f"{value!r}: permitted are more than 0 and at most {MOST_GAP_MS} ms")
    return found


SEED = whole(0, 2**63 - 1)

KEYS: Mapping[str, tuple[Key, ...]] = {
    "world": (
        optional(text_value, "name", "a name for people", "world"),
        optional(SEED, "seed", "where all chance comes from", 0),
        optional(text_value, "trace", "what 'up' keeps of what happens: a FILE that grows, 'ring N' (records), or 'off'", "off"),
        optional(text_value, "state", "directory that keeps non-volatile memory; without it, memory ends with the world"),
    ),
    "line": (
        Key("name", name_value, "how controllers and scripts name it"),
        optional(text_value, "kind", "", "modbus"),
        optional(
            whole(300, 1_000_000),
            "baud",
            "bit/s; default that of the first controller, the highest of the chips",
        ),
        optional(
            word("real", "strict", "off"),
            "timing",
            "real: characters take their time; strict (modbus): and a pause above 750 us drops a frame; off",
            "off",
        ),
        optional(
            _gap,
            "gap",
            "silence in ms after which bytes of no frame are given up; default 0.75 on a serial port, else 20",
        ),
    ),
    "event": (
        optional(name_value, "name", "for the trace"),
        optional(time_value, "at", "when"),
        optional(positive_time, "every", "again and again"),
        optional(text_value, "when", "a condition, such as 'x.position > 100'"),
        optional(flag, "once", "when: only the first time the condition comes true", False),
        STEPS,
    ),
    "script": (
        Key("name", name_value, "for the trace"),
        optional(time_value, "at", "when it begins", 0),
        optional(whole(1, 10**9), "repeat", "how often all of it is done", 1),
        STEPS,
    ),
}

EVENT = TableRows(written="[[event]]", keys=KEYS["event"], need={"once": "when"})
SCRIPT = TableRows(written="[[script]]", keys=KEYS["script"])


def tables() -> Mapping[str, TableRows]:
    """Every table, in the order of a description: its name and seed, lines, controllers, elements, scripts, services, drawing."""
    return _tables_with(tuple(map(id, (*KINDS.values(), *ELEMENTS.values(), *LINK_KEYS.values(), *SERVICE_TABLES.values()))))


@lru_cache(maxsize=4)
def _tables_with(registered: tuple[int, ...]) -> Mapping[str, TableRows]:
    """As `tables`, until something else is registered."""
    found = {
        "world": TableRows(written="[world]", keys=KEYS["world"]),
        USE: USES,
        "line": TableRows(written="[[line]]", keys=_line_keys(), need=TLS_NEED, only=_only_of_lines()),
    }
    for kind in KINDS.values():
        found[kind.name] = TableRows(written=f"[[{kind.name}]]", keys=kind.keys, exclude=kind.exclusive)
    for element in ELEMENTS.values():
        found |= {element.name: element.rows, **element.inner}
    services = {name: table.rows for name, table in SERVICE_TABLES.items() if table.rows is not None}
    return found | {"event": EVENT, "script": SCRIPT} | services | {DRAWING: DRAWING_TABLE}


def _line_keys() -> tuple[Key, ...]:
    """What kinds of lines and links there are is known when all are registered."""
    meaning = " or ".join(kind.meaning for kind in line_kinds().values())
    own = (replace(key, read=word(*line_kinds()), meaning=meaning) if key.name == "kind" else key for key in KEYS["line"])
    return (*own, *(link.key for link in LINK_KEYS.values()), *TLS_KEYS)


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
        " to ".join(dict.fromkeys((names[0], names[-1]))): kind.inner_keys(names[0][len(kind.name) + 2 : -1])
        for names in groups.values()
    }


def _only_of_lines() -> Mapping[str, tuple[str, ...]]:
    """Keys of a line that not all kinds of lines have, and the kinds that do."""
    lines = {kind.name: (*kind.opened_by, *kind.keys) for kind in line_kinds().values()}
    keys = dict.fromkeys(key for keys in lines.values() for key in keys)
    having = {key: tuple(name for name, keys in lines.items() if key in keys) for key in keys}
    return {key: kinds for key, kinds in having.items() if len(kinds) < len(lines)}
