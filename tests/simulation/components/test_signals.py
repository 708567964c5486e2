"""Signals of conditions and scripts: their values, when they change by themselves, and which names there are."""

from __future__ import annotations

import pytest
from world_rig import small

from steptwin.controller import MILLISECOND, SECOND
from steptwin.errors import Misuse
from steptwin.files.world import World
from steptwin.live.world import ClientPort, LiveWorld
from steptwin.mic488.datasheet import datasheet_of
from steptwin.simulation.components.signals import Idle, find_signal
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.script.steps import Send
from steptwin.wire.crc import with_crc

OF_M1 = "M1.status, M1.enabled, M1.moving, M1.position, M1.velocity, M1.encoder"
CHIP = """
    [[m1486]]
    name = "d"
"""


def moving() -> World:
    """M1 of a: 25 mm with 100 mm/s² and 40 mm/s: ramps of 0.4 s and 8 mm, 9 mm between them in 0.225 s. x goes from 50 mm on."""
    world = small(CHIP)
    axis = world.mic488["a"].axis[1]
    axis.enable()
    axis.move_to(25.0)
    return world


def ramp(t: float) -> tuple[float, float]:
    """Position and velocity of that move."""
    if t < 0.4:
        return 50.0 * t * t, 100.0 * t
    if t < 0.625:
        return 8.0 + 40.0 * (t - 0.4), 40.0
    if t < 1.025:
        return 25.0 - 50.0 * (1.025 - t) ** 2, 100.0 * (1.025 - t)
    return 25.0, 0.0


@pytest.mark.parametrize("t", [0.0, 0.2, 0.5, 0.9, 1.2])
def test_signals_of_an_axis_go_as_its_profile(t: float) -> None:
    world = moving()
    world.run(for_=t)
    position, velocity = ramp(t)
    read = {q: world.read(f"a.M1.{q}") for q in ("position", "velocity", "encoder", "moving", "enabled", "status")}
    assert read["position"] == pytest.approx(position, abs=0.011)
    assert read["velocity"] == pytest.approx(velocity, abs=1e-6)
    assert read["encoder"] == world.mic488["a"].axis[1].encoder
    assert (read["moving"], read["enabled"]) == (float(t < 1.025), 1.0)
    assert read["status"] == float(world.mic488["a"].axis[1].status)
    assert world.read("x.position") == pytest.approx(50.0 + position, abs=0.011)
    assert world.read("time") == t


def test_turns_are_the_ends_of_segments_that_are_still_to_come() -> None:
    world = moving()
    world.run(for_=0.5)
    for name in ("a.M1.position", "a.M1.velocity", "a.M1.moving", "a.M1.encoder"):
        signal = find_signal(world.objects, name)
        assert signal.continuous, name
        ends = [1.025] if name == "a.M1.moving" else [0.4, 0.625, 1.025]
        assert list(signal.turning_points(world.now)) == pytest.approx([end * SECOND for end in ends if end > 0.5], abs=2), name
        assert list(signal.turning_points(0)) == pytest.approx([end * SECOND for end in ends], abs=2), name
        (first, *_) = signal.turning_points(world.now)
        assert first not in signal.turning_points(first), "a turn at the moment itself is not to come"
    for name in ("x.position", "x.lost", "x.stalled"):
        turning_points = list(find_signal(world.objects, name).turning_points(world.now))
        assert turning_points == sorted(set(turning_points)), name
        assert turning_points[:1] == pytest.approx([0.625 * SECOND], abs=2), name
    for name in ("a.M1.status", "a.M1.enabled", "a.status", "a.program", "a.IN1", "d.variable", "d.moving", "go.pressed"):
        signal = find_signal(world.objects, name)
        assert (signal.continuous, list(signal.turning_points(0)), signal.version()) == (False, [], None), name
    time = find_signal(world.objects, "time")
    assert (time.continuous, list(time.turning_points(0)), time.sync(0), time.version()) == (True, [], (), "time")


def test_an_endless_motion_has_no_last_turn() -> None:
    world = small()
    world.mic488["a"].write("M1_EN", 1)
    world.mic488["a"].write("M1_VEL_ABS", -40.0)
    assert list(find_signal(world.objects, "a.M1.velocity").turning_points(0)) == pytest.approx([0.4 * SECOND], abs=2)


