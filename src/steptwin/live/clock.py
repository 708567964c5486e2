"""Real time and virtual time."""

from __future__ import annotations

import time
from collections.abc import Callable
from math import inf

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message

SPEED_IS_OUT_OF_RANGE = Message("live.speed-is-out-of-range", "speed = {speed:g}: must be finite and greater than 0")


class Clock:
    """Virtual time that runs ``speed`` times as fast as real time, from ``begin`` (ns) on; it can be stopped.

    ``wall_ns`` must never go back; the monotonic clock, which is the default, does not.
    """

    __slots__ = ("_from_ns", "_start_ns", "is_stopped", "speed", "wall_ns")

    def __init__(self, speed: float = 1.0, wall_ns: Callable[[], Nanos] = time.monotonic_ns, begin: Nanos = 0) -> None:
        self.wall_ns = wall_ns
        self._from_ns = begin
        self.run(speed)

    def now(self) -> Nanos:
        if self.is_stopped:
            return self._from_ns
        passed = self.wall_ns() - self._start_ns
        return self._from_ns + (passed if self.speed == 1.0 else int(passed * self.speed))

    def wait_s(self, moment: Nanos) -> float:
        """Real seconds until virtual ``moment``, at least 0; infinite while the clock is stopped."""
        ahead = moment - self.now()
        if self.is_stopped:
            return inf if ahead > 0 else 0.0
        return max(ahead / self.speed, 0) / SECOND

    def lag(self, by: Nanos) -> None:
        """Set virtual time back by ``by``, ns; the time taken back must not have been observed."""
        self._from_ns -= by

    def stop(self, moment: Nanos) -> None:
        """Stop at ``moment``. No observed time may be later."""
        self._from_ns = moment
        self.is_stopped = True

    def run(self, speed: float) -> None:
        """Run at ``speed`` from the moment at which the clock was made or stopped. Raises `Misuse` for an invalid speed."""
        if not 0.0 < speed < inf:
            raise Misuse(SPEED_IS_OUT_OF_RANGE(speed=speed))
        self.speed = speed
        self._start_ns = self.wall_ns()
        self.is_stopped = False
