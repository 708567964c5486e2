"""``[history]``: the database in which the past of a world or of devices is kept. What keeps it is `steptwin.history`."""

from __future__ import annotations

from dataclasses import dataclass

from steptwin.machine import MILLISECOND, Nanos
from steptwin.simulation.toml.reader import Key, TomlText, optional, read_table
from steptwin.simulation.toml.table import TableRows
from steptwin.simulation.toml.tomlplaces import Path
from steptwin.simulation.toml.values import number, positive_time, text_value, texts, whole

HISTORY = "history"
MOST_DAYS = 36_500


@dataclass(frozen=True, slots=True, kw_only=True)
class HistorySpec:
    """Files are relative to the description."""

    database: str
    """``sqlite:///FILE``, or the URL of a PostgreSQL database."""
    interval: Nanos
    """How often values that come without events are looked at, ns."""
    registers: tuple[str, ...]
    """Further points to keep: ``MACHINE.POINT``."""
    dead_band: float
    """Changes of numbers up to this much, in their unit, are not kept."""
    keep_days: int | None
    """Values older than this are removed; their summaries stay. None: nothing is."""
    spool: str | None
    """The folder in which waits what the database has not taken yet. None: beside the description."""
    path: Path = (HISTORY,)


HISTORY_TABLE = TableRows(
    written=f"[{HISTORY}]",
    keys=(
        Key("database", text_value, "where it is kept: sqlite:///FILE or postgresql://HOST/NAME"),
        optional(positive_time, "interval", "how often values that come without events are looked at", 100 * MILLISECOND),
        optional(texts, "registers", "further points to keep: MACHINE.POINT, such as table.USER_REGISTER[5]", ()),
        optional(number(0.0), "dead_band", "changes of numbers up to this much, in their unit, are not kept", 0.0),
        optional(whole(1, MOST_DAYS), "keep_days", "values older than this are removed, their summaries stay; default: none"),
        optional(text_value, "spool", "folder for what the database has not taken yet; default NAME.spool beside the file"),
    ),
)


def read_history(text: TomlText) -> HistorySpec | None:
    """The table of a description, None without one; errors are added to ``text``."""
    given = text.data.get(HISTORY)
    if given is None:
        return None
    values = read_table(text, (HISTORY,), given, HISTORY_TABLE.keys)
    return HistorySpec(**values) if "database" in values else None
