"""Gateways and the history beside the world of a studio."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from math import isinf
from typing import TYPE_CHECKING, TypeVar

from steptwin.controller import SECOND
from steptwin.errors import Misuse, Refusal
from steptwin.eventloop import later
from steptwin.gateways.contract import OpenGateway
from steptwin.messages import Message
from steptwin.simulation.describe.servicetables import HISTORY
from steptwin.studio.servicerequests import (
    MOST_POINTS,
    MOST_WRITES,
    GatewayClient,
    HistoryContents,
    HistoryDifference,
    HistoryInterval,
    HistoryPoint,
    HistoryRun,
    HistorySeries,
    HistoryWrite,
    ShownGateway,
)

if TYPE_CHECKING:
    from steptwin.history.reading import HistoryDatabase, KeptEvent, KeptRun, PointSeries

T = TypeVar("T")
STEPS = 800
"""Positions of a motion that are given for an interval, beside the ends of its parts."""
MOST_VALUES = 4000
"""Most values of a point; where there are more, it is read in equal steps."""
MOST_RUNS = 500
"""The last ones."""
COUNT_OF_POINTS = Message("live.count-of-points", "points: {count} are given: permitted are 1 to {most}")
NO_HISTORY = Message("live.no-history", "nothing is kept here: the description of the world has no table [{table}]")


class LiveServices:
    """See `steptwin.studio.servicerequests.WorldServices`. ``opened``: the gateways that are open, which grow after the start."""

    def __init__(self, opened: Sequence[OpenGateway]) -> None:
        self._opened = opened

    def gateways(self) -> Sequence[ShownGateway]:
        found: list[ShownGateway] = []
        for kind, place, gateway in self._opened:
            is_up, text, shown, known = gateway.state()
            clients = tuple([GatewayClient(*client) for client in known or ()])
            found.append(ShownGateway(kind, gateway.protocol, place, is_up, text, shown, known is not None, clients))
        return found

    async def history(self) -> HistoryContents | None:
        return None if self._url is None else await self._read(_contents)

    async def values(self, points: Sequence[str], run: int, begin_s: float, end_s: float | None) -> HistoryInterval:
        if not 0 < len(points) <= MOST_POINTS:
            raise Misuse(COUNT_OF_POINTS(count=len(points), most=MOST_POINTS))
        return await self._read(lambda past: _values(past, points, past.run(run), begin_s, end_s))

    async def compare(
        self, points: Sequence[str], runs: tuple[int, int], begin_s: float, end_s: float | None
    ) -> Sequence[HistoryDifference]:
        return await self._read(lambda past: _compare(past, points, runs, begin_s, end_s))

    async def writes(self, run: int, begin_s: float, end_s: float | None) -> Sequence[HistoryWrite]:
        return await self._read(lambda past: _writes(past, past.run(run), begin_s, end_s))

    @property
    def _url(self) -> str | None:
        for one in self._opened:
            if one.kind == HISTORY:
                from steptwin.history.keeper import HistoryKeeper  # its libraries are there, because it is open

                return one.gateway.url if isinstance(one.gateway, HistoryKeeper) else None
        return None

    async def _read(self, work: Callable[[HistoryDatabase], T]) -> T:
        """Read with ``work`` in a thread. Raises `Refusal` where there is no history."""
        url = self._url
        if url is None:
            raise Refusal(NO_HISTORY(table=HISTORY))

        def read() -> T:
            from steptwin.history.reading import HistoryDatabase

            with HistoryDatabase(url) as past:
                return work(past)

        return await later(asyncio.to_thread(read))


def _contents(past: HistoryDatabase) -> HistoryContents:
    from steptwin.history.reading import TEXTS

    points = {point.name: HistoryPoint(point.name, point.unit, point.type == TEXTS) for point in past.points()}
    return HistoryContents(past.address, tuple(map(_run, past.runs()[-MOST_RUNS:])), tuple(points.values()))


def _run(run: KeptRun) -> HistoryRun:
    began = run.began.isoformat(timespec="seconds")
    return HistoryRun(run.number, run.subject, run.is_virtual, began, _length_s(run), run.is_over)


def _length_s(run: KeptRun) -> float:
    return (run.ended_ns - run.began_ns) / SECOND


ENDS_BEFORE_ITS_BEGIN = Message("live.ends-before-its-begin", "to_s {until_s:g}: this is before from_s {begin_s:g}")


def _values(past: HistoryDatabase, points: Sequence[str], run: KeptRun, begin_s: float, end_s: float | None) -> HistoryInterval:
    until_s = _length_s(run) if end_s is None else end_s
    if until_s < begin_s:
        raise Misuse(ENDS_BEFORE_ITS_BEGIN(until_s=until_s, begin_s=begin_s))
    series = tuple([_series(past, point, run, begin_s, until_s) for point in points])
    return HistoryInterval(run.number, begin_s, until_s, series)


def _series(past: HistoryDatabase, point: str, run: KeptRun, begin_s: float, end_s: float) -> HistorySeries:
    step_s = max((end_s - begin_s) / STEPS, 1e-6)
    found: PointSeries = past.series(point, begin_s, end_s, run=run.number, moving_s=step_s, most=MOST_VALUES + 1)
    is_thinned = len(found) > MOST_VALUES
    if is_thinned:
        found = past.series(point, begin_s, end_s, run=run.number, every_s=step_s)
    at_s = tuple([max(at - run.began_ns / SECOND, begin_s) for at in found.seconds.tolist()])
    values = tuple([None if value is None or value != value else value for value in found.values.tolist()])  # noqa: PLR0124  NaN
    return HistorySeries(point, found.unit, found.is_text, found.is_motion, is_thinned, at_s, values)


def _compare(
    past: HistoryDatabase, points: Sequence[str], runs: tuple[int, int], begin_s: float, end_s: float | None
) -> Sequence[HistoryDifference]:
    from steptwin.history.intervals import Interval, compare

    one, other = (Interval(begin_s, end_s, past.run(number)) for number in runs)
    chosen = points or sorted({point.name for point in past.points()})
    return [
        HistoryDifference(point, unit, None if isinf(most) else most, at_s, tuple(map(_to_json, values)))
        for point, unit, most, at_s, values in compare(past, chosen, one, other)
    ]


def _to_json(value: object) -> object:
    """Number of numpy as one for JSON."""
    return None if value is None or value != value else value if isinstance(value, str) else float(value)  # type: ignore[arg-type]  # noqa: PLR0124


def _writes(past: HistoryDatabase, run: KeptRun, begin_s: float, end_s: float | None) -> Sequence[HistoryWrite]:
    from steptwin.history.reading import WRITTEN

    found = past.events(begin_s, end_s, run=run.number, kinds=WRITTEN, most=MOST_WRITES)
    return [_write(one, (one.time - run.began_ns) / SECOND) for one in found]


def _write(event: KeptEvent, at_s: float) -> HistoryWrite:
    kept = event.content
    if event.kind == "write":
        source, what = kept["source"], kept["words"]
    else:
        others = {name: value for name, value in kept["fields"].items() if name not in ("controller", "machine")}  # version 1
        fields = ", ".join(f"{name} = {value}" for name, value in others.items())
        source, what = f"{kept['viewer']} ({kept['role']})", f"{kept['do']} {fields}".rstrip()
    return HistoryWrite(at_s, source, event.machine, what, kept["outcome"])
