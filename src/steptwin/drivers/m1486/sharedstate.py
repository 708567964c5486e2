"""State that the drivers of one chip share."""

from __future__ import annotations

from collections.abc import Sequence

from steptwin.controller import Nanos
from steptwin.drivers.m1486.failures import Restarted
from steptwin.drivers.m1486.motion import ChipMotionCommand
from steptwin.drivers.m1486.sentcommands import SentCommands
from steptwin.drivers.m1486.settings import ChipSettings
from steptwin.m1486.commands import TABLE
from steptwin.m1486.commanduse import ChipState, Wait
from steptwin.m1486.flow import may_turn_on
from steptwin.m1486.functions import CONTINUE, FUNCTIONS
from steptwin.m1486.functions import TABLE as ALL_FUNCTIONS
from steptwin.m1486.lines import Interface
from steptwin.m1486.variants import Store, Variant

FUNCTION_BYTES = (17, 18, 19)
"""The numbers of ``U`` for functions 40 to 63."""
_UNREADABLE = ChipState.DISTANCE | ChipState.SETTINGS | ChipState.WAVEFORM | ChipState.SENDING | ChipState.LISTENING
_CHANGES_NOTHING_READABLE = frozenset(
    spec.letter.lower()
    for spec in TABLE
    if spec.use.writes and spec.use.writes in _UNREADABLE and spec.use.waits in (Wait.NOTHING, Wait.SENDING)
)
"""Commands after which a chip at rest still is, and uploads what it did before."""


class SharedChipState:
    """The state that all drivers of one chip on one line share."""

    def __init__(self) -> None:
        self.variant: Variant | None = None
        self.interface: Interface | None = None
        self._functions: dict[int, bool] = {}  # those that are known
        self.readings: dict[int, int] = {}
        """Bytes by their numbers of ``U``, as they were read since the last command that may change them."""
        self.is_at_rest = False
        """Whether the chip has answered since the last command that takes time. Its pins may have begun something meanwhile."""
        self.sent = SentCommands()
        self.settings = ChipSettings()
        self.motion: ChipMotionCommand | None = None
        self.is_position_valid = True
        self.was_awake = False
        """Whether it has echoed before: if not any more, it was switched off."""
        self.restarted: Restarted | None = None
        """Set when a wait for another chip has detected that this one was switched off; the next use raises `Restarted`."""
        self.stops = 0
        """Number of stops: a motion requested before a stop must not begin after it."""
        self.pending_stops: set[object] = set()
        """Stops that are not acknowledged yet: a motion requested meanwhile must not begin either."""
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
        self._functions = {}
        if self.variant is not None and self.variant.store is not Store.EEPROM:  # else a stored program has begun
            self.note_defaults()
        self.readings = {}
        self.is_at_rest = False
        self.sent = SentCommands()
        self.motion = None
        self.uploads = None
        self.is_position_valid = False

    def function(self, number: int) -> bool | None:
        """Whether a function is ON; None if unknown."""
        return self._functions.get(number)

    def note_function(self, number: int, *, on: bool) -> None:
        self._functions[number] = on

    def note_defaults(self) -> None:
        """Note the functions after a reset."""
        self._functions = {function.number: function.default for function in ALL_FUNCTIONS}

    def forget_functions(self, *numbers: int) -> None:
        """Forget functions that may have been switched, until they are read again."""
        for number in numbers:
            self._functions.pop(number, None)

    def note_downloaded(self, text: str, stored_bits: int) -> None:
        """Note a command of a program that is about to be sent (`SentCommands.note`)."""
        command = self.sent.note(text, stored_bits)
        if command is not None and may_turn_on(CONTINUE, command):
            self.forget_functions(CONTINUE)  # wrong data may end nothing any more

    def note_begin(self, label: int | None) -> None:
        """Note that commands begin to be executed, those at ``label`` if given. They switch what they like."""
        if self.sent.may_turn_on(CONTINUE, label):
            self.forget_functions(CONTINUE)

    def note_command(self, text: str) -> None:
        """Note a command that is sent: what it may change is not known any more."""
        if text[0] not in _CHANGES_NOTHING_READABLE:
            self.readings.clear()
            self.is_at_rest = False

    def note_readings(self, numbers: Sequence[int], found: Sequence[int]) -> None:
        """Note bytes that were read, by their numbers of ``U``."""
        self.readings.update(zip(numbers, found, strict=True))
        for number, byte in zip(numbers, found, strict=True):
            if number in FUNCTION_BYTES:
                first = FUNCTIONS[8 * FUNCTION_BYTES.index(number)]
                self._functions.update((first + bit, bool(byte >> bit & 1)) for bit in range(8))

    def reading(self, first: int) -> int | None:
        """The 24 bits from byte ``first`` on; None if they are not known."""
        numbers = range(first, first + 3)
        if not self.readings.keys() >= set(numbers):
            return None
        return int.from_bytes(bytes(self.readings[number] for number in numbers), "little")

    def note_counter(self, counter_u: int) -> None:
        """Note the position counter that was set."""
        self.note_readings((1, 2, 3), counter_u.to_bytes(3, "little"))
