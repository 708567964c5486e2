"""What controllers notice of their mechanics: limits, homing to switch, stop and index, correction, following, faults."""

from __future__ import annotations

from textwrap import dedent

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mic488_rig import controller
from pulse_by_pulse import pulse_by_pulse
from toy import Driven

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.files.world import World
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.status import AxisStatus
from steptwin.motion import MotionState, plan_position
from steptwin.simulation.faults import read
from steptwin.simulation.mechanics.mechanics import EncoderBuild, Mechanism
from steptwin.simulation.mechanics.motor import StepperMotor
from steptwin.simulation.mechanics.trajectory import Build, LoadSection, MechanicalState
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.script import steps as do

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
    assert (axis.status, axis.position, world.axis["x"].position) == (AxisStatus.LIMIT_R, 80.0, 100.0)
    axis.move_to(-200.0)
    world.run(until="idle")
    assert (axis.status, axis.position, world.axis["x"].position) == (AxisStatus.LIMIT_L, -20.0, 0.0)


@pytest.mark.parametrize(("mode", "place"), [("HOME0", 0.0), ("HOME4", 1.0), ("HOME3", 1.0)])
def test_homing_ends_at_the_switch_or_the_index_next_to_switch_or_stop(mode: str, place: float) -> None:
    """The index is at 1 mm and every 5 mm: back from the switch at 0 it comes at 1, back from the stop at -3 as well."""
    world = world_of(f'home_mode = "{mode}"')
    axis = world.mic488["m"].axis[1]
    axis.home(-20.0)
    world.run(until="m.M1.status == 4", for_=30)
    assert axis.status is AxisStatus.REACHED
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


@pytest.mark.parametrize("is_inverted", [False, True])
@pytest.mark.parametrize("to", [40.0, -40.0])
def test_a_rotor_that_loses_steps_is_behind_in_the_direction_of_its_motion(to: float, is_inverted: bool) -> None:
    """By four full steps, 64 pulses of 3200, 0.1 mm: it stays below where it goes up, and above where it goes down."""
    text = dedent(AXIS).format(config="").replace("start = 20.0", f"start = 50.0\ninverted = {str(is_inverted).lower()}")
    world = World.from_toml(text + '[[fault]]\nkind = "lost-steps"\nmachine = "m"\nat_s = 1.0\n')
    world.mic488["m"].axis[1].enable()
    world.mic488["m"].axis[1].move_to(to)
    world.run(until="m.M1.status == 4", for_=20)
    up = 1.0 if (to > 0.0) is not is_inverted else -1.0
    assert world.axis["x"].position == pytest.approx(50.0 + up * 39.9, abs=0.001)


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
    world.apply_input(do.SetFault(read("stall name=late machine=m for_s=9")))
    world.apply_input(do.ClearFault("early"))
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


# ---------------------------------------------------------------------- a mechanism by itself


@settings(max_examples=40, deadline=None)
@given(
    moves=st.lists(st.tuples(st.integers(-200, 200), st.integers(1, 2 * SECOND)), min_size=1, max_size=6),
    play=st.integers(0, 9),
    stops=st.booleans(),
)
def test_a_mechanism_follows_replaced_plans_as_a_simulation_does(moves: list[tuple[int, Nanos]], play: int, stops: bool) -> None:
    scheduler, motor = Scheduler(), Driven()
    scheduler.add("m", motor)
    build = Build(zero=5, low=-90 if stops else None, high=110 if stops else None, play=play)
    mechanism = Mechanism(scheduler, "m", 1, build)
    scheduler.add_part(mechanism)
    state, now = MechanicalState(5, 5), 0
    for target, pause in moves:
        motor.go(target, now)
        scheduler.propagate()
        way = pulse_by_pulse(build, motor.axis.plan, state, now, now + pause)
        now += pause
        scheduler.advance(now)
        motor.advance(now)
        state = MechanicalState(*way[-1][1:])
        assert mechanism.at(now)[:2] == state[:2]


