"""The cases of a campaign by number: the same whoever asks for them, in whatever order."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from functools import cached_property
from math import prod
from typing import Any, NamedTuple

from steptwin.campaign.case import Case, FaultAt, StepAt, VariedValue
from steptwin.campaign.description import SALTELLI, SEARCHES, CampaignDescription, step_text
from steptwin.campaign.designs import Design, design_of, saltelli_block
from steptwin.campaign.variation import Choice
from steptwin.controller import Nanos
from steptwin.durations import duration
from steptwin.errors import Misuse
from steptwin.simulation.scheduler.chance import Chance

_NAME = re.compile(r"\{([A-Za-z_][\w-]*)\}")


class CaseDimension(NamedTuple):
    """Something that is chosen for each case: a value, or whether a fault of less than certain ``chance`` is there.

    ``levels``: so many values, each of which is tried with each of other dimensions; 0: it is drawn.
    """

    name: str
    levels: int


class Cases:
    """Cases of a description."""

    def __init__(self, description: CampaignDescription) -> None:
        self.description = description
        is_grid = description.design == "grid"
        self._doubtful = tuple(n for n, fault in enumerate(description.faults) if fault.chance < 1.0)
        """The numbers of the faults that may be missing."""
        self.dimensions = (
            *(
                CaseDimension(one.name, len(one.spread.levels) if is_grid or one.spread.is_grid else 0)
                for one in description.vary
            ),
            *(CaseDimension(f"fault {n + 1}", 2 if is_grid else 0) for n in self._doubtful),
        )
        self.grid = prod(one.levels for one in self.dimensions if one.levels)
        """How many combinations of levels there are; 1 without a grid."""

    @cached_property
    def count(self) -> int | None:
        """How many there are; None: without end. Raises `Misuse` where nothing says when to end."""
        description = self.description
        if description.runs is not None or description.time_ns is not None or description.until_failure:
            return description.runs
        if description.design != "grid" and not any(one.levels for one in self.dimensions):
            raise Misuse(f"campaign {description.name!r} has no end: give runs, time, until_failure or a grid")
        return self.grid

    @cached_property
    def _design(self) -> Design:
        drawn = [one.name for one in self.dimensions if not one.levels]
        return design_of(self.description.design, self.description.seed, drawn, self.count)

    def __getitem__(self, number: int) -> Case:
        """The case with this number, from 0."""
        return self.at(number, self.unit(number))

    def unit(self, number: int) -> list[float]:
        """The point of the design with this number, as `at` takes it."""
        drawn = iter(self._design(number))
        place = number % self.grid
        unit: list[float] = []
        for dimension in reversed(self.dimensions):
            if dimension.levels:
                place, level = divmod(place, dimension.levels)
                unit.append((level + 0.5) / dimension.levels)
            else:
                unit.append(-1.0)
        return [next(drawn) if u < 0.0 else u for u in reversed(unit)]

    def at(self, number: int, unit: Sequence[float]) -> Case:
        """The case at a point: for each of `dimensions` a number from 0 to below 1."""
        description = self.description
        is_grid = description.design == "grid"
        values: dict[str, VariedValue] = {}
        for one, dimension, u in zip(description.vary, self.dimensions, unit, strict=False):
            levels = one.spread.levels if dimension.levels else ()
            values[one.name] = Choice(levels).value(u) if levels else one.spread.value(u)
        present = [True] * len(description.faults)
        for n, u in zip(self._doubtful, unit[len(description.vary) :], strict=True):
            present[n] = u >= 0.5 if is_grid else u < description.faults[n].chance
        seed = Chance(description.seed, f"case {self._seeded_as(number)}").draw() >> 1
        return self.made(number, seed, values, [n for n, one in enumerate(present) if one])

    def _seeded_as(self, number: int) -> int:
        """Chance is one more thing that differs between two points of Saltelli, and is that of the first in those between."""
        if self.description.design != SALTELLI or self.description.search != SEARCHES[0]:
            return number
        place = number % saltelli_block(len(self.dimensions))
        return number if place == 1 else number - place

    def made(
        self,
        number: int,
        seed: int,
        values: Mapping[str, VariedValue],
        faults: Sequence[int],
        steps: Sequence[int] | None = None,
        end_ns: Nanos | None = None,
    ) -> Case:
        """The case with these values, and with the faults and steps (None: all) of these tables, from 0."""
        description = self.description
        found: list[FaultAt] = []
        for n in faults:
            fault = description.faults[n]
            text = filled(fault.do, values)
            if description.start_ns is not None and not re.search(r"\bname=", text):
                # All runs have the seed of their beginning; what a fault draws depends on its name, too.
                text = f"{text} name={text.split()[0]}-{n + 1}-{seed:x}"
            found.append(FaultAt(self._moment(fault.at, values), text, n))
        done = [
            StepAt(self._moment(step.at, values), filled_step(step.do, values), n)
            for n, step in enumerate(description.steps)
            if steps is None or n in steps
        ]
        return Case(number, dict(values), tuple(found), tuple(done), seed, description.end_ns if end_ns is None else end_ns)

    @staticmethod
    def _moment(at: Nanos | str, values: Mapping[str, VariedValue]) -> Nanos:
        return duration(values[at]) if isinstance(at, str) else at


def filled(text: str, values: Mapping[str, VariedValue]) -> str:
    """With values in the place of ``{name}``."""
    return _NAME.sub(lambda found: _format(values[found[1]]) if found[1] in values else found[0], text)


def filled_step(step: str, values: Mapping[str, VariedValue]) -> str:
    """As `filled`, of a step as JSON; a text that is nothing but ``{name}`` becomes the value, of its type."""
    return step_text(_filled(json.loads(step), values)) if "{" in step[1:] else step


def _filled(part: Any, values: Mapping[str, VariedValue]) -> Any:
    if isinstance(part, str):
        whole = _NAME.fullmatch(part)
        return values[whole[1]] if whole is not None and whole[1] in values else filled(part, values)
    if isinstance(part, dict):
        return {filled(key, values): _filled(one, values) for key, one in part.items()}
    return [_filled(one, values) for one in part] if isinstance(part, list) else part


def names_in(text: str) -> list[str]:
    """The names to which a text refers."""
    return _NAME.findall(text)


def _format(value: VariedValue) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
