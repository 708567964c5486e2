"""Falsification: cases are chosen where those before came nearer to a violation. They are chosen in one place, and
results are given back in order, so that a campaign has the same cases with any number of workers."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count
from math import inf, isnan
from typing import Any, Protocol, TypeAlias

from steptwin.campaign.case import Case, CaseResult
from steptwin.campaign.cases import Cases
from steptwin.errors import Misuse
from steptwin.extras import missing

WAVE = 8
"""Cases that are chosen at most before the results of any of them are given back."""
DRAWN = 4
"""Cases of a wave that is drawn at random, or lies along the slope."""
REACH = 3.0
"""The least distance, in multiples of the range of the distances so far, from which on these show no way to a violation."""
SIGMA = 0.08
"""Deviation at the beginning of evolution, of the range of each value."""
TRIED = 6
"""Waves in which evolution or estimators have to come nearer,"""
PATIENCE = 8.0
"""so fast that this many times as many would come to a violation. Otherwise points are drawn at random again."""
CANDIDATES = 24
FARTHEST = 1e6
"""Robustness is cut off here."""
_BELOW_ONE = 1.0 - 2.0**-53

Point: TypeAlias = list[float]
Told: TypeAlias = list[tuple[float, Point]]
"""Distances from a violation, with their points of the unit cube."""


class PointChooser(Protocol):
    """Chooses points of a unit cube, whose distances from a violation it is given in the order in which it chose them."""

    def points(self, count: int) -> list[Point]:
        """At most ``count``, which is at most `WAVE`; the distances of those before have been given."""
        ...

    def tell(self, distances: Sequence[float]) -> None:
        """Take the distances of the last points."""
        ...

    @property
    def is_over(self) -> bool:
        """Whether it has nothing more to choose."""
        ...


class GuidedSearch:
    """Random points, those of a random search, until their distances show a way. Then points along their slope; then evolution
    of a normal distribution (CMA-ES), or Parzen estimators where fewer than two dimensions are continuous, as long as these come
    nearer; then random points again."""

    def __init__(self, cases: Cases) -> None:
        """Raises `Misuse` without the libraries, and where nothing varies."""
        if not cases.dimensions:
            raise Misuse("nothing varies in this campaign: a guided search needs [[vary]], or a fault with a chance")
        self._cases = cases
        self._is_continuous = sum(not one.spread.levels for one in cases.description.vary) > 1
        _check_libraries()
        self._next = 0
        self._drawn = count()
        """Numbers of random points."""
        self._restarts = 0
        self._told: Told = []
        """Since random points were drawn first, or again."""
        self._asked: list[Point] = []
        self._chooser: PointChooser | None = None
        """None: points are drawn at random."""

    def ask(self, most: int = WAVE) -> list[Case]:
        """The next cases, at most so many. The distances of those before have been given."""
        if self._chooser is None:
            self._asked = [self._cases.unit(next(self._drawn)) for _ in range(min(most, DRAWN))]
        else:
            self._asked = self._chooser.points(most)
        found = [self._cases.at(self._next + n, point) for n, point in enumerate(self._asked)]
        self._next += len(found)
        return found

    def tell(self, distances: Sequence[float]) -> None:
        """How far from a violation the cases were that were asked for, in their order."""
        self._told += zip(distances, self._asked, strict=True)
        if self._chooser is None:
            if shows_way(min(self._told)[0], max(self._told)[0]):
                self._chooser = _Slope(self._told)
            return
        self._chooser.tell(distances)
        if not self._chooser.is_over:
            return
        if isinstance(self._chooser, _Slope):
            seed = (self._cases.description.seed + self._restarts) & 0xFFFFFFFF
            self._chooser = (_Evolution if self._is_continuous else _Estimators)(self._told, seed)
        else:
            self._chooser, self._told = None, []
            self._restarts += 1


def shows_way(least: float, most: float) -> bool:
    """Whether distances differ by so much that to go on like that would come to a violation. Equal ones show no way."""
    return least < REACH * (most - least)


class _Slope:
    """Points from the nearest one in the direction in which distances become less, up to the edge."""

    def __init__(self, told: Told) -> None:
        self._told = told
        self.is_over = False

    def points(self, count: int) -> list[Point]:
        size = len(self._told)
        near = min(self._told)[1]
        mean = sum(distance for distance, _ in self._told) / size
        means = [sum(one) / size for one in zip(*(point for _, point in self._told), strict=True)]
        slope = [sum((distance - mean) * (point[n] - at) for distance, point in self._told) for n, at in enumerate(means)]
        steepest = max(map(abs, slope)) or 1.0
        found: list[Point] = []
        for part in range(1, min(count, DRAWN) + 1):
            step = part / DRAWN / steepest
            found.append([min(max(u - step * one, 0.0), _BELOW_ONE) for u, one in zip(near, slope, strict=True)])
        return found

    def tell(self, distances: Sequence[float]) -> None:
        self.is_over = True


class _Progress:
    """Whether the least distance becomes less fast enough."""

    def __init__(self, least: float) -> None:
        self._least = [least]

    def add(self, distances: Sequence[float]) -> bool:
        """Whether to go on after another wave."""
        self._least.append(min(*distances, self._least[-1]))
        gain = self._least[-1 - TRIED] - self._least[-1] if len(self._least) > TRIED else inf
        return self._least[-1] < PATIENCE * gain


def _check_libraries() -> None:
    from importlib.util import find_spec

    if find_spec("cmaes") is None or find_spec("optuna") is None:
        raise missing("a guided search", "campaign")


class _Evolution:
    """CMA-ES of cmaes, from the nearest point so far."""

    def __init__(self, told: Told, seed: int) -> None:
        import cmaes
        import numpy as np

        least, mean = min(told)
        self._progress = _Progress(least)
        self._evolving: Any = cmaes.CMA(
            mean=np.array(mean), sigma=SIGMA, bounds=np.array([(0.0, 1.0)] * len(mean)), seed=seed, population_size=WAVE
        )
        self._asked: list[Any] = []
        self.is_over = False

    def points(self, count: int) -> list[Point]:
        self._asked = [self._evolving.ask() for _ in range(count)]
        return [[min(u, _BELOW_ONE) for u in point.tolist()] for point in self._asked]

    def tell(self, distances: Sequence[float]) -> None:
        if len(distances) == WAVE:  # fewer are the last ones
            self._evolving.tell(list(zip(self._asked, distances, strict=True)))
        self.is_over = not self._progress.add(distances) or self._evolving.should_stop()


class _Estimators:
    """Tree-structured Parzen estimators of optuna (`TPESampler`), all dimensions together, in memory."""

    def __init__(self, told: Told, seed: int) -> None:
        import optuna

        optuna.logging.set_verbosity(optuna.logging.WARNING)
        sampler = optuna.samplers.TPESampler(
            n_startup_trials=0,
            n_ei_candidates=CANDIDATES,
            multivariate=True,
            group=False,
            constant_liar=True,
            seed=seed,
        )
        self._study: Any = optuna.create_study(storage=None, sampler=sampler, direction="minimize")
        distribution = optuna.distributions.FloatDistribution(0.0, _BELOW_ONE)
        self._space: dict[str, Any] = {str(n): distribution for n in range(len(told[0][1]))}
        for distance, point in told:
            params = dict(zip(self._space, point, strict=True))
            self._study.add_trial(optuna.create_trial(params=params, distributions=self._space, value=distance))
        self._progress = _Progress(min(told)[0])
        self._asked: list[Any] = []
        self.is_over = False

    def points(self, count: int) -> list[Point]:
        self._asked = [self._study.ask(self._space) for _ in range(count)]
        return [[trial.params[name] for name in self._space] for trial in self._asked]

    def tell(self, distances: Sequence[float]) -> None:
        for trial, distance in zip(self._asked, distances, strict=True):
            self._study.tell(trial, distance)
        self._asked = []
        self.is_over = not self._progress.add(distances)


def distance(result: CaseResult) -> float:
    """The least robustness of a result, within bounds; a run with an error is violated."""
    if result.error is not None:
        return -FARTHEST
    least = result.robustness
    return 0.0 if least is None or isnan(least) else max(-FARTHEST, min(FARTHEST, least))