def test_steps_taken_away_are_lost_until_the_end() -> None:
    scheduler, motor = Scheduler(), Driven()
    scheduler.add("m", motor)
    mechanism = Mechanism(scheduler, "m", 1, Build())
    scheduler.add_part(mechanism)
    motor.go(100, 0)
    scheduler.advance(20 * SECOND)
    mechanism.lose(7, 20 * SECOND)
    assert (mechanism.grid_position(20 * SECOND), mechanism.lost(20 * SECOND)) == (93, 7)
    mechanism.block(True, 20 * SECOND)
    motor.go(150, 20 * SECOND)
    scheduler.advance(40 * SECOND)
    assert (mechanism.grid_position(40 * SECOND), mechanism.lost(40 * SECOND)) == (93, 57)
    mechanism.block(False, 40 * SECOND)
    motor.go(100, 40 * SECOND)
    scheduler.advance(60 * SECOND)
    assert mechanism.grid_position(60 * SECOND) == pytest.approx(43)


def rigged(build: Build, **options: object) -> tuple[Scheduler, Driven, Mechanism, list[TraceRecord]]:
    told: list[TraceRecord] = []
    scheduler, drive = Scheduler(record=told.append), Driven()
    scheduler.add("m", drive)
    mechanism = Mechanism(scheduler, "m", 1, build, "x")
    scheduler.add_part(mechanism)
    return scheduler, drive, mechanism, told


@pytest.mark.parametrize(("zero", "is_within"), [(-11, False), (-10, True), (20, True), (21, False)])
def test_an_axis_begins_within_its_stops(zero: int, is_within: bool) -> None:
    build = Build(zero=zero, low=-10, high=20)
    if is_within:
        assert rigged(build)[2].at(0) == MechanicalState(zero, zero)
        return
    with pytest.raises(Misuse, match=f"m axis 1 stands at {zero} imp, outside its hard stops -10 to 20 imp"):
        rigged(build)


def test_what_is_ideal_has_no_deadline_and_no_stops_either() -> None:
    scheduler, drive, mechanism, told = rigged(Build(sign=-1, zero=7))
    drive.go(100, 0)
    scheduler.advance(20 * SECOND)
    assert (mechanism.at(scheduler.now), mechanism.lost(scheduler.now), mechanism.deadline()) == (
        MechanicalState(-93, -93),
        0,
        None,
    )
    assert [record.kind for record in told] == ["plan"]


@pytest.mark.parametrize("taken", [7, -7, 400, -400])
def test_pulses_are_taken_away_as_far_as_stops_permit(taken: int) -> None:
    """Stops at -30 and 120 and 5 pulses of play: the rotor goes from -35 to 120. The load is at the rotor or up to 5 above."""
    scheduler, drive, mechanism, _ = rigged(Build(low=-30, high=120, play=5))
    drive.go(100, 0)
    scheduler.advance(20 * SECOND)
    assert mechanism.at(scheduler.now) == MechanicalState(100, 100)
    mechanism.lose(taken, scheduler.now)
    rotor = min(max(100 - taken, -35), 120)
    load = min(max(100, rotor), rotor + 5)
    assert mechanism.at(scheduler.now)[:2] == (rotor, load)
    assert mechanism.lost(scheduler.now) == 100 - rotor
    assert scheduler.is_dirty, "what stands on the load looks again"
    drive.go(60, scheduler.now)
    scheduler.advance(40 * SECOND)
    assert mechanism.at(scheduler.now).rotor == min(max(rotor - 40, -35), 120)


def test_an_ideal_axis_that_lost_pulses_keeps_the_loss_through_a_snapshot_and_a_counter_from_0() -> None:
    scheduler, drive, mechanism, _ = rigged(Build())
    drive.go(100, 0)
    scheduler.advance(20 * SECOND)
    mechanism.lose(7, scheduler.now)
    scheduler.propagate()
    state = mechanism.copy_state()
    mechanism.lose(3, scheduler.now)
    mechanism.set_state(state)
    assert mechanism.lost(scheduler.now) == 7
    drive.go(50, scheduler.now)
    scheduler.propagate()
    later = mechanism.copy_state()
    scheduler.advance(40 * SECOND)
    assert (mechanism.grid_position(scheduler.now), mechanism.lost(scheduler.now)) == (43, 7)
    mechanism.set_state(later)
    assert mechanism.grid_position(40 * SECOND) == 43
    # A drive that is switched off counts from 0 again: the load stays where it is.
    drive.axis.follow(plan_position(MotionState(40 * SECOND, 0, 0.0, 0.0), 0, 1.0, 1.0, 1.0))
    assert mechanism.at(40 * SECOND)[:2] == (43, 43)


