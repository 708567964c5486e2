"""Errors of the M1486 driver, in the three families of `steptwin.errors`."""

from __future__ import annotations

from collections.abc import Collection

from steptwin.drivers.mic488.failures import Unconfirmed
from steptwin.errors import LineFailure, Refusal
from steptwin.messages import Message, text_of

NO_ROOM = Message(
    "drivers.m1486.no-room",
    "{place}: '{request}' was refused: the input buffer has no room (5EH); the chip moves, waits or its program is held",
)
AMONG_THEM = Message("drivers.m1486.among-them", " ({names})")
SEVERAL_CHIPS = Message(
    "drivers.m1486.several-chips",
    "{place}: several chips{which} answer: all of them would do what is sent without an address; name one, as chip=7 "
    "in the address of the device or as the address of the driver",
)
EXECUTED_OR_NOT = Message("drivers.m1486.executed-or-not", "; it is unknown whether the chip has executed it")
NOT_EXECUTED = Message("drivers.m1486.not-executed", "; it was not executed")
NOTHING = Message("drivers.m1486.nothing", "nothing")
GARBLED = Message(
    "drivers.m1486.garbled", "{place}: '{request}' did not come back as it was sent: {received} instead of {sent}{doubt}"
)
NO_ECHO = Message(
    "drivers.m1486.no-echo",
    "{place}: {chip} does not echo: it is off, has another address or baud rate, or is still busy with an earlier "
    "command ({cause})",
)
RESTARTED = Message(
    "drivers.m1486.restarted",
    "{place}: {chip} was switched off or reset meanwhile: its settings are those of power-up, its position is unknown; "
    "nothing was executed",
)
DOUBTFUL_MOVE = Message(
    "drivers.m1486.doubtful-move",
    "it is unknown whether {chip} has begun {what}: the command was sent once and is not repeated ({cause}); stop it, "
    "or wait for it and check its position",
)
NOT_STOPPED = Message(
    "drivers.m1486.not-stopped", "{chip} could not be stopped: it cannot be reached and continues its last command ({cause})"
)


class NoRoom(Refusal):
    """The chip answered 5EH: its input buffer had no room for a character of the command."""

    def __init__(self, place: str, request: object) -> None:
        super().__init__(NO_ROOM(place=place, request=request))


class Busy(Refusal):
    """The chip moves, waits or runs its program; nothing that moves was sent."""


class SeveralChips(Refusal):
    """A chip was not named on a line that has several. ``addresses``: those that are known."""

    def __init__(self, place: str, addresses: Collection[int]) -> None:
        self.addresses = tuple(sorted(addresses))
        names = [f"{address:X}" for address in self.addresses]
        which = AMONG_THEM(names=names) if len(names) > 1 else ""
        super().__init__(SEVERAL_CHIPS(place=place, which=which))


class PositionUnknown(Refusal):
    """The position counter does not show the position of the motor."""


class WrongType(Refusal):
    """Another type of chip responds than expected."""


class ProgramLost(Refusal):
    """A program is not, or no longer, in the command memory of a chip."""


class Garbled(LineFailure):
    """A command did not come back from the chip as it was sent.

    ``uncertain``: the chip may have executed it, or another command that it received instead.
    """

    def __init__(self, place: str, request: object, sent: bytes, received: bytes, *, uncertain: bool) -> None:
        self.uncertain = uncertain
        doubt = EXECUTED_OR_NOT() if uncertain else NOT_EXECUTED()
        super().__init__(GARBLED(place=place, request=request, received=_format(received), sent=_format(sent), doubt=doubt))


class NoEcho(LineFailure):
    """A chip does not echo."""

    def __init__(self, place: str, chip: str, cause: LineFailure | None) -> None:
        super().__init__(NO_ECHO(place=place, chip=chip, cause="None" if cause is None else text_of(cause)))


class Restarted(LineFailure):
    """A chip does not echo any more, as after power-up: its settings and position were lost."""

    def __init__(self, place: str, chip: str) -> None:
        super().__init__(RESTARTED(place=place, chip=chip))


class DoubtfulMove(LineFailure):
    """It is unknown whether a motion has begun."""

    uncertain = True

    def __init__(self, chip: str, what: str, cause: LineFailure) -> None:
        super().__init__(DOUBTFUL_MOVE(chip=chip, what=what, cause=text_of(cause)))


class FileGivenUp(LineFailure):
    """A file could not be sent completely; nothing of it runs."""


def unconfirmed(chip: str, cause: LineFailure) -> Unconfirmed:
    return Unconfirmed(NOT_STOPPED(chip=chip, cause=text_of(cause)))


def _format(data: bytes) -> str:
    return repr(data.decode("latin-1")) if data else NOTHING()
