"""The data sheets of the controllers of a subject, by name."""

from __future__ import annotations

from collections.abc import Callable

from steptwin.datasheet import Datasheet
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.nearmiss import NearMiss
from steptwin.subject.contract import Description

UNKNOWN_CONTROLLER = Message("studio.unknown-controller", "there is no controller {controller!r}{hint}: there are {names}")


class Sheets:
    def __init__(self, describe: Callable[[], Description]) -> None:
        self._describe = describe

    def of(self, controller: str) -> Datasheet:
        """Raises `Misuse` with the names that there are."""
        sheets = {part.name: part.datasheet for part in self._describe().controllers}
        if controller not in sheets:
            hint = NearMiss().hint(controller, sheets)
            raise Misuse(UNKNOWN_CONTROLLER(controller=controller, hint=hint, names=list(sheets)))
        return sheets[controller]
