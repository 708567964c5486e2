"""The motion of what axes move besides their loads, in every export: what the world said while it ran."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path
from random import Random
from textwrap import dedent

import pytest

from steptwin.controller import MILLISECOND, SECOND
from steptwin.errors import Misuse
from steptwin.files.export import axis_views, read_trace, write_trace
from steptwin.files.export.tracetracks import sort_out
from steptwin.files.world import World
from steptwin.simulation.mechanics.channels import MovedChannel

MACHINE = dedent("""
    [world]
    name = "moved"
    [[mic488]]
    name = "m"
    [mic488.M1]
    unit = "mm"
    gear = 640.0
    acc = 400.0
    dec = 4000.0
    vel = 100.0
    [mic488.M3]
    unit = "mm"
    gear = 640.0
    vel = 30
    [mic488.M4]
    unit = "mm"
    gear = 640.0
    vel = 30
    [[axis]]
    name = "x"
    drive = "m.M1"
    pulses_per_unit = 640.0
    SIGN
    start = 3.0
    [[axis]]
    name = "y1"
    drive = "m.M3"
    pitch = 5.0
    [axis.motor]
    torque = [[0, 1.2], [1500, 0.5]]
    [[axis]]
    name = "y2"
    drive = "m.M4"
    pitch = 5.0
    start = 1.0
    [axis.motor]
    torque = [[0, 1.2], [1500, 0.5]]
    [[gantry]]
    name = "beam"
    axis = "y1"
    other = "y2"
    limit = 2.0
    mass = 2.0
    [[carriage]]
    name = "tool"
    axis = "x"
    frequency = 14
    damping = 0.06
    [[shaft]]
    name = "cams"
    axis = "x"
    ratio = -0.05
    offset = 40
    [[follower]]
    name = "knife"
    shaft = "cams"
    points = [[30, 0], [90, 12], [150, 12], [200, 1]]
    [[script]]
    name = "hand"
    steps = [
      { write = { "m.M1_EN" = 1, "m.M3_EN" = 1, "m.M4_EN" = 1 } },
      { write = { "m.M1_POS_ABS" = 120.0, "m.M3_POS_ABS" = 20.0, "m.M4_POS_ABS" = 20.0 } },
      { wait = "2200 ms" },
      { write = { "m.M1_POS_ABS" = -30.0 } },
      { wait = "500 ms" },
      { write = { "m.M1_POS_ABS" = 10.0 } },
    ]
""")
FAULTS = dedent("""
    [[fault]]
    kind = "slipping-coupling"
    element = "cams"
    from_s = 0.8
    until_s = 0.9
    [[fault]]
    kind = "slack-belt"
    element = "tool"
    share = 0.4
    from_s = 1.62
    until_s = 2.3
    [[fault]]
    kind = "stuck-follower"
    element = "knife"
    from_s = 0.4
    until_s = 0.5
    [[fault]]
    kind = "worn-cam"
    element = "knife"
    share = 0.5
    from_s = 1.2
    until_s = 3.0
    [[fault]]
    kind = "stall"
    machine = "m"
    axis = 4
    at_s = 0.5
    for_s = 0.3
