"""How cases are spread: points of a unit cube by number."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

from steptwin.campaign.description import SALTELLI
from steptwin.errors import Misuse
from steptwin.extras import missing
from steptwin.simulation.scheduler.chance import Chance

Design: TypeAlias = Callable[[int], Sequence[float]]
"""The point of a number: for each dimension a number from 0 to below 1."""

_WHOLE = 1 << 53
_BLOCK = 1024
"""So many points of a Sobol sequence are made at once: a power of 2, as its balance needs."""
MOST_DIMENSIONS = 1000
MOST_POINTS = 10_000_000
"""Numbers of a Latin hypercube, which is made at once."""


def design_of(name: str, seed: int, dimensions: Sequence[str], count: int | None) -> Design:
    """``dimensions`` are the names of what is drawn. Raises `Misuse` without the libraries, or where there is no such design."""
    if not dimensions or name in {"random", "grid"}:
        return lambda number: [_drawn(seed, number, one) for one in dimensions]
    if name == "sobol":
        return _Sobol(seed, len(dimensions)).point
    if name == SALTELLI:
        return _saltelli(_Sobol(seed, 2 * len(dimensions)).point, len(dimensions))
    if count is None:
        raise Misuse("a Latin hypercube needs the number of its points: give runs")
    if count * len(dimensions) > MOST_POINTS:
        raise Misuse(
            f"a Latin hypercube of {count} runs and {len(dimensions)} values: permitted are {MOST_POINTS} numbers; use sobol"
        )
    hypercube = _qmc().LatinHypercube(len(dimensions), rng=seed)
    points = hypercube.random(count)
    return lambda number: points[number].tolist()


def saltelli_block(dimensions: int) -> int:
    """So many points belong together: one, another, and for each dimension the one with its number of the other."""
    return dimensions + 2


def _saltelli(pairs: Design, dimensions: int) -> Design:
    """Points from which Sobol indices follow (A. Saltelli et al., 2010): ``pairs`` are two points each."""

    def point(number: int) -> Sequence[float]:
        block, place = divmod(number, saltelli_block(dimensions))
        both = pairs(block)
        one, other = both[:dimensions], both[dimensions:]
        if place < 2:
            return (one, other)[place]
        return [*one[: place - 2], other[place - 2], *one[place - 1 :]]

    return point


def _drawn(seed: int, number: int, name: str) -> float:
    return (Chance(seed, f"{number}/{name}").draw() >> 11) / _WHOLE


def _qmc() -> Any:
    try:
        from scipy.stats import qmc
    except ImportError:
        raise missing("this design", "campaign") from None
    return qmc


class _Sobol:
    """A scrambled Sobol sequence, made in blocks."""

    def __init__(self, seed: int, dimensions: int) -> None:
        if dimensions > MOST_DIMENSIONS:
            raise Misuse(f"{dimensions} values vary: a Sobol sequence has at most {MOST_DIMENSIONS}")
        self._make = lambda: _qmc().Sobol(dimensions, rng=seed)
        self._block: tuple[int, Any] = (-1, None)

    def point(self, number: int) -> Sequence[float]:
        block, place = divmod(number, _BLOCK)
        if block != self._block[0]:
            sequence = self._make()
            if block:
                sequence.fast_forward(block * _BLOCK)
            self._block = block, sequence.random(_BLOCK)
        return self._block[1][place].tolist()
