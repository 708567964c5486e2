"""Sobol indices: of a function whose indices are known, beside those of scipy, and of a campaign."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import cos, pi, sin, tau
from pathlib import Path

import pytest
from campaigns import campaign_file

from steptwin.campaign.campaign import Campaign
from steptwin.campaign.case import Case
from steptwin.campaign.designs import design_of
from steptwin.campaign.reading import load_campaign
from steptwin.campaign.report.sobolindices import LEAST_BLOCKS, SobolIndex, sobol_indices
from steptwin.campaign.report.write import write_report
from steptwin.errors import Misuse

NAMES = ("x1", "x2", "x3")


def ishigami(point: Sequence[float]) -> float:
    """Of three values from -pi to pi, divided so that it is within -1 and 1 (T. Ishigami, T. Homma, 1990; a = 7, b = 0.1)."""
    x1, x2, x3 = (tau * u - pi for u in point)
    return (sin(x1) + 7.0 * sin(x2) ** 2 + 0.1 * x3**4 * sin(x1)) / 20.0


def indices(of: Callable[[Sequence[float]], float], blocks: int) -> dict[str, SobolIndex]:
    point = design_of("saltelli", 3, NAMES, None)
    outcome = [of(point(n)) for n in range(blocks * 5)]
    return {one.name: one for one in sobol_indices(NAMES, range(len(outcome)), outcome, [1.0] * len(outcome))}


def test_indices_of_a_function_whose_indices_are_known() -> None:
    found = indices(ishigami, 2048)
    firsts, totals = {"x1": 0.3139, "x2": 0.4424, "x3": 0.0}, {"x1": 0.5576, "x2": 0.4424, "x3": 0.2437}
    assert list(found) == sorted(totals, key=lambda name: -totals[name])
    for name, one in found.items():
        assert one.first == pytest.approx(firsts[name], abs=0.02)
        assert one.total == pytest.approx(totals[name], abs=0.02)
        assert one.first_low <= firsts[name] <= one.first_high
        assert one.total_low <= totals[name] <= one.total_high


def test_indices_are_those_of_scipy() -> None:
    stats = pytest.importorskip("scipy.stats")
    import numpy as np

    point, blocks = design_of("saltelli", 5, NAMES, None), 64
    outcome = np.array([ishigami(point(n)) for n in range(blocks * 5)]).reshape(blocks, 5).T
    expected = stats.sobol_indices(func={"f_A": outcome[:1], "f_B": outcome[1:2], "f_AB": outcome[2:, None, :]}, n=blocks)
    flat = outcome.T.ravel().tolist()
    found = {one.name: one for one in sobol_indices(NAMES, range(len(flat)), flat, [1.0] * len(flat))}
    assert [found[name].first for name in NAMES] == pytest.approx(expected.first_order.tolist())
    assert [found[name].total for name in NAMES] == pytest.approx(expected.total_order.tolist())


def test_points_between_two_have_one_number_of_the_other() -> None:
    point = design_of("saltelli", 1, ["a", "b"], None)
    for block in range(0, 40, 4):
        one, other, first, second = (list(point(block + n)) for n in range(4))
        assert (first, second) == ([other[0], one[1]], [one[0], other[1]])


@pytest.mark.parametrize("numbers", [range(5 * LEAST_BLOCKS - 1), [0, *range(2, 500)]])
def test_with_too_few_runs_there_are_none(numbers: Sequence[int]) -> None:
    assert sobol_indices(NAMES, numbers, [float(n % 7) for n in numbers], [1.0] * len(numbers)) == []


def test_what_always_comes_out_alike_has_none() -> None:
    assert sobol_indices(NAMES, range(500), [0.5] * 500, [1.0] * 500) == []


TEXT = """
[campaign]
world = "world.toml"
runs = 100
seed = 7
end = "1500 ms"
design = "saltelli"
[[vary]]
name = "t"
between = ["500 ms", "1500 ms"]
[[vary]]
name = "idle"
choose = ["one", "two", "three"]
[[step]]
at = "t"
do = { set = { "table.IN1" = 1 } }
[[step]]
do = { note = "{idle}" }
[[property]]
holds = "time between x.position > 11 and table.IN1 < 2 s"
"""


def test_a_campaign_says_what_matters(tmp_path: Path) -> None:
    path = campaign_file(tmp_path, TEXT)
    campaign = Campaign.load(path)
    report = write_report(campaign, campaign.run(tmp_path / "out"), tmp_path / "out", path)
    assert [one.name for one in report.indices] == ["t", "idle"]
    assert report.indices[0].total == pytest.approx(1.0, abs=0.25)
    assert (report.indices[1].first, report.indices[1].total) == (0.0, 0.0)
    assert report.to_json(tmp_path)["sobol_indices"][1]["name"] == "idle"
    page = report.html(tmp_path)
    assert "Sobol indices of the least robustness" in page
    assert "Spearman" not in page


def test_chance_is_that_of_the_first_point_but_in_the_second(tmp_path: Path) -> None:
    cases = Campaign.load(campaign_file(tmp_path, TEXT)).cases
    one, other, *between = (cases[n] for n in range(4))
    assert one.seed != other.seed
    assert {case.seed for case in between} == {one.seed}
    assert isinstance(one, Case)


def test_a_grid_has_no_place_in_it(tmp_path: Path) -> None:
    with pytest.raises(Misuse, match="design = 'saltelli' draws all values"):
        load_campaign(campaign_file(tmp_path, TEXT.replace("choose =", "grid =")))


def test_the_cosine_has_no_first_order_where_it_is_a_product() -> None:
    found = indices(lambda point: cos(pi * point[0]) * cos(pi * point[1]), 512)
    assert abs(found["x1"].first) < 0.1
    assert found["x1"].total > 0.8
    assert found["x3"].total == 0.0
