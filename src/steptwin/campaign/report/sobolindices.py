"""Sobol indices of the design *saltelli*: which share of the variance of the runs comes from each value.

The estimators are those of A. Saltelli et al. (2010, first order) and M. J. W. Jansen (1999, total order), as in
``scipy.stats.sobol_indices``; the intervals are percentiles of a bootstrap over blocks of runs.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from steptwin.campaign.designs import saltelli_block
from steptwin.campaign.summary import CONFIDENCE

LEAST_BLOCKS = 16
"""With fewer there are no indices."""
RESAMPLES = 1000
_TAILS = (50.0 * (1.0 - CONFIDENCE), 50.0 * (1.0 + CONFIDENCE))


class SobolIndex(NamedTuple):
    """``first``: the share of the variance that goes away, on average, once the value is known. ``total``: the share that is left
    once all others are known, so that it includes what the value does together with others. Each with its 95 % interval. ``of``:
    what varies: the least robustness, or whether a run passes."""

    name: str
    first: float
    first_low: float
    first_high: float
    total: float
    total_low: float
    total_high: float
    of: str


def sobol_indices(
    names: Sequence[str], numbers: Sequence[int], robustness: Sequence[float], passed: Sequence[float]
) -> list[SobolIndex]:
    """The greatest total first; empty where too few runs are there, or all came out the same. ``numbers`` of the runs rise."""
    import numpy as np

    size = saltelli_block(len(names))
    there = next((n for n, number in enumerate(numbers) if n != number), len(numbers))  # what is missing ends the blocks
    blocks = there // size
    if not names or blocks < LEAST_BLOCKS:
        return []
    several = {"robustness": robustness, "passed": passed}
    outcomes: dict[str, Any] = {
        of: np.clip(np.asarray(column[: blocks * size], dtype=float), -1.0, 1.0).reshape(blocks, size).T
        for of, column in several.items()
    }
    of = next((of for of, outcome in outcomes.items() if np.ptp(outcome[:2]) > 0.0), None)
    if of is None:
        return []
    outcome = outcomes[of]
    first, total = _shares(outcome)
    drawn = np.random.default_rng(0).integers(blocks, size=(RESAMPLES, blocks))
    resampled: Any = np.array([_shares(outcome[:, one]) for one in drawn])
    low, high = np.nanpercentile(resampled, _TAILS, axis=0)
    columns = (column.tolist() for column in (first, low[0], high[0], total, low[1], high[1]))
    found = [SobolIndex._make((*row, of)) for row in zip(names, *columns, strict=True)]
    return sorted(found, key=lambda one: -one.total)


def _shares(outcome: Any) -> tuple[Any, Any]:
    """First and total order of each dimension; nan where the outcome does not vary."""
    import numpy as np

    outcome = outcome - outcome[:2].mean()
    one, other, between = outcome[0], outcome[1], outcome[2:]
    variance = outcome[:2].var() or np.nan
    first = (other * (between - one)).mean(axis=1) / variance
    total = ((one - between) ** 2).mean(axis=1) / (2.0 * variance)
    return first, total
