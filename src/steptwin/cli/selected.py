"""The running twin that an option names, and its controllers."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import typer

from steptwin.errors import Misuse

if TYPE_CHECKING:
    from steptwin.datasheet import Datasheet
    from steptwin.live.remote import RemoteSubject
    from steptwin.subject.commands import Command


class Selected:
    """A running twin, and the controller of it that was named, if one was."""

    def __init__(self, subject: RemoteSubject, controller: str | None) -> None:
        self.subject = subject
        self._controller = controller
        self.controllers = tuple(controller.name for controller in subject.description.controllers)

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
        return next(part.datasheet for part in self.subject.description.controllers if part.name == name)

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


def levels_of(there: Selected) -> dict[str, float]:
    """The selected pins, as CONTROLLER.PIN."""
    from steptwin.subject.commands import ReadPins

    return {name: level for controller in there.shown for name, level in there.do(ReadPins(controller)).items()}


def print_data(value: object) -> None:
    """Print what a twin has sent, as JSON."""
    import json

    typer.echo(json.dumps(value, indent=2))
