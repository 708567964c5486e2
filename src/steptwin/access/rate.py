"""Rate limits of requests: a sustained rate, and a burst."""

from __future__ import annotations

from steptwin.controller import SECOND, Nanos


class RateLimit:
    """Permits ``rate`` requests per second, ``burst`` at once. Moments must not go back."""

    __slots__ = ("_burst", "_left", "_rate", "_since")

    def __init__(self, rate: float, burst: float) -> None:
        self._rate = rate
        self._burst = burst
        self._left = burst
        self._since: Nanos | None = None

    def allows(self, now: Nanos) -> bool:
        """Whether one more request is permitted; it is counted then."""
        passed = 0 if self._since is None else now - self._since
        self._since = now
        self._left = min(self._burst, self._left + passed / SECOND * self._rate)
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True


class RateLimits:
    """One for each key, the ``most`` of them that asked last."""

    def __init__(self, rate: float, burst: float, most: int = 1000) -> None:
        self._rate, self._burst, self._most = rate, burst, most
        self._of: dict[object, RateLimit] = {}

    def allows(self, key: object, now: Nanos) -> bool:
        limit = self._of.pop(key, None) or RateLimit(self._rate, self._burst)
        self._of[key] = limit
        if len(self._of) > self._most:
            del self._of[next(iter(self._of))]
        return limit.allows(now)
