"""Single runs of a campaign."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from campaigns import CAMPAIGN, WORLD, campaign_file

from steptwin.campaign.campaign import Campaign
from steptwin.campaign.findings import shrinker
from steptwin.campaign.shrink import failures_of
from steptwin.controller import SECOND
from steptwin.coverage.counts import Coverage
from steptwin.errors import Misuse
from steptwin.simulation.script.steps import Set


@pytest.fixture
def doors(tmp_path: Path) -> Campaign:
    return Campaign.load(campaign_file(tmp_path))


def test_a_run_has_its_steps_measures_and_end(doors: Campaign) -> None:
    for case in (doors.cases[n] for n in range(6)):
        result = doors.run_case(case)
        assert result.measures["opened"] == case.values["t"]
        assert result.measures["place"] == pytest.approx(50.0)  # 10 at the beginning and 40 from there
        assert result.end_ns == SECOND * 3 // 2
        assert result.error is None
        assert result.failed is (float(case.values["t"]) <= 1.0)


def test_an_expectation_in_vain_is_a_verdict(doors: Campaign) -> None:
    case = doors.cases.made(0, 1, {"t": 0.75}, [])
    (verdict,) = doors.run_case(case).verdicts
    assert (verdict.holds, verdict.at_ns, verdict.why) == (False, SECOND, "table.IN1 == 0; table.IN1 is 1")


def test_the_same_case_has_the_same_result_and_others_have_others(doors: Campaign) -> None:
    assert doors.run_case(3) == doors.run_case(3)
    assert doors.run_case(3).digest != doors.run_case(4).digest


def test_a_condition_ends_a_run(tmp_path: Path) -> None:
    text = CAMPAIGN.replace("seed = 7", 'seed = 7\nuntil = "x.position >= 20"')
    result = Campaign.load(campaign_file(tmp_path, text)).run_case(0)
    assert result.end_ns < SECOND
    assert result.measures["place"] == pytest.approx(20.0, abs=1e-3)


def test_a_path_varies_the_world(tmp_path: Path) -> None:
    text = CAMPAIGN + '[[vary]]\npath = "x.start"\nchoose = [5.0, 20.0]\n'
    campaign = Campaign.load(campaign_file(tmp_path, text))
    for n in range(8):
        case = campaign.cases[n]
        assert campaign.run_case(case).measures["place"] == pytest.approx(float(case.values["x.start"]) + 40.0)


def test_a_case_that_the_world_refuses_is_an_error_of_its_run(tmp_path: Path) -> None:
    text = CAMPAIGN + '[[vary]]\npath = "x.pitch"\nchoose = [4.0, -1.0]\n'
    campaign = Campaign.load(campaign_file(tmp_path, text))
    results = {campaign.cases[n].values["x.pitch"]: campaign.run_case(n) for n in range(12)}
    assert results[4.0].error is None
    assert "pitch: -1.0" in str(results[-1.0].error)
    assert (results[-1.0].digest, results[-1.0].failed) == ("", True)


def test_the_world_of_a_case_can_be_looked_at(doors: Campaign) -> None:
    world = doors.world(3)
    world.run_to(doors.description.end_ns)
    assert world.trace.digest() == doors.run_case(3).digest
    assert [type(given.what) for given in world.inputs] == [Set]


COMMON = CAMPAIGN.replace("seed = 7", 'seed = 7\nstart = "400 ms"')


def test_runs_from_a_common_beginning_are_those_from_the_beginning(tmp_path: Path) -> None:
    branched = Campaign.load(campaign_file(tmp_path, COMMON))
    anew = Campaign.load(campaign_file(tmp_path, CAMPAIGN))
    for n in range(6):
        case = branched.cases[n]
        one, other = branched.run_case(case), anew.run_case(replace(case, seed=branched.description.seed))
        assert one == other
        world = branched.world(case)
        world.run_to(case.end_ns)
        assert world.trace.digest() == one.digest
        assert len(list(world.trace)) == len(world.trace)


PROPERTIES = """
[[property]]
name = "far"
eventually = "x.position > 45"
[[property]]
name = "shut while it moves"
never = "table.IN1 and table.M1.moving"
"""


def test_properties_have_verdicts_and_distances(tmp_path: Path) -> None:
    campaign = Campaign.load(campaign_file(tmp_path, CAMPAIGN + PROPERTIES))
    early, late = (campaign.run_case(campaign.cases.made(0, 1, {"t": t}, [])) for t in (0.2, 1.4))
    far, shut, expected = early.verdicts
    assert (far.name, far.holds, far.robustness > 0) == ("far", True, True)
    assert (shut.holds, shut.at_ns, shut.robustness < 0) == (False, SECOND // 5, True)
    assert expected.name == "expectations of the scripts"
    assert [(one.name, one.holds) for one in late.verdicts] == [("far", True), ("shut while it moves", True)]


def test_properties_know_of_the_common_beginning(tmp_path: Path) -> None:
    """What happens in it counts for each run, as if it had run it itself."""
    early = '[[property]]\nname = "never below 30"\nnever = "x.position < 30"\n'
    branched = Campaign.load(campaign_file(tmp_path, COMMON + PROPERTIES + early))
    anew = Campaign.load(campaign_file(tmp_path, CAMPAIGN + PROPERTIES + early))
    for n in range(3):
        case = branched.cases[n]
        one = branched.run_case(case)
        assert one == anew.run_case(replace(case, seed=branched.description.seed))
        assert not one.verdicts[2].holds


def test_expectations_of_scripts_need_not_count(tmp_path: Path) -> None:
    text = CAMPAIGN.replace("seed = 7", "seed = 7\nexpectations = false")
    assert Campaign.load(campaign_file(tmp_path, text)).run().failed == 0


@pytest.mark.parametrize("counts", [True, False])
def test_a_request_that_is_lost_on_the_line_fails_the_run(tmp_path: Path, counts: bool) -> None:
    world = WORLD.replace('name = "table"', 'name = "table"\nline = "bus"', 1) + '[[line]]\nname = "bus"\nkind = "modbus"\n'
    world = world.replace('name = "go"', 'name = "go"\nat = "10 ms"')  # after the fault
    text = f"""
