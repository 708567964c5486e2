"""M1486 chips on a line in sessions by chance: characters, pins, power."""

from __future__ import annotations

import pytest
from random_m1486 import session


@pytest.mark.parametrize("seed", range(100, 110))
def test_it_does_not_matter_at_which_moments_they_are_read(seed: int) -> None:
    assert session(seed, stepwise=True) == session(seed, stepwise=False)
