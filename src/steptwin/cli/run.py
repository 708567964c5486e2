"""``steptwin run``: run a program in virtual time. Exit code 1 if something in it failed.

From Python: `steptwin.commands.run_m1486.run` and its neighbours.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from steptwin.cli import completion
from steptwin.errors import Misuse

if TYPE_CHECKING:
    from steptwin.files.timedinputs import TimedInput
    from steptwin.machine import Nanos


_NAMES = {"moment": "from"}
"""Options whose names are not names in Python."""


@dataclass(frozen=True)
class RunOptions:
    """The options of the command line; None: not given."""

    limit: Nanos | None
    until: str | None
    inputs: list[TimedInput]
    trace: Path | None
    as_json: bool
    variant: str | None = None
    interface: str | None = None
    wire: list[str] | None = None
    positions: Path | None = None
    config: Path | None = None
    firmware: str | None = None
    travel: list[str] | None = None
    statement_time: str | None = None
    fault: list[str] | None = None
    session: Path | None = None
    seed: int | None = None
    state: Path | None = None
    moment: Nanos | None = None
    allow_outside: bool | None = None
    strict: bool | None = None
    print_world: bool | None = None

    @property
    def until_idle(self) -> bool:
        return self.until == "idle"

    def refuse(self, files: str, *names: str) -> None:
        """Raises `Misuse` if one of these options was given, which do not apply to such files."""
        for name in names:
            if getattr(self, name) not in (None, []):
                raise Misuse(f"--{_NAMES.get(name, name).replace('_', '-')} is not for {files}")


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
Trace = Annotated[Path | None, typer.Option(help="Write a trace to a file (.jsonl, .html, .vcd, .csv, ...) or into a directory.")]
Variant = Annotated[
    str | None,
    typer.Option(help="M1486: type A, B, C, E1, E2, or A2x and so on. Default A.", autocompletion=completion.variants),
]
Wire = Annotated[
    list[str] | None, typer.Option(help="M1486: wire from a pin of one chip to an input of another, 0.B1=7.B3; repeatable.")
]
Firmware = Annotated[
    str | None, typer.Option(help="MIC488: 1.23, 1.40 or 1.70. Default 1.70.", autocompletion=completion.firmwares)
]
Travel = Annotated[
    list[str] | None,
    typer.Option(
        metavar="Mn=LOW..HIGH,...",
        help="MIC488: positions of the switches KL and KR, relative to the position at power-on: M1=-10..250, M1=-50.. or "
        "M1=..250.",
    ),
]
StatementTime = Annotated[
    str | None, typer.Option(metavar="TIME", help="MIC488: execution time of a statement. Default 1ms; 0 for none.")
]
Fault = Annotated[
    list[str] | None,
    typer.Option(help="World: fault active from the start, such as 'crc nth=3'; repeatable. See steptwin fault --kinds."),
]
State = Annotated[
    Path | None,
    typer.Option(metavar="DIR", help="World: directory of the non-volatile memory. Default: that of its file, or none."),
]
Begin = Annotated[
    str | None,
    typer.Option("--from", metavar="TIME", help="Session: continue from this moment, such as 2.5s. Default: its end."),
]
PrintWorld = Annotated[
    bool, typer.Option("--print-world", help="Program: print the description of the world it would run in, and end.")
]
AllowOutside = Annotated[bool, typer.Option("--allow-outside", help="World: permit files outside the folder of its file.")]


def run(
    file: File,
    duration: Duration = None,
    until: Until = None,
    inputs: Inputs = None,
    trace: Trace = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
    variant: Variant = None,
    interface: Annotated[str | None, typer.Option(help="M1486: driver interface sd, dual or two. Default sd.")] = None,
    wire: Wire = None,
    positions: Annotated[Path | None, typer.Option(help="MIC488: position table. Default: the .csv of the same name.")] = None,
    config: Annotated[Path | None, typer.Option(help="MIC488: configuration. Default: the .cfg of the same name.")] = None,
    firmware: Firmware = None,
    travel: Travel = None,
    statement_time: StatementTime = None,
    fault: Fault = None,
    seed: Annotated[int | None, typer.Option(help="World: random seed. Default: that of its file.")] = None,
    state: State = None,
    session: Annotated[Path | None, typer.Option(help="World: write a session for 'steptwin replay'.")] = None,
    begin: Begin = None,
    strict: Annotated[bool, typer.Option("--strict", help="World: exit code 1 also for a wait that timed out.")] = False,
    print_world: PrintWorld = False,
    allow_outside: AllowOutside = False,
) -> None:
    """Run a program or a world in virtual time and print its moves, waits, outputs and uploads. A session is continued."""
    from steptwin.files.timedinputs import parse_duration, parse_inputs

    runner = _RUNNERS.get(file.suffix.lower())
    if runner is None:
        raise Misuse(f"{file}: unknown suffix: permitted are {', '.join(_RUNNERS)}")
    if until not in (None, "idle") and runner is not _run_world:
        raise Misuse(f"--until {until}: permitted is 'idle'")
    limit = None if duration is None else parse_duration(duration, "--for")
    if limit == 0:
        raise Misuse(f"--for {duration}: must be more than 0")
    _check_targets(trace, session)
    options = RunOptions(
        limit=limit,
        until=until,
        inputs=parse_inputs(",".join(inputs or [])),
        trace=trace,
        as_json=as_json,
        variant=variant,
        interface=interface,
        wire=wire,
        positions=positions,
        config=config,
        firmware=firmware,
        travel=travel,
        statement_time=statement_time,
        fault=fault,
        session=session,
        seed=seed,
        state=state,
        moment=None if begin is None else parse_duration(begin, "--from"),
        allow_outside=allow_outside or None,
        strict=strict or None,
        print_world=print_world or None,
    )
    if not runner(file, options):
        raise typer.Exit(1)


def _check_targets(trace: Path | None, session: Path | None) -> None:
    """Raises `Misuse` where nothing can be written, before anything runs."""
    if trace is not None:
        from steptwin.files.export import check_target

        check_target(trace)
    if session is not None:
        from steptwin.files.beginning import check_session_target

        check_session_target(session)


_WORLDS = ("fault", "session", "seed", "state", "moment", "allow_outside", "strict")
"""Options that apply to worlds only."""


def _run_m1486(file: Path, options: RunOptions) -> bool:
    from steptwin.commands.run_m1486 import M1486Run
    from steptwin.commands.run_m1486 import run as run_program
    from steptwin.m1486.variants import DEFAULT

    options.refuse("M1486 programs", "positions", "config", "firmware", "travel", "statement_time", *_WORLDS)
    wanted = M1486Run(
        program=file,
        variant=options.variant or DEFAULT.name,
        interface=options.interface or "sd",
        wires=tuple(options.wire or ()),
        limit=options.limit,
        until_idle=options.until_idle,
        inputs=tuple(options.inputs),
        trace=options.trace,
        as_json=options.as_json,
        print_world=bool(options.print_world),
    )
    return run_program(wanted, typer.echo, lambda text: typer.echo(text, err=True))


def _run_wbc(file: Path, options: RunOptions) -> bool:
    from steptwin.commands.run_wbc import WbcRun
    from steptwin.commands.run_wbc import run as run_program
    from steptwin.commands.travels import parse_travel
    from steptwin.files.timedinputs import parse_duration
    from steptwin.wbc.dialect import DEFAULT

    options.refuse("WBC programs", "variant", "interface", "wire", *_WORLDS)
    wanted = WbcRun(
        program=file,
        positions=options.positions,
        config=options.config,
        firmware=options.firmware or DEFAULT.firmware,
        statement_time=parse_duration(options.statement_time or "1ms", "--statement-time"),
        travels=parse_travel(",".join(options.travel or [])),
        limit=options.limit,
        until_idle=options.until_idle,
        inputs=tuple(options.inputs),
        trace=options.trace,
        as_json=options.as_json,
        print_world=bool(options.print_world),
    )
    return run_program(wanted, typer.echo, lambda text: typer.echo(text, err=True))


def _run_world(file: Path, options: RunOptions) -> bool:
    from steptwin.commands.run_world import WorldRun
    from steptwin.commands.run_world import run as run_world

    mechanics = ("positions", "config", "firmware", "travel", "statement_time", "variant", "interface", "wire", "print_world")
    options.refuse("worlds, whose file has these settings", *mechanics)
    wanted = WorldRun(
        world=file,
        moment=options.moment,
        seed=options.seed,
        state=options.state,
        limit=options.limit,
        until=options.until,
        inputs=tuple(options.inputs),
        faults=tuple(options.fault or ()),
        trace=options.trace,
        session=options.session,
        allow_outside=bool(options.allow_outside),
        strict=bool(options.strict),
        as_json=options.as_json,
    )
    return run_world(wanted, typer.echo, lambda text: typer.echo(text, err=True))


#: What runs each kind of file; True when nothing went wrong.
_RUNNERS: dict[str, Callable[[Path, RunOptions], bool]] = {
    ".m1486": _run_m1486,
    ".prg": _run_wbc,
    ".wbc": _run_wbc,
    ".toml": _run_world,
    ".json": _run_world,
}
