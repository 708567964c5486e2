"""The true position of mechanics in every export: what the world said while it ran."""

from __future__ import annotations

import csv
import io
import json
import re
from dataclasses import dataclass
from pathlib import Path
from textwrap import dedent

import pytest

from steptwin.controller import MILLISECOND, SECOND
from steptwin.files.export import AxisViews, axis_views, read_trace, write_trace
from steptwin.files.export.progress import silent
from steptwin.files.export.timeline import write_timeline
from steptwin.files.export.tracetracks import sort_out
from steptwin.files.world import World
from steptwin.simulation.faults import read
from steptwin.simulation.script import steps as do

PERIOD = 10 * MILLISECOND
PULSE = 1.001 / 640
MACHINE = """
    [world]
    name = "press"
    [[mic488]]
    name = "m"
    [mic488.M1]
    unit = "mm"
    gear = 640.0
    acc = 200.0
    dec = 200.0
    vel = 50.0
    [[axis]]
    name = "x"
    drive = "m.M1"
    pitch = 5.0
    start = 20.0
"""
MOVES = """
    [[script]]
    name = "hand"
    steps = [
      { write = { "m.M1_EN" = 1, "m.M1_POS_ABS" = 30.0 } },
      { until = "idle" },
      { write = { "m.M1_POS_ABS" = -25.0 } },
      { wait = "400 ms" },
      { write = { "m.M1_POS_ABS" = 12.5 } },
    ]
"""
BUILDS = {
    "backlash": "backlash = 0.5",
    "inverted, backlash": "backlash = 0.5\ninverted = true",
    "stops": "travel = [10.0, 40.0]",
    "inverted, stops, backlash": "travel = [5.0, 38.0]\nbacklash = 1.0\ninverted = true",
    "motor": "[axis.motor]\ntorque = [[0, 1.0], [500, 0.3]]\ninertia = 0.0001\nfriction = 0.1\nload = 0.25\nstart_speed = 60",
    "lost steps": '[[fault]]\nkind = "lost-steps"\nmachine = "m"\npulses = 700\nat_s = 0.5',
    "held rotor": 'backlash = 0.2\n[[fault]]\nkind = "stall"\nmachine = "m"\nfor_s = 0.3\nat_s = 0.5',
    "slip": "[axis.encoder]\ncounts_per_rev = 4000\nslip = 0.25",
}


@dataclass
class Ran:
    world: World
    positions: list[float]
    """What the world said every 10 ms."""

    @property
    def views(self) -> AxisViews:
        return axis_views(self.world)


def run(build: str) -> Ran:
    world = World.from_toml(dedent(MACHINE) + build + dedent(MOVES))
    positions = [world.axis["x"].position]
    while world.now < 5 * SECOND:
        world.run(for_=PERIOD / SECOND)
        positions.append(world.axis["x"].position)
    return Ran(world, positions)


@pytest.fixture(scope="module")
def stalled() -> Ran:
    return run(BUILDS["motor"])


@pytest.mark.parametrize("build", BUILDS.values(), ids=BUILDS)
def test_the_trace_knows_where_the_load_was(build: str) -> None:
    ran = run(build)
    (track,) = [axis for axis in sort_out(ran.world.trace, ran.views, 0, ran.world.now).axes if axis.view.name == "M1"]
    load = track.true()
    assert load is not None
    commanded = []
    for n, position in enumerate(ran.positions):
        now = n * PERIOD
        found = load.plan(now).position(now) / load.view.pulses_per_unit  # type: ignore[union-attr]
        # The load is at whole pulses, the profile between them.
        assert found == pytest.approx(position, abs=PULSE)
        sign = -1.0 if "inverted" in build else 1.0
        commanded.append(20.0 + sign * track.plan(now).position(now) / 640)  # type: ignore[union-attr]
    differs = any(abs(a - b) > 0.1 for a, b in zip(commanded, ran.positions, strict=True))
    assert differs is ("slip" not in build)


