from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path

import pytest
from space_rig import BELT, BLADE, ROD, place_in

from steptwin.controller import SECOND, Nanos
from steptwin.files.scene.recordedscene import RecordedScene
from steptwin.files.scene.recorder import SceneRecorder
from steptwin.files.scene.scenescript import SceneScript
from steptwin.files.world import World
from steptwin.simulation.space.frames import FLOOR, NM_PER_MM, pose
from steptwin.subject.scene import WorkpieceState

ROOT = Path(__file__).parents[3]
EXAMPLES = ROOT / "examples/worlds"
DEMO = ROOT / "src/steptwin/live/studio/demo_machine/demo.toml"
JAWS = """
[[mic488]]
name = "table"
[[axis]]
name = "turn"
drive = "table.M1"
kind = "rotary"
at = [0, 0, 200]
along = "+z"
[[cylinder]]
name = "lift"
stroke = 60
on = "turn"
at = [100, 0, 0]
along = "-z"
[[gripper]]
name = "jaws"
stroke = 60
on = "lift"
along = "+x"
[[nest]]
name = "tray"
at = [100, 0, 100]
cells = [1, 1]
pitch = [60, 60]
workpiece = [40, 30, 50]
filled = 1
[[body]]
name = "hand"
at = [0, -300, 0]
size = [50, 50, 50]
when = "time > 1 and time < 2.5"
[[button]]
name = "down"
to = "lift.extend"
[[button]]
name = "grip"
to = "jaws.close"
[[script]]
name = "way"
steps = [
  { press = "down" }, { wait = "1 s" }, { press = "grip" }, { wait = "700 ms" }, { release = "down" }, { wait = "300 ms" },
  { press = "down" }, { wait = "800 ms" }, { release = "grip" },
]
"""
SWINGS = """
[[mic488]]
name = "table"
[mic488.M1]
unit = "mm"
gear = 640.0
acc = 400.0
dec = 400.0
vel = 100.0
[[axis]]
name = "x"
drive = "table.M1"
pitch = 5.0
at = [0, 0, 100]
[[carriage]]
name = "load"
axis = "x"
frequency = 8.0
damping = 0.05
at = [0, 50, 100]
[[shaft]]
name = "cams"
axis = "x"
ratio = 0.1
at = [0, 300, 50]
along = "+x"
[[body]]
name = "arm"
on = "cams"
at = [0, 30, 0]
size = [10, 10, 10]
[[follower]]
name = "knife"
shaft = "cams"
points = [[0, 0], [90, 10], [180, 10], [270, 0]]
at = [0, 350, 50]
along = "+z"
[[body]]
name = "lid"
when = "x.position % 20 < 10"
at = [300, 0, 0]
size = [10, 10, 10]
[[script]]
name = "way"
steps = [
  { write = { "table.M1_EN" = 1 } }, { write = { "table.M1_POS_ABS" = 120 } }, { wait = "1800 ms" },
  { write = { "table.M1_POS_ABS" = -20 } },
]
"""


def recorded(world: World, seconds: float) -> RecordedScene:
    recorder = SceneRecorder()
    recorder.follow(world)
    world.run(for_=seconds)
    scene = recorder.recorded()
    assert scene is not None
    return scene


def state_of(scene: RecordedScene, name: str, now: Nanos) -> WorkpieceState | None:
    return [None, *(stint.place for stint in scene.workpieces.get(name, []) if stint.begin <= now)][-1]


def moments(seconds: float, count: int) -> Iterator[Nanos]:
    yield from sorted(random.Random(7).randrange(round(seconds * SECOND)) for _ in range(count))


