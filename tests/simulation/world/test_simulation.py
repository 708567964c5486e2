"""Worlds without files: machines that share nothing, stops and wires between them, snapshots."""

from __future__ import annotations

from textwrap import dedent

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from world_rig import SMALL, moved, small

from steptwin.controller import SECOND
from steptwin.errors import Misuse, TimeReversal
from steptwin.files.world import World
from steptwin.simulation.faults import read
from steptwin.simulation.script import steps as do
from steptwin.simulation.script.steps import Steps
from steptwin.simulation.world import model
from steptwin.simulation.world.inputs import Bytes, Leave, See
from steptwin.simulation.world.simulation import Simulation
from steptwin.wire.crc import with_crc
from steptwin.wire.slave import FrameDirection


def test_controllers_that_share_nothing_are_advanced_when_somebody_looks() -> None:
    world = small()
    assert [list(scheduler.controllers) for scheduler in world.schedulers] == [["a", "b"], ["c"]]
    world.at(3.0, do.Set((("a", "IN5", 1.0),)))
    world.advance(5 * SECOND)
    assert [scheduler.now for scheduler in world.schedulers] == [3 * SECOND, 0]
    assert world.mic488["c"].status == 0
    assert [scheduler.now for scheduler in world.schedulers] == [3 * SECOND, 5 * SECOND]


def test_an_edge_of_an_input_is_told_once() -> None:
    world = World.from_toml("""
        [[m1486]]
        name = "d"
        [[mic488]]
        name = "t"
        [[wire]]
        from = "t.OUT1"
        to = "d.B2"
    """)
    world.run(for_=1)
    begin = world.now
    world.m1486["d"].set_pin("B1", 0)
    world.m1486["d"].set_pin("BR0", 0)
    world.mic488["t"].write("OUT1", 1)
    world.run(for_=1)
    world.mic488["t"].write("OUT1", 0)
    world.m1486["d"].set_pin("B1", 1)
    world.m1486["d"].set_pin("LIMIT", 0)
    world.run(for_=1)
    edges = [(edge.subject, edge.value, edge.time - begin) for edge in world.trace.edges("d") if edge.time >= begin]
    assert sorted(edges) == [
        ("B1", 0.0, 0), ("B1", 1.0, SECOND), ("B2", 0.0, SECOND), ("B2", 1.0, 0), ("B5", 0.0, 0), ("LIMIT", 0.0, SECOND)
    ]  # fmt: skip


def test_a_delayed_wire_and_a_button() -> None:
    world = small()
    world.mic488["a"].write("OUT1", 1)
    world.run(for_="19 ms")
    assert world.mic488["b"].pins["IN3"] == 0.0
    world.run(for_="1 ms")
    assert world.mic488["b"].pins["IN3"] == 1.0
    world.press("go", "50 ms")
    assert world.mic488["b"].pins["IN4"] == 1.0
    world.run(for_="1 s")
    assert world.mic488["b"].pins["IN4"] == 0.0


def test_a_snapshot_of_another_world_is_refused() -> None:
    snapshot = small().snapshot()
    small().restore(snapshot)
    other = small('[[axis.switch]]\nabove = 100.0\nto = "a.IN2"\n')
    with pytest.raises(Misuse, match="the snapshot is of another world"):
        other.restore(snapshot)
    with pytest.raises(Misuse, match="the snapshot is of another world"):
        World.from_toml("[[mic488]]\nname = 'a'\n").restore(World.from_toml("[[m1486]]\nname = 'a'\n").snapshot())


def test_a_snapshot_is_gone_back_to_with_its_scripts() -> None:
    world = small(
        '[[script]]\nname = "s"\nsteps = [{ write = { "a.M1_EN" = 1 } }, { repeat = 9, steps = ['
        '{ write = { "a.M1_POS_REL" = 7.0 } }, { until = "idle" }, { wait = "300 ms" }, { write = { "a.M1_POS_REL" = -6.0 } }, '
        '{ until = "idle" }] }]\n'
    )
    world.run(for_=2.9)
    snapshot = world.snapshot()
    before = (world.trace.digest(), world.axis["x"].position)
    world.run(for_=10)
    after = (world.trace.digest(), world.axis["x"].position)
    world.restore(snapshot)
    assert (world.trace.digest(), world.axis["x"].position) == before
    world.run(for_=10)
    assert (world.trace.digest(), world.axis["x"].position) == after


