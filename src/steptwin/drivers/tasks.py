"""A line for asyncio tasks."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Hashable, Mapping
from contextlib import AbstractAsyncContextManager
from types import TracebackType
from typing import Any, Generic, Self, cast

from steptwin.controller import SECOND, Nanos
from steptwin.drivers.exchange import A, ExchangeCounts, Exchanger, Job, LineLost, Q
from steptwin.drivers.line import LINE_IS_CLOSED, LOCK_SLICE_S
from steptwin.drivers.tcp import Endpoint
from steptwin.errors import Misuse
from steptwin.system import reason
from steptwin.tracing import is_traced, span

CLOSE_S = 1.0
"""Time for the other end to close a connection, s."""


class TaskLine(Generic[Q, A]):
    """See `steptwin.drivers.line.DriverLine`. It belongs to one event loop; ``async with`` opens and closes it."""

    def __init__(self, endpoint: Endpoint, exchanger: Exchanger[Q, A], shared: Mapping[Hashable, Any] | None = None) -> None:
        self.shared: dict[Hashable, Any] = {} if shared is None else dict(shared)
        self._endpoint = endpoint
        self._engine = exchanger
        self._loop: asyncio.AbstractEventLoop | None = None
        self._transport: asyncio.Transport | None = None
        self._connection: _LineConnection | None = None
        self._ended = asyncio.Event()  # set when that is no more
        self._opening: asyncio.Task[None] | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._timer_ns: Nanos  # moment of its arrival
        self._closed = False
        self._locks: dict[Hashable, asyncio.Lock] = {}

    @property
    def place(self) -> str:
        return str(self._endpoint)

    @property
    def counts(self) -> ExchangeCounts:
        return self._engine.counts

    def now(self) -> Nanos:
        return round(self._running().time() * SECOND)

    def _running(self) -> asyncio.AbstractEventLoop:
        if self._loop is None:
            self._loop = asyncio.get_running_loop()
        return self._loop

    # ------------------------------------------------------------------ opening

    async def __aenter__(self) -> Self:
        await self.open()
        return self

    async def __aexit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        await self.close()

    async def open(self) -> None:
        self._closed = False
        if self._transport is None:
            await self._open()

    async def _open(self) -> None:
        connection = self._connection = _LineConnection(self)
        self._ended.clear()
        transport = await self._endpoint.connect(lambda: connection)
        if self._closed:
            transport.abort()
        else:
            self._transport = transport

    def _reopen(self) -> None:
        if self._opening is None and self._engine.busy and not self._closed:
            self._opening = self._running().create_task(self._reopened())

    async def _reopened(self) -> None:
        try:
            await self._open()
        except LineLost as error:
            self._engine.fail_all(error)
        finally:
            self._opening = None
        self._run()

    # ------------------------------------------------------------------ exchanges

    async def exchange(self, job: Job[Q, A]) -> A:
        if not is_traced():
            return await self._exchanged(job)
        with span(f"line {self.place}", {"line": self.place, "request": str(job.request)}, is_part=True) as traced_span:
            try:
                return await self._exchanged(job)
            finally:
                traced_span.set_attribute("failed_attempts", job.attempts)

    async def _exchanged(self, job: Job[Q, A]) -> A:
        if self._closed:
            raise Misuse(LINE_IS_CLOSED(place=self.place))
        done: asyncio.Future[None] = self._running().create_future()
        job.on_done = lambda: None if done.done() else done.set_result(None)
        self._engine.submit(job)
        self._run()
        try:
            await done
        except asyncio.CancelledError:
            self._engine.withdraw(job)
            raise
        return job.result()

    def _run(self) -> None:
        transport = self._transport
        if transport is None:
            self._reopen()
            return
        engine = self._engine
        data = engine.step(self.now())
        if data:
            transport.write(data)
            engine.written()
        due = engine.deadline()
        if due is not None and (self._timer is None or due < self._timer_ns):
            self._arm(due)

    def _arm(self, due: Nanos) -> None:
        """Set the timer. An earlier one is kept: it finds nothing to do and sets the next."""
        if self._timer is not None:
            self._timer.cancel()
        self._timer_ns = due
        # The loop of a browser refuses moments that have passed.
        self._timer = self._running().call_later(max(due - self.now(), 0) / SECOND, self._wake)

    def _wake(self) -> None:
        self._timer = None
        self._run()

    def received(self, connection: _LineConnection, data: bytes) -> None:
        if self._transport is not connection.transport:
            return
        try:
            self._engine.receive(data, self.now())
        except LineLost as error:
            transport, self._transport = self._transport, None
            if transport is not None:
                transport.abort()
            self._engine.lost(error)
        self._run()

    def lost(self, connection: _LineConnection, error: Exception | None) -> None:
        if connection is self._connection:
            self._ended.set()
        if self._transport is not connection.transport:
            return
        self._transport = None
        why = "the other end closed the connection" if error is None else reason(error)
        self._engine.lost(LineLost(f"{self.place}: {why}"))
        self._run()

    # ------------------------------------------------------------------ the rest

    async def sleep(self, seconds: float) -> None:
        await asyncio.sleep(max(seconds, 0.0))

    def lock(self, key: Hashable, waiting: Callable[[], object] | None = None) -> AbstractAsyncContextManager[object]:
        lock = self._locks.setdefault(key, asyncio.Lock())
        return lock if waiting is None else _SlicedLock(lock, waiting)

    async def close(self) -> None:
        self._closed = True
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._opening is not None:
            self._opening.cancel()
        transport, self._transport = self._transport, None
        if transport is not None:
            transport.close()
            try:
                # A network serial port closes after its server has confirmed that all characters have been sent.
                async with asyncio.timeout(CLOSE_S):
                    await self._ended.wait()
            except TimeoutError:
                transport.abort()
        error = LineLost(f"the line {self.place} was closed")
        self._engine.lost(error)
        self._engine.fail_all(error)


class _SlicedLock:
    """See `steptwin.drivers.line.DriverLine.lock`. Waiting tasks keep their place in the queue."""

    __slots__ = ("_lock", "_waiting")

    def __init__(self, lock: asyncio.Lock, waiting: Callable[[], object]) -> None:
        self._lock = lock
        self._waiting = waiting

    async def __aenter__(self) -> None:
        if not self._lock.locked():
            await self._lock.acquire()
            return
        acquiring = asyncio.ensure_future(self._lock.acquire())
        try:
            while not (await asyncio.wait({acquiring}, timeout=LOCK_SLICE_S))[0]:
                self._waiting()
        except asyncio.CancelledError:
            if acquiring.done() and not acquiring.cancelled():
                self._lock.release()
            acquiring.cancel()
            raise

    async def __aexit__(self, *_: object) -> None:
        self._lock.release()


class _LineConnection(asyncio.Protocol):
    """One connection of a line; bytes from an old one are ignored."""

    transport: asyncio.Transport | None = None

    def __init__(self, line: TaskLine[Any, Any]) -> None:
        self._line = line

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = cast(asyncio.Transport, transport)  # uvloop's and serialx' are no subclasses

    def data_received(self, data: bytes) -> None:
        self._line.received(self, data)

    def connection_lost(self, exc: Exception | None) -> None:
        self._line.lost(self, exc)
