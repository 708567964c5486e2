"""Falsification: cases are chosen where those before came nearer to a violation. Asked in one place and told in order, so that a
campaign has the same cases with any number of workers."""

from __future__ import annotations

from collections.abc import Sequence
from math import isnan
from typing import Any

from steptwin.campaign.case import Case, CaseResult
from steptwin.campaign.cases import Cases
from steptwin.errors import Misuse
from steptwin.extras import libraries_of, missing

WAVE = 8
"""Cases that are asked for before the results of any of them are told."""
FIRST = 16
"""Cases that are drawn at random before any are chosen."""
CANDIDATES = 24
FARTHEST = 1e6
"""Robustness is cut off here."""
_BELOW_ONE = 1.0 - 2.0**-53


class GuidedSearch:
    """Tree-structured Parzen estimators of optuna (`TPESampler`), all dimensions together, in memory."""

    def __init__(self, cases: Cases) -> None:
        """Raises `Misuse` without optuna, and where nothing varies."""
        if not cases.dimensions:
            raise Misuse("nothing varies in this campaign: a guided search needs [[vary]], or a fault with a chance")
        try:
            import optuna
        except ImportError:
            raise missing("a guided search", libraries_of("campaign")) from None
        optuna.logging.set_verbosity(optuna.logging.WARNING)
        self._cases = cases
        sampler = optuna.samplers.TPESampler(
            n_startup_trials=FIRST,
            n_ei_candidates=CANDIDATES,
            multivariate=True,
            group=False,
            constant_liar=True,
            seed=cases.description.seed & 0xFFFFFFFF,
        )
        self._study: Any = optuna.create_study(storage=None, sampler=sampler, direction="minimize")
        distribution = optuna.distributions.FloatDistribution(0.0, _BELOW_ONE)
        self._space = {f"{n} {one.name}": distribution for n, one in enumerate(cases.dimensions)}
        self._asked: list[Any] = []
        self._next = 0

    def ask(self, count: int = WAVE) -> list[Case]:
        """The next cases. Those before have been told."""
        assert not self._asked  # noqa: S101
        self._asked = [self._study.ask(self._space) for _ in range(count)]
        points = [[trial.params[name] for name in self._space] for trial in self._asked]
        found = [self._cases.at(self._next + n, point) for n, point in enumerate(points)]
        self._next += count
        return found

    def tell(self, distances: Sequence[float]) -> None:
        """How far from a violation the cases were that were asked for, in their order."""
        for trial, distance in zip(self._asked, distances, strict=True):
            self._study.tell(trial, distance)
        self._asked = []


def distance(result: CaseResult) -> float:
    """The least robustness of a result, within bounds; a run with an error is violated."""
    if result.error is not None:
        return -FARTHEST
    least = result.robustness
    return 0.0 if least is None or isnan(least) else max(-FARTHEST, min(FARTHEST, least))
