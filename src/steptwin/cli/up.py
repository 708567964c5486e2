"""``steptwin up``: a world in real time. Exit code 1 if an expectation of its scripts did not hold.

From Python: `steptwin.files.world.World`, which runs in virtual time.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from steptwin.cli.commands import PageFormat, PageSection, show
from steptwin.errors import Misuse
from steptwin.machine import MILLISECOND

if TYPE_CHECKING:
    from steptwin.world.reader import Key


def up(
    world: Annotated[
        Path | None,
        typer.Argument(metavar="MACHINE.toml", help="The description of the world, or a session (.json) to continue."),
    ] = None,
    speed: Annotated[
        str,
        typer.Option(help="Virtual seconds per second: 0.1, 1, 10; 'max' for worlds without external clients; 0 starts paused."),
    ] = "1",
    name: Annotated[str | None, typer.Option(help="Name by which --device finds it. Default: that of the file.")] = None,
    session: Annotated[Path | None, typer.Option(help="Write a session for 'steptwin replay' when it ends.")] = None,
    trace: Annotated[
        str | None,
        typer.Option(
            metavar="FILE",
            help="Write a trace to a file or into a directory; 'ring N' keeps the last N records for 'save'; 'off' keeps none. "
            "Default: that of the description.",
        ),
    ] = None,
    fault: Annotated[
        list[str] | None,
        typer.Option(help="Fault active from the start, such as 'crc nth=3'; repeatable. See steptwin fault --kinds."),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Random seed. Default: that of the description.")] = None,
    state: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Directory of the non-volatile memory. Default: that of the description, or none."),
    ] = None,
    begin: Annotated[
        str | None,
        typer.Option("--from", metavar="TIME", help="Session: continue from this moment, such as 2.5s. Default: its end."),
    ] = None,
    ready_file: Annotated[
        Path | None, typer.Option(help="JSON file with the end points, written when all of them are open.")
    ] = None,
    control: Annotated[
        str | None,
        typer.Option(metavar="HOST:PORT", help="Also open the control endpoint on this loopback TCP address."),
    ] = None,
    listen_any: Annotated[bool, typer.Option("--listen-any", help="Permit addresses that other computers can reach.")] = False,
    log_frames: Annotated[
        bool, typer.Option("--log-frames", help="Print the traffic of every line with time, direction, bytes and meaning.")
    ] = False,
    strict: Annotated[bool, typer.Option("--strict", help="Exit code 1 also for a wait that timed out.")] = False,
    allow_outside: Annotated[
        bool, typer.Option("--allow-outside", help="Permit files outside the folder of the description.")
    ] = False,
    keys: Annotated[bool, typer.Option("--keys", help="Show all keys of a description.")] = False,
    form: Annotated[PageFormat, typer.Option("--format", help="How to print the keys.")] = PageFormat.TEXT,
) -> None:
    """Run a world in real time until Ctrl-C or until one of its scripts stops it; other programs connect to its lines.

    'steptwin pause', 'step', 'resume' and 'save' control its time.
    """
    if keys:
        show(sections(), form)
        return
    if world is None:
        raise Misuse("a world is missing: give its description (.toml) or a session (.json)")
    from steptwin.commands.up_world import UpOptions
    from steptwin.commands.up_world import up as run_up
    from steptwin.files.timedinputs import parse_duration

    options = UpOptions(
        world=world,
        moment=None if begin is None else parse_duration(begin, "--from"),
        seed=seed,
        state=state,
        speed=speed,
        name=name,
        session=session,
        trace=trace,
        faults=tuple(fault or ()),
        ready_file=ready_file,
        control=control,
        listen_any=listen_any,
        log_frames=log_frames,
        strict=strict,
        allow_outside=allow_outside,
    )
    if not run_up(options):
        raise typer.Exit(1)


def sections() -> list[PageSection]:
    """The tables of a description, for people."""
    from steptwin.world.script import ACTIONS, REPEAT, STEPS
    from steptwin.world.tables import all_keys, written

    found = [
        PageSection(
            written(name),
            ("key", "meaning", "default"),
            [(key.name, key.meaning, "required" if key.is_required else _default(key)) for key in keys],
        )
        for name, keys in all_keys().items()
    ]
    steps = [
        (action.main.name, action.main.meaning, ", ".join(f"{key.name}: {key.meaning}" for key in action.others))
        for action in ACTIONS.values()
    ]
    steps.append((REPEAT.name, REPEAT.meaning, f"{STEPS.name}: {STEPS.meaning}"))
    return [*found, PageSection("Steps of events and scripts", ("first key", "meaning", "more keys"), steps)]


def _default(key: Key) -> str:
    from steptwin.world.values import positive_time, time_value

    value = key.default
    if value is None or value == ():
        return ""
    if value and key.read in (positive_time, time_value):
        return f"{value / MILLISECOND:g} ms"
    return str(value).lower() if isinstance(value, bool) else str(value)
