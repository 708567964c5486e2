"""`steptwin run MACHINE.toml` and `steptwin replay FILE`: run a world in virtual time and report what happened."""

from __future__ import annotations

import json
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from operator import itemgetter
from pathlib import Path
from typing import Any, NamedTuple

import steptwin.services  # noqa: F401  their tables are checked, too
from steptwin.campaign.properties import Verdict, read_property, watch_together
from steptwin.controller import SECOND, Nanos
from steptwin.controllerstate import ControllerState
from steptwin.durations import duration
from steptwin.errors import Misuse
from steptwin.files import recording as recordings
from steptwin.files.coverage import CoverageReports
from steptwin.files.export import axis_views, bar, write_trace
from steptwin.files.export.progress import TimeProgress
from steptwin.files.loader import load_world, set_faults
from steptwin.files.scene.recorder import SceneRecorder
from steptwin.files.scene.scenescript import NO_SCRIPT, scene_script
from steptwin.files.timedinputs import TimedInput
from steptwin.files.world import LONGEST_RUN_NS, World
from steptwin.files.worldoptions import ShownOptions, WorldRunOptions
from steptwin.jsonvalues import to_json
from steptwin.languages.program_run import report_causes
from steptwin.live.interrupts import FirstInterrupt
from steptwin.simulation.kinds.kind import ProgramAct, ProgramReport
from steptwin.simulation.logic.condition import INSTEAD
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.records import PROGRAM, Selection, describe, is_shown, named_in, read_selection
from steptwin.simulation.world.references import check_step
from steptwin.simulation.world.unfinished import changes_of_pins, unchanged_inputs, unfinished, without_program

USUAL_LIMIT_NS: Nanos = 60 * SECOND
RECORDING = "session.json"
INTERRUPTED = "Ctrl-C"
JSON_VERSION = 1
MOST_STANDING = 20
"""So many things that stand still, and inputs that never changed, are printed."""

