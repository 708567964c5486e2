"""The past of twins and devices in a database: SQLite, or PostgreSQL (docs/history.md).

`steptwin.history.reading.HistoryDatabase` reads it; ``[history]`` of a description keeps it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from steptwin.history.reading import HistoryDatabase as HistoryDatabase


def __getattr__(name: str) -> object:
    """Reading needs numpy, keeping does not."""
    if name == "HistoryDatabase":
        from steptwin.history.reading import HistoryDatabase

        return HistoryDatabase
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
