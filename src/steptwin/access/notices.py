"""Notices about clients: a client that sends nonsense without end does not fill the log."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

from steptwin.access.rate import RateLimits
from steptwin.controller import Nanos

AT_ONCE = 5
EACH_S = 60.0
MOST_HOSTS = 1000


class ClientNotices:
    """Passes to ``notice`` `AT_ONCE` lines about a host, and then one in `EACH_S`, which counts what was left out.

    ``clock`` gives nanoseconds that never go back.
    """

    def __init__(self, notice: Callable[[str], object], clock: Callable[[], Nanos]) -> None:
        self._notice = notice
        self._clock = clock
        self._limits = RateLimits(1 / EACH_S, AT_ONCE, MOST_HOSTS)
        self._left_out: Counter[str] = Counter()

    def say(self, host: str, text: str) -> None:
        """``host``: where the client is, without its port; empty for a notice about all clients."""
        if not self._limits.allows(host, self._clock()):
            self._left_out[host] += 1
            return
        count = self._left_out.pop(host, 0)
        if len(self._left_out) > MOST_HOSTS:
            self._left_out.clear()
        self._notice(f"{text} ({count} more like this were left out)" if count else text)
