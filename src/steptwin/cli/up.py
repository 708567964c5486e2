"""``steptwin up``: a world in real time. Exit code 1 if an expectation of its scripts did not hold.

From Python: `steptwin.files.world.World`, which runs in virtual time.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from steptwin.cli.commands import Format, Section, show
from steptwin.errors import Misuse
from steptwin.machine import MILLISECOND

if TYPE_CHECKING:
    from steptwin.world.reader import Key


def up(
    world: Annotated[
        Path | None,
        typer.Argument(metavar="[MACHINE.toml]", help="The description of the world, or a session (.json) to go on from."),
    ] = None,
    speed: Annotated[
        str,
        typer.Option(
            help="Virtual seconds in a second: 0.1, 1, 10; 'max' for worlds without clients outside; 0: paused at first."
        ),
    ] = "1",
    name: Annotated[
        str | None, typer.Option(help="Name under which 'steptwin pin' and its like find it. Default: that of the file.")
    ] = None,
    session: Annotated[Path | None, typer.Option(help="Write a session for 'steptwin replay' when it ends.")] = None,
    trace: Annotated[Path | None, typer.Option(help="Write what happened to a file or into a directory when it ends.")] = None,
    fault: Annotated[
        list[str] | None,
        typer.Option(help="What goes wrong, such as 'crc nth=3'; repeatable. See steptwin fault --kinds."),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Where all chance comes from. Default: what the description says.")] = None,
    begin: Annotated[
        str | None,
        typer.Option("--from", metavar="TIME", help="Session: go on from this moment, such as 2.5s. Default: its end."),
    ] = None,
    ready_file: Annotated[Path | None, typer.Option(help="JSON file with the end points, written once they listen.")] = None,
    listen_any: Annotated[bool, typer.Option("--listen-any", help="Permit addresses that others can reach.")] = False,
    log_frames: Annotated[
        bool, typer.Option("--log-frames", help="Print what goes over every line with time, direction, bytes and meaning.")
    ] = False,
    strict: Annotated[bool, typer.Option("--strict", help="Exit code 1 also for what was waited for in vain.")] = False,
    allow_outside: Annotated[
        bool, typer.Option("--allow-outside", help="Permit files that do not lie beside the description or below.")
    ] = False,
    keys: Annotated[bool, typer.Option("--keys", help="Show what a description may say.")] = False,
    form: Annotated[Format, typer.Option("--format", help="How to print the keys.")] = Format.TEXT,
) -> None:
    """Run a world in real time until Ctrl-C or until one of its scripts stops it; other programs connect to its lines.

    'steptwin pause', 'step', 'resume' and 'save' control its time.
    """
    if keys:
        show(sections(), form)
        return
    if world is None:
        raise Misuse("which world? give the TOML file that describes it")
    from steptwin.commands.up_world import UpOptions
    from steptwin.commands.up_world import up as run_up
    from steptwin.files.timedinputs import parse_duration

    options = UpOptions(
        world=world,
        moment=None if begin is None else parse_duration(begin, "--from"),
        seed=seed,
        speed=speed,
        name=name,
        session=session,
        trace=trace,
        faults=tuple(fault or ()),
        ready_file=ready_file,
        listen_any=listen_any,
        log_frames=log_frames,
        strict=strict,
        allow_outside=allow_outside,
    )
    if not run_up(options):
        raise typer.Exit(1)


def sections() -> list[Section]:
    """The tables of a description, for people."""
    from steptwin.world.script import ACTIONS, REPEAT, STEPS
    from steptwin.world.tables import KEYS, TABLES

    found = [
        Section(
            TABLES[name],
            ("key", "meaning", "default"),
            [(key.name, key.meaning, "required" if key.is_required else _default(key)) for key in keys],
        )
        for name, keys in KEYS.items()
    ]
    steps = [
        (action.main.name, action.main.meaning, ", ".join(f"{key.name}: {key.meaning}" for key in action.others))
        for action in ACTIONS.values()
    ]
    steps.append((REPEAT.name, REPEAT.meaning, f"{STEPS.name}: {STEPS.meaning}"))
    return [*found, Section("Steps of events and scripts", ("first key", "meaning", "more keys"), steps)]


def _default(key: Key) -> str:
    from steptwin.world.reader import positive_time, time_value

    value = key.default
    if value is None or value == ():
        return ""
    if value and key.read in (positive_time, time_value):
        return f"{value / MILLISECOND:g} ms"
    return str(value).lower() if isinstance(value, bool) else str(value)
