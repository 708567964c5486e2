"""`steptwin run FILE.prg`: run a program of the MIC488 in virtual time."""

from __future__ import annotations

import json
import time
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import partial
from math import inf
from pathlib import Path
from typing import NamedTuple

from steptwin.controller import SECOND, Nanos
from steptwin.diagnostics import Severity, render, visible
from steptwin.durations import duration_text
from steptwin.errors import Misuse
from steptwin.files.coverage import CoverageReports
from steptwin.files.programbanks import Findings, read_banks
from steptwin.files.programfiles import CompanionFiles
from steptwin.files.world import World
from steptwin.inputfiles import read_bytes
from steptwin.jsonvalues import to_json
from steptwin.languages.descriptions import Named, print_world
from steptwin.languages.program_run import (
    NOTE,
    Ending,
    Outcome,
    Print,
    ProgramRun,
    changes_of,
    report_causes,
    report_coverage,
    run_on,
    world_of,
    write,
)
from steptwin.languages.travels import PlacedSwitches, SwitchTravel, place_switches
from steptwin.mic488.axis import Axis
from steptwin.mic488.config import ConfigError, ControllerConfig, ProgramConfig, examine_config
from steptwin.mic488.core import check_pin
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.homing import Homing
from steptwin.mic488.inifile import IniFile
from steptwin.mic488.inputs import index_input
from steptwin.mic488.present import current_line, state_of
from steptwin.mic488.program import RUNNING
from steptwin.mic488.status import AxisStatus, ProgramState
from steptwin.simulation.describe.generated import Whole
from steptwin.simulation.describe.generated_mic488 import mic488_world
from steptwin.simulation.describe.overrides import NO_OVERRIDES
from steptwin.simulation.kinds.mic488.program_watch import ProgramEvent, ProgramWatch
from steptwin.simulation.kinds.programs import StatementSubscription
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.wbc.dialect import DEFAULT, dialect_for
from steptwin.wbc.interpreter import STATEMENT_TIME
from steptwin.wbc.real import real_text
from steptwin.wbc.usage import homing_sides

NAME = "mic488"
"""The name of the controller in the world."""
JSON_VERSION = 1

