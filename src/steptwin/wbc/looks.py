"""The first moment at which a condition can change (WBC-18); evaluations before it can be skipped."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from steptwin.controller import Nanos

Side = Callable[[Nanos], float]
"""The value at a moment. Within each interval it only rises or only falls."""


def first_change(side: Side, begin: Nanos, period: Nanos, intervals: Iterable[Nanos], horizon: Nanos) -> Nanos | None:
    """The first of the moments ``begin + period``, ``begin + 2 period``, … at which the value differs from that at ``begin``.

    ``intervals`` are the ends of the intervals, in order; after the last one nothing changes any more. None if nothing else is
    ever seen; the first of the moments after ``horizon`` if not up to there.
    """
    seen = side(begin)
    at = begin + period
    for end in intervals:
        if end < at:
            continue
        if at > horizon or side(at) != seen:
            return at
        last = (min(end, horizon) - at) // period
        found = _within(side, seen, at, period, last)
        if found is not None:
            return found
        at += (last + 1) * period
    return at if at > horizon or side(at) != seen else None


def _within(side: Side, seen: float, at: Nanos, period: Nanos, last: int) -> Nanos | None:
    """Moments of ``at + k · period`` up to k = ``last``, all in one interval, where ``seen`` is seen at ``at``."""
    same, step = 0, 1
    # Most changes are near, and some intervals have no end: steps of growing size first, then halving.
    while same < last:
        k = min(same + step, last)
        if side(at + k * period) != seen:
            break
        same = k
        step *= 8
    else:
        return None
    different = k
    while different - same > 1:
        middle = (same + different) // 2
        if side(at + middle * period) != seen:
            different = middle
        else:
            same = middle
    return at + different * period
