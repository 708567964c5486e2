"""The checker: errors and warnings of a program before it runs."""

from __future__ import annotations

from dataclasses import dataclass

from steptwin.diagnostics import Diagnostic, Severity, in_order
from steptwin.wbc import flow, mistaken, usage
from steptwin.wbc.dialect import DEFAULT, Dialect
from steptwin.wbc.memory import StepMemory
from steptwin.wbc.positions import PositionTable
from steptwin.wbc.resolve import resolve
from steptwin.wbc.scope import ProgramScope
from steptwin.wbc.steps import Executable, IllegalStep
from steptwin.wbc.syntax import parse
from steptwin.wbc.tree import ProgramTree
from steptwin.wbc.usage import Setup


@dataclass(frozen=True, slots=True)
class CheckedProgram:
    """``executable`` is None when there are errors, or positions without a table. ``lines`` counts the executable lines, wrong
    ones included. ``diagnostics`` are in text order."""

    text: str
    program: ProgramTree
    executable: Executable | None
    lines: int
    diagnostics: list[Diagnostic]
    positions: PositionTable | None = None
    """The table in which names after @ were found."""

    @property
    def errors(self) -> list[Diagnostic]:
        return [d for d in self.diagnostics if d.severity is Severity.ERROR]


def check(
    text: str, positions: PositionTable | None = None, setup: Setup | None = None, dialect: Dialect = DEFAULT
) -> CheckedProgram:
    """All errors and warnings of a program. Never raises.

    Without ``positions`` the names after @ are not checked (one warning reports it); without ``setup`` gears, ramps and input
    interrupts are not. Findings that depend on several lines need all these lines to be correct.
    """
    program, diagnostics = parse(text)
    return check_program(text, program, diagnostics, positions, setup, dialect)[0]


def check_program(
    text: str,
    program: ProgramTree,
    diagnostics: list[Diagnostic],
    positions: PositionTable | None,
    setup: Setup | None,
    dialect: Dialect,
    *,
    memory: StepMemory | None = None,
) -> tuple[CheckedProgram, ProgramScope]:
    """As `check`, for a parsed program; also returns the scope of its names. ``memory`` is that of `resolve`."""
    resolution = resolve(program, positions, dialect, memory)
    executable = resolution.executable
    diagnostics += resolution.diagnostics
    diagnostics += usage.endless_waits(executable)
    diagnostics += usage.waits_for_velocity(executable)
    wrong = [step for step in executable.steps if isinstance(step, IllegalStep)]
    if not any(step.opaque for step in wrong):
        paths = flow.flow_of(executable.steps)
        diagnostics += flow.interrupt_ends(paths, executable)
        diagnostics += flow.unreached(paths, executable)
        diagnostics += flow.stray_returns(paths, executable)
        diagnostics += flow.left_by_calls(paths, executable)
    if not wrong:
        diagnostics += mistaken.unused_variables(executable, resolution.scope, dialect)
        diagnostics += mistaken.waits_for_variables(executable, dialect)
        diagnostics += usage.axes_never_enabled(executable, positions)
        diagnostics += usage.interrupts(executable, setup)
        if setup is not None:
            diagnostics += usage.unequal_axes(executable, setup)
            diagnostics += usage.homing_without_end(executable, setup)
            diagnostics += usage.too_fast(executable, program, setup)
    wrong_somewhere = any(d.severity is Severity.ERROR for d in diagnostics)
    runs = resolution.complete and not wrong_somewhere
    checked = CheckedProgram(text, program, executable if runs else None, len(executable.steps), in_order(diagnostics), positions)
    return checked, resolution.scope
