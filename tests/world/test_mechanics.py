"""What controllers notice of their mechanics: limits, homing to switch, stop and index, correction, following, faults."""

from __future__ import annotations

from textwrap import dedent

import pytest

from steptwin.files.world import World
from steptwin.machine import SECOND
from steptwin.mic488.status import Status
from steptwin.world import script as do
from steptwin.world.faults import read

AXIS = """
    [[mic488]]
    name = "m"
    line = "bus"
    unit = 1
    [mic488.M1]
    unit = "mm"
    gear = 640.0
    acc = 200.0
    dec = 200.0
    vel = 50.0
    mot_resol = 3200
    enc_resol = 4000
    in_kl = "IN1"
    in_kr = "IN2"
    {config}
    [[line]]
    name = "bus"
    [[axis]]
    name = "x"
    drive = "m.M1"
    pitch = 5.0
    travel = [-3.0, 103.0]
    start = 20.0
    [axis.encoder]
    counts_per_rev = 4000
    index = true
    offset = 1.0
    [[axis.switch]]
    below = 0.0
    to = "m.IN1"
    [[axis.switch]]
    above = 100.0
    to = "m.IN2"
"""


def world_of(config: str, more: str = "") -> World:
    world = World.from_toml(dedent(AXIS).format(config=config) + more)
    world.mic488["m"].axis[1].enable()
    return world


def test_a_limit_switch_stops_the_drive() -> None:
    world = world_of('limit_mode = "KL+KR"')
    axis = world.mic488["m"].axis[1]
    axis.move_to(200.0)
    world.run(until="idle")
    assert (axis.status, axis.position, world.axis["x"].position) == (Status.LIMIT_R, 80.0, 100.0)
    axis.move_to(-200.0)
    world.run(until="idle")
    assert (axis.status, axis.position, world.axis["x"].position) == (Status.LIMIT_L, -20.0, 0.0)


@pytest.mark.parametrize(("mode", "place"), [("HOME0", 0.0), ("HOME4", 1.0), ("HOME3", 1.0)])
def test_homing_ends_at_the_switch_or_the_index_next_to_switch_or_stop(mode: str, place: float) -> None:
    """The index is at 1 mm and every 5 mm: back from the switch at 0 it comes at 1, back from the stop at -3 as well."""
    world = world_of(f'home_mode = "{mode}"')
    axis = world.mic488["m"].axis[1]
    axis.home(-20.0)
    world.run(until="m.M1.status == 4", for_=30)
    assert axis.status is Status.REACHED
    assert axis.position == 0.0
    assert world.axis["x"].position == pytest.approx(place, abs=0.002)
    assert (world.axis["x"].lost != 0) is (mode == "HOME3")


def test_a_drive_against_its_stop_corrects_and_then_gives_up() -> None:
    """Status 8 while it corrects, 5 after two seconds without progress (MIC-19)."""
    world = world_of('pos_ctrl_mode = "ENCODER"\nerr_ctrl_mode = "ERRMODE0"')
    axis = world.mic488["m"].axis[1]
    axis.move_to(90.0)
    assert world.run(until="m.M1.status == 8 or m.M1.status == 5", for_=10) is not None
    assert world.run(until="m.M1.status == 5", for_=10) is not None
    assert world.axis["x"].position == 103.0
    assert world.mic488["m"].status == 1


def test_lost_steps_are_made_good_by_the_encoder() -> None:
    world = world_of('pos_ctrl_mode = "ENCODER"', '[[fault]]\nkind = "lost-steps"\nmachine = "m"\npulses = 500\nat_s = 1.0\n')
    axis = world.mic488["m"].axis[1]
    axis.move_to(50.0)
    world.run(until=0.9)
    assert world.axis["x"].lost == 0
    world.run(until="m.M1.status == 4", for_=20)
    assert axis.position == pytest.approx(50.0, abs=0.01)
    assert world.axis["x"].position == pytest.approx(70.0, abs=0.01)
    assert world.axis["x"].lost == pytest.approx(500, abs=8)
    assert [record.subject for record in world.trace.faults("m")] == ["lost-steps"]


def test_faults_of_the_line_are_in_a_snapshot_and_in_the_digest() -> None:
    request = bytes.fromhex("01 03 27 24 00 02 8e b4")
    fault = '[[fault]]\nkind = "crc"\nunit = 1\nprobability = 0.5\n[[fault]]\nkind = "delay"\nfor_ms = 300.0\nnth = 2\n'

    def ask(world: World) -> bytes:
        world.line["bus"].send(request)
        world.run(for_=0.2)
        return world.line["bus"].received()

    def answers(world: World) -> list[bytes]:
        return [ask(world) for _ in range(8)]

    world, plain = world_of("", fault), world_of("")
    first = ask(world)
    snapshot = world.snapshot()
    rest = answers(world)
    assert first == b""  # the second answer after that to EN: on its way when the snapshot was taken
    assert len(rest[0]) == 18
    assert rest[1:] != answers(plain)[1:]
    digest = world.trace.digest()
    world.restore(snapshot)
    assert answers(world) == rest
    assert world.trace.digest() == digest
    assert answers(world_of("", fault)) == [first, *rest[:-1]]


