"""A program that was suspended does not move anything afterwards by what it was asked to do before."""

from __future__ import annotations

import pytest
from suspended_unit import OPERATIONS, trial

STRIDE = 5
"""Every so-manyth point is tried here, other ones for each operation and line; all of them in `tests/soak`."""


@pytest.mark.parametrize("loss", [0, 3])
@pytest.mark.parametrize("tasks", [False, True], ids=["threads", "tasks"])
@pytest.mark.parametrize("name", OPERATIONS)
def test_what_was_asked_for_before_a_suspension_moves_nothing_after_it(name: str, tasks: bool, loss: int) -> None:
    points, _ = trial(name, None, tasks=tasks, loss=loss)
    assert points > 4  # the first of them is when it is asked for
    first = 1 + (len(name) + loss + 2 * tasks) % STRIDE
    wrong = [fault for at in range(first, points, STRIDE) if (fault := trial(name, at, tasks=tasks, loss=loss)[1])]
    assert not wrong, "\n".join(wrong)
