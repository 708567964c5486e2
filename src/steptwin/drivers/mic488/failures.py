"""Errors of the MIC488 driver, in the three families of `steptwin.errors`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from steptwin.errors import LineFailure, Refusal
from steptwin.messages import Message, text_of
from steptwin.wire.pdu import EXCEPTION_NAMES, ModbusException

if TYPE_CHECKING:
    from steptwin.drivers.mic488.motion import MoveEnd


_WHY = {
    1: Message("drivers.mic488.no-function", "the controller does not have this function"),
    2: Message("drivers.mic488.no-register", "the controller does not have this register, or not for this function"),
    3: Message("drivers.mic488.value-is-not-accepted", "the controller does not accept this value"),
}
_DONE = {
    "paused": Message("drivers.mic488.paused", "paused"),
    "stopped": Message("drivers.mic488.stopped", "stopped"),
    "switched off": Message("drivers.mic488.switched-off", "switched off"),
}
"""Wanted action on an axis or a program."""
UNKNOWN = Message("drivers.mic488.unknown-exception", "unknown")
AT_PLACE = Message("drivers.mic488.at-place", "{place}: {what}")
REFUSED = Message("drivers.mic488.refused", "'{request}' was refused: {why} (exception {code:02X}, {name})")
REFUSED_WITHOUT_REASON = Message("drivers.mic488.refused-without-reason", "'{request}' was refused: exception {code:02X}, {name}")
UNCONFIRMED = Message(
    "drivers.mic488.unconfirmed",
    "{who} could not be {what}: the controller cannot be reached and continues its last command ({problem})",
)


class Mic488Refusal(Refusal):
    """A refusal by the controller at ``place``; ``what`` is the message without it."""

    def __init__(self, place: str, what: str) -> None:
        self.what = what
        super().__init__(AT_PLACE(place=place, what=text_of(what)))


class ModbusRefusal(Mic488Refusal):
    """The controller answered with a Modbus exception; ``code`` is its number."""

    def __init__(self, place: str, request: object, exception: ModbusException) -> None:
        self.code = exception.code
        code, name = exception.code, EXCEPTION_NAMES.get(exception.code, UNKNOWN())
        if code in _WHY:
            super().__init__(place, REFUSED(request=request, why=_WHY[code](), code=code, name=name))
        else:
            super().__init__(place, REFUSED_WITHOUT_REASON(request=request, code=code, name=name))


class NotReady(Mic488Refusal):
    """The state of the controller does not permit the request; nothing was sent."""


class NoMic488(Refusal):
    """The device that responds is not a MIC488."""


class MoveFailed(Refusal):
    """A motion did not end as intended; ``end`` has the reason."""

    def __init__(self, end: MoveEnd) -> None:
        self.end = end
        super().__init__(str(end))


class Unconfirmed(LineFailure):
    """A stop, or a change of mode that ends a motion, was not confirmed by the controller. The text names its possible state."""


def unconfirmed(who: str, what: str, failure: LineFailure) -> Unconfirmed:
    """The error for the axis or controller ``who``, which could not be ``what``, such as ``stopped``."""
    return Unconfirmed(UNCONFIRMED(who=text_of(who), what=_DONE[what](), problem=text_of(failure)))
