"""Findings of a campaign: its failures by cause, each with its simplest case."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from steptwin.campaign.case import Case, CaseResult, VariedValue
from steptwin.campaign.cases import Cases
from steptwin.campaign.description import CampaignDescription
from steptwin.campaign.reproduce import Reproduction, identifier, reproduce, summary, where
from steptwin.campaign.runner import CaseRunner
from steptwin.campaign.shrink import ADDED, MOST_RUNS, CaseFailure, RunCase, ShrunkCase, failures_of, shrink, without_numbers
from steptwin.campaign.variation import Between, Choice, Normal

MOST_FINDINGS = 10
"""Failures that are made simpler; more are counted only."""


@dataclass(frozen=True, slots=True)
class FoundFailure:
    """``numbers``: of the cases that failed so. ``shrunk``: the simplest one; None where that was not looked for. ``where``: what
    is particular to it, in words."""

    failure: CaseFailure
    numbers: tuple[int, ...]
    result: CaseResult
    shrunk: ShrunkCase | None
    files: Reproduction | None
    where: str | None = None

    def to_json(self, folder: Path) -> dict[str, Any]:
        """As JSON; paths are relative to ``folder``."""
        shrunk = self.shrunk
        return {
            "property": self.failure.property,
            "cause": self.failure.cause,
            "what": summary(self.result),
            "count": len(self.numbers),
            "cases": list(self.numbers[:100]),
            "simplest": None if shrunk is None else shrunk.case.to_json(),
            "where": self.where,
            "repeats": None if shrunk is None else shrunk.repeats,
            "shrinking_runs": 0 if shrunk is None else shrunk.runs,
            "files": {} if self.files is None else self.files.to_json(folder),
        }


def shrinker(description: CampaignDescription, run: RunCase) -> Callable[..., ShrunkCase]:
    """`shrink` for cases of a campaign: with its values, from the faults and steps of its tables."""
    cases = Cases(description)
    spreads = {one.name: one.spread for one in description.vary}

    def with_values(case: Case, values: Mapping[str, VariedValue]) -> Case:
        faults = [one.table for one in case.faults if one.table != ADDED]
        steps = [one.table for one in case.steps if one.table != ADDED]
        made = cases.made(case.number, case.seed, values, faults, steps, case.end_ns)
        return replace(
            made,
            faults=(*made.faults, *(one for one in case.faults if one.table == ADDED)),
            steps=(*made.steps, *(one for one in case.steps if one.table == ADDED)),
        )

    def permitted(name: str, value: VariedValue) -> bool:
        return name in spreads and is_within(spreads[name], value)

    def run_shrink(case: Case, failure: CaseFailure, **budget: Any) -> ShrunkCase:
        paths = [one.name for one in description.vary if one.is_path]
        return shrink(case, failure, run, with_values=with_values, optional=paths, permitted=permitted, **budget)

    return run_shrink


def is_within(spread: Between | Normal | Choice, value: VariedValue) -> bool:
    """Whether a value is one of a spread."""
    if isinstance(spread, Choice):
        return value in spread.values
    if not isinstance(value, int | float) or isinstance(value, bool):
        return False
    if isinstance(spread, Between) and spread.is_whole and value != int(value):
        return False
    return (spread.low is None or value >= spread.low) and (spread.high is None or value <= spread.high)


def find(
    runner: CaseRunner,
    failed: Iterable[CaseResult],
    case_of: Callable[[int], Case],
    folder: Path,
    campaign: Path | None = None,
    *,
    runs: int = MOST_RUNS,
    is_over: Callable[[], bool] = lambda: False,
) -> list[FoundFailure]:
    """The failures among results, each with its simplest case and that as files in ``folder``; those with the most cases first.

    Cases with the same failure of which some lack a fault of the simplest case have several causes: each gets its own. ``failed``
    is read once; ``case_of`` gives the case of a number.
    """
    groups: dict[CaseFailure, list[int]] = {}
    firsts: dict[int, CaseResult] = {}
    for result in failed:
        failure = failures_of(result)[0]
        groups.setdefault(failure, []).append(result.number)
        if len(groups[failure]) <= MOST_FINDINGS:
            firsts[result.number] = result
    simpler = shrinker(runner.description, runner.run)
    found: dict[tuple[object, ...], FoundFailure] = {}
    waiting = sorted(groups.items(), key=lambda group: -len(group[1]))
    while waiting:
        failure, numbers = waiting.pop(0)
        number = numbers[0]
        if len(found) >= MOST_FINDINGS or is_over():
            result = firsts[number] if number in firsts else runner.run(case_of(number))
            found[failure.property, f"case {number}"] = FoundFailure(failure, tuple(numbers), result, None, None)
            continue
        shrunk = _without_cut(simpler(case_of(number), failure, runs=runs, is_over=is_over), runner.run)
        alike, others = _alike(shrunk.case, numbers, case_of)
        if others:
            waiting.append((failure, others))
        key = _cause(shrunk)
        if key in found:
            found[key] = replace(found[key], numbers=(*found[key].numbers, *alike))
            continue
        files = reproduce(runner, shrunk.case, shrunk.result, folder, f"{identifier(failure.property)}-{number}", campaign)
        particular = where(shrunk.case, runner.description)
        found[key] = FoundFailure(shrunk.failure, tuple(alike), shrunk.result, shrunk, files, particular)
    return sorted(found.values(), key=lambda one: -len(one.numbers))


def _without_cut(shrunk: ShrunkCase, run: RunCase) -> ShrunkCase:
    """Without the violations in its result that only its early end makes: what was to come had no time to."""
    case, result = shrunk.case, shrunk.result
    if case.end_ns >= shrunk.original.end_ns or result.error is not None or len(failures_of(result)) < 2:
        return shrunk
    longer = run(replace(case, end_ns=shrunk.original.end_ns))
    meant = {one.name for one in longer.verdicts if not one.holds and one.at_ns is not None and one.at_ns <= case.end_ns}
    meant.add(shrunk.failure.property)
    kept = tuple(one for one in result.verdicts if one.holds or one.name in meant)
    return replace(shrunk, result=replace(result, verdicts=kept))


def _cause(shrunk: ShrunkCase) -> tuple[object, ...]:
    """Equal for failures that have one cause as far as their simplest cases tell: the same failure, faults and steps.

    Before they were made simple they may have differed in words, and their values may still differ.
    """
    case = shrunk.case
    if not shrunk.repeats:
        return shrunk.failure.property, replace(case, number=0, seed=0).digest
    given = (*(one.fault for one in case.faults), *(one.step for one in case.steps))
    return (*shrunk.failure, *map(without_numbers, given))


def _alike(simplest: Case, numbers: list[int], case_of: Callable[[int], Case]) -> tuple[list[int], list[int]]:
    """The cases that have all faults of the simplest one, and the others. The first is always alike."""
    needed = {one.table for one in simplest.faults}
    alike, others = numbers[:1], list[int]()
    for number in numbers[1:]:
        (alike if needed <= {one.table for one in case_of(number).faults} else others).append(number)
    return alike, others
