"""Records of a trace in words."""

from __future__ import annotations

from steptwin.machine import SECOND
from steptwin.world.trace import TraceRecord

_NAMED = ("note", "expectation", "overdue")
"""Events whose texts need their code in front."""


def is_shown(record: TraceRecord) -> bool:
    """Whether a record is shown to a user. Requests are not: they are as frequent as frames."""
    return record.kind in ("event", "fault", "input") and record.subject != "request"


def describe(record: TraceRecord) -> str:
    """What happened, in one line."""
    what = f"{record.subject}: " if record.kind != "event" or record.subject in _NAMED else ""
    value = record.value.hex(" ") if isinstance(record.value, bytes) else record.value
    return f"{record.time / SECOND:12.6f} s  {record.machine:<10} {what}{value}".rstrip()
