"""Shrinking of failed cases, with toy runs: a function of the case says whether it fails."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steptwin.campaign.case import Case, CaseResult, FaultAt, StepAt, VariedValue, Verdict
from steptwin.campaign.shrink import ADDED, ERROR, CaseFailure, digits_of, failures_of, rounder_numbers, shrink

SAFE = CaseFailure("safe", "it moved at # mm")
END = 10_000_000_000


def case_of(faults: int = 0, steps: int = 0, values: Mapping[str, VariedValue] | None = None, at: int = 1_234_567_890) -> Case:
    return Case(
        7,
        dict(values or {}),
        tuple(FaultAt(at + n, f"stall machine=m{n} for_s=0.4837", ADDED) for n in range(faults)),
        tuple(StepAt(at + n, f'{{"press": "b{n}"}}', ADDED) for n in range(steps)),
        5,
        END,
    )


class Toy:
    """Runs that fail where ``fails`` says so, at 3 s; ``asked`` are the cases that ran."""

    def __init__(self, fails: Callable[[Case], bool], at: int | None = 3_000_000_000) -> None:
        self.fails = fails
        self.at = at
        self.asked: list[Case] = []

    def __call__(self, case: Case) -> CaseResult:
        self.asked.append(case)
        bad = self.fails(case) and (self.at is None or case.end_ns >= self.at)
        verdict = Verdict("safe", not bad, -1.0 if bad else 1.0, self.at if bad else None, "it moved at 3.5 mm" if bad else "")
        return CaseResult(case.number, (verdict,), "", case.end_ns, {})


def controllers(case: Case) -> set[str]:
    return {one.fault.split()[1].removeprefix("machine=") for one in case.faults}


@given(st.integers(1, 12).flatmap(lambda n: st.tuples(st.just(n), st.sets(st.integers(0, n - 1)))))
def test_exactly_the_needed_faults_stay(drawn: tuple[int, set[int]]) -> None:
    count, needed = drawn
    wanted = {f"m{n}" for n in needed}
    found = shrink(case_of(count, steps=3), SAFE, Toy(lambda case: wanted <= controllers(case)))
    assert controllers(found.case) == wanted
    assert found.case.steps == ()
    assert found.repeats
    assert found.is_complete


@given(st.floats(0.0, 1e6), st.floats(0.0, 1e6))
def test_numbers_become_round_but_still_fail(value: float, border: float) -> None:
    if value < border:
        value, border = border, value
    found = shrink(case_of(values={"x": value}), SAFE, Toy(lambda case: float(case.values["x"]) >= border))
    assert float(found.case.values["x"]) >= border
    assert digits_of(found.case.values["x"]) <= digits_of(value)
    assert not any(digits_of(one) < digits_of(found.case.values["x"]) and one >= border for one in rounder_numbers(value))


def test_moments_and_parameters_of_added_faults_become_round() -> None:
    found = shrink(case_of(1), SAFE, Toy(lambda case: bool(case.faults) and case.faults[0].at_ns > 1_200_000_000))
    assert found.case.faults == (FaultAt(2_000_000_000, "stall machine=m0 for_s=0.0", ADDED),)


def test_faults_of_tables_follow_the_values() -> None:
    def with_values(case: Case, values: Mapping[str, VariedValue]) -> Case:
        return replace(
            case, values=values, faults=tuple(replace(one, at_ns=int(float(values["t"]) * 1e9)) for one in case.faults)
        )

    first = with_values(replace(case_of(), faults=(FaultAt(0, "stall for_s=0.4837", 0),)), {"t": 1.23456})
    toy = Toy(lambda case: any(one.at_ns > 1_000_000_000 for one in case.faults))
    found = shrink(first, SAFE, toy, with_values=with_values)
    assert found.case.values == {"t": 2.0}
    assert found.case.faults == (FaultAt(2_000_000_000, "stall for_s=0.4837", 0),)


def test_values_that_do_not_matter_are_left_to_the_description() -> None:
    values: dict[str, VariedValue] = {"x.friction": 0.31, "y.friction": 0.22, "z.kind": "new", "n": 4}
    toy = Toy(lambda case: float(case.values.get("y.friction", 0.1)) > 0.2)
    found = shrink(case_of(values=values), SAFE, toy, optional=("x.friction", "y.friction", "z.kind"))
    assert found.case.values == {"y.friction": 0.3, "n": 0}


def test_only_permitted_values_are_tried() -> None:
    toy = Toy(lambda case: True)
    found = shrink(
        case_of(values={"x": 0.37}), SAFE, toy, permitted=lambda name, value: isinstance(value, float) and value >= 0.25
    )
    assert found.case.values == {"x": 0.4}
    assert all(float(case.values["x"]) >= 0.25 for case in toy.asked)


def test_the_end_is_the_moment_of_the_violation() -> None:
    found = shrink(case_of(2), SAFE, Toy(lambda case: True))
    assert found.case.end_ns == 3_000_000_000


def test_a_failure_without_a_moment_keeps_its_end() -> None:
    assert shrink(case_of(1), SAFE, Toy(lambda case: True, at=None)).case.end_ns == END


def test_a_failure_that_does_not_repeat_is_not_shrunk() -> None:
    toy = Toy(lambda case: False)
    found = shrink(case_of(3), SAFE, toy)
    assert not found.repeats
    assert found.case == case_of(3)
    assert len(toy.asked) == 1


def test_another_property_is_another_failure() -> None:
    def run(case: Case) -> CaseResult:
        name = "safe" if case.faults else "quick"
        return CaseResult(7, (Verdict(name, False, -1.0, None, "why"),), "", END, {})

    found = shrink(case_of(2), SAFE, run)
    assert len(found.case.faults) == 1


@pytest.mark.parametrize("runs", [1, 2, 5])
def test_the_budget_of_runs_is_kept(runs: int) -> None:
    toy = Toy(lambda case: len(case.faults) >= 5)
    found = shrink(case_of(12, 12), SAFE, toy, runs=runs)
    assert len(toy.asked) == found.runs == runs
    assert not found.is_complete
    assert toy.fails(found.case)


def test_the_budget_of_time_is_kept() -> None:
    toy = Toy(lambda case: len(case.faults) >= 5)
    found = shrink(case_of(12), SAFE, toy, is_over=lambda: len(toy.asked) >= 4)
    assert len(toy.asked) == 4
    assert not found.is_complete


def test_what_is_simplest_stays_and_no_case_runs_twice() -> None:
    toy = Toy(lambda case: len(case.faults) >= 3 and float(case.values["x"]) > 17.5)
    found = shrink(case_of(9, 4, {"x": 18.25}), SAFE, toy)
    assert len({case.digest for case in toy.asked[1:]}) == len(toy.asked) - 1
    again = shrink(found.case, SAFE, Toy(toy.fails))
    assert again.case == found.case


def test_errors_shrink_to_the_same_error() -> None:
    def run(case: Case) -> CaseResult:
        value = float(case.values["x"])
        text = f"x = {value} is too large" if value > 3 else f"x = {value} is too small" if value < 1 else None
        return CaseResult(7, (), "", END, {}, text)

    found = shrink(case_of(1, 1, {"x": 7.31}), CaseFailure(ERROR, "x = # is too large"), run)
    assert found.case.values == {"x": 7.0}
    assert found.case.faults == ()


def test_failures_in_the_order_of_their_moments() -> None:
    verdicts = (Verdict("late", False, -1, 9, "a"), Verdict("fine", True, 1, 1, ""), Verdict("early", False, -1, 4, "at 4.5 mm"))
    result = CaseResult(1, verdicts, "", 10, {})
    assert failures_of(result) == [CaseFailure("early", "at # mm"), CaseFailure("late", "a")]


@pytest.mark.parametrize(
    ("number", "digits"), [(0, 0), (0.0, 0), (5, 1), (500, 1), (0.15, 2), (-2.5, 2), (1e-9, 1), (10_000_001, 8), (True, 0)]
)
def test_significant_digits(number: float, digits: int) -> None:
    assert digits_of(number) == digits


def test_rounder_numbers_have_fewer_digits_and_are_near() -> None:
    assert list(rounder_numbers(0.1234)) == [0.0, 0.1, 0.2, 0.12, 0.13, 0.123, 0.124]
    assert list(rounder_numbers(1289)) == [0, 1000, 2000, 1300, 1200, 1290, 1280]
    assert list(rounder_numbers(-3.7)) == [-0.0, -4.0, -3.0]
    assert all(isinstance(one, int) for one in rounder_numbers(1289))


def test_a_failure_at_the_first_moment_is_a_run_without_length() -> None:
    found = shrink(case_of(steps=2), SAFE, Toy(lambda case: True, at=0))
    assert (found.case.end_ns, found.case.steps, found.is_complete) == (0, (), True)