def test_python_operators_are_brought_back_by_what_they_were_sent() -> None:
    def operator() -> Steps:
        for target in (5.0, 15.0, 25.0):
            position = yield do.Read("x.position")
            yield do.Write((("a", "M1_EN", 1.0), ("a", "M1_POS_ABS", target + position / 100)))
            yield do.Until("idle")

    world = small()
    world.script(operator)
    world.run(for_=1.0)
    snapshot = world.snapshot()
    world.run(for_=20)
    digest = world.trace.digest()
    other = world.branch()
    world.restore(snapshot)
    world.run(for_=20)
    assert world.trace.digest() == other.trace.digest() == digest


MOVES = st.lists(
    st.tuples(
        st.sampled_from("abc"), st.sampled_from(["POS_ABS", "POS_REL", "VEL_ABS"]), st.integers(-80, 80), st.integers(0, 2000)
    ),
    max_size=8,
)


PARTS = st.lists(
    st.sampled_from(
        [
            '[[wire]]\nfrom = "a.OUT2"\nto = "c.IN7"\ninverted = true\n',
            '[[wire]]\nfrom = "c.M1_EN"\nto = "b.IN5"\ndelay = "3 ms"\n',
            '[[axis]]\nname = "y"\ndrive = "b.M1"\nbacklash = 3.0\ntravel = [-50.0, 60.0]\npulses_per_unit = 1.0\n',
            (
                '[[axis]]\nname = "z"\ndrive = "c.M1"\npulses_per_unit = 1.0\ninverted = true\n'
                '[[axis.switch]]\nposition = 10.0\nwidth = 5.0\nto = "c.IN2"\nbounce = "4 ms"\n'
            ),
            '[[source]]\nto = "b.AIN1"\nkind = "sine"\nvalue = 5.0\namplitude = 3.0\n',
            '[[event]]\nwhen = "x.position > 60"\nsteps = [{ press = "go", for = "100 ms" }, { write = { "a.OUT1" = 1 } }]\n',
            '[[event]]\nevery = "700 ms"\nsteps = [{ write = { "b.M1_EN" = 1, "b.M1_POS_REL" = 13.0 } }]\n',
        ]
    ),
    unique=True,
)


def acted(world: World, moves: list) -> World:
    for name, register, value, pause in moves:
        world.mic488[name].write("M1_EN", 1)
        world.mic488[name].write(f"M1_{register}", float(value))
        world.run(for_=pause / 1000)
    return world


@settings(max_examples=15, deadline=None)
@given(parts=PARTS, moves=MOVES, cuts=st.lists(st.integers(1, 3000), max_size=4))
def test_random_worlds_do_the_same_again_in_pieces_and_from_a_snapshot(parts: list[str], moves: list, cuts: list[int]) -> None:
    text = dedent(SMALL) + "".join(parts)
    first = acted(World.from_toml(text), moves)
    snapshot = first.snapshot()
    first.run(for_=12)
    second = acted(World.from_toml(text), moves)
    for cut in cuts:
        second.run(for_=cut / 1000)
        second.restore(second.snapshot())
        second.sync_all()
    second.run(until=first.time)
    assert second.trace.digest() == first.trace.digest()
    third = first.branch(snapshot)
    third.run(for_=12)
    assert third.trace.digest() == first.trace.digest()
    assert list(third.trace) == list(first.trace)


