"""Variation: how a number from 0 to 1 becomes a value."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import exp, log
from statistics import NormalDist

from steptwin.campaign.case import VariedValue

TIME_DIGITS = 9
"""Times are whole nanoseconds."""
SIGNIFICANT = 9
"""Digits of other numbers."""
MOST_LEVELS = 1_000_000


@dataclass(frozen=True, slots=True)
class Between:
    """Uniform from ``low`` to ``high``; ``is_log``: uniform in the logarithm. ``steps``: so many equidistant levels in a grid."""

    low: float
    high: float
    is_log: bool = False
    is_whole: bool = False
    is_time: bool = False
    steps: int = 0

    def value(self, u: float) -> VariedValue:
        if self.is_whole:
            return min(int(self.low) + int(u * (self.high - self.low + 1)), int(self.high))
        low, high = (log(self.low), log(self.high)) if self.is_log else (self.low, self.high)
        found = low + u * (high - low)
        found = exp(found) if self.is_log else found
        return rounded(min(max(found, self.low), self.high), is_time=self.is_time)

    @property
    def levels(self) -> tuple[VariedValue, ...]:
        return _levels(self)

    @property
    def is_grid(self) -> bool:
        return False


@lru_cache(maxsize=64)
def _levels(of: Between) -> tuple[VariedValue, ...]:
    """May be a million, and each case asks for them."""
    if of.is_whole and not of.steps and of.high - of.low < MOST_LEVELS:
        return tuple(range(int(of.low), int(of.high) + 1))
    if of.steps < 2:
        return (of.value(0.5),) if of.steps else ()
    return tuple(dict.fromkeys(of.value(n / (of.steps - 1)) for n in range(of.steps)))


@dataclass(frozen=True, slots=True)
class Normal:
    """A normal distribution, cut off at ``low`` and ``high`` where these are given."""

    mean: float
    deviation: float
    low: float | None = None
    high: float | None = None
    is_time: bool = False

    @property
    def _shares(self) -> tuple[float, float]:
        """Shares of the whole distribution below ``low`` and below ``high``."""
        curve = NormalDist(self.mean, self.deviation)
        return 0.0 if self.low is None else curve.cdf(self.low), 1.0 if self.high is None else curve.cdf(self.high)

    @property
    def share(self) -> float:
        """So much of the whole distribution is left."""
        below, above = self._shares
        return above - below

    def value(self, u: float) -> VariedValue:
        curve = NormalDist(self.mean, self.deviation)
        below, above = self._shares
        share = below + u * (above - below)
        found = curve.inv_cdf(min(max(share, 1e-16), 1.0 - 1e-16))
        if self.low is not None:
            found = max(found, self.low)
        if self.high is not None:
            found = min(found, self.high)
        return rounded(found, is_time=self.is_time)

    @property
    def levels(self) -> tuple[VariedValue, ...]:
        return ()

    @property
    def is_grid(self) -> bool:
        return False


@dataclass(frozen=True, slots=True)
class Choice:
    """One of a few values, each as often as the others. ``is_grid``: each with each value of other grids, in every design."""

    values: tuple[VariedValue, ...]
    is_grid: bool = False

    def value(self, u: float) -> VariedValue:
        return self.values[min(int(u * len(self.values)), len(self.values) - 1)]

    @property
    def levels(self) -> tuple[VariedValue, ...]:
        return self.values


@dataclass(frozen=True, slots=True)
class Varied:
    """``name``: a path of the description (``is_path``), or a name that others refer to as ``{name}``."""

    name: str
    is_path: bool
    spread: Between | Normal | Choice


def rounded(value: float, *, is_time: bool) -> float:
    """To whole nanoseconds, or to as many digits as people read: a value that is written and read again is the same."""
    return round(value, TIME_DIGITS) if is_time else float(f"{value:.{SIGNIFICANT}g}")
