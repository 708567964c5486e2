"""Running scripts: their progress and what they wait for."""

from __future__ import annotations

from array import array
from collections.abc import Callable
from typing import Any, NamedTuple, TypeAlias

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.script import steps as do


class PendingRequests(NamedTuple):
    """The requests ``first`` to ``last`` on a line, for whose answers a script waits; ``written``: the values of a `Write`."""

    line: str
    first: int
    last: int
    written: str = ""


class ScriptWait(NamedTuple):
    """Wait of a script: a moment, or a condition or answers before that moment."""

    until: Nanos | None
    condition: str | None = None
    asked: tuple[PendingRequests, ...] = ()
    answer: bytes | None = None
    """The answer of a `Request` that was answered at once."""
    is_request: bool = False
    """Whether the answer is sent to the script's generator."""
    began: Nanos = 0
    """When a wait for a condition began."""

    @property
    def is_timed(self) -> bool:
        """Whether only the passing of time ends the wait."""
        return self.condition is None and not self.asked


WRONG_RESULT_OF_A_STEP = Message(
    "simulation.wrong-result-of-a-step", "{value}: the result of a step is None, a truth value, a number or bytes"
)


class SentValues:
    """All values sent to a generator so far, stored compactly because scripts may run for months."""

    __slots__ = ("_bytes", "_kinds", "_lengths", "_numbers")

    _PLAIN = (None, False, True)
    _NUMBER, _BYTES = 3, 4

    def __init__(self) -> None:
        self._kinds = bytearray()
        self._numbers = array("d")
        self._lengths = array("L")
        self._bytes = bytearray()

    def __len__(self) -> int:
        return len(self._kinds)

    def add(self, value: object) -> None:
        """Add the result of a step: None, a truth value, a number or bytes."""
        if value is None or value is False or value is True:
            self._kinds.append(self._PLAIN.index(value))
        elif isinstance(value, float):
            self._kinds.append(self._NUMBER)
            self._numbers.append(value)
        elif isinstance(value, bytes):
            self._kinds.append(self._BYTES)
            self._lengths.append(len(value))
            self._bytes += value
        else:
            raise Misuse(WRONG_RESULT_OF_A_STEP(value=repr(value)))

    def values(self) -> Any:
        """All values in order."""
        numbers, lengths, at = iter(self._numbers), iter(self._lengths), 0
        for kind in self._kinds:
            if kind == self._NUMBER:
                yield next(numbers)
            elif kind == self._BYTES:
                length = next(lengths)
                yield bytes(self._bytes[at : at + length])
                at += length
            else:
                yield self._PLAIN[kind]

    def copy(self) -> SentValues:
        other = SentValues()
        other._kinds, other._bytes = self._kinds.copy(), self._bytes.copy()
        other._numbers, other._lengths = self._numbers[:], self._lengths[:]
        return other


ScriptProgress: TypeAlias = "tuple[tuple[int, int], ...] | SentValues"
"""The progress of a script: its place in a `Walk`, or the values sent to its generator."""


class ScriptState(NamedTuple):
    """The state of a script that has not ended."""

    number: int
    name: str
    make: Callable[[], do.Steps | do.Walk]
    is_external: bool
    place: ScriptProgress
    waiting: ScriptWait | None


class Script:
    """A script in progress. Scripts are numbered in the order of their start."""

    __slots__ = ("_sent", "_steps", "ended", "entry", "is_external", "make", "name", "number", "sources", "waiting")

    def __init__(self, number: int, name: str, make: Callable[[], do.Steps | do.Walk], *, is_external: bool) -> None:
        self.number = number
        self.name = name
        self.make = make
        self.is_external = is_external
        """Whether it is not part of the description, so that its actions are external inputs."""
        self._sent = SentValues()
        self._steps = make()
        self.waiting: ScriptWait | None = None
        self.entry = 0
        """The number of its valid entry in an agenda."""
        self.sources: tuple[Any, ...] = ()
        """The controllers, lines and elements on which its wait depends (`steptwin.simulation.scheduler.scheduler.Source`)."""
        self.ended = False

    def send(self, value: Any) -> do.Step | None:
        """The next step; None after the last."""
        if not isinstance(self._steps, do.Walk):
            self._sent.add(value)
        return self._next(value)

    def _next(self, value: Any) -> do.Step | None:
        try:
            return self._steps.send(value)
        except StopIteration:
            self.end()
            return None

    def end(self) -> None:
        """End it: no further step is executed."""
        self.ended = True
        self._steps.close()
        self._sent = SentValues()

    def state(self) -> ScriptState:
        steps = self._steps
        place: ScriptProgress = steps.place if isinstance(steps, do.Walk) else self._sent.copy()
        return ScriptState(self.number, self.name, self.make, self.is_external, place, self.waiting)

    @classmethod
    def at(cls, state: ScriptState) -> Script:
        """A script in a given state: a walk at its place, or a new generator that was sent the same values again."""
        script = cls(state.number, state.name, state.make, is_external=state.is_external)
        if isinstance(state.place, SentValues):
            script._sent = state.place.copy()
            for value in state.place.values():
                script._next(value)
        elif isinstance(script._steps, do.Walk):
            script._steps.place = state.place
        return script