def test_the_trace_stays_compact_and_says_nothing_of_loads_that_follow(stalled: Ran) -> None:
    assert 0 < len(list(stalled.world.trace.loads())) < 10
    for build in ("", "travel = [-50.0, 90.0]", "[axis.encoder]\ncounts_per_rev = 4000"):
        assert not list(run(build).world.trace.loads())


def test_looking_changes_nothing(stalled: Ran) -> None:
    world = World.from_toml(dedent(MACHINE) + BUILDS["motor"] + dedent(MOVES))
    world.run(until=1.0)
    snapshot = world.snapshot()
    world.run(until=3.0)
    world.restore(snapshot)
    world.run(until=stalled.world.time)
    assert world.trace.digest() == stalled.world.trace.digest()


def test_samples_have_a_column_of_it(stalled: Ran, tmp_path: Path) -> None:
    write_trace(stalled.world.trace, tmp_path / "run.csv", views=stalled.views, ended=stalled.world.now, period=PERIOD)
    with (tmp_path / "run.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["m.x_true_position_mm"]) for row in rows] == pytest.approx(stalled.positions, abs=PULSE)
    assert [name for name in rows[0] if "true" in name] == ["m.x_true_position_mm"]


def test_signals_have_it_as_a_real_number(stalled: Ran, tmp_path: Path) -> None:
    write_trace(stalled.world.trace, tmp_path / "run.vcd", views=stalled.views, ended=stalled.world.now)
    text = (tmp_path / "run.vcd").read_text()
    (code,) = re.findall(r"\$var real 64 (\S+) x_true_position_mm \$end", text)
    values = re.findall(rf"^r(\S+) {re.escape(code)}$", text, re.MULTILINE)
    assert (float(values[0]), float(values[-1])) == (20.0, stalled.positions[-1])


def test_a_picture_and_a_page_have_a_channel_of_it(stalled: Ran, tmp_path: Path) -> None:
    write_trace(stalled.world.trace, tmp_path / "run.svg", views=stalled.views, title="press", ended=stalled.world.now)
    picture = (tmp_path / "run.svg").read_text()
    assert ">press<" in picture
    assert ">x true position<" in picture
    page = io.StringIO()
    write_timeline(sort_out(stalled.world.trace, stalled.views, 0, stalled.world.now), page, silent)
    data = json.loads(re.findall(r'id="data">(.*?)</script>', page.getvalue(), re.DOTALL)[0])
    loads = {axis["name"]: axis["true"] for axis in data["axes"] if "true" in axis}
    assert [(name, load["name"], load["unit"]) for name, load in loads.items()] == [("M1", "x true", "mm")]
    last = loads["M1"]["plans"][-1]
    assert (last["base"] + last["final"]) / loads["M1"]["scale"] == stalled.positions[-1]


def test_a_file_keeps_it(stalled: Ran, tmp_path: Path) -> None:
    write_trace(stalled.world.trace, tmp_path / "run.jsonl", views=stalled.views, title="press", ended=9 * SECOND)
    saved = read_trace(tmp_path / "run.jsonl")
    assert (saved.title, saved.until, saved.views) == ("press", 9 * SECOND, stalled.views)
    assert saved.trace.digest() == stalled.world.trace.digest()
    for name, trace, views in (("a", saved.trace, saved.views), ("b", stalled.world.trace, stalled.views)):
        write_trace(trace, tmp_path / f"{name}.svg", views=views)
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()


def test_a_load_that_loses_steps_while_nothing_moves_is_told_too(tmp_path: Path) -> None:
    world = World.from_toml(dedent(MACHINE))
    world.at(1.0, do.SetFault(read("lost-steps machine=m pulses=640 at_s=0")))
    world.run(for_=2)
    write_trace(world.trace, tmp_path / "x.csv", views=axis_views(world), ended=world.now, period=SECOND)
    with (tmp_path / "x.csv").open(newline="") as file:
        positions = [float(row["m.x_true_position_mm"]) for row in csv.DictReader(file)]
    assert positions == [20.0, 19.0, 19.0]
    assert world.axis["x"].position == 19.0