def test_a_version_changes_with_the_plan_and_with_the_coordinate() -> None:
    world = moving()
    signals = {name: find_signal(world.objects, name) for name in ("a.M1.position", "a.M1.velocity", "a.M1.moving", "x.position")}
    before = {name: signal.version() for name, signal in signals.items()}
    world.run(for_=0.1)
    assert {name: signal.version() for name, signal in signals.items()} == before
    world.mic488["a"].axis[1].move_to(3.0)
    world.run(for_=0)
    after = {name: signal.version() for name, signal in signals.items()}
    assert all(after[name] != before[name] for name in signals), after
    world.run(until="idle")
    still = signals["a.M1.position"].version()
    world.mic488["a"].write("M1_POS_ACT", 7.0)
    assert signals["a.M1.position"].version() != still


def test_a_chip_has_signals_of_its_own() -> None:
    """12800 minimum microsteps forward; the coordinate counter and the user variable go with them."""
    world = World.from_toml('[[line]]\nname = "bus"\nkind = "m1486"\n[[m1486]]\nname = "d"\nline = "bus"\naddress = 3\n')
    chip = world.m1486["d"].chip
    names = ("position", "velocity", "counter", "moving", "variable")
    start = {name: world.read(f"d.{name}") for name in names}
    assert start == {"position": 0.0, "velocity": 0.0, "counter": 0.0, "moving": 0.0, "variable": float(chip.unit.variable)}
    idle = world.read("idle")
    world.line["bus"].send(b"x3\rf12800\rr\r")
    signals = {name: find_signal(world.objects, f"d.{name}") for name in names}
    versions = {name: signals[name].version() for name in ("position", "velocity")}
    world.run(for_=0.05)
    now = world.now
    assert (idle, world.read("idle"), world.read("d.moving")) == (1.0, 0.0, 1.0)
    assert world.read("d.velocity") == chip.drive.profile.velocity(now) > 0.0
    assert 0.0 < world.read("d.position") < 12800.0
    turning_points = [chip.drive.profile.start + int(end) for end in chip.drive.profile.ends]
    for name in ("position", "velocity", "counter"):
        assert signals[name].continuous, name
        assert list(signals[name].turning_points(0)) == turning_points, name
        assert list(signals[name].turning_points(turning_points[-1] - 1)) == turning_points[-1:], name
    for name, version in versions.items():
        assert signals[name].version() == chip.drive.revision != version, name
    world.run(until="idle")
    assert (world.read("d.position"), world.read("d.counter"), world.read("d.moving")) == (12800.0, 12800.0, 0.0)
    assert (world.read("d.b1"), world.read("d.B1")) == (1.0, 1.0)


def test_controllers_have_status_program_and_pins() -> None:
    world = small()
    assert (world.read("a.status"), world.read("a.program"), world.read("a.IN1")) == (0.0, 0.0, 0.0)
    world.mic488["a"].write("OUT1", 1)
    assert (world.read("a.OUT1"), world.read("a.out1")) == (1.0, 1.0)
    world.press("go")
    assert (world.read("go.pressed"), world.read("b.in4")) == (1.0, 1.0)
    world.release("go")
    assert world.read("go.pressed") == 0.0


def test_to_sync_a_signal_is_to_advance_the_scheduler_of_its_source() -> None:
    world = small()
    signal = find_signal(world.objects, "c.status")
    assert isinstance(signal, SignalOf)
    assert signal.sync(SECOND) == ((world.objects.scheduler_of["c"], "c"),)
    assert [scheduler.now for scheduler in world.schedulers] == [0, SECOND]


def test_a_condition_makes_no_scheduler_step_exact_unless_requests_change_its_signal() -> None:
    """What a controller counts changes with events; what a master stores does not."""
    for is_kept in (False, True):
        scheduler = small().objects.scheduler_of["c"]
        options = {"is_kept": True} if is_kept else {}
        SignalOf((scheduler.source("c"),), lambda now: 0.0, **options).watch("c.status")  # type: ignore[arg-type]
        assert scheduler.is_step_exact is is_kept


def test_idle_looks_at_what_was_busy_last_and_at_all_when_nothing_is() -> None:
    world = moving()
    idle = find_signal(world.objects, "idle")
    assert isinstance(idle, Idle)
    assert (idle.continuous, list(idle.turning_points(0)), idle.version()) == (False, [], None)
    assert idle.sync(world.now) == (world.objects.scheduler_of["a"].source("a"),)
    assert idle.value(world.now) == 0.0
    assert [scheduler.now for scheduler in world.schedulers] == [0, 0, 0]
    world.run(for_=1.1)
    assert idle.sync(world.now) == tuple(world.objects.scheduler_of[name].source(name) for name in world.controllers)
    assert idle.value(world.now) == 1.0
    assert [scheduler.now for scheduler in world.schedulers] == [world.now] * 3
    world.mic488["c"].axis[1].enable()
    world.mic488["c"].axis[1].move_to(100.0)
    assert idle.sync(world.now) == (world.objects.scheduler_of["c"].source("c"),)
    assert world.read("idle") == 0.0


