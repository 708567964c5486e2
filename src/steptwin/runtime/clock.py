"""Wall time and virtual time."""

from __future__ import annotations

import time
from collections.abc import Callable

from steptwin.errors import Misuse
from steptwin.machine import SECOND, Nanos


class Clock:
    """Virtual time that runs ``speed`` times as fast as the wall's, from 0 on.

    ``wall_ns`` must never go back; the monotonic clock, which is the default, does not.
    """

    __slots__ = ("_start_ns", "_wall_ns", "speed")

    def __init__(self, speed: float = 1.0, wall_ns: Callable[[], Nanos] = time.monotonic_ns) -> None:
        if not 0.0 < speed < float("inf"):
            raise Misuse(f"speed = {speed:g}: must be finite and greater than 0")
        self.speed = speed
        self._wall_ns = wall_ns
        self._start_ns = wall_ns()

    def now(self) -> Nanos:
        passed = self._wall_ns() - self._start_ns
        return passed if self.speed == 1.0 else int(passed * self.speed)

    def wait_s(self, moment: Nanos) -> float:
        """Wall seconds until virtual ``moment``, at least 0."""
        return max((moment - self.now()) / self.speed, 0) / SECOND

    def lag(self, by: Nanos) -> None:
        """From now on virtual time is ``by`` behind what it would have been; nobody may have seen the time taken back."""
        self._start_ns += by if self.speed == 1.0 else int(by / self.speed)