def test_a_step_that_goes_back_in_time_goes_on_from_there() -> None:
    """What a script does after it has restored a snapshot is what the restored script does."""
    world = small()
    went_back: list[float] = []

    def go_back() -> None:
        if not went_back:
            went_back.append(world.time)
            world.restore(before)

    def operator() -> Steps:
        yield do.Wait(SECOND)
        yield do.Call(go_back)
        yield do.Note("after it")

    world.script(operator)
    world.run(until=0.5)
    before = world.snapshot()
    world.run(until=1)
    assert went_back == [1.0]
    world.run(until=3)
    assert [(record.time, record.value) for record in world.trace.events("world")] == [(SECOND, "after it")]
    assert world.scripts == []


def test_a_move_into_a_stop_loses_what_the_stop_holds() -> None:
    world = moved(small(), 60.0)
    world.run(for_="10 s")
    assert world.mic488["a"].axis[1].position == 60.0
    assert (world.axis["x"].position, world.axis["x"].lost) == (101.0, 900)
    assert world.mic488["a"].axis[1].encoder < 60 * 100 * 400 // 3200  # the default encoder sits on the motor


def test_inputs_say_whether_the_scripts_had_done_what_was_due() -> None:
    """A replay has to do the same before and after the scripts of the description at a moment."""
    world = small('[[event]]\nat = "1 s"\nsteps = [{ note = "due" }]\n')
    world.press("go")
    world.press("go")
    world.run(until=1)
    world.release("go")
    world.release("go")
    assert [(given.time, given.settled) for given in world.inputs] == [(0, False), (0, False), (SECOND, True), (SECOND, False)]
    unkept = World.from_toml(dedent(SMALL), keep_inputs=False)
    unkept.press("go")
    assert unkept.inputs == []


def test_what_comes_from_outside_acts_and_is_in_the_trace() -> None:
    """Characters of a script to a chip, a hand on a shaft, a program that leaves its place, power off and on."""
    world = small('[[line]]\nname = "bus"\nkind = "m1486"\n[[m1486]]\nname = "d"\nline = "bus"\naddress = 3\n')
    world.apply_input(do.Send("bus", b"x3\rf640\rr\r"))
    world.run(until="idle")
    assert world.m1486["d"].position == 640
    world.apply_input(do.Turn("a", 2, -7))
    assert world.mic488["a"].axis[2].encoder == -7
    world.line["bus"].send(b"x3\ru20\r", "plc")
    assert "plc" in world.lines["bus"].clients
    world.apply_input(Leave("bus", "plc"))
    assert "plc" not in world.lines["bus"].clients
    world.apply_input(Leave("bus", "plc"))
    world.apply_input(do.PowerCycle("d"))
    world.run(for_=0.1)
    assert world.m1486["d"].counter == 0
    recorded = [(r.controller, r.subject, r.value) for r in world.trace if r.kind == "input"]
    assert recorded == [("a", "M2 turned", -7), ("d", "power-cycle", "")]
    for step, message in (
        (do.Send("bys", b"x"), r"no line is called 'bys' \(did you mean 'bus'\?\); there are bus"),
        (do.Turn("d", 1, 1), "'d' is an M1486, which has no encoder"),
        (do.PowerCycle("e"), "no controller is called 'e'"),
        (do.Wait(1), "only scripts can execute this step"),
    ):
        with pytest.raises(Misuse, match=message):
            world.apply_input(step)


def test_what_an_action_leads_to_happens_at_once() -> None:
    world = small()
    world.apply_input(do.Write((("a", "M1_EN", 1.0), ("a", "M1_POS_ABS", 60.0))))
    world.apply_input(do.Press("go"))
    happened = list(world.trace)
    assert [r.time for r in happened if (r.controller, r.kind, r.subject) == ("b", "edge", "IN4")][-1:] == [0]
    plan = [r for r in happened if (r.controller, r.kind, r.subject) == ("a", "plan", "1")][-1]
    assert plan.value.moving(1)  # type: ignore[attr-defined]


def test_an_encoder_that_nothing_turns_stands_still() -> None:
    world = small()
    world.apply_input(do.Couple("b", 1, "free"))
    world.mic488["b"].axis[1].enable()
    world.mic488["b"].axis[1].move_to(1000.0)
    world.run(for_="10 s")
    assert (world.mic488["b"].axis[1].position, world.mic488["b"].axis[1].encoder) == (1000.0, 0)
    assert next((r.controller, r.subject, r.value) for r in world.trace if r.kind == "input") == ("b", "M1 coupled", "free")


