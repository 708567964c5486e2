"""Recorder of a subject, as rows: motions of twins as their plans, values when they change, events."""

from __future__ import annotations

import asyncio
import json
import uuid
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from operator import itemgetter
from typing import NamedTuple

from steptwin.access.audit import Entry
from steptwin.controller import SECOND, Nanos
from steptwin.gateways.contract import GatewaySubject
from steptwin.gateways.points import CLOCK, CLOCK_POINTS, GatewayPoint, PointType, PointValue, points_of, whole_state
from steptwin.gateways.sampling import Sample, Sampler
from steptwin.history.rows import EventRow, KeptValue, PlanRow, PointRow, RowBatch, RunHead, SampleRow
from steptwin.jsonvalues import to_json
from steptwin.motion.planjson import plan_to_json
from steptwin.subject.contract import ControllerDescription
from steptwin.subject.events import Event
from steptwin.subject.payloads import SHOWN_KINDS, CoordinatePayload, EdgePayload, PlanPayload, RestoredPayload
from steptwin.subject.subscriptions import filter_of

MOST_EVENTS = 100_000
"""Between two looks."""
TWIN_KINDS = SHOWN_KINDS | {"plan", "coordinate", "edge", "write"}
REST_NS: Nanos = SECOND
"""Period at which twins whose events say most of it are polled without one."""
ALIVE_US = 60_000_000
"""A run without changes says so often that it goes on."""
SET_US = 1_000_000
"""By how much the wall clock has to differ from the steady one to have been set; a clock that is corrected slowly has not."""
FROM_PLANS = ("position", "velocity", "moving")
PASSING = ("program.line", "program.statement", "virtual_time")
"""They change too fast to be polled."""
LINES, COMMAND = "lines", "command"
TRAFFIC_POINTS = tuple(
    GatewayPoint(path=(name,), meaning=meaning, type=PointType.WHOLE, part=whole_state, of=itemgetter(name))
    for name, meaning in (
        ("requests", "Requests of programs, or lines of characters, since the line was opened."),
        ("errors", "Those that were answered with an exception, lost, or not answered."),
        ("unframed", "Bytes that belonged to no frame."),
    )
)
SHARED_CLOCK_POINTS = tuple(point for point in CLOCK_POINTS if point.name not in PASSING)


class _Axis(NamedTuple):
    point: int
    scale: float
    round_p: int | None


class _Last(NamedTuple):
    """The value that was kept last, and where it was seen since then with less change than the dead band."""

    value: KeptValue
    seen: tuple[Nanos, int, KeptValue] | None = None


@dataclass(frozen=True, slots=True)
class WallAndSteady:
    """Two clocks, us: the wall clock in UTC, which may be set, and one that nobody sets."""

    wall_us: Callable[[], int]
    steady_us: Callable[[], int]


@dataclass(frozen=True, slots=True)
class _GapNote:
    """The batch that says how many rows were lost before it, and has everything again."""

    batch: RowBatch
    lost: int
    again: int
    """Rows of it that are there for this reason only."""


