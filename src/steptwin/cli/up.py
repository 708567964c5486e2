"""``steptwin up``: a world in real time. Exit code 1 if an expectation of its scripts did not hold.

From Python: `steptwin.files.world.World`, which runs in virtual time.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from steptwin.cli.optiongroups import grouped
from steptwin.cli.pages import PageFormat, PageSection, show
from steptwin.controller import MILLISECOND
from steptwin.errors import Misuse
from steptwin.files.worldoptions import Coverage, ShownOptions, WorldRunOptions
from steptwin.live.options import AuditInto, LiveOptions, LogOptions, ReadyFile, UpOptions

if TYPE_CHECKING:
    from steptwin.simulation.toml.reader import Key


@grouped
def command(
    world: Annotated[
        Path | None,
        typer.Argument(metavar="MACHINE.toml", help="The description of the world, or a recording (.json) to continue."),
    ] = None,
    *,
    past: Annotated[bool, typer.Option("--past", help="Keep the past, as far as memory permits, for 'steptwin why'.")] = False,
    coverage: Coverage = (),
    ready_file: ReadyFile = None,
    audit: AuditInto = None,
    keys: Annotated[bool, typer.Option("--keys", help="Show all keys of a description.")] = False,
    form: Annotated[PageFormat, typer.Option("--format", help="How to print the keys.")] = PageFormat.TEXT,
    live: LiveOptions,
    options: WorldRunOptions,
    shown: ShownOptions,
    log: LogOptions,
) -> None:
    """Run a world in real time until Ctrl-C or until one of its scripts stops it; other programs connect to its lines.

    'steptwin pause', 'step', 'resume' and 'save' control its time.
    """
    if keys:
        show(sections(), form)
        return
    if world is None:
        raise Misuse("a world is missing: give its description (.toml) or a recording (.json)")
    from steptwin.files.auditfile import audit_into
    from steptwin.live.running import up as run_up

    with audit_into(audit) as commands:
        wanted = UpOptions(
            world=world,
            run=options,
            live=live,
            shown=shown,
            log=log,
            ready_file=ready_file,
            past=past,
            coverage=coverage,
            audit=commands,
        )
        if not run_up(wanted):
            raise typer.Exit(1)


def sections() -> list[PageSection]:
    """The tables of a description, for people."""
    import steptwin.services  # noqa: F401  their tables are among them
    from steptwin.simulation.describe.steptable import ACTIONS, REPEAT, STEPS
    from steptwin.simulation.describe.tables import written_tables

    found = [
        PageSection(
            name,
            ("key", "meaning", "permitted", "default"),
            [(key.name, key.meaning, key.permitted, "required" if key.is_required else _default(key)) for key in keys],
        )
        for name, keys in written_tables().items()
    ]
    steps = [
        (main.name, main.meaning, main.permitted, ", ".join(f"{key.name}: {key.meaning} ({key.permitted})" for key in others))
        for main, others in (*((action.main, action.others) for action in ACTIONS.values()), (REPEAT, (STEPS,)))
    ]
    return [*found, PageSection("Steps of events and scripts", ("first key", "meaning", "permitted", "more keys"), steps)]


def _default(key: Key) -> str:
    from steptwin.simulation.toml.values import positive_time, time_value, whole_seconds

    value = key.default
    if value is None or value == ():
        return ""
    if value and key.read in (positive_time, time_value, whole_seconds):
        return f"{value / MILLISECOND:g} ms"
    return str(value).lower() if isinstance(value, bool) else str(value)
