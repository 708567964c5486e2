"""Functions of time on whole nanoseconds, made of straight intervals: least and greatest, over windows, from a moment on."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise
from typing import NamedTuple, TypeAlias

from steptwin.controller import Nanos

TINY = 1e-12
"""The least distance of what is true or false by nothing: a value's sign is always the truth."""
BOTTOM = -2.0
"""Less than any value."""


class Slope(NamedTuple):
    """From ``begin`` to ``end``, both included, straight from ``first`` to ``last``."""

    begin: Nanos
    end: Nanos
    first: float
    last: float

    def at(self, moment: Nanos) -> float:
        if moment == self.begin or self.first == self.last:
            return self.first
        if moment == self.end:
            return self.last
        share = (moment - self.begin) / (self.end - self.begin)
        return self.first * (1.0 - share) + self.last * share

    def cut(self, begin: Nanos, end: Nanos) -> Slope:
        return self if (begin, end) == self[:2] else Slope(begin, end, self.at(begin), self.at(end))


Shape: TypeAlias = "list[Slope]"
"""Without gaps, in order."""


def value_at(shape: Shape, moment: Nanos) -> float:
    low, high = 0, len(shape) - 1
    while low < high:
        middle = (low + high) // 2
        low, high = (middle + 1, high) if shape[middle].end < moment else (low, middle)
    return shape[low].at(moment)


def constant(begin: Nanos, end: Nanos, value: float) -> Shape:
    return [Slope(begin, end, value, value)]


def negative(shape: Shape) -> Shape:
    return [Slope(begin, end, -first, -last) for begin, end, first, last in shape]


def shortest(shape: Iterable[Slope]) -> Shape:
    """With neighbours of one constant value as one."""
    found: Shape = []
    flat: float | None = None  # the value of the last one, if it is constant
    for slope in shape:
        _, end, first, last = slope
        if flat is None or not flat == first == last:
            found.append(slope)
            flat = first if first == last else None
        else:
            found[-1] = Slope(found[-1].begin, end, flat, flat)
    return found


def together(one: Shape, other: Shape) -> Iterator[tuple[Slope, Slope]]:
    """Both in the same intervals, in each of which the same one is not below the other, but for rounding where they meet."""
    i = j = 0
    while i < len(one) and j < len(other):
        a, b = one[i], other[j]
        begin, end = max(a.begin, b.begin), min(a.end, b.end)
        i += a.end == end
        j += b.end == end
        a, b = a.cut(begin, end), b.cut(begin, end)
        left, right = a.first - b.first, a.last - b.last
        if left * right < 0.0 and end > begin:
            middle = min(begin + int((end - begin) * (left / (left - right))), end - 1)
            yield a.cut(begin, middle), b.cut(begin, middle)
            a, b = a.cut(middle + 1, end), b.cut(middle + 1, end)
        yield a, b


def least(one: Shape, other: Shape) -> Shape:
    return shortest(a if a.first + a.last <= b.first + b.last else b for a, b in together(one, other))


def greatest(one: Shape, other: Shape) -> Shape:
    return shortest(a if a.first + a.last >= b.first + b.last else b for a, b in together(one, other))


def from_on(shape: Shape) -> Shape:
    """At each moment the greatest value from then on."""
    found: Shape = []
    most = BOTTOM
    for slope in reversed(shape):
        begin, end, first, last = slope
        most = max(most, last)
        if first <= most:
            found.append(Slope(begin, end, most, most))
        else:
            found += reversed(greatest([slope], constant(begin, end, most)))
            most = first
    return shortest(reversed(found))


def within(shape: Shape, length: Nanos) -> Shape:
    """At each moment the greatest value in the ``length`` ns after it, both ends included, as far as the shape goes; what is
    true by no more than the share of the window that is left when it becomes true."""
    begin, end = shape[0].begin, shape[-1].end
    is_all = length >= end - begin
    values = from_on(shape) if is_all else _highest([_reached(slope, length, begin, end) for slope in shape])
    if length == 0 or not any(slope.first > 0.0 for slope in shape):
        return values
    return least(values, _left(shape, length))


def _reached(slope: Slope, length: Nanos, begin: Nanos, end: Nanos) -> Shape:
    """Contribution of one interval to each moment."""
    if slope.last >= slope.first:
        parts = [Slope(slope.begin - length, slope.end - length, slope.first, slope.last)]
        parts.append(Slope(slope.end - length + 1, slope.end, slope.last, slope.last))
    else:
        parts = [Slope(slope.begin - length, slope.begin, slope.first, slope.first)]
        parts.append(Slope(slope.begin + 1, slope.end, slope.at(min(slope.begin + 1, slope.end)), slope.last))
    return _filled(parts, begin, end, BOTTOM)


