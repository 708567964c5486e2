"""What a driver needs of a line, whatever waits for its answers.

Tasks wait on a `steptwin.drivers.tasks.TaskLine`, threads on a `steptwin.drivers.threads.ThreadLine`.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from contextlib import AbstractAsyncContextManager
from typing import Any, Protocol

from steptwin.drivers.exchange import A, Job, Q
from steptwin.errors import Misuse
from steptwin.machine import Nanos

LONGEST_WAIT_S = 1e6
"""Nobody waits longer for a motion: eleven days."""


LOCK_SLICE_S = 1.0


class DriverLine(Protocol[Q, A]):
    """A line that may be shared by several drivers, tasks or threads.

    ``notes`` is where drivers of one device on the line keep what they have in common.
    """

    notes: dict[Hashable, Any]

    @property
    def place(self) -> str:
        """Where it is, for people."""
        ...

    async def open(self) -> None:
        """Open the port or the connection. Raises `LineLost`. An exchange opens a line that was lost again."""
        ...

    async def exchange(self, job: Job[Q, A]) -> A:
        """The answer. Raises `Refusal` or `LineFailure`."""
        ...

    async def sleep(self, seconds: float) -> None: ...

    def now(self) -> Nanos: ...

    def lock(self, key: Hashable, waiting: Callable[[], object] | None = None) -> AbstractAsyncContextManager[object]:
        """For several exchanges that belong together; the same key gives the same lock.

        ``waiting`` is called every `LOCK_SLICE_S` while another holds it, so that waiting can be told from being suspended.
        """
        ...

    async def close(self) -> None: ...


def check_wait(timeout_s: float | None) -> None:
    """`Misuse` for a time nobody can wait; None is one to be computed."""
    if timeout_s is not None and not 0.0 <= timeout_s <= LONGEST_WAIT_S:
        raise Misuse(f"a time to wait of {timeout_s:g} s is outside 0 to {LONGEST_WAIT_S:.0f} s")
