"""Where elements are drawn: the track, what moves on it, and the zones of its switches."""

from __future__ import annotations

import pytest

from steptwin.files.world import World
from steptwin.simulation.components.registry import ELEMENTS
from steptwin.simulation.mechanics.drawing import Drawing, SensorZone, rail

WORLD = """
[[mic488]]
name = "c"
[[axis]]
name = "x"
drive = "c.M1"
pulses_per_unit = 100
travel = [-5.0, 295.0]
[axis.motor]
torque = [[0, 1.0]]
[[axis]]
name = "y"
drive = "c.M2"
pulses_per_unit = 100
[axis.motor]
torque = [[0, 1.0]]
[[carriage]]
name = "on-x"
axis = "x"
frequency = 5
[[carriage.switch]]
above = 100
to = "c.IN1"
[[carriage]]
name = "on-y"
axis = "y"
frequency = 5
[[carriage.switch]]
position = 20
width = 8
period = 50
to = "c.IN2"
[[gantry]]
name = "beam"
axis = "x"
other = "y"
limit = 1
[[cylinder]]
name = "lift"
stroke = 60
[[cylinder.switch]]
above = 59
to = "c.IN3"
[[shaft]]
name = "cams"
axis = "y"
ratio = 0.05
[[shaft.cam]]
from = 90
until = 135
to = "c.IN4"
[[shaft.cam]]
from = 350
until = 15
to = "c.IN5"
[[follower]]
name = "knife"
shaft = "cams"
points = [[30, 0], [90, 12], [150, 12], [200, 0]]
[[follower.switch]]
below = 1
to = "c.IN6"
[[conveyor]]
name = "belt"
length = 101
speed = 10
workpiece = 50
[[conveyor.sensor]]
at = 30
to = "c.IN7"
"""


def pin(number: int) -> tuple[str, str]:
    return "c", f"IN{number}"


@pytest.mark.parametrize(
    ("kind", "name", "drawing"),
    [
        ("carriage", "on-x", Drawing("slide", 300.0, ("position",), sensors=(SensorZone(pin(1), 100.0, None),), low=-5.0)),
        # No travel is known: from 0 to the end of its zone at 24, and a twentieth beyond.
        (
            "carriage",
            "on-y",
            Drawing("slide", 24.0 * 1.1, ("position",), sensors=(SensorZone(pin(2), 16.0, 24.0, 50.0),), low=-1.2),
        ),
        ("gantry", "beam", Drawing("slide", 300.0, ("position",), low=-5.0)),
        ("cylinder", "lift", Drawing("rod", 60.0, ("position",), sensors=(SensorZone(pin(3), 59.0, None),))),
        # A cam through 0 ends beyond a turn.
        (
            "shaft",
            "cams",
            Drawing("dial", 360.0, ("angle",), sensors=(SensorZone(pin(4), 90.0, 135.0), SensorZone(pin(5), 350.0, 375.0))),
        ),
        ("follower", "knife", Drawing("rod", 12.0, ("position",), sensors=(SensorZone(pin(6), None, 1.0),))),
        # Three pieces of 50 mm and a bit of a fourth are on 101 mm.
        (
            "conveyor",
            "belt",
            Drawing("belt", 101.0, ("place1", "place2", "place3", "place4"), 50.0, (SensorZone(pin(7), 30.0, 30.0),)),
        ),
    ],
)
def test_drawings(kind: str, name: str, drawing: Drawing) -> None:
    world = World.from_toml(WORLD)
    draw = ELEMENTS[kind].drawing
    assert draw is not None
    found = draw(world.objects.elements[kind][name])
    assert found.length == pytest.approx(drawing.length)
    assert found.low == pytest.approx(drawing.low)
    assert (found.shape, found.places, found.size, found.sensors) == (
        drawing.shape,
        drawing.places,
        drawing.size,
        drawing.sensors,
    )


def test_rails() -> None:
    zone = SensorZone(pin(1), -40.0, -20.0)
    assert rail((0.0, 10.0), beyond=2.0) == Drawing("slide", 14.0, ("position",), low=-2.0)
    assert rail((0.0, 10.0)) == Drawing("slide", 10.0, ("position",))
    assert rail(None) == Drawing("slide", 2.0, ("position",), low=-1.0)
    assert rail(None, (zone,)) == Drawing("slide", 44.0, ("position",), sensors=(zone,), low=-42.0)
    assert rail(None, (zone,), beyond=1.0) == Drawing("slide", 42.0, ("position",), sensors=(zone,), low=-41.0)
