"""Motions with values by chance go as they did before: golden/random_ways.txt has a digest of every ten of them.

Regenerate with ``make golden ARGS=tests/simulation/test_random_ways.py`` where behaviour has changed. The file run with KIND SEED
shows one, so that its lines before and after a change can be compared.
"""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from chance import digest
from random_ways import KINDS, way_of

GOLDEN = Path(__file__).parent / "golden" / "random_ways.txt"
TEN = 10
CASES = [(kind, first) for kind, (_, number) in KINDS.items() for first in range(0, number, TEN)]


def digests(kind: str, first: int) -> str:
    lines = [line for seed in range(first, first + TEN) for line in way_of(kind, seed)]
    return f"{kind} {first} {digest(lines)}"


@pytest.mark.parametrize(("kind", "first"), CASES)
def test_it_goes_as_it_did(kind: str, first: int) -> None:
    assert digests(kind, first) in GOLDEN.read_text().splitlines()


if __name__ == "__main__":
    if sys.argv[1:]:
        print(*way_of(sys.argv[1], int(sys.argv[2])), sep="\n")
    else:
        GOLDEN.write_text("".join(f"{digests(kind, first)}\n" for kind, first in CASES))
