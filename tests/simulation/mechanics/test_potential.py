"""Rotors in the wells of a field or of a detent: energies against the formulas of the module, both sides of each border."""

from __future__ import annotations

from math import asin, pi, sqrt

import pytest

from steptwin.simulation.mechanics.potential import PeriodicPotential

POTENTIAL = PeriodicPotential(0.8, 64.0)
HALF = 0.8 * 64.0 / (2.0 * pi)
"""Half of the way from the bottom to the edge, N·m·pulses."""


@pytest.mark.parametrize(
    ("position", "place"),
    [(0.0, 0), (31.9, 0), (32.0, 64), (95.9, 64), (96.0, 128), (-32.0, 0), (-32.1, -64), (-96.0, -64)],
)
def test_the_nearest_well(position: float, place: int) -> None:
    assert POTENTIAL.nearest(position) == place


def test_places_of_wells_whose_period_is_no_whole_number() -> None:
    assert [PeriodicPotential(1.0, 2.5).nearest(position) for position in (1.2, 1.25, 3.7, 3.8, 6.3)] == [0, 2, 2, 5, 8]


@pytest.mark.parametrize(("resisting", "share"), [(0.0, 1.0), (0.4, sqrt(0.75)), (-0.4, sqrt(0.75)), (0.8, 0.0), (9.0, 0.0)])
def test_how_deep_the_place_of_rest_is(resisting: float, share: float) -> None:
    assert POTENTIAL.deep(resisting) == pytest.approx(HALF * share, abs=1e-12)
    assert POTENTIAL.catches_below(0.002, resisting) == pytest.approx(sqrt(2.0 * HALF * share / 0.002), abs=1e-12)


@pytest.mark.parametrize("resisting", [-0.8, -0.4, 0.0, 0.3, 0.8])
def test_what_it_takes_to_leave_a_well(resisting: float) -> None:
    r = resisting / 0.8
    assert POTENTIAL.to_leave(resisting) == pytest.approx(HALF * (2.0 * sqrt(1.0 - r * r) + r * (pi + 2.0 * asin(r))), abs=1e-9)


def test_against_more_than_the_torque_it_takes_what_it_takes_against_the_torque() -> None:
    assert POTENTIAL.to_leave(2.0) == POTENTIAL.to_leave(0.8) == pytest.approx(0.8 * 64.0)
    assert POTENTIAL.to_leave(-2.0) == 0.0


def test_without_torque_there_are_no_wells() -> None:
    none = PeriodicPotential(0.0, 64.0)
    assert (none.to_leave(0.1), none.deep(0.0), none.catches_below(1.0, 0.1)) == (0.0, 0.0, 0.0)
    assert (none.passed(0.0, 0.1), none.passed(0.1, 0.1), none.passed(0.1, 0.0)) == (0, 1, None)


def test_how_many_wells_are_passed() -> None:
    """The first one takes what leaves it, each further one the work against what resists."""
    first, further = POTENTIAL.to_leave(0.4), 0.4 * 64.0
    assert POTENTIAL.passed(first, 0.4) == 0
    assert POTENTIAL.passed(first * 0.5, 0.4) == 0
    assert POTENTIAL.passed(first + 1e-9, 0.4) == 1
    assert POTENTIAL.passed(first + 0.999 * further, 0.4) == 1
    assert POTENTIAL.passed(first + 1.001 * further, 0.4) == 2
    assert POTENTIAL.passed(first + 2.5 * further, 0.4) == 3


def test_without_resistance_or_driven_it_does_not_come_to_rest() -> None:
    assert POTENTIAL.passed(POTENTIAL.to_leave(0.0) + 1.0, 0.0) is None
    assert POTENTIAL.passed(POTENTIAL.to_leave(-0.1) + 1.0, -0.1) is None
    assert POTENTIAL.passed(POTENTIAL.to_leave(0.0), 0.0) == 0
