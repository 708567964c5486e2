"""Chance with a seed, for records of machines whose inputs come by chance, and their digests.

Texts have gaps: ``⟨2..9⟩`` becomes a number, ``⟨#2..9⟩`` a whole one, ``⟨a|b⟩`` one of these. All comes from
`random.Random.random`, which is the same in every Python. Where the seed is even, numbers are on a coarse grid, so that moments
and places coincide; otherwise they have decimals.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Sequence
from hashlib import blake2b
from pathlib import Path
from random import Random
from typing import NamedTuple, TypeVar

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


def digest(lines: list[str]) -> str:
    return blake2b("\n".join(lines).encode(), digest_size=6).hexdigest()


class GoldenDigests(NamedTuple):
    """Digests of what is ``seen`` with each seed, by its kind, and the golden file with a line of them for each seed."""

    seen: Callable[[int], dict[str, list[str]]]
    file: Path
    seeds: Sequence[int]

    def of(self, seed: int) -> str:
        return f"{seed} " + " ".join(f"{what}={digest(lines)}" for what, lines in self.seen(seed).items())

    def recorded(self, seed: int) -> str:
        return self.file.read_text().splitlines()[seed]

    def main(self) -> None:
        """Show what is behind the digests of the seed that the command line names; without one, make the file anew."""
        if sys.argv[1:]:
            for what, lines in self.seen(int(sys.argv[1])).items():
                print(f"--- {what}", *lines, sep="\n")
        else:
            self.file.parent.mkdir(exist_ok=True)
            self.file.write_text("".join(f"{self.of(seed)}\n" for seed in self.seeds))
