"""Searches for failing cases: every single fault, and guided by robustness."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from statistics import median

import pytest

from steptwin.campaign.campaign import Campaign
from steptwin.campaign.case import Case, CaseResult, Verdict
from steptwin.campaign.search.exhaustive import ExhaustiveCases
from steptwin.campaign.search.guided import FARTHEST, GuidedSearch, distance
from steptwin.campaign.variation import Choice, Varied
from steptwin.errors import Misuse

WORLD = """
[[line]]
name = "bus"
kind = "modbus"

[[mic488]]
name = "table"
line = "bus"

[[script]]
name = "go"
steps = [
  { wait = "10 ms" },
  { set = { "table.IN4" = 1 } },
  { wait = "10 ms" },
  { write = { "table.M1_EN" = 1 } },
  { wait = "1 s" },
  { expect = "table.M1_EN == 1" },
]
"""
CAMPAIGN = """
[campaign]
world = "world.toml"
runs = 24
end = "2 s"
[[vary]]
name = "a"
between = [0.0, 1.0]
[[vary]]
name = "b"
between = [0.0, 1.0]
[[step]]
at = "20 ms"
do = { note = "{a} and {b}" }
"""


@pytest.fixture
def campaign(tmp_path: Path) -> Campaign:
    (tmp_path / "world.toml").write_text(WORLD, encoding="utf-8")
    return Campaign.from_toml(CAMPAIGN, tmp_path)


def test_every_byte_request_and_edge_has_its_case(campaign: Campaign) -> None:
    cases = ExhaustiveCases(campaign.description)
    faults = [cases[number].faults[0] for number in range(cases.count)]
    flips = [one.fault for one in faults if one.fault.startswith("flip line=bus direction=in")]
    assert flips == [f"flip line=bus direction=in nth={n}" for n in range(1, 9)]
    stuck = [one.at_ns for one in faults if one.fault == "stuck machine=table pin=IN4 value=0"]
    assert stuck[0] == 0
    assert 10_000_000 in stuck  # the edge of the input
    assert len({(one.at_ns, one.fault) for one in faults}) == len(faults)


def test_an_exhaustive_search_finds_the_requests_that_matter(campaign: Campaign) -> None:
    summary = campaign.changed(search="exhaustive").run()
    found = {one.case.faults[0].fault.partition(" nth")[0] for one in summary.failures}
    assert {"busy line=bus", "supply-drop machine=table"} <= found
    assert "crc line=bus" not in found  # the answer is wrong, but the drive is on


def nearness(case: Case) -> float:
    """Below 0 in two thousandths of the square."""
    return abs(float(case.values["a"]) - 0.83) + abs(float(case.values["b"]) - 0.27) - 0.03


def asked_until_found(campaign: Campaign, seed: int, most: int = 400) -> int:
    search = GuidedSearch(campaign.changed(seed=seed).cases)
    asked = 0
    while asked < most:
        cases = search.ask()
        asked += len(cases)
        if min(map(nearness, cases)) < 0:
            break
        search.tell([nearness(case) for case in cases])
    return asked


def test_a_guided_search_needs_fewer_cases_than_chance(campaign: Campaign) -> None:
    area = 2 * 0.03**2
    assert median(asked_until_found(campaign, seed) for seed in range(5)) < 0.69 / area / 2  # half of the median of chance


def test_equal_distances_lead_back_to_the_points_of_a_random_search(campaign: Campaign) -> None:
    """A property that is true or false only shows no way: the search is never worse than chance."""
    search = GuidedSearch(campaign.cases)
    asked: list[Case] = []
    for _ in range(6):
        cases = search.ask()
        asked += cases
        search.tell([0.9] * len(cases))
    assert asked == [campaign.cases[n] for n in range(len(asked))]


@pytest.mark.parametrize("values", [1, 2])
def test_a_mistake_at_the_edge_of_a_value_is_found_along_the_slope(campaign: Campaign, values: int) -> None:
    if values == 1:
        campaign = Campaign(replace(campaign.description, vary=campaign.description.vary[:1], steps=()))
    search, asked = GuidedSearch(campaign.cases), 0
    while asked < 100:
        cases = search.ask()
        asked += len(cases)
        distances = [0.95 - float(case.values["a"]) for case in cases]
        if min(distances) < 0:
            break
        search.tell(distances)
    assert asked <= 8


@pytest.mark.parametrize("values", [1, 2])  # that are continuous: estimators, evolution
def test_the_same_cases_for_the_same_results(campaign: Campaign, values: int) -> None:
    if values == 1:
        fixed = Varied("b", False, Choice((0.27, 0.5)))
        campaign = Campaign(replace(campaign.description, vary=(campaign.description.vary[0], fixed)))
    one, other = (GuidedSearch(campaign.cases) for _ in range(2))
    for _ in range(4):
        cases = one.ask()
        assert cases == other.ask()
        one.tell([nearness(case) for case in cases])
        other.tell([nearness(case) for case in cases])
    assert one.ask() != other.ask(3)


def test_a_guided_campaign_goes_on_where_it_was(campaign: Campaign, tmp_path: Path) -> None:
    guided = campaign.changed(search="guided")
    whole = guided.run(tmp_path / "whole")
    assert whole.runs == 24
    guided.changed(runs=12).run(tmp_path / "parts")
    parts = guided.run(tmp_path / "parts")
    assert parts.digest == whole.digest
    assert guided.run(tmp_path / "jobs", jobs=2).digest == whole.digest


def test_without_anything_that_varies_nothing_can_be_guided(campaign: Campaign) -> None:
    fixed = Campaign(replace(campaign.description, vary=(), steps=(), search="guided"))
    with pytest.raises(Misuse, match="nothing varies"):
        fixed.run()
    with pytest.raises(Misuse, match="random, exhaustive, guided"):
        campaign.changed(search="clever")


def test_distances() -> None:
    result = CaseResult(0, (Verdict("a", True, 3.0, None, ""), Verdict("b", True, 0.5, None, "")), "", 1, {})
    assert distance(result) == 0.5
    assert distance(replace(result, error="refused")) == -FARTHEST
    assert distance(replace(result, verdicts=())) == 0.0
    assert distance(replace(result, verdicts=(Verdict("a", True, float("inf"), None, ""),))) == FARTHEST
