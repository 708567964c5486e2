"""A line for threads.

A thread that waits for an answer runs the line until it has it; the others wait for their turn. So there is no background
thread, and a process that hangs sends nothing.

The methods are coroutines that never suspend, so the same driver runs on this and on `steptwin.drivers.tasks`.
`steptwin.drivers.blocking` makes blocking calls of them.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Hashable, Mapping
from typing import Any, Generic

from steptwin.controller import SECOND, Nanos
from steptwin.drivers.exchange import A, ExchangeCounts, Exchanger, Job, LineLost, Q
from steptwin.drivers.line import LINE_IS_CLOSED, LOCK_SLICE_S
from steptwin.drivers.tcp import Channel, Endpoint
from steptwin.errors import Misuse


class ThreadLine(Generic[Q, A]):
    """See `steptwin.drivers.line.DriverLine`. ``clock`` and ``sleeping``: real time."""

    def __init__(
        self,
        endpoint: Endpoint,
        exchanger: Exchanger[Q, A],
        shared: Mapping[Hashable, Any] | None = None,
        *,
        clock: Callable[[], Nanos] = time.monotonic_ns,
        sleeping: Callable[[float], None] = time.sleep,
    ) -> None:
        self.shared: dict[Hashable, Any] = {} if shared is None else dict(shared)
        self.now = clock
        self._endpoint = endpoint
        self._engine = exchanger
        self._sleeping = sleeping
        self._channel: Channel | None = None
        self._closed = False
        self._changed = threading.Condition(threading.Lock())
        self._leading = False  # whether some thread runs the line
        self._locks: dict[Hashable, threading.Lock] = {}

    @property
    def place(self) -> str:
        return str(self._endpoint)

    @property
    def counts(self) -> ExchangeCounts:
        return self._engine.counts

    async def open(self) -> None:
        with self._changed:
            self._closed = False
            if self._channel is None:
                self._channel = self._endpoint.open()

    async def exchange(self, job: Job[Q, A]) -> A:
        with self._changed:
            if self._closed:
                raise Misuse(LINE_IS_CLOSED(place=self.place))
            self._engine.submit(job)
            try:
                if self._leading:
                    self._follow(job)
                if not job.done:
                    self._lead(job)
            finally:
                if not job.done:
                    self._engine.withdraw(job)
        return job.result()

    def _follow(self, job: Job[Q, A]) -> None:
        """Wait until another thread has finished the job, or none runs the line."""
        job.on_done = self._changed.notify_all
        while self._leading and not job.done:
            self._changed.wait()

    def _lead(self, job: Job[Q, A]) -> None:
        """Run the line, for other threads, too, until ``job`` is finished."""
        self._leading = True
        try:
            if self._engine.discipline.wary:
                self._empty()
            while not job.done:
                try:
                    self._turn(job)
                except LineLost as error:
                    self._drop(error)
        finally:
            self._leading = False
            if self._engine.busy:
                self._changed.notify_all()

    def _empty(self) -> None:
        """Discard bytes received between exchanges."""
        try:
            while self._channel is not None and (data := self._channel.read(0.0)):
                self._engine.receive(data, self.now())
        except LineLost as error:
            self._drop(error)

    def _turn(self, job: Job[Q, A]) -> None:
        if self._closed:
            self._end()
        elif self._channel is None:
            self._reopen()
        else:
            self._exchange(self._channel, job)

    def _exchange(self, channel: Channel, job: Job[Q, A]) -> None:
        engine = self._engine
        now = self.now()
        data = engine.step(now)
        if data:
            channel.write(data)
            engine.written()
        due = engine.deadline()
        if due is None or job.done:
            return
        self._changed.release()
        try:
            received = channel.read((due - now) / SECOND)
        finally:
            self._changed.acquire()
        if received:
            engine.receive(received, self.now())

    def _reopen(self) -> None:
        """Open the line again; on failure end all jobs with the error."""
        try:
            self._channel = self._endpoint.open()
        except LineLost as error:
            self._engine.fail_all(error)

    def _drop(self, error: LineLost) -> None:
        channel, self._channel = self._channel, None
        if channel is not None:
            channel.close()
        self._engine.lost(error)

    async def sleep(self, seconds: float) -> None:
        if seconds > 0.0:
            self._sleeping(seconds)

    def lock(self, key: Hashable, waiting: Callable[[], object] | None = None) -> ThreadLock:
        return ThreadLock(self._locks.setdefault(key, threading.Lock()), waiting)

    async def close(self) -> None:
        """Close the line. Waiting jobs of other threads end with `LineLost`, at the latest at their time-out."""
        with self._changed:
            self._closed = True
            if not self._leading:
                self._end()

    def _end(self) -> None:
        error = LineLost(f"the line {self.place} was closed")
        self._drop(error)
        self._engine.fail_all(error)


class ThreadLock:
    """A lock for threads that is entered like one for tasks; ``waiting`` as of `steptwin.drivers.line.DriverLine.lock`."""

    __slots__ = ("_lock", "_waiting")

    def __init__(self, lock: threading.Lock, waiting: Callable[[], object] | None) -> None:
        self._lock = lock
        self._waiting = waiting

    async def __aenter__(self) -> None:
        if self._waiting is None:
            self._lock.acquire()
            return
        while not self._lock.acquire(timeout=LOCK_SLICE_S):
            self._waiting()

    async def __aexit__(self, *_: object) -> None:
        self._lock.release()
