"""Runs the cases of a campaign, one after the other, in one process."""

from __future__ import annotations

import json
import traceback
from collections import OrderedDict
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from steptwin.campaign.case import EXPECTATIONS, WAITS, Case, CaseResult, Verdict
from steptwin.campaign.description import CampaignDescription, Measure
from steptwin.campaign.properties import WatchState, read_property, watch_together
from steptwin.controller import SECOND, Nanos
from steptwin.coverage.counts import Coverage
from steptwin.coverage.watch import WorldCoverage
from steptwin.errors import Misuse, SteptwinError
from steptwin.files.world import World
from steptwin.simulation.describe import steptable
from steptwin.simulation.describe.blueprint import Blueprint
from steptwin.simulation.describe.description import read_world
from steptwin.simulation.describe.includes import given_files
from steptwin.simulation.describe.overrides import Overrides
from steptwin.simulation.faults import read as read_fault
from steptwin.simulation.script import steps as do
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.world.references import check_step
from steptwin.simulation.world.snapshot import SimulationSnapshot

MOST_BLUEPRINTS = 16
"""So many descriptions that differ are kept, for cases that have the same values."""


class CaseRunner:
    """Runner of the cases of a campaign.

    The blueprint of the world and the beginning that all runs share are made once.

    Raises `WorldError` for a world that is wrong whatever varies, and `Misuse` for what is refused of properties and measures.
    """

    def __init__(self, description: CampaignDescription) -> None:
        self.description = description
        self._paths = frozenset(one.name for one in description.vary if one.is_path)
        self._blueprints: OrderedDict[str, Blueprint] = OrderedDict()
        self._beginning: SimulationSnapshot | None = None
        self._properties = [read_property(one.text, one.name) for one in description.properties]
        self._seen: list[WatchState | None] = [None] * len(self._properties)
        """State after the common beginning, by property."""
        self._coverage: list[Any] = []
        """Coverage of the common beginning, as plain values."""
        if description.start_ns is not None:
            world = self._anew({}, description.seed)
            coverage = Coverage()
            watch = WorldCoverage(world, coverage)
            watches = watch_together(self._properties, world)
            ended = world.run_to(description.start_ns)
            watch.close()
            if ended is not None:
                start = description.start_ns / SECOND
                raise Misuse(f"start = {start:g} s: the world ends its run at {world.now / SECOND:g} s: {ended}")
            self._coverage = coverage.to_json()
            self._seen = [one.state() for one in watches]
            for one in watches:
                one.close()
            self._beginning, self._common = world.snapshot(), world.blueprint

    # ------------------------------------------------------------------ worlds

    def begin(self, case: Case, *, keep: bool = False) -> World:
        """The world of a case where it begins to vary, with its faults and steps to come; ``keep``: with its trace and its
        recording, from its beginning. Raises `Misuse` for a case that the world refuses."""
        world = self._world(case, keep=keep)
        for fault in case.faults:
            self._schedule(world, fault.at_ns, do.SetFault(read_fault(fault.fault)), "fault")
        for step in case.steps:
            self._schedule(world, step.at_ns, read_step(step.step), "step")
        return world

    def _world(self, case: Case, *, keep: bool) -> World:
        if self._beginning is None:
            return self._anew(self._overrides(case), case.seed, keep=keep)
        start = self._beginning.now
        early = next((one for one in (*case.faults, *case.steps) if one.at_ns < start), None)
        if early is not None:
            at = f"{early.at_ns / SECOND:g} s"
            raise Misuse(f"{at}: this is before {start / SECOND:g} s, up to which all runs have one beginning (start)")
        if keep:
            world = self._anew({}, self.description.seed, keep=True)
            world.run_to(start)
            return world
        return World(self._common, keep_trace=False, keep_inputs=False, at=self._beginning)

    def _overrides(self, case: Case) -> Overrides:
        return {name: value for name, value in case.values.items() if name in self._paths}

    def _anew(self, overrides: Overrides, seed: int, *, keep: bool = False) -> World:
        common = self._blueprint(overrides)
        blueprint = common.with_seed(seed)
        world = World(blueprint, keep_trace=keep, keep_inputs=keep)
        common.connected = blueprint.connected
        return world

    def _blueprint(self, overrides: Overrides) -> Blueprint:
        key = json.dumps(overrides)
        found = self._blueprints.get(key)
        if found is None:
            description = self.description
            spec = read_world(description.world, description.text, None, overrides, given_files(description.files))
            found = self._blueprints[key] = Blueprint(spec, description.files)
            if len(self._blueprints) > MOST_BLUEPRINTS:
                self._blueprints.popitem(last=False)
        return found

    @staticmethod
    def _schedule(world: World, at: Nanos, step: do.Step, name: str) -> None:
        check_step(world, step)
        world.start(name, partial(do.run_through, (do.At(at), step)), is_external=True)

    # ------------------------------------------------------------------ running

    def run(self, case: Case, coverage: Coverage | None = None) -> CaseResult:
        """Run a case to its end. What is wrong with it is the ``error`` of its result. ``coverage`` counts what it executes, with
        the beginning that all runs have in common."""
        world: World | None = None
        try:
            world = self.begin(case)
            return self.finish(case, world, coverage)
        except SteptwinError as error:
            return self.refused(case, world, error)
        except Exception as error:  # noqa: BLE001 - a mistake of ours in one run is no reason to lose the others
            return self.refused(case, world, Misuse(f"steptwin itself failed: {_told(error)}"))

    @staticmethod
    def refused(case: Case, world: World | None, error: SteptwinError) -> CaseResult:
        """The result of a case that did not begin, or not run to its end."""
        now, digest = (0, "") if world is None else (world.now, world.trace.digest())
        return CaseResult(case.number, (), digest, now, {}, str(error))

    def finish(self, case: Case, world: World, coverage: Coverage | None = None) -> CaseResult:
        """Run the world of a case, as `begin` made it, to its end. Raises `SteptwinError` where it does not get there."""
        watch = None
        if coverage is not None:
            for text in Coverage.from_json(self._coverage):
                coverage.add(text)
            watch = WorldCoverage(world, coverage)
        measures = _Measures(world, self.description.measures)
        watches = watch_together(self._properties, world, self._seen)
        world.run_to(case.end_ns, self.description.until)
        if watch is not None:
            watch.close()
        verdicts = [one.verdict() for one in watches]
        measured = dict(measures.values())
        for one in watches:
            measured |= one.measures()
        if len(world.failures) and self.description.expectations:
            first = world.failures[0]
            verdicts.append(Verdict(EXPECTATIONS, False, -1.0, first.time, str(first.value)))
        if len(world.overdue) and self.description.expectations:
            late = world.overdue[0]
            verdicts.append(Verdict(WAITS, False, -1.0, late.time, str(late.value)))
        return CaseResult(case.number, tuple(verdicts), world.trace.digest(), world.now, measured)


