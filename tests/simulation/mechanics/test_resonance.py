"""The vibration of a rotor in a band of speeds: amplitudes and moments against the exponential function."""

from __future__ import annotations

from math import acos, exp, log, pi, sqrt

import pytest

from steptwin.simulation.mechanics.resonance import MotionPhase, Resonance, ResonanceInterval, limit, resonance_intervals

BAND = Resonance(1000.0, 2000.0, 12.0, 8.0, 0.1)


def test_amplitudes() -> None:
    growing, fading = ResonanceInterval(2.0, 0.5, 12.0), ResonanceInterval(2.0, 0.5, -8.0)
    assert growing.at(2.25, 0.1) == pytest.approx(0.5 * exp(3.0))
    assert fading.at(2.1, 0.1) == pytest.approx(0.5 * exp(-0.8))
    assert fading.at(3.0, 0.1) == 0.1


@pytest.mark.parametrize("use", [0.0, 0.25, 0.7, 0.999])
def test_the_amplitude_with_which_the_field_is_lost(use: float) -> None:
    stiffness = sqrt(1.0 - use * use)
    expected = sqrt(4.0 * (stiffness - use * acos(use)) / stiffness) / (pi / 2.0)
    assert limit(use) == pytest.approx(expected, rel=1e-6)


def test_without_torque_to_spare_it_is_lost_at_once() -> None:
    assert (limit(1.0), limit(2.0)) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("speed", "grows"), [(999.0, False), (1000.0, False), (1000.1, True), (1999.9, True), (2000.0, False), (2001.0, False)]
)
def test_it_grows_between_the_ends_of_the_band(speed: float, grows: bool) -> None:
    ((interval, lost),) = resonance_intervals(BAND, [MotionPhase(1.0, 1.01, speed, 0.0)], 0.2)
    assert interval == ResonanceInterval(1.0, 0.2, 12.0 if grows else -8.0)
    assert lost is None


def test_the_moment_at_which_the_field_is_lost() -> None:
    """Two parts: the amplitude fades in the first one, and grows in the second to its limit."""
    parts = [MotionPhase(0.0, 0.05, 500.0, 0.0), MotionPhase(0.05, 1.0, 1500.0, 0.5), MotionPhase(1.0, 2.0, 500.0, 0.0)]
    first, second = resonance_intervals(BAND, parts, 0.4)
    at = 0.4 * exp(-0.4)
    assert first == (ResonanceInterval(0.0, 0.4, -8.0), None)
    assert second[0].amplitude == pytest.approx(at)
    assert second[1] == pytest.approx(0.05 + log(limit(0.5) / at) / 12.0)


def test_a_part_that_ends_before_is_survived() -> None:
    needed = log(limit(0.5) / 0.2) / 12.0
    for share, count in ((0.999, 2), (1.001, 1)):
        parts = [MotionPhase(0.0, needed * share, 1500.0, 0.5), MotionPhase(needed * share, 9.0, 500.0, 0.0)]
        assert len(list(resonance_intervals(BAND, parts, 0.2))) == count


def test_an_amplitude_above_the_limit_loses_the_field_at_once() -> None:
    ((_, lost),) = resonance_intervals(BAND, [MotionPhase(3.0, 4.0, 1500.0, 0.5)], 2.0 * limit(0.5))
    assert lost == 3.0


def test_after_a_part_without_end_there_is_the_least_vibration() -> None:
    parts = [MotionPhase(0.0, float("inf"), 500.0, 0.0), MotionPhase(1.0, 2.0, 500.0, 0.0)]
    assert [interval.amplitude for interval, _ in resonance_intervals(BAND, parts, 0.4)] == [0.4, 0.1]
