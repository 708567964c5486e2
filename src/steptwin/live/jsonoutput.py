"""Output as a structured log: lines of JSON, made by structlog."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TextIO

import structlog

from steptwin.live.output import Output
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.subject.events import payload_of
from steptwin.wire.frameline import FrameLine


class JsonOutput(Output):
    """Each line is an object: ``timestamp`` (ISO 8601, UTC), ``level``, ``event`` (a text for people) and ``kind``.

    Kinds: ``begin`` has what is served; ``message``, ``notice``; ``frame`` has ``link``, ``direction`` and ``data``; others are
    kinds of events of a world (docs/control.md) with ``controller``, ``time_ns`` (virtual, as text) and ``data``.
    """

    def __init__(self, stream: TextIO | None) -> None:
        super().__init__(stream)
        self.encoding = "utf-8"
        self._log: Any = structlog.wrap_logger(
            _Written(self),
            processors=[
                structlog.processors.add_log_level,
                structlog.processors.TimeStamper(fmt="iso", utc=True),
                structlog.processors.JSONRenderer(ensure_ascii=False),
            ],
            wrapper_class=structlog.make_filtering_bound_logger("debug"),
        )

    def isatty(self) -> bool:
        """Nothing is drawn."""
        return False

    def line(self, text: str) -> None:
        self._log.info(text.strip(), kind="message")

    def notice(self, text: str) -> None:
        self._log.warning(text.strip(), kind="notice")

    def record(self, record: TraceRecord) -> None:
        payload = payload_of(record)
        self._log.info(
            payload.text, kind=payload.kind, controller=record.controller, time_ns=str(record.time), data=payload.to_json()
        )

    def frame(self, frame: FrameLine) -> None:
        self._log.info(
            frame.meaning,
            kind="frame",
            link=frame.link,
            direction=frame.direction.value,
            data=frame.raw.hex(),
            time_ns=str(frame.time),
        )

    def begin(self, head: Sequence[str], announcement: Mapping[str, object]) -> None:
        self._log.info(head[0].strip() if head else "begins", kind="begin", **announcement)


class _Written:
    """The logger behind structlog's: all levels are lines."""

    def __init__(self, output: Output) -> None:
        self._write = output.write

    def msg(self, text: str) -> None:
        self._write(text + "\n")

    info = warning = error = msg
