"""Rows on their way to the database: batches of rows, as lines of JSON."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeAlias

from steptwin.controller import Nanos

KeptValue: TypeAlias = float | str | None
"""A number, a text; None: not known."""


class PointRow(NamedTuple):
    name: str
    """``MACHINE.POINT``, such as ``table.M1.position``."""
    unit: str
    type: str


class SampleRow(NamedTuple):
    point: int
    """Its place in the points of the run."""
    time: Nanos
    at_us: int
    value: KeptValue


class PlanRow(NamedTuple):
    point: int
    time: Nanos
    at_us: int
    plan: str
    origin: int
    scale: float
    round_p: int | None


class EventRow(NamedTuple):
    time: Nanos
    at_us: int
    number: int
    machine: str
    kind: str
    cause: int | None
    text: str
    content: str


@dataclass(frozen=True, slots=True, kw_only=True)
class RunHead:
    """A recording as it begins."""

    key: str
    subject: str
    is_virtual: bool
    began_ns: Nanos
    began_us: int
    points: tuple[PointRow, ...]

    def line(self) -> bytes:
        points = [list(point) for point in self.points]
        data = [self.key, self.subject, self.is_virtual, self.began_ns, self.began_us, points]
        return _line(data)


@dataclass(slots=True, kw_only=True)
class RowBatch:
    """Rows of a run that come into the database together; ``number`` counts from 1 in a run.

    ``time`` and ``at_us``: up to when the run is complete with them.
    """

    run: str
    number: int
    time: Nanos
    at_us: int
    is_last: bool = False
    samples: list[SampleRow] = field(default_factory=list)
    plans: list[PlanRow] = field(default_factory=list)
    events: list[EventRow] = field(default_factory=list)

    def __len__(self) -> int:
        return len(self.samples) + len(self.plans) + len(self.events)

    def line(self) -> bytes:
        rows = [self.samples, self.plans, self.events]
        return _line([self.run, self.number, self.time, self.at_us, self.is_last, *rows])


def read_head(line: bytes) -> RunHead:
    """Read the result of `RunHead.line`. Raises `ValueError` or `TypeError` for anything else."""
    key, subject, is_virtual, began_ns, began_us, points = json.loads(line)
    rows = tuple(PointRow(*point) for point in points)
    return RunHead(key=key, subject=subject, is_virtual=is_virtual, began_ns=began_ns, began_us=began_us, points=rows)


def read_batch(line: bytes) -> RowBatch:
    """Read the result of `RowBatch.line`. Raises `ValueError` or `TypeError` for anything else."""
    run, number, time, at_us, is_last, samples, plans, events = json.loads(line)
    return RowBatch(
        run=run,
        number=number,
        time=time,
        at_us=at_us,
        is_last=is_last,
        samples=[SampleRow(*row) for row in samples],
        plans=[PlanRow(*row) for row in plans],
        events=[EventRow(*row) for row in events],
    )


def _line(data: Any) -> bytes:
    return json.dumps(data, separators=(",", ":")).encode() + b"\n"
