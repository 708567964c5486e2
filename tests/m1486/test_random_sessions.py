"""M1486 chips send and do by chance what they did before, and the same is said of programs: golden/random.txt has digests.

Regenerate with ``python tests/m1486/test_random_sessions.py`` where behaviour or a message has changed. ``... SEED`` shows a
session and a program, so that their lines before and after a change can be compared.
"""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from chance import digest
from random_m1486 import said, session

GOLDEN = Path(__file__).parent / "golden" / "random.txt"
SEEDS = range(48)


def seen(seed: int) -> dict[str, list[str]]:
    return session(seed) | {"says": [*said(2 * seed), *said(2 * seed + 1)]}


def digests(seed: int) -> str:
    return f"{seed} " + " ".join(f"{what}={digest(lines)}" for what, lines in seen(seed).items())


@pytest.mark.parametrize("seed", SEEDS)
def test_chips_send_and_do_what_they_did(seed: int) -> None:
    assert digests(seed) == GOLDEN.read_text().splitlines()[seed]


@pytest.mark.parametrize("seed", range(100, 112))
def test_it_does_not_matter_at_which_moments_they_are_looked_at(seed: int) -> None:
    found = [session(seed, stepwise=stepwise) for stepwise in (True, False)]
    assert found[0] == found[1]


if __name__ == "__main__":
    if sys.argv[1:]:
        for what, lines in seen(int(sys.argv[1])).items():
            print(f"--- {what}", *lines, sep="\n")
    else:
        GOLDEN.write_text("".join(f"{digests(seed)}\n" for seed in SEEDS))
