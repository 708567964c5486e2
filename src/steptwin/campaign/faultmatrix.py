"""Every fault of a world at every phase of its cycle, and what the machine did: a table as of an FMEA."""

from __future__ import annotations

import csv
import io
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

from steptwin.campaign.case import Case, FaultAt
from steptwin.campaign.description import CampaignDescription, MatrixRules
from steptwin.campaign.effects import FactsWatch, FaultEffect, Judgement, RunFacts, judge, wrong_without_a_fault
from steptwin.campaign.inventory import PossibleFault, occasions, possible_faults
from steptwin.campaign.phases import MOST_PHASES, CyclePhase, PhaseWatch
from steptwin.campaign.runner import CaseRunner
from steptwin.campaign.search.exhaustive import without_faults
from steptwin.campaign.shrink import ADDED
from steptwin.campaign.workers import workers
from steptwin.controller import SECOND
from steptwin.coverage.counts import Coverage
from steptwin.errors import SteptwinError
from steptwin.files import recording as recordings
from steptwin.files.world import World
from steptwin.simulation.faults.active import FaultActs

LASTING = frozenset({"no-answer"})
"""Kinds that would happen now and then, but are tried from a phase on without end: a line that is broken."""
CELLS = "cells"
NOMINAL = f"{CELLS}/without.json"
"""Recording of the run without a fault."""
COLUMNS = (
    "function", "part", "failure mode", "fault", "phase", "phase begins with", "at s", "acted", "acted first at s", "effect",
    "why", "detection", "detected after s", "session",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class MatrixCell:
    """A fault at a phase. ``session``: its file, relative to the folder of the matrix; empty where nothing was written."""

    phase: int
    fault: str
    judgement: Judgement
    acts: FaultActs | None
    session: str


@dataclass(frozen=True, slots=True)
class MatrixRow:
    possible: PossibleFault
    function: str
    cells: tuple[MatrixCell, ...]


@dataclass(frozen=True, slots=True)
class FaultMatrix:
    """``left_out``: faults to which it never comes in the run without a fault; ``wrong``: the reason why that run is the result
    and no fault was tried; empty if it holds."""

    name: str
    phases: tuple[CyclePhase, ...]
    rows: tuple[MatrixRow, ...]
    left_out: tuple[PossibleFault, ...]
    nominal: RunFacts
    coverage: Coverage
    wrong: str = ""

    @property
    def counts(self) -> dict[FaultEffect, int]:
        found = Counter(cell.judgement.effect for row in self.rows for cell in row.cells)
        return {effect: found[effect] for effect in FaultEffect}

    def to_json(self) -> dict[str, Any]:
        """As JSON."""
        return {
            "name": self.name,
            "end_s": self.nominal.result.end_ns / SECOND,
            "ended": self.nominal.ended,
            "wrong": self.wrong,
            "phases": [phase.to_json() for phase in self.phases],
            "counts": {effect.value: count for effect, count in self.counts.items()},
            "coverage": list(self.coverage.summary),
            "left_out": [one.text for one in self.left_out],
            "cells": [dict(zip(COLUMNS, values, strict=True)) for values in self.table()],
        }

    def table(self) -> Iterator[tuple[str | float | int | None, ...]]:
        """The values of `COLUMNS` for each cell."""
        for row in self.rows:
            for cell in row.cells:
                phase, judged = self.phases[cell.phase], cell.judgement
                after = None if judged.after_ns is None else judged.after_ns / SECOND
                acted, first = (0, None) if cell.acts is None else (cell.acts.count, cell.acts.first / SECOND)
                yield (
                    row.function, row.possible.part.value, row.possible.mode, cell.fault, phase.number, phase.name,
                    phase.middle / SECOND, acted, first, judged.effect.value, judged.why, judged.detection, after, cell.session,
                )  # fmt: skip

    def csv(self) -> str:
        file = io.StringIO()
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows(["" if value is None else value for value in row] for row in self.table())
        return file.getvalue()


class _CellTask(NamedTuple):
    """Task of a worker."""

    phase: int
    case: Case
    name: str


class _CellResult(NamedTuple):
    facts: RunFacts
    session: str


def fault_matrix(
    description: CampaignDescription,
    folder: Path,
    *,
    jobs: int | None = 1,
    progress: Callable[[int, int], object] = lambda done, total: None,
) -> FaultMatrix:
    """Run every fault at every phase, and write the recording of each run into ``folder``. The run without a fault comes first;
    if it does not hold, its recording is all that there is. Raises `Misuse`."""
    runner, rules = CaseRunner(description), description.matrix
    nominal_case = without_faults(description)
    coverage = Coverage()
    world = runner.begin(nominal_case, keep=True)
    watch = PhaseWatch(world)
    nominal = _run(runner, world, nominal_case, rules, coverage)
    (folder / CELLS).mkdir(parents=True, exist_ok=True)
    recordings.save(recordings.recording_of(world), folder / NOMINAL)
    if wrong := wrong_without_a_fault(nominal, rules):
        return FaultMatrix(description.name, (), (), (), nominal, coverage, wrong)
    made = [one.name for one in description.measures if one.value is not None]
    phases = watch.phases(MOST_PHASES if rules.phases is None else rules.phases)
    possible = possible_faults(runner.begin(nominal_case))
    counts = occasions(runner.begin(nominal_case), possible, nominal_case.end_ns, description.until)
    tried = [one for one in possible if counts.get(one.text, 1)]
    tasks = [
        [_CellTask(n, _case(nominal_case, one, phase), f"{row + 1:03}-{phase.number:02}") for n, phase in enumerate(phases)]
        for row, one in enumerate(tried)
    ]
    rows: list[MatrixRow] = []
    for results, covered in _results(description, rules, tasks, folder, jobs):
        possible_fault, row = tried[len(rows)], tasks[len(rows)]
        for text in Coverage.from_json(covered):
            coverage.add(text)
        cells = [
            MatrixCell(
                task.phase,
                task.case.faults[0].fault,
                judge(found.facts, nominal, task.case.faults[0].at_ns, rules.product, made),
                found.facts.acts,
                found.session,
            )
            for task, found in zip(row, results, strict=True)
        ]
        rows.append(MatrixRow(possible_fault, function_of(world, possible_fault), tuple(cells)))
        progress(len(rows), len(tried))
    left_out = tuple(one for one in possible if one not in tried)
    return FaultMatrix(description.name, tuple(phases), tuple(rows), left_out, nominal, coverage)


def _case(nominal: Case, possible: PossibleFault, phase: CyclePhase) -> Case:
    fault = possible.fault
    if possible.is_counted and fault.kind.name not in LASTING:
        fault = possible.once()
    return replace(nominal, faults=(FaultAt(phase.middle, str(fault), ADDED),))


def _run(runner: CaseRunner, world: World, case: Case, rules: MatrixRules, coverage: Coverage | None) -> RunFacts:
    watch = FactsWatch(world, rules)
    try:
        result = runner.finish(case, world, coverage)
    except SteptwinError as error:
        result = runner.refused(case, world, error)
    return watch.facts(result)


def _run_row(
    description: CampaignDescription, rules: MatrixRules, tasks: Iterable[_CellTask], folder: Path
) -> tuple[list[_CellResult], list[Any]]:
    """In a worker. The coverage is plain values."""
    runner, coverage = CaseRunner(description), Coverage()
    found: list[_CellResult] = []
    for task in tasks:
        world = runner.begin(task.case, keep=True)
        facts = _run(runner, world, task.case, rules, coverage)
        name = ""
        if facts.result.error is None:
            name = f"{CELLS}/{task.name}.json"
            recordings.save(recordings.recording_of(world), folder / name)
        found.append(_CellResult(facts, name))
    return found, coverage.to_json()


def _results(
    description: CampaignDescription, rules: MatrixRules, tasks: list[list[_CellTask]], folder: Path, jobs: int | None
) -> Iterator[tuple[list[_CellResult], list[Any]]]:
    with workers(jobs, None) as there:
        executor = there.open()
        waiting = deque[Future[Any]]()
        for row in tasks:
            waiting.append(executor.submit(_run_row, description, rules, row, folder))
            if len(waiting) > there.width:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()


def function_of(world: World, possible: PossibleFault) -> str:
    """The function that fails: the faulty thing, and what drives the input."""
    place = possible.place
    name, _, pin = place.partition(".")
    path = next((path for one, path in world.objects.driven.items() if one.controller == name and one.pin == pin), None)
    if path is None or possible.fault.kind.parameter("pin") is None:
        return place
    table: Any = world.spec.text.data
    names: list[str] = []
    for key in path:
        table = table[key] if not isinstance(table, dict) or key in table else None
        if table is None:
            break
        if isinstance(table, dict):
            names += [str(table[key]) for key in ("name", "from") if key in table]
    return f"{place} ({', '.join(names)})" if names else place
