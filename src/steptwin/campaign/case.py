"""One run of a campaign, as plain values: what is different in it, and what came of it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from hashlib import blake2b
from typing import Any, TypeAlias

from steptwin.machine import Nanos

VariedValue: TypeAlias = float | int | str | bool
DIGEST_BYTES = 16
EXPECTATIONS = "expectations of the scripts"
"""The name of the verdict on a run whose scripts expected something in vain."""
WAITS = "waits of the scripts"
"""The name of the verdict on a run whose scripts waited for a condition or an answer in vain."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """What a property says of a run."""

    name: str
    holds: bool
    robustness: float
    at_ns: Nanos | None
    why: str


@dataclass(frozen=True, slots=True)
class FaultAt:
    """A fault in words (`steptwin.world.faults.read`), set at a moment. ``table``: the number of its ``[[fault]]``, from 0."""

    at_ns: Nanos
    fault: str
    table: int = 0


@dataclass(frozen=True, slots=True)
class StepAt:
    """A step of a script at a moment; ``step`` is its table of TOML as JSON: ``{"press": "start"}``."""

    at_ns: Nanos
    step: str
    table: int = 0


@dataclass(frozen=True, slots=True)
class Case:
    """What is particular to one run. It is JSON (`plain`), and pickles.

    ``values`` are those of what varies, by its path or name; times in seconds. ``seed`` is that of all chance in the world.
    """

    number: int
    values: Mapping[str, VariedValue]
    faults: tuple[FaultAt, ...]
    steps: tuple[StepAt, ...]
    seed: int
    end_ns: Nanos

    def plain(self) -> dict[str, Any]:
        return asdict(self)

    @classmethod
    def of_plain(cls, plain: Mapping[str, Any]) -> Case:
        """What `plain` gave, also after JSON."""
        faults = tuple(FaultAt(**one) for one in plain["faults"])
        steps = tuple(StepAt(**one) for one in plain["steps"])
        return cls(plain["number"], dict(plain["values"]), faults, steps, plain["seed"], plain["end_ns"])

    @property
    def digest(self) -> str:
        """Equal for equal cases, whatever their number."""
        return digest_of({**self.plain(), "number": None})


@dataclass(frozen=True, slots=True)
class CaseResult:
    """``digest``: that of the trace; empty if there was no world. ``error``: why there was none, or why it did not run to its
    end."""

    number: int
    verdicts: tuple[Verdict, ...]
    digest: str
    end_ns: Nanos
    measures: Mapping[str, float]
    error: str | None = None

    @property
    def failed(self) -> bool:
        return self.error is not None or not all(verdict.holds for verdict in self.verdicts)

    @property
    def robustness(self) -> float | None:
        """The least of all properties; None without any."""
        return min((verdict.robustness for verdict in self.verdicts), default=None)

    def plain(self) -> dict[str, Any]:
        return asdict(self)

    @classmethod
    def of_plain(cls, plain: Mapping[str, Any]) -> CaseResult:
        """What `plain` gave, also after JSON."""
        verdicts = tuple(Verdict(**one) for one in plain["verdicts"])
        return cls(plain["number"], verdicts, plain["digest"], plain["end_ns"], dict(plain["measures"]), plain["error"])


def digest_of(plain: Any) -> str:
    """Of values that JSON has: 32 hexadecimal digits, equal for equal values in whatever order of their keys."""
    text = json.dumps(plain, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return blake2b(text.encode(), digest_size=DIGEST_BYTES).hexdigest()
