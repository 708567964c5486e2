"""Data sheets and tables as lines of text, for golden files that are reviewed once against the manuals."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

from steptwin.datasheet import Datasheet
from steptwin.jsonvalues import to_json


def line(item: Any) -> str:
    """Every field of a row that is not empty, in the order of its definition."""
    values = {field.name: getattr(item, field.name) for field in fields(item)} if is_dataclass(item) else item
    if isinstance(values, Mapping):
        values = {name: value if isinstance(value, range) else to_json(value) for name, value in values.items()}
    return json.dumps(_filled(values), ensure_ascii=False, default=str)


def _filled(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _filled(one) for name, one in value.items() if one is not False and one not in ("", [], {}, None)}
    return [_filled(one) for one in value] if isinstance(value, list) else value


def sheet_lines(sheet: Datasheet) -> list[str]:
    found = []
    for field in fields(sheet):
        value = getattr(sheet, field.name)
        rows = value if isinstance(value, tuple) else (value,)
        found += [f"{field.name}: {line(row)}" for row in rows]
    return found


def missing(sheet: Datasheet, other: Datasheet) -> list[str]:
    """What ``sheet`` has and ``other`` has not: points, commands, pins and so on, by their names."""
    return [
        f"{field.name}: {name}"
        for field in fields(sheet)
        if isinstance(getattr(sheet, field.name), tuple)
        for name in dict.fromkeys(map(_name, getattr(sheet, field.name)))
        if name not in map(_name, getattr(other, field.name))
    ]


def _name(row: Any) -> str:
    given = to_json(row)
    return given if isinstance(given, str) else str(given.get("path") or given.get("name") or given["code"])
