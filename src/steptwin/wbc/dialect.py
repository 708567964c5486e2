"""The features of a firmware generation for programs. A dialect is a value; no other code depends on the firmware."""

from __future__ import annotations

from dataclasses import dataclass

from steptwin.errors import Misuse

GENERATIONS = ("1.23", "1.40", "1.70")

# WBC-12
MAX_VARIABLES = 128
# The image has room for 227 rows; the 1.74 manual speaks of 200, which no 227-row table of a running controller should fail.
MAX_POSITIONS = 227


@dataclass(frozen=True, slots=True)
class Dialect:
    """Limits and features of one generation.

    ``user_registers`` counts 16-bit registers, ``max_steps`` executable lines, ``max_positions`` rows of the position table.
    """

    firmware: str
    user_registers: int
    max_steps: int
    max_positions: int = MAX_POSITIONS
    max_variables: int = MAX_VARIABLES

    def has(self, since: str | None) -> bool:
        """Whether something that came with generation ``since`` exists (None: it always did)."""
        return since is None or GENERATIONS.index(since) <= GENERATIONS.index(self.firmware)


DIALECTS = {
    dialect.firmware: dialect
    for dialect in (
        Dialect("1.23", user_registers=500, max_steps=1000),
        Dialect("1.40", user_registers=2000, max_steps=1000),
        Dialect("1.70", user_registers=2000, max_steps=4000),
    )
}
DEFAULT = DIALECTS["1.70"]


def dialect_for(firmware: str) -> Dialect:
    """The dialect of a firmware version: that of the newest generation not newer than it (``1.25`` → 1.23, ``1.74`` → 1.70)."""
    try:
        asked = _version(firmware)
    except ValueError:
        asked = (0, 0)
    known = [name for name in GENERATIONS if _version(name) <= asked]
    if not known:
        raise Misuse(f"firmware {firmware!r} is not known: give {GENERATIONS[0]} or newer, like {', '.join(GENERATIONS)}")
    return DIALECTS[known[-1]]


def _version(text: str) -> tuple[int, int]:
    major, minor = text.split(".")
    return int(major), int(minor)