_WRONG = frozenset({"program-error", "position-error", "overrun"})
"""Events that make a run fail."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WbcRun(ProgramRun):
    """The options of a run."""

    positions: Path | None = None
    config: Path | None = None
    firmware: str = DEFAULT.firmware
    statement_time: Nanos = STATEMENT_TIME
    travels: Sequence[SwitchTravel] = ()


def run(options: WbcRun, out: Print, warn: Print) -> bool:
    """Run a program in its own world and print what it did. Returns whether no error occurred. ``warn`` gets the findings of
    the checker.

    Raises `Misuse` for options or files that cannot be run, `ProgramErrors` for a program with errors.
    """
    reports = CoverageReports(options.coverage)
    given = prepare(options, warn)
    if options.print_world:
        print_world(given.describe(str), f"run {options.program}")
        return True
    files = {str(path): read_bytes(path) for path in given.paths}
    is_late = options.statement_time == 0
    """Whether the program is started by this command after power-on, so that its first statements are observed, too."""
    late = {f"mic488.{NAME}.start": False} if is_late else NO_OVERRIDES
    keep_trace = options.trace is not None
    with world_of(given.describe(str), files, options, keep_trace=keep_trace, overrides=late) as world:
        watch = RunWatch(world)
        reports.observe(world, Path())
        if keep_trace:
            StatementSubscription(world.programs, world.trace.add)
        if is_late:
            given.start(watch.device)
        limit = options.longest
        begin = time.perf_counter()
        why = run_on(world, limit, world.due, lambda: watch.has_ended(world.due()), until_idle=options.until_idle)
        end = limit if why == "limit" else min(watch.settled(), limit)
        world.run_to(max(end, world.now))
        outcome = Outcome(Ending(end, why), time.perf_counter() - begin)
        ran = WbcRunResult(options, given, watch, outcome)
        wrong = any(happening.code in _WRONG for happening in watch.happened)
        if options.as_json:
            out(json.dumps(_data(ran, wrong=wrong), ensure_ascii=False, indent=2))
        else:
            if given.companions.found:
                out(str(given.companions))
            _print_lines(ran, out)
        write(world, options.trace, options.program.name, outcome.ending.at)
        report_coverage(reports, out)
        report_causes(world, options.questions, out)
    return not wrong


class Prepared(NamedTuple):
    """The checked input of a run."""

    options: WbcRun
    companions: CompanionFiles
    placed: PlacedSwitches
    banks: ProgramConfig
    """The banks that the configuration starts."""

    @property
    def paths(self) -> list[Path]:
        return [path for path in (self.options.program, self.companions.positions, self.companions.config) if path is not None]

    def start(self, device: Mic488Device) -> None:
        """Start the program now, as the controller does at power-on."""
        device.program.program_bank, device.program.position_bank = self.banks.prog_bank, self.banks.pos_bank
        device.command(partial(device.program.command, RUNNING), device.now)

    def describe(self, named: Named) -> str:
        """The description of the world."""
        options, positions, config = self.options, self.companions.positions, self.companions.config
        values = {
            "firmware": options.firmware,
            "config": None if config is None else named(config),
            "programs": {self.banks.prog_bank: named(options.program)},
            "positions": None if positions is None else {self.banks.pos_bank: named(positions)},
            "start": True,
            "statement_time": None if options.statement_time == STATEMENT_TIME else duration_text(options.statement_time),
        }
        changes = changes_of(options.inputs, NAME)
        return mic488_world(Whole(name=options.program.stem), [None], values, switches=self.placed.switches, changes=changes)


def prepare(options: WbcRun, warn: Print) -> Prepared:
    """Read and check the files. ``warn`` gets their warnings."""
    files = CompanionFiles.of(options.program, options.positions, options.config)
    config = ControllerConfig() if files.config is None else load_config(files.config, options.firmware, warn)
    for change in options.inputs:
        check_pin(change.pin, change.value)
    positions = {} if files.positions is None else {0: files.positions}
    banks = read_banks({0: options.program}, positions, config, dialect_for(options.firmware), option="--positions FILE")
    _warn(banks.findings, warn)
    program = banks.programs[0]
    if program.uses_positions and not banks.positions:
        raise Misuse(f"{options.program} moves to rows of the position table: give it with --positions FILE")
    driven = {change.pin for change in options.inputs}
    return Prepared(options, files, place_switches(config, options.travels, homing_sides(program.steps), driven), config.program)


def load_config(path: Path, firmware: str, warn: Print) -> ControllerConfig:
    """Read a configuration (``.cfg``). ``warn`` gets its warnings. Raises `Misuse`, with all errors in it."""
    file = IniFile.parse(read_bytes(path), str(path))
    config, findings = examine_config(file, firmware)
    if any(finding.severity is Severity.ERROR for finding in findings):
        raise ConfigError(file.source, findings)
    _warn(((file.source, findings),), warn)
    return config


def _warn(findings: Findings, warn: Print) -> None:
    for source, diagnostics in findings:
        shown = [d for d in diagnostics if d.severity is not Severity.NOTE]
        if shown:
            warn(render(source, shown))


class RunWatch(ProgramWatch):
    """Observes the program of the only controller; ``happened`` includes events and inputs."""

    def __init__(self, world: World) -> None:
        device = world.mic488[NAME].device
        super().__init__(device, world.objects.scheduler_of[NAME], NAME)
        for event in device.events:  # those of power-on
            self._emit(event.time, event.code, event.text)
        world.trace.subscribers.append(self._recorded)

    def _recorded(self, record: TraceRecord) -> None:
        if record.kind == "event" and record.controller == NAME:
            self._emit(record.time, record.subject, str(record.value), self._caused(record.time))
        elif record.kind == "event" and record.subject == NOTE:
            self._emit(record.time, "input", str(record.value))

    def has_ended(self, due: Nanos | None) -> bool:
        return due is None and self.device.program.state is ProgramState.STOPPED

    def settled(self) -> Nanos:
        """The time (ns) since which nothing has changed: every axis is at rest or moves at constant velocity."""
        last = max((happening.time for happening in self.happened), default=0)
        for axis in self.device.axes:
            profile = axis.profile
            last = max(last, profile.start, *(profile.start + int(end) for end in profile.ends if end != inf))
        return last


def missing_switches(device: Mic488Device, switched: Collection[str]) -> list[str]:
    """A text for each axis that is homing to a switch or index that nothing in the run can operate."""
    homing = [(axis.number, _missing(device, axis, switched)) for axis in device.axes if axis.status is AxisStatus.HOMING]
    return [f"M{number} homes {reason}" for number, reason in homing if reason is not None]


def _missing(device: Mic488Device, axis: Axis, switched: Collection[str]) -> str | None:
    homing = axis.homing
    if homing.leg == Homing.TO_STOP:
        return "to a mechanical stop, which only a world has"
    if homing.leg == Homing.TO_INDEX:
        pin = f"IN{index_input(axis.number - 1) + 1}"
        missing = f"to channel C of its encoder on {pin}, which nothing operates: --input {pin}=1@TIME"
        return None if pin in switched else missing
    side = "KL" if homing.velocity_p < 0 else "KR"
    if homing.sensor >= len(device.inputs.pins):
        return f"to {side}, for which the configuration has no input (In{side} of [Axis{axis.number - 1}])"
    pin = f"IN{homing.sensor + 1}"
    if pin in switched:
        return None
    return f"to {side} on {pin}, which nothing operates: --travel M{axis.number}={'LOW..' if side == 'KL' else '..HIGH'}"


class WbcRunResult(NamedTuple):
    """The result of a run."""

    options: WbcRun
    given: Prepared
    watch: RunWatch
    outcome: Outcome

    @property
    def missing(self) -> list[str]:
        return missing_switches(self.watch.device, self.given.placed.pins)


# ---------------------------------------------------------------------- output


def _print_lines(ran: WbcRunResult, out: Print) -> None:
    watch, outcome = ran.watch, ran.outcome
    for text in ran.given.placed.assumed:
        out(text)
    if watch.happened:
        out("\n".join(_line(happening) for happening in watch.happened))
    out(_ending(watch, outcome.ending))
    for text in ran.missing:
        out(f"  {text}")
    shown = state_of(watch.device, outcome.ending.at)
    for axis in shown.axes:
        if axis.enabled or axis.position:
            speed = f", {real_text(axis.velocity)} {axis.unit}/s" if axis.velocity else ""
            out(f"  {axis.name} at {real_text(axis.position or 0.0)} {axis.unit}{speed}, {axis.status.text}")
    on = [name for name, level in shown.pins.items() if level and not name.startswith("AIN")]
    out(f"  on: {', '.join(on) or 'nothing'}")
    out(str(outcome))


def _line(happening: ProgramEvent) -> str:
    return f"{happening.time / SECOND:14.6f} s  {happening.text:<34}  {happening.place}".rstrip()


def _statement(watch: RunWatch, step: int) -> str:
    found = watch.program.steps[step]
    return visible(watch.program.source.text[found.start : found.end].strip())


def _ending(watch: RunWatch, ending: Ending) -> str:
    fault = watch.device.program.fault
    if fault is not None:
        line, _ = watch.program.source.position(fault.span.start)
        return f"an error has stopped the program in line {line}: {fault.text}"
    if ending.why == "ended":
        return "the program has ended"
    place = current_line(watch.device)
    if place is None:
        return "ended at the time limit"
    is_paused = watch.device.program.state is ProgramState.PAUSED
    if ending.why == "waiting":
        moving = [f"M{axis.number}" for axis in watch.device.axes if axis.profile.moving(ending.at)]
        meanwhile = f", while {' and '.join(moving)} {'moves' if len(moving) == 1 else 'move'} on" if moving else ""
        return f"the program {'is paused' if is_paused else 'waits for ever'} in line {place.line}: {place.text}{meanwhile}"
    paused = ", paused" if is_paused else ""
    return f"ended at the time limit (--for sets a longer one){paused} in line {place.line}: {place.text}"


def _data(ran: WbcRunResult, *, wrong: bool) -> dict[str, object]:
    options, files, watch, outcome = ran.options, ran.given.companions, ran.watch, ran.outcome
    return {
        "version": JSON_VERSION,
        "file": str(options.program),
        "positions": None if files.positions is None else str(files.positions),
        "config": None if files.config is None else str(files.config),
        "language": "wbc",
        "firmware": watch.device.firmware.name,
        "ended": outcome.ending.why,
        "went_wrong": wrong,
        "virtual_s": outcome.virtual_s,
        "wall_s": outcome.wall_s,
        "ratio": outcome.ratio,
        "assumed": list(ran.given.placed.assumed),
        "missing_switches": ran.missing,
        "state": to_json(state_of(watch.device, outcome.ending.at)),
        "events": [_event_data(watch, happening) for happening in watch.happened],
    }


def _event_data(watch: RunWatch, happening: ProgramEvent) -> dict[str, object]:
    step = happening.step
    known = step is not None and step < len(watch.program.steps)
    return {
        "time_s": happening.time / SECOND,
        "code": happening.code,
        "text": happening.text,
        "line": watch.line(step) if step is not None and known else None,
        "statement": _statement(watch, step) if step is not None and known else None,
    }
