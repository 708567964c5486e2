"""M1486 chips send and do by chance what they did before, and the same is said of programs: golden/random.txt has digests.

Regenerate with ``python tests/m1486/test_random_sessions.py`` where behaviour or a message has changed. ``... SEED`` shows a
session and a program, so that their lines before and after a change can be compared.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from chance import GoldenDigests
from random_m1486 import said, session


def seen(seed: int) -> dict[str, list[str]]:
    return session(seed) | {"says": [*said(2 * seed), *said(2 * seed + 1)]}


GOLDEN = GoldenDigests(seen, Path(__file__).parent / "golden" / "random.txt", range(48))


@pytest.mark.parametrize("seed", GOLDEN.seeds)
def test_chips_send_and_do_what_they_did(seed: int) -> None:
    assert GOLDEN.of(seed) == GOLDEN.recorded(seed)


@pytest.mark.parametrize("seed", range(100, 112))
def test_it_does_not_matter_at_which_moments_they_are_looked_at(seed: int) -> None:
    found = [session(seed, stepwise=stepwise) for stepwise in (True, False)]
    assert found[0] == found[1]


if __name__ == "__main__":
    GOLDEN.main()
