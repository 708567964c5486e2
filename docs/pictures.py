"""Pictures of elements and of a machine for the docs, from worlds that run: ``python docs/pictures.py``."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from io import BytesIO
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
from PIL import Image
from resvg_py import svg_to_bytes

from steptwin.controller import SECOND
from steptwin.files.scene.picture import View, picture, write_picture
from steptwin.files.scene.recorder import SceneRecorder
from steptwin.files.world import World
from steptwin.live.studio.demo import FOLDER, describe_demo
from steptwin.simulation.world.simulation import Simulation

IMAGES = Path(__file__).parent / "images"
CONTROLLER = """
[[mic488]]
name = "table"
[mic488.M1]
unit = "mm"
gear = 640.0
acc = 400.0
dec = 400.0
vel = 100.0
"""
SECOND_MOTOR = """
[mic488.M2]
unit = "mm"
gear = 640.0
acc = 400.0
dec = 400.0
vel = 100.0
"""
AXIS = """
[[axis]]
name = "z"
drive = "table.M1"
pitch = 5.0
travel = [0.0, 400.0]
start = 200.0
[axis.motor]
torque = [[0, 0.9], [1500, 0.7]]
inertia = 0.00003
mass = 4.0
force = 39.0
friction = 0.2
when_off = "free"
start_speed = 120
"""
Steps = Sequence[tuple[float, str]]
"""Seconds and what happens: TARGET = VALUE, of a register; a button with + or -."""


def draw(name: str, text: str, steps: Steps, end_s: float, curves: Sequence[str], levels: Sequence[str]) -> None:
    """Signals over the time: ``curves`` above one another, ``levels`` as channels."""
    world = World.from_toml(CONTROLLER + text)
    times: list[float] = []
    read: dict[str, list[float]] = {signal: [] for signal in (*curves, *levels)}
    due = list(steps)
    for n in range(1001):
        now = end_s * n / 1000
        while due and due[0][0] <= now:
            world.run(until=max(due[0][0], world.now / SECOND))
            target, _, value = due.pop(0)[1].partition("=")
            if value:
                world.mic488["table"].write(target, float(value))
            elif target.endswith("+"):
                world.press(target[:-1])
            else:
                world.release(target[:-1])
        world.run(until=max(now, world.now / SECOND))
        times.append(now)
        for signal, values in read.items():
            values.append(world.read(signal))
    rows = len(curves) + bool(levels)
    heights = [*[2.2] * len(curves), *[0.45 * len(levels)] * bool(levels)]
    figure, found = plt.subplots(
        rows, 1, sharex=True, squeeze=False, figsize=(8, 0.6 + 0.75 * sum(heights)), gridspec_kw={"height_ratios": heights}
    )
    axes = found[:, 0]
    for place, signal in zip(axes, curves, strict=False):
        place.plot(times, read[signal], linewidth=1.4)
        place.set_ylabel(signal)
        place.grid(alpha=0.3)
    for row, signal in enumerate(reversed(levels)):
        axes[-1].broken_barh(list(spans(times, read[signal])), (row, 0.6), alpha=0.6)
        axes[-1].axhline(row, color="0.8", linewidth=0.5)
    if levels:
        axes[-1].set_ylim(-0.2, len(levels))
        axes[-1].set_yticks([row + 0.3 for row in range(len(levels))], list(reversed(levels)))
    axes[-1].set_xlabel("s")
    axes[-1].set_xlim(0, end_s)
    figure.tight_layout()
    figure.savefig(IMAGES / f"{name}.svg", metadata={"Date": None})
    plt.close(figure)


def spans(times: Sequence[float], levels: Sequence[float]) -> Iterator[tuple[float, float]]:
    """Where a level is on: begin and length."""
    begin: float | None = None
    for now, level in zip(times, levels, strict=True):
        if level and begin is None:
            begin = now
        elif not level and begin is not None:
            yield begin, now - begin
            begin = None
    if begin is not None:
        yield begin, times[-1] - begin


STOPS = """
[[button]]
name = "stop1"
to = "safety.coil"
contact = "NC"
join = "series"
[[button]]
name = "stop2"
to = "safety.coil"
contact = "NC"
join = "series"
[[relay]]
name = "safety"
pull_in = "150 ms"
drop_out = "80 ms"
[[wire]]
from = "safety.no"
to = "table.IN9"
[[timer]]
name = "restart"
kind = "on-delay"
input = "safety.no"
time = "400 ms"
[[latch]]
name = "alarm"
set = "safety.nc"
reset = "restart.out"
"""
CLAMP = """
[[cylinder]]
name = "clamp"
extend = "table.OUT1"
stroke = 50.0
extend_time = "600 ms"
retract_time = "400 ms"
[[cylinder.switch]]
above = 25.0
to = "table.IN3"
"""
BRAKE = """
[[brake]]
name = "hold"
axis = "z"
torque = 0.6
release = "table.OUT4"
release_time = "40 ms"
apply_time = "80 ms"
"""
CRASH = """
[[cylinder]]
name = "clamp"
extend = "table.OUT1"
[[collision]]
name = "crash"
when = "z.position > 250 and not clamp.retracted"
effect = "jam"
reset = "table.OUT2"
"""
LOADS = """
[[load]]
name = "box"
axis = "z"
mass = 12.0
force = 1400.0
when = "table.OUT5"
[[load]]
name = "guide"
axis = "z"
friction_force = 1500.0
of = "z.position"
points = [[240, 0], [300, 1]]
"""
SHAFT = """
[[shaft]]
name = "cams"
axis = "z"
ratio = 0.05
[[shaft.cam]]
from = 90
until = 135
to = "table.IN11"
[[shaft.cam]]
from = 350
until = 15
to = "table.IN12"
[[fault]]
kind = "slipping-coupling"
element = "cams"
from_s = 0.9
until_s = 1.0
"""
GANTRY = f"""{SECOND_MOTOR}[[axis]]
name = "y1"
drive = "table.M1"
pitch = 5.0
[axis.motor]
torque = [[0, 1.2], [1500, 0.5]]
[[axis]]
name = "y2"
drive = "table.M2"
pitch = 5.0
[axis.motor]
torque = [[0, 1.2], [1500, 0.5]]
[[gantry]]
name = "beam"
axis = "y1"
other = "y2"
limit = 2.0
mass = 20.0
friction_force = 120.0
reset = "table.OUT7"
[[wire]]
from = "beam.skewed"
to = "table.IN8"
"""
CONVEYOR = """
[[conveyor]]
name = "infeed"
length = 300.0
speed = 200.0
run = "table.OUT1"
feed = "table.OUT2"
workpiece = 60.0
next = "outfeed"
[[conveyor.sensor]]
at = 250.0
to = "table.IN5"
[[conveyor]]
name = "outfeed"
length = 300.0
speed = 400.0
run = "table.OUT1"
workpiece = 60.0
"""
STOP = """
[[conveyor]]
name = "line"
length = 600.0
speed = 200.0
run = "table.OUT1"
feed_every = "500 ms"
workpiece = 60.0
[[conveyor.stop]]
at = 400.0
hold = "table.OUT2"
"""
TOOL = f"""{SECOND_MOTOR}[[axis]]
name = "a"
drive = "table.M1"
pitch = 5.0
[[axis]]
name = "b"
drive = "table.M2"
pitch = 5.0
[[tool]]
name = "head"
axis = "a"
other = "b"
[[tool.x_switch]]
above = 40.0
to = "table.IN1"
[[fault]]
kind = "slipping-belt"
element = "head"
from_s = 0.6
until_s = 0.7
"""
CUP = """
[[button]]
name = "part"
to = "cup.pick"
[[vacuum]]
name = "cup"
ejector = "table.OUT1"
"""
GRIPPER = """
[[button]]
name = "part"
to = "jaws.pick"
[[gripper]]
name = "jaws"
close = "table.OUT1"
"""
VOLTAGE = """
[[button]]
name = "start"
to = "table.IN5"
[[source]]
name = "oven"
to = "table.AIN1"
kind = "table"
points = [[0, 1.0], [2, 6.0], [3, 5.5]]
[[fault]]
kind = "broken-wire"
element = "oven"
from_s = 2.2
until_s = 2.7
"""
GAP = """
[[transducer]]
name = "gap"
of = "z.position"
to = "table.AIN2"
points = [[200, 1.0], [240, 9.0], [260, 9.0], [300, 2.0]]
resolution = 0.25
"""

SPACE = """
[[axis]]
name = "x"
drive = "table.M1"
pitch = 5.0
at = [0, 0, 200]
[[cylinder]]
name = "lift"
extend = "table.OUT1"
stroke = 60.0
extend_time = "250 ms"
retract_time = "200 ms"
on = "x"
along = "-z"
[[vacuum]]
name = "cup"
ejector = "table.OUT2"
on = "lift"
at = [0, 0, -19]
[[nest]]
name = "tray"
at = [0, 0, 100]
workpiece = [40, 30, 20]
filled = 1
[[beam]]
name = "passes"
at = [60, -50, 165]
along = "+y"
length = 100
"""
TANK = """
[[cylinder]]
name = "valve"
extend = "table.OUT1"
stroke = 10.0
extend_time = "200 ms"
retract_time = "100 ms"
[[integrator]]
name = "tank"
unit = "l"
start = 6.0
low = 0.0
high = 8.0
rate = "2.5 * table.OUT2 - 0.4 * valve.position"
[[integrator.switch]]
below = 3.0
to = "table.IN4"
[[integrator]]
name = "bottle"
unit = "l"
rate = "0.4 * valve.position * (1 - tank.at_low)"
reset = "table.OUT3"
"""
REEL = """
[[dcmotor]]
name = "reel"
speed = 90
run = "table.OUT1"
run_up = "800 ms"
coast = "1.5 s"
[[fault]]
kind = "dead-motor"
element = "reel"
from_s = 1.4
until_s = 1.8
"""


def draw_moving(name: str, world: Simulation, begin_s: int, seconds: int) -> None:
    """A machine in space that moves, ten pictures a second."""
    frames = []
    for n in range(10 * seconds):
        world.advance(begin_s * SECOND + n * SECOND // 10)
        frames.append(as_image(picture(world, View.ISO), 720))
    palette = frames[0].quantize(64)
    first, *rest = (frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames)
    first.save(IMAGES / f"{name}.gif", save_all=True, append_images=rest, duration=100, loop=0, optimize=True)


def as_image(svg: str, width: int) -> Image.Image:
    return Image.open(BytesIO(svg_to_bytes(svg_string=svg, width=width, background="white", skip_system_fonts=True))).convert(
        "RGB"
    )


def main() -> None:
    mpl.rcParams["svg.hashsalt"] = "steptwin"
    presses = ((0.5, "stop1+"), (1.0, "stop1-"), (2.0, "stop2+"), (2.05, "stop2-"))
    draw("logic", STOPS, presses, 3.0, (), ("safety.coil", "safety.no", "restart.out", "alarm.out"))
    strokes = ((0.2, "OUT1=1"), (1.2, "OUT1=0"), (1.9, "OUT1=1"), (2.2, "OUT1=0"))
    draw("cylinder", CLAMP, strokes, 3.0, ("clamp.position",), ("table.OUT1", "clamp.extended", "clamp.retracted", "table.IN3"))
    stops = ((0.0, "M1_EN=1"), (0.0, "OUT4=1"), (0.3, "M1_POS_REL=30"), (1.2, "OUT4=0"), (1.2, "M1_EN=0"))
    heavy = AXIS.replace("force = 39.0", "force = 400.0")
    draw("brake", heavy + BRAKE, stops, 2.0, ("z.position",), ("table.OUT4", "hold.released", "table.M1_EN"))
    crash = ((0.0, "M1_EN=1"), (0.2, "M1_POS_REL=100"), (0.5, "OUT1=1"), (2.0, "OUT2=1"))
    draw("collision", AXIS + CRASH, crash, 2.5, ("z.position", "table.M1.position"), ("clamp.retracted", "crash.hit"))
    lifted = ((0.0, "M1_EN=1"), (0.3, "OUT5=1"), (0.315, "OUT5=0"), (0.8, "M1_POS_REL=100"))
    draw("load", AXIS + LOADS, lifted, 2.4, ("z.position", "guide.share"), ("box.acts", "z.stalled"))
    way = ((0.0, "M1_EN=1"), (0.2, "M1_POS_REL=100"))
    cup = (
        (0.0, "M1_EN=1"),
        (0.1, "OUT1=1"),
        (0.4, "OUT2=1"),
        (0.6, "OUT1=0"),
        (0.9, "M1_POS_REL=100"),
        (2.4, "OUT1=1"),
        (2.7, "OUT2=0"),
        (2.8, "OUT1=0"),
    )
    draw("beam", SPACE, cup, 3.2, ("x.position", "lift.position"), ("table.OUT2", "cup.held", "passes.seen"))
    fills = ((0.2, "OUT1=1"), (1.1, "OUT1=0"), (1.6, "OUT3=1"), (1.7, "OUT3=0"), (1.8, "OUT2=1"), (2.4, "OUT1=1"))
    draw("integrator", TANK, fills, 3.4, ("valve.position", "tank.value", "bottle.value"), ("table.OUT2", "table.IN4"))
    runs = ((0.2, "OUT1=1"), (2.6, "OUT1=0"))
    draw("dcmotor", REEL, runs, 4.5, ("reel.speed", "reel.angle"), ("table.OUT1",))
    draw("transducer", AXIS + GAP, way, 1.8, ("z.position", "gap.volts"), ())
    draw("shaft", AXIS + SHAFT, way, 1.8, ("z.position", "cams.angle"), ("table.IN11", "table.IN12"))
    apart = ((0.0, "M1_EN=1"), (0.0, "M2_EN=1"), (0.2, "M1_POS_REL=80"), (0.2, "M2_POS_REL=80"), (0.7, "M2_EN=0"))
    draw("gantry", GANTRY, apart, 1.6, ("y1.position", "y2.position", "beam.skew"), ("table.M2_EN", "beam.skewed"))
    turns = ((0.0, "M1_EN=1"), (0.0, "M2_EN=1"), (0.2, "M1_POS_REL=80"), (1.5, "M2_POS_REL=60"))
    draw("tool", TOOL, turns, 2.8, ("a.position", "b.position", "head.x", "head.y"), ("table.IN1",))
    feeds = ((0.1, "OUT1=1"), (0.2, "OUT2=1"), (0.9, "OUT2=0"), (1.0, "OUT2=1"), (1.6, "OUT1=0"), (2.2, "OUT1=1"))
    fronts = "infeed.place1", "outfeed.place1"
    draw("conveyor", CONVEYOR, feeds, 3.4, fronts, ("table.OUT1", "table.OUT2", "table.IN5"))
    draw("source", VOLTAGE, ((0.5, "start+"), (1.2, "start-")), 3.5, ("oven.volts",), ("start.pressed",))
    held = ((0.0, "OUT1=1"), (1.0, "OUT2=1"), (4.6, "OUT2=0"))
    draw("stop", STOP, held, 5.5, ("line.place1", "line.place2", "line.place3"), ("table.OUT2",))
    tries = ((0.1, "OUT1=1"), (0.5, "OUT1=0"), (0.6, "part+"), (0.8, "OUT1=1"), (1.3, "OUT1=0"))
    draw("vacuum", CUP, tries, 1.6, ("cup.pressure",), ("table.OUT1", "cup.pick", "cup.held"))
    draw(
        "gripper", GRIPPER, tries, 1.6, ("jaws.position",), ("table.OUT1", "jaws.pick", "jaws.opened", "jaws.closed", "jaws.held")
    )
    demo = World.from_toml(describe_demo(free_ports=True), {"demo.prg": (FOLDER / "demo.prg").read_bytes()})
    draw_moving("demo", demo, 6, 10)

    for name, seconds, example in (("palletizer", 35.0, "palletizer"), ("plotter-drawn", 10.3, "plotter")):
        recorder = SceneRecorder()
        with World.load(IMAGES.parents[1] / f"examples/worlds/{example}/{example}.toml") as world:
            recorder.follow(world)
            world.run(for_=seconds)
            write_picture(world, IMAGES / f"{name}.svg", recorder=recorder)


if __name__ == "__main__":
    main()
