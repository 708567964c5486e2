"""Numbers of a report: what matters most, and histograms."""

from __future__ import annotations

from array import array
from bisect import bisect_right
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import isfinite
from statistics import fmean
from typing import Any, NamedTuple

from steptwin.campaign.case import Case, CaseResult
from steptwin.campaign.search.guided import distance
from steptwin.simulation.faults import read as read_fault

BINS = 24
MOST_MATTERING = 20


class Influence(NamedTuple):
    """Spearman's rank correlation of a value with ``of``: the least robustness, or whether the run passed where none differs."""

    name: str
    correlation: float
    p_value: float
    of: str


class Histogram(NamedTuple):
    name: str
    count: int
    least: float
    mean: float
    most: float
    edges: tuple[float, ...]
    counts: tuple[int, ...]
    unit: str = ""


@dataclass(slots=True)
class RunColumns:
    """The numbers of all runs, as columns: 8 bytes for each."""

    values: dict[str, array[float]] = field(default_factory=dict)
    measures: dict[str, array[float]] = field(default_factory=dict)
    numbers: array[int] = field(default_factory=lambda: array("q"))
    robustness: array[float] = field(default_factory=lambda: array("d"))
    passed: array[float] = field(default_factory=lambda: array("d"))

    @classmethod
    def of(cls, results: Iterable[tuple[Case, CaseResult]], faults: Sequence[str] = ()) -> RunColumns:
        """``faults``: the words of each ``[[fault]]``, in which what varies has a name."""
        found = cls()
        for case, result in results:
            for name, value in _numbers(case, faults).items():
                found.values.setdefault(name, array("d", [float("nan")] * len(found.passed))).append(value)
            for name, measure in result.measures.items():
                found.measures.setdefault(name, array("d")).append(measure)
            found.numbers.append(case.number)
            found.robustness.append(distance(result))
            found.passed.append(0.0 if result.failed else 1.0)
            for column in found.values.values():
                if len(column) < len(found.passed):
                    column.append(float("nan"))
        return found


def _numbers(case: Case, faults: Sequence[str]) -> Mapping[str, float]:
    """Varied values as numbers: values, and 1 for each fault that is there."""
    found = {name: float(value) for name, value in case.values.items() if not isinstance(value, str)}
    for fault in case.faults:
        words = faults[fault.table] if 0 <= fault.table < len(faults) else str(replace(read_fault(fault.fault), name=""))
        found[f"fault {words}"] = 1.0
    return found


def influences(columns: RunColumns) -> list[Influence]:
    """The greatest first. A fault that is missing in a run counts 0."""
    import numpy as np
    from scipy import stats

    target, of = np.asarray(columns.robustness), "robustness"
    if target.size < 3 or np.ptp(target) == 0.0:
        target, of = np.asarray(columns.passed), "passed"
    if target.size < 3 or np.ptp(target) == 0.0:
        return []
    found: list[Influence] = []
    for name, column in columns.values.items():
        given = np.nan_to_num(np.asarray(column)) if name.startswith("fault ") else np.asarray(column)
        known = np.isfinite(given)
        if known.sum() < 3 or np.ptp(given[known]) == 0.0 or np.ptp(target[known]) == 0.0:
            continue
        result: Any = stats.spearmanr(given[known], target[known])
        found.append(Influence(name, float(result.statistic), float(result.pvalue), of))
    return sorted(found, key=lambda one: -abs(one.correlation))[:MOST_MATTERING]


def histogram(name: str, numbers: Iterable[float], unit: str = "") -> Histogram | None:
    """None where there are no numbers."""
    given = [one for one in numbers if isfinite(one)]
    if not given:
        return None
    least, most, bins = min(given), max(given), min(BINS, len(given))
    low, high = (least, most) if least < most else (least - 0.5, most + 0.5)
    inner = [low + (high - low) * n / bins for n in range(1, bins)]
    counts = Counter(bisect_right(inner, one) for one in given)
    return Histogram(
        name,
        len(given),
        least,
        fmean(given),
        most,
        (low, *inner, high),
        tuple(counts[n] for n in range(bins)),
        unit,
    )
