"""`steptwin.later.Later` and the event loop: a task whose result is there later, and waiting for a result; tasks without end."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

from steptwin.errors import LineFailure
from steptwin.later import Later

T = TypeVar("T")
_TASKS: set[asyncio.Task[Any]] = set()


def later(work: Coroutine[Any, Any, T]) -> Later[T]:
    """Run ``work`` as a task; what it gives is there later."""
    found: Later[T] = Later()

    def ended(task: asyncio.Task[T]) -> None:
        _TASKS.discard(task)
        if task.cancelled():
            found.fail(LineFailure("given up: the server or the connection to the device was closed"))
            return
        error = task.exception()
        if isinstance(error, Exception):
            found.fail(error)
        else:
            found.put(task.result())

    task = asyncio.get_running_loop().create_task(work)
    _TASKS.add(task)  # the loop itself keeps none
    task.add_done_callback(ended)
    return found


async def result_of(later: Later[T]) -> T:
    """Wait for it. Raises its error."""
    if not later.is_done:
        arrived = asyncio.Event()
        later.then(arrived.set)
        await arrived.wait()
    return later.result()


def endless(work: Coroutine[Any, Any, None], failed: Callable[[str], None]) -> asyncio.Task[None]:
    """Run ``work`` as a task that only a cancellation ends; ``failed`` is called with the text of an error that ends it."""

    def ended(task: asyncio.Task[None]) -> None:
        error = None if task.cancelled() else task.exception()
        if error is not None:
            failed(f"internal error, please report it: {type(error).__name__}: {error}")

    task = asyncio.get_running_loop().create_task(work)
    task.add_done_callback(ended)
    return task
