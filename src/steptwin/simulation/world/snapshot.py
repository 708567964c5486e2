"""The state of a world at a moment, and what was given to it from outside."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

from steptwin.controller import Nanos
from steptwin.diagnostics import SourceText
from steptwin.simulation.describe.blueprint import FileContents
from steptwin.simulation.describe.overrides import Overrides
from steptwin.simulation.faults import Fault
from steptwin.simulation.scheduler.schedulerstate import SchedulerState
from steptwin.simulation.scheduler.trace import Mark
from steptwin.simulation.world.boundedlog import BoundedLogState
from steptwin.simulation.world.inputs import ExternalInput, PastAct
from steptwin.simulation.world.scripts import ScriptsState


class RecordedInput(NamedTuple):
    """An external input and its moment. ``settled``: the scripts of the description had already run at that moment."""

    time: Nanos
    what: ExternalInput
    settled: bool = False


@dataclass(frozen=True, slots=True)
class SimulationSnapshot:
    """The complete state of a world at a moment."""

    description: tuple[str, int, Overrides, FileContents]
    now: Nanos
    schedulers: tuple[SchedulerState, ...]
    faults: tuple[tuple[Fault, str, Nanos], ...]
    """The faults that were set, with their names and moments."""
    prepared: tuple[str, ...]
    """The controllers that were prepared for faults."""
    faults_state: Any
    scripts: ScriptsState
    acts: tuple[PastAct, ...]
    inputs: tuple[RecordedInput, ...]
    is_settled: bool
    failures: BoundedLogState
    overdue: BoundedLogState
    trace: Mark
    scheduled: frozenset[str]
    """Names of the scheduled steps that can still be cancelled."""
    downloaded: tuple[tuple[tuple[str, str], SourceText], ...]
