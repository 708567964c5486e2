"""A program that was suspended does not move a chip afterwards by what it was asked to do before."""

from __future__ import annotations

import pytest
from suspended_chip import NOT_HELD_S, OPERATIONS, trial

STRIDE = 17
JOG_STRIDE = 97
"""Every so-manyth point is tried here; all of them in `tests/soak`. A jog has ten times as many as the others."""


@pytest.mark.parametrize("tasks", [False, True], ids=["threads", "tasks"])
@pytest.mark.parametrize("name", OPERATIONS)
def test_what_was_asked_for_before_a_suspension_moves_nothing_after_it(name: str, tasks: bool) -> None:
    points, _ = trial(name, None, tasks=tasks)
    assert points > 4  # the first of them is when it is asked for
    stride = JOG_STRIDE if name == "jog" else STRIDE
    wrong = [fault for at in range(1 + (len(name) + 2 * tasks) % 7, points, stride) if (fault := trial(name, at, tasks=tasks)[1])]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("tasks", [False, True], ids=["threads", "tasks"])
def test_a_jog_that_was_suspended_for_longer_than_its_hold_time_does_not_begin_again(tasks: bool) -> None:
    points, _ = trial("jog", None, tasks=tasks)
    wrong = [fault for at in range(5, points, JOG_STRIDE) if (fault := trial("jog", at, tasks=tasks, away_s=NOT_HELD_S)[1])]
    assert not wrong, "\n".join(wrong)
