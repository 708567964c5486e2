"""A world with every element, and a program in each of its controllers."""

from __future__ import annotations

import re
from collections.abc import Iterator

from compositions import PARTS

from steptwin.files.world import World
from steptwin.simulation.components.registry import ELEMENTS
from steptwin.wire.crc import with_crc

READ = with_crc(bytes.fromhex("01 03 27 24 00 04"))
WORLD = """
[world]
name = "everything"
[[line]]
name = "bus"
timing = "real"
[[line]]
name = "chips"
kind = "m1486"
timing = "real"
[[mic488]]
name = "table"
line = "bus"
program = "p.prg"
start = true
[mic488.M1]
unit = "mm"
gear = 640.0
acc = 200.0
dec = 200.0
vel = 60.0
pos_ctrl_mode = "ENCODER"
err_ctrl_mode = "ERRMODE0"
[mic488.M2]
limit_mode = "KL+KR"
in_kl = "IN1"
in_kr = "IN2"
[[m1486]]
name = "drum"
line = "chips"
address = 3
[[axis]]
name = "x"
drive = "table.M1"
unit = "mm"
pitch = 5.0
travel = [-50.0, 302.0]
backlash = 0.02
[axis.encoder]
counts_per_rev = 400
[axis.motor]
torque = [[0, 1.0], [600, 0.5]]
inertia = 1e-5
friction = 0.05
when_off = "free"
[[carriage]]
name = "slide"
axis = "x"
frequency = 15.0
[[carriage.switch]]
above = 19.99
to = "table.IN7"
[[brake]]
name = "hold"
axis = "x"
torque = 0.6
release = "seen.out"
[[transducer]]
name = "gap"
of = "x.position"
to = "table.AIN2"
points = [[-50, 1.0], [302, 9.0]]
[[collision]]
name = "bump"
when = "x.position > 10 and clamp.position > 1"
[[body]]
name = "nose"
on = "x"
at = [0, 0, -10]
size = [20, 20, 10]
[[body]]
name = "wall"
when = "table.OUT1"
at = [40, 0, -20]
size = [10, 10, 30]
[[nest]]
name = "tray"
on = "x"
cells = [2, 1]
workpiece = [20, 10, 5]
filled = 3
[[beam]]
name = "glance"
at = [30, 0, 2]
along = "-x"
length = 60
[[collision]]
name = "nudge"
between = ["nose", "wall"]
[[axis]]
name = "left"
drive = "table.M3"
pitch = 5.0
[axis.motor]
torque = [[0, 1.0], [600, 0.5]]
[[axis]]
name = "right"
drive = "table.M4"
pitch = 5.0
[axis.motor]
torque = [[0, 1.0], [600, 0.5]]
[axis.encoder]
follows = "away"
counts_per_unit = 20
[[gantry]]
name = "beam"
axis = "left"
other = "right"
limit = 0.01
mass = 5.0
[[tool]]
name = "head"
axis = "x"
other = "left"
[[tool.x_switch]]
above = 5.0
to = "table.IN8"
[[load]]
name = "box"
axis = "left"
mass = 1.0
of = "left.position"
points = [[0, 0], [10, 1]]
when = "table.OUT1"
[[axis]]
name = "turret"
drive = "drum.M1"
kind = "rotary"
[[axis.switch]]
position = 90.0
width = 5.0
to = "table.IN6"
bounce = "2 ms"
[[wire]]
from = "table.OUT1"
to = "drum.B2"
delay = "3 ms"
[[shaft]]
name = "main"
axis = "x"
ratio = 0.05
[[follower]]
name = "knife"
shaft = "main"
points = [[30, 0], [90, 12], [150, 12], [200, 0]]
[[follower.switch]]
above = 11.5
to = "table.IN13"
[[supply]]
name = "rail"
feeds = "drum"
rise = "0 ms"
[[button]]
name = "start"
to = "table.IN9"
bounce = "5 ms"
[[source]]
name = "oven"
to = "table.AIN1"
kind = "sine"
value = 5.0
amplitude = 4.0
[[lamp]]
name = "busy"
from = "table.OUT1"
warms = "20 ms"
[[gate]]
name = "both"
kind = "or"
inputs = ["table.OUT1", "start-time.out"]
[[latch]]
name = "seen"
set = "clamp.extended"
[[wire]]
from = "seen.out"
to = "table.IN10"
[[timer]]
name = "start-time"
kind = "pulse"
time = "300 ms"
input = "table.OUT1"
[[counter]]
name = "cycles"
preset = 2
up = "both.out"
[[relay]]
name = "power"
coil = "both.out"
pull_in = "7 ms"
[[wire]]
from = "power.no"
to = "belt.run"
[[cylinder]]
name = "clamp"
extend = "power.no"
extend_time = "90 ms"
[[conveyor]]
name = "belt"
mass = 0.5
length = 300.0
speed = 500.0
feed_every = "150 ms"
[[conveyor.sensor]]
at = 100.0
to = "table.IN11"
bounce = "2 ms"
[[conveyor.stop]]
at = 200.0
hold = "power.nc"
[[vacuum]]
name = "cup"
ejector = "clamp.extended"
pick = "clamp.extended"
from = "belt"
pick_at = 80.0
build_up = "40 ms"
[[wire]]
from = "cup.held"
to = "table.IN12"
[[vacuum]]
name = "lifter"
ejector = "clamp.extended"
on = "x"
at = [0, 0, 11]
diameter = 8
[[conveyor]]
name = "away"
length = 100
run = "power.no"
speed = 100.0
ramp_up = "80 ms"
at = [0, 200, 40]
[[body]]
name = "blade"
on = "clamp"
at = [0, 180, 45]
size = [20, 10, 30]
pushes = true
[[gripper]]
name = "jaws"
close = "clamp.extended"
pick = "clamp.extended"
from = "belt"
pick_at = 120.0
close_time = "30 ms"
[[fault]]
kind = "jam"
element = "clamp"
from_s = 0.35
until_s = 0.9
[[fault]]
kind = "empty-feeder"
element = "belt"
from_s = 0.2
until_s = 0.5
[[fault]]
kind = "burnt-out"
element = "busy"
from_s = 0.4
until_s = 0.9
[[fault]]
kind = "lost-steps"
axis = 1
machine = "table"
pulses = 300
at_s = 0.7
[[fault]]
kind = "delay"
for_ms = 40
every = 2
[[fault]]
kind = "split"
[[fault]]
kind = "bounce"
machine = "table"
pin = "IN9"
[[fault]]
kind = "master-error"
machine = "table"
from_s = 0.5
until_s = 1.5
[[script]]
name = "both"
steps = [
  { write = { "table.M2_EN" = 1, "table.M2_VEL_ABS" = 400.0, "table.M3_EN" = 1, "table.M3_VEL_ABS" = 90.0 } },
  { send = "chips", text = "x3\\rv2000\\rf12800\\rr\\r" },
  { press = "start", for = "300 ms" },
]
"""
PROGRAM = b"M1 = ON\nA:\nPABS M1 20\nWAITPOS\nOUT1 = ON\nDELAY 0.05\nPABS M1 -3,5\nWAITPOS\nOUT1 = OFF\nJUMP A\n"


def _further() -> Iterator[str]:
    """The parts of random compositions with elements that are not above, at the controller and the axes of this world."""
    for part in PARTS:
        if _elements(part) - _elements(WORLD):
            yield re.sub(r"\bc(?=['.])", "table", part).replace("'y'", "'left'")


def _elements(text: str) -> set[str]:
    return {kind for kind in re.findall(r"^\[\[([a-z]+)\]\]", text, re.MULTILINE) if kind in ELEMENTS}


def everything() -> World:
    world = World.from_toml("\n".join((WORLD, *_further())), {"p.prg": PROGRAM})
    world.line["bus"].send(READ)
    return world
