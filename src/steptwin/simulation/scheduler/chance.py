"""Chance that is the same everywhere: one stream of numbers for each name, in integers only."""

from __future__ import annotations

from functools import lru_cache
from hashlib import blake2b

from steptwin.state import Stateful

_MASK = (1 << 64) - 1
_STEP = 0x9E3779B97F4A7C15
_WHOLE = 1 << 53
_REMEMBERED = 512
"""Streams whose beginnings are remembered, since worlds of one description have the same."""


@lru_cache(maxsize=_REMEMBERED)
def _beginning(seed: int, name: str) -> int:
    return int.from_bytes(blake2b(f"{seed}/{name}".encode(), digest_size=8).digest(), "big")


class Chance(Stateful):
    """The stream ``name`` of ``seed``: SplitMix64 (Steele, Lea, Flood 2014). Streams of different names are independent, so that
    one fault more or less does not change what the others draw.
    """

    __slots__ = ("_state",)

    def __init__(self, seed: int, name: str) -> None:
        self._state = _beginning(seed, name)

    def draw(self) -> int:
        """A number from 0 to 2^64 − 1."""
        self._state = (self._state + _STEP) & _MASK
        mixed = self._state
        mixed = (mixed ^ mixed >> 30) * 0xBF58476D1CE4E5B9 & _MASK
        mixed = (mixed ^ mixed >> 27) * 0x94D049BB133111EB & _MASK
        return mixed ^ mixed >> 31

    def below(self, limit: int) -> int:
        """A number from 0 to ``limit`` − 1."""
        return self.draw() * limit >> 64

    def happens(self, probability: float) -> bool:
        return self.draw() >> 11 < probability * _WHOLE

    def some_bytes(self, count: int) -> bytes:
        return bytes(self.below(256) for _ in range(count))
