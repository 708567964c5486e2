"""The integral of a rate that changes in a straight line: a parabola of time, exact in fractions.

From a moment on with the value v, the rate r and its slope s it is v + r·t + s·t²/2. The rate has no other line before ``end``; a
value that comes to a limit ends its line there, too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from math import ceil, floor
from typing import NamedTuple

from steptwin.controller import Nanos
from steptwin.points import FARTHEST_NS


class Straight(NamedTuple):
    """A value that goes on in a straight line."""

    value: Fraction
    slope: Fraction = Fraction(0)
    """Per ns."""
    until: Nanos | None = None
    """The moment, ns, from which it is on another line; None: never without an event."""


class Limits(NamedTuple):
    """The lowest and the highest value; None: there is none."""

    low: Fraction | None = None
    high: Fraction | None = None

    def clip(self, value: Fraction) -> Fraction:
        if self.low is not None and value < self.low:
            return self.low
        return self.high if self.high is not None and value > self.high else value

    def stops(self, value: Fraction, rate: Fraction, slope: Fraction) -> bool:
        """Whether a value at a limit would leave it."""
        heads = rate or slope
        return (heads > 0 and value == self.high) or (heads < 0 and value == self.low)


class Integral(NamedTuple):
    """A value that follows its rate from ``begin`` on, up to ``end``, and stays there. Rates per ns."""

    begin: Nanos
    value: Fraction
    rate: Fraction
    slope: Fraction
    end: Nanos | None
    limits: Limits

    @staticmethod
    def of(rate: Straight, value: Fraction, limits: Limits, now: Nanos) -> Integral:
        """The one that begins with a value within the limits."""
        r, s, until = rate
        if r == s == 0:
            return Integral(now, value, r, s, until, limits)
        if limits.stops(value, r, s):
            # It leaves the limit when its rate has turned back.
            turn = now + ceil(-r / s) if r * s < 0 else None
            end = turn if until is None else until if turn is None else min(turn, until)
            return Integral(now, value, Fraction(0), Fraction(0), end, limits)
        found = Integral(now, value, r, s, until, limits)
        low, high = limits
        leaves = found.first(now, lambda one: (low is not None and one <= low) or (high is not None and one >= high), exact=True)
        return found if leaves is None else found._replace(end=leaves)

    def _line(self, now: Nanos) -> Fraction:
        t = now - self.begin
        return self.value + (self.rate + self.slope * t / 2) * t

    def at(self, now: Nanos) -> Fraction:
        return self.limits.clip(self._line(now if self.end is None else min(now, self.end)))

    def rate_at(self, now: Nanos) -> Fraction:
        return self.rate + self.slope * (now - self.begin)

    def goes_on_as(self, other: Integral) -> bool:
        """Whether another one, which begins with its value, is its own continuation."""
        now = other.begin
        same = self.end == other.end and self.slope == other.slope and self.rate_at(now) == other.rate
        return same and self.at(now) == other.value

    def turning_points(self, now: Nanos) -> Iterator[Nanos]:
        """Moments after one between which it goes one way: around that at which the rate is 0, and its end."""
        if self.rate * self.slope < 0:
            turn = self.begin + floor(-self.rate / self.slope)
            yield from (at for at in (turn, turn + 1) if at > now and (self.end is None or at < self.end))
        if self.end is not None and self.end > now:
            yield self.end

    def first(self, after: Nanos, test: Callable[[Fraction], bool], *, exact: bool = False) -> Nanos | None:
        """First moment after one at which a test of the value is true, which is true on one side of a value and false right after
        that moment; None: not before the end. ``exact``: without the limits."""
        at = self._line if exact else self.at
        begin = after
        for end in (*self.turning_points(after), *((after + FARTHEST_NS,) if self.end is None else ())):
            if test(at(end)):
                low, high = begin, end
                while high - low > 1:
                    middle = (low + high) // 2
                    low, high = (low, middle) if test(at(middle)) else (middle, high)
                return high
            begin = end
        return None
