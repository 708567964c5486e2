"""What a campaign finds: causes apart from each other, and their simplest cases as files that show them again."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from pages import PYTEST_OF_USERS

from steptwin.campaign.cases import Cases
from steptwin.campaign.findings import FoundFailure, find, is_within
from steptwin.campaign.reading import load_campaign
from steptwin.campaign.reproduce import check_case, identifier
from steptwin.campaign.runner import CaseRunner
from steptwin.campaign.shrink import digits_of, failures_of
from steptwin.campaign.variation import Between, Choice, Normal
from steptwin.files import recording as recordings

WORLD = """
[[mic488]]
name = "table"
[mic488.M1]
unit = "mm"
gear = 800.0
vel = 100.0

[[axis]]
name = "x"
drive = "table.M1"
pitch = 4.0

[[axis.switch]]
position = 30.0
width = 2.0
to = "table.IN1"

[[script]]
name = "go"
steps = [
  { write = { "table.M1_EN" = 1 } },
  { wait = "100 ms" },
  { move = "table.M1", to = 40.0, within = "3 s" },
  { wait = "10 ms" },
  { expect = "x.lost == 0" },
  { expect = "table.IN1 == 0 and x.position > 39" },
]
"""
CAMPAIGN = """
[campaign]
world = "world.toml"
runs = 20
end = "4 s"

[[vary]]
name = "t"
between = ["200 ms", "400 ms"]

[[vary]]
path = "x.backlash"
between = [0.0, 0.01]

[[fault]]
do = "lost-steps axis=1 pulses=40"
at = "t"
chance = 0.5

[[fault]]
do = "stuck pin=IN1 value=1"
at = "t"
chance = 0.5
"""


@pytest.fixture
def campaign(tmp_path: Path) -> Path:
    (tmp_path / "world.toml").write_text(WORLD, encoding="utf-8")
    (tmp_path / "campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    return tmp_path / "campaign.toml"


@pytest.fixture
def found(campaign: Path) -> list[FoundFailure]:
    description = load_campaign(campaign)
    runner, cases = CaseRunner(description), Cases(description)
    results = [runner.run(cases[number]) for number in range(20)]
    return find(runner, [one for one in results if one.failed], cases.__getitem__, campaign.parent / "out", campaign)


def test_each_cause_has_its_simplest_case(found: list[FoundFailure]) -> None:
    assert all(one.shrunk is not None and one.shrunk.is_complete for one in found)
    cases = [one.shrunk.case for one in found if one.shrunk is not None]
    assert {tuple(fault.fault for fault in case.faults) for case in cases} == {
        ("lost-steps axis=1 pulses=40",),
        ("stuck pin=IN1 value=1",),
    }
    assert all(case.values.keys() == {"t"} and digits_of(case.values["t"]) == 1 for case in cases)
    assert all(case.end_ns < 4_000_000_000 for case in cases)


def test_the_session_is_the_run_of_the_case(found: list[FoundFailure], campaign: Path) -> None:
    for one in found:
        assert one.files is not None
        assert one.files.session is not None
        recording = recordings.load(one.files.session)
        assert recording.digest == one.result.digest
        assert recording.replay().trace.digest() == recording.digest
        assert one.files.timeline is not None
        assert "table" in one.files.timeline.read_text(encoding="utf-8")
        assert one.files.page is not None
        page = one.files.page.read_text(encoding="utf-8")
        assert one.files.timeline.name in page
        why = page[page.index("<h2>Why") : page.index("<h2>Timeline")]
        (fault,) = one.shrunk.case.faults if one.shrunk is not None else ()
        assert f"fault {fault.fault.split()[0]}" in why
        assert one.to_json(campaign.parent)["files"]["session"].startswith("out")


def test_the_test_fails_until_the_program_is_mended(found: list[FoundFailure], campaign: Path) -> None:
    tests = [str(one.files.test) for one in found if one.files is not None]
    command = [sys.executable, "-m", "pytest", "-q", *PYTEST_OF_USERS, *tests]
    failing = subprocess.run(command, cwd=campaign.parent, capture_output=True, text=True, check=False)
    assert f"{len(tests)} failed" in failing.stdout
    assert "x.lost == 0" in failing.stdout
    mended = WORLD.replace('  { expect = "x.lost == 0" },\n', "").replace("table.IN1 == 0 and x.position > 39", "time > 0.1")
    (campaign.parent / "world.toml").write_text(mended, encoding="utf-8")
    passing = subprocess.run(command, cwd=campaign.parent, capture_output=True, text=True, check=False)
    assert f"{len(tests)} passed" in passing.stdout


def test_what_only_the_early_end_of_the_simplest_case_violates_is_left_out(campaign: Path) -> None:
    """The axis arrives at 0.9 s, long after it is too far: only that is wrong, and once it is mended the test passes."""
    properties = """expectations = false
