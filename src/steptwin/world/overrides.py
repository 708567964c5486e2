"""Parameters of a description that take other values than its text has: ``{"axis.x.pitch": 4.0, "mic488.table.M1.gear": 2}``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

from steptwin.errors import Misuse
from steptwin.nearmiss import NearMiss

Overrides: TypeAlias = Mapping[str, Any]
"""By key with its tables, joined by points. Of several tables of a kind one is chosen by its name, or by its number from 0."""

NO_OVERRIDES: Overrides = {}


def override(data: dict[str, Any], overrides: Overrides) -> None:
    """Put the values into what was read from TOML. Raises `Misuse` for tables that are not there."""
    for key, value in overrides.items():
        *tables, last = key.split(".")
        inner: Any = data
        for table in tables:
            inner = _inside(inner, table, key)
        if not isinstance(inner, dict) or not tables:
            raise Misuse(f"override {key!r}: expected TABLE.KEY or TABLE.NAME.KEY, such as 'axis.x.pitch'")
        inner[last] = value


def _inside(holder: Any, wanted: str, key: str) -> Any:
    known: dict[str, Any] = {}
    if isinstance(holder, dict):
        known = holder
    elif isinstance(holder, list):
        known = {str(number): table for number, table in enumerate(holder)}
        known |= {table["name"]: table for table in holder if isinstance(table, dict) and isinstance(table.get("name"), str)}
    if wanted not in known:
        raise Misuse(f"override {key!r}: there is no {wanted!r}{NearMiss().hint(wanted, known)}")
    return known[wanted]
