"""What can fail of a toy: its input, its supply, and the shaft that mechanics give it."""

from __future__ import annotations

from collections.abc import Iterable

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.simulation.faults import AxisLoad, FaultKind, FaultyController, Occasion


class ToyBody:
    inputs = ("STOP",)
    outputs = ("BUSY",)

    def __init__(self, shafts: Iterable[AxisLoad] = ()) -> None:
        self.shafts = list(shafts)

    def slip(self, axis: int, counts: int, now: Nanos) -> None:
        raise AssertionError("a toy lacks this")

    def lacks(self, kind: FaultKind) -> str | None:
        if kind.needs is not None or kind.occasion is Occasion.SAVE:
            return "is a toy"
        return None if self.shafts or kind.parameter("axis") is None else "has no shaft"

    def show_master_error(self, shown: bool, now: Nanos) -> None:
        raise AssertionError("a toy lacks this")

    def watch(self, owner: FaultyController) -> None:
        """It keeps nothing, and serves no requests that could be refused."""

    def pin_name(self, pin: str) -> str:
        return pin.upper()

    def check_pin(self, pin: str, level: float) -> None:
        if pin != "STOP" or level not in (0.0, 1.0):
            raise Misuse(f"{pin} = {level:g}: the input is STOP, 0 or 1")

    def applied(self, pin: str) -> None:
        """No pin is both."""