""")
PULSE = 1.0 / 640
# Where the load is at whole pulses in the world and between them in a trace, by a pulse; the carriage by that of a cubic.
CHANNELS = {
    "tool.position": PULSE / 25,
    "cams.angle": 360 * 0.05 * PULSE * 1.05,
    "knife.position": 360 * 0.05 * PULSE * 12 / 50,
    "beam.position": 5 / 3200 * 1.05,
}
WORLDS = {
    "sound": (MACHINE.replace("SIGN", ""), ""),
    "inverted": (MACHINE.replace("SIGN", "inverted = true"), ""),
    "stop": (MACHINE.replace("SIGN", "travel = [-10.0, 80.0]"), ""),
    "faults": (MACHINE.replace("SIGN", ""), FAULTS),
}


@pytest.fixture(params=WORLDS)
def world(request: pytest.FixtureRequest) -> World:
    return World.from_toml("".join(WORLDS[request.param]))


def test_channels_say_what_the_world_said(world: World) -> None:
    chance = Random(3)
    said = {name: list[tuple[int, float]]() for name in CHANNELS}
    for now in sorted({chance.randrange(1, 6 * SECOND) for _ in range(1500)}):
        world.run(until=now / SECOND)
        for name, values in said.items():
            values.append((world.now, world.read(name)))
    world.run(until=6)
    tracks = sort_out(world.trace, axis_views(world), 0, world.now)
    tracks = {track.view.name.replace(" ", "."): track for track in tracks.moved}
    assert set(tracks) == set(CHANNELS)
    for name, values in said.items():
        for now, value in values:
            plan = tracks[name].plan(now)
            assert plan.position(now) == pytest.approx(value, abs=CHANNELS[name]), (name, now)  # type: ignore[union-attr]
        assert max(value for _, value in values) - min(value for _, value in values) > 5


def test_a_window_and_a_file_have_the_same_channels(tmp_path: Path) -> None:
    world = World.from_toml("".join(WORLDS["faults"]))
    world.run(until=4)
    write_trace(world.trace, tmp_path, views=axis_views(world), title="moved", ended=world.now)
    saved = read_trace(tmp_path)
    assert saved.views == axis_views(world)
    whole = sort_out(saved.trace, saved.views, 0, saved.until)
    part = sort_out(saved.trace, saved.views, 2 * SECOND, 3 * SECOND)
    for one, other in zip(whole.moved, part.moved, strict=True):
        for now in range(2 * SECOND, 3 * SECOND, 7 * MILLISECOND):
            assert one.plan(now).position(now) == pytest.approx(other.plan(now).position(now), abs=1e-3)  # type: ignore[union-attr]


def test_every_format_has_them(tmp_path: Path) -> None:
    world = World.from_toml(WORLDS["sound"][0])
    world.run(until=3)
    for name in ("t.csv", "t.vcd", "t.html", "t.svg"):
        write_trace(world.trace, tmp_path / name, views=axis_views(world), title="moved", ended=world.now, period=MILLISECOND)
    rows = list(csv.DictReader((tmp_path / "t.csv").read_text().splitlines()))
    assert float(rows[-1]["m.tool_position_mm"]) == pytest.approx(world.read("tool.position"), abs=PULSE)
    assert float(rows[-1]["m.cams_angle_degree"]) == pytest.approx(world.read("cams.angle"), abs=0.03)
    named = dict(re.findall(r"\$var real 64 (\S+) (\S+) \$end", (tmp_path / "t.vcd").read_text()))
    assert {"tool_position_mm", "cams_angle_degree", "knife_position_mm", "beam_position_mm"} <= set(named.values())
    (data,) = re.findall(r'<script[^>]*id="data"[^>]*>(.*?)</script>', (tmp_path / "t.html").read_text(), re.DOTALL)
    names = ["cams angle", "knife position", "tool position", "beam position"]
    assert [one["name"] for one in json.loads(data)["moved"]] == names
    picture = (tmp_path / "t.svg").read_text()
    assert all(label in picture for label in names)


def test_a_picture_ends_after_the_swing() -> None:
    world = World.from_toml(MACHINE.replace("SIGN", ""))
    world.run(until=8)
    tracks = sort_out(world.trace, axis_views(world), 0, world.now)
    quiet = world.read("tool.settled")
    assert quiet == 1.0
    assert tracks.axes[0].plans[-1].end < tracks.last < world.now  # type: ignore[union-attr, operator]


@pytest.mark.parametrize(
    "wrong",
    [
        {"per_pulse": 0.0},
        {"per_pulse": "1"},
        {"points": ((10.0, 1.0), (5.0, 2.0))},
        {"points": ((0.0, 1.0), (400.0, 2.0))},
        {"spring": (0.0, 0.1)},
        {"spring": (10.0, 1.0)},
        {"other": ("m",)},
        {"unknown": 1},
    ],
)
def test_a_channel_that_nobody_can_compute_is_refused(tmp_path: Path, wrong: dict[str, object]) -> None:
    world = World.from_toml(MACHINE.replace("SIGN", ""))
    world.run(until=1)
    place = tmp_path / "t.jsonl"
    write_trace(world.trace, place, views=axis_views(world), title="moved", ended=world.now)
    head, *rest = place.read_text().splitlines(keepends=True)
    data = json.loads(head)
    axis = next(one for one in data["axes"] if one.get("mechanics", {}).get("moved"))
    axis["mechanics"]["moved"][0] = MovedChannel("tool", "position", "mm", 0.001)._asdict() | wrong
    place.write_text(json.dumps(data) + "\n" + "".join(rest))
    with pytest.raises(Misuse, match="not the first line of a trace"):
        read_trace(place)
