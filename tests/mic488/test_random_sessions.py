"""A MIC488 answers and does in sessions by chance what it did before: golden/random.txt has digests of each.

Regenerate with ``python tests/mic488/test_random_sessions.py`` where behaviour has changed. ``... SEED`` shows a session, so that
its lines before and after a change can be compared.
"""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from chance import Chance, digest
from random_mic488 import session
from random_mic488_texts import said, valued

GOLDEN = Path(__file__).parent / "golden" / "random.txt"
SEEDS = range(48)


def seen(seed: int) -> dict[str, list[str]]:
    chance = Chance("texts", seed)
    return session(seed) | {"says": said(chance), "called": valued(chance)}


def digests(seed: int) -> str:
    return f"{seed} " + " ".join(f"{what}={digest(lines)}" for what, lines in seen(seed).items())


@pytest.mark.parametrize("seed", SEEDS)
def test_it_answers_and_does_what_it_did(seed: int) -> None:
    assert digests(seed) == GOLDEN.read_text().splitlines()[seed]


@pytest.mark.parametrize("seed", range(100, 112))
def test_it_does_not_matter_at_which_moments_it_is_looked_at(seed: int) -> None:
    found = [session(seed, stepwise=stepwise) for stepwise in (True, False)]
    assert found[0] == found[1]


if __name__ == "__main__":
    if sys.argv[1:]:
        for what, lines in seen(int(sys.argv[1])).items():
            print(f"--- {what}", *lines, sep="\n")
    else:
        GOLDEN.write_text("".join(f"{digests(seed)}\n" for seed in SEEDS))