class _Measures:
    """Reads them at the end, and notes when conditions come true first."""

    def __init__(self, world: World, measures: tuple[Measure, ...]) -> None:
        self._world = world
        self._measures = measures
        self._found: dict[str, float] = {}
        for one in measures:
            if one.when is not None:
                world.when(one.when, self._noting(one.name), once=True, name="measure")
            elif one.value is not None:
                world.signal(one.value)

    def _noting(self, name: str) -> Callable[[], None]:
        def note() -> None:
            self._found.setdefault(name, self._world.now / SECOND)

        return note

    def values(self) -> Mapping[str, float]:
        ends = {one.name: self._world.read(one.value) for one in self._measures if one.value is not None}
        found = self._found | ends
        return {one.name: found[one.name] for one in self._measures if one.name in found}


def _told(error: Exception) -> str:
    """Kind and origin of an error, in a line."""
    place = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {error} ({Path(place.filename).name}, {place.name})".replace("\n", " ")


def read_step(text: str) -> do.Step:
    """The step in a table that is JSON. Raises `Misuse`."""
    table: Any = json.loads(text)
    toml = TomlText("step", "")
    step = steptable.read_step(toml, (), table)
    if step is None:
        found = toml.findings[0]
        raise Misuse(f"step {text}: {found.message}{f': {found.hint}' if found.hint else ''}")
    return step