def test_a_button_that_is_pressed_again_is_not_released_by_the_first_time() -> None:
    world = small()
    world.press("go", 1.0)
    world.run(for_=0.5)
    world.press("go")
    world.run(for_=2)
    assert world.read("go.pressed") == 1.0


def test_a_switch_is_off_where_its_axis_begins_beside_its_zone() -> None:
    """Within the hysteresis it depends on where the axis comes from; there it comes from nowhere."""
    for start, level in ((-0.1, 1.0), (0.1, 0.0)):
        world = World.from_toml(dedent(SMALL).replace("start = 50.0", f"start = {start}"))
        assert world.read("a.IN1") == level


READ, WRITE = with_crc(bytes.fromhex("01 03 00 64 00 01")), with_crc(bytes.fromhex("01 06 00 64 00 01"))


@pytest.mark.parametrize(
    ("timing", "fault", "data", "idle"),
    [
        ("off", "", READ, True),
        ("off", "", WRITE, False),
        ("off", "", READ + READ, False),
        ("off", "crc probability=0.5", READ, False),
        ("real", "", READ, False),
    ],
)
def test_a_read_changes_nothing_unless_it_takes_time_or_may_fail(timing: str, fault: str, data: bytes, idle: bool) -> None:
    world = World.from_toml(f'[[line]]\nname = "bus"\ntiming = "{timing}"\n[[mic488]]\nname = "t"\nline = "bus"\n')
    if fault:
        world.apply_input(do.SetFault(read(fault)))
    line = world.lines["bus"]
    line.connect("plc", "rtu")
    assert line.is_idle_read(line.clients["plc"], data) is idle


def test_what_a_condition_found_later_is_forgotten_when_time_goes_back() -> None:
    world = moved(small(), 100.0)
    world.run(for_=0.2)
    before = world.snapshot()
    awaited = "x.position > 60 and b.IN9"
    world.run(for_=1)
    assert world.axis["x"].position > 60.0
    assert world.condition(awaited).due(world.now) is None, "it is behind, and not to come again"
    world.restore(before)
    world.mic488["b"].set_pin("IN9", 1.0)
    world.run(until=awaited, for_="1 min")
    assert world.axis["x"].position == 60.01