[campaign]
world = "world.toml"
runs = 1
end = "20 s"
expectations = {str(counts).lower()}
[[fault]]
do = "no-answer line=bus"
"""
    result = Campaign.load(campaign_file(tmp_path, text, world)).run_case(0)
    assert result.failed is counts
    why = [one.why for one in result.verdicts if one.name == "waits of the scripts"]
    assert why == (["go waited in vain for an answer on bus"] if counts else [])


def test_nothing_can_happen_before_the_end_of_a_common_beginning(tmp_path: Path) -> None:
    branched = Campaign.load(campaign_file(tmp_path, COMMON))
    result = branched.run_case(branched.cases.made(0, 1, {"t": 0.3}, []))
    assert result.error == "0.3 s: this is before 0.4 s, up to which all runs have one beginning (start)"


def test_a_world_that_ends_before_its_beginning_does_is_refused(tmp_path: Path) -> None:
    world = WORLD + '[[script]]\nname = "end"\nat = "100 ms"\nsteps = [{ stop = "done" }]\n'
    campaign = Campaign.load(campaign_file(tmp_path, COMMON, world))
    with pytest.raises(Misuse, match=r"start = 0.4 s: the world ends its run at 0.1 s: done"):
        campaign.run_case(0)


@pytest.mark.parametrize("start", ["", '\nstart = "400 ms"'])
def test_coverage_counts_what_programs_execute(tmp_path: Path, start: str) -> None:
    (tmp_path / "loop.prg").write_text("LOOP:\nDELAY 0.1\nJUMP LOOP\n")
    world = '[[mic488]]\nname = "table"\nprogram = "loop.prg"\nstart = true\n'
    text = f'[campaign]\nworld = "world.toml"\nend = "1 s"\nruns = 2{start}\n'
    campaign = Campaign.load(campaign_file(tmp_path, text, world))
    counts = []
    for _ in range(2):
        coverage = Coverage()
        campaign.runner.run(campaign.cases[0], coverage)
        (found,) = coverage
        counts.append({found.source.position(at)[0]: count for at, count in found.hits.items()})
    assert counts[0] == counts[1]
    assert counts[0][2] in {10, 11}  # a delay of 100 ms in 1 s, also in the common beginning


COUNTED = """
[campaign]
world = "world.toml"
runs = 1
end = "1500 ms"
expectations = false
[[vary]]
name = "t"
between = ["0 s", "1 s"]
[[step]]
at = "t"
do = { set = { "table.IN1" = 1 } }
[[fault]]
at = "10 ms"
do = "stall machine=table axis=1"
[[property]]
"""


@pytest.mark.parametrize(
    ("text", "needs_fault"),
    [
        ("eventually x.position > 39", True),
        ("table.IN2 == 0 until x.position > 39", True),
        ("(always table.IN1 == 0) or (eventually x.position > 39)", True),
        ("count(x.position > 39) >= 1", True),
        ("not (time between table.IN1 and x.position > 39 <= 1 s)", False),
        ("count(table.IN2) == 2", False),
    ],
)
def test_what_never_comes_is_not_made_simpler_by_an_early_end(tmp_path: Path, text: str, needs_fault: bool) -> None:
    campaign = Campaign.load(campaign_file(tmp_path, f'{COUNTED}holds = "{text}"\n'))
    case = campaign.cases[0]
    (failure,) = failures_of(campaign.run_case(case))
    found = shrinker(campaign.description, campaign.run_case)(case, failure)
    assert found.case.end_ns == case.end_ns
    assert bool(found.case.faults) is needs_fault
