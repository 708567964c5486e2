"""``steptwin pin``: the inputs of a running twin.

From Python: `steptwin.live.remote.RemoteSubject`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from steptwin.cli import completion
from steptwin.cli.device import Json, Twin
from steptwin.cli.selected import Selected, levels_of, print_data, selected
from steptwin.errors import Misuse

if TYPE_CHECKING:
    from steptwin.subject.commands import Command


def command(
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
    for text in changes or []:
        name, equals, value = text.partition("=")
        if not equals:
            raise Misuse(f"{text!r}: expected PIN=VALUE, such as IN3=1 or AIN1=4.2")
        try:
            wanted[name.strip().upper()] = read_number(value)
        except Misuse as error:
            raise Misuse(f"{text!r}: {error}") from None
    with selected(twin) as there:
        for change in _changes(there, wanted):
            there.do(change)
        pins = levels_of(there) if json or not wanted else {}
    if json:
        print_data(pins)
    elif pins:
        typer.echo("\n".join(f"{name:<6} {value:g}" for name, value in pins.items()))


def _changes(there: Selected, wanted: dict[str, float]) -> list[Command]:
    """The commands for pins and buttons: one for all pins, then one for each button."""
    from steptwin.simulation.script.steps import Press, Release, Set

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
