"""Steps without branches: what is executed often is executed in one piece."""

from __future__ import annotations

from array import array
from typing import Any

from steptwin.wbc.code import COMPILED_AFTER, StraightSteps


def test_straight_steps_are_compiled_when_they_have_been_executed_some_times() -> None:
    executed: list[float] = []

    def step(m: Any, cells: array[float]) -> int:
        executed.append(cells[0])
        cells[0] += 1.0
        return 7

    cells = array("d", [0.0])
    straight = StraightSteps([step, step], ["c[0] += 1.0", "c[0] += 1.0"], 7)
    execution: Any = None
    assert {straight.run(execution, cells) for _ in range(COMPILED_AFTER + 3)} == {7}
    assert cells[0] == 2.0 * (COMPILED_AFTER + 3)
    assert len(executed) == 2 * COMPILED_AFTER
