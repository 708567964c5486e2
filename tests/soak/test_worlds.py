"""Worlds that run for months stay as large as they are."""

from __future__ import annotations

import gc
from collections.abc import Callable
from pathlib import Path

from soak import scaled

from steptwin.controller import SECOND
from steptwin.files.world import World
from steptwin.simulation.script import steps as do

FEEDER = Path(__file__).with_name("feeder.toml").read_text()
DAY_S = 24 * 3600
CYCLE = """
[[script]]
name = "cycle"
at = "60 s"
repeat = 1000000000
steps = [
  { press = "start", for = "200 ms" },
  { write = { "table.M1_POS_ABS" = 50.0, "table.OUT1" = 1 } },
  { until = "table.M1.status == 4", within = "30 s" },
  { send = "chips", text = "U5\\rf6400\\rr\\r" },
  { until = "x.position < 0", within = "1 s" },
  { write = { "table.M1_POS_ABS" = 20.0, "table.OUT1" = 0 } },
  { until = "table.M1.status == 4", within = "30 s" },
  { expect = "x.position > 1000" },
  { wait = "10 s" },
]
"""


def objects() -> int:
    """How many objects there are that can hold others.

    A collection leaves out a tuple only once everything in it has been left out, so tuples in tuples take several.
    """
    count = -1
    while count != (count := _collected()):
        pass
    return count


def _collected() -> int:
    gc.collect()
    return len(gc.get_objects())


def growth(work: Callable[[], object]) -> int:
    """By how many objects the second of two equal pieces of work leaves more behind than it found."""
    work()
    before = objects()
    work()
    return objects() - before


def test_a_month_of_the_feeder_leaves_nothing_behind() -> None:
    world = World.from_toml(FEEDER + CYCLE, keep_trace=False)
    world.run(for_=600)
    half = scaled(30 * DAY_S) // 2
    assert growth(lambda: world.run(for_=half)) < 100
    assert len(list(world.failures)) <= 1000


def test_a_million_steps_of_a_script_leave_nothing_behind() -> None:
    steps = scaled(1_000_000) // 2
    world = World.from_toml(
        '[[mic488]]\nname = "a"\n[[script]]\nname = "s"\nrepeat = 1000000000\n'
        'steps = [{ until = "time >= 0" }, { until = "a.IN1", within = "1 us" }, { wait = "1 us" }, { set = { "a.IN2" = 1 } }]',
        keep_trace=False,
    )
    assert growth(lambda: world.run(for_=steps / 2 * 1e-6)) < 100


def test_a_million_steps_of_an_operator_leave_no_objects_behind() -> None:
    steps = scaled(1_000_000) // 2

    def operator() -> do.Steps:
        while True:
            yield do.Read("time")
            yield do.Until("a.IN1", SECOND // 10**6)

    world = World.from_toml('[[mic488]]\nname = "a"\n', keep_trace=False)
    world.script(operator)
    assert growth(lambda: world.run(for_=steps / 2 * 1e-6)) < 100
