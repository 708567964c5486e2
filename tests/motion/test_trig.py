"""Our own sines against decimal arithmetic."""

from __future__ import annotations

from decimal import Decimal, localcontext
from math import sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.errors import Misuse
from steptwin.motion import trig

PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494459")
ULP = Decimal(2) ** -51


def exact_sine(x: Decimal) -> Decimal:
    """Taylor's series."""
    term = total = x
    n = 1
    while abs(term) > Decimal("1e-40"):
        n += 2
        term *= -x * x / (n * (n - 1))
        total += term
    return total


@given(angle=st.one_of(st.floats(-5.0, 5.0), st.floats(-1e9, 1e9), st.integers(-8, 8).map(lambda n: n + 1e-12)))
def test_sine_and_cosine_are_exact_to_the_last_bits(angle: float) -> None:
    with localcontext() as context:
        context.prec = 60
        # Less than a turn; the series is short there.
        turn = Decimal(angle) - 4 * round(Decimal(angle) / 4)
        for found, exact in (
            (trig.sine(angle), exact_sine(turn * PI / 2)),
            (trig.cosine(angle), exact_sine((turn + 1) * PI / 2)),
        ):
            assert abs(Decimal(found) - exact) <= ULP * min(abs(exact) * 4, 1) + Decimal("1e-30")


@pytest.mark.parametrize(("angle", "sine"), [(0, 0.0), (1, 1.0), (2, 0.0), (3, -1.0), (4, 0.0), (-1, -1.0), (1001, 1.0)])
def test_whole_quarters_are_exact(angle: int, sine: float) -> None:
    assert trig.sine(angle) == sine
    assert trig.cosine(angle - 1) == sine
    assert str(trig.sine(angle)) == str(sine), "no negative zero"


@given(x=st.one_of(st.floats(-1.0, 1.0), st.floats(-1e-9, 1e-9), st.floats(0.7, 0.71)))
def test_the_inverses_are_exact_to_the_last_bits(x: float) -> None:
    with localcontext() as context:
        context.prec = 60
        for angle, back in ((trig.arcsine(x), exact_sine), (trig.arccosine(x), lambda a: exact_sine(a + PI / 2))):
            found = Decimal(angle) * PI / 2
            # By how much the angle is wrong, from the slope of the sine there.
            slope = max(Decimal(sqrt(1.0 - x * x)), Decimal("1e-8"))
            error = abs(back(found) - Decimal(x)) / slope
            assert error <= 4 * ULP * max(abs(found), abs(Decimal(x))) + Decimal("1e-320")
        assert abs(Decimal(trig.arcsine(x)) + Decimal(trig.arccosine(x)) - 1) <= 2 * ULP


@pytest.mark.parametrize("x", [1.0000000000000002, -1.5, float("nan")])
def test_there_is_no_angle_with_a_sine_above_1(x: float) -> None:
    with pytest.raises(Misuse, match=r"permitted are -1…1"):
        trig.arcsine(x)
    with pytest.raises(Misuse, match=r"permitted are -1…1"):
        trig.arccosine(x)


@given(angle=st.floats(-2.0, 2.0, exclude_min=True), distance=st.floats(1e-300, 1e300))
def test_a_direction_is_found_again(angle: float, distance: float) -> None:
    x, y = distance * trig.cosine(angle), distance * trig.sine(angle)
    assert trig.direction(x, y) == pytest.approx(angle, abs=1e-15)
    assert trig.length(x, y) == pytest.approx(distance, rel=1e-15)


def test_directions_of_the_axes() -> None:
    assert [trig.direction(x, y) for x, y in ((1, 0), (0, 1), (-1, 0), (0, -1))] == [0.0, 1.0, 2.0, -1.0]
    with pytest.raises(Misuse, match=r"\(0, 0\)"):
        trig.direction(0.0, 0.0)
    assert trig.length(0.0, 0.0) == 0.0
