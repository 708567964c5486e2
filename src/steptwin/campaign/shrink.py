"""A failed case made as simple as it can be, with the same failure: fewest faults and steps, fewest values other than those of
the description of the world, round numbers, earliest end.

Each accepted edit makes the complexity of the case smaller, so that this ends. Failure is judged in the time of the world only.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal
from functools import partial
from typing import NamedTuple, TypeAlias, TypeVar

from steptwin.campaign.case import EXPECTATIONS, WAITS, Case, CaseResult, FaultAt, VariedValue

T = TypeVar("T")

MOST_RUNS = 400
"""The largest number of runs for shrinking one failure, by default."""
ADDED = -1
"""The table of faults and steps that are of no table of the description of a campaign."""
ERROR = "error"
"""Stands for a property where a case did not run to its end."""

RunCase: TypeAlias = Callable[[Case], CaseResult]
WithValues: TypeAlias = Callable[[Case, Mapping[str, VariedValue]], Case]

_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?")
_PARAMETER = re.compile(r"(?<==)-?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?(?=\s|$)")


class CaseFailure(NamedTuple):
    """Property that fails, and the reason in words without numbers: distinct failures differ in it."""

    property: str
    cause: str


def failures_of(result: CaseResult) -> list[CaseFailure]:
    """All of a case, the earliest first; empty if none."""
    if result.error is not None:
        return [CaseFailure(ERROR, without_numbers(result.error))]
    failed = [verdict for verdict in result.verdicts if not verdict.holds]
    failed.sort(key=lambda verdict: result.end_ns if verdict.at_ns is None else verdict.at_ns)
    return [CaseFailure(verdict.name, without_numbers(verdict.why)) for verdict in failed]


def without_numbers(text: str) -> str:
    return _NUMBER.sub("#", text)


@dataclass(frozen=True, slots=True)
class ShrunkCase:
    """``result`` is that of ``case``; in a finding without what only its early end violates.

    ``repeats``: whether the failure came again when the case was run again; if not, ``case`` is the original. ``is_complete``:
    whether no edit makes it simpler; otherwise the budget was used up.
    """

    original: Case
    case: Case
    result: CaseResult
    failure: CaseFailure
    runs: int
    repeats: bool
    is_complete: bool


def shrink(
    case: Case,
    failure: CaseFailure,
    run: RunCase,
    *,
    with_values: WithValues = lambda case, values: replace(case, values=values),
    optional: Collection[str] = (),
    permitted: Callable[[str, VariedValue], bool] = lambda name, value: True,
    runs: int = MOST_RUNS,
    is_over: Callable[[], bool] = lambda: False,
) -> ShrunkCase:
    """The simplest case found at which the property of ``failure`` fails.

    ``with_values`` gives the case with other values, on which its faults and steps may depend; ``optional`` are those it may
    be without: paths, for which the world then has its own values. ``permitted`` says whether the campaign may choose a value.
    After ``runs`` runs, or once ``is_over`` (a budget of time), the simplest case so far is the result.
    """
    shrinker = _Shrinker(case, failure, run, with_values, frozenset(optional), permitted, runs, is_over)
    return shrinker.shrink()


class _BudgetUsedError(Exception):
    """No more runs."""


class _Shrinker:
    def __init__(
        self,
        case: Case,
        failure: CaseFailure,
        run: RunCase,
        with_values: WithValues,
        optional: frozenset[str],
        permitted: Callable[[str, VariedValue], bool],
        runs: int,
        is_over: Callable[[], bool],
    ) -> None:
        self.original = self.best = case
        self.failure = failure
        self._run = run
        self._with_values = with_values
        self._optional = optional
        self._permitted = permitted
        self._most = runs
        self._is_over = is_over
        self._seen: set[str] = set()
        self.runs = 0

    def shrink(self) -> ShrunkCase:
        self.runs = 1
        self.result = self._run(self.original)
        if not self._is_same(self.result):
            return ShrunkCase(self.original, self.original, self.result, self.failure, 1, repeats=False, is_complete=False)
        is_complete = True
        try:
            self._shorten()
            while any([self._fewer_faults(), self._fewer_steps(), self._fewer_values(), self._rounder()]):
                pass
            self._earliest_end()
        except _BudgetUsedError:
            is_complete = False
        return ShrunkCase(self.original, self.best, self.result, self._found(), self.runs, repeats=True, is_complete=is_complete)

    def _is_same(self, result: CaseResult) -> bool:
        found = failures_of(result)
        if self.failure.property in {ERROR, EXPECTATIONS, WAITS}:
            return self.failure in found
        return self.failure.property in [one.property for one in found]

    def _found(self) -> CaseFailure:
        """The failure of the simplest case, whose cause may be another one."""
        return next(one for one in failures_of(self.result) if one.property == self.failure.property)

    def _try(self, case: Case) -> bool:
        """Keep a case that is simpler and fails."""
        if self._complexity(case) >= self._complexity(self.best) or case.digest in self._seen:
            return False
        self._seen.add(case.digest)
        if self.runs >= self._most or self._is_over():
            raise _BudgetUsedError
        self.runs += 1
        result = self._run(case)
        if not self._is_same(result):
            return False
        self.best, self.result = case, result
        return True

    def _complexity(self, case: Case) -> tuple[int, ...]:
        own = [one for one in (*case.faults, *case.steps) if one.table == ADDED]
        digits = sum(map(digits_of, case.values.values())) + sum(digits_of(one.at_ns) for one in own)
        digits += sum(digits_of(number) for one in own if isinstance(one, FaultAt) for number in _numbers(one.fault))
        return len(case.faults), len(case.steps), len(self._optional & case.values.keys()), digits, case.end_ns

    # ------------------------------------------------------------------ passes: each says whether anything became simpler

    def _violated(self) -> int | None:
        """When the property failed."""
        return next((one.at_ns for one in self.result.verdicts if one.name == self.failure.property and not one.holds), None)

    def _shorten(self) -> None:
        """Not much longer than it takes, so that the runs that follow are short, and edits may still delay the failure."""
        at = self._violated()
        if at is not None and 2 * at < self.best.end_ns:
            self._try(replace(self.best, end_ns=2 * at))

    def _earliest_end(self) -> None:
        at = self._violated()
        for end in () if at is None else (at, at + 1):
            if self._try(replace(self.best, end_ns=end)):
                return

    def _fewer_faults(self) -> bool:
        return self._fewer(lambda case: case.faults, lambda case, faults: replace(case, faults=faults))

    def _fewer_steps(self) -> bool:
        return self._fewer(lambda case: case.steps, lambda case, steps: replace(case, steps=steps))

    def _fewer(self, items: Callable[[Case], tuple[T, ...]], put: Callable[[Case, tuple[T, ...]], Case]) -> bool:
        """Without all, halves, quarters…, single ones."""
        found, size = False, len(items(self.best))
        while size:
            at = 0
            while at < len(items(self.best)):
                there = items(self.best)
                if self._try(put(self.best, there[:at] + there[at + size :])):
                    found = True
                else:
                    at += size
            size = min(size // 2, len(items(self.best)))
        return found

    def _fewer_values(self) -> bool:
        """Without all, halves, quarters…, single ones of the optional values."""
        names = [name for name in self.best.values if name in self._optional]
        found, size = False, len(names)
        while size:
            for at in range(0, len(names), size):
                left = {name: value for name, value in self.best.values.items() if name not in names[at : at + size]}
                found |= self._try(self._with_values(self.best, left))
            size //= 2
        return found

    def _rounder(self) -> bool:
        """Numbers with fewer digits, the fewest first. Faults and steps of a table have theirs from it, and from the values."""
        found = False
        for name, value in list(self.best.values.items()):
            if isinstance(value, int | float) and not isinstance(value, bool):
                found |= self._round(value, partial(self._with_value, name))
        for n, fault in enumerate(self.best.faults):
            if fault.table == ADDED:
                found |= self._round(fault.at_ns, partial(self._with_moment, n))
                for place, number in enumerate(_numbers(fault.fault)):
                    found |= self._round(number, partial(self._with_parameter, n, place))
        for n, step in enumerate(self.best.steps):
            if step.table == ADDED:
                found |= self._round(step.at_ns, partial(self._with_step, n))
        return found

    def _round(self, number: float, put: Callable[[float], Case | None]) -> bool:
        for rounder in rounder_numbers(number):
            case = put(rounder)
            if case is not None and self._try(case):
                return True
        return False

    def _with_value(self, name: str, number: float) -> Case | None:
        if not self._permitted(name, number):
            return None
        return self._with_values(self.best, {**self.best.values, name: number})

    def _with_moment(self, n: int, number: float) -> Case:
        return self._with_fault(n, replace(self.best.faults[n], at_ns=int(number)))

    def _with_parameter(self, n: int, place: int, number: float) -> Case:
        old = self.best.faults[n]
        return self._with_fault(n, replace(old, fault=_with_number(old.fault, place, number)))

    def _with_fault(self, n: int, fault: FaultAt) -> Case:
        there = self.best.faults
        return replace(self.best, faults=(*there[:n], fault, *there[n + 1 :]))

    def _with_step(self, n: int, number: float) -> Case:
        there = self.best.steps
        return replace(self.best, steps=(*there[:n], replace(there[n], at_ns=int(number)), *there[n + 1 :]))


def _numbers(fault: str) -> list[float]:
    """The numbers among the parameters of a fault."""
    return [_number(found.group()) for found in _PARAMETER.finditer(fault)]


def _number(text: str) -> float:
    return int(text) if re.fullmatch(r"-?\d+", text) else float(text)


def _with_number(fault: str, place: int, number: float) -> str:
    found = list(_PARAMETER.finditer(fault))[place]
    return f"{fault[: found.start()]}{number!r}{fault[found.end() :]}"


# ---------------------------------------------------------------------- round numbers


def digits_of(number: VariedValue) -> int:
    """Significant digits, without zeros at the end: 0 of 0, 1 of 500, 2 of 0.15."""
    if not isinstance(number, int | float) or isinstance(number, bool):
        return 0
    value = Decimal(repr(number)).normalize()
    return len(value.as_tuple().digits) if value and value.is_finite() else 0


def rounder_numbers(number: float) -> Iterator[float]:
    """Numbers near one with fewer digits, those with the fewest first, and whole ones for a whole one."""
    digits = digits_of(number)
    if digits == 0:
        return
    yield type(number)(0)
    value = Decimal(repr(number))
    for kept in range(1, digits):
        unit = Decimal(1).scaleb(value.adjusted() - kept + 1)
        near = sorted(
            {value.quantize(unit, rounding) if unit < 1 else _to_multiple(value, unit, rounding) for rounding in _ROUNDINGS},
            key=lambda one: abs(one - value),
        )
        yield from (type(number)(one) for one in near)


_ROUNDINGS = (ROUND_FLOOR, ROUND_CEILING)


def _to_multiple(value: Decimal, unit: Decimal, rounding: str) -> Decimal:
    return (value / unit).to_integral_value(rounding) * unit
