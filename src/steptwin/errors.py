"""The three families of errors: the caller's misuse, the peer's refusal, the line's failure."""

from __future__ import annotations

from typing import Any


class SteptwinError(Exception):
    """Base of every error this package raises on purpose. Its text is meant for the user."""

    def __reduce__(self) -> tuple[Any, ...]:
        """For pickle and copy: an exception is otherwise made again from its text, which an own ``__init__`` does not take."""
        return _made_again, (type(self), self.args), self.__dict__


def _made_again(kind: type[SteptwinError], args: tuple[Any, ...]) -> SteptwinError:
    error = kind.__new__(kind)
    error.args = args
    return error


class Misuse(SteptwinError, ValueError):
    """The caller gave a value that is not permitted; the text names the value, the permitted range and its unit."""


class SourceErrors(Misuse):
    """Texts that the caller gave have errors. The text is the diagnostics, each with file, line and column."""


class TimeReversal(Misuse):
    """A machine was asked to go back in time."""

    def __init__(self, now: int, asked: int) -> None:
        super().__init__(f"time cannot go back: the machine is at {now} ns, asked for {asked} ns")


class Runaway(SteptwinError, RuntimeError):
    """More events in one instant than a machine can have: a loop that takes no time."""


class Refusal(SteptwinError):
    """The peer understood and refused (Modbus exception code, M1486 5EH)."""


class LineFailure(SteptwinError, OSError):
    """The line failed: time-out, bad CRC, disconnect. ``uncertain``: the peer may have executed the request nevertheless."""

    uncertain = False


class DatabaseFailure(LineFailure):
    """A database is damaged, full or gone: nothing is known of what was asked. What was written before stays."""
