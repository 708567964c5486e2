"""The members of the M1486 family, as data.

Sizes in bits as the manual gives them, times in nanoseconds. A 2x member at 24 MHz runs everything twice as fast: its
arguments keep the ranges of the 12 MHz member and mean half the time, twice the speed, four times the acceleration.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass, replace

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message


class Store(enum.Enum):
    """Where the command memory lives."""

    RAM = "RAM"
    EEPROM = "EEPROM"


@dataclass(frozen=True, slots=True)
class Variant:
    """One member of the family (manual chapters II and X)."""

    name: str
    labels: int
    """Labels are numbered from 1 to this."""
    input_bits: int
    memory_bits: int
    store: Store
    type_letter: int
    """Letter that U20 sends; that of C is assumption M-15."""
    addresses: range = range(16)
    """Addresses the pins can give and ``X`` can name."""
    shared_bits: int = 0
    """Last bits of the command memory that numeric registers 1 to 8 occupy; 0 where they have a place of their own."""
    erase_ns: Nanos = 0
    """Time ``\\`` takes while nothing is received. Not scaled by the clock: it is the EEPROM's own."""
    write_ns: Nanos = 0
    """Least time from one command to the next on the line, for the EEPROM write."""
    has_shutdown: bool = True
    """Shutdown by the SD pin."""
    pwm_outputs: int = 0
    clock: int = 1
    """1 at 12 MHz, 2 at 24 MHz."""
    # M-3: the pages with the defaults of S and A are missing.
    start_stop: int = 200
    acceleration: int = 5_000

    @property
    def title(self) -> str:
        return f"M1486{self.name}"

    @property
    def statement_ns(self) -> Nanos:
        """Time one command takes unless configured otherwise (M-19)."""
        return MILLISECOND // self.clock

    def baud(self, br1: int, br0: int) -> int:
        """Bits per second that pins BR1 and BR0 choose (chapter II, Serial interface)."""
        return _BAUD[br1 << 1 | br0] * self.clock


_BAUD = (300, 1_200, 2_400, 4_800)
SLOWEST_JOG = 1_200
"""Lowest rate of a line on which a dead-man jog can be renewed in time, bit/s: each of its moves takes a dozen characters."""

_A = Variant("A", 15, 96, 864, Store.RAM, 0x41, shared_bits=8 * 16)
_B = Variant("B", 80, 256, 2032, Store.RAM, 0x42)
# "Pin and function compatible" with the A: its registers are taken to share the memory as the A's do.
_C = replace(_A, name="C", memory_bits=4000, type_letter=0x43, pwm_outputs=4)
_E1 = Variant("E1", 80, 256, 2000, Store.EEPROM, 0x45, range(1, 16), erase_ns=SECOND, write_ns=SECOND // 2, has_shutdown=False)
_E2 = replace(_E1, name="E2", memory_bits=4000, type_letter=0x46, erase_ns=2 * SECOND)

_TWELVE = (_A, _B, _C, _E1, _E2)

VARIANTS: tuple[Variant, ...] = _TWELVE + tuple(replace(v, name=f"{v.name}2x", clock=2) for v in _TWELVE)

DEFAULT = _A
"""The manual speaks of this one wherever it names no other (chapter X)."""


UNKNOWN_VARIANT = Message("m1486.unknown-variant", "no M1486 variant is called {name!r}; there are {names}")


def variant(name: str) -> Variant:
    """The member called ``name``: ``E1``, ``a2x``, ``M1486B``. Raises `Misuse` with the names there are."""
    wanted = name.strip().upper().removeprefix("M1486")
    for v in VARIANTS:
        if v.name.upper() == wanted:
            return v
    raise Misuse(UNKNOWN_VARIANT(name=name, names=[v.name for v in VARIANTS]))
