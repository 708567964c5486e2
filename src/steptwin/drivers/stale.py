"""Input that was typed while the program was suspended.

A terminal keeps what is typed while the program does not run, and delivers it all at once afterwards. It must not move
anything.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

BEAT_S = 0.05
"""How often `StaleInput.beat` is to be called while the program runs."""
SUSPENDED_S = 1.0
"""A longer time between two beats is a suspension; a loaded machine comes close to it."""
QUIET_S = 0.5
"""After a suspension the input counts as stale until there was none for this time."""


class StaleInput:
    """Distinguishes stale input from fresh. ``clock`` is in seconds. Threads may share it."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._beat_s = self._stale_until_s = clock()

    def beat(self) -> None:
        """Report that the program runs."""
        with self._lock:
            self._beat()

    def is_stale(self) -> bool:
        """Whether input that arrives now is from a suspension, or continues such input."""
        with self._lock:
            self._beat()  # input may be delivered before the beat that is due
            if self._beat_s >= self._stale_until_s:
                return False
            self._stale_until_s = self._beat_s + QUIET_S
            return True

    def _beat(self) -> None:
        now = self._clock()
        if now - self._beat_s > SUSPENDED_S:
            self._stale_until_s = now + QUIET_S
        self._beat_s = now
