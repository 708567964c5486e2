"""Reports of campaigns, their comparison, and campaigns inside of tests."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from pages import PYTEST_OF_USERS

from steptwin.campaign.campaign import Campaign
from steptwin.campaign.case import Case, CaseResult, FaultAt, Verdict
from steptwin.campaign.findings import FoundFailure
from steptwin.campaign.report.campaignpage import CampaignReport
from steptwin.campaign.report.comparison import compare, lines
from steptwin.campaign.report.statistics import RunColumns, histogram, influences
from steptwin.campaign.report.write import write_report
from steptwin.campaign.results import StoredCase
from steptwin.campaign.shrink import failures_of
from steptwin.campaign.summary import CampaignSummary
from steptwin.errors import Misuse

EXAMPLES = Path(__file__).parents[3] / "examples" / "worlds"
CAMPAIGN = """
[campaign]
world = "press.toml"
runs = 20
end = "12 s"
[[vary]]
name = "t"
between = ["0 s", "3 s"]
[[vary]]
path = "ram.extend_time"
between = ["200 ms", "600 ms"]
[[fault]]
do = "jam element=ram"
at = "t"
chance = 0.5
[[measure]]
name = "down after <s>"
when = "ram.extended"
"""


def written(folder: Path, text: str = CAMPAIGN) -> tuple[CampaignReport, Path]:
    shutil.copytree(EXAMPLES / "press", folder, dirs_exist_ok=True)
    (folder / "campaign.toml").write_text(text, encoding="utf-8")
    campaign = Campaign.load(folder / "campaign.toml")
    summary = campaign.run(folder / "out")
    return write_report(campaign, summary, folder / "out", folder / "campaign.toml"), folder / "out"


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> tuple[CampaignReport, Path]:
    return written(tmp_path_factory.mktemp("campaign"))


def test_the_page_needs_no_network_and_links_what_is_there(report: tuple[CampaignReport, Path]) -> None:
    found, folder = report
    text = (folder / "report.html").read_text(encoding="utf-8")
    assert "http" not in text
    assert "down after &lt;s&gt;" in text
    assert f"{found.summary.pass_rate:.2%} pass" in text
    for cause in found.found:
        files = cause.to_json(folder)["files"]
        assert set(files) == {"page", "session", "timeline", "test"}
        assert all((folder / file).is_file() and file in text for file in files.values())


def test_the_fault_matters_most(report: tuple[CampaignReport, Path]) -> None:
    found, _ = report
    assert found.influences
    assert found.influences[0].name == "fault jam element=ram"
    assert found.influences[0].correlation < -0.5
    assert [one.name for one in found.histograms] == ["down after <s>"]
    assert sum(found.histograms[0].counts) == found.histograms[0].count > 0


def test_junit_has_a_failure_for_each_property_that_failed(report: tuple[CampaignReport, Path]) -> None:
    found, folder = report
    suite = ET.parse(folder / "junit.xml").getroot()
    assert [case.attrib["name"] for case in suite] == ["expectations of the scripts", "waits of the scripts"]
    assert suite.attrib["tests"] == suite.attrib["failures"] == "2"
    failure = suite.find("testcase/failure")
    assert failure is not None
    counts = {one.failure.property: len(one.numbers) for one in found.found}
    assert sum(counts.values()) == found.summary.failed  # each run is of one cause
    assert failure.attrib["message"].startswith(f"{counts['expectations of the scripts']} of 20 runs")
    assert "jam element=ram" in failure.attrib["message"]


def test_json_has_the_summary_and_the_causes(report: tuple[CampaignReport, Path]) -> None:
    found, folder = report
    plain = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    assert plain["digest"] == found.summary.digest
    assert plain["causes"][0]["simplest"]["faults"][0]["fault"].startswith("jam")


def test_two_campaigns_beside_each_other(report: tuple[CampaignReport, Path], tmp_path: Path) -> None:
    _, before = report
    _, after = written(tmp_path, CAMPAIGN.replace("chance = 0.5", "chance = 0.001"))
    assert compare(before, before)["verdict"] == "the same"
    found = compare(before, after)
    assert found["verdict"] == "better"
    assert found["p_value"] < 0.05
    assert [name for name, _ in found["gone"]] == ["expectations of the scripts", "waits of the scripts"]
    assert compare(after, before)["verdict"] == "worse"
    assert any("gone" in line for line in lines(found))
    with pytest.raises(Misuse, match=r"no report\.json"):
        compare(before, tmp_path / "nothing")


def test_ranks_decide() -> None:
    cases = [(Case(n, {"a": n * n, "b": 1.0, "c": "x"}, (), (), 1, 1), n) for n in range(10)]
    results = [(case, CaseResult(case.number, (Verdict("p", True, -float(n), None, ""),), "", 1, {})) for case, n in cases]
    (found,) = influences(RunColumns.of(results))
    assert (found.name, found.of) == ("a", "robustness")
    assert found.correlation == pytest.approx(-1.0)


def test_a_fault_that_is_missing_counts_as_none() -> None:
    fault = FaultAt(1, "jam element=ram name=jam-1-ff")
    results = [
        (Case(n, {}, (fault,) * (n % 2), (), 1, 1), CaseResult(n, (Verdict("p", n % 2 == 0, 1.0 - n % 2, None, ""),), "", 1, {}))
        for n in range(8)
    ]
    (found,) = influences(RunColumns.of(results))
    assert found.name == "fault jam element=ram"
    assert found.correlation == pytest.approx(-1.0)


def test_a_fault_with_what_varies_is_one() -> None:
    results = [
        (
            Case(n, {}, (FaultAt(1, f"stall machine=m axis=1 for_s={n / 10}"),) * (n % 2), (), 1, 1),
            CaseResult(n, (Verdict("p", n % 2 == 0, 1.0 - n % 2, None, ""),), "", 1, {}),
        )
        for n in range(8)
    ]
    words = "stall machine=m axis=1 for_s={length}"
    assert [one.name for one in influences(RunColumns.of(results, [words]))] == [f"fault {words}"]


def test_without_numbers_there_is_no_histogram() -> None:
    assert histogram("x", []) is None
    assert histogram("x", [float("nan")]) is None
    one = histogram("x", [2.0])
    assert one is not None
    assert one.counts == (1,)


def test_the_greatest_number_is_in_the_last_bar_of_a_histogram() -> None:
    one = histogram("x", [0.0, 1.0, 4.0, 3.9, float("inf")])
    assert one is not None
    assert (one.edges, one.counts) == ((0.0, 1.0, 2.0, 3.0, 4.0), (1, 1, 0, 2))
    assert (one.count, one.least, one.mean, one.most) == (4, 0.0, 2.225, 4.0)


TEST = """
import pytest