def test_a_chip_is_idle_when_its_last_command_is_over() -> None:
    """On a line that gives characters at once nothing else happens at that moment."""
    world = World.from_toml('[[line]]\nname = "chips"\nkind = "m1486"\ntiming = "off"\n[[m1486]]\nname = "c"\nline = "chips"\n')
    world.at(0.1, Send("chips", b"v100\r"))
    world.run(until=0.1)
    assert (world.read("idle"), world.read("c.busy")) == (0, 1)
    world.run(until="idle", for_=1.0)
    assert world.now == 101 * MILLISECOND
    assert (world.read("idle"), world.read("c.busy")) == (1, 0)


def test_a_program_and_a_line_keep_a_world_busy() -> None:
    line = World.from_toml('[[line]]\nname = "bus"\ntiming = "real"\n[[mic488]]\nname = "a"\nline = "bus"\n')
    line.line["bus"].send(bytes.fromhex("01 03 27 24 00 02 8e b4"))
    assert line.read("idle") == 0.0
    line.run(for_=1)
    assert line.read("idle") == 1.0
    program = World.from_toml('[[mic488]]\nname = "a"\nprogram = "p"\nstart = true\n', {"p": b"L:\nDELAY 10\nJUMP L\n"})
    assert (program.read("idle"), program.read("a.program")) == (0.0, 1.0)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("a.M1.positon", rf"no signal 'a\.M1\.positon' \(did you mean 'M1\.position'\?\); there are {OF_M1}$"),
        ("a.M1.xyz", rf"no signal 'a\.M1\.xyz'; there are {OF_M1}$"),
        ("a.M5.position", rf"did you mean 'M1.position'\?\); there are status, program, {OF_M1} and more, \d+ in all, and pins$"),
        ("a.M1", rf"no signal 'a\.M1'; there are status, program, {OF_M1} and more, \d+ in all, and pins$"),
        ("d.status", r"no signal 'd\.status'; there are position, velocity, counter, moving, busy, valid, room, variable "),
        ("x.spin", r"no signal 'x\.spin'; there are position, lost, stalled, power, speed$"),
        ("go.pressd", r"no signal 'go\.pressd' \(did you mean 'pressed'\?\); there are pressed$"),
        ("tim", r"no signal 'tim': nothing is called 'tim' \(did you mean 'time'\?\); there are a, b, c, d, x, go, time, idle$"),
        ("qqqq.status", r"no signal 'qqqq\.status': nothing is called 'qqqq'; there are a, b, c, d, x, go, time, idle$"),
    ],
)  # fmt: skip
def test_a_name_that_is_no_signal_is_refused_with_those_that_are(name: str, message: str) -> None:
    with pytest.raises(Misuse, match=message):
        find_signal(small(CHIP).objects, name)


MASTER = """
[[line]]
name = "bus"
[[mic488]]
name = "a"
line = "bus"
unit = 1
[mic488.M1]
unit = "mm"
gear = 100.0
acc = 100.0
dec = 100.0
vel = 40.0
[[script]]
name = "operator"
steps = [
  { until = "a.USER_REGISTER[4]:real > 1.5 and a.hr:3 == 7" },
  { note = "written" },
]
"""


