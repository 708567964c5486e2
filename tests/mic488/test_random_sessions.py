"""A MIC488 answers and does in sessions by chance what it did before: golden/random.txt has digests of each.

Regenerate with ``python tests/mic488/test_random_sessions.py`` where behaviour has changed. ``... SEED`` shows a session, so that
its lines before and after a change can be compared.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from chance import Chance, GoldenDigests
from random_mic488 import session
from random_mic488_texts import said, valued


def seen(seed: int) -> dict[str, list[str]]:
    chance = Chance("texts", seed)
    return session(seed) | {"says": said(chance), "called": valued(chance)}


GOLDEN = GoldenDigests(seen, Path(__file__).parent / "golden" / "random.txt", range(48))


@pytest.mark.parametrize("seed", GOLDEN.seeds)
def test_it_answers_and_does_what_it_did(seed: int) -> None:
    assert GOLDEN.of(seed) == GOLDEN.recorded(seed)


@pytest.mark.parametrize("seed", range(100, 112))
def test_it_does_not_matter_at_which_moments_it_is_looked_at(seed: int) -> None:
    found = [session(seed, stepwise=stepwise) for stepwise in (True, False)]
    assert found[0] == found[1]


if __name__ == "__main__":
    GOLDEN.main()
