"""Chance with a seed, for tests whose inputs come by chance.

Texts have gaps: ``⟨2..9⟩`` becomes a number, ``⟨#2..9⟩`` a whole one, ``⟨a|b⟩`` one of these. All comes from
`random.Random.random`, which is the same in every Python. Where the seed is even, numbers are on a coarse grid, so that moments
and places coincide; otherwise they have decimals.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from random import Random
from typing import TypeVar

T = TypeVar("T")

GAP = re.compile(r"⟨([^⟩]*)⟩")


class Chance:
    """Where all that is by chance comes from."""

    def __init__(self, name: str, seed: int) -> None:
        self._random = Random(f"{name} {seed}")
        self.is_even = seed % 2 == 0

    def below(self, end: int) -> int:
        return int(self._random.random() * end)

    def one(self, among: Sequence[T]) -> T:
        return among[self.below(len(among))]

    def is_so(self) -> bool:
        """Two times of three."""
        return self.below(3) > 0

    def number(self, low: str, high: str) -> str:
        places = max(len(end.partition(".")[2]) for end in (low, high))
        begin, end = float(low), float(high)
        if self.is_even:
            return f"{begin + (end - begin) * self.below(9) / 8:.{places}f}"
        return f"{begin + (end - begin) * self._random.random():.{places + 3}f}"

    def whole(self, low: str, high: str) -> str:
        return str(int(low) + self.below(int(high) - int(low) + 1))

    def gap(self, inside: str) -> str:
        chosen = inside.split("|")
        one = self.one(chosen)
        low, dots, high = one.partition("..")
        if not dots:
            return one
        return self.whole(low[1:], high) if low.startswith("#") else self.number(low, high)

    def filled(self, text: str) -> str:
        return GAP.sub(lambda found: self.gap(found[1]), text)
