"""``steptwin pin``, ``encoder``, ``power-cycle``, ``state``: the inputs, power and state of a running twin.

From Python: `steptwin.live.remote.RemoteSubject`.
"""

from __future__ import annotations

import re
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, Any

import typer

from steptwin.cli import completion
from steptwin.errors import Misuse

if TYPE_CHECKING:
    from steptwin.datasheet import Datasheet
    from steptwin.live.remote import RemoteSubject
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


class Selected:
    """A running twin, and the controller of it that was named, if one was."""

    def __init__(self, subject: RemoteSubject, controller: str | None) -> None:
        self.subject = subject
        self._controller = controller
        self.controllers = tuple(machine.name for machine in subject.description.machines)

    def do(self, command: Command) -> Any:
        return self.subject.do(command).value

    @property
    def shown(self) -> Sequence[str]:
        """The selected controllers: the one named, or all."""
        return self.controllers if self._controller is None else (self._controller,)

    def one(self) -> str:
        """The selected controller. Raises `Misuse` if the twin has several and none was named."""
        if len(self.shown) != 1:
            raise Misuse(
                f"the twin has several controllers: name one with --device TWIN.CONTROLLER: {', '.join(self.controllers)}"
            )
        return self.shown[0]

    def sheet(self, name: str) -> Datasheet:
        """The data sheet of the controller called ``name``."""
        return next(part.datasheet for part in self.subject.description.machines if part.name == name)

    def called(self, name: str) -> str:
        """The controller called ``name``; case does not matter. Raises `Misuse`."""
        found = next((each for each in self.controllers if each.upper() == name.upper()), None)
        if found is None:
            raise Misuse(f"no controller {name!r}: there are {', '.join(self.controllers)}")
        return found


@contextmanager
def selected(twin: str | None) -> Generator[Selected]:
    """The twin that ``twin`` names and its controller. Raises `LineFailure` or `Misuse` if that is ambiguous."""
    from steptwin.live.remote import RemoteSubject
    from steptwin.live.twins import find_controller

    name, controller = find_controller(twin)
    with RemoteSubject(name) as subject:
        yield Selected(subject, controller)


def ask_twin(twin: str | None, command: Command) -> Any:
    """The response of the twin that ``twin`` names to a command for the whole twin."""
    from steptwin.live.remote import ask
    from steptwin.live.twins import find_controller

    return ask(find_controller(twin)[0], command)


def pin(
    changes: Annotated[
        list[str] | None,
        typer.Argument(help="IN3=1 AIN1=4.2 ...; without any, all pins are shown.", autocompletion=completion.pins),
    ] = None,
    twin: Twin = None,
    json: Json = False,
) -> None:
    """Set inputs of a running twin, press or release its buttons, or show all pins."""
    wanted: dict[str, float] = {}
    for change in changes or []:
        name, equals, value = change.partition("=")
        if not equals:
            raise Misuse(f"{change!r}: expected PIN=VALUE, such as IN3=1 or AIN1=4.2")
        try:
            wanted[name.strip().upper()] = float(value.replace(",", "."))
        except ValueError:
            raise Misuse(f"{change!r}: {value!r} is not a number") from None
    with selected(twin) as there:
        for command in _changes(there, wanted):
            there.do(command)
        pins = levels_of(there) if json or not wanted else {}
    if json:
        _print_json(pins)
    elif pins:
        typer.echo("\n".join(f"{name:<6} {value:g}" for name, value in pins.items()))


def levels_of(there: Selected) -> dict[str, float]:
    """The selected pins, as CONTROLLER.PIN."""
    from steptwin.subject.commands import ReadPins

    return {name: level for machine in there.shown for name, level in there.do(ReadPins(machine)).items()}


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
    from steptwin.subject.commands import State

    with selected(twin) as there:
        name = there.one()
        found = there.do(State(name))
    if json:
        _print_json(found)
        return
    from steptwin.commands.state_text import lines
    from steptwin.controllerstate import read_state

    typer.echo("\n".join(lines(read_state(found), there.sheet(name))))


def _print_json(value: object) -> None:
    import json

    typer.echo(json.dumps(value, indent=2))
