"""WBC programs for another firmware: what differs between two generations, and what has to change in a program."""

from __future__ import annotations

from collections.abc import Iterator

from steptwin.diagnostics import Diagnostic
from steptwin.wbc.check import check
from steptwin.wbc.dialect import GENERATIONS, Dialect
from steptwin.wbc.positions import PositionTable
from steptwin.wbc.usage import Setup

_CAME_WITH = {
    "1.40": (),
    "1.70": (
        "PULSE, HARDINT_ labels, ticks of 100 and 1000 ms and interrupts of drives",
        "STATUS, which reads 0 before",
        "a position error with ERRMODE1 that pauses the program, instead of stopping it",
    ),
}


def differences(old: Dialect, new: Dialect) -> Iterator[str]:
    """Differences that a program may notice, as sentences."""
    if old.user_registers != new.user_registers:
        yield f"{new.user_registers} user registers, not {old.user_registers}"
    if old.max_steps != new.max_steps:
        yield f"{new.max_steps} executable lines, not {old.max_steps}"
    low, high = sorted((GENERATIONS.index(old.firmware), GENERATIONS.index(new.firmware)))
    for generation in GENERATIONS[low + 1 : high + 1]:
        for feature in _CAME_WITH[generation]:
            yield f"{'with' if new.firmware >= generation else 'without'} {feature}"


def findings(
    text: str, old: Dialect, new: Dialect, positions: PositionTable | None = None, setup: Setup | None = None
) -> list[Diagnostic]:
    """Findings of the checker for the new firmware only."""
    known = {(d.code, d.span) for d in check(text, positions, setup, old).diagnostics}
    return [d for d in check(text, positions, setup, new).diagnostics if (d.code, d.span) not in known]
