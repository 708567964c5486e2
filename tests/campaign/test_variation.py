"""How numbers from 0 to 1 become values."""

from __future__ import annotations

from statistics import NormalDist, fmean

import pytest

from steptwin.campaign.variation import Between, Choice, Normal


@pytest.mark.parametrize(("u", "value"), [(0.0, 10.0), (0.5, 15.0), (0.25, 12.5)])
def test_uniform(u: float, value: float) -> None:
    assert Between(10.0, 20.0).value(u) == value


def test_uniform_in_the_logarithm() -> None:
    spread = Between(1.0, 10_000.0, is_log=True)
    assert [spread.value(n / 4) for n in range(4)] == [1.0, 10.0, 100.0, 1000.0]


def test_whole_numbers_are_equally_frequent_and_include_both_ends() -> None:
    spread = Between(1.0, 4.0, is_whole=True)
    assert [spread.value((n + 0.5) / 8) for n in range(8)] == [1, 1, 2, 2, 3, 3, 4, 4]
    assert spread.levels == (1, 2, 3, 4)


def test_times_are_whole_nanoseconds() -> None:
    assert Between(0.0, 1.0, is_time=True).value(1 / 3) == 0.333333333


def test_levels_are_equidistant_with_both_ends() -> None:
    assert Between(0.0, 1.0, steps=5).levels == (0.0, 0.25, 0.5, 0.75, 1.0)
    assert Between(0.0, 1.0).levels == ()


def test_a_normal_distribution_has_its_quantiles_and_can_be_cut_off() -> None:
    assert Normal(5.0, 2.0).value(0.5) == 5.0
    assert Normal(5.0, 2.0).value(0.8413447460685429) == pytest.approx(7.0)
    cut = Normal(5.0, 2.0, 4.0, 6.0)
    values = [float(cut.value((n + 0.5) / 1000)) for n in range(1000)]
    assert 4.0 <= min(values) < 4.01
    assert 5.99 < max(values) <= 6.0
    assert fmean(values) == pytest.approx(5.0)
    assert isinstance(Normal(0.0, 1.0).value(0.0), float)  # not minus infinity
    assert NormalDist().cdf(-9.0) < 1e-16


def test_a_choice_has_each_value_as_often() -> None:
    assert [Choice(("a", 2, True)).value(u) for u in (0.0, 0.34, 0.67, 0.999999)] == ["a", 2, True, True]


def test_the_logarithm_of_a_very_wide_range() -> None:
    spread = Between(1e-300, 1e300, is_log=True)
    assert [spread.value(u) for u in (0.0, 0.5, 1.0)] == [1e-300, 1.0, 1e300]


def test_many_levels_are_made_once() -> None:
    spread = Between(0.0, 1.0, steps=10_000)
    assert spread.levels is Between(0.0, 1.0, steps=10_000).levels
    assert len(spread.levels) == 10_000


def test_the_share_of_a_normal_distribution_that_is_left() -> None:
    assert Normal(0.0, 1.0).share == 1.0
    assert Normal(0.0, 1.0, 0.0, None).share == pytest.approx(0.5)
    assert Normal(0.0, 1.0, 10.0, 11.0).share == 0.0
