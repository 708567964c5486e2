"""The interface of a line to its drivers, for tasks and threads alike.

Tasks wait on a `steptwin.drivers.tasks.TaskLine`, threads on a `steptwin.drivers.threads.ThreadLine`.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from contextlib import AbstractAsyncContextManager
from typing import Any, Protocol

from steptwin.controller import Nanos
from steptwin.drivers.exchange import A, ExchangeCounts, Job, Q
from steptwin.errors import Misuse
from steptwin.messages import Message

LONGEST_WAIT_S = 1e6
"""Longest time-out of a motion, s: eleven days."""


LINE_IS_CLOSED = Message("drivers.line-is-closed", "the line {place} is closed")
LOCK_SLICE_S = 1.0


class DriverLine(Protocol[Q, A]):
    """A line that several drivers, tasks or threads may share.

    ``shared`` holds the state that drivers of one device on the line share.
    """

    shared: dict[Hashable, Any]

    @property
    def place(self) -> str:
        """The address as text."""
        ...

    @property
    def counts(self) -> ExchangeCounts:
        """Traffic over it."""
        ...

    async def open(self) -> None:
        """Open the port or connection. Raises `LineLost`. An exchange reopens a lost line."""
        ...

    async def exchange(self, job: Job[Q, A]) -> A:
        """Send a request and return the answer. Raises `Refusal` or `LineFailure`."""
        ...

    async def sleep(self, seconds: float) -> None: ...

    def now(self) -> Nanos: ...

    def lock(self, key: Hashable, waiting: Callable[[], object] | None = None) -> AbstractAsyncContextManager[object]:
        """A lock for exchanges that belong together; the same key gives the same lock.

        ``waiting`` is called every `LOCK_SLICE_S` while another holds it, to distinguish waiting from a suspension.
        """
        ...

    async def close(self) -> None: ...


def check_wait(timeout_s: float | None) -> None:
    """Raises `Misuse` for a time-out (s) outside its range; None: it is computed."""
    if timeout_s is not None and not 0.0 <= timeout_s <= LONGEST_WAIT_S:
        raise Misuse(f"a time to wait of {timeout_s:g} s is outside 0 to {LONGEST_WAIT_S:.0f} s")
