"""Result of the checks, as a value, a text and JSON."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from steptwin.jsonvalues import to_json
from steptwin.verify.check import CheckOutcome, CheckResult

FORMAT = "steptwin verification 1"


@dataclass(frozen=True, slots=True)
class Report:
    """``device``: what it is and where. ``time``: ISO 8601. ``version``: of steptwin. ``permitted``: read, write or move."""

    device: Mapping[str, object]
    version: str
    time: str
    permitted: str
    results: Sequence[CheckResult]
    is_complete: bool = True
    """Whether it was not cancelled."""

    def of(self, outcome: CheckOutcome) -> list[CheckResult]:
        return [result for result in self.results if result.outcome is outcome]

    @property
    def counts(self) -> Mapping[str, int]:
        found = Counter(result.outcome for result in self.results)
        return {str(outcome): found[outcome] for outcome in CheckOutcome}

    def to_json(self) -> dict[str, object]:
        return {
            "format": FORMAT,
            "steptwin": self.version,
            "time": self.time,
            "device": dict(self.device),
            "permitted": self.permitted,
            "is_complete": self.is_complete,
            "counts": dict(self.counts),
            "results": [to_json(result) for result in self.results],
        }

    def json_text(self) -> str:
        return json.dumps(self.to_json(), indent=2, ensure_ascii=False) + "\n"

    def to_text(self) -> str:
        device = ", ".join(f"{name} {value}" for name, value in self.device.items() if value is not None)
        lines = [f"{device}; steptwin {self.version}, {self.time}, permitted: {self.permitted}"]
        for outcome in (CheckOutcome.CONFIRMED, CheckOutcome.REFUTED):
            for result in self.of(outcome):
                lines.append(f"{result.id:<7} {outcome:<11} {result.what}")
                lines += [f"        {p.what}: expected {p.expected}, came {p.came}" for p in result.probes if not p.holds]
        reasons: dict[str, list[str]] = {}
        for result in self.of(CheckOutcome.NOT_CHECKED):
            reasons.setdefault(result.why, []).append(result.id)
        lines += [f"not checked: {why}: {', '.join(ids)}" for why, ids in reasons.items()]
        lines.append(", ".join(f"{count} {outcome}" for outcome, count in self.counts.items()))
        if not self.is_complete:
            lines.append("cancelled: the report is not complete")
        return "\n".join(lines)