Print = Callable[[str], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldRun:
    """The options of a run. ``until`` is a condition; ``limit`` (ns) ends the run at the latest.

    Default of ``limit``: a minute; with ``until`` an hour.
    """

    world: Path
    """A description, or a recording to continue."""
    run: WorldRunOptions = field(default_factory=WorldRunOptions)
    shown: ShownOptions = field(default_factory=ShownOptions)
    limit: Nanos | None = None
    until: str | None = None
    inputs: Sequence[TimedInput] = ()
    trace: Path | None = None
    coverage: Sequence[str] = ()
    """Files for coverage of programs; ``-`` for a table."""
    questions: Sequence[str] = ()
    """Questions that are answered at the end (`steptwin.why`)."""
    properties: Sequence[str] = ()
    """Properties that must hold in the run (`steptwin.campaign.properties`)."""
    as_json: bool = False


def run(options: WorldRun, out: Print, warn: Print) -> bool:
    """Run a world and report what happened. Returns whether all expectations held. ``warn`` gets the warnings about its files.

    Raises `Misuse` for a file or option that cannot be run. After Ctrl-C everything is written, then `KeyboardInterrupt`
    raised.
    """
    reports = CoverageReports(options.coverage)
    keep_trace = options.trace is not None or not options.as_json
    recorder = SceneRecorder()

    def begun(world: World) -> None:
        if options.questions:
            world.keep_states()
        if options.trace is not None:
            recorder.follow(world)

    with load_world(
        options.world,
        warn,
        moment=options.run.moment,
        seed=options.run.seed,
        overrides=options.run.overrides,
        keep_trace=keep_trace,
        allow_outside=options.run.allow_outside,
        state=options.run.state,
        begun=begun,
    ) as world:
        reports.observe(world, options.world.parent)
        return _run_and_report(world, options, reports, recorder, out, warn)


def _check_until(text: str | None) -> None:
    """Raises `Misuse` for a time in the place of a condition."""
    try:
        duration(text if text is not None else "")
    except Misuse:
        return
    raise Misuse(f"--until {text}: this is a time, where a condition is expected; --for {text} ends the run then")


def _run_and_report(
    world: World, options: WorldRun, reports: CoverageReports, recorder: SceneRecorder, out: Print, warn: Print
) -> bool:
    _check_until(options.until)
    began = world.now
    before = filter(is_shown, world.trace) if began else ()  # what happens at power-on is part of the run
    known = Counter(record.controller for record in before)
    pins = changes_of_pins(world)
    _arrange(world, options)
    properties = watch_together([read_property(text) for text in options.properties], world)
    selection = read_selection(options.shown.of, options.shown.show, named_in(world.objects))
    usual = USUAL_LIMIT_NS if options.until is None else LONGEST_RUN_NS
    limit = options.limit if options.limit is not None else usual
    watches = {} if options.as_json else _watched(world)
    wall = time.perf_counter()
    with bar(f"running {world.spec.name}", began, began + limit) as progress:
        reason = _run(world, options.until, limit, progress)
    wall_s = time.perf_counter() - wall
    verdicts = [one.verdict() for one in properties]
    measures = {name: value for one in properties for name, value in one.measures().items()}
    written = _write(world, options, recorder, warn)
    recording = recordings.recording_of(world)
    if options.run.session is not None:
        recordings.save(recording, options.run.session)
        written.append(options.run.session)
    tables: list[str] = []
    written += reports.write(tables.append)
    in_vain = options.until if reason is None else None
    outcome = WorldRunResult(began, known, reason, in_vain, wall_s, recording.digest, written, verdicts, measures)
    if options.as_json:
        _json(world, outcome, out)
    else:
        _print_happened(world, outcome, watches, selection, out)
        _print_end(world, outcome, selection, pins, out)
    for text in tables:
        out(f"\n{text}")
    report_causes(world, options.questions, out)
    if reason is INTERRUPTED:
        raise KeyboardInterrupt
    in_time = not world.overdue and in_vain is None
    holds = all(one.holds for one in verdicts)
    return not world.failures and holds and (in_time or not options.run.strict)


def _watched(world: World) -> dict[str, ProgramReport]:
    """Watches for the programs of all controllers that have any."""
    found = {
        name: world.kind(name).watch_program(controller, world.objects.scheduler_of[name], name)
        for name, controller in world.controllers.items()
    }
    return {name: watch for name, watch in found.items() if watch is not None}


def _run(world: World, until: str | None, limit: Nanos, progress: TimeProgress) -> str | None:
    """Run to the limit; returns the reason of an earlier end. The first Ctrl-C ends the run and keeps its results."""

    def watch(now: Nanos) -> None:
        progress(now)
        if interrupt.came:
            raise _Interrupted

    with FirstInterrupt() as interrupt:
        try:
            return world.run(until=until, for_=limit / SECOND, watch=watch)
        except _Interrupted:
            return INTERRUPTED


class _Interrupted(Exception):
    """A signal has requested the end of the run."""


class WorldRunResult(NamedTuple):
    """The end of a run. ``reason``: why it ended early; ``in_vain``: the condition that did not come true in time.

    ``known``: the number of records of each controller at the moment it ``began``.
    """

    began: Nanos
    known: Counter[str]
    reason: str | None
    in_vain: str | None
    wall_s: float
    digest: str
    written: list[Path]
    verdicts: list[Verdict]
    measures: dict[str, float]
    """Measured cycle times in properties."""


def _arrange(world: World, options: WorldRun) -> None:
    """Apply the inputs and faults of the command line."""
    set_faults(world, options.run.fault)
    for given in options.inputs:
        controller, dot, pin = given.pin.rpartition(".")
        names = {name.upper(): name for name in world.controllers}
        if not dot and len(names) == 1:
            controller = next(iter(names))
        if controller.upper() not in names:
            raise Misuse(f"--input {given.pin}: expected CONTROLLER.PIN; controllers are {', '.join(world.controllers)}")
        name = names[controller.upper()]
        step = do.Set(((name, pin.upper(), given.value),))
        try:
            check_step(world, step)
            world.at(given.time / SECOND, step, name=f"--input {given.pin}")
        except Misuse as error:
            raise Misuse(f"--input {name}.{pin}: {error}") from None
    if options.until is not None:
        world.condition(options.until)


def _write(world: World, options: WorldRun, recorder: SceneRecorder, warn: Print) -> list[Path]:
    if options.trace is None:
        return []
    written = _write_trace(world, options.trace, recorder, warn)
    if options.trace.is_dir():
        where = options.trace / RECORDING
        recordings.save(recordings.recording_of(world), where)
        written.append(where)
    return written


def _write_trace(world: World, where: Path, recorder: SceneRecorder, warn: Print) -> list[Path]:
    views, scene = axis_views(world), recorder.recorded()
    written = write_trace(world.trace, where, views=views, scene=scene, title=world.spec.name, ended=world.now, watch=bar)
    if scene is not None and not scene_script() and any(path.suffix == ".html" for path in written):
        warn(NO_SCRIPT)
    return written


# ---------------------------------------------------------------------- output


def _print_happened(
    world: World, outcome: WorldRunResult, watches: Mapping[str, ProgramReport], selection: Selection, out: Print
) -> None:
    """Print in order of time what happened in the world, and what programs did with the statements that caused it.

    At one moment what statements did stands before what came of it.
    """
    shown: list[tuple[Nanos, bool, str]] = []
    for record in filter(is_shown, world.trace):
        if outcome.known[record.controller]:
            outcome.known[record.controller] -= 1
        elif selection.shows(record):
            shown.append((record.time, True, describe(record)))
    for name, watch in watches.items():
        if not selection.takes(PROGRAM, (name,)):
            continue
        shown += [(each.time, not each.is_done, _with_statement(name, each)) for each in watch.happened]
    for _, _, text in sorted(shown, key=itemgetter(0, 1)):
        out(text)


def _with_statement(controller: str, happening: ProgramAct) -> str:
    return f"{happening.time / SECOND:12.6f} s  {controller:<10} {happening.text:<34}  {happening.place}".rstrip()


def _print_failures(world: World, out: Print) -> None:
    """The first failure of each expectation, and how often it failed after it."""
    by_condition: dict[str, list[TraceRecord]] = {}
    for failure in world.failures:
        by_condition.setdefault(str(failure.value).partition(INSTEAD)[0], []).append(failure)
    for first, *others in by_condition.values():
        out(f"expectation failed at {first.time / SECOND:g} s: {first.value}")
        if others:
            out(f"and {len(others)} more times, the last at {others[-1].time / SECOND:g} s: {others[-1].value}")
    if world.failures.more:
        out(f"{world.failures.more} more expectations failed")


def _print_end(world: World, outcome: WorldRunResult, selection: Selection, pins: Counter[str], out: Print) -> None:
    """``pins``: how often they had changed when the run began."""
    out("")
    for name, axis in world.axis.items():
        lost = f"   {axis.lost} pulses lost" if axis.lost else ""
        out(f"{name:<10} {axis.position:12.4f} {axis.unit}{lost}")
    driven = {fitted.spec.drive for fitted in world.axes.values()}
    for name, state in _states(world).items():
        for axis in state.axes:
            if (name, axis.name) not in driven and (axis.position or axis.enabled):
                out(f"{f'{name}.{axis.name}':<10} {axis.position or 0.0:12.4f} {axis.unit}")
    ended = "" if outcome.reason is None else f", ended by: {outcome.reason}"
    begun = f", from {outcome.began / SECOND:g} s on" if outcome.began else ""
    out(f"{world.time:g} s of {world.spec.name}{begun} in {outcome.wall_s:.2f} s{ended}")
    for verdict in outcome.verdicts:
        out(_verdict_text(verdict))
    for name, value in outcome.measures.items():
        out(f"{name}: {value:g}{'' if name.endswith(' cycles') else ' s'}")
    _print_failures(world, out)
    for late in world.overdue:
        out(f"warning: at {late.time / SECOND:g} s {late.value}")
    if world.overdue.more:
        out(f"warning: {world.overdue.more} more of these")
    if outcome.in_vain is not None:
        time = f"{(world.now - outcome.began) / SECOND:g} s"
        out(f"warning: waited {time} in vain for {world.told(outcome.in_vain)}")
    if outcome.reason is None or world.failures or world.overdue:
        _print_unfinished(world, pins, selection, out)
    for path in outcome.written:
        out(f"wrote {path}")
    out(f"digest {outcome.digest}")


def _verdict_text(verdict: Verdict) -> str:
    if verdict.holds:
        return f"property holds, robustness {verdict.robustness:.4g}: {verdict.name}"
    at = "" if verdict.at_ns is None else f" at {verdict.at_ns / SECOND:.9g} s"
    return f"property violated{at}, robustness {verdict.robustness:.4g}: {verdict.name}: {verdict.why}"


def _print_unfinished(world: World, pins: Counter[str], selection: Selection, out: Print) -> None:
    """Print what stands still: usually that is why something did not happen."""
    found = [*unfinished(world), *without_program(world)]
    stand = [one for one in found if one.who not in world.controllers or selection.takes_of(one.who)]
    for one in stand[:MOST_STANDING]:
        out(str(one))
    if len(stand) > MOST_STANDING:
        out(f"{len(stand) - MOST_STANDING} more stand still")
    unchanged = [pin for pin in unchanged_inputs(world, pins) if selection.takes_of(pin.partition(".")[0])]
    if unchanged:
        shown = ", ".join(unchanged[:MOST_STANDING])
        more = f" and {len(unchanged) - MOST_STANDING} more" if len(unchanged) > MOST_STANDING else ""
        out(f"inputs that never changed: {shown}{more}")


def _states(world: World) -> dict[str, ControllerState]:
    return {name: world.state_of(name) for name in world.controllers}


def _json(world: World, outcome: WorldRunResult, out: Print) -> None:
    data: dict[str, Any] = {
        "version": JSON_VERSION,
        "world": world.spec.name,
        "from_s": outcome.began / SECOND,
        "time_s": world.time,
        "wall_s": round(outcome.wall_s, 3),
        "ended_by": outcome.reason,
        "in_vain": outcome.in_vain,
        "failures": [
            {"time_s": f.time / SECOND, "condition": str(f.value).partition(INSTEAD)[0], "what": f.value} for f in world.failures
        ],
        "properties": [
            {
                "property": one.name,
                "holds": one.holds,
                "robustness": one.robustness,
                "time_s": None if one.at_ns is None else one.at_ns / SECOND,
                "why": one.why,
            }
            for one in outcome.verdicts
        ],
        "measures": outcome.measures,
        "waiting": [one._asdict() for one in unfinished(world)],
        "overdue": [{"time_s": late.time / SECOND, "what": late.value} for late in world.overdue],
        "axes": {
            name: {"position": axis.position, "unit": axis.unit, "lost_pulses": axis.lost, "stalled": axis.stalled}
            for name, axis in world.axis.items()
        },
        "controllers": {name: to_json(state) for name, state in _states(world).items()},
        "files": [str(path) for path in outcome.written],
        "digest": outcome.digest,
    }
    out(json.dumps(data, ensure_ascii=False, indent=2))


def replay(path: Path, trace: Path | None, out: Print, warn: Print, *, as_json: bool = False) -> bool:
    """Run a recording again. Returns whether the result was the same. Raises `Misuse` for a file that is not a recording."""
    recording = recordings.load(path)
    recorder = SceneRecorder()
    world = recording.replay(begun=recorder.follow if trace is not None else lambda world: None)
    digest = world.trace.digest()
    is_same = digest == recording.digest
    written = [] if trace is None else _write_trace(world, trace, recorder, warn)
    if as_json:
        data = {
            "same": is_same,
            "digest": digest,
            "recorded_digest": recording.digest,
            "recorded_by": recording.version,
            "world": world.spec.name,
            "time_s": world.time,
            "inputs": len(recording.inputs),
            "files": [str(each) for each in written],
        }
        out(json.dumps(data, ensure_ascii=False, indent=2))
        return is_same
    for each in written:
        out(f"wrote {each}")
    if is_same:
        out(f"{world.time:g} s of {world.spec.name}, {len(recording.inputs)} inputs: the same, digest {digest}")
    else:
        recorded = f"recorded {recording.digest} (steptwin {recording.version})"
        warn(f"{path}: the run differs from the recorded one: digest {digest}, {recorded}")
    return is_same
