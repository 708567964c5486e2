"""Results that may come later, without an event loop: coroutines that wait for a `Later`, and what runs them.

A coroutine whose results are there runs to its end at once. So the same code serves what answers at once, such as a world, and
what answers later, such as a device.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Generator
from functools import partial
from typing import Any, Generic, TypeVar

T = TypeVar("T")


class Later(Generic[T]):
    """A result, or an error instead of it, that is available now or later."""

    __slots__ = ("_actions", "_error", "_value", "is_done")

    def __init__(self) -> None:
        self.is_done = False
        self._value: tuple[T, ...] = ()
        """Empty until there is one."""
        self._error: Exception | None = None
        self._actions: list[Callable[[], object]] = []

    def put(self, value: T) -> None:
        """Set the result. Only the first result counts."""
        self._end((value,), None)

    def fail(self, error: Exception) -> None:
        """Set an error instead of a result."""
        self._end((), error)

    def _end(self, value: tuple[T, ...], error: Exception | None) -> None:
        if self.is_done:
            return
        self.is_done, self._value, self._error = True, value, error
        actions, self._actions = self._actions, []
        for action in actions:
            action()

    def result(self) -> T:
        """The result, once it is done. Raises its error."""
        if self._error is not None:
            raise self._error
        (value,) = self._value
        return value

    def then(self, action: Callable[[], object]) -> None:
        """Call ``action`` when the result is done: at once if it already is."""
        if self.is_done:
            action()
        else:
            self._actions.append(action)

    def __await__(self) -> Generator[Later[Any], None, T]:
        if not self.is_done:
            yield self
        return self.result()


def finish(parts: Generator[object, None, T]) -> T:
    """The result of something that is done in parts, after all of them."""
    while True:
        try:
            next(parts)
        except StopIteration as end:
            return end.value


def start(work: Coroutine[Later[Any], None, T]) -> Later[T]:
    """Run a coroutine until it waits; it continues when that result is done. It may wait for `Later` only."""
    later: Later[T] = Later()
    _go_on(work, later)
    return later


def _go_on(work: Coroutine[Later[Any], None, T], later: Later[T]) -> None:
    try:
        waited_for = work.send(None)
    except StopIteration as end:
        later.put(end.value)
    except Exception as error:  # noqa: BLE001  the caller that waits for the result gets it
        later.fail(error)
    else:
        waited_for.then(partial(_go_on, work, later))
