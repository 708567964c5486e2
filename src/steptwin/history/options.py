"""``[history]``: its keys. Imports no library, so that descriptions are checked where none is installed."""

from __future__ import annotations

from steptwin.controller import MILLISECOND, Nanos
from steptwin.simulation.describe.servicetables import HISTORY, ServiceTable
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.table import TableSpec, key, read_spec, table
from steptwin.simulation.toml.values import number, positive_time, text_value, texts, whole

MOST_DAYS = 36_500


@table(f"[{HISTORY}]")
class HistorySpec(TableSpec):
    """Files are relative to the description."""

    database: str = key(text_value, "where it is kept: sqlite:///FILE or postgresql://HOST/NAME")
    interval: Nanos = key(positive_time, "how often values that come without events are read", default=100 * MILLISECOND)
    registers: tuple[str, ...] = key(
        texts, "further points to keep: CONTROLLER.POINT, such as table.USER_REGISTER[5]", default=()
    )
    dead_band: float = key(number(0.0), "changes of numbers up to this much, in their unit, are not kept", default=0.0)
    keep_days: int | None = key(
        whole(1, MOST_DAYS), "values older than this are removed, their summaries stay; default: none", default=None
    )
    spool: str | None = key(
        text_value, "folder for what the database has not taken yet; default NAME.spool beside the file", default=None
    )


def read_history(text: TomlText) -> HistorySpec | None:
    """The table of a description, None without one; errors are added to ``text``."""
    given = text.data.get(HISTORY)
    return None if given is None else read_spec(text, (HISTORY,), HistorySpec, given)


HISTORY_TABLE = ServiceTable(name=HISTORY, rows=HistorySpec.rows, check=read_history)
