"""Machines in space, and where their workpieces are."""

from __future__ import annotations

from collections.abc import Callable

from steptwin.files.world import World
from steptwin.simulation.space.frames import FLOOR, pose
from steptwin.subject.scene import WorkpieceState


def controller(name: str, gear: float, acc: float, vel: float) -> str:
    """A controller whose first axis counts ``gear`` pulses in a mm, with a ramp in mm/s² and a speed in mm/s."""
    return f"""
[[mic488]]
name = "{name}"
[mic488.M1]
unit = "mm"
gear = {gear}
acc = {acc}
dec = {acc}
vel = {vel}
mot_resol = 3200
"""


SLIDE = controller("a", 640.0, 100.0, 50.0) + (
    """
[[axis]]
name = "x"
drive = "a.M1"
pitch = 5.0
at = [0, 0, 500]
"""
)
"""A rail 500 mm above the floor."""
POST = """
[[body]]
name = "post"
at = [200, 0, 300]
size = [20, 20, 140]
"""


def head(on: str) -> str:
    """A body below what carries it."""
    return f'[[body]]\nname = "head"\non = "{on}"\nat = [0, 0, -30]\nsize = [40, 40, 30]\n'


BELT = controller("c", 160.0, 2000.0, 400.0) + (
    """
[[conveyor]]
name = "main"
length = 600
speed = 100
run = "c.OUT1"
feed_every = "2 s"
workpiece = [40, 30, 20]
at = [0, 0, 100]
"""
)
ROD = """
[[cylinder]]
name = "rod"
extend = "c.OUT2"
stroke = 120
at = [300, -80, 110]
along = "+y"
"""
"""400 mm/s."""
BLADE = """
[[body]]
name = "blade"
on = "rod"
size = [60, 10, 30]
pushes = true
"""


def told(world: World) -> list[str]:
    """What happened to workpieces."""
    return [str(record.value) for record in world.trace.of("event") if record.subject == "workpiece"]


def place(world: World, name: str) -> tuple[float, ...]:
    """The middle of the lower face of a workpiece, mm from the floor."""
    body = world.objects.workpieces.bodies()[name]
    return tuple(one / 1e6 for one in pose(body.frame, FLOOR, world.now).at)


def place_in(state: WorkpieceState, read: Callable[[str], float]) -> list[float]:
    """Where a viewer that knows the values of signals has a workpiece, in the frame of what carries it, mm."""
    found = [*state.at]
    for move in state.moves:
        found["xyz".index(move.along[1])] += float(f"{move.along[0]}1") * move.per_unit * (read(move.signal) - move.at)
    return found
