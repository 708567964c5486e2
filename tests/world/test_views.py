"""What Python sees of a world."""

from __future__ import annotations

import pytest
from small_world import moved, small

from steptwin.errors import Misuse
from steptwin.mic488.status import Status


def test_names_that_are_not_there_are_misuse_with_those_that_are() -> None:
    world = small()
    with pytest.raises(Misuse, match="no axis 5: axes are 1, 2, 3, 4"):
        _ = world.mic488["a"].axis[5]
    with pytest.raises(Misuse, match="no MIC488 is called 'd'; there are a, b, c"):
        world.mic488["d"]
    with pytest.raises(Misuse, match=r"nothing is called 'z'.* there are a, b, c, x, go, time, idle"):
        world.run(until="z.position > 1")
    with pytest.raises(Misuse, match=r"no signal 'x\.speed'; there are position, lost, stalled$"):
        world.read("x.speed")
    with pytest.raises(Misuse, match="no button is called 'stop'; there are go"):
        world.press("stop")
    with pytest.raises(Misuse, match="M1_POS_AB"):
        world.mic488["a"].write("M1_POS_AB", 1.0)
    assert "d" not in world.mic488
    assert world.mic488.get("d") is None
    assert [*world.mic488] == ["a", "b", "c"]


def test_positions_are_those_of_register_and_mechanics() -> None:
    world = moved(small(), 25.0)
    assert world.run(until="a.M1.status == 4") == "a.M1.status == 4"
    axis = world.mic488["a"].axis[1]
    assert (axis.position, axis.velocity, axis.status, axis.unit) == (25.0, 0.0, Status.REACHED, "mm")
    assert (world.axis["x"].position, world.axis["x"].lost) == (75.0, 0)
