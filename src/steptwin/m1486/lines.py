"""The I/O lines B1 to B21, the functions that share their pins, and the driver interface that uses some of them (chapters II
and VI)."""

from __future__ import annotations

from dataclasses import dataclass

from steptwin.errors import Misuse
from steptwin.messages import Message

LINES = range(1, 22)
"""Lines B1 to B21."""


@dataclass(frozen=True, slots=True)
class Interface:
    """One way the chip drives a motor, chosen by the pins S&D and DUAL."""

    name: str
    title: str
    code: int
    """The byte of U15 (M-15)."""
    occupied: range
    """Lines whose pins the interface needs for itself."""
    microstep: int
    """Microsteps per full step after power-up."""


STEP_DIRECTION = Interface("sd", "Step & Direction", 2, range(0), 1)
DUAL_DAC = Interface("dual", "Dual DAC", 1, range(10, 18), 4)
TWO_DACS = Interface("two", "Two DACs", 0, range(8, 18), 4)

INTERFACES = (STEP_DIRECTION, DUAL_DAC, TWO_DACS)


UNKNOWN_INTERFACE = Message("m1486.unknown-interface", "no driver interface is called {name!r}; there are {names}")


def interface(name: str) -> Interface:
    """The driver interface called ``sd``, ``dual`` or ``two``. Raises `Misuse` with the names there are."""
    for i in INTERFACES:
        if i.name == name.strip().lower():
            return i
    raise Misuse(UNKNOWN_INTERFACE(name=name, names=[i.name for i in INTERFACES]))


SEEK_ENDS_LOW = frozenset((1, 2, 3, 8, 9, 10, 11, 16, 17, 18, 19))
"""Lines that end a seek when they are low; the others end it when they are high (chapter VII.2, Seek)."""

RUNSIGN_LINE = 1
"""Line that function 40 (Runsign) drives."""

SHARED_PINS = {
    5: "BR0, read when RST goes high",
    6: "BR1, read when RST goes high",
    7: "JOG DIRECTION",
    18: "ADDR0, read when RST goes high",
    19: "ADDR1, read when RST goes high",
    20: "ADDR2, read when RST goes high",
    21: "ADDR3, read when RST goes high",
}
"""Other functions on the pin of a line, beside the driver interface."""


def line_group(argument: int) -> range | None:
    """The lines that the argument of Query or Order names: last digit the count, the digits before it the first line.

    ``14`` is lines 1 to 4, ``184`` lines 18 to 21; the lowest line is the least significant bit. None where the argument
    names no lines or lines beyond 21.
    """
    first, count = divmod(argument, 10)
    if count == 0 or first not in LINES or first + count - 1 not in LINES:
        return None
    return range(first, first + count)
