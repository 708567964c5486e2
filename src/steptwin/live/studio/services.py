"""Gateways and the history beside the world of a studio."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping, Sequence
from math import isinf
from typing import TYPE_CHECKING, TypeVar

from steptwin.controller import SECOND
from steptwin.errors import Misuse, Refusal
from steptwin.eventloop import later
from steptwin.gateways.contract import OpenGateway
from steptwin.messages import Message
from steptwin.simulation.describe.servicetables import HISTORY
from steptwin.studio.servicerequests import MOST_POINTS, MOST_WRITES

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

    def gateways(self) -> Sequence[Mapping[str, object]]:
        found: list[dict[str, object]] = []
        for kind, place, gateway in self._opened:
            state = gateway.state()
            head = {"kind": kind, "protocol": gateway.protocol, "place": place}
            clients = [{**client._asdict(), "follows": list(client.follows)} for client in state.clients or ()]
            found.append({**head, **state._asdict(), "has_clients": state.clients is not None, "clients": clients})
        return found

    async def history(self) -> Mapping[str, object] | None:
        return None if self._url is None else await self._read(_contents)

    async def values(self, points: Sequence[str], run: int, begin_s: float, end_s: float | None) -> Mapping[str, object]:
        if not 0 < len(points) <= MOST_POINTS:
            raise Misuse(COUNT_OF_POINTS(count=len(points), most=MOST_POINTS))
        return await self._read(lambda past: _values(past, points, past.run(run), begin_s, end_s))

    async def compare(
        self, points: Sequence[str], runs: tuple[int, int], begin_s: float, end_s: float | None
    ) -> Sequence[Mapping[str, object]]:
        return await self._read(lambda past: _compare(past, points, runs, begin_s, end_s))

    async def writes(self, run: int, begin_s: float, end_s: float | None) -> Sequence[Mapping[str, object]]:
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


def _contents(past: HistoryDatabase) -> Mapping[str, object]:
    from steptwin.history.reading import TEXTS

    points = {point.name: point for point in past.points()}
    return {
        "database": past.address,
        "runs": [_run(run) for run in past.runs()[-MOST_RUNS:]],
        "points": [{"point": one.name, "unit": one.unit, "is_text": one.type == TEXTS} for one in points.values()],
    }


def _run(run: KeptRun) -> Mapping[str, object]:
    return {
        "run": run.number,
        "subject": run.subject,
        "is_virtual": run.is_virtual,
        "began": run.began.isoformat(timespec="seconds"),
        "length_s": _length_s(run),
        "is_over": run.is_over,
    }


def _length_s(run: KeptRun) -> float:
    return (run.ended_ns - run.began_ns) / SECOND


ENDS_BEFORE_ITS_BEGIN = Message("live.ends-before-its-begin", "to_s {until_s:g}: this is before from_s {begin_s:g}")


def _values(
    past: HistoryDatabase, points: Sequence[str], run: KeptRun, begin_s: float, end_s: float | None
) -> Mapping[str, object]:
    until_s = _length_s(run) if end_s is None else end_s
    if until_s < begin_s:
        raise Misuse(ENDS_BEFORE_ITS_BEGIN(until_s=until_s, begin_s=begin_s))
    series = [_series(past, point, run, begin_s, until_s) for point in points]
    return {"run": run.number, "from_s": begin_s, "to_s": until_s, "series": series}


def _series(past: HistoryDatabase, point: str, run: KeptRun, begin_s: float, end_s: float) -> Mapping[str, object]:
    step_s = max((end_s - begin_s) / STEPS, 1e-6)
    found: PointSeries = past.series(point, begin_s, end_s, run=run.number, moving_s=step_s, most=MOST_VALUES + 1)
    is_thinned = len(found) > MOST_VALUES
    if is_thinned:
        found = past.series(point, begin_s, end_s, run=run.number, every_s=step_s)
    at_s = [max(at - run.began_ns / SECOND, begin_s) for at in found.seconds.tolist()]
    values = [None if value is None or value != value else value for value in found.values.tolist()]  # noqa: PLR0124  NaN
    head = {"point": point, "unit": found.unit, "is_text": found.is_text, "is_motion": found.is_motion}
    return {**head, "is_thinned": is_thinned, "at_s": at_s, "values": values}


def _compare(
    past: HistoryDatabase, points: Sequence[str], runs: tuple[int, int], begin_s: float, end_s: float | None
) -> Sequence[Mapping[str, object]]:
    from steptwin.history.intervals import Interval, compare

    one, other = (Interval(begin_s, end_s, past.run(number)) for number in runs)
    chosen = points or sorted({point.name for point in past.points()})
    return [
        {
            "point": found.point,
            "unit": found.unit,
            "most": None if isinf(found.most) else found.most,
            "at_s": found.at_s,
            "values": [_to_json(value) for value in found.values],
        }
        for found in compare(past, chosen, one, other)
    ]


def _to_json(value: object) -> object:
    """Number of numpy as one for JSON."""
    return None if value is None or value != value else value if isinstance(value, str) else float(value)  # type: ignore[arg-type]  # noqa: PLR0124


def _writes(past: HistoryDatabase, run: KeptRun, begin_s: float, end_s: float | None) -> Sequence[Mapping[str, object]]:
    from steptwin.history.reading import WRITTEN

    found = past.events(begin_s, end_s, run=run.number, kinds=WRITTEN, most=MOST_WRITES)
    return [_write(one, (one.time - run.began_ns) / SECOND) for one in found]


def _write(event: KeptEvent, at_s: float) -> Mapping[str, object]:
    kept = event.content
    if event.kind == "write":
        source, what = kept["source"], kept["words"]
    else:
        others = {name: value for name, value in kept["fields"].items() if name not in ("controller", "machine")}  # version 1
        fields = ", ".join(f"{name} = {value}" for name, value in others.items())
        source, what = f"{kept['viewer']} ({kept['role']})", f"{kept['do']} {fields}".rstrip()
    return {"at_s": at_s, "source": source, "controller": event.machine, "what": what, "outcome": kept["outcome"]}