@pytest.mark.steptwin_campaign("campaign.toml", runs=4)
def test_it(steptwin_campaign):
    assert steptwin_campaign.runs == 4
"""


@pytest.mark.parametrize(("chance", "shown"), [("0.001", "1 passed"), ("1.0", "4 of 4 runs failed")])
def test_a_campaign_inside_of_a_test(chance: str, shown: str, tmp_path: Path) -> None:
    shutil.copytree(EXAMPLES / "press", tmp_path, dirs_exist_ok=True)
    (tmp_path / "campaign.toml").write_text(CAMPAIGN.replace("chance = 0.5", f"chance = {chance}"), encoding="utf-8")
    (tmp_path / "test_press.py").write_text(TEST, encoding="utf-8")
    command = [sys.executable, "-m", "pytest", "-q", *PYTEST_OF_USERS, "test_press.py"]
    ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert shown in ran.stdout
    assert ("jam element=ram" in ran.stdout) is (chance == "1.0")


def test_files_for_ci_are_xml_whatever_names_contain() -> None:
    summary = CampaignSummary.of(
        "a\x1b<&>", "d", 1, [(Case(0, {}, (), (), 1, 100), CaseResult(0, (Verdict("p\x07", True, 1.0, 0, ""),), "", 100, {}))]
    )
    page = CampaignReport(summary=summary, found=(), influences=(), histograms=(), search="random")
    suite = ET.fromstring(page.junit())
    assert (suite.get("name"), suite.find("testcase").get("name")) == ("a\ufffd<&>", "p\ufffd")  # type: ignore[union-attr]


def test_a_report_of_what_ended_by_failure_has_nothing_after_it(tmp_path: Path) -> None:
    shutil.copytree(EXAMPLES / "press", tmp_path, dirs_exist_ok=True)
    text = CAMPAIGN.replace("runs = 20", "runs = 20\nuntil_failure = true") + '[[property]]\nalways = "ram.position < 1"\n'
    (tmp_path / "campaign.toml").write_text(text, encoding="utf-8")
    campaign = Campaign.load(tmp_path / "campaign.toml")
    summary = campaign.run(tmp_path / "out")
    store = campaign.open_store(tmp_path / "out")
    store.add([StoredCase(campaign.cases[n], campaign.run_case(n)) for n in (1, 2)])  # of another process, meanwhile
    store.close()
    report = write_report(campaign, summary, tmp_path / "out", None)
    assert [one.numbers for one in report.found] == [(0,)]
    assert report.histograms[0].count == 1


def test_what_fails_only_after_something_else_fails_for_ci_too() -> None:
    verdicts = (Verdict("first", False, -1.0, 3, "early"), Verdict("second", False, -1.0, 5, "late"))
    result = CaseResult(0, verdicts, "", 100, {})
    summary = CampaignSummary.of("n", "d", 1, [(Case(0, {}, (), (), 1, 100), result)])
    found = FoundFailure(failures_of(result)[0], (0,), result, None, None)
    suite = ET.fromstring(CampaignReport(summary=summary, found=[found], influences=(), histograms=(), search="random").junit())
    assert suite.get("failures") == "2"
    messages = {case.get("name"): case[0].get("message") for case in suite}
    assert messages["second"] == "1 of 1 runs, in each of which another property failed before"
