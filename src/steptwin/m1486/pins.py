"""The pins of the chip as they are electrically: open-drain user lines, control inputs, outputs (manual chapters II and VI).

Levels are 0 and 1. A user line is high unless the chip or external wiring pulls it low.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.m1486.lines import DUAL_DAC, LINES, RUNSIGN_LINE, SEEK_ENDS_LOW, STEP_DIRECTION, TWO_DACS, Interface
from steptwin.m1486.variants import Variant
from steptwin.messages import Message
from steptwin.state import Stateful

LINE_PINS = {f"B{line}": line for line in LINES}
CONTROL_PINS = ("JOG", "LIMIT", "SD", "RST", "S&D", "DUAL")
"""Pins that are inputs only."""
OUTPUT_PINS = ("BOOST", "DIRECTION")
ALIASES = {
    "BR0": "B5", "BR1": "B6", "JOG DIRECTION": "B7", "JOGDIR": "B7", "SHUTDOWN": "SD",
    "ADDR0": "B18", "ADDR1": "B19", "ADDR2": "B20", "ADDR3": "B21",
}  # fmt: skip
"""Second names of pins with two functions."""

OPEN_ADDRESS = 15
"""Open address pins; a chip alone needs no other address (chapter II, Serial interface)."""
WAVEFORM = "N"
"""A pseudo pin: its level is the number of the waveform of the phase currents (command N)."""
JOG_DIRECTION_LINE = 7
_BAUD_LINES = (5, 6)
_ADDRESS_LINES = (18, 19, 20, 21)


class ChipPins(Stateful):
    """Levels of all pins. ``on_change`` is called with name, level and moment whenever a line or an output has changed."""

    FIXED: ClassVar[tuple[str, ...]] = ("_on_change",)
    __slots__ = (*FIXED, "external", "latches", "levels", "others", "runsign", "tied_low")

    def __init__(self, address: int, baud_code: int, interface: Interface, on_change: Callable[[str, int, Nanos], None]) -> None:
        self._on_change = on_change
        # Index 0 of these lists is not a line.
        self.external = [1] * (LINES.stop)
        """Levels applied from outside; by default all are open (1)."""
        for bit, line in enumerate(_ADDRESS_LINES):
            self.external[line] = address >> bit & 1
        for bit, line in enumerate(_BAUD_LINES):
            self.external[line] = baud_code >> bit & 1
        self.latches = [1] * (LINES.stop)
        """Outputs of the program."""
        self.runsign: int | None = None
        """Output of function 40 on its line; None while it is OFF."""
        self.tied_low = False
        """The chip is shut down with function 45 OFF."""
        self.others = dict.fromkeys((*CONTROL_PINS, *OUTPUT_PINS), 1)
        self.others |= {"RST": 0, "DIRECTION": 0, "S&D": int(interface != STEP_DIRECTION)}
        self.others["DUAL"] = int(interface != DUAL_DAC)
        self.levels = list(self.external)
        """Levels that are read on the lines."""

    def __getitem__(self, name: str) -> int:
        return self.others[name]

    def set_output(self, name: str, level: int, now: Nanos) -> None:
        if self.others[name] != level:
            self.others[name] = level
            self._on_change(name, level, now)

    def set_external(self, line: int, level: int, now: Nanos) -> bool:
        """Pull or release a line from outside; True if its level changed."""
        self.external[line] = level
        return self._settle(line, now)

    def set_latch(self, line: int, level: int, now: Nanos) -> None:
        self.latches[line] = level
        self._settle(line, now)

    def set_runsign(self, level: int | None, now: Nanos) -> None:
        self.runsign = level
        self._settle(RUNSIGN_LINE, now)

    def tie_low(self, low: bool, now: Nanos) -> None:
        self.tied_low = low
        for line in LINES:
            self._settle(line, now)

    def release_outputs(self, now: Nanos) -> None:
        """All outputs high, as after power-up."""
        self.runsign = None
        self.tied_low = False
        for line in LINES:
            self.latches[line] = 1
            self._settle(line, now)

    def _settle(self, line: int, now: Nanos) -> bool:
        own = self.latches[line]
        if line == RUNSIGN_LINE and self.runsign is not None:
            own = self.runsign
        level = self.external[line] & (0 if self.tied_low else own)
        if level == self.levels[line]:
            return False
        self.levels[line] = level
        self._on_change(f"B{line}", level, now)
        return True

    # ------------------------------------------------------------------ what is read at a reset

    def address(self) -> int:
        return _number([self.levels[line] for line in _ADDRESS_LINES])

    def baud_pins(self) -> tuple[int, int]:
        """BR1 and BR0."""
        return self.levels[_BAUD_LINES[1]], self.levels[_BAUD_LINES[0]]

    def interface(self) -> Interface:
        """The driver interface; S&D takes precedence over DUAL."""
        if not self.others["S&D"]:
            return STEP_DIRECTION
        return TWO_DACS if self.others["DUAL"] else DUAL_DAC


def seek_ends(line: int, level: int) -> bool:
    """Whether a seek ends when ``line`` has this level."""
    return level == (0 if line in SEEK_ENDS_LOW else 1)


ALIAS = Message("m1486.alias-of-a-pin", "{name} is {line}")
UNKNOWN_INPUT_PIN = Message("m1486.unknown-input-pin", "no input pin {pin!r}: inputs are B1 to B21, {names}; {aliases}")


def known_pin(pin: str) -> str:
    """The pin a name means, in either case and by its second name too. Raises `Misuse` with the inputs there are."""
    name = pin.strip().upper()
    name = ALIASES.get(name, name)
    if name not in LINE_PINS and name not in CONTROL_PINS:
        raise Misuse(
            UNKNOWN_INPUT_PIN(
                pin=pin, names=list(CONTROL_PINS), aliases=[ALIAS(name=other, line=line) for other, line in ALIASES.items()]
            )
        )
    return name


DIGITAL_INPUT_VALUE = Message("m1486.digital-input-value", "{name} = {value:g}: a digital input is 0 or 1")


def settable_pin(pin: str, value: float) -> str:
    """The pin a name means, as `known_pin`. Raises `Misuse` unless it can take ``value``."""
    name = known_pin(pin)
    if value not in (0.0, 1.0):
        raise Misuse(DIGITAL_INPUT_VALUE(name=name, value=value))
    return name


PIN_IS_TAKEN = Message("m1486.pin-is-taken", "{pin} is taken: the {interface} interface has B{first} to B{last}")


def refuse_taken(pin: str, interface: Interface) -> None:
    """`Misuse` for a line whose pin the driver interface uses: it is neither input nor output (M-21)."""
    taken = interface.occupied
    if LINE_PINS.get(pin) in taken:
        raise Misuse(PIN_IS_TAKEN(pin=pin, interface=interface.title, first=taken[0], last=taken[-1]))


def _number(bits: list[int]) -> int:
    return sum(bit << n for n, bit in enumerate(bits))


WRONG_BAUD_RATE = Message("m1486.wrong-baud-rate", "{baud} bit/s: {title} has {rates}")


def baud_pins(variant: Variant, baud: int | None) -> int:
    """BR1 and BR0 as a number for a baud rate, by default the highest. Raises `Misuse` with the four there are."""
    rates = [variant.baud(code >> 1, code & 1) for code in range(4)]
    if baud is None:
        return len(rates) - 1
    if baud not in rates:
        raise Misuse(WRONG_BAUD_RATE(baud=baud, title=variant.title, rates=list(rates)))
    return rates.index(baud)
