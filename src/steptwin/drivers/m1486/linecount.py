"""Which chips are on a line, found with some bursts of characters and one command stored by each chip.

``X`` acts when it is received and is stored nowhere, and a chip echoes (function 41) what comes between its selection and the
next one: ``x1 CR u20 CR x2 CR`` brings ``u20 CR x2 CR`` back from chip 1. A chip that does not echo shows itself by its type
letter, which has no address.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import NamedTuple

from steptwin.controller import MILLISECOND, Nanos
from steptwin.drivers.m1486.talk import LETTERS, TYPE_QUERY
from steptwin.m1486.variants import VARIANTS

ECHO_NS: Nanos = 60 * MILLISECOND
"""The time in which the last echo arrives, with adapters that delay bytes, ns."""
ANSWER_NS: Nanos = 100 * MILLISECOND + max(one.write_ns for one in VARIANTS)
"""The time in which the last letter arrives, ns: an E type first writes the question into its EEPROM."""
_ECHOED = frozenset(f"xg{TYPE_QUERY}0123456789abcdef\r".encode("ascii"))


class FoundChips(NamedTuple):
    """``addresses`` of the chips that echo; the number of type ``letters`` that arrived."""

    addresses: frozenset[int]
    letters: int


async def find_chips(probe: Callable[[str, Nanos], Awaitable[bytes]]) -> FoundChips:
    """Find the chips at rest, and those that echo. ``probe`` sends a text to all chips and returns what came back within a time.

    Each address is selected twice, so that a garbled character hides nobody. All chips listen afterwards.
    """
    ask = f"{TYPE_QUERY}\r"
    received = [await probe(_selections(""), ECHO_NS), await probe(_selections(ask), ECHO_NS)]
    found: set[int] = set()
    for echo in map(_echo, received):
        found |= {address for address in range(1, 15) if f"x{address + 1:x}".encode("ascii") in echo}
        found |= {15} if b"xg" in echo else set()
    # X0 is wrong data to an E type that listens, and would end its program.
    parked = next((address for address in range(14, 0, -1) if address not in found), 15)
    received.append(await probe(f"x{parked:x}\rx0\r{ask}xg\rx{parked:x}\rx0\rxg\r", ANSWER_NS))
    if b"xg" in _echo(received[-1]):
        found.add(0)
    return FoundChips(frozenset(found), sum(byte in LETTERS for byte in b"".join(received)))


def _selections(between: str) -> str:
    """The selections of addresses 1 to 15, each followed by ``between``, and of all."""
    return "".join(f"x{address:x}\r{between}" for address in range(1, 16)) + "xg\r"


def _echo(received: bytes) -> bytes:
    """The received bytes that may be an echo."""
    return bytes(byte for byte in received if byte in _ECHOED)
