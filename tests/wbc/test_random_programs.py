"""What is said of programs by chance, made of them and done by them is what it was: golden/random.txt has digests of each.

Regenerate with ``python tests/wbc/test_random_programs.py`` where behaviour or a message has changed. ``... SEED`` shows all of a
program, so that its lines before and after a change can be compared.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from chance import GoldenDigests
from random_wbc import seen

GOLDEN = GoldenDigests(seen, Path(__file__).parent / "golden" / "random.txt", range(30))


@pytest.mark.parametrize("seed", GOLDEN.seeds)
def test_a_program_means_and_does_what_it_did(seed: int) -> None:
    assert GOLDEN.of(seed) == GOLDEN.recorded(seed)


if __name__ == "__main__":
    GOLDEN.main()
