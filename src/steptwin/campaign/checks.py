"""Checks of a campaign that need more than one of its tables, or its world."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from steptwin.campaign.cases import filled, filled_step, names_in
from steptwin.campaign.description import SALTELLI, Measure, NamedProperty, VariedFault, VariedStep
from steptwin.campaign.properties import read_property
from steptwin.campaign.runner import read_step
from steptwin.campaign.variation import Between, Choice, Normal, Varied, VariedValue
from steptwin.controller import SECOND
from steptwin.durations import LONGEST_NS, duration
from steptwin.errors import Misuse
from steptwin.files.world import World, read_beside
from steptwin.simulation.describe.description import describe
from steptwin.simulation.describe.includes import FILE_KEYS, USE, given_files
from steptwin.simulation.describe.overrides import override, place_of
from steptwin.simulation.faults import read as read_fault
from steptwin.simulation.script import steps as do
from steptwin.simulation.toml.keypaths import Path as TomlPath
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.world.references import check_step

CAMPAIGN, VARY, FAULT, STEP, PROPERTY, MEASURE = "campaign", "vary", "fault", "step", "property", "measure"
MATRIX = "matrix"
"""The tables."""
UNKNOWN_KEY = "D004"
_LATE = "this is after end, so that it never happens"


class CampaignChecks:
    """Checks of the tables of a campaign against one another and against its world. ``head``: the values of ``[campaign]``."""

    def __init__(self, toml: TomlText, head: Mapping[str, Any], vary: tuple[Varied, ...]) -> None:
        self._toml = toml
        self._head = head
        self._vary = vary
        self._by_name: dict[str, Between | Normal | Choice] = {one.name: one.spread for one in vary if not one.is_path}

    def check_names(self, faults: tuple[VariedFault, ...], steps: tuple[VariedStep, ...]) -> None:
        toml = self._toml
        seen: set[str] = set()
        for n, one in enumerate(self._vary):
            if one.name in seen:
                toml.wrong((VARY, n), "D006", f"{one.name!r} varies already")
            seen.add(one.name)
        for kind, found in ((FAULT, faults), (STEP, steps)):
            for n, one in enumerate(found):
                for name in names_in(one.do):
                    if name not in self._by_name:
                        near = toml.near(name, self._by_name)
                        toml.wrong((kind, n, "do"), "D009", f"{{{name}}}: no [[vary]] has this name{near}")
                if isinstance(one.at, str):
                    self._check_moment((kind, n, "at"), one.at)
                elif one.at < (self._head.get("start_ns") or 0):
                    toml.wrong((kind, n, "at"), "D007", "this is before start, up to which all runs have one beginning")
                elif one.at > self._head.get("end_ns", one.at):
                    toml.wrong((kind, n, "at"), "D007", _LATE)

    def _check_moment(self, place: TomlPath, name: str) -> None:
        spread = self._by_name.get(name)
        if spread is None:
            near = self._toml.near(name, self._by_name)
            self._toml.wrong(place, "D009", f"{name!r} is not a time, and no [[vary]] has this name{near}")
            return
        start = (self._head.get("start_ns") or 0) / SECOND
        ends = spread.values if isinstance(spread, Choice) else (spread.low, spread.high)
        if isinstance(spread, Normal) and spread.low is None:
            self._toml.wrong(place, "D007", f"{name!r} is not a time, because it may be below 0", "give times, or between")
            return
        try:
            earliest = min(duration(value) for value in ends if value is not None) / SECOND
        except Misuse as error:
            self._toml.wrong(place, "D007", f"{name!r} varies, but is not a time: {error}")
            return
        if earliest > self._head.get("end_ns", LONGEST_NS) / SECOND:
            self._toml.wrong(place, "D007", f"{name!r} is at least {earliest:g} s: {_LATE}")
        if earliest < start:
            self._toml.wrong(
                place, "D007", f"{name!r} may be {earliest:g} s, before start, up to which all runs have one beginning"
            )

    def check_head(self) -> None:
        toml, head = self._toml, self._head
        start, end = head.get("start_ns"), head.get("end_ns")
        if start is not None and end is not None and start >= end:
            toml.wrong((CAMPAIGN, "start"), "D007", "start must be before end")
        for n, one in enumerate(self._vary):
            if one.is_path and start is not None:
                toml.wrong(
                    (VARY, n, "path"),
                    "D007",
                    f"{one.name!r} is of the world, which is the same in all runs that have one beginning",
                    "leave out start, or vary names that faults and steps refer to",
                )
            if head.get("design") == SALTELLI and one.spread.is_grid:
                toml.wrong((VARY, n, "grid"), "D007", f"design = {SALTELLI!r} draws all values", "give choose instead of grid")
            if head.get("design") == "grid" and not one.spread.levels:
                toml.wrong((VARY, n), "D007", f"{one.name!r} has no few values, as a grid needs", "give choose, grid, or levels")

    # ------------------------------------------------------------------ in the world

    def read_files(self, base: Path, files: dict[str, bytes]) -> None:
        """Add the files that vary; the world names only one of each."""
        for n, one in enumerate(self._vary):
            if one.is_path and isinstance(one.spread, Choice) and one.name.split(".")[-1] in FILE_KEYS:
                self._toml.unless_wrong((VARY, n), partial(_read_all, base, one.spread, files))

    def check_in(
        self,
        world: World,
        files: Mapping[str, bytes],
        faults: tuple[VariedFault, ...],
        steps: tuple[VariedStep, ...],
        measures: tuple[Measure, ...],
    ) -> None:
        """Whether the world has all that is named. Values that only some cases have are left to these."""
        text, toml = world.spec.text.source.text, self._toml
        places: dict[tuple[str, ...], str] = {}
        for n, one in enumerate(self._vary):
            if one.is_path:
                toml.unless_wrong((VARY, n, "path"), partial(_check_path, text, files, one))
                earlier = places.setdefault(place_of(world.spec.text.data, one.name), one.name)
                if earlier != one.name:
                    toml.wrong((VARY, n, "path"), "D006", f"{one.name!r} is the same as {earlier!r}, which varies already")
        for n, fault in enumerate(faults):
            toml.unless_wrong((FAULT, n, "do"), partial(self._check_fault, world, fault.do))
        for n, step in enumerate(steps):
            toml.unless_wrong((STEP, n, "do"), partial(self._check_step, world, step.do))
        for n, measure in enumerate(measures):
            if measure.value is not None:
                toml.unless_wrong((MEASURE, n, "value"), partial(world.read, measure.value))
            if measure.when is not None:
                toml.unless_wrong((MEASURE, n, "when"), partial(world.condition, measure.when))
        if self._head["until"] is not None:
            toml.unless_wrong((CAMPAIGN, "until"), partial(world.condition, self._head["until"]))

    def check_properties(self, world: World, properties: tuple[NamedProperty, ...]) -> None:
        """Whether the world has what they are about."""
        for n, one in enumerate(properties):
            table = self._toml.data[PROPERTY][n]
            word = next(key for key in table if key != "name")
            self._toml.unless_wrong((PROPERTY, n, word), partial(_watch, world, one))

    def _check_fault(self, world: World, text: str) -> None:
        for values in self._samples(text):
            check_step(world, do.SetFault(read_fault(filled(text, values))))

    def _check_step(self, world: World, text: str) -> None:
        for values in self._samples(text):
            check_step(world, read_step(filled_step(text, values)))

    def _samples(self, text: str) -> Iterator[Mapping[str, VariedValue]]:
        """Values of the names in a text: each that can be chosen, with the middle of the others."""
        names = dict.fromkeys(names_in(text))
        middle = {name: self._by_name[name].value(0.5) for name in names}
        yield middle
        for name in names:
            for value in self._by_name[name].levels if isinstance(self._by_name[name], Choice) else ():
                yield {**middle, name: value}


def _watch(world: World, one: NamedProperty) -> None:
    read_property(one.text, one.name).watch(world).close()


def _read_all(base: Path, spread: Choice, files: dict[str, bytes]) -> None:
    for name in spread.values:
        if isinstance(name, str) and name not in files:
            files[name] = read_beside(base, name)


def _check_path(text: str, files: Mapping[str, bytes], one: Varied) -> None:
    """Raises `Misuse` for a path that the world does not have, whatever its value."""
    name, found = one.name, {one.name: one.spread.value(0.5)}
    toml = TomlText("world", text)
    override(toml.data, found, USE)
    spec = describe("world", text, None, found, given_files(files))
    last = name.split(".")[-1]
    wrong = next((one for one in spec.text.findings if one.code == UNKNOWN_KEY and f"has no {last!r}" in one.message), None)
    if wrong is not None:
        raise Misuse(f"{name!r}: {wrong.message}")
