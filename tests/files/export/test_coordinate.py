"""The position that exports show is POS_ACT: it jumps where a home or a write sets it anew; the count goes on beside it."""

from __future__ import annotations

import csv
import io
import json
import re
from pathlib import Path
from textwrap import dedent

import pytest

from steptwin.controller import MILLISECOND, SECOND
from steptwin.files.export import axis_views, read_trace, write_trace
from steptwin.files.world import World

PERIOD = 10 * MILLISECOND
MACHINE = """
    [[mic488]]
    name = "m"
    [mic488.M1]
    unit = "mm"
    gear = 640.0
    acc = 200.0
    dec = 200.0
    vel = 50.0
    in_kl = "IN1"
    home_mode = "HOME1"
    [[axis]]
    name = "x"
    drive = "m.M1"
    pitch = 5.0
    start = 20.0
    [[axis.switch]]
    below = 0.0
    to = "m.IN1"
    [[script]]
    name = "operator"
    steps = [
      { write = { "m.M1_EN" = 1, "m.M1_HOME" = -20.0 } },
      { until = "m.M1.status == 4" },
      { write = { "m.M1_POS_ABS" = 10.0 } },
      { until = "idle" },
      { write = { "m.M1_POS_ACT" = 310.0 } },
      { write = { "m.M1_POS_ABS" = 305.0 } },
      { until = "idle" },
    ]
"""


@pytest.fixture(scope="module")
def ran() -> tuple[World, list[tuple[float, float]]]:
    """The world, and what it showed every 10 ms: POS_ACT, and the pulses since power-on."""
    world = World.from_toml(dedent(MACHINE))
    axis = world.mic488["m"].axis[1]
    shown = []
    for n in range(500):
        world.run(until=n * PERIOD / SECOND)
        shown.append((axis.position, world.mic488["m"].device.axes[0].profile.count(world.now) / 640))
    return world, shown


def exported(world: World, path: Path) -> Path:
    write_trace(world.trace, path, views=axis_views(world), period=PERIOD, until=499 * PERIOD)
    return path


def test_a_table_has_both(ran: tuple[World, list[tuple[float, float]]], tmp_path: Path) -> None:
    world, shown = ran
    rows = list(csv.DictReader(io.StringIO(exported(world, tmp_path / "t.csv").read_text())))
    for column, which in (("m.M1_position_mm", 0), ("m.M1_since_power_on_mm", 1)):
        off = [(n, row[column]) for n, row in enumerate(rows) if abs(float(row[column]) - shown[n][which]) > 1.001 / 640]
        assert off == [], f"{column}: rows that are not what the world showed"
    assert shown[-1] == (305.0, pytest.approx(shown[-1][1]))
    assert abs(shown[-1][0] - shown[-1][1]) > 300
    assert "m.M2_since_power_on_imp" not in rows[0]


def test_a_dump_and_a_timeline_have_both(ran: tuple[World, list[tuple[float, float]]], tmp_path: Path) -> None:
    world, shown = ran
    text = exported(world, tmp_path / "t.vcd").read_text("latin-1")
    for name, last in (("M1_position_mm", shown[-1][0]), ("M1_since_power_on_mm", shown[-1][1])):
        code = re.search(rf"\$var real 64 (\S+) {name} \$end", text)
        assert code is not None, name
        values = re.findall(rf"^r(\S+) {re.escape(code[1])}$", text, re.MULTILINE)
        assert float(values[-1]) == pytest.approx(last, abs=1.001 / 640)
    page = exported(world, tmp_path / "t.html").read_text("utf-8")
    found = re.search(r'(\{"begin":.*\})', page)
    assert found is not None
    axes = json.loads(found[1])["axes"]
    ends = [(plan["base"] + plan["final"]) / 640 for plan in (axes[0]["plans"][-1], axes[0]["counted"]["plans"][-1])]
    assert ends == pytest.approx(shown[-1], abs=1.001 / 640)
    assert "counted" not in axes[1]


def test_a_file_gives_it_back_and_a_branch_records_the_same(ran: tuple[World, list[tuple[float, float]]], tmp_path: Path) -> None:
    world, _ = ran
    saved = read_trace(exported(world, tmp_path / "t.jsonl"))
    assert saved.digest == world.trace.digest()
    values = [record.value for record in saved.trace.of("coordinate")]
    assert len(values) == 2, "one home, one write"
    cut = World.from_toml(dedent(MACHINE))
    cut.run(until=3)
    branch = cut.branch()
    branch.run(until=world.time)
    assert branch.trace.digest() == world.trace.digest()
