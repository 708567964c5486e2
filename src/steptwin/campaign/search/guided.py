"""Falsification: cases are chosen where those before came nearer to a violation. They are chosen in one place, and
results are given back in order, so that a campaign has the same cases with any number of workers."""

from __future__ import annotations

from collections.abc import Sequence
from math import isnan
from typing import Any, Protocol

from steptwin.campaign.case import Case, CaseResult
from steptwin.campaign.cases import Cases
from steptwin.errors import Misuse
from steptwin.extras import missing

WAVE = 8
"""Cases that are chosen before the results of any of them are given back."""
FIRST = 16
"""Cases that are drawn at random before estimators choose any."""
SIGMA = 0.1
"""Deviation at the beginning, of the range of each value."""
STALE = 8
"""Waves without anything better, after which points are drawn at random again."""
CANDIDATES = 24
FARTHEST = 1e6
"""Robustness is cut off here."""
_BELOW_ONE = 1.0 - 2.0**-53


class PointChooser(Protocol):
    """Chooses points of a unit cube, whose distances from a violation it is given in the order in which it chose them."""

    def points(self, count: int) -> list[list[float]]:
        """At most `WAVE`; the distances of those before have been given."""
        ...

    def tell(self, distances: Sequence[float]) -> None:
        """Take the distances of the last points."""
        ...


class GuidedSearch:
    """Evolution of a normal distribution (CMA-ES), or Parzen estimators where fewer than two dimensions are continuous."""

    def __init__(self, cases: Cases) -> None:
        """Raises `Misuse` without the libraries, and where nothing varies."""
        if not cases.dimensions:
            raise Misuse("nothing varies in this campaign: a guided search needs [[vary]], or a fault with a chance")
        self._cases = cases
        size, seed = len(cases.dimensions), cases.description.seed & 0xFFFFFFFF
        continuous = sum(not one.spread.levels for one in cases.description.vary)
        self._chooser: PointChooser = _Evolution(size, seed) if continuous > 1 else _Estimators(size, seed)
        self._next = 0

    def ask(self, count: int = WAVE) -> list[Case]:
        """The next cases. The distances of those before have been given."""
        found = [self._cases.at(self._next + n, point) for n, point in enumerate(self._chooser.points(count))]
        self._next += count
        return found

    def tell(self, distances: Sequence[float]) -> None:
        """How far from a violation the cases were that were asked for, in their order."""
        self._chooser.tell(distances)


class _Evolution:
    """CMA-ES of cmaes, from the best of a wave of random points; again where it has found nothing better for a while."""

    def __init__(self, size: int, seed: int) -> None:
        try:
            import cmaes
            import numpy as np
        except ImportError:
            raise missing("a guided search", "campaign") from None
        self._cma: Any = cmaes.CMA
        self._size = size
        self._bounds: Any = np.array([(0.0, 1.0)] * size)
        self._random: Any = np.random.RandomState(seed)
        self._evolving: Any = None
        """None: points are drawn at random."""
        self._asked: list[Any] = []
        self._drawn: list[tuple[float, list[float]]] = []
        self._least = FARTHEST
        self._stale = 0

    def points(self, count: int) -> list[list[float]]:
        if self._evolving is None:
            self._asked = [self._random.random_sample(self._size) for _ in range(count)]
        else:
            self._asked = [self._evolving.ask() for _ in range(count)]
        return [[min(u, _BELOW_ONE) for u in point.tolist()] for point in self._asked]

    def tell(self, distances: Sequence[float]) -> None:
        results = list(zip(self._asked, distances, strict=True))
        self._asked = []
        if self._evolving is None:
            self._drawn += [(distance, point) for point, distance in results]
            if len(self._drawn) >= WAVE:
                self._begin()
            return
        if len(results) == WAVE:  # fewer are the last ones
            self._evolving.tell(results)
        least = min(distances)
        self._stale = 0 if least < self._least else self._stale + 1
        self._least = min(self._least, least)
        if self._stale >= STALE or self._evolving.should_stop():
            self._evolving = None

    def _begin(self) -> None:
        self._least, mean = min(self._drawn, key=lambda one: one[0])
        self._drawn, self._stale = [], 0
        self._evolving = self._cma(
            mean=mean,
            sigma=SIGMA,
            bounds=self._bounds,
            seed=int(self._random.randint(1 << 31)),
            population_size=WAVE,
        )


class _Estimators:
    """Tree-structured Parzen estimators of optuna (`TPESampler`), all dimensions together, in memory."""

    def __init__(self, size: int, seed: int) -> None:
        try:
            import optuna
        except ImportError:
            raise missing("a guided search", "campaign") from None
        optuna.logging.set_verbosity(optuna.logging.WARNING)
        sampler = optuna.samplers.TPESampler(
            n_startup_trials=FIRST,
            n_ei_candidates=CANDIDATES,
            multivariate=True,
            group=False,
            constant_liar=True,
            seed=seed,
        )
        self._study: Any = optuna.create_study(storage=None, sampler=sampler, direction="minimize")
        distribution = optuna.distributions.FloatDistribution(0.0, _BELOW_ONE)
        self._space = {str(n): distribution for n in range(size)}
        self._asked: list[Any] = []

    def points(self, count: int) -> list[list[float]]:
        self._asked = [self._study.ask(self._space) for _ in range(count)]
        return [[trial.params[name] for name in self._space] for trial in self._asked]

    def tell(self, distances: Sequence[float]) -> None:
        for trial, distance in zip(self._asked, distances, strict=True):
            self._study.tell(trial, distance)
        self._asked = []


def distance(result: CaseResult) -> float:
    """The least robustness of a result, within bounds; a run with an error is violated."""
    if result.error is not None:
        return -FARTHEST
    least = result.robustness
    return 0.0 if least is None or isnan(least) else max(-FARTHEST, min(FARTHEST, least))
