"""A MIC488 in sessions by chance: requests, pins, programs, power."""

from __future__ import annotations

import pytest
from random_mic488 import session


@pytest.mark.parametrize("seed", range(100, 110))
def test_it_does_not_matter_at_which_moments_it_is_read(seed: int) -> None:
    assert session(seed, stepwise=True) == session(seed, stepwise=False)
