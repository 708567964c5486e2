"""A program that was suspended does not move a chip afterwards by what it was asked to do before."""

from __future__ import annotations

import pytest
from suspended_chip import OPERATIONS, trial

STRIDE = 7
"""Every so-manyth point is tried here; all of them in `tests/soak`."""


@pytest.mark.parametrize("tasks", [False, True], ids=["threads", "tasks"])
@pytest.mark.parametrize("name", OPERATIONS)
def test_what_was_asked_for_before_a_suspension_moves_nothing_after_it(name: str, tasks: bool) -> None:
    points, _ = trial(name, None, tasks=tasks)
    assert points > 4  # the first of them is when it is asked for
    wrong = [fault for at in range(1 + len(name) % STRIDE, points, STRIDE) if (fault := trial(name, at, tasks=tasks)[1])]
    assert not wrong, "\n".join(wrong)