def test_a_world_that_has_stopped_goes_on_where_a_snapshot_was_taken() -> None:
    world = small('[[event]]\nat = "1 s"\nsteps = [{ stop = "enough" }]\n')
    before = world.snapshot()
    assert world.run(for_=5) == "enough"
    assert world.stopped == "enough"
    world.restore(before)
    assert world.stopped is None
    world.advance(SECOND // 2)
    assert world.now == SECOND // 2


def test_whoever_watches_schedulers_sees_those_that_scripts_wait_for_as_well() -> None:
    world = small('[[script]]\nname = "s"\nsteps = [{ until = "a.IN5" }, { until = "a.IN6" }]\n')
    world.run(for_=0.1)
    seen: list[str] = []
    world.subscribe_to_schedulers(lambda scheduler: seen.append(next(iter(scheduler.controllers))))
    for controller, pin in (("a", "IN7"), ("c", "IN7"), ("a", "IN5"), ("a", "IN6"), ("a", "IN8")):
        seen.clear()
        world.apply_input(do.Set(((controller, pin, 1.0),)))
        assert set(seen) == {controller}, pin
        world.run(for_=0.1)


def test_what_was_to_be_done_later_is_done_once_and_may_be_called_off() -> None:
    world = small()
    steps = (do.Wait(SECOND), do.Press("go"))
    world._scripts.schedule("press it", steps)
    world.run(for_=0.5)
    world._scripts.schedule("press it", steps)
    world.run(for_=0.75)
    assert world.read("go.pressed") == 0.0, "begun anew: the first was called off"
    world.run(for_=0.25)
    assert world.read("go.pressed") == 1.0
    world.release("go")
    world._scripts.schedule("press it", steps)
    world._scripts.unschedule("press it")
    world._scripts.unschedule("press it")
    world.run(for_=2)
    assert world.read("go.pressed") == 0.0


def test_time_does_not_go_back() -> None:
    world = small()
    world.advance(SECOND)
    with pytest.raises(TimeReversal) as caught:
        world.advance(SECOND - 1)
    assert caught.value.args == TimeReversal(SECOND, SECOND - 1).args
    world.advance(SECOND)


def test_what_is_remembered_of_texts_does_not_grow_without_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(model, "MOST_REMEMBERED", 3)
    world = small()
    for number in range(20):
        assert world.holds(world.condition(f"time >= -{number}"))
        world.read(f"b.IN{number + 1}")
        world.mic488["b"].write("M1_VMAX", 10.0 + number)
        assert max(map(len, (world._conditions, world._signals, world._encoded))) <= 3
    same = world.condition("x.position > 1")
    assert world.condition("x.position > 1") is same


class Heard:
    """Follows a line: frames by their place and direction, bytes that are none by their place."""

    def __init__(self) -> None:
        self.frames: list[tuple[int, str, str, bytes]] = []
        self.lost: list[tuple[str, int]] = []

    def frame(self, now: int, client: str, direction: FrameDirection, data: bytes) -> None:
        self.frames.append((now, client, direction.value, data))

    def unframed(self, now: int, client: str, count: int) -> None:
        self.lost.append((client, count))


@pytest.mark.parametrize("timing", ["off", "real"])
@pytest.mark.parametrize(("gap", "gap_ns"), [("", 20_000_000), ("gap = 2\n", 2_000_000)])
def test_the_gap_of_a_line_is_waited_for_where_a_length_is_not_known(timing: str, gap: str, gap_ns: int) -> None:
    """MIC-1: a function nobody knows is refused when so long nothing has come behind it."""
    world = World.from_toml(
        f'[[line]]\nname = "bus"\ntiming = "{timing}"\n{gap}[[mic488]]\nname = "t"\nline = "bus"\n', name="w.toml"
    )
    heard = Heard()
    line = world.lines["bus"]
    line.subscribe_to_frames(heard)
    unknown, refusal = with_crc(bytes.fromhex("01 41 01 02")), with_crc(bytes.fromhex("01 C1 01"))
    world.apply_input(Bytes("bus", "plc", "rtu", unknown))
    world.run(for_=0.1)
    world.apply_input(Bytes("bus", "plc", "rtu", b"\xff\xfe"))
    world.run(for_=0.1)
    ((moment, data),) = line.clients["plc"].received
    assert data == refusal
    # 6 characters there and 5 back at 38400 bit/s, and the turnaround.
    wire_ns = 0 if timing == "off" else 1_562_500 + 750_000 + 1_302_084
    assert moment == pytest.approx(gap_ns + wire_ns, abs=2)
    assert [frame[1:] for frame in heard.frames] == [("plc", "in", unknown), ("plc", "out", refusal)]
    assert heard.lost == [("plc", 2)]


def test_a_record_of_a_vision_system_reaches_its_controller() -> None:
    world = World.from_toml('[[mic488]]\nname = "t"\n[mic488.M1]\ngear = 1.0\n', name="w.toml")
    before = [record for record in world.trace if record.kind == "input"]
    world.apply_input(See("t", 2.0, 12.5, -3.0, 90.0))
    assert before == []
    (record,) = [record for record in world.trace if record.kind == "input"]
    assert (record.controller, record.subject, record.value) == ("t", "vision", (2.0, 12.5, -3.0, 90.0))
    assert world.mic488["t"].device.program.registers.vision.tolist() == [1.0, 2.0, 12.5, -3.0, 90.0]


def test_a_record_of_a_vision_system_for_a_chip_is_refused() -> None:
    world = World.from_toml('[[m1486]]\nname = "d"\n', name="w.toml")
    with pytest.raises(Misuse, match="'d' is an M1486, which has no vision registers"):
        world.apply_input(See("d", 2.0, 12.5, -3.0, 90.0))


def test_frames_can_be_followed_on_a_link_that_is_in_use() -> None:
    """A follower sees what goes over it from then on, also where nothing is recorded."""
    world = World.from_toml('[[line]]\nname = "bus"\n[[mic488]]\nname = "t"\nline = "bus"\n', name="w.toml")
    request = bytes.fromhex("01 03 27 24 00 02 8E B4")
    answer = bytes.fromhex("01 03 04 00 00 00 00 FA 33")
    line, heard = world.lines["bus"], Heard()
    world.stop_recording()
    world.apply_input(Bytes("bus", "plc", "rtu", request))
    line.subscribe_to_frames(heard)
    assert heard.frames == []
    world.apply_input(Bytes("bus", "plc", "rtu", request))
    assert [frame[1:] for frame in heard.frames] == [("plc", "in", request), ("plc", "out", answer)]
    line.unsubscribe_from_frames(heard)
    world.apply_input(Bytes("bus", "plc", "rtu", request))
    assert len(heard.frames) == 2


def test_programs_that_are_answered_at_one_moment_are_answered_in_the_same_order_after_a_snapshot() -> None:
    world = World.from_toml('[[mic488]]\nname = "t"\nline = "bus"\n[[line]]\nname = "bus"\n', name="w.toml")
    unknown = with_crc(bytes.fromhex("01 41 01 02"))  # it is refused after a gap, for its length is not known
    world.apply_input(Bytes("bus", "first", "rtu", unknown))
    world.run(for_=0.5)
    for place in ("second", "first"):
        world.apply_input(Bytes("bus", place, "rtu", unknown))
    again = world.branch()
    for one in (world, again):
        one.run(for_=0.5)
    places = [record.subject for record in world.trace.frames()][2:]
    assert places == ["second/in", "second/out", "first/in", "first/out"]
    assert [record.subject for record in again.trace.frames()][2:] == places
    assert again.trace.digest() == world.trace.digest()


def test_who_watches_actions_is_told_who_did_what() -> None:
    world = small('[[script]]\nname = "s"\nsteps = [{ wait = "1 s" }, { press = "go" }]\n')
    seen: list[tuple[int, str, object]] = []
    world.act_subscribers.append(lambda by, what: seen.append((world.now, by, what)))
    world.apply_input(do.Set((("a", "IN5", 1.0),)))
    world.run(for_=2)
    assert seen == [(0, "", do.Set((("a", "IN5", 1.0),))), (SECOND, "s", do.Press("go"))]


@pytest.mark.parametrize("count", [65_535, 65_536, 65_537])
def test_what_a_program_does_not_fetch_is_kept_up_to_a_limit(count: int) -> None:
    world = World.from_toml('[[line]]\nname = "bus"\n[[mic488]]\nname = "a"\nline = "bus"\n')
    there = world.lines["bus"].connect("somebody")
    there.received.extend((n, b"x") for n in range(count))
    kept = there.take(count)
    assert len(kept) == min(count, 65_536)
    assert kept[-1][0] == count - 1
    assert there.take(count) == []


def test_a_plant_keeps_what_happens_and_what_comes_in_unless_told_otherwise() -> None:
    world = small()
    usual, light = Simulation(world.blueprint), Simulation(world.blueprint, keep_trace=False, keep_inputs=False)
    for keeps, found in ((True, usual), (False, light)):
        assert (found.trace.is_kept, found.keeps_inputs) == (keeps, keeps)
        found.apply_input(do.Set((("a", "IN5", 1.0),)))
        assert [one.what for one in found.inputs] == ([do.Set((("a", "IN5", 1.0),))] if keeps else [])


def test_what_has_come_in_is_forgotten_when_nothing_is_recorded_any_more() -> None:
    world = small()
    world.press("go")
    assert len(world.inputs) == 1
    world.stop_recording()
    assert list(world.inputs) == []