def test_a_stall_of_some_time_is_a_fault_of_the_mechanics() -> None:
    world = world_of("", '[[fault]]\nkind = "stall"\nmachine = "m"\nfor_s = 0.5\nat_s = 0.5\n')
    world.mic488["m"].axis[1].move_to(50.0)
    world.run(until=0.75)
    held = world.axis["x"].position
    world.run(until=0.99)
    assert world.axis["x"].position == held
    world.run(until="idle")
    assert 20.0 < held < world.axis["x"].position < 70.0
    assert world.now > SECOND


def test_an_ideal_axis_is_where_it_was_after_a_snapshot_in_the_middle_of_a_move() -> None:
    world = World.from_toml(dedent(AXIS.partition("travel")[0]).format(config=""))
    world.mic488["m"].axis[1].enable()
    world.mic488["m"].axis[1].move_to(50.0)
    world.run(until=0.5)
    snapshot = world.snapshot()
    world.run(until=0.9)
    there = world.axis["x"].position
    world.restore(snapshot)
    world.run(until=0.9)
    assert world.axis["x"].position == there > 20.0
    other = world.branch(snapshot)
    other.run(until=0.9)
    assert other.axis["x"].position == there


def test_faults_that_are_set_and_cleared_after_a_snapshot_are_undone_by_it() -> None:
    """Back from where the world has them to where it has not, and into another world that never had them."""
    world = world_of("", '[[fault]]\nkind = "stuck"\nname = "early"\nmachine = "m"\npin = "IN7"\nvalue = 1.0\nfrom_s = 0.1\n')
    axis = world.mic488["m"].axis[1]
    axis.move_to(30.0)
    world.run(for_=0.5)
    before = world.snapshot()
    world.outside(do.SetFault(read("stall name=late machine=m for_s=9")))
    world.outside(do.ClearFault("early"))
    world.run(for_=0.25)
    after = world.snapshot()
    world.run(for_=3)
    stalled = (world.trace.digest(), world.axis["x"].position, world.mic488["m"].pins["IN7"])
    world.restore(before)
    world.run(for_=3)
    assert (world.axis["x"].position, world.mic488["m"].pins["IN7"]) == (50.0, 1.0)
    world.restore(after)
    world.run(for_=3)
    assert (world.trace.digest(), world.axis["x"].position, world.mic488["m"].pins["IN7"]) == stalled


def test_an_encoder_that_slips_on_its_shaft_shows_it_and_the_load_does_not() -> None:
    """40 counts of 4000 a revolution of 5 mm are 0.05 mm; again by a fault of the running world."""
    world = world_of("", '[[fault]]\nkind = "slip"\nmachine = "m"\ncounts = 40\nat_s = 1.0\n')
    axis = world.mic488["m"].axis[1]
    axis.move_to(10.0)
    world.run(until=0.999)
    moved = axis.encoder - round(axis.position / 5.0 * 4000)
    assert abs(moved) <= 1
    world.run(until="idle and time > 2")
    assert (axis.encoder, axis.position, world.axis["x"].position, world.axis["x"].lost) == (8040, 10.0, 30.0, 0)
    world.put_fault(read("slip machine=m counts=-100"))
    world.run(for_=1)
    assert (axis.encoder, axis.position, world.axis["x"].position) == (7940, 10.0, 30.0)
    axis.move_to(0.0)
    world.run(until="idle")
    assert axis.encoder == -60
    assert [record.value for record in world.trace.faults("m")] == [
        "the encoder of M1 slips by 40 counts",
        "the encoder of M1 slips by -100 counts",
    ]


def test_a_correction_follows_an_encoder_that_has_slipped() -> None:
    """The controller believes its encoder: the load is off by what that has slipped, 1 mm."""
    world = world_of('pos_ctrl_mode = "ENCODER"', '[[fault]]\nkind = "slip"\nmachine = "m"\ncounts = 800\nat_s = 0.5\n')
    axis = world.mic488["m"].axis[1]
    axis.move_to(50.0)
    world.run(until="m.M1.status == 4", for_=20)
    assert axis.position == pytest.approx(50.0, abs=0.01)
    assert world.axis["x"].position == pytest.approx(69.0, abs=0.02)
