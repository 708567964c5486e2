"""Drivers in processes that are suspended, very often: nothing moves afterwards that was asked for before."""

from __future__ import annotations

import random

import pytest
import suspended_chip
import suspended_unit
from host_rig import Wire, driver, thread_line
from soak import factor, scaled
from suspension import Suspension

from steptwin.controller import MILLISECOND
from steptwin.drivers import Mic488


@pytest.mark.parametrize("tasks", [False, True], ids=["threads", "tasks"])
@pytest.mark.parametrize("name", suspended_chip.OPERATIONS)
def test_a_chip_at_every_point(name: str, tasks: bool) -> None:
    points, _ = suspended_chip.trial(name, None, tasks=tasks)
    chosen = random.Random(name).sample(range(1, points), max(1, round((points - 1) * min(factor(), 1.0))))
    wrong = [fault for at in chosen if (fault := suspended_chip.trial(name, at, tasks=tasks)[1])]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("loss", [0, 3])
@pytest.mark.parametrize("tasks", [False, True], ids=["threads", "tasks"])
@pytest.mark.parametrize("name", suspended_unit.OPERATIONS)
def test_a_mic488_at_every_point(name: str, tasks: bool, loss: int) -> None:
    points, _ = suspended_unit.trial(name, None, tasks=tasks, loss=loss)
    chosen = random.Random(name).sample(range(1, points), max(1, round((points - 1) * min(factor(), 1.0))))
    wrong = [fault for at in chosen if (fault := suspended_unit.trial(name, at, tasks=tasks, loss=loss)[1])]
    assert not wrong, "\n".join(wrong)


def test_a_jog_at_random_moments() -> None:
    """Suspended at any point of a jog, for longer than it is held: the axis stands still from then on."""
    chance = random.Random(1)
    began_again = []
    for trial in range(scaled(1000)):
        wire = Wire()
        driver(wire).enable(1)
        suspension = Suspension(wire, away_s=chance.uniform(0.5, 5.0))
        mic = Mic488(suspension.thread(thread_line(wire)), config=wire.config, firmware="1.70")
        mic.open()
        with mic.axis(1).jog(5.0) as jog:
            suspension.arm(chance.randrange(300))
            while jog.hold() and suspension.back is None:
                pass
            jog.hold()
        if suspension.back is None:
            continue
        wire.sleep(1.0)
        stood = wire.position()
        wire.rest(10.0)
        last = [(at - suspension.back) / MILLISECOND for at, frame in wire.sent if at > suspension.back]
        if wire.position() != stood:
            began_again.append(f"trial {trial}, suspended {suspension.what}: {last}")
    assert not began_again, "\n".join(began_again)
