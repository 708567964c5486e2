"""What came of a campaign in numbers."""

from __future__ import annotations

import pytest

from steptwin.campaign.case import Case, CaseResult, Verdict
from steptwin.campaign.summary import CampaignSummary, percent, why, wilson


@pytest.mark.parametrize(("passed", "runs"), [(0, 1), (1, 1), (7, 10), (999, 1000), (0, 50), (50, 50)])
def test_the_interval_is_wilsons(passed: int, runs: int) -> None:
    stats = pytest.importorskip("scipy.stats")
    expected = stats.binomtest(passed, runs).proportion_ci(0.95, method="wilson")
    assert wilson(passed, runs) == pytest.approx((expected.low, expected.high), abs=1e-12)


def test_without_runs_nothing_is_known() -> None:
    assert wilson(0, 0) == (0.0, 1.0)
    empty = CampaignSummary.of("n", "d", 1, [])
    assert (empty.pass_rate, empty.runs) == (None, 0)


def case(number: int) -> Case:
    return Case(number, {"a": 0.5}, (), (), 1, 100)


def result(number: int, robustness: float, error: str | None = None) -> CaseResult:
    return CaseResult(number, (Verdict("p", robustness > 0, robustness, 5, "why not"),), f"{number}", 100, {}, error)


def test_properties_failures_and_errors_are_counted() -> None:
    results = [(case(0), result(0, 2.0)), (case(1), result(1, -1.0)), (case(2), result(2, 1.0, "refused\nat length"))]
    found = CampaignSummary.of("n", "d", 1, results)
    assert (found.runs, found.failed, found.errors, found.passed) == (3, 2, 1, 1)
    assert (found.properties["p"].failed, found.properties["p"].robustness, found.properties["p"].case) == (1, -1.0, 1)
    assert [(one.number, one.why) for one in found.failures] == [(1, "p: why not"), (2, "refused")]
    plain = found.to_json()
    assert (plain["pass_rate"], plain["confidence"]) == (pytest.approx(1 / 3), 0.95)
    assert plain["failures"][0]["case"]["values"] == {"a": 0.5}


def test_the_digest_is_that_of_all_results_in_order() -> None:
    results = [(case(n), result(n, 1.0)) for n in range(3)]
    one = CampaignSummary.of("n", "d", 1, results)
    assert CampaignSummary.of("other", "e", 2, results).digest == one.digest
    assert CampaignSummary.of("n", "d", 1, results[:2]).digest != one.digest
    assert CampaignSummary.of("n", "d", 1, [*results[:2], (case(2), result(2, 1.5))]).digest != one.digest


def test_a_reason_is_one_line() -> None:
    assert why(result(1, -1.0, "x" * 1000)) == "x" * 299 + "…"
    assert why(CaseResult(1, (), "", 0, {}, "")) == "an error"


@pytest.mark.parametrize(
    ("share", "text"), [(0.0, "0.00%"), (1.0, "100.00%"), (0.5, "50.00%"), (1 - 1e-5, "99.999%"), (1e-6, "0.0001%")]
)
def test_a_share_is_all_or_none_only_where_it_is(share: float, text: str) -> None:
    assert percent(share) == text
