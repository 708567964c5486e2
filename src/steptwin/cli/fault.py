"""``steptwin fault``: faults of a running twin.

From Python: `steptwin.simulation.faults`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from steptwin.cli import completion
from steptwin.cli.device import Json, Twin
from steptwin.cli.pages import PageFormat, PageSection, show
from steptwin.cli.selected import selected
from steptwin.errors import Misuse

if TYPE_CHECKING:
    from steptwin.simulation.faults.table import Parameter


def command(
    words: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="KIND NAME=VALUE",
            help="Such as crc nth=3. Without arguments the present faults are shown.",
            autocompletion=completion.faults,
        ),
    ] = None,
    clear: Annotated[list[str] | None, typer.Option(help="Remove the fault of this name; repeatable.")] = None,
    clear_all: Annotated[bool, typer.Option("--clear-all", help="Remove all faults.")] = False,
    kinds: Annotated[bool, typer.Option("--kinds", help="Show all kinds of faults and what they take.")] = False,
    form: Annotated[PageFormat, typer.Option("--format", help="How to print the kinds.")] = PageFormat.TEXT,
    twin: Twin = None,
    json: Json = False,
) -> None:
    """Set, clear or show the faults of a running twin."""
    if kinds:
        show(sections(), form)
        return
    if clear and clear_all:
        raise Misuse("--clear and --clear-all exclude each other")
    from steptwin.simulation.faults import read
    from steptwin.simulation.script.steps import ClearFault, SetFault
    from steptwin.subject.commands import ListFaults

    wanted = read(" ".join(words)) if words else None
    with selected(twin) as twin_:
        unwanted = [active["name"] for active in twin_.do(ListFaults())] if clear_all else list(dict.fromkeys(clear or []))
        for name in unwanted:
            twin_.do(ClearFault(name))
        if wanted is not None:
            twin_.do(SetFault(wanted))
        there = twin_.do(ListFaults())
    if json:
        import json as json_

        typer.echo(json_.dumps(there, indent=2))
    elif there:
        width = max(len(active["name"]) for active in there)
        for active in there:
            typer.echo(f"{active['name']:<{width}}  {active['fault']}  (acted {_times(active['acted'])})")
    else:
        typer.echo("no faults")


def sections() -> list[PageSection]:
    """The table of faults for people."""
    from steptwin.simulation.components.registry import failing, fault_kinds
    from steptwin.simulation.faults.kinds import shared
    from steptwin.simulation.faults.table import Layer

    def described(parameter: Parameter) -> str:
        default = "required" if parameter.is_required else _else(parameter)
        return (
            f"{parameter.name} ({parameter.permitted}; {'' if parameter.is_required else 'else '}{default}): {parameter.meaning}"
        )

    found = []
    for layer in Layer:
        table = [
            (
                kind.name,
                kind.meaning,
                ", ".join(failing(kind) or (line.value for line in kind.lines)) or "controllers",
                kind.occasion.value,
                " ".join(described(parameter) for parameter in kind.own),
            )
            for kind in fault_kinds().values()
            if kind.layer is layer
        ]
        heads = ("kind", "what happens", "on", "at each", "its own parameters")
        found.append(PageSection(f"Faults of {layer.value}", heads, table))
    common = [(parameter.name, parameter.meaning, parameter.permitted, _else(parameter), of) for parameter, of in shared()]
    found.append(PageSection("Where and when", ("parameter", "meaning", "permitted", "else", "of"), common))
    return found


def _else(parameter: Parameter) -> str:
    """The value if it is not given."""
    default = parameter.default
    return parameter.otherwise or (f"{default:g}" if isinstance(default, float) else f"{default}")


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"
