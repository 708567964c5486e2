"""What the class of each step says of it, against a controller that executes it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import pytest
from mic488_rig import loaded, started

from steptwin.tables import complete
from steptwin.wbc import steps as s
from steptwin.wbc.real import ProgramFault

PROGRAM = """\
a = 0
b = 0
x = a + b
y = a
IF a < b
y = b
ELSE
y = 1
ENDIF
WHILE a < b
y = b
ENDWHILE
WAIT a < b
DELAY a
PULSE(OUT2, a)
HOME M1 a
VABS M1 a
VREL M2 a
PABS M1 a
PREL M2 a
BRAKE M1
STOP M2
MOVEPTP b
MOVELIN b
MOVELIN_REL b
MOVETOCIRC b
DOCIRC b
DOARC b
WAITPOS
JUMP L
L:
RETURN
PROGRESET
END
INT_IN1:
RETURN
"""
ROWS = "P0;3;4;5;1\n"
"""The numbers of a row that every statement can use."""


class NotedCells(list[float]):
    """Cells that note which of the variables are read."""

    def __init__(self, values: list[float], variables: int) -> None:
        super().__init__(values)
        self._variables = variables
        self.read: set[int] = set()

    def __getitem__(self, index: int) -> float:  # type: ignore[override]
        if index < self._variables:
            self.read.add(index)
        return super().__getitem__(index)


class Executed(NamedTuple):
    """What a step did: the variables it read, the step after it, what it acted on, what it waited for."""

    read: set[str]
    after: int
    outputs: set[int]
    drives: set[int]
    ended: bool
    waits: set[s.StepWait]


PRELUDE = "M1 = ON\nM2 = ON\n"
_HOLD = "DELAY 1000\n"
STEPS = loaded(PROGRAM, ROWS)[0].steps
FIRST = len(loaded(PRELUDE + _HOLD + "END\n")[0].steps) - 1
VALUES = [(0.5, 0.0), (2.0, 0.0), (0.0, 2.0), (-1.0, 0.0)]
"""Of the variables a and b; row 0 is the only one."""


def executed(number: int, values: tuple[float, float], *, moving: bool) -> Executed | None:
    """What step ``number`` of the program does with values of a and b; None if it is a program error with them."""
    rig = started(PRELUDE + ("VABS M1 5\n" if moving else "x = x\n") + _HOLD + PROGRAM, ROWS)
    rig.wait(0.1)
    device, program = rig.device, rig.device.program
    (running,) = program.banks.programs.values()
    interpreter, first = program.interpreter, FIRST + 1
    cells = NotedCells(list(running.code.cells), len(running.variables))
    for name, value in zip("ab", values, strict=True):
        cells[running.variables.index(name)] = value
    interpreter.not_before = 0
    before = [(axis.status, axis.revision) for axis in device.axes]
    pulses = dict(program._pulses)
    try:
        after = running.code.steps[first + number](interpreter, cells)  # type: ignore[arg-type]
    except ProgramFault:
        return None
    moved = {axis.number for axis, was in zip(device.axes, before, strict=True) if (axis.status, axis.revision) != was}
    waits = {s.StepWait.TIME} if interpreter.not_before > rig.now else set()
    return Executed(
        {running.variables[index] for index in cells.read},
        (~after if after < 0 else after) - first,
        {output + 1 for output in program._pulses.keys() - pulses.keys()},
        moved,
        not any(axis.enabled for axis in device.axes),
        waits | ({s.StepWait.CONDITION} if interpreter.waiting else set()),
    )


def outcomes(number: int) -> Iterator[Executed]:
    for values in VALUES:
        for moving in (False, True):
            found = executed(number, values, moving=moving)
            if found is not None:
                yield found


WAITED: Mapping[s.StepWait, set[s.StepWait]] = complete(
    "wait",
    s.StepWait,
    "waits of a step in the run of the program",
    {
        s.StepWait.NOTHING: set(),
        s.StepWait.EVENT: set(),
        s.StepWait.TIME: {s.StepWait.TIME},
        # Both are asked again and again.
        s.StepWait.CONDITION: {s.StepWait.CONDITION},
        s.StepWait.MOTION: {s.StepWait.CONDITION},
    },
)


@pytest.mark.parametrize("number", range(len(STEPS)), ids=[f"{n}-{type(step).__name__}" for n, step in enumerate(STEPS)])
def test_a_step_does_what_its_class_says(number: int) -> None:
    step, found = STEPS[number], list(outcomes(number))
    effect = step.effect()
    if isinstance(step, s.ReturnStep):
        assert found == []  # a program error without a JUMP before
        return
    assert set().union(*(one.read for one in found)) == {one.name for one in step.sources() if isinstance(one, s.Variable)}
    assert set().union(*(one.outputs for one in found)) == ({effect.output} if effect.output else set())
    drives = set().union(*(one.drives for one in found))
    assert bool(drives) == effect.on_drives
    assert drives <= ({effect.drive} if effect.drive else {1, 2})
    assert all(one.ended == effect.everything for one in found)
    assert set().union(*(one.waits for one in found)) == WAITED[step.waits]
    ways = {one.after for one in found} - ({number} if step.waits is not s.StepWait.NOTHING or effect.everything else set())
    if isinstance(step, s.JumpStep):
        assert ways == {step.target}
    elif isinstance(step, s.ProgResetStep):
        assert step.after(number) == ()
    else:
        assert ways == set(step.after(number))


def test_every_class_of_step_is_executed() -> None:
    assert {type(step) for step in STEPS} == {*s.STEPS} - {s.IllegalStep}


def test_a_step_without_its_facts_is_refused() -> None:
    with pytest.raises(TypeError, match=r"^step SwapStep lacks its waits, sources, effect, after$"):
        type("SwapStep", (s.ProgramStep,), {})
