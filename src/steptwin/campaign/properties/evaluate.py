"""How far a property is from being violated: quantitative semantics of signal temporal logic.

Values are from -1 to 1, and their sign is the truth: what is true by nothing has `TINY` instead of 0. A window that ends after
the run is not decided unless it is by then; under `always` it counts as true, under `eventually` as false.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import reduce
from math import ceil, floor
from operator import itemgetter

from steptwin.campaign.properties.slopes import (
    TINY,
    Shape,
    Slope,
    constant,
    from_on,
    greatest,
    held_until,
    later,
    least,
    negative,
    rises,
    steps,
    value_at,
    within,
)
from steptwin.campaign.properties.tree import (
    Atom,
    Becoming,
    Combination,
    CycleTime,
    Delayed,
    Holding,
    Lasting,
    PropertyFormula,
    Tally,
)
from steptwin.controller import Nanos
from steptwin.simulation.logic.expression import COMPARE


def forced(value: float, *, holds: bool) -> float:
    """Within -1 and 1, with the sign of the truth."""
    return min(max(value, TINY), 1.0) if holds else max(min(value, -TINY), -1.0)


class Evaluation:
    """Evaluation of all comparisons, over one time."""

    def __init__(self, atoms: Mapping[Atom, Shape]) -> None:
        self._atoms = atoms
        some = next(iter(atoms.values()))
        self.begin, self.end = some[0].begin, some[-1].end
        self._known: dict[tuple[int, bool], Shape] = {}

    def shape(self, node: PropertyFormula, *, undecided: bool = True) -> Shape:
        """``undecided``: what a window counts as that is not decided when the run ends."""
        key = id(node), undecided
        found = self._known.get(key)
        if found is None:
            found = self._known[key] = self._shape(node, undecided)
        return found

    def _shape(self, node: PropertyFormula, undecided: bool) -> Shape:
        match node:
            case Atom():
                return self._atoms[node]
            case Combination(word, inner):
                parts = [self.shape(one, undecided=undecided) for one in inner]
                return reduce(least if word == "and" else greatest, parts)
            case Lasting():
                return self._lasting(node, undecided)
            case Delayed(length, inner):
                return later(self.shape(inner, undecided=undecided), length, 1.0 if undecided else -1.0)
            case Holding(first, then, released):
                a, b = self.shape(first, undecided=not released), self.shape(then, undecided=released)
                return negative(held_until(negative(a), negative(b))) if released else held_until(a, b)
            case Becoming(inner, never):
                found = self._rise(self.shape(inner, undecided=False))
                return negative(found) if never else found
            case Tally(inner, sign, number):
                moments = rises(self.shape(inner, undecided=False))
                return steps(moments, self.begin, self.end, lambda count: _tallied(count, sign, number))
            case CycleTime():
                return constant(self.begin, self.end, self._cycles(node))
        raise AssertionError(node)

    def _lasting(self, node: Lasting, undecided: bool) -> Shape:
        length, is_once = node.length, node.word == "eventually"
        if length is None:
            shape = self.shape(node.inner, undecided=not is_once)
            return from_on(shape) if is_once else negative(from_on(negative(shape)))
        shape = self.shape(node.inner, undecided=undecided)
        if is_once:
            return self._open(within(shape, length), length, undecided)
        return negative(self._open(within(negative(shape), length), length, not undecided))

    def _open(self, shape: Shape, length: Nanos, undecided: bool) -> Shape:
        """Windows that end after the run: as they are where true, otherwise true if that is what undecided counts as."""
        last = self.end - length
        if not undecided or last >= self.end:
            return shape
        found: Shape = []
        for slope in shape:
            if slope.end <= last or slope.first > 0.0:
                found.append(slope)
                continue
            if slope.begin <= last:
                found.append(slope.cut(slope.begin, last))
            found.append(Slope(max(slope.begin, last + 1), slope.end, 1.0, 1.0))
        return found

    def _rise(self, shape: Shape) -> Shape:
        """1 at its moments; elsewhere as far as it is away, -1 where it has been."""
        found: Shape = []
        at = set(rises(shape))
        for slope in shape:
            if slope.first <= 0.0:
                found.append(slope)
                continue
            begin = slope.begin
            if begin in at:
                found.append(Slope(begin, begin, 1.0, 1.0))
                begin += 1
            if begin <= slope.end:
                found.append(Slope(begin, slope.end, -1.0, -1.0))
        return found

    # ------------------------------------------------------------------ cycles

    def cycles(self, node: CycleTime) -> tuple[list[tuple[Nanos, Nanos]], Nanos | None]:
        """Begin and end of each, and the begin of one that has not ended."""
        begins = rises(self.shape(node.begin, undecided=False))
        ends = rises(self.shape(node.end, undecided=False))
        found: list[tuple[Nanos, Nanos]] = []
        n = 0
        for begin in begins:
            while n < len(ends) and ends[n] <= begin:
                n += 1
            if n == len(ends):
                return found, begin
            found.append((begin, ends[n]))
        return found, None

    def _cycles(self, node: CycleTime) -> float:
        closed, begun = self.cycles(node)
        values = [_timed(end - begin, node.sign, node.limit) for begin, end in closed]
        if begun is not None:
            so_far = _timed(self.end - begun, node.sign, node.limit)
            if node.sign in ("<", "<=") and so_far < 0.0:
                values.append(so_far)
        return max(values, default=-1.0) if node.some else min(values, default=1.0)

    # ------------------------------------------------------------------ where it is decided

    def decided(self, node: PropertyFormula, moment: Nanos, *, undecided: bool = True) -> tuple[Nanos, PropertyFormula]:
        """The moment, and the part of a formula, by which its value at ``moment`` is decided.

        What is false stays false whatever comes after that moment.
        """
        match node:
            case Combination():
                return self._joined(node, moment, undecided)
            case Lasting():
                return self._lasted(node, moment, undecided)
            case Delayed(length, inner) if moment + length <= self.end:
                return self.decided(inner, moment + length, undecided=undecided)
            case Delayed():
                return self.end, node
            case Holding() if value_at(self.shape(node), moment) <= 0.0:
                return self._not_held(node, moment)
            case CycleTime(begin, end):
                return self._known_by(self._cycle_decided(node), begin, end), node
            case Tally() if value_at(self.shape(node), moment) <= 0.0:
                return self._miscounted(node, moment), node
            case Becoming(inner):
                return self._known_by(moment, inner), node
        return moment, node

    def _joined(self, node: Combination, moment: Nanos, undecided: bool) -> tuple[Nanos, PropertyFormula]:
        value = value_at(self.shape(node, undecided=undecided), moment)
        if node.word == "or" and value <= 0.0:  # once the last of them is false
            every = [self.decided(one, moment, undecided=undecided) for one in node.inner]
            return max(reversed(every), key=itemgetter(0))
        close = [one for one in node.inner if abs(value_at(self.shape(one, undecided=undecided), moment) - value) < TINY]
        return self.decided((close or list(node.inner))[-1], moment, undecided=undecided)

    def _lasted(self, node: Lasting, moment: Nanos, undecided: bool) -> tuple[Nanos, PropertyFormula]:
        value = value_at(self.shape(node, undecided=undecided), moment)
        word, length, inner = node.word, node.length, node.inner
        below = undecided if length is not None else word == "always"
        end = self.end if length is None else min(self.end, moment + length)
        shape = self.shape(inner, undecided=below)
        if word == "eventually":
            reached = _first(shape, moment, end, lambda one: one > 0.0) if value > 0.0 else None
            return (self._known_by(end, inner), node) if reached is None else self.decided(inner, reached, undecided=below)
        failed = _first(shape, moment, end, lambda one: one <= 0.0) if value <= 0.0 else None
        return self.decided(inner, _lowest(shape, moment, end) if failed is None else failed, undecided=below)

    def _miscounted(self, node: Tally, moment: Nanos) -> Nanos:
        """Time of the first surplus occurrence; too few occurrences are certain only at the end."""
        moments = [one for one in rises(self.shape(node.inner, undecided=False)) if one >= moment]
        most = {"<": ceil(node.number) - 1, "<=": floor(node.number), "==": floor(node.number)}.get(node.sign)
        if most is None or len(moments) <= most:
            return self.end
        return self._known_by(moments[most] if most >= 0 else moment, node.inner)

    def _not_held(self, node: Holding, moment: Nanos) -> tuple[Nanos, PropertyFormula]:
        """Where ``until`` failed: its first part did too early; or what it is the opposite of came true."""
        way = node.released
        failing, other = (node.then, node.first) if way else (node.first, node.then)
        failed = _first(self.shape(failing, undecided=True), moment, self.end, lambda one: one <= 0.0)
        if failed is None:
            return self.end, node
        at, by = self.decided(failing, failed)
        return max(at, self._known_by(failed, other)), by

    def _cycle_decided(self, node: CycleTime) -> Nanos:
        is_upper = node.sign in ("<", "<=")
        closed, begun = self.cycles(node)
        every = [(_timed(end - begin, node.sign, node.limit), begin, end) for begin, end in closed]
        if begun is not None and is_upper:
            every.append((_timed(self.end - begun, node.sign, node.limit), begun, self.end))
        if not every:
            return self.end
        worst, begin, end = min(every)
        if node.some and self._cycles(node) <= 0.0:  # none of them, which the end decides
            return self.end
        return min(end, begin + node.limit + (node.sign == "<=")) if is_upper and worst < 0.0 else end

    def _known_by(self, moment: Nanos, *parts: PropertyFormula) -> Nanos:
        """When it is known what parts are up to a moment."""
        ahead = [_ahead(part) for part in parts]
        return self.end if None in ahead else min(self.end, moment + max(one for one in ahead if one is not None))


def _ahead(node: PropertyFormula) -> Nanos | None:
    """How far after a moment its value there may be decided; None: at the end of the run."""
    parts = [_ahead(part) for part in node.parts()]
    known = [one for one in parts if one is not None]
    if len(known) < len(parts) or isinstance(node, Holding | Tally | CycleTime):
        return None
    most = max(known, default=0)
    if isinstance(node, Lasting | Delayed):
        return None if node.length is None else most + node.length
    return most


def _first(shape: Shape, begin: Nanos, end: Nanos, test: Callable[[float], bool]) -> Nanos | None:
    for slope in shape:
        if slope.end >= begin and slope.begin <= end and test(slope.first):
            return max(slope.begin, begin)
    return None


def _lowest(shape: Shape, begin: Nanos, end: Nanos) -> Nanos:
    best: tuple[float, Nanos] | None = None
    for slope in shape:
        if best is not None and slope.first >= best[0] <= slope.last:
            continue
        if slope.end >= begin and slope.begin <= end:
            for at in (max(slope.begin, begin), min(slope.end, end)):
                if best is None or slope.at(at) < best[0]:
                    best = slope.at(at), at
    return begin if best is None else best[1]


def _tallied(count: int, sign: str, number: float) -> float:
    holds = bool(COMPARE[sign](count, number))
    if sign in ("==", "!="):
        return (
            1.0 if holds and sign == "==" else forced(abs(count - number) * (1 if holds else -1) / max(number, 1.0), holds=holds)
        )
    away = number + (0.5 if sign == "<=" else -0.5 if sign in ("<", ">=") else 0.5) - count
    return forced((away if sign in ("<", "<=") else -away) / max(number, 1.0), holds=holds)


def _timed(length: Nanos, sign: str, limit: Nanos) -> float:
    holds = bool(COMPARE[sign](length, limit))
    if sign in ("==", "!="):
        return 1.0 if holds else -1.0
    return forced((limit - length if sign in ("<", "<=") else length - limit) / max(limit, 1), holds=holds)
