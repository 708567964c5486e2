"""One run of a campaign, as plain values: what is different in it, and what came of it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import blake2b
from typing import Any, TypeAlias

from steptwin.controller import Nanos

VariedValue: TypeAlias = float | int | str | bool
PickledCase: TypeAlias = "tuple[type, tuple[object, ...]]"
"""Many cases and results go to other processes; what `dataclass` does for frozen ones with slots takes ten times as long."""
DIGEST_BYTES = 16
EXPECTATIONS = "expectations of the scripts"
"""The name of the verdict on a run whose scripts expected something in vain."""
WAITS = "waits of the scripts"
"""The name of the verdict on a run whose scripts waited for a condition or an answer in vain."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """Verdict of a property on a run."""

    name: str
    holds: bool
    robustness: float
    at_ns: Nanos | None
    why: str

    def __reduce__(self) -> PickledCase:
        return Verdict, (self.name, self.holds, self.robustness, self.at_ns, self.why)


@dataclass(frozen=True, slots=True)
class FaultAt:
    """A fault in words (`steptwin.simulation.faults.read`), set at a moment. ``table``: the number of its ``[[fault]]``, from
    0."""

    at_ns: Nanos
    fault: str
    table: int = 0

    def __reduce__(self) -> PickledCase:
        return FaultAt, (self.at_ns, self.fault, self.table)


@dataclass(frozen=True, slots=True)
class StepAt:
    """A step of a script at a moment; ``step`` is its table of TOML as JSON: ``{"press": "start"}``."""

    at_ns: Nanos
    step: str
    table: int = 0

    def __reduce__(self) -> PickledCase:
        return StepAt, (self.at_ns, self.step, self.table)


@dataclass(frozen=True, slots=True)
class Case:
    """A run by its values. It is JSON (`to_json`) and can be pickled.

    ``values`` are those of what varies, by its path or name; times in seconds. ``seed`` is that of all chance in the world.
    """

    number: int
    values: Mapping[str, VariedValue]
    faults: tuple[FaultAt, ...]
    steps: tuple[StepAt, ...]
    seed: int
    end_ns: Nanos

    def __reduce__(self) -> PickledCase:
        return Case, (self.number, self.values, self.faults, self.steps, self.seed, self.end_ns)

    def to_json(self) -> dict[str, Any]:
        faults = [{"at_ns": one.at_ns, "fault": one.fault, "table": one.table} for one in self.faults]
        steps = [{"at_ns": one.at_ns, "step": one.step, "table": one.table} for one in self.steps]
        return {
            "number": self.number,
            "values": dict(self.values),
            "faults": faults,
            "steps": steps,
            "seed": self.seed,
            "end_ns": self.end_ns,
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Case:
        """Read the result of `to_json`, also after JSON."""
        faults = tuple(FaultAt(**one) for one in data["faults"])
        steps = tuple(StepAt(**one) for one in data["steps"])
        return cls(data["number"], dict(data["values"]), faults, steps, data["seed"], data["end_ns"])

    @property
    def digest(self) -> str:
        """Equal for equal cases, whatever their number."""
        return digest_of({**self.to_json(), "number": None})


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

    def __reduce__(self) -> PickledCase:
        return CaseResult, (self.number, self.verdicts, self.digest, self.end_ns, self.measures, self.error)

    @property
    def failed(self) -> bool:
        return self.error is not None or not all(verdict.holds for verdict in self.verdicts)

    @property
    def robustness(self) -> float | None:
        """The least of all properties; None without any."""
        return min((verdict.robustness for verdict in self.verdicts), default=None)

    def to_json(self) -> dict[str, Any]:
        verdicts = [
            {"name": one.name, "holds": one.holds, "robustness": one.robustness, "at_ns": one.at_ns, "why": one.why}
            for one in self.verdicts
        ]
        return {
            "number": self.number,
            "verdicts": verdicts,
            "digest": self.digest,
            "end_ns": self.end_ns,
            "measures": dict(self.measures),
            "error": self.error,
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> CaseResult:
        """Read the result of `to_json`, also after JSON."""
        verdicts = tuple(Verdict(**one) for one in data["verdicts"])
        return cls(data["number"], verdicts, data["digest"], data["end_ns"], dict(data["measures"]), data["error"])


def digest_of(data: Any) -> str:
    """Digest of values that JSON has: 32 hexadecimal digits, equal for equal values in whatever order of their keys."""
    text = json.dumps(data, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return blake2b(text.encode(), digest_size=DIGEST_BYTES).hexdigest()
