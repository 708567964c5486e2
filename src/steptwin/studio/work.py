"""Searches for devices and checks of one, in a thread: one at a time, for all viewers."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from typing import Any, Protocol

from steptwin.errors import Refusal, SteptwinError
from steptwin.eventloop import later, result_of
from steptwin.later import Later
from steptwin.messages import Message
from steptwin.studio.workrequests import Cancelled, Work


class Worker(Protocol):
    """Does the work. Blocks; raises `SteptwinError`, and `Cancelled` out of a progress."""

    def plan(self, places: Sequence[str], kind: str, units: str, baud: str | None, timeout: float) -> Callable[[Work], None]:
        """A search, whose rows it adds to ``found``. Raises `Misuse` for wrong fields."""
        ...

    def verify(self, work: Work, address: str, *, write: bool) -> dict[str, object]:
        """The report of the checks."""
        ...


WORK_IS_RUNNING = Message("studio.work-is-running", "{kind} is running: wait, or cancel it")


class DeviceWork:
    """See `steptwin.studio.surroundings.LongWork`."""

    def __init__(self, worker: Worker, on_internal: Callable[[Exception], object]) -> None:
        self._worker = worker
        self._on_internal = on_internal
        self._work: Work | None = None
        self._running: Later[None] | None = None

    def scan(self, places: Sequence[str], kind: str, units: str, baud: str | None, timeout: float) -> None:
        search = self._worker.plan(places, kind, units, baud, timeout)
        self._begin("scan", search)

    def verify(self, address: str, *, write: bool) -> None:
        def checks(work: Work) -> None:
            work.report = self._worker.verify(work, address, write=write)

        self._begin("verify", checks)

    @property
    def last(self) -> Work | None:
        return self._work

    def cancel(self) -> None:
        if self._work is not None:
            self._work.is_cancelled = True

    def _begin(self, kind: str, do: Callable[[Work], None]) -> None:
        if self._work is not None and self._work.is_running:
            raise Refusal(WORK_IS_RUNNING(kind=self._work.work))
        work = self._work = Work(kind)
        self._running = later(asyncio.to_thread(self._run, work, do))

    def _run(self, work: Work, do: Callable[[Work], Any]) -> None:
        try:
            do(work)
        except Cancelled:
            work.problems.append("cancelled")
        except SteptwinError as error:
            work.problems.append(str(error))
        except Exception as error:  # noqa: BLE001  it is reported, and the next work can begin
            work.problems.append("an error in steptwin")
            self._on_internal(error)
        finally:
            work.is_running = False

    async def close(self) -> None:
        """Wait for its end, so that what was changed is put back."""
        self.cancel()
        if self._running is not None:
            await result_of(self._running)
