"""A scheduler in real time: `RealTimeDriver.start` begins it, and an input for its controllers comes between
`RealTimeDriver.enter` and `RealTimeDriver.leave`."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Protocol

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.live.batches import batches
from steptwin.live.clock import Clock

LONGEST_WAIT_S = 3600.0
"""Longest timer, s: event loops do not accept arbitrarily distant ones; longer waits are divided."""

LONGEST_DELAY_NS: Nanos = 500 * MILLISECOND
"""Delay of a deadline, in real time, above which the process was stopped or cannot keep up, ns; below it is jitter."""


LEAST_PART_NS, MOST_PART_NS = MILLISECOND, SECOND // 4
REST_S = 0.004
"""Real time after an advance that is bounded and took long. Where something is always due at once a browser gives a worker no
messages of its page, for seconds; 4 ms is its shortest timer."""


class Advanceable(Protocol):
    """Subject of a real-time driver, which advances it in real time: a scheduler or a whole world. The methods are those of
    `Scheduler`."""

    is_dirty: bool

    @property
    def now(self) -> Nanos: ...
    def advance(self, now: Nanos) -> None: ...
    def deadline(self) -> Nanos | None: ...


class RealTimeDriver:
    """Controllers in real time, advanced together at their deadlines and when an input arrives.

    While the process does not run, virtual time stands still, so that there is no backlog; ``on_lag`` is called with the delay.

    ``longest_ns``: real time that an advance takes at most where nothing else can run meanwhile; virtual time that does not fit
    into it is delayed. After an advance that took long inputs come at the moment that was reached, until the timer begins the
    next one: a request would wait for an advance for each thing that is read for it. None: each advance ends at the present.
    """

    __slots__ = (
        "_armed_for",
        "_batch",
        "_batches",
        "_loop",
        "_part",
        "_rests",
        "_timer",
        "clock",
        "longest_ns",
        "moments",
        "on_lag",
        "scheduler",
    )

    def __init__(self, scheduler: Advanceable, clock: Clock, longest_ns: Nanos | None = None) -> None:
        self.scheduler = scheduler
        self.longest_ns = longest_ns
        self._rests = False
        """Whether the last advance took long, and the timer will begin the next one."""
        self._part: Nanos = LEAST_PART_NS
        """Virtual time between two readings of the wall clock, in an advance that is bounded."""
        self.clock = clock
        self.on_lag: Callable[[Nanos], None] | None = None
        self._loop = asyncio.get_running_loop()
        self._batches = batches()
        self._batch = 0
        """The batch for which the controllers were advanced to the present."""
        self.moments = 0
        """Counts the advances to the present: with each, time may have passed and signals have settled."""
        self._timer: asyncio.TimerHandle | None = None
        self._armed_for: Nanos | None = None

    def start(self) -> None:
        """Follow the clock from now on: controllers act at their deadlines, also without inputs."""
        self.enter()
        self._arm(self.scheduler.deadline())

    def enter(self) -> Nanos:
        """Advance the controllers to the present. Apply inputs at the moment returned, then call `leave`."""
        batch = self._batches.current
        if (batch and batch == self._batch) or self._rests:
            return self.scheduler.now
        self._batch = batch
        self.moments += 1
        now = self.clock.now()
        due = self._armed_for
        if due is not None and now - due > LONGEST_DELAY_NS * self.clock.speed:
            now = self._held_up(due, now)
        began = 0 if self.longest_ns is None else self.clock.wall_ns()
        reached = self.advance(now)
        if self.longest_ns is not None and not self.clock.is_stopped:
            self.clock.lag(now - reached)
            self._rests = reached < now or self.clock.wall_ns() - began > self.longest_ns // 4
            if self._rests:
                self._arm_after(REST_S, reached)
        return reached

    def advance(self, to: Nanos) -> Nanos:
        """Advance the controllers, within `longest_ns`, and give the moment that was reached."""
        if self.longest_ns is None:
            self.scheduler.advance(to)
            return to
        begin = before = self.clock.wall_ns()
        while True:
            part = min(to, self.scheduler.now + self._part)
            self.scheduler.advance(part)
            now = self.clock.wall_ns()
            if now - before > self.longest_ns // 4:
                self._part = max(self._part // 2, LEAST_PART_NS)
            elif now - before < self.longest_ns // 16:
                self._part = min(self._part * 2, MOST_PART_NS)
            if part == to or self.scheduler.now < part or now - begin >= self.longest_ns:
                return self.scheduler.now
            before = now

    def leave(self) -> None:
        """Let signals settle after an input, and set the timer for the next deadline."""
        if self.scheduler.is_dirty:
            self._batch = 0  # something may be due at once
            self._arm(self.scheduler.deadline())

    def _held_up(self, due: Nanos, now: Nanos) -> Nanos:
        """Continue at the moment at which the delay began."""
        resumed = max(due, self.scheduler.now)
        self.clock.lag(now - resumed)
        if self.on_lag is not None:
            self.on_lag(now - resumed)
        return resumed

    def _arm(self, due: Nanos | None) -> None:
        if due is None or self.clock.is_stopped or (self._armed_for is not None and self._armed_for <= due):
            return
        self._arm_after(min(self.clock.wait_s(due), LONGEST_WAIT_S), due)

    def _arm_after(self, wait_s: float, due: Nanos) -> None:
        if self._timer is not None:
            self._timer.cancel()
        self._armed_for = due
        self._timer = self._loop.call_later(wait_s, self._wake)

    def _wake(self) -> None:
        self._rests = False
        self.enter()
        if not self._rests:
            self._timer = self._armed_for = None
            self._arm(self.scheduler.deadline())

    def close(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = self._armed_for = None
        self._rests = False