class Recorder:
    """Rows of ``subject``."""

    def __init__(
        self,
        subject: GatewaySubject,
        registers: Mapping[str, Iterable[str]],
        *,
        clock: WallAndSteady,
        dead_band: float = 0.0,
    ) -> None:
        self._subject = subject
        self._clock = clock
        self._dead_band = dead_band
        self._sampler = Sampler(subject.samples, registers)
        self._controllers = {part.name: part for part in subject.description.controllers}
        self._has_devices = any(part.is_real for part in self._controllers.values())
        kinds = SHOWN_KINDS if self._has_devices else TWIN_KINDS
        self._subscription = subject.subscribe(filter_of(kinds), MOST_EVENTS)
        self._points: list[PointRow] = []
        self._sampled: dict[str, list[tuple[int, GatewayPoint]]] = {CLOCK: self._add(CLOCK, SHARED_CLOCK_POINTS)}
        self._axes: dict[tuple[str, str], _Axis] = {}
        self._pins: dict[tuple[str, str], int] = {}
        for part in self._controllers.values():
            self._add_controller(part, registers.get(part.name, ()))
        self._traffic = {line: self._add(line, TRAFFIC_POINTS) for line in subject.traffic()}
        self._last: dict[int, _Last] = {}
        self._plans: dict[tuple[str, str], tuple[str, int]] = {}
        """Plan and origin of axes."""
        self._looked: dict[str, Nanos] = {}
        self._batch = RowBatch(run="", number=0, time=0, at_us=0)
        self._speed = 1.0
        self._looked_at: tuple[Nanos, int] = 0, 0
        self._steady = 0
        """The steady clock at the last look."""
        self._lost = 0
        """Rows that could not be kept, of which no batch tells yet."""
        self._note: _GapNote | None = None

    def _add_controller(self, part: ControllerDescription, registers: Iterable[str]) -> None:
        points = [point for point in points_of(part, self._subject.description, registers) if point.name not in PASSING]
        if part.is_real:
            self._sampled[part.name] = self._add(part.name, points)
            return
        for axis in part.datasheet.axes:
            (number, _), *_ = self._add(part.name, [point for point in points if point.path == (axis.name, "position")])
            self._axes[part.name, str(axis.number)] = _Axis(number, axis.pulses_per_unit or 1.0, axis.round_p)
        pins = [point for point in points if point.path[0] == "pins"]
        self._pins |= {(part.name, point.path[1]): number for number, point in self._add(part.name, pins)}
        axes = {axis.name for axis in part.datasheet.axes}
        rest = [p for p in points if p.path[0] != "pins" and not (p.path[0] in axes and p.path[1] in FROM_PLANS)]
        self._sampled[part.name] = self._add(part.name, rest)

    def _add(self, controller: str, points: Iterable[GatewayPoint]) -> list[tuple[int, GatewayPoint]]:
        found: list[tuple[int, GatewayPoint]] = []
        for point in points:
            found.append((len(self._points), point))
            self._points.append(PointRow(f"{controller}.{point.name}", point.unit, point.type.value))
        return found

    def close(self) -> None:
        self._sampler.close()
        self._subscription.close()

    # ------------------------------------------------------------------ runs

    async def begin(self) -> RunHead:
        """Begin a run at the present moment, with all values. Raises as commands do."""
        if self._has_devices:
            self._sampler.watch(self._controllers)
        clock = await self._sampler.take(CLOCK)
        now, wall = _time(clock), self._clock.wall_us()
        self._steady = self._clock.steady_us()
        head = self._begin_run(now, wall)
        self._subscription.take()
        self._take_plans(wall)
        self._take_sample(clock, now, wall)
        await self._take_all(now, wall)
        return head

    def _begin_run(self, time: Nanos, at_us: int) -> RunHead:
        self._last.clear()
        self._plans.clear()
        self._looked.clear()
        head = RunHead(
            key=uuid.uuid4().hex,
            subject=self._subject.description.name,
            is_virtual=not self._has_devices,
            began_ns=time,
            began_us=at_us,
            points=tuple(self._points),
        )
        self._batch = RowBatch(run=head.key, number=1, time=time, at_us=at_us)
        self._looked_at = time, at_us
        return head

    def _take_plans(self, wall: int) -> None:
        for event in self._subject.plans(filter_of(["plan"])):
            self._take_event(event, event.time, wall)

    async def _take_all(self, now: Nanos, wall: int) -> None:
        """All values of all controllers, also levels, of which events tell."""
        self._take_traffic(now, wall)
        for name in self._controllers:
            sample = await self._sampler.take(name)
            self._take_sample(sample, now, wall)
            if sample.state is not None:
                for pin, level in sample.state["pins"].items():
                    if (name, pin) in self._pins:
                        self._keep(self._pins[name, pin], now, wall, level, is_stepwise=True)

    # ------------------------------------------------------------------ looking

    async def look(self, *, has_room: bool = True) -> list[RunHead | RowBatch]:
        """Changes since the last call: a batch of the present run; the heads of others that have begun, because time
        has gone back, and their batches. Once there is room after rows were lost, it has their number and everything."""
        clock = await self._sampler.take(CLOCK)
        now, wall = _time(clock), self._clock.wall_us()
        is_set, was = self._is_set(wall)
        new, wall = wall, was if is_set else wall
        if clock.state is not None:
            speed = clock.state["speed"]
            self._speed = speed if isinstance(speed, int | float) and speed and not clock.state["paused"] else 0.0
        missed, events = self._subscription.take()
        found: list[RunHead | RowBatch] = []
        while (place := _restored(events)) is not None:
            for event in events[:place]:
                self._take_event(event, event.time, wall)
            at = events[place].time
            found += [self.end(), self._begin_run(at, self._at(at, now, wall))]
            events = events[place + 1 :]
        self._take_events(events, now, wall)
        if missed:
            self._note_loss(now, wall, f"{missed} events came too fast and are missing before this moment")
            self._take_plans(wall)
        self._take_sample(clock, now, wall)
        if missed or found:
            await self._take_all(now, wall)
        if not 0 <= now - self._looked.get(LINES, -REST_NS) < REST_NS:
            self._take_traffic(now, wall)
        await self._take_changed(events, now, wall)
        if is_set:
            await self._go_on(now, wall, new)
            wall = new
        if self._lost and has_room:
            await self._end_gap(now, wall)
        self._looked_at = now, wall
        return [*found, *self._full(now, wall)]

    def _is_set(self, wall: int) -> tuple[bool, int]:
        """Whether the wall clock has been set since the last look, and what it would be otherwise."""
        steady = self._clock.steady_us()
        expected = self._looked_at[1] + steady - self._steady
        self._steady = steady
        return abs(wall - expected) > SET_US, expected

    async def _go_on(self, now: Nanos, before: int, wall: int) -> None:
        """The wall clock was set from ``before`` to ``wall``: keep everything again, so that nothing lasts over that moment."""
        by = (wall - before) / 1e6
        text = f"the wall clock went {'forward' if by > 0 else 'back'} by {abs(by):.3f} s: it was set, or this computer slept"
        self._batch.events.append(EventRow(now, wall, 0, "", "clock", None, text, json.dumps({"by_s": by})))
        for (controller, axis), (plan, origin) in self._plans.items():
            there = self._axes[controller, axis]
            self._batch.plans.append(PlanRow(there.point, now, before, plan, origin, there.scale, there.round_p))
        await self._take_again(now, wall)

    async def _end_gap(self, now: Nanos, wall: int) -> None:
        """Rows are kept from now on: say how many were not, and keep everything again, because the values of the last ones may be
        among them."""
        before = len(self._batch)
        self._tell_lost(now, wall)
        await self._take_again(now, wall)
        self._note = _GapNote(self._batch, self._lost, len(self._batch) - before)
        self._lost = 0

    def _tell_lost(self, now: Nanos, wall: int) -> None:
        self._note_loss(now, wall, f"{self._lost} rows found no room and are missing before this moment")

    async def _take_again(self, now: Nanos, wall: int) -> None:
        self._plans.clear()
        self._last.clear()
        self._take_plans(wall)
        self._take_sample(await self._sampler.take(CLOCK), now, wall)
        await self._take_all(now, wall)

    async def _take_changed(self, events: Iterable[Event], now: Nanos, wall: int) -> None:
        if self._has_devices:
            for sample in await asyncio.gather(*map(self._sampler.take, await self._sampler.due(0.0))):
                self._sampler.taken(sample)
                self._take_sample(sample, now, wall)
        for name in self._due(events, now):
            self._take_sample(await self._sampler.present(name), now, wall)

    def log(self, entry: Entry) -> None:
        """Keep a command, with who gave it and what became of it."""
        content = json.dumps(to_json(entry), ensure_ascii=False, separators=(",", ":"))
        controller = str(entry.fields.get("controller") or "")
        row = EventRow(entry.time_ns, self._clock.wall_us(), 0, controller, COMMAND, None, str(entry), content)
        self._batch.events.append(row)

    def lost(self, batches: Iterable[RowBatch]) -> None:
        """These could not be kept: a later one says so."""
        for batch in batches:
            self._lost += len(batch)
            if self._note is not None and batch is self._note.batch:
                self._lost += self._note.lost - self._note.again

    def end(self) -> RowBatch:
        """The last batch of the run, up to the last look."""
        self._take_traffic(*self._looked_at)
        if self._lost:
            self._tell_lost(*self._looked_at)
            self._note = _GapNote(self._batch, self._lost, 1)
            self._lost = 0
        self._batch.is_last = True
        self._batch.time, self._batch.at_us = self._looked_at
        return self._batch

    def _due(self, events: Iterable[Event], now: Nanos) -> list[str]:
        """Twins to sample: those with an event, and those without a sample for a while."""
        if self._has_devices:
            return []
        busy = {event.controller for event in events}
        due = [name for name in self._controllers if name in busy or not 0 <= now - self._looked.get(name, -REST_NS) < REST_NS]
        self._looked |= dict.fromkeys(due, now)
        return due

    def _full(self, time: Nanos, wall: int) -> list[RowBatch]:
        full = self._batch
        if not len(full) and abs(wall - full.at_us) < ALIVE_US:
            return []
        full.time, full.at_us = time, wall
        self._batch = RowBatch(run=full.run, number=full.number + 1, time=time, at_us=wall)
        return [full]

    # ------------------------------------------------------------------ rows

    def _at(self, time: Nanos, now: Nanos, wall: int) -> int:
        """The wall clock at a moment that was a short while ago."""
        return wall - int((now - time) / 1000 / self._speed) if self._speed else wall

    def _take_events(self, events: Iterable[Event], now: Nanos, wall: int) -> None:
        for event in events:
            self._take_event(event, event.time, self._at(event.time, now, wall))

    def _take_event(self, event: Event, time: Nanos, at_us: int) -> None:
        match event.payload:
            case PlanPayload(axis, plan, origin):
                known = self._plans.get((event.controller, axis), ("", 0))[1]
                text = json.dumps(plan_to_json(plan), separators=(",", ":"))
                self._keep_plan(event.controller, axis, time, at_us, text, known if origin is None else origin)
            case CoordinatePayload(axis, origin):
                plan_text = self._plans.get((event.controller, axis), ("", 0))[0]
                if plan_text:
                    self._keep_plan(event.controller, axis, time, at_us, plan_text, origin)
            case EdgePayload(pin, level):
                if (event.controller, pin) in self._pins:
                    self._keep(self._pins[event.controller, pin], time, at_us, level, is_stepwise=True)
            case payload if event.is_shown or event.kind == "write":
                content = json.dumps(payload.to_json(), separators=(",", ":"))
                row = EventRow(time, at_us, event.number, event.controller, event.kind, event.cause, event.text, content)
                self._batch.events.append(row)

    def _note_loss(self, time: Nanos, wall: int, text: str) -> None:
        self._batch.events.append(EventRow(time, wall, 0, "", "gap", None, text, "{}"))

    def _keep_plan(self, controller: str, axis: str, time: Nanos, at_us: int, plan: str, origin: int) -> None:
        if self._plans.get((controller, axis)) == (plan, origin):
            return
        self._plans[controller, axis] = plan, origin
        there = self._axes[controller, axis]
        self._batch.plans.append(PlanRow(there.point, time, at_us, plan, origin, there.scale, there.round_p))

    def _take_sample(self, sample: Sample, now: Nanos, wall: int) -> None:
        moving = set()
        if (
            sample.state is not None
            and sample.controller in self._controllers
            and not self._controllers[sample.controller].is_real
        ):
            moving = {axis["name"] for axis in sample.state["axes"] if axis["moving"]}
        for number, point in self._sampled[sample.controller]:
            if point.path[-1] == "encoder" and point.path[0] in moving:
                continue  # follows from the motion; it is kept when that is over
            value = None if sample.state is None else point.read(sample.state)
            stepwise = point.type is not PointType.NUMBER
            self._keep(number, now, wall, _kept(value), is_stepwise=stepwise)

    def _take_traffic(self, now: Nanos, wall: int) -> None:
        self._looked[LINES] = now
        for line, traffic in self._subject.traffic().items():
            counts = traffic._asdict()
            for number, point in self._traffic.get(line, ()):
                self._keep(number, now, wall, _kept(point.read(counts)), is_stepwise=True)

    def _keep(self, number: int, time: Nanos, at_us: int, value: KeptValue, *, is_stepwise: bool) -> None:
        """Keep a value that is another one; of a number that is measured now and then also where it was before, because it
        changed between these two moments."""
        last = self._last.get(number)
        if last is not None:
            if last.value == value or (not is_stepwise and self._is_near(last.value, value)):
                self._last[number] = _Last(last.value, (time, at_us, value))
                return
            if not is_stepwise and last.seen is not None and (self._has_devices or last.seen[2] != last.value):
                self._batch.samples.append(SampleRow(number, *last.seen))
        self._last[number] = _Last(value)
        self._batch.samples.append(SampleRow(number, time, at_us, value))

    def _is_near(self, last: KeptValue, value: KeptValue) -> bool:
        if not isinstance(last, float) or not isinstance(value, float):
            return False
        return abs(last - value) <= self._dead_band


def _restored(events: Iterable[Event]) -> int | None:
    """The place of the event that time has gone back."""
    return next((place for place, event in enumerate(events) if isinstance(event.payload, RestoredPayload)), None)


def _time(clock: Sample) -> Nanos:
    return 0 if clock.state is None else int(clock.state["time_ns"])


def _kept(value: PointValue) -> KeptValue:
    return float(value) if isinstance(value, bool | int | float) else value
