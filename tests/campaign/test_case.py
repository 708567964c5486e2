"""Cases and results as plain values."""

from __future__ import annotations

import json
import pickle
from dataclasses import asdict, replace

from steptwin.campaign.case import Case, CaseResult, FaultAt, StepAt, Verdict

CASE = Case(
    3, {"x.friction": 0.25, "t": 1.5, "kind": "NC", "on": True}, (FaultAt(10, "crc nth=3", 1),), (StepAt(20, "{}"),), 7, 99
)
RESULT = CaseResult(3, (Verdict("quiet", True, 0.5, None, ""), Verdict("safe", False, -1.0, 40, "not so")), "ab", 99, {"m": 1.0})


def test_a_case_is_json_and_pickles() -> None:
    assert Case.from_json(json.loads(json.dumps(CASE.to_json()))) == CASE
    assert pickle.loads(pickle.dumps(CASE)) == CASE


def test_all_that_a_case_and_a_result_have_is_in_their_plain_values() -> None:
    for one in (CASE, RESULT):
        assert json.dumps(one.to_json()) == json.dumps(asdict(one))


def test_equal_cases_have_equal_digests_whatever_their_number() -> None:
    values = dict(reversed(list(CASE.values.items())))
    assert replace(CASE, number=4, values=values).digest == CASE.digest
    for other in (replace(CASE, seed=8), replace(CASE, end_ns=98), replace(CASE, faults=()), replace(CASE, values={})):
        assert other.digest != CASE.digest


def test_a_result_is_json_and_pickles() -> None:
    assert CaseResult.from_json(json.loads(json.dumps(RESULT.to_json()))) == RESULT
    assert pickle.loads(pickle.dumps(RESULT)) == RESULT


def test_a_run_fails_by_an_error_or_by_a_property() -> None:
    assert RESULT.failed
    assert RESULT.robustness == -1.0
    held = replace(RESULT, verdicts=RESULT.verdicts[:1])
    assert not held.failed
    assert replace(held, error="refused").failed
    assert replace(held, verdicts=()).robustness is None
