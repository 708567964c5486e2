"""Permission to send a request that moves an axis.

A program can be suspended at any moment, by a debugger, SIGSTOP, the sleep of a laptop or a lack of memory, and continue
hours later. A person at the machine does not expect a motion then. So a motion has a permission that expires; it is checked
against the clock immediately before sending.

A dead-man jog has one permission from before its first motion to its end, of the hold time: each answer of the device that
belongs to the motion extends it, and nothing else. A process that was away for longer finds it expired, for good (ADR 12).
"""

from __future__ import annotations

from collections.abc import Callable

from steptwin.controller import MILLISECOND, Nanos

HOLD_NS: Nanos = 400 * MILLISECOND
"""The usual hold time of a jog: so long after the last answer of the device that belongs to its motion nothing more is begun."""


def never() -> bool:
    """No stop applies."""
    return False


class Permission:
    """Permission for a request that acts. It ends with a stop, or ``patience_ns`` after it was given or extended.

    ``clock`` is that of the line; ``is_stopped`` returns whether a stop was requested meanwhile.
    """

    __slots__ = ("_clock", "_has_expired", "_until", "is_stopped", "patience_ns")

    def __init__(self, clock: Callable[[], Nanos], patience_ns: Nanos, is_stopped: Callable[[], bool] = never) -> None:
        self._clock = clock
        self.patience_ns = patience_ns
        self.is_stopped = is_stopped
        self._has_expired = False
        self._until = clock() + patience_ns

    def has_expired(self) -> bool:
        """Whether it is too late to send anything."""
        if not self._has_expired and self._clock() > self._until:
            self._has_expired = True
        return self._has_expired

    def extend(self) -> None:
        """Extend the permission, because the request makes progress. An expired one stays expired."""
        now = self._clock()  # once: the program may be suspended between two looks
        if now > self._until:
            self._has_expired = True
        elif not self._has_expired:
            self._until = now + self.patience_ns
