"""What is built of descriptions before anything happens: mechanics, references, what is drawn and moved; golden/built.txt.

The world has references across controllers. Regenerate with
``make golden ARGS=tests/simulation/test_built_golden.py`` and read the diff.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from steptwin.files.export import axis_views
from steptwin.files.world import World
from steptwin.simulation.components.axis import AXIS
from steptwin.simulation.components.registry import ELEMENTS

GOLDEN = Path(__file__).parent / "golden" / "built.txt"
ACROSS = """
[[line]]
name = "bus"
kind = "modbus"
[[mic488]]
name = "a"
line = "bus"
[[mic488]]
name = "b"
line = "bus"
unit = 2
[mic488.M1]
enc_resol = 4000
[[m1486]]
name = "c"
[[axis]]
name = "x"
drive = "a.M1"
unit = "mm"
pulses_per_unit = 100
inverted = true
travel = [-10, 90]
start = 1.5
backlash = 0.25
[[axis.switch]]
above = 80
to = "b.IN1"
[axis.motor]
torque = [[0, 1.0], [1500, 0.3]]
inertia = 0.00003
friction = 0.05
when_off = "free"
[[axis]]
name = "y"
kind = "rotary"
drive = "b.M1"
[axis.encoder]
follows = "x"
[[axis.switch]]
position = 90
width = 4
to = "a.IN2"
[[axis]]
name = "z"
drive = "c.M1"
[[shaft]]
name = "main"
axis = "y"
ratio = 2
[[shaft.cam]]
from = 90
until = 180
to = "c.B3"
[[follower]]
name = "lever"
shaft = "main"
points = [[0, 0], [180, 5]]
[[follower.switch]]
above = 3
to = "a.IN3"
[[carriage]]
name = "head"
axis = "x"
frequency = 12
damping = 0.1
[[carriage.switch]]
above = 50
to = "c.B4"
[[cylinder]]
name = "clamp"
extend = "c.B5"
[[cylinder.switch]]
above = 45
to = "b.IN4"
[[conveyor]]
name = "belt"
length = 200
speed = 50
run = "a.OUT2"
next = "second"
[[conveyor.sensor]]
at = 100
to = "b.IN5"
[[conveyor]]
name = "second"
length = 200
axis = "z"
[[collision]]
name = "crash"
when = "x.position > y.position + clamp.position"
[[wire]]
from = "crash.hit"
to = "a.IN6"
"""
"""References to other controllers at every key that can have them."""


def described(world: World) -> Iterator[str]:
    yield f"schedulers: {'; '.join(' '.join(names) for names in world.blueprint.connected or ())}"
    for name, axis in world.objects.built(AXIS).items():
        yield f"axis {name}: {axis.mechanism.build}, {float(axis.scale.pulses_per_unit):.12g} imp/{axis.scale.unit}"
    yield from (f"view {'.'.join(name)}: {view}" for name, view in axis_views(world).items())
    for element in ELEMENTS.values():
        for spec in world.spec.elements.of(element):
            refers = (
                f"{one.one}–{one.other} {'.'.join(map(str, one.path))}" for one in element.refers(spec, world.spec.elements)
            )
            yield f"{'.'.join(map(str, spec.path))}: {', '.join(refers)}"
        for name, built in world.objects.built(element).items():
            if element.drawing is not None:
                yield f"  {name} is drawn: {element.drawing(built)}"
            for signal, of in ({} if element.signals is None else element.signals(built)).items():
                sources = " ".join(source.name for source in of.sources)
                yield f"  {name}.{signal}: {of.unit} {of.bounds} of {sources}"
            if element.moved is not None:
                yield from (f"  {name} is moved by {axis}: {channel}" for axis, channel in element.moved(built))
    for scheduler in world.schedulers:
        for number, part in enumerate(scheduler.parts):
            watched = sorted(name for name, numbers in scheduler._parts.by_name.items() if number in numbers)
            yield f"part {number} {type(part).__name__} of {scheduler._parts.computes[number]}: {' '.join(watched)}"


def test_what_is_built_is_the_reviewed() -> None:
    assert list(described(World.from_toml(ACROSS))) == GOLDEN.read_text(encoding="utf-8").splitlines()


if __name__ == "__main__":
    GOLDEN.write_text("".join(f"{line}\n" for line in described(World.from_toml(ACROSS))), encoding="utf-8")
