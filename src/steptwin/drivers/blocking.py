"""Blocking calls made from a driver's coroutines.

On a `steptwin.drivers.threads.ThreadLine` a coroutine never suspends, so one step runs it to its end. The blocking classes
hold a driver and name its methods.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Coroutine
from types import TracebackType
from typing import Any, Concatenate, ParamSpec, Protocol, Self, TypeVar, cast

P = ParamSpec("P")
R = TypeVar("R")
R_co = TypeVar("R_co", covariant=True)


def finish(coroutine: Coroutine[Any, Any, R]) -> R:
    """The result of a coroutine that never suspends."""
    try:
        coroutine.send(None)
    except StopIteration as done:
        return done.value
    coroutine.close()
    raise RuntimeError("this line belongs to an event loop: use the asynchronous driver")


class Method(Protocol[P, R_co]):
    """The type of a method, for type checkers."""

    def __get__(self, instance: Any, owner: Any = None) -> Callable[P, R_co]: ...


def blocking(method: Callable[Concatenate[Any, P], Coroutine[Any, Any, R]]) -> Method[P, R]:
    """The blocking method that calls ``method`` of the class's ``_driver``."""

    @functools.wraps(method)
    def call(self: Any, *args: P.args, **kwargs: P.kwargs) -> R:
        return finish(method(self._driver, *args, **kwargs))

    return cast("Method[P, R]", call)


class Blocking:
    """Base of the blocking classes."""

    __slots__ = ("_driver",)

    def __init__(self, driver: Any) -> None:
        self._driver = driver

    def __repr__(self) -> str:
        return repr(self._driver).replace("Async", "", 1)


class BlockingLine(Blocking):
    """Base of lines and devices: ``with`` opens and closes them."""

    def __enter__(self) -> Self:
        finish(self._driver.open())
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        finish(self._driver.close())


class BlockingJog(Blocking):
    """Base of jogs: ``with`` begins and ends them."""

    def __enter__(self) -> Self:
        finish(self._driver.__aenter__())
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        finish(self._driver.__aexit__(kind, error, trace))
