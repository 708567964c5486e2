"""All checks of one controller, one after the other, without I/O; and the report."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol, TypeVar

from steptwin.verify.check import Check, CheckNeed, CheckOutcome, CheckResult, CheckSteps, NotRestored, Probes, Undecided

_NEEDED = {
    CheckNeed.WRITE: "writes settings and puts them back: permit it with --write",
    CheckNeed.MOVE: "moves an axis: permit it with --move",
}


class Talk(Protocol):
    """With a controller: the comparisons of the present check."""

    probes: Probes

    def hello(self) -> CheckSteps[None]: ...


T = TypeVar("T", bound=Talk)
Progress = Callable[[str, int, int], object]
"""Called before each check with its id, its number from 0 and the number of checks."""


def check_all(
    talk: T,
    checks: Sequence[Check[T]],
    permitted: frozenset[CheckNeed],
    *,
    progress: Progress = lambda id_, number, count: None,
    is_cancelled: Callable[[], bool] = lambda: False,
) -> CheckSteps[list[CheckResult]]:
    """The results of the checks that are permitted. Cancelled, it ends between two checks.

    Raises `LineFailure`; a message names what could not be put back.
    """
    yield from talk.hello()
    results = []
    for number, check in enumerate(checks):
        if is_cancelled():
            break
        progress(check.id, number, len(checks))
        results.append((yield from _checked(talk, check, permitted)))
    return results


def _checked(talk: T, check: Check[T], permitted: frozenset[CheckNeed]) -> CheckSteps[CheckResult]:
    why = _NEEDED[check.need] if check.need not in permitted else check.unless(talk)
    if why is not None:
        return CheckResult(check.id, CheckOutcome.NOT_CHECKED, check.what, why=why)
    probes = talk.probes = Probes()
    try:
        yield from check.steps(talk)
    except Undecided as reason:
        if probes.unrestored:
            raise NotRestored(f"{check.id}: not put back: {'; '.join(probes.unrestored.values())} ({reason})") from None
        return CheckResult(check.id, CheckOutcome.NOT_CHECKED, check.what, tuple(probes.found), str(reason))
    outcome = CheckOutcome.CONFIRMED if all(probe.holds for probe in probes.found) else CheckOutcome.REFUTED
    return CheckResult(check.id, outcome, check.what, tuple(probes.found))


def complete(results: Sequence[CheckResult], unchecked: Mapping[str, str]) -> list[CheckResult]:
    """The results with the ids that no check decides, in the order of the ids."""
    return sorted(
        [*results, *(CheckResult(id_, CheckOutcome.NOT_CHECKED, "", why=why) for id_, why in unchecked.items())],
        key=lambda result: _order(result.id),
    )


def _order(id_: str) -> tuple[str, int]:
    family, _, number = id_.partition("-")
    return family, int(number)
