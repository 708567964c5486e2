"""The seven current characteristics against sine and powers in decimal arithmetic."""

from __future__ import annotations

from decimal import ROUND_HALF_UP, Decimal, localcontext

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.errors import Misuse
from steptwin.motion.waveforms import CHARACTERISTICS, PERIOD, currents

PI = Decimal("3.14159265358979323846264338327950288419716939937510")


def sine(x: Decimal) -> Decimal:
    """Taylor's series."""
    term = total = x
    n = 1
    while abs(term) > Decimal("1e-40"):
        n += 2
        term *= -x * x / (n * (n - 1))
        total += term
    return total


def shape(characteristic: int, theta: int) -> Decimal:
    """0…1 in the first half period, of ``theta`` in minimum microsteps."""
    angle = Decimal(min(theta, 128 - theta))
    match characteristic:
        case 2:
            return min(angle / 32, Decimal(1))
        case 5:
            return angle / 64
    value = sine(PI * angle / 128)
    exponent = {1: "1", 3: "1.2", 4: "1.5", 6: "0.8", 7: "0.6"}[characteristic]
    return value ** Decimal(exponent) if value else value


@pytest.mark.parametrize("characteristic", CHARACTERISTICS)
def test_every_value_is_the_rounded_shape(characteristic: int) -> None:
    with localcontext() as context:
        context.prec = 45
        for theta in range(128):
            value = int((127 * shape(characteristic, theta)).quantize(Decimal(1), ROUND_HALF_UP))
            assert currents(characteristic, theta)[0] == value
            assert currents(characteristic, theta + 128)[0] == -value


@given(characteristic=st.sampled_from(CHARACTERISTICS), theta=st.integers(-(2**24), 2**24))
def test_symmetries(characteristic: int, theta: int) -> None:
    first, second = currents(characteristic, theta)
    assert currents(characteristic, theta + PERIOD) == (first, second)
    # Phase 2 follows a quarter period later; backwards from 0 phase 1 changes its sign and phase 2 does not.
    assert currents(characteristic, theta - 64)[0] == second
    assert currents(characteristic, -theta) == (-first, second)
    assert -127 <= first <= 127


def test_full_steps_have_one_phase_at_full_current() -> None:
    for characteristic in CHARACTERISTICS:
        assert [currents(characteristic, theta) for theta in (0, 64, 128, 192)] == [(0, -127), (127, 0), (0, 127), (-127, 0)]


def test_n2_with_m2_is_half_step() -> None:
    """Manual, Characteristic: half-step mode with N2 and M2. Both phases at full current half-way between full steps."""
    halves = [currents(2, theta) for theta in range(0, 256, 32)]
    assert halves == [(0, -127), (127, -127), (127, 0), (127, 127), (0, 127), (-127, 127), (-127, 0), (-127, -127)]


def test_trimmed_lie_below_the_sine_and_filled_above() -> None:
    by_size = [sum(abs(currents(n, theta)[0]) for theta in range(256)) for n in (5, 4, 3, 1, 6, 7, 2)]
    assert by_size[1:] == sorted(by_size[1:])
    assert by_size[0] < by_size[3]


@pytest.mark.parametrize("characteristic", [0, 8, -1])
def test_other_characteristics_are_refused(characteristic: int) -> None:
    with pytest.raises(Misuse, match=f"characteristic = {characteristic}: must be 1 to 7"):
        currents(characteristic, 0)