def _left(shape: Shape, length: Nanos) -> Shape:
    """The share of the window from each moment on that is left when the next interval that is true comes."""
    begin = shape[0].begin
    found: Shape = []
    for slope in shape:
        if slope.first <= 0.0:
            continue
        ramp = Slope(slope.begin - length, slope.begin, TINY, 1.0)
        first = max(begin, ramp.begin)
        if first > begin:
            found += constant(begin, first - 1, TINY)
        if first <= slope.begin:
            found.append(ramp.cut(first, slope.begin))
        if slope.end > slope.begin:
            found += constant(slope.begin + 1, slope.end, 1.0)
        begin = slope.end + 1
    return found if begin > shape[-1].end else [*found, *constant(begin, shape[-1].end, TINY)]


def _filled(parts: Iterable[Slope], begin: Nanos, end: Nanos, value: float) -> Shape:
    """Parts as far as they are between ``begin`` and ``end``, with ``value`` elsewhere."""
    kept = [one.cut(max(one.begin, begin), min(one.end, end)) for one in parts if one.end >= begin]
    kept = [one for one in kept if one.begin <= one.end]
    found: Shape = []
    at = begin
    for one in kept:
        if one.begin > at:
            found += constant(at, one.begin - 1, value)
        found.append(one)
        at = one.end + 1
    if at <= end:
        found += constant(at, end, value)
    return found


def _highest(shapes: list[Shape]) -> Shape:
    while len(shapes) > 1:
        pairs = [greatest(*shapes[n : n + 2]) if n + 1 < len(shapes) else shapes[n] for n in range(0, len(shapes), 2)]
        shapes = pairs
    return shapes[0]


def later(shape: Shape, length: Nanos, open_value: float) -> Shape:
    """At each moment the value ``length`` ns after it, by no more than the share of this time for which it has been true, or
    false, by then; ``open_value`` where that is after the end."""
    begin, end = shape[0].begin, shape[-1].end
    found: Shape = []
    since, before = begin, shape[0].first > 0.0
    for slope in shape:
        is_true = slope.first > 0.0
        if is_true is not before:
            since, before = slope.begin, is_true
        ramp = Slope(since, since + length, TINY, 1.0)
        most = _filled([ramp] if length else [], slope.begin, slope.end, 1.0)
        found += least([slope], most) if is_true else negative(least(negative([slope]), most))
    shifted = [Slope(one.begin - length, one.end - length, one.first, one.last) for one in found]
    return _filled(shifted, begin, end, open_value)


def held_until(first: Shape, then: Shape) -> Shape:
    """At each moment the greatest, over a moment from then on, of the lesser of ``then`` at it and of ``first`` before it."""
    found: Shape = []
    after = BOTTOM
    for a, b in reversed(list(together(first, then))):
        begin, end = a[:2]
        rest = constant(begin, end, after)
        if a.last >= a.first:
            ahead = constant(begin, end, b.last) if b.last >= b.first else [b]
            best = greatest(least([a], greatest(ahead, rest)), [b])
        else:
            least_left = constant(begin, end, min(a.last, after))
            comes = (
                constant(begin, end, min(b.last, a.at(max(end - 1, begin)))) if b.last > b.first and a.first >= b.first else [b]
            )
            best = greatest(greatest(comes, [b]), least_left)
        found += reversed(best)
        after = best[0].first
    return shortest(reversed(found))


def rises(shape: Shape) -> list[Nanos]:
    """The moments at which it becomes positive, its beginning included."""
    begin = [shape[0].begin] if shape[0].first > 0.0 else []
    return begin + [here.begin for before, here in pairwise(shape) if before.last <= 0.0 < here.first]


def steps(moments: list[Nanos], begin: Nanos, end: Nanos, value: Callable[[int], float]) -> Shape:
    """``value`` of the number of ``moments`` that are not before each moment."""
    found: Shape = []
    at = begin
    for n, moment in enumerate(moments):
        if moment >= at:
            level = value(len(moments) - n)
            found.append(Slope(at, moment, level, level))
            at = moment + 1
    if at <= end:
        found += constant(at, end, value(0))
    return found
