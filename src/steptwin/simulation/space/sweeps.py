"""Where bodies may come before their plans change: what cannot meet by then is not searched for contacts."""

from __future__ import annotations

from bisect import bisect_left, insort
from collections.abc import Callable, Iterator
from math import frexp, inf, isfinite, ldexp
from typing import NamedTuple, TypeAlias

from steptwin.controller import Nanos
from steptwin.motion.trig import cosine, length, sine
from steptwin.simulation.space.bodies import Body, Box
from steptwin.simulation.space.frames import AXES, Frame, Joint
from steptwin.simulation.space.pieces import Range, span

ROUNDING_NM = 1.0
"""More than the rounding errors of what moves; places that do not move are whole."""

Bounds: TypeAlias = tuple[float, float, float]
"""nm by x, y and z of the floor; infinite for a motion that does not end."""


class Sweep(NamedTuple):
    """All that a body may occupy."""

    low: Bounds
    high: Bounds

    @property
    def is_endless(self) -> bool:
        """Whether it has no end in one direction."""
        return -inf in self.low or inf in self.high


def sweep(body: Body, now: Nanos, *, since: Nanos | None = None, until: Nanos | None = None) -> Sweep:
    """Space that a body may occupy from a moment on, as everything below it moves now; or from ``since`` on, up to ``until``."""
    return swept(body, lambda frame, joint: span(joint.motion.pieces(now), since=since, until=until))


def swept(body: Body, ranges: Callable[[Frame, Joint], Range], seen_from: Frame | None = None) -> Sweep:
    """Space that a body may occupy while each joint below it is in a range, seen from a frame that it is on; without one from
    the floor."""
    shape = body.shape
    half = shape.half if isinstance(shape, Box) else (shape.radius, shape.radius, shape.half)
    low = [float(c - h) for c, h in zip(body.centre, half, strict=True)]
    high = [float(c + h) for c, h in zip(body.centre, half, strict=True)]
    for frame in body.frame.line():
        if frame is seen_from:
            break
        if frame.joint is not None:
            _carry(frame.joint, low, high, ranges(frame, frame.joint))
        for axis, shift in enumerate(frame.at):
            low[axis] += shift
            high[axis] += shift
    (a, b, c), (d, e, f) = low, high
    return Sweep((a, b, c), (d, e, f))


def versions_of(body: Body) -> tuple[Callable[[], object], ...]:
    """The versions of all that moves a body."""
    joints = (frame.joint for frame in body.frame.line())
    return tuple(joint.motion.version for joint in joints if joint is not None and not joint.motion.is_still)


class SweptBody:
    """A body with its sweep, which is computed once for each plan of its motion."""

    __slots__ = ("_soon", "_state", "_sweep", "body", "versions")

    def __init__(self, body: Body) -> None:
        self.body = body
        self.versions = versions_of(body)
        self.forget()

    def forget(self) -> None:
        """Compute it anew: a snapshot was restored, whose moment may be before that of the sweep."""
        self._state: list[object] | None = None
        self._sweep: Sweep | None = None
        self._soon: tuple[Nanos, Sweep] | None = None

    def sweep(self, now: Nanos) -> Sweep:
        """Where it may come before its plan changes."""
        state = [version() for version in self.versions]
        if self._sweep is None or state != self._state:
            self._state, self._sweep, self._soon = state, sweep(self.body, now), None
        return self._sweep

    def soon(self, now: Nanos, until: Nanos) -> Sweep:
        """Where it may come before its plan changes; where that has no end, up to a moment."""
        whole = self.sweep(now)
        if not whole.is_endless:
            return whole
        if self._soon is None or self._soon[0] != until:
            self._soon = until, sweep(self.body, now, until=until)
        return self._soon[1]


def _carry(joint: Joint, low: list[float], high: list[float], ends: Range) -> None:
    axis, sign = joint.along
    least, most = (sign * end for end in ends[::sign])
    if not joint.turns:
        low[axis] += least - ROUNDING_NM
        high[axis] += most + ROUNDING_NM
        return
    u, v = (axis + 1) % 3, (axis + 2) % 3
    if not all(map(isfinite, (low[u], low[v], high[u], high[v]))):  # without corners or a length
        low[u], high[u], low[v], high[v] = -inf, inf, -inf, inf
        return
    corners = [(x, y) for x in (low[u], high[u]) for y in (low[v], high[v])]
    if least == most:
        c, s = cosine(least), sine(least)
        corners = [(c * x - s * y, s * x + c * y) for x, y in corners]
    else:
        far = max(length(x, y) for x, y in corners)
        corners = [(-far, -far), (far, far)]
    low[u], high[u] = min(x for x, _ in corners) - ROUNDING_NM, max(x for x, _ in corners) + ROUNDING_NM
    low[v], high[v] = min(y for _, y in corners) - ROUNDING_NM, max(y for _, y in corners) + ROUNDING_NM


class Sweeps:
    """The sweeps of bodies by name, for those that meet another sweep.

    Along each axis those whose width has the same next power of two are in the order of their lower ends: those that may meet
    another one begin within that width before it, or in it.
    """

    __slots__ = ("_by_name", "_lows")

    def __init__(self) -> None:
        self._by_name: dict[str, Sweep] = {}
        self._lows: tuple[dict[float, list[tuple[float, str]]], ...] = ({}, {}, {})

    def put(self, name: str, its: Sweep) -> None:
        """In place of an earlier one of the same name."""
        if name in self._by_name:
            if self._by_name[name] == its:
                return
            self.discard(name)
        self._by_name[name] = its
        for axis, by_width in enumerate(self._lows):
            insort(by_width.setdefault(_width(its, axis), []), (its.low[axis], name))

    def discard(self, name: str) -> None:
        """Forget one, if there is one of this name."""
        its = self._by_name.pop(name, None)
        if its is None:
            return
        for axis, by_width in enumerate(self._lows):
            ordered = by_width[width := _width(its, axis)]
            del ordered[bisect_left(ordered, (its.low[axis], name))]
            if not ordered:
                del by_width[width]

    @property
    def endless(self) -> int:
        """Count of those without an end along an axis, of that which has most."""
        return max(len(by_width.get(inf, ())) for by_width in self._lows)

    def near(self, its: Sweep) -> list[str]:
        """Those whose sweep has a part in common with this one, in no order."""
        _, axis = min((sum(last - first for _, first, last in self._along(its, axis)), axis) for axis in range(len(AXES)))
        there = (name for ordered, first, last in self._along(its, axis) for _, name in ordered[first:last])
        return [name for name in there if meet(its, self._by_name[name])]

    def _along(self, its: Sweep, axis: int) -> Iterator[tuple[list[tuple[float, str]], int, int]]:
        """Those that may meet it as far as one axis tells: in each list from the first to the last, which is not one of them."""
        low, high = its.low[axis], its.high[axis]
        for width, ordered in self._lows[axis].items():
            yield ordered, bisect_left(ordered, (low - width, "")), bisect_left(ordered, (high, ""))


def _width(its: Sweep, axis: int) -> float:
    """The next power of two, which is not below it; or infinite."""
    width = its.high[axis] - its.low[axis]
    return width if width == inf else ldexp(1.0, frexp(width)[1])


def meet(one: Sweep, other: Sweep) -> bool:
    """Whether they have a part in common."""
    ends = zip(one.low, one.high, other.low, other.high, strict=True)
    return all(low < its_high and its_low < high for low, high, its_low, its_high in ends)
