"""``steptwin pin``, ``encoder``, ``power-cycle``, ``state``: the inputs, power and state of a running twin.

From Python: `steptwin.live.remote.RemoteSubject`.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Annotated

import typer

from steptwin.cli import completion
from steptwin.cli.selected import Selected, levels_of, selected
from steptwin.errors import Misuse

if TYPE_CHECKING:
    from steptwin.subject.commands import Command

Twin = Annotated[
    str | None,
    typer.Option(
        "--device",
        "-d",
        metavar="TWIN",
        help="A running twin: mic488, machine.table (a controller of it), its file or address. Default: the only one running.",
        autocompletion=completion.devices,
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON.")]


def pin(
    changes: Annotated[
        list[str] | None,
        typer.Argument(help="IN3=1 AIN1=4.2 ...; without any, all pins are shown.", autocompletion=completion.pins),
    ] = None,
    twin: Twin = None,
    json: Json = False,
) -> None:
    """Set inputs of a running twin, press or release its buttons, or show all pins."""
    from steptwin.numerals import read_number

    wanted: dict[str, float] = {}
    for change in changes or []:
        name, equals, value = change.partition("=")
        if not equals:
            raise Misuse(f"{change!r}: expected PIN=VALUE, such as IN3=1 or AIN1=4.2")
        try:
            wanted[name.strip().upper()] = read_number(value)
        except Misuse as error:
            raise Misuse(f"{change!r}: {error}") from None
    with selected(twin) as there:
        for command in _changes(there, wanted):
            there.do(command)
        pins = levels_of(there) if json or not wanted else {}
    if json:
        _print_json(pins)
    elif pins:
        typer.echo("\n".join(f"{name:<6} {value:g}" for name, value in pins.items()))


def _changes(there: Selected, wanted: dict[str, float]) -> list[Command]:
    """The commands for pins and buttons: one for all pins, then one for each button."""
    from steptwin.world.script import Press, Release, Set

    levels: list[tuple[str, str, float]] = []
    buttons: list[Command] = []
    known = {button.upper(): button for button in there.subject.description.buttons}
    for name, level in wanted.items():
        owner, dot, pin = name.rpartition(".")
        button = None if dot else known.get(name)
        if button is None:
            levels.append((there.called(owner) if dot else _owner(there, name), pin, level))
        elif level not in (0, 1):
            raise Misuse(f"{button} = {level:g}: a button takes 1 (pressed) and 0 (released)")
        else:
            buttons.append(Press(button) if level else Release(button))
    return [*([Set(tuple(levels))] if levels else []), *buttons]


def _owner(there: Selected, pin: str) -> str:
    if len(there.shown) == 1:
        return there.one()
    buttons = ", ".join(there.subject.description.buttons) or "none"
    raise Misuse(f"{pin}: give a pin as CONTROLLER.PIN; controllers are {', '.join(there.controllers)}; buttons are {buttons}")


def encoder(
    changes: Annotated[
        list[str] | None,
        typer.Argument(help="M1+40 or M1-40 turns the shaft by counts; M1=drive, M1=free, M1=blocked selects what turns it."),
    ] = None,
    twin: Twin = None,
    json: Json = False,
) -> None:
    """Turn, couple or block the encoder shafts of a running twin, or show them."""
    wanted: dict[int, int | str] = {}
    for change in changes or []:
        match = re.fullmatch(r"(?ai)M([1-9]\d{0,8})(?:([+-]\d{1,18})|=(\w+))", change.strip())
        if match is None:
            raise Misuse(f"{change!r}: expected M1+40, M1-40, M1=drive, M1=free or M1=blocked")
        wanted[int(match[1])] = int(match[2]) if match[2] else match[3].lower()
    from steptwin.subject.commands import Encoders
    from steptwin.world.script import Couple, Turn

    with selected(twin) as there:
        machine = there.one()
        for axis, change in wanted.items():
            there.do(Turn(machine, axis, change) if isinstance(change, int) else Couple(machine, axis, change))
        shafts = there.do(Encoders(machine))
    if json:
        _print_json(shafts)
    else:
        typer.echo("\n".join(f"M{s['axis']}  {s['counts']:>10} counts, turned by: {s['turned_by']}" for s in shafts))


def power_cycle(twin: Twin = None) -> None:
    """Switch a running twin off and on again."""
    from steptwin.world.script import PowerCycle

    with selected(twin) as there:
        for machine in there.shown:
            there.do(PowerCycle(machine))


def state(twin: Twin = None, json: Json = False) -> None:
    """Show the state of a running twin."""
    from steptwin.subject.commands import ReadState

    with selected(twin) as there:
        name = there.one()
        found = there.do(ReadState(name))
    if json:
        _print_json(found)
        return
    from steptwin.commands.state_text import lines
    from steptwin.controllerstate import read_state

    typer.echo("\n".join(lines(read_state(found), there.sheet(name))))


def _print_json(value: object) -> None:
    import json

    typer.echo(json.dumps(value, indent=2))
