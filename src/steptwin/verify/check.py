"""A check as a value: its assumption, what it may do, and its steps without I/O."""

from __future__ import annotations

import enum
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import Annotated, Generic, NamedTuple, TypeAlias, TypeVar

from steptwin.errors import LineFailure


class CheckNeed(enum.IntEnum):
    """Effect of a check on the controller."""

    READ = 0
    """Nothing: it reads, and sends requests that are to be refused and would write present values if they were not."""
    WRITE = 1
    """It writes settings and puts them back."""
    MOVE = 2
    """It moves an axis and returns it."""


class CheckOutcome(enum.StrEnum):
    CONFIRMED = "confirmed"
    REFUTED = "refuted"
    NOT_CHECKED = "not checked"


class CheckRequest(NamedTuple):
    """Bytes to send; the answer of the line is what came within ``wait_s``, or until ``is_whole`` says that it is an answer.

    Without ``data`` it only waits. ``at_once``: without the usual pause before it.
    """

    data: bytes
    wait_s: float
    is_whole: Callable[[bytes], bool] = lambda received: False
    at_once: bool = False


R = TypeVar("R")
CheckSteps: TypeAlias = Generator[CheckRequest, bytes, R]
"""Yields what to send, gets what came."""


class Probe(NamedTuple):
    """One comparison of a check."""

    what: str
    expected: str
    came: str
    holds: bool


class Undecided(Exception):
    """The state of the controller permits no decision; the text is the reason."""


@dataclass(slots=True)
class Probes:
    """The comparisons of the check that runs, and what it has changed."""

    found: list[Probe] = field(default_factory=list)
    unrestored: dict[str, str] = field(default_factory=dict)
    """Values to be put back, by name."""

    def equal(self, what: str, expected: object, came: object) -> None:
        self.found.append(Probe(what, str(expected), str(came), expected == came))

    def holds(self, what: str, expected: str, came: str, holds: bool) -> None:
        self.found.append(Probe(what, expected, came, holds))


T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Check(Generic[T]):
    """A row of the table of checks of a kind of controller, whose talk is a ``T``.

    ``unless`` returns why it does not apply to this controller or line.
    """

    id: str
    what: str
    steps: Callable[[T], CheckSteps[None]]
    need: CheckNeed = CheckNeed.READ
    unless: Callable[[T], str | None] = lambda talk: None


@dataclass(frozen=True, slots=True)
class CheckResult:
    """Result for one assumption: ``why`` it was not checked, or its ``probes``."""

    id: Annotated[str, "Of the assumption."]
    outcome: CheckOutcome
    what: str
    probes: tuple[Probe, ...] = ()
    why: Annotated[str, "It was not checked."] = ""


class NotRestored(LineFailure):
    """A check could not put back what it had changed."""
