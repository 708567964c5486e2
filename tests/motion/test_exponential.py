"""Against the functions of the C library, and where they have no branches."""

from __future__ import annotations

from math import exp, log

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.motion.exponential import decay, logarithm


@given(st.floats(0.0, 700.0))
def test_decay_is_that_of_the_library(x: float) -> None:
    assert decay(x) == pytest.approx(exp(-x), rel=1e-12)


@given(st.floats(1.0, 1e300))
def test_logarithm_is_that_of_the_library(y: float) -> None:
    assert logarithm(y) == pytest.approx(log(y), rel=1e-12, abs=1e-12)


def test_the_ends() -> None:
    assert (decay(0.0), decay(701.0), logarithm(1.0)) == (1.0, 0.0, 0.0)
