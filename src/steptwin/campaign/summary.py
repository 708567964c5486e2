"""Result of a campaign, in a few numbers."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass, field
from hashlib import blake2b
from math import sqrt
from typing import Any, NamedTuple

from steptwin.campaign.case import DIGEST_BYTES, Case, CaseResult

CONFIDENCE = 0.95
_Z = 1.959963984540054
"""Quantile of a normal distribution, two-sided, for `CONFIDENCE`."""
MOST_FAILURES = 1000
"""Failures that a summary lists; the database has all."""
LONGEST_WHY = 300
_digested = json.JSONEncoder(sort_keys=True, separators=(",", ":")).encode


class PassInterval(NamedTuple):
    low: float
    high: float


def wilson(passed: int, runs: int) -> PassInterval:
    """The interval in which the share of runs that pass lies (E. B. Wilson, 1927)."""
    if runs == 0:
        return PassInterval(0.0, 1.0)
    share, square = passed / runs, _Z * _Z / runs
    middle = (share + square / 2.0) / (1.0 + square)
    half = _Z * sqrt(share * (1.0 - share) / runs + square / runs / 4.0) / (1.0 + square)
    return PassInterval(max(middle - half, 0.0), min(middle + half, 1.0))


@dataclass(slots=True)
class PropertySummary:
    """Result of one property: how often it did not hold, and its least robustness with the first case that has it."""

    failed: int = 0
    robustness: float = float("inf")
    case: int | None = None


class FailedCase(NamedTuple):
    number: int
    why: str
    case: Case


@dataclass(slots=True, kw_only=True)
class CampaignSummary:
    """``digest``: over the results of all runs, in the order of their numbers; ``campaign``: of what they depend on."""

    name: str
    campaign: str
    seed: int
    times: tuple[str, ...] = ()
    """Names of the values that are times, in s."""
    runs: int = 0
    failed: int = 0
    errors: int = 0
    digest: str = ""
    properties: dict[str, PropertySummary] = field(default_factory=dict)
    failures: list[FailedCase] = field(default_factory=list)
    """The first ones."""

    @classmethod
    def of(
        cls, name: str, campaign: str, seed: int, results: Iterable[tuple[Case, CaseResult]], before: int | None = None
    ) -> CampaignSummary:
        """Summary of the results in the order of their numbers, ``before`` a number."""
        found = cls(name=name, campaign=campaign, seed=seed)
        whole = blake2b(digest_size=DIGEST_BYTES)
        for case, result in results:
            if before is not None and case.number >= before:
                break
            whole.update(_digested(result.to_json()).encode())
            found._add(case, result)
        found.digest = whole.hexdigest()
        return found

    def _add(self, case: Case, result: CaseResult) -> None:
        self.runs += 1
        self.errors += result.error is not None
        for verdict in result.verdicts:
            one = self.properties.setdefault(verdict.name, PropertySummary())
            one.failed += not verdict.holds
            if verdict.robustness < one.robustness:
                one.robustness, one.case = verdict.robustness, case.number
        if result.failed:
            self.failed += 1
            if len(self.failures) < MOST_FAILURES:
                self.failures.append(FailedCase(case.number, why(result), case))

    @property
    def passed(self) -> int:
        return self.runs - self.failed

    @property
    def pass_rate(self) -> float | None:
        return self.passed / self.runs if self.runs else None

    @property
    def interval(self) -> PassInterval:
        return wilson(self.passed, self.runs)

    def to_json(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "campaign": self.campaign,
            "name": self.name,
            "seed": self.seed,
            "times": list(self.times),
            "runs": self.runs,
            "failed": self.failed,
            "errors": self.errors,
            "pass_rate": self.pass_rate,
            "interval": list(self.interval),
            "confidence": CONFIDENCE,
            "digest": self.digest,
            "properties": {
                name: {"failed": one.failed, "robustness": _finite(one.robustness), "case": one.case}
                for name, one in self.properties.items()
            },
            "failures": [{"number": one.number, "why": one.why, "case": one.case.to_json()} for one in self.failures],
        }


def percent(share: float) -> str:
    """With two decimals, or as many as tell it from none and from all."""
    digits = next((n for n in range(2, 12) if 0.0 < round(share, n + 2) < 1.0), 2)
    return f"{share:.{digits}%}"


def why(result: CaseResult) -> str:
    """Why a run failed, in a line."""
    if result.error is not None:
        lines = result.error.strip().splitlines()
        text = lines[0] if lines else "an error"
    else:
        text = "; ".join(f"{one.name}: {one.why}" if one.why else one.name for one in result.verdicts if not one.holds)
    return text if len(text) <= LONGEST_WHY else f"{text[: LONGEST_WHY - 1]}…"


def _finite(number: float) -> float | None:
    return number if abs(number) < float("inf") else None
