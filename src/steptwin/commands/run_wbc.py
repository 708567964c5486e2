"""`steptwin run FILE.prg`: a program of the MIC488 in virtual time, and what it does when."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from steptwin.commands.wbc_bench import NAME, Bench, Ending, Happening, Travel
from steptwin.diagnostics import Severity, render, visible
from steptwin.errors import Misuse
from steptwin.files.programbanks import Findings, ProgramErrors, read_banks
from steptwin.files.programfiles import Companions
from steptwin.files.timedinputs import TimedInput
from steptwin.machine import SECOND, Nanos
from steptwin.mic488.config import ControllerConfig
from steptwin.mic488.device import check_pin
from steptwin.served.serve_mic488 import load_config
from steptwin.wbc.dialect import DEFAULT, dialect_for
from steptwin.wbc.machine import STATEMENT_TIME
from steptwin.wbc.real import real_text
from steptwin.words.mic488_state import place_of, state_of
from steptwin.world.trace import Trace

USUAL_LIMIT_NS: Nanos = 60 * SECOND
LIMIT_UNTIL_IDLE_NS: Nanos = 3600 * SECOND
JSON_VERSION = 1

_WRONG = frozenset({"program-error", "position-error", "overrun"})
"""Events after which a run has not gone well."""

Say = Callable[[str], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class WbcRun:
    """What is to be run. ``limit`` ends it where nothing else does; ``until_idle`` ends it also where it waits for ever."""

    program: Path
    positions: Path | None = None
    config: Path | None = None
    firmware: str = DEFAULT.firmware
    statement_time: Nanos = STATEMENT_TIME
    travels: Sequence[Travel] = ()
    limit: Nanos | None = None
    until_idle: bool = False
    inputs: Sequence[TimedInput] = ()
    trace: Path | None = None
    as_json: bool = False


class Outcome(NamedTuple):
    options: WbcRun
    ending: Ending
    wall_s: float

    @property
    def virtual_s(self) -> float:
        return self.ending.at / SECOND

    @property
    def ratio(self) -> float:
        return self.virtual_s / self.wall_s


def run(options: WbcRun, say: Say, warn: Say) -> bool:
    """Run a program and say what it did; whether everything went right. ``warn`` is told what the checker found.

    Raises `Misuse` for what cannot be run, `ProgramErrors` for a program with errors.
    """
    files = Companions.of(options.program, options.positions, options.config)
    config = ControllerConfig() if files.config is None else load_config(files.config, options.firmware)
    for change in options.inputs:
        check_pin(change.pin, change.value)
    positions = {} if files.positions is None else {0: files.positions}
    try:
        banks = read_banks({0: options.program}, positions, config, dialect_for(options.firmware), option="--positions FILE")
    except ProgramErrors as errors:
        _warn(errors.findings, warn)
        raise
    _warn(banks.findings, warn)
    if banks.programs[0].uses_positions and not banks.positions:
        raise Misuse(f"{options.program} moves to rows of the position table: give it with --positions FILE")

    trace = None if options.trace is None else Trace([NAME])
    bench = Bench(
        banks.programs[0],
        banks.positions.get(0),
        config,
        firmware=options.firmware,
        statement_time=options.statement_time,
        trace=trace,
    )
    bench.place_switches(options.travels, {change.pin for change in options.inputs})
    limit = options.limit if options.limit is not None else LIMIT_UNTIL_IDLE_NS if options.until_idle else USUAL_LIMIT_NS
    begin = time.perf_counter()
    ending = bench.run(options.inputs, limit, until_idle=options.until_idle)
    outcome = Outcome(options, ending, time.perf_counter() - begin)
    wrong = any(happening.code in _WRONG for happening in bench.happened)
    if options.as_json:
        say(json.dumps(_data(bench, outcome, files, wrong=wrong), ensure_ascii=False, indent=2))
    else:
        if files.found:
            say(str(files))
        _say_lines(bench, outcome, say)
    if trace is not None and options.trace is not None:
        _write(trace, options.trace, options.program.name, bench, ending.at)
    return not wrong


def _warn(findings: Findings, warn: Say) -> None:
    for source, diagnostics in findings:
        shown = [d for d in diagnostics if d.severity is not Severity.NOTE]
        if shown:
            warn(render(source, shown))


def _write(trace: Trace, where: Path, title: str, bench: Bench, ended: Nanos) -> None:
    from steptwin.files.export import axis_views, bar, write_trace

    write_trace(trace, where, views=axis_views({NAME: bench.device}), title=title, ended=ended, watch=bar)


# ---------------------------------------------------------------------- what is said


def _say_lines(bench: Bench, outcome: Outcome, say: Say) -> None:
    for text in bench.assumed:
        say(text)
    if bench.happened:
        say("\n".join(_line(bench, happening) for happening in bench.happened))
    say(_ending(bench, outcome.ending))
    for text in bench.missing_switches():
        say(f"  {text}")
    shown: Any = state_of(bench.device, outcome.ending.at)
    for axis in shown["axes"]:
        if axis["enabled"] or axis["position_pulses"]:
            unit = axis["unit"]
            speed = f", {real_text(axis['velocity'])} {unit}/s" if axis["velocity"] else ""
            say(f"  M{axis['axis']} at {real_text(axis['position'])} {unit}{speed}, {axis['status_text']}")
    on = [name for name, level in shown["pins"].items() if level and not name.startswith("AIN")]
    say(f"  on: {', '.join(on) or 'nothing'}")
    virtual_s, wall_s = outcome.virtual_s, outcome.wall_s
    say(f"{virtual_s:.6f} s of virtual time in {wall_s:.3f} s: {outcome.ratio:,.0f} times faster than real time")


def _line(bench: Bench, happening: Happening) -> str:
    shown = f"{happening.time / SECOND:14.6f} s  {happening.text:<34}"
    step = happening.step
    if step is not None and step < len(bench.program.steps):
        shown += f"  {bench.line(step):>4}  {_statement(bench, step)}"
    return shown.rstrip()


def _statement(bench: Bench, step: int) -> str:
    found = bench.program.steps[step]
    return visible(bench.program.source.text[found.start : found.end].strip())


def _ending(bench: Bench, ending: Ending) -> str:
    fault = bench.device.program.fault
    if fault is not None:
        line, _ = bench.program.source.position(fault.span.start)
        return f"an error has stopped the program in line {line}: {fault.text}"
    if ending.why == "ended":
        return "the program has ended"
    place = place_of(bench.device)
    if place is None:
        return "ended by the limit of time"
    if ending.why == "waiting":
        moving = [f"M{axis.number}" for axis in bench.device.axes if axis.profile.moving(ending.at)]
        meanwhile = f", while {' and '.join(moving)} {'moves' if len(moving) == 1 else 'move'} on" if moving else ""
        return f"it waits for ever in line {place.line}: {place.text}{meanwhile}"
    return f"ended by the limit of time (--for takes a longer one) in line {place.line}: {place.text}"


def _data(bench: Bench, outcome: Outcome, files: Companions, *, wrong: bool) -> dict[str, object]:
    options = outcome.options
    return {
        "version": JSON_VERSION,
        "file": str(options.program),
        "positions": None if files.positions is None else str(files.positions),
        "config": None if files.config is None else str(files.config),
        "language": "wbc",
        "firmware": bench.device.firmware.name,
        "ended": outcome.ending.why,
        "went_wrong": wrong,
        "virtual_s": outcome.virtual_s,
        "wall_s": outcome.wall_s,
        "ratio": outcome.ratio,
        "assumed": bench.assumed,
        "missing_switches": bench.missing_switches(),
        "state": state_of(bench.device, outcome.ending.at),
        "events": [_event_data(bench, happening) for happening in bench.happened],
    }


def _event_data(bench: Bench, happening: Happening) -> dict[str, object]:
    step = happening.step
    known = step is not None and step < len(bench.program.steps)
    return {
        "time_s": happening.time / SECOND,
        "code": happening.code,
        "text": happening.text,
        "line": bench.line(step) if step is not None and known else None,
        "statement": _statement(bench, step) if step is not None and known else None,
    }
