"""Errors of the M1486 driver, in the three families of `steptwin.errors`."""

from __future__ import annotations

from collections.abc import Collection

from steptwin.drivers.mic488.failures import Unconfirmed
from steptwin.errors import LineFailure, Refusal


class NoRoom(Refusal):
    """The chip answered 5EH: its input buffer had no room for a character of the command."""

    def __init__(self, place: str, request: object) -> None:
        super().__init__(
            f"{place}: '{request}' was refused: the input buffer has no room (5EH); the chip moves, waits or its program is held"
        )


class Busy(Refusal):
    """The chip moves, waits or runs its program; nothing that moves was sent."""


class SeveralChips(Refusal):
    """A chip was not named on a line that has several. ``addresses``: those that are known."""

    def __init__(self, place: str, addresses: Collection[int]) -> None:
        self.addresses = tuple(sorted(addresses))
        which = f" ({', '.join(f'{address:X}' for address in self.addresses)})" if len(self.addresses) > 1 else ""
        super().__init__(
            f"{place}: several chips{which} answer: all of them would do what is sent without an address; name one, as chip=7 "
            "in the address of the device or as the address of the driver"
        )


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
        doubt = "; it is unknown whether the chip has executed it" if uncertain else "; it was not executed"
        super().__init__(
            f"{place}: '{request}' did not come back as it was sent: {_shown(received)} instead of {_shown(sent)}{doubt}"
        )


class NoEcho(LineFailure):
    """A chip does not echo."""

    def __init__(self, place: str, chip: str, cause: LineFailure | None) -> None:
        super().__init__(
            f"{place}: {chip} does not echo: it is off, has another address or baud rate, or is still busy with an earlier "
            f"command ({cause})"
        )


class Restarted(LineFailure):
    """A chip does not echo any more, as after power-up: its settings and position were lost."""

    def __init__(self, place: str, chip: str) -> None:
        super().__init__(
            f"{place}: {chip} was switched off or reset meanwhile: its settings are those of power-up, its position is unknown; "
            "nothing was executed"
        )


class DoubtfulMove(LineFailure):
    """It is unknown whether a motion has begun."""

    uncertain = True

    def __init__(self, chip: str, what: str, cause: LineFailure) -> None:
        super().__init__(
            f"it is unknown whether {chip} has begun {what}: the command was sent once and is not repeated ({cause}); stop it, "
            "or wait for it and check its position"
        )


class FileGivenUp(LineFailure):
    """A file could not be sent completely; nothing of it runs."""


def unconfirmed(chip: str, cause: LineFailure) -> Unconfirmed:
    return Unconfirmed(f"{chip} could not be stopped: it cannot be reached and continues its last command ({cause})")


def _shown(data: bytes) -> str:
    return repr(data.decode("latin-1")) if data else "nothing"
