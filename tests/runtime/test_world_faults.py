"""Faults of a described world: on its lines, at its switches, at the load of an axis."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from steptwin.errors import Misuse
from steptwin.runtime.world import World
from steptwin.world.faults import read

PLANT = """
[world]
seed = 11

[[line]]
name = "bus"
kind = "modbus"
timing = "real"

[[mic488]]
name = "table"
line = "bus"
[mic488.M1]
gear = 100.0
acc = 100.0
dec = 100.0
vel = 50.0
enc_resol = 400
mot_resol = 100

[[axis]]
name = "x"
drive = "table.M1"
pulses_per_unit = 100
[axis.encoder]
counts_per_rev = 400

[[button]]
name = "start"
to = "table.IN5"

[[script]]
name = "operator"
steps = [
  { write = { "table.M1_EN" = 1, "table.M1_POS_ABS" = 100.0 } },
  { wait = "300 ms" },
  { press = "start", for = "200 ms" },
  { write = { "table.M1_VMAX" = 40.0 } },
  { wait = "300 ms" },
  { write = { "table.M1_VMAX" = 50.0 } },
]
"""

FAULTS = """
[[fault]]
kind = "lost-steps"
pulses = 40
at_s = 1.0

[[fault]]
kind = "bounce"
pin = "IN5"

[[fault]]
kind = "crc"
probability = 0.5

[[fault]]
kind = "gap"
probability = 0.1
for_ms = 12
"""


def test_lost_steps_of_a_described_axis_are_lost_by_its_load() -> None:
    sound, spoilt = World.from_toml(PLANT), World.from_toml(PLANT + FAULTS)
    for world in (sound, spoilt):
        world.run(for_="10 s")
    assert sound.read("x.position") == pytest.approx(100.0)
    assert spoilt.read("x.position") == pytest.approx(99.6)
    assert spoilt.read("table.M1.position") == pytest.approx(100.0)


DRUM = """
[[line]]
name = "chips"
kind = "m1486"

[[m1486]]
name = "drum"
line = "chips"
address = 3

[[axis]]
name = "y"
kind = "rotary"
unit = "rev"
pulses_per_rev = 12800
drive = "drum.M1"

[[fault]]
kind = "lost-steps"
machine = "drum"
pulses = 400
at_s = 2.0

[[fault]]
kind = "stall"
machine = "drum"
at_s = 5.0
for_s = 0.01
"""


def test_the_load_of_an_m1486_is_what_stalls_and_loses_steps() -> None:
    world = World.from_toml(DRUM)
    world.line["chips"].send(b"x3\rf12800\rr\r")
    world.run(for_=1.5)
    assert world.axis["y"].position == 1.0
    world.run(for_=1.0)
    assert world.axis["y"].lost == 400
    assert world.axis["y"].position == pytest.approx(1.0 - 400 / 12800)
    world.run(until="time >= 4.9", for_=10)
    world.line["chips"].send(b"f12800\rr\r")
    world.run(for_=2.0)
    assert world.axis["y"].lost > 400
    assert world.read("drum.position") == 25600
    bare = World.from_toml(DRUM.partition("[[axis]]")[0])
    with pytest.raises(Misuse, match="fault stall: 'drum' has no shaft"):
        bare.put_fault(read("stall at_s=1 for_s=1"))


def test_what_goes_wrong_is_in_the_trace_and_two_runs_share_it() -> None:
    worlds = [World.from_toml(PLANT + FAULTS) for _ in range(2)]
    for world in worlds:
        world.run(for_="10 s")
    first, second = worlds
    assert first.trace.digest() == second.trace.digest()
    assert {record.subject for record in first.trace.faults()} == {"lost-steps", "bounce", "crc", "gap"}
    other = World.from_toml(PLANT.replace("seed = 11", "seed = 12") + FAULTS)
    other.run(for_="10 s")
    assert other.trace.digest() != first.trace.digest()


@settings(max_examples=10)
@given(st.floats(0.0, 2.0))
def test_a_snapshot_at_any_moment_changes_nothing(moment: float) -> None:
    world = World.from_toml(PLANT + FAULTS)
    world.run(for_="3 s")
    digest = world.trace.digest()
    world = World.from_toml(PLANT + FAULTS)
    world.run(for_=f"{moment:.9f} s")
    snapshot = world.snapshot()
    world.run(for_="0.7 s")
    world.restore(snapshot)
    world.run(for_=f"{3.0 - round(moment, 9):.9f} s")
    assert world.trace.digest() == digest