def test_the_trace_is_told_where_the_load_is_only_when_it_does_not_go_with_its_drive() -> None:
    """Stop at 55: 45 of 100 pulses are lost there. On the way back the load is 45 behind."""
    scheduler, drive, _, told = rigged(Build(high=55))
    drive.go(100, 0)
    scheduler.advance(10 * SECOND)
    drive.go(70, 10 * SECOND)
    scheduler.advance(20 * SECOND)
    loads = [record for record in told if record.kind == "load"]
    assert [(record.controller, record.subject) for record in loads] == [("m", "1")] * len(loads)
    met = plan_position(MotionState(0, 0, 0.0, 0.0), 100, 500.0, 500.0, 200.0)
    held = met.pulse_time(56, 0)
    assert held is not None
    first = loads[0].value
    assert first == (LoadSection(0, True, 0), LoadSection(held, False, 55), LoadSection(met.end or 0, True, -45))
    assert all(carried == LoadSection(10 * SECOND, True, -45) for record in loads[1:] for carried in record.value)  # type: ignore[attr-defined]


def test_a_motor_without_torque_is_told_when_it_loses_the_field_and_when_it_is_caught() -> None:
    """Nothing is left above 100 pulses/s: lost 0.2 s after the start with 500 pulses/s², caught at rest. Full steps of 16."""
    build = Build(period_p=64, motor=StepperMotor(((0.0, 1.0), (100.0, 1.0)), 0.0, 0.0, 0.0, None))
    scheduler, drive, mechanism, told = rigged(build)
    assert mechanism.deadline() is None
    drive.go(200, 0)
    scheduler.propagate()
    assert mechanism.deadline() == pytest.approx(0.2 * SECOND, abs=1000)
    assert scheduler.deadline() == mechanism.deadline()
    scheduler.advance(SECOND // 2)
    end = drive.axis.plan.end
    assert mechanism.deadline() == end
    assert (mechanism.at(scheduler.now).stalled, mechanism.at(scheduler.now).rotor) == (True, 10)
    scheduler.advance(5 * SECOND)
    assert mechanism.deadline() is None
    behind = 200 - mechanism.grid_position(scheduler.now)
    assert behind == 192, "the multiple of 64 nearest to 190"
    events = [(record.time, record.subject, record.value) for record in told if record.kind == "event"]
    assert [event[1:] for event in events] == [
        ("stall", "x stalls: it no longer follows its field"),
        ("stall", "x is caught, 192 pulses behind"),
    ]
    assert [event[0] for event in events] == pytest.approx([0.2 * SECOND, end], abs=1000)
    assert mechanism.lost(scheduler.now) == 192


@pytest.mark.parametrize(("sign", "side"), [(1, "upper"), (-1, "lower")])
def test_an_axis_that_pushes_against_a_hard_stop_is_reported_until_it_no_longer_does(sign: int, side: str) -> None:
    """It stands at the stop and does not push; 60 pulses further, each of them is lost: a multiple of the period."""
    build = Build(low=-40, high=40, period_p=4)
    scheduler, drive, mechanism, told = rigged(build)

    def reported() -> list[tuple[Nanos, str]]:
        return [(record.time, str(record.value)) for record in told if record.subject == "hard-stop"]

    drive.go(sign * 40, 0)
    scheduler.advance(2 * SECOND)
    assert (reported(), mechanism.deadline()) == ([], None)
    drive.go(sign * 100, scheduler.now)
    begin = scheduler.now
    scheduler.advance(10 * SECOND)
    end = drive.axis.plan.end
    assert end is not None
    (first, begins), (last, ends) = reported()
    assert begins == f"x pushes against its {side} hard stop"
    assert ends == f"x no longer pushes against its {side} hard stop, {sign * 60} pulses behind"
    assert first == pytest.approx(begin + (2 / 500) ** 0.5 * SECOND, abs=1), "the first pulse of the way, at 250 t²"
    assert last == end
    drive.go(sign * 70, scheduler.now)
    scheduler.advance(20 * SECOND)
    assert (len(reported()), mechanism.grid_position(scheduler.now)) == (2, sign * 10)
    facts = [dict(record.facts) for record in told if record.subject == "hard-stop"]
    assert facts == [
        {"axis": 1, "element": "x", "stop": side, "pushes": True, "lost": sign},
        {"axis": 1, "element": "x", "stop": side, "pushes": False, "lost": sign * 60},
    ]


def test_an_axis_that_turns_round_at_a_hard_stop_pushes_until_its_field_comes_back_to_it() -> None:
    """The field is 3 pulses beyond the stop, less than half a period of 8: nothing is lost."""
    scheduler, drive, mechanism, told = rigged(Build(high=40, period_p=8))
    drive.go(43, 0)
    scheduler.advance(SECOND)
    drive.go(0, scheduler.now)
    scheduler.advance(5 * SECOND)
    texts = [str(record.value) for record in told if record.subject == "hard-stop"]
    assert texts[0] == "x pushes against its upper hard stop"
    assert texts[-1] == "x no longer pushes against its upper hard stop, 0 pulses behind"
    assert mechanism.grid_position(scheduler.now) == 0


def test_a_blocked_rotor_of_a_motor_is_let_go_to_the_nearest_period() -> None:
    build = Build(period_p=64, motor=StepperMotor(((0.0, 1.0), (1000.0, 1.0)), 0.0, 0.0, 0.0, None))
    scheduler, drive, mechanism, _ = rigged(build)
    mechanism.block(True, 0)
    drive.go(200, 0)
    scheduler.advance(5 * SECOND)
    assert (mechanism.grid_position(scheduler.now), mechanism.lost(scheduler.now)) == (0, 200)
    version = mechanism.version()
    mechanism.block(False, scheduler.now)
    assert mechanism.version() != version
    scheduler.advance(6 * SECOND)
    assert mechanism.at(scheduler.now) == MechanicalState(8, 8, behind=192)


def test_an_encoder_elsewhere_is_told_every_10_ms_while_the_axis_moves() -> None:
    """The encoder of another controller: it is looked at while it turns, and at rest not at all."""
    told: list[TraceRecord] = []
    scheduler, drive = Scheduler(record=told.append), Driven()
    other = Mic488Device(controller())
    scheduler.add("m", drive)
    scheduler.add("other", other)
    mechanism = Mechanism(scheduler, "m", 1, Build())
    scheduler.add_part(mechanism)
    mechanism.fit(EncoderBuild("other", other, 2, counts=-3, pulses=2), 0)
    assert mechanism.deadline() is None
    drive.go(100, 0)
    scheduler.propagate()
    assert mechanism.deadline() == 10 * MILLISECOND
    scheduler.advance(10 * MILLISECOND)
    assert mechanism.deadline() == 20 * MILLISECOND
    scheduler.advance(20 * SECOND)
    assert mechanism.deadline() is None
    assert other.axes[1].encoder_counts(20 * SECOND) == -150
    assert other.axes[0].encoder_counts(20 * SECOND) == 0


@pytest.mark.parametrize(("on_load", "counts"), [(False, [0, 100, 60]), (True, [0, 100, 65])])
def test_an_encoder_sits_on_the_rotor_or_on_the_load(on_load: bool, counts: list[int]) -> None:
    """One count a pulse, 5 pulses of play."""
    scheduler, drive = Scheduler(), Driven()
    other = Mic488Device(controller())
    scheduler.add("m", drive)
    scheduler.add("other", other)
    mechanism = Mechanism(scheduler, "m", 1, Build(sign=-1, zero=500, play=5))
    scheduler.add_part(mechanism)
    mechanism.fit(EncoderBuild("other", other, 1, on_load, 1), 0)
    found = [other.axes[0].encoder_counts(0)]
    for target, now in ((-100, 0), (-60, 20 * SECOND)):
        drive.go(target, now)
        scheduler.advance(now + 20 * SECOND)
        found.append(-other.axes[0].encoder_counts(scheduler.now))
    assert mechanism.at(scheduler.now)[:2] == (560, 565)
    assert found == counts
