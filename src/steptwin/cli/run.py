"""``steptwin run``: run a program or a world in virtual time. Exit code 1 if something in it failed.

From Python: `steptwin.commands.run_m1486.run` and its neighbours.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from steptwin.cli import completion
from steptwin.cli.device import Json, complain
from steptwin.cli.optiongroups import OptionGroup, grouped
from steptwin.cli.worldoptions import Coverage, ShownOptions, WorldRunOptions
from steptwin.errors import Misuse

if TYPE_CHECKING:
    from steptwin.files.timedinputs import TimedInput
    from steptwin.machine import Nanos

File = Annotated[Path, typer.Argument(help="File to run: a program (.prg, .wbc, .m1486), a world (.toml) or a session (.json).")]
Duration = Annotated[
    str | None,
    typer.Option("--for", metavar="TIME", help="Longest virtual time to run, such as 10s. Default 60s; 1h with --until."),
]
Until = Annotated[
    str | None,
    typer.Option(
        metavar="idle", help="'idle': end as soon as only an input could cause anything further. A world: any condition."
    ),
]
Inputs = Annotated[
    list[str] | None,
    typer.Option("--input", metavar="PIN=VALUE@TIME,...", help="Changes of inputs: B3=0@1.5s,B3=1@2s. 7.B3 selects the chip."),
]
Questions = Annotated[
    list[str] | None,
    typer.Option(metavar="QUESTION", help="Ask why something is as it is at the end, as 'steptwin why' does; repeatable."),
]
Properties = Annotated[
    list[str] | None,
    typer.Option(
        "--property",
        metavar="PROPERTY",
        help="A property that must hold, such as 'never guard.open and table.M1.moving'; exit code 1 if not; repeatable. Worlds.",
    ),
]
Trace = Annotated[Path | None, typer.Option(help="Write a trace to a file (.jsonl, .html, .vcd, .csv, ...) or into a directory.")]


@dataclass(frozen=True, kw_only=True)
class ProgramOptions(OptionGroup):
    heading = "Options of programs"

    print_world: Annotated[
        bool, typer.Option("--print-world", help="Print the description of the world the program would run in, and end.")
    ] = False


@dataclass(frozen=True, kw_only=True)
class WbcOptions(OptionGroup):
    heading = "Options of MIC488 programs"

    positions: Annotated[Path | None, typer.Option(help="Position table. Default: the .csv of the same name.")] = None
    config: Annotated[Path | None, typer.Option(help="Configuration. Default: the .cfg of the same name.")] = None
    firmware: Annotated[
        str | None, typer.Option(help="1.23, 1.40 or 1.70. Default 1.70.", autocompletion=completion.firmwares)
    ] = None
    travel: Annotated[
        list[str] | None,
        typer.Option(
            metavar="Mn=LOW..HIGH,...",
            help="Positions of the switches KL and KR, relative to the position at power-on: M1=-10..250, M1=-50.. or M1=..250.",
        ),
    ] = None
    statement_time: Annotated[
        str | None, typer.Option(metavar="TIME", help="Execution time of a statement. Default 1ms; 0 for none.")
    ] = None


@dataclass(frozen=True, kw_only=True)
class ChipProgramOptions(OptionGroup):
    heading = "Options of M1486 programs"

    variant: Annotated[
        str | None,
        typer.Option(help="Type A, B, C, E1, E2, or A2x and so on. Default A.", autocompletion=completion.variants),
    ] = None
    interface: Annotated[str | None, typer.Option(help="Driver interface sd, dual or two. Default sd.")] = None
    wire: Annotated[
        list[str] | None, typer.Option(help="Wire from a pin of one chip to an input of another, 0.B1=7.B3; repeatable.")
    ] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class _RunOptions:
    """What applies to every file, and the groups of options of which a file has some. None: not given."""

    limit: Nanos | None
    until: str | None
    inputs: tuple[TimedInput, ...]
    trace: Path | None
    coverage: tuple[str, ...]
    questions: tuple[str, ...]
    properties: tuple[str, ...]
    as_json: bool
    program: ProgramOptions
    wbc: WbcOptions
    chip: ChipProgramOptions
    world: WorldRunOptions
    shown: ShownOptions

    def until_idle(self) -> bool:
        """Of a program. Raises `Misuse` for a condition, which only a world has."""
        if self.until not in (None, "idle"):
            raise Misuse(f"--until {self.until}: permitted is 'idle'")
        return self.until is not None


@grouped
def run(
    file: File,
    duration: Duration = None,
    until: Until = None,
    inputs: Inputs = None,
    trace: Trace = None,
    coverage: Coverage = None,
    why: Questions = None,
    properties: Properties = None,
    json: Json = False,
    *,
    program: ProgramOptions,
    wbc: WbcOptions,
    chip: ChipProgramOptions,
    world: WorldRunOptions,
    shown: ShownOptions,
) -> None:
    """Run a program or a world in virtual time and print its moves, waits, outputs and uploads. A session is continued."""
    from steptwin.files.timedinputs import parse_duration, parse_inputs

    runner = _RUNNERS.get(file.suffix.lower())
    if runner is None:
        raise Misuse(f"{file}: unknown suffix: permitted are {', '.join(_RUNNERS)}")
    limit = None if duration is None else parse_duration(duration, "--for")
    if limit == 0:
        raise Misuse(f"--for {duration}: must be more than 0")
    _check_targets(trace, world.session)
    if json and "-" in (coverage or ()):
        raise Misuse("--coverage - and --json both print on standard output: give a file, such as --coverage coverage.json")
    if json and why:
        raise Misuse("--why and --json both print on standard output: ask 'steptwin why' about a --session instead")
    changes = parse_inputs(",".join(inputs or []))
    wanted = _RunOptions(
        limit=limit,
        until=until,
        inputs=tuple(changes),
        trace=trace,
        coverage=tuple(coverage or ()),
        questions=tuple(why or ()),
        properties=tuple(properties or ()),
        as_json=json,
        program=program,
        wbc=wbc,
        chip=chip,
        world=world,
        shown=shown,
    )
    if wanted.properties and runner is not _run_world:
        raise Misuse(f"--property is for worlds: {file} is a program")
    if not runner(file, wanted):
        raise typer.Exit(1)


def _check_targets(trace: Path | None, session: Path | None) -> None:
    """Raises `Misuse` if a file cannot be written, before the run begins."""
    if trace is not None:
        from steptwin.files.export import check_target

        check_target(trace)
    if session is not None:
        from steptwin.files.beginning import check_session_target

        check_session_target(session)


def _run_m1486(file: Path, given: _RunOptions) -> bool:
    from steptwin.commands.run_m1486 import M1486Run
    from steptwin.commands.run_m1486 import run as run_program
    from steptwin.m1486.variants import DEFAULT

    for group in (given.wbc, given.world, given.shown):
        group.refuse("M1486 programs")
    wanted = M1486Run(
        program=file,
        variant=given.chip.variant or DEFAULT.name,
        interface=given.chip.interface or "sd",
        wires=tuple(given.chip.wire or ()),
        limit=given.limit,
        until_idle=given.until_idle(),
        inputs=given.inputs,
        trace=given.trace,
        coverage=given.coverage,
        questions=given.questions,
        as_json=given.as_json,
        print_world=given.program.print_world,
    )
    return run_program(wanted, typer.echo, complain)


def _run_wbc(file: Path, given: _RunOptions) -> bool:
    from steptwin.commands.run_wbc import WbcRun
    from steptwin.commands.run_wbc import run as run_program
    from steptwin.commands.travels import parse_travel
    from steptwin.files.timedinputs import parse_duration
    from steptwin.wbc.dialect import DEFAULT

    for group in (given.chip, given.world, given.shown):
        group.refuse("WBC programs")
    wanted = WbcRun(
        program=file,
        positions=given.wbc.positions,
        config=given.wbc.config,
        firmware=given.wbc.firmware or DEFAULT.firmware,
        statement_time=parse_duration(given.wbc.statement_time or "1ms", "--statement-time"),
        travels=parse_travel(",".join(given.wbc.travel or [])),
        limit=given.limit,
        until_idle=given.until_idle(),
        inputs=given.inputs,
        trace=given.trace,
        coverage=given.coverage,
        questions=given.questions,
        as_json=given.as_json,
        print_world=given.program.print_world,
    )
    return run_program(wanted, typer.echo, complain)


def _run_world(file: Path, given: _RunOptions) -> bool:
    from steptwin.commands.run_world import WorldRun
    from steptwin.commands.run_world import run as run_world

    for group in (given.wbc, given.chip, given.program):
        group.refuse("worlds, whose file has these settings")
    wanted = WorldRun(
        world=file,
        moment=given.world.moment,
        seed=given.world.seed,
        overrides=given.world.overrides,
        state=given.world.state,
        limit=given.limit,
        until=given.until,
        inputs=given.inputs,
        faults=tuple(given.world.fault or ()),
        trace=given.trace,
        coverage=given.coverage,
        questions=given.questions,
        properties=given.properties,
        session=given.world.session,
        allow_outside=given.world.allow_outside,
        strict=given.world.strict,
        as_json=given.as_json,
        names=tuple(given.shown.of or ()),
        kinds=tuple(given.shown.show or ()),
    )
    return run_world(wanted, typer.echo, complain)


#: What runs each kind of file; True when nothing went wrong.
_RUNNERS: dict[str, Callable[[Path, _RunOptions], bool]] = {
    ".m1486": _run_m1486,
    ".prg": _run_wbc,
    ".wbc": _run_wbc,
    ".toml": _run_world,
    ".json": _run_world,
}
