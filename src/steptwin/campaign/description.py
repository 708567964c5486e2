"""``campaign.toml`` as values: which world, what varies, what is done to it, what must hold and what is measured."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

from steptwin import __version__
from steptwin.campaign.case import digest_of
from steptwin.campaign.variation import Varied
from steptwin.machine import Nanos
from steptwin.simulation.describe.blueprint import FileContents

SEARCHES = ("random", "exhaustive", "guided")
SALTELLI = "saltelli"
DESIGNS = ("random", "grid", "latin-hypercube", "sobol", SALTELLI)


@dataclass(frozen=True, slots=True)
class VariedFault:
    """``do`` is in words, with ``{name}`` for what varies. ``at``: ns, or the name of a time that varies."""

    do: str
    at: Nanos | str
    chance: float


@dataclass(frozen=True, slots=True)
class VariedStep:
    """``do`` is the table of the step as JSON, with ``{name}`` for what varies."""

    do: str
    at: Nanos | str


@dataclass(frozen=True, slots=True)
class NamedProperty:
    """A property as it is written, with its name for people."""

    name: str
    text: str


@dataclass(frozen=True, slots=True)
class Measure:
    """A number that is kept of each run: ``value``, a signal at its end, or the time in s until ``when`` comes true first."""

    name: str
    value: str | None
    when: str | None


@dataclass(frozen=True, slots=True)
class MatrixRules:
    """Rules for effects. ``done``: a condition that is true at the end of a run that made its parts; None: the run ends as
    that without a fault, and no wait of a script has run out of time. ``alarm``: how the machine says that it noticed something.
    """

    done: str | None = None
    alarm: str | None = None
    phases: int | None = None
    product: tuple[str, ...] = ()
    """Names of properties whose failure is a wrong part, not a danger."""


@dataclass(frozen=True)
class CampaignDescription:
    """All that runs depend on, the world with its files included: it pickles, and needs no other file where it runs."""

    name: str
    world: str
    """The name of the description of the world, for messages."""
    text: str
    files: FileContents
    seed: int
    design: str
    runs: int | None
    """None: as many as the grid has, or as the time permits."""
    time_ns: Nanos | None
    """Longest time of the wall clock."""
    until_failure: bool
    end_ns: Nanos
    until: str | None
    start_ns: Nanos | None
    """The end of the beginning that all runs have in common; None: there is none."""
    vary: tuple[Varied, ...]
    faults: tuple[VariedFault, ...]
    steps: tuple[VariedStep, ...]
    properties: tuple[NamedProperty, ...]
    measures: tuple[Measure, ...]
    database: str | None = None
    expectations: bool = True
    """Whether a run fails where a script expects something in vain."""
    matrix: MatrixRules = MatrixRules()
    """Settings of the fault matrix."""
    search: str = SEARCHES[0]

    @cached_property
    def digest(self) -> str:
        """Equal for campaigns whose cases with the same number have the same results."""
        return digest_of(self._decisive())

    def _decisive(self) -> Mapping[str, Any]:
        left = {"runs", "time_ns", "until_failure", "database", "files", "name", "matrix", "world"}
        plain: dict[str, Any] = {"version": __version__} | {
            one.name: repr(getattr(self, one.name)) for one in fields(self) if one.name not in left
        }
        if self.design == "latin-hypercube":  # its points depend on how many there are
            plain["runs"] = self.runs
        return plain | {"files": {name: content.hex() for name, content in self.files.items()}}


def step_text(table: Mapping[str, Any]) -> str:
    """A step as `StepAt` has it."""
    return json.dumps(table, ensure_ascii=False)
