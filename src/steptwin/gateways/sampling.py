"""Present values of controllers for gateways, taken when they may have changed.

An event of a controller makes it due at once, but at most once in an interval; what changes without events (a motion, a running
program, named registers) is due once in an interval. Of a twin only what its events name is read again (`HeldState`); a device is
read as a whole. Nothing waits in queues: a gateway that is late gets the latest values.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from math import inf
from typing import Any, cast
from zlib import crc32

from steptwin.controller import SECOND, Nanos
from steptwin.errors import LineFailure, Refusal
from steptwin.gateways.heldstate import HeldState, is_resting, merged, parts_only
from steptwin.gateways.points import CLOCK, State
from steptwin.subject import commands as command
from steptwin.subject.contract import AsyncSubject
from steptwin.subject.events import Event
from steptwin.subject.payloads import RestoredPayload
from steptwin.subject.subscriptions import USUAL, Filter, Subscription

KINDS = USUAL | {"write"}
"""Kinds of events; a write of a program on a line may change what no other event tells."""
MOST_EVENTS = 16_384
RESTING_INTERVALS = 10
"""A device at rest is sampled once in so many intervals."""
REST_S = 10.0
"""A twin is read as a whole so often: for what no event tells, such as a character that a chip has received."""
TICK_S = 0.01
"""Controllers become due at multiples of this, so that what happens at almost the same time is read together."""
AT_ONCE = 64
"""Controllers that are sampled before others in this event loop have their turn."""
INTERVAL = SECOND // 10
_REST_SLOTS = round(REST_S / TICK_S)


@dataclass(frozen=True, slots=True)
class Sample:
    """``state`` at the moment ``at``; None for a controller that does not answer, or refuses what it is asked.

    A part of a state in which nothing has changed is the same object as in the sample before (`GatewayPoint.part`).
    """

    controller: str
    state: State | None
    at: datetime
    time: Nanos = 0
    """When it was read last, by the clock of the subject, which may stand; levels that edges have brought are newer. 0 without an
    answer, and of the `CLOCK`."""


class SharedSamples:
    """Shared part of the samplers of ``subject``: events, and samples that one of them has just taken."""

    def __init__(self, subject: AsyncSubject) -> None:
        self.subject = subject
        self._samplers: list[Sampler] = []
        self._subscription: Subscription | None = None
        self._latest: dict[str, tuple[float, Sample]] = {}
        """The last sample of each controller, and when it was taken by the clock of the event loop."""
        self._past: set[str] = set()
        """Controllers that have to be read as a whole."""
        self._held: dict[str, HeldState] = {}
        """Held states of twins."""
        self._whole: dict[str, float] = {}
        """When each of them was read as a whole."""
        self._on_line: dict[str, list[str]] = {}
        """Controllers by their line."""
        self._registers: dict[str, tuple[str, ...]] = {}

    def join(self, sampler: Sampler) -> None:
        if self._subscription is None:
            self._subscription = self.subject.subscribe(Filter(KINDS), MOST_EVENTS)
            self._subscription.on_event = self._wake
            for part in self.subject.description.controllers:
                if not part.is_real:
                    self._held[part.name] = HeldState(part)
                if part.line is not None:
                    self._on_line.setdefault(part.line, []).append(part.name)
        self._samplers.append(sampler)
        self._collect_registers()

    def leave(self, sampler: Sampler) -> None:
        if sampler in self._samplers:
            self._samplers.remove(sampler)
            self._collect_registers()
        if self._subscription is not None and not self._samplers:
            self._subscription.close()
            self._subscription = None
            for known in (self._latest, self._held, self._whole, self._on_line):
                known.clear()

    def _collect_registers(self) -> None:
        found: dict[str, dict[str, None]] = {}
        for sampler in self._samplers:
            for controller, names in sampler.registers.items():
                found.setdefault(controller, {}).update(dict.fromkeys(names))
        registers = {controller: tuple(names) for controller, names in found.items()}
        self._past.update(name for name in registers if registers[name] != self._registers.get(name))
        self._registers = registers

    def _wake(self) -> None:
        for sampler in self._samplers:
            sampler.wake()

    # ------------------------------------------------------------------ events

    def see_events(self) -> None:
        """Tell all samplers what has happened."""
        if self._subscription is None or not len(self._subscription):
            return
        missed, events = self._subscription.take()
        if missed or any(isinstance(event.payload, RestoredPayload) for event in events):
            self._past.update(self._latest)
            for sampler in self._samplers:
                sampler.everything_changed()
            return
        changed: dict[str, None] = {}
        for event in events:
            for name in self._on_line.get(event.controller, (event.controller,)):
                if self._may_change(name, event):
                    changed[name] = None
        for sampler in self._samplers:
            sampler.changed_by_events(changed)

    def _may_change(self, name: str, event: Event) -> bool:
        held = self._held.get(name)
        if held is None:
            self._past.add(name)
            return True
        return held.take(event)

    # ------------------------------------------------------------------ samples

    def is_resting(self, sample: Sample) -> bool:
        """Whether it does not change without events."""
        if sample.controller == CLOCK or sample.state is None:
            return False
        held = self._held.get(sample.controller)
        return is_resting(sample.state) if held is None else not held.is_active

    async def recent(self, controller: str, since: float) -> Sample:
        """One that was taken after ``since`` and everything that has happened, or a new one."""
        known = self._latest.get(controller)
        if known is None or controller in self._past:
            return await self.take(controller)
        taken_at, sample = known
        held = self._held.get(controller)
        if held is None or sample.state is None:
            return sample if taken_at >= since else await self.take(controller)
        if asyncio.get_running_loop().time() - self._whole.get(controller, -inf) > REST_S / 2:
            return await self.take(controller)
        is_due = taken_at < since
        if not is_due and not held.has_news:
            return sample
        return await self._part(controller, held, sample, is_due=is_due)

    async def _part(self, controller: str, held: HeldState, before: Sample, *, is_due: bool) -> Sample:
        """Read what events have named."""
        wanted = held.wanted(is_due=is_due)
        parts: dict[str, Any] = {}
        now: Nanos | None = None
        try:
            if wanted:
                answer = await self.subject.do(command.ReadState(controller, wanted))
                parts, now = answer.value, answer.time
            if is_due and controller in self._registers:
                parts = {**parts, "registers": await self._read(controller)}
        except (LineFailure, Refusal):
            return self._keep(Sample(controller, None, datetime.now(UTC)))
        state = held.put(parts, now)
        if state is before.state:
            return self._keep(before)
        return self._keep(Sample(controller, state, datetime.now(UTC), before.time if now is None else now))

    async def present(self, controller: str) -> Sample:
        """The present values of a controller; of a twin what may have changed is read."""
        self.see_events()
        return await self.recent(controller, asyncio.get_running_loop().time())

    async def take(self, controller: str) -> Sample:
        """The present values of a controller, read as a whole, or of the `CLOCK`."""
        if controller == CLOCK:
            return Sample(CLOCK, cast("State", (await self.subject.do(command.Time())).value), datetime.now(UTC))
        self._past.discard(controller)
        try:
            answer = await self.subject.do(command.ReadState(controller))
            state = parts_only(cast("State", answer.value), await self._read(controller))
        except (LineFailure, Refusal):  # a device may refuse a register
            return self._keep(Sample(controller, None, datetime.now(UTC)))
        held, known = self._held.get(controller), self._latest.get(controller)
        if held is not None:
            state = held.put_all(state, answer.time)
            self._whole[controller] = asyncio.get_running_loop().time()
        elif known is not None and known[1].state is not None:
            state = merged(known[1].state, state)
        return self._keep(Sample(controller, state, datetime.now(UTC), answer.time))

    def _keep(self, sample: Sample) -> Sample:
        self._latest[sample.controller] = asyncio.get_running_loop().time(), sample
        return sample

    async def _read(self, controller: str) -> Mapping[str, float | None]:
        names = self._registers.get(controller, ())
        if not names:
            return {}
        points = tuple(f"{controller}.{name}" for name in names)
        readings = cast("list[Mapping[str, Any]]", (await self.subject.do(command.ReadPoints(points))).value)
        return {name: reading["value"] for name, reading in zip(names, readings, strict=True)}


class Sampler:
    """Samples of controllers for one gateway, with the registers that are named by controller."""

    def __init__(self, shared: SharedSamples, registers: Mapping[str, Iterable[str]], interval: Nanos = INTERVAL) -> None:
        self.registers = {name: tuple(of) for name, of in registers.items()}
        self._shared = shared
        self._slots = max(round(interval / SECOND / TICK_S), 1)
        """Slots of an interval, as long as `TICK_S` each; moments are numbers of slots of the event loop's time."""
        self._last: dict[str, int] = {}
        """Sampled controllers, and when each of them was due the last time."""
        self._phases: dict[str, int] = {}
        """In which slot of `REST_S` each of them is read as a whole: not all of a thousand at the same moment."""
        self._at: dict[str, int] = {}
        """When each of them is due."""
        self._calendar: dict[int, dict[str, None]] = {}
        """The same by moment; entries that `_at` does not confirm are of the past."""
        self._ready: deque[str] = deque()
        self._woken = asyncio.Event()
        self._reading: dict[str, asyncio.Task[None]] = {}
        self._read: list[Sample] = []
        """Samples of devices, whose answers come later."""
        self._failed: BaseException | None = None
        """Error that has ended the reading of a device."""
        self._real = frozenset(part.name for part in shared.subject.description.controllers if part.is_real)
        self._shared.join(self)

    def close(self) -> None:
        self._shared.leave(self)
        for task in self._reading.values():
            task.cancel()

    # ------------------------------------------------------------------ what is sampled

    def watch(self, controllers: Iterable[str]) -> None:
        """Look at these from now on, and at no others."""
        wanted = set(controllers)
        for name in self._last.keys() - wanted:
            del self._last[name]
            self._at.pop(name, None)
        for name in wanted - self._last.keys():
            self._last[name] = -self._slots
            self._phases[name] = crc32(name.encode()) % _REST_SLOTS
            self._plan(name, self._now())

    def hasten(self, controller: str) -> None:
        """It may have changed, or will: sample it when the interval is over."""
        if controller in self._last:
            self._plan(controller, max(self._last[controller] + self._slots, self._now()))

    def changed_by_events(self, controllers: Iterable[str]) -> None:
        now = self._now()
        for name in controllers:
            last = self._last.get(name)
            if last is not None:
                self._plan(name, max(last + self._slots, now))

    def everything_changed(self) -> None:
        for name in self._last:
            self.hasten(name)

    def wake(self) -> None:
        self._woken.set()

    def _now(self) -> int:
        return int(asyncio.get_running_loop().time() / TICK_S + 1e-6)

    def _plan(self, controller: str, slot: int) -> None:
        planned = self._at.get(controller)
        if planned is None or planned > slot:
            self._at[controller] = slot
            self._calendar.setdefault(slot, {})[controller] = None

    # ------------------------------------------------------------------ samples

    async def due(self, within_s: float) -> list[str]:
        """Controllers that may have changed, some of them if there are many; none if there are none ``within_s``. Raises an
        unexpected error of the reading of a device.

        Whoever asks takes samples of them and reports it by `taken`."""
        loop = asyncio.get_running_loop()
        end = loop.time() + within_s
        await asyncio.sleep(0)
        while True:
            self._woken.clear()
            if self._failed is not None:
                raise self._failed
            self._shared.see_events()
            self._come(self._now())
            if self._ready or self._read or loop.time() >= end:
                return [self._ready.popleft() for _ in range(min(len(self._ready), AT_ONCE))]
            await self._wait(end)

    def _come(self, now: int) -> None:
        for slot in sorted(slot for slot in self._calendar if slot <= now):
            for name in self._calendar.pop(slot):
                if self._at.get(name) == slot:
                    del self._at[name]
                    self._last[name] = slot
                    self._ready.append(name)

    async def _wait(self, end: float) -> None:
        """Until the next moment at which something is due, or the end of the slot in which something happens."""
        loop = asyncio.get_running_loop()
        planned = min(self._calendar, default=None)
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout_at(end if planned is None else min(end, planned * TICK_S)):
                await self._woken.wait()
                await asyncio.sleep((self._now() + 1) * TICK_S - loop.time())

    def taken(self, sample: Sample) -> None:
        """This sample of a controller that was due has been taken."""
        name = sample.controller
        last = self._last.get(name)
        if last is None:
            return
        slot = last + self._slots
        if self._shared.is_resting(sample) and not self.registers.get(name):
            if name in self._real:
                slot = last + self._slots * RESTING_INTERVALS
            else:
                slot += (self._phases[name] - slot) % _REST_SLOTS
        self._plan(name, max(slot, self._now()))

    async def changed(self, within_s: float) -> list[Sample]:
        """Samples of controllers that may have changed, as `due`. A device that does not answer holds up no other controller."""
        found: list[Sample] = []
        for name in await self.due(within_s):
            if name in self._real:
                if name not in self._reading:
                    self._reading[name] = asyncio.create_task(self._read_device(name))
                    self._reading[name].add_done_callback(self._has_read)
            elif name in self._last:
                found.append(await self._shared.recent(name, self._last[name] * TICK_S))
                self.taken(found[-1])
        found += self._read
        self._read.clear()
        return found

    async def _read_device(self, name: str) -> None:
        try:
            sample = await self.take(name)
        finally:
            del self._reading[name]
        self._read.append(sample)
        self.taken(sample)
        self.wake()

    def _has_read(self, task: asyncio.Task[None]) -> None:
        if not task.cancelled() and task.exception() is not None:
            self._failed = task.exception()
            self.wake()

    async def take(self, controller: str) -> Sample:
        """The present values of a controller, read as a whole, or of the `CLOCK`."""
        return await self._shared.take(controller)

    async def present(self, controller: str) -> Sample:
        """The present values of a controller; of a twin only what may have changed is read."""
        return await self._shared.present(controller)
