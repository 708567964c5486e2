"""Tables of a description that belong to services beside its world: ``[history]`` and ``[gateway.NAME]``.

A description keeps them as they are written, in `TomlText.data` with their places. Where the rooms that own them have registered
them (`steptwin.services`) they are checked as all others; without, the simulation alone still reads the description.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from steptwin.errors import Misuse
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.table import TableRows

HISTORY, GATEWAY = "history", "gateway"
SERVICES = (HISTORY, GATEWAY)


@dataclass(frozen=True, slots=True, kw_only=True)
class ServiceTable:
    """A table of a description, as its owner knows it."""

    name: str
    """One of `SERVICES`."""
    rows: TableRows | None = None
    """Keys of the table itself. None for one that holds tables only."""
    inner: Mapping[str, TableRows] = field(default_factory=dict)
    """Tables in it, by name."""
    check: Callable[[TomlText], object]
    """Reads it where a description has one, and adds errors to the text."""


SERVICE_TABLES: dict[str, ServiceTable] = {}
"""Registered tables by name, in the order of their registration."""


def register(table: ServiceTable) -> None:
    """From now on descriptions are checked for this table, too. Raises `Misuse` for a name that descriptions do not keep."""
    if table.name not in SERVICES:
        raise Misuse(f"{table.name!r} is not one of {', '.join(SERVICES)}")
    SERVICE_TABLES[table.name] = table


def inner_tables() -> dict[str, TableRows]:
    """Tables in those of services, by how they are written."""
    return {rows.written: rows for table in SERVICE_TABLES.values() for rows in table.inner.values()}