@pytest.mark.parametrize("path", ["palletizer/palletizer", "pick_and_place/pick_and_place", "press/press", "hoist/hoist", None])
def test_a_recorded_scene_is_where_the_world_is(path: str | None) -> None:
    """Everything that moves, every level and every workpiece, at moments that nothing else knows of."""
    file = DEMO if path is None else EXAMPLES / f"{path}.toml"
    scene = recorded(World.load(file), 16.0)
    wanted = SceneScript().wanted(scene.machine)
    assert set(wanted["signals"]) <= scene.motions.keys()
    assert set(wanted["levels"]) <= scene.levels.keys() | scene.motions.keys()
    lamps = [f"{body.name}.lit" for body in scene.machine.scene.bodies if body.lit is not None]
    world = World.load(file)
    for now in moments(16.0, 150):
        world.advance(now)
        world.sync_all()
        for name, mounted in world.objects.frames.items():
            for one in mounted.movements:
                factor = one.per_unit / 90.0 if one.turns else one.per_unit * NM_PER_MM
                assert scene.value(f"{name}.{one.signal}", now) == pytest.approx(one.motion.at(now) / factor, abs=1e-3), (
                    name,
                    now,
                )
        for signal, changes in scene.levels.items():
            assert [level for moment, level in changes if moment <= now][-1] == world.read(signal), (signal, now)
        for lamp in lamps:
            assert scene.value(lamp, now) == world.read(lamp), (lamp, now)
        check_workpieces(scene, world, now)


def check_workpieces(scene: RecordedScene, world: World, now: Nanos) -> None:
    frames = world.objects.frames
    bodies = world.objects.workpieces.bodies()
    assert {name for name in scene.workpieces if state_of(scene, name, now) is not None} == set(bodies)
    for name, body in bodies.items():
        state = state_of(scene, name, now)
        assert state is not None
        there = pose(body.frame, FLOOR if state.on is None else frames[state.on].frame, now).at
        place = place_in(state, lambda signal: scene.value(signal, now) or 0.0)
        assert place == pytest.approx([one / NM_PER_MM for one in there], abs=1e-3), (name, now)


def test_what_is_pushed_is_where_its_pusher_has_it() -> None:
    script = """
    [[script]]
    name = "push"
    steps = [{ write = { "c.OUT1" = 1 } }, { wait = "5.2 s" }, { write = { "c.OUT2" = 1 } }]
    """
    text = BELT + ROD.replace("stroke = 120", "stroke = 80") + BLADE + script
    scene, world = recorded(World.from_toml(text), 6.0), World.from_toml(text)
    for now in moments(6.0, 200):
        world.run(until=now / SECOND)
        check_workpieces(scene, world, world.now)
    assert {len(stint.place.moves) for stint in scene.workpieces["main.1"] if stint.place is not None} >= {1, 2}


def test_jaws_and_a_hand_that_comes_and_goes() -> None:
    scene = recorded(World.from_toml(JAWS), 5.0)
    world = World.from_toml(JAWS)
    for now in moments(5.0, 200):
        world.advance(now)
        for signal in ("jaws.position", "hand.present"):
            assert scene.value(signal, now) == pytest.approx(world.read(signal), abs=1e-3), (signal, now)
    assert [place.on for _, place in scene.workpieces["tray.1"] if place is not None] == ["tray", "jaws", "tray"]


def test_what_swings_turns_and_is_lifted_and_what_no_event_shows() -> None:
    """Plans with more polynomials than are computed at once, the last of which are cut by another plan."""
    scene = recorded(World.from_toml(SWINGS), 5.0)
    world = World.from_toml(SWINGS)
    for now in moments(5.0, 400):
        world.advance(now)
        world.sync_all()
        for name in ("load", "knife", "cams"):
            (one,) = world.objects.frames[name].movements
            factor = one.per_unit / 90.0 if one.turns else one.per_unit * NM_PER_MM
            assert scene.value(f"{name}.{one.signal}", now) == pytest.approx(one.motion.at(now) / factor, abs=1e-3), (name, now)
        assert scene.value("lid.present", now) == world.read("lid.present"), now
    assert len(scene.motions["load.position"]) > 100
    assert len(scene.motions["cams.angle"]) < 20


def test_recording_changes_nothing() -> None:
    plain, watched = (World.load(EXAMPLES / "palletizer/palletizer.toml") for _ in range(2))
    plain.run(for_=12.0)
    recorded(watched, 12.0)
    assert watched.trace.digest() == plain.trace.digest()


def test_a_world_without_space_has_no_scene() -> None:
    recorder = SceneRecorder()
    recorder.follow(World.from_toml('[[mic488]]\nname = "table"\n'))
    assert recorder.recorded() is None
