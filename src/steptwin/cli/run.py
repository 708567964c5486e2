"""``steptwin run``: run a program or a world in virtual time. Exit code 1 if something in it failed.

From Python: `steptwin.languages.run_m1486.run` and its neighbours.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypedDict

import typer

from steptwin.cli.device import Json, complain
from steptwin.cli.languageoptions import M1486FileOptions, WbcFileOptions, given_of
from steptwin.cli.optiongroups import grouped
from steptwin.cli.writtenfiles import written
from steptwin.errors import Misuse
from steptwin.files.worldoptions import Coverage, ShownOptions, WorldRunOptions
from steptwin.options import Option, OptionGroup, option_of

if TYPE_CHECKING:
    from steptwin.controller import Nanos
    from steptwin.files.timedinputs import TimedInput

WORLDS = (".toml", ".json")
"""Suffixes of worlds and recordings; all other files are programs (`steptwin.languages`)."""

File = Annotated[
    Path, typer.Argument(help="File to run: a program (.prg, .wbc, .m1486), a world (.toml) or a recording (.json).")
]
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
Trace = Annotated[Path | None, written(help="Write a trace to a file (.jsonl, .html, .vcd, .csv, ...) or into a directory.")]


@dataclass(frozen=True, kw_only=True)
class ProgramOptions(OptionGroup):
    heading = "Options of programs"

    print_world: Annotated[bool, Option("Print the description of the world the program would run in, and end.")] = False


@dataclass(frozen=True, kw_only=True)
class WbcRunOptions(WbcFileOptions):
    travel: Annotated[
        tuple[str, ...],
        Option(
            metavar="Mn=LOW..HIGH,...",
            help="Positions of the switches KL and KR, relative to the position at power-on: M1=-10..250, M1=-50.. or M1=..250.",
        ),
    ] = ()
    statement_time: Annotated[
        str | None, Option(metavar="TIME", help="Execution time of a statement. Default 1ms; 0 for none.")
    ] = None


@dataclass(frozen=True, kw_only=True)
class M1486RunOptions(M1486FileOptions):
    wire: Annotated[tuple[str, ...], Option("Wire from a pin of one chip to an input of another, 0.B1=7.B3; repeatable.")] = ()


class _CommonOptions(TypedDict):
    """Those of programs and worlds."""

    limit: Nanos | None
    inputs: Sequence[TimedInput]
    trace: Path | None
    coverage: Sequence[str]
    questions: Sequence[str]
    as_json: bool


@grouped
def command(
    file: File,
    duration: Duration = None,
    until: Until = None,
    inputs: Inputs = None,
    trace: Trace = None,
    coverage: Coverage = (),
    why: Questions = None,
    properties: Properties = None,
    json: Json = False,
    *,
    program: ProgramOptions,
    wbc: WbcRunOptions,
    chip: M1486RunOptions,
    world: WorldRunOptions,
    shown: ShownOptions,
) -> None:
    """Run a program or a world in virtual time and print its moves, waits, outputs and uploads. A recording is continued."""
    from steptwin.files.timedinputs import parse_duration, parse_inputs

    run_program = None if file.suffix.lower() in WORLDS else _program_runner(file)
    limit = None if duration is None else parse_duration(duration, "--for")
    if limit == 0:
        raise Misuse(f"--for {duration}: must be more than 0")
    _check_targets(trace, world.session)
    if json and "-" in coverage:
        raise Misuse("--coverage - and --json both print on standard output: give a file, such as --coverage coverage.json")
    if json and why:
        raise Misuse("--why and --json both print on standard output: ask 'steptwin why' about a --session instead")
    changes = parse_inputs(",".join(inputs or []))
    if properties and run_program is not None:
        raise Misuse(f"--property is for worlds: {file} is a program")
    common = _CommonOptions(
        limit=limit,
        inputs=tuple(changes),
        trace=trace,
        coverage=coverage,
        questions=tuple(why or ()),
        as_json=json,
    )
    if run_program is not None:
        went_well = run_program(common, until, program, given_of(wbc, chip, world, shown))
    else:
        for group in (wbc, chip, program):
            group.refuse("worlds, whose file has these settings")
        went_well = _run_world(file, common, until, properties or (), world, shown)
    if not went_well:
        raise typer.Exit(1)


def _check_targets(trace: Path | None, recording: Path | None) -> None:
    """Raises `Misuse` if a file cannot be written, before the run begins."""
    if trace is not None:
        from steptwin.files.export import check_target

        check_target(trace)
    if recording is not None:
        from steptwin.files.loader import check_recording_target

        check_recording_target(recording)


def _program_runner(
    file: Path,
) -> Callable[[_CommonOptions, str | None, ProgramOptions, Mapping[str, Any]], bool]:
    """Function that runs a program. Raises `Misuse` for what is none."""
    from steptwin.languages import LANGUAGES, by_suffix
    from steptwin.languages.contract import FileLanguage
    from steptwin.languages.program_run import ProgramRun

    language = by_suffix(file)
    if language is None or not language.offers(FileLanguage.run):
        suffixes = [suffix for one in LANGUAGES.values() if one.offers(FileLanguage.run) for suffix in one.suffixes]
        raise Misuse(f"{file}: unknown suffix: permitted are {', '.join((*suffixes, *WORLDS))}")

    def run_program(common: _CommonOptions, until: str | None, program: ProgramOptions, given: Mapping[str, Any]) -> bool:
        language.refuse_others(given, option_of)
        if until not in (None, "idle"):
            raise Misuse(f"--until {until}: permitted is 'idle'")
        wanted = ProgramRun(program=file, until_idle=until is not None, print_world=program.print_world, **common)
        return language.run(wanted, given, typer.echo, complain)

    return run_program


def _run_world(
    file: Path,
    common: _CommonOptions,
    until: str | None,
    properties: Sequence[str],
    world: WorldRunOptions,
    shown: ShownOptions,
) -> bool:
    from steptwin.languages.run_world import WorldRun
    from steptwin.languages.run_world import run as run_world

    wanted = WorldRun(world=file, run=world, shown=shown, until=until, properties=properties, **common)
    return run_world(wanted, typer.echo, complain)
