"""The value of one quantity at which another has a wanted value, where it goes one way only. No second formula: what is tried
out is the planner itself."""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt

MOST_STEPS = 200
"""Halving the logarithm of the widest range of REALs and then all bits of a double takes less than 80."""
SAME = 1e-12
"""Relative: closer values count as equal."""


def solve(of: Callable[[float], float], wanted: float, low: float, high: float) -> float | None:
    """The least ``x`` from ``low`` to ``high`` (both above 0) at which ``of(x)`` is ``wanted``; None where it never is.

    ``of`` rises or falls, or stays; by how much is the caller's.
    """
    first, last = of(low), of(high)
    if is_same(first, wanted):
        return low
    if not min(first, last) * (1.0 - SAME) <= wanted <= max(first, last) * (1.0 + SAME):
        return None
    rises = last > first
    for _ in range(MOST_STEPS):
        middle = sqrt(low) * sqrt(high) if high > 2.0 * low else 0.5 * (low + high)
        if not low < middle < high:
            break
        value = of(middle)
        # What is alike counts as reached, so that the beginning of an interval without change is found.
        if is_same(value, wanted) or (value > wanted) is rises:
            high = middle
        else:
            low = middle
    return high


def is_same(one: float, other: float) -> bool:
    return abs(one - other) <= SAME * max(abs(one), abs(other))
