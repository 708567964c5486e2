"""Scripts that run: generators of steps, with what they were sent and what they wait for."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

from steptwin.machine import Nanos
from steptwin.world import script as do
from steptwin.world.expression import Condition
from steptwin.world.lines import Line


@dataclass(slots=True)
class Waiting:
    """What a script waits for. ``until`` is a moment; a condition or an answer may come before it."""

    until: Nanos | None
    condition: Condition | None = None
    answer: Line | None = None

    @property
    def is_timed(self) -> bool:
        """Whether nothing but a moment ends it."""
        return self.condition is None and self.answer is None and self.until is not None


class ScriptState(NamedTuple):
    """A script, what it was sent so far, as (value, how often), what it waits for, and whether it has ended."""

    name: str
    make: Callable[[], do.Steps]
    is_outside: bool
    sent: tuple[tuple[Any, int], ...]
    until: Nanos | None
    condition: str | None
    answer: str | None
    ended: bool


class Script:
    """A generator of steps in progress."""

    __slots__ = ("ended", "is_outside", "make", "name", "number", "sent", "steps", "waiting")

    def __init__(self, number: int, name: str, make: Callable[[], do.Steps], *, is_outside: bool) -> None:
        self.number = number
        self.name = name
        self.make = make
        self.is_outside = is_outside
        """Whether it is no part of the description: what it does comes from outside."""
        self.sent: list[tuple[Any, int]] = []
        self.steps = make()
        self.waiting: Waiting | None = None
        self.ended = False

    def send(self, value: Any) -> do.Step | None:
        if self.sent and self.sent[-1][0] is value:
            self.sent[-1] = value, self.sent[-1][1] + 1
        else:
            self.sent.append((value, 1))
        return self._next(value)

    def _next(self, value: Any) -> do.Step | None:
        try:
            return self.steps.send(value)
        except StopIteration:
            self.ended = True
            return None

    def state(self) -> ScriptState:
        waiting = self.waiting
        return ScriptState(
            self.name,
            self.make,
            self.is_outside,
            tuple(self.sent),
            None if waiting is None else waiting.until,
            None if waiting is None or waiting.condition is None else waiting.condition.text,
            None if waiting is None or waiting.answer is None else waiting.answer.name,
            self.ended,
        )

    def replay(self, sent: Iterable[tuple[Any, int]]) -> None:
        """Bring a fresh generator to where it had been sent all this."""
        self.steps.close()
        self.steps = self.make()
        self.sent = list(sent)
        self.ended = False
        for value, count in self.sent:
            for _ in range(count):
                self._next(value)