[[property]]
name = "not so far"
always = "x.position < 10"
[[property]]
name = "arrives"
eventually = "x.position > 39"
"""
    campaign.write_text(CAMPAIGN.partition("[[fault]]")[0].replace("[[vary]]", f"{properties}\n[[vary]]", 1))
    description = load_campaign(campaign)
    runner, cases = CaseRunner(description), Cases(description)
    (found,) = find(runner, [runner.run(cases[3])], cases.__getitem__, campaign.parent / "out", campaign)
    assert found.result.end_ns < 500_000_000
    assert found.to_json(campaign.parent)["what"].startswith("not so far: x.position is 10 mm, not < 10 mm at 0.")
    assert "arrives" not in found.to_json(campaign.parent)["what"]
    assert found.files is not None
    assert found.files.test is not None
    text = found.files.test.read_text(encoding="utf-8")
    assert "PROPERTIES = ['not so far']" in text
    case = cases.made(1, 1, {"t": 0.25}, [], end_ns=found.result.end_ns).to_json()
    with pytest.raises(AssertionError, match=r"not so far: [^;]*$"):
        check_case(campaign, case, ["not so far"])
    with pytest.raises(AssertionError, match="arrives"):
        check_case(campaign, case)
    check_case(campaign, {**case, "end_ns": 200_000_000}, ["not so far"])


def test_a_case_that_fails_is_an_assertion(campaign: Path) -> None:
    case = Cases(load_campaign(campaign)).made(1, 1, {"t": 0.25}, [0])
    with pytest.raises(AssertionError, match=r"x\.lost == 0"):
        check_case(campaign, case.to_json())
    check_case(campaign, {**case.to_json(), "faults": ()})


@pytest.mark.parametrize(
    ("spread", "inside", "outside"),
    [
        (Between(1.0, 2.0), 1.5, 2.5),
        (Between(1, 9, is_whole=True), 4, 4.5),
        (Normal(0.0, 1.0, low=-1.0), 8.0, -1.5),
        (Choice(("a", "b")), "b", "c"),
        (Between(0.0, 2.0), 1.0, True),
    ],
)
def test_only_values_of_a_spread_are_within(spread: Between | Normal | Choice, inside: float | str, outside: float | str) -> None:
    assert is_within(spread, inside)
    assert not is_within(spread, outside)


def test_names_of_files() -> None:
    assert identifier("Guard: stops it!") == "guard_stops_it"
    assert identifier("…") == "case"


def test_causes_that_differ_before_they_are_made_simple_only_are_one(campaign: Path) -> None:
    """With a stuck input the property fails in other words, but without it, too; the values of the simplest cases differ. Those
    that are times have their unit."""
    properties = 'expectations = false\n[[property]]\nname = "near"\nalways = "x.position < 10 and not table.IN1"\n'
    properties += '[[vary]]\nname = "u"\nchoose = [3, 4, 5, 6]\n'
    campaign.write_text(CAMPAIGN.replace("[[vary]]", f"{properties}\n[[vary]]", 1))
    description = load_campaign(campaign)
    runner, cases = CaseRunner(description), Cases(description)
    results = [runner.run(cases[number]) for number in range(12)]
    assert len({failures_of(one)[0].cause for one in results}) > 1
    (found,) = find(runner, results, cases.__getitem__, campaign.parent / "out", campaign)
    assert len(found.numbers) == 12
    assert found.where is not None
    assert re.match(r"u = \d; t = \d00 ms; end ", found.where)
