"""Programs with planted mistakes: a campaign finds each in so many runs, shrinks it to what was planted, and passes the mended
program."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from steptwin.campaign.campaign import Campaign
from steptwin.campaign.case import Case
from steptwin.campaign.findings import shrinker
from steptwin.campaign.shrink import failures_of

PLANTED = Path(__file__).parent / "planted"
S = 1_000_000_000


class Planted(NamedTuple):
    """``nominal``: values of the machine as its builder thinks of it, without faults. ``within``: runs in which a random search
    with the seed of the file finds the mistake. ``fails``: the property that says so."""

    name: str
    nominal: dict[str, Any]
    within: int
    fails: str


RACE = Planted("race", {"measured": 0.9, "arrives": 1.1, "pause": 0.0}, 50, "ejects")
DEBOUNCE = Planted("debounce", {"x.switch.0.bounce": 0.001, "x.backlash": 0.0, "dip": 0.0}, 7, "counts once")
LIMIT = Planted("limit", {"t": 0.0, "u": 0.0, "x.backlash": 0.0}, 32, "stamps in its place")
DEADLOCK = Planted("deadlock", {"first": 0.6, "next": 1.2, "t": 0.0}, 2, "the left one works")
STALL = Planted("stall", {"t": 0.0, "length": 0.2, "u": 0.0}, 4, "stamps in its place")
ALL = (RACE, DEBOUNCE, LIMIT, DEADLOCK, STALL)


def load(which: Planted) -> Campaign:
    return Campaign.load(PLANTED / which.name / "campaign.toml")


def simplest(which: Planted) -> Case:
    """What the first failing case of a random search becomes."""
    campaign = load(which)
    number = campaign.changed(runs=which.within).run().failures[0].number
    failure = next(one for one in failures_of(campaign.run_case(number)) if one.property == which.fails)
    found = shrinker(campaign.description, campaign.run_case)(campaign.cases[number], failure)
    assert found.repeats
    assert found.is_complete
    return found.case


@pytest.mark.parametrize("which", ALL, ids=lambda one: one.name)
def test_the_nominal_run_holds(which: Planted) -> None:
    campaign = load(which)
    result = campaign.run_case(campaign.cases.made(0, 0, which.nominal, ()))
    assert [one.why for one in result.verdicts if not one.holds] == []
    assert result.error is None


@pytest.mark.parametrize("which", ALL, ids=lambda one: one.name)
def test_a_random_search_finds_the_mistake(which: Planted) -> None:
    assert load(which).changed(runs=which.within).run().properties[which.fails].failed == 1


@pytest.mark.parametrize("which", ALL, ids=lambda one: one.name)
def test_the_mended_program_passes(which: Planted, tmp_path: Path) -> None:
    shutil.copytree(PLANTED / which.name, tmp_path, dirs_exist_ok=True)
    shutil.copyfile(tmp_path / "mended.prg", tmp_path / "program.prg")
    summary = Campaign.load(tmp_path / "campaign.toml").run()
    assert [(one.number, one.why) for one in summary.failures] == []
    assert load(which).run().failed > 0


def test_a_race_shrinks_to_the_two_sensors_in_the_wrong_order() -> None:
    case = simplest(RACE)
    assert case.faults == ()
    assert [step.step for step in case.steps] == ['{"press": "bad", "for": "500 ms"}', '{"press": "there", "for": "200 ms"}']
    assert float(case.values["measured"]) > float(case.values["arrives"])


def test_a_missing_debounce_shrinks_to_the_bounces() -> None:
    case = simplest(DEBOUNCE)
    assert case.faults == ()
    assert case.values.keys() - {"dip"} == {"x.switch.0.bounce"}
    assert float(case.values["x.switch.0.bounce"]) > 0.02  # two changes that the input filter of 10 ms lets pass


def test_an_unhandled_limit_shrinks_to_the_limit() -> None:
    case = simplest(LIMIT)
    assert [one.fault for one in case.faults] == ["stuck machine=cell pin=IN2 value=1"]
    assert "x.backlash" not in case.values


def test_a_deadlock_shrinks_to_two_requests_at_a_time() -> None:
    case = simplest(DEADLOCK)
    assert case.faults == ()
    assert len(case.steps) == 2
    assert abs(case.steps[0].at_ns - case.steps[1].at_ns) <= S // 20  # while the other one does not yet look


def test_a_lost_position_shrinks_to_the_stall() -> None:
    (fault,) = simplest(STALL).faults
    assert fault.fault.startswith("stall machine=cell axis=1 for_s=")