def written(values: bytes) -> bytes:
    """A request that writes user registers from 3 on."""
    return with_crc(bytes((1, 16, 0, 3, 0, len(values) // 2, len(values))) + values)


def test_registers_are_read_by_name_and_by_address() -> None:
    """Manual 1.70, table 3.2: POS_ACT of M1 at 10020, ACC at 10036, inputs from 5000 on, user registers from 0 on."""
    world = World.from_toml(MASTER)
    world.mic488["a"].write("M1_POS_ACT", 12.5)
    world.line["bus"].send(written(bytes.fromhex("ff85 0000 4020")))
    names = ("M1.position", "m1_pos_act", "hr:10020", "M1_ACC", "hr:10036", "DATA_TYPE")
    assert [world.read(f"a.{name}") for name in names] == [12.5, 12.5, 12.5, 100.0, 100.0, 0.0]
    # Low word first: 0x40200000 is 2.5; 0xFF85 is −123.
    users = ("USER_REGISTER[3]", "hr:3", "hr:3:int", "USER_REGISTER[4]:real", "hr:4:dint")
    assert [world.read(f"a.{name}") for name in users] == [65413.0, 65413.0, -123.0, 2.5, 0x40200000]
    world.mic488["a"].write("DATA_TYPE", 1)
    assert world.read("a.hr:10020") == 12.5
    world.mic488["a"].set_pin("IN7", 1)
    world.run(for_=1)
    assert (world.read("a.IN7"), world.read("a.di:5006"), world.read("a.co:6000")) == (1.0, 1.0, 0.0)


def test_a_condition_on_what_a_master_only_stores_is_not_late() -> None:
    """Nothing happens in the controller when a user register is written."""
    world = World.from_toml(MASTER)
    live = LiveWorld(world)
    port = ClientPort(live, "bus", "rtu-1", "rtu")
    live.advance(SECOND)
    port.exchange(written(bytes.fromhex("0007 0000 3f80")), SECOND)
    live.deadline()
    live.advance(2 * SECOND)
    port.exchange(written(bytes.fromhex("0007 0000 4000")), 2 * SECOND)
    live.deadline()
    live.advance(3 * SECOND)
    assert [record.time for record in world.trace if record.subject == "note"] == [2 * SECOND]


def test_nor_is_it_over_tcp_where_nothing_is_recorded() -> None:
    world = World.from_toml(MASTER)
    live = LiveWorld(world)
    world.stop_recording()
    notes: list[int] = []
    world.trace.subscribers.append(lambda record: notes.append(record.time) if record.subject == "note" else None)
    port = ClientPort(live, "bus", "tcp-1", "tcp")
    for moment, value in ((1, "3f80"), (2, "4000")):
        live.advance(moment * SECOND)
        pdu = written(bytes.fromhex(f"0007 0000 {value}"))[1:-2]
        port.exchange(bytes((0, 1, 0, 0, 0, len(pdu) + 1, 1)) + pdu, moment * SECOND)
        live.deadline()
    live.advance(3 * SECOND)
    assert notes == [2 * SECOND]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("a.M1_POS_ABS", "a.M1_POS_ABS can only be written"),
        ("a.hr:10021", "'hr:10021': this is the second word of M1_POS_ACT, which is at 10020"),
        ("a.hr:10020:real", "M1_POS_ACT is of type REAL/DINT; leave out :real"),
        ("a.hr:9999", "has no holding register at 9999"),
        ("a.xy:1", "addresses begin with hr:, co:, di:"),
        ("a.USER_REGISTER", r"choose one of USER_REGISTER\[0\]"),
        ("a.USER_REGISTER[2000]", "user register 2000 as WORD is outside 0 to 1999"),
    ],
)
def test_what_cannot_be_read_is_refused_in_a_condition(name: str, message: str) -> None:
    world = World.from_toml(MASTER)
    with pytest.raises(Misuse, match=message):
        world.run(until=f"{name} > 1", for_=1)


def test_what_can_only_be_written_has_no_value() -> None:
    with pytest.raises(Misuse, match="it can only be written"):
        World.from_toml(MASTER).read("a.M1_POS_ABS")


def test_a_condition_meets_a_count_that_begins_anew() -> None:
    """G+ goes on until Kill; 2²⁴ minimum microsteps are 262 144 steps, after which the counter is at 0 again."""
    world = World.from_toml('[[line]]\nname = "bus"\nkind = "m1486"\n[[m1486]]\nname = "d"\nline = "bus"\naddress = 3\n')
    world.line["bus"].send(b"x3\rg+\rr\r")
    world.run(until="d.moving")
    drive = world.m1486["d"].chip.drive
    drive.set_counter(2**24 - 1000, world.now)
    assert world.run(until="d.counter < 1000", for_=60) == "d.counter < 1000"
    at = world.now
    assert (drive.counter_u(at - 1) > 2**23, drive.counter_u(at) < 1000) == (True, True)
    assert world.run(until="d.U2 == 7", for_=60) == "d.U2 == 7"
    assert (drive.counter_u(world.now - 1) >> 8, drive.counter_u(world.now) >> 8) == (6, 7)


def test_no_condition_can_be_on_a_pin_that_changes_with_every_microstep() -> None:
    world = World.from_toml('[[m1486]]\nname = "d"\ninterface = "dual"\n')
    (occupied, *_) = world.m1486["d"].chip.interface.occupied
    assert world.read(f"d.B{occupied}") in (0.0, 1.0)
    with pytest.raises(Misuse, match=f"B{occupied} is taken: the .* interface has B"):
        world.run(until=f"d.B{occupied}", for_=1)


def test_a_pin_in_a_condition_needs_no_data_sheet() -> None:
    """A sheet has all points of a controller with its units: it took a quarter of the time in which a world is loaded."""
    before = datasheet_of.cache_info().misses
    world = World.from_toml('[[mic488]]\nname = "a"\n[mic488.M1]\nunit = "cm"\ngear = 7.25\n')
    assert not world.holds(world.condition("a.IN1 and a.AIN1 > 2 V"))
    assert datasheet_of.cache_info().misses == before
