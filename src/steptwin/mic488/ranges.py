"""Ranges of permitted numbers that can be shown to people."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ValueRange:
    """Finite numbers from ``low`` (itself excluded when ``above``) to ``high``; None is open."""

    low: float | None = None
    high: float | None = None
    above: bool = False

    def __contains__(self, value: float) -> bool:
        """NaN and infinity lie in no range (MIC-7)."""
        if not math.isfinite(value):
            return False
        if self.low is not None and (value <= self.low if self.above else value < self.low):
            return False
        return self.high is None or value <= self.high

    def __str__(self) -> str:
        if self.low is not None and self.high is not None and not self.above:
            return f"{_format(self.low)}…{_format(self.high)}"
        bounds = []
        if self.low is not None:
            bounds.append(f"{'>' if self.above else '≥'} {_format(self.low)}")
        if self.high is not None:
            bounds.append(f"≤ {_format(self.high)}")
        return ", ".join(bounds) or "any finite number"


def _format(number: float) -> str:
    return str(int(number)) if number == int(number) and abs(number) < 1e15 else f"{number:.{12 if abs(number) < 1e15 else 4}g}"


FINITE = ValueRange()
POSITIVE = ValueRange(0, above=True)
