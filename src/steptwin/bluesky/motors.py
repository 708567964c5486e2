"""Axes as motors of Bluesky: Movable, Stoppable, Locatable, Readable, and where positions can be read in motion Flyable."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple, Protocol

from bluesky.protocols import EventCollectable, PartialEvent
from event_model import DataKey
from ophyd_async.core import (
    FlyableLogic,
    FlyMotorInfo,
    MovableLogic,
    SignalR,
    SignalRW,
    StandardFlyable,
    StandardMovable,
    StandardReadable,
    StandardReadableFormat,
    TimeoutCalculator,
    soft_signal_rw,
)

from steptwin.bluesky.motions import AwaitedMotion, DrivenAxis
from steptwin.bluesky.signals import POLL_S, DriverBackend, metadata_of
from steptwin.datasheet import Limits
from steptwin.errors import Misuse

SAMPLE_S = 0.02
"""How long a flying motor waits between two samples, s."""


class MotorPlace(NamedTuple):
    """Place of a motor and the positions that it can have, which its parent knows once it is connected."""

    source: Callable[[], str]
    positions: Callable[[], Limits | None]


@dataclass
class MotionLogic(MovableLogic[float]):
    """How a motor moves; limits are those of the axis, and within them those of the client (``low_limit``, ``high_limit``)."""

    motion: AwaitedMotion
    place: MotorPlace
    low_limit: SignalRW[float]
    high_limit: SignalRW[float]

    async def stop(self) -> None:
        await self.motion.stop()

    async def limits(self) -> Limits:
        known = self.place.positions()
        low, high = await asyncio.gather(self.low_limit.get_value(), self.high_limit.get_value())
        least, most = (None, None) if known is None else (known.low, known.high)
        return Limits(_narrower(max, low, least), _narrower(min, high, most))

    async def check_move(self, new_position: float) -> None:
        """Raises `Misuse` outside the limits."""
        limits = await self.limits()
        low, high = limits.low, limits.high
        if math.isfinite(new_position) and (low is None or new_position >= low) and (high is None or new_position <= high):
            return
        unit, _ = await self.get_units_precision()
        ends = " to ".join("any" if end is None else f"{end:.9g}" for end in (low, high))
        raise Misuse(f"{self.readback.name}: {new_position:.9g} {unit}: permitted are {ends} {unit}")

    async def move(self, new_position: float, timeout: TimeoutCalculator) -> None:
        await self.setpoint.set(new_position, timeout=timeout())


def _narrower(choose: Callable[[float, float], float], own: float, known: float | None) -> float | None:
    chosen = own if known is None else choose(own, known)
    return chosen if math.isfinite(chosen) else None


class MovingMotor(StandardMovable[float], StandardReadable):
    """The axis ``axis``. The status of `set` is done when the motion has ended, and fails when it was refused or interrupted.

    ``poll_s``: how often its position is read while it is monitored; None for an axis that does not tell it in motion.
    """

    def __init__(self, axis: DrivenAxis, place: MotorPlace, name: str = "", *, poll_s: float | None = POLL_S) -> None:
        self._axis = axis
        self._place = place
        shown = DriverBackend(
            float, place.source, axis.position, lambda: metadata_of(axis.unit, place.positions()), poll_s=poll_s
        )
        self._motion = AwaitedMotion(axis, shown.publish)
        wanted = DriverBackend(
            float, place.source, axis.position, lambda: metadata_of(axis.unit, place.positions()), write=self._motion.move
        )
        with self.add_children_as_readables(StandardReadableFormat.HINTED_UNCACHED_SIGNAL):
            self.readback = SignalR(shown)
        self.setpoint = SignalRW(wanted)
        with self.add_children_as_readables(StandardReadableFormat.CONFIG_SIGNAL):
            self.low_limit = soft_signal_rw(float, -math.inf)
            self.high_limit = soft_signal_rw(float, math.inf)
        super().__init__(name)

    @cached_property
    def movable_logic(self) -> MotionLogic:
        return MotionLogic(self.setpoint, self.readback, self._motion, self._place, self.low_limit, self.high_limit)


class RampedAxis(DrivenAxis, Protocol):
    """An axis whose velocity can be chosen, and that tells its position in motion: `steptwin.drivers.AsyncMic488Axis`."""

    async def set_ramp(self, *, velocity: float | None = None) -> None: ...


class RampSettings(NamedTuple):
    """In units per second, and per second squared."""

    velocity: float
    acceleration: float
    deceleration: float


class FlightSample(NamedTuple):
    """The position, and when it was there: between the sending of the request and its answer, s since 1970."""

    at_s: float
    position: float


@dataclass
class FlightContext:
    info: FlyMotorInfo
    before: RampSettings
    end: float
    has_come: asyncio.Event = field(default_factory=asyncio.Event)
    """It is at the start, or has ended."""
    flight: asyncio.Task[None] | None = None


@dataclass
class FlightLogic(MotionLogic, FlyableLogic[FlyMotorInfo, FlightContext]):
    """A pass at constant velocity: up to it before the start, down after the end. VMAX is afterwards what it was."""

    axis: RampedAxis = field(kw_only=True)
    ramp: Callable[[], Awaitable[RampSettings]] = field(kw_only=True)
    samples: list[FlightSample] = field(default_factory=list, kw_only=True)
    present: FlightContext | None = field(default=None, kw_only=True)

    async def on_prepare(self, value: FlyMotorInfo) -> FlightContext:
        """Moves to where the run-up begins, at the present velocity."""
        ramp = await self.ramp()
        begin = value.ramp_up_start_pos(value.speed / ramp.acceleration)
        end = value.ramp_down_end_pos(value.speed / ramp.deceleration)
        for position in (begin, end):
            await self.check_move(position)
        self.samples.clear()
        await self.setpoint.set(begin, timeout=None)
        return FlightContext(value, ramp, end)

    async def on_kickoff(self, ctx: FlightContext) -> FlightContext:
        """Returns when it has come to the start. Raises `SteptwinError` for a pass that was refused, or has ended before."""
        self.present = ctx
        await self.axis.set_ramp(velocity=ctx.info.speed)
        ctx.flight = asyncio.get_running_loop().create_task(self._fly(ctx))
        await ctx.has_come.wait()
        if ctx.flight.done():
            await ctx.flight
        return ctx

    async def on_complete(self, ctx: FlightContext) -> None:
        """Raises `SteptwinError` for a pass that was refused or interrupted."""
        if ctx.flight is not None:
            await ctx.flight

    async def _fly(self, ctx: FlightContext) -> None:
        watching = asyncio.get_running_loop().create_task(self._watch(ctx))
        try:
            await self.motion.move(ctx.end)
            if self.motion.was_stopped:
                raise RuntimeError(f"{self.readback.name} was stopped")
        finally:
            watching.cancel()
            await asyncio.wait((watching,))
            self.present = None
            try:
                await self.axis.set_ramp(velocity=ctx.before.velocity)
            finally:
                asyncio.get_running_loop().call_soon(ctx.has_come.set)  # when this task is done

    async def _watch(self, ctx: FlightContext) -> None:
        low, high = sorted((ctx.info.start_position, ctx.info.end_position))
        while True:
            before = time.time()
            position = await self.axis.position()
            if low <= position <= high:
                self.samples.append(FlightSample((before + time.time()) / 2.0, position))
                ctx.has_come.set()
            await asyncio.sleep(SAMPLE_S)

    async def on_stage(self) -> None:
        """An axis that others move is left alone."""

    async def on_unstage(self) -> None:
        if self.present is not None:
            await self.stop()


class FlyingMotor(MovingMotor, StandardFlyable[FlyMotorInfo, FlightContext], EventCollectable):
    """A motor that also makes passes at constant velocity, whose positions are collected."""

    def __init__(self, axis: RampedAxis, place: MotorPlace, ramp: Callable[[], Awaitable[RampSettings]], name: str = "") -> None:
        self._ramped = axis
        self._ramp = ramp
        super().__init__(axis, place, name)

    @cached_property
    def movable_logic(self) -> FlightLogic:
        return FlightLogic(
            self.setpoint,
            self.readback,
            self._motion,
            self._place,
            self.low_limit,
            self.high_limit,
            axis=self._ramped,
            ramp=self._ramp,
        )

    @cached_property
    def flyable_logic(self) -> FlightLogic:
        return self.movable_logic

    async def describe_collect(self) -> dict[str, DataKey]:
        return await self.readback.describe()

    async def collect(self) -> AsyncIterator[PartialEvent]:
        """The samples of the last pass between its start and its end."""
        samples, self.movable_logic.samples[:] = list(self.movable_logic.samples), []
        for at_s, position in samples:
            yield PartialEvent(time=at_s, data={self.name: position}, timestamps={self.name: at_s})
