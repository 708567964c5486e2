"""What is said of programs by chance, made of them and done by them is what it was: golden/random.txt has digests of each.

Regenerate with ``python tests/wbc/test_random_programs.py`` where behaviour or a message has changed. ``... SEED`` shows all of a
program, so that its lines before and after a change can be compared.
"""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from chance import digest
from random_wbc import seen

GOLDEN = Path(__file__).parent / "golden" / "random.txt"
SEEDS = range(30)


def digests(seed: int) -> str:
    return f"{seed} " + " ".join(f"{what}={digest(lines)}" for what, lines in seen(seed).items())


@pytest.mark.parametrize("seed", SEEDS)
def test_a_program_means_and_does_what_it_did(seed: int) -> None:
    assert digests(seed) == GOLDEN.read_text().splitlines()[seed]


if __name__ == "__main__":
    if sys.argv[1:]:
        for what, lines in seen(int(sys.argv[1])).items():
            print(f"--- {what}", *lines, sep="\n")
    else:
        GOLDEN.write_text("".join(f"{digests(seed)}\n" for seed in SEEDS))
