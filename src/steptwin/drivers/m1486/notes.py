"""What drivers of one chip know of it together."""

from __future__ import annotations

from steptwin.drivers.m1486.failures import Restarted
from steptwin.drivers.m1486.motion import ChipMotionCommand
from steptwin.drivers.m1486.settings import ChipSettings
from steptwin.m1486.functions import FUNCTIONS, TABLE
from steptwin.m1486.lines import Interface
from steptwin.m1486.variants import Variant
from steptwin.machine import Nanos


class ChipNotes:
    """The state that all drivers of one chip on one line share."""

    def __init__(self) -> None:
        self.variant: Variant | None = None
        self.interface: Interface | None = None
        self.functions: int | None = None
        """Functions 40 to 63, the lowest number in the lowest bit."""
        self.settings = ChipSettings()
        self.motion: ChipMotionCommand | None = None
        self.is_position_valid = True
        self.was_awake = False
        """Whether it has echoed before: if not any more, it was switched off."""
        self.restarted: Restarted | None = None
        """Set when a wait for another chip has detected that this one was switched off; the next use raises `Restarted`."""
        self.stops = 0
        """Number of stops: a motion requested before a stop must not begin after it."""
        self.is_killed = False
        """Whether Kill may hold the program (function 51 OFF)."""
        self.uploads: bytearray | None = None
        """Unread uploads of the program that was started last."""
        self.ready_at: Nanos = 0
        """The end of the present EEPROM write, ns."""
        self.begins_at: Nanos = 0
        """When the command that may move and was sent last is done: an E type first writes it into its EEPROM, ns."""
        self.asked_at: Nanos = 0
        """The moment of the last query of its type, ns."""

    def forget(self) -> None:
        """Forget the state of a chip that was switched off or reset by others."""
        self.settings = ChipSettings()
        self.functions = sum(function.default << bit for bit, function in enumerate(TABLE))
        self.motion = None
        self.uploads = None
        self.is_position_valid = False

    def function(self, number: int) -> bool | None:
        return None if self.functions is None else bool(self.functions >> (number - FUNCTIONS.start) & 1)

    def note_function(self, number: int, *, on: bool) -> None:
        if self.functions is not None:
            bit = 1 << (number - FUNCTIONS.start)
            self.functions = self.functions | bit if on else self.functions & ~bit
