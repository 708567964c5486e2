"""A world in this process as a subject: what it answers, which events it gives, and that recordings replay."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from world_rig import small

from steptwin.controller import MILLISECOND, SECOND
from steptwin.datasheet import Limits
from steptwin.errors import Misuse, Refusal
from steptwin.files.recording import recording_of
from steptwin.files.world import World
from steptwin.later import start
from steptwin.simulation.faults import read as read_fault
from steptwin.simulation.faults.kinds import KINDS
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.inputs import Bytes, Download
from steptwin.subject import commands as command
from steptwin.subject.commands import COMMANDS
from steptwin.subject.contract import (
    ConnectionDescription,
    DrawingDescription,
    ElementDescription,
    SignalDescription,
    SwitchDescription,
    read_description,
)
from steptwin.subject.describe import describe
from steptwin.subject.dispatch import respond
from steptwin.subject.events import Event
from steptwin.subject.payloads import FramePayload, InputPayload
from steptwin.subject.subscriptions import filter_of
from steptwin.subject.world import WorldSubject
from steptwin.wire.crc import with_crc

EXAMPLES = Path(__file__).parents[2] / "examples" / "worlds"
READ_POSITION = with_crc(bytes.fromhex("01 03 27 24 00 02"))


def of(world: World) -> WorldSubject:
    return WorldSubject(world)


def feeder() -> World:
    return World.load(EXAMPLES / "feeder.toml")


def said(subject: WorldSubject, **message: object) -> dict[str, Any]:
    """The answer to a message, as it goes over a wire."""

    def fail(error: Exception) -> None:
        raise error

    return json.loads(
        json.dumps(start(respond(lambda wanted, _: subject.answer(wanted), json.dumps(message).encode(), fail)).result())
    )


def test_a_command_moves_an_axis_and_its_answer_says_when() -> None:
    subject = of(small())
    subject.do(command.Enable("a", 1))
    subject.do(command.Move("a", 1, to=20.0))
    done = subject.do(command.Advance(duration=2 * SECOND))
    assert done.time == 2 * SECOND
    # x begins at 50 mm; its drive counts from there.
    assert [(r.point, r.value, r.unit) for r in subject.read("a.M1.position", "x.position", "time")] == [
        ("a.M1.position", 20.0, "mm"),
        ("x.position", 70.0, "mm"),
        ("time", 2.0, "s"),
    ]


def test_pins_have_the_level_of_a_stuck_output_and_the_state_what_was_commanded() -> None:
    world = small()
    world.fault("stuck machine=a pin=OUT1 value=1")
    subject = of(world)
    subject.do(command.Advance(duration=SECOND))
    assert subject.do(command.ReadPins("a")).value["a.OUT1"] == 1.0
    assert subject.do(command.ReadState("a", ("pins",))).value["pins"]["OUT1"] == 0.0


def test_what_each_command_of_a_controller_writes() -> None:
    subject = of(small())
    subscription = subject.subscribe(filter_of(["input"]), 99)
    subject.do(command.Enable("a", 1))
    subject.do(command.Jog("a", 1, 5.0))
    subject.do(command.StopAxes("a", 1))
    subject.do(command.StopAxes("a"))
    subject.do(command.Home("a", 1, -20.0))
    subject.do(command.Move("a", 1, by=1.5))
    subject.do(command.ControlProgram("a", "stop"))
    values = [event.payload.value for event in subscription.take().events if isinstance(event.payload, InputPayload)]
    found = [value.hex() if isinstance(value, bytes) else str(value) for value in values]
    # M1_EN is coil 2000; a REAL has its low word first.
    assert found[0] == "0507d0ff00"
    assert found[1].endswith("0000" + "40a0")
    assert found[2:4] == ["axis 1", "all axes"]
    assert found[4].endswith("0000" + "c1a0")
    assert found[5].endswith("0000" + "3fc0")
    assert found[6:] == ["program"]
    assert subject.read("a.M1.enabled")[0].value == 1.0


def test_a_description_survives_json_and_names_points_that_can_be_read() -> None:
    subject = of(feeder())
    description = subject.description
    assert read_description(json.loads(json.dumps(description.to_json()))) == description
    assert {part.name: part.controls for part in description.controllers} == {
        "table": ("enable", "move", "home", "jog", "stop", "program"),
        "drum": ("move", "jog", "stop", "program"),
    }
    takes = {(one.command, part.name, one.axis): one.arguments for part in description.controllers for one in part.takes}
    (velocity,) = takes["jog", "table", 2]
    (axis,) = (axis for axis in description.controllers[0].datasheet.axes if axis.number == 2)
    assert axis.pulses_per_unit is not None
    fastest = 64_000 / axis.pulses_per_unit
    assert (velocity.unit, velocity.limits) == (f"{axis.unit}/s", Limits(-fastest, fastest))
    to, by = takes["move", "drum", 1]
    assert (to.limits, by.limits) == (Limits(0, 16_000_000), Limits(-16_000_000, 16_000_000))
    assert (to.unit, by.is_optional) == ("min. microsteps", True)
    assert takes["program", "table", None][0].values == ("start", "pause", "stop")
    assert (takes["stop", "table", None], takes["stop", "table", 4]) == ((), ())
    assert ("home", "drum", 1) not in takes
    points = [point for part in (*description.controllers, *description.axes) for point in part.points]
    assert len(points) > 150
    found = {reading.point: reading for reading in subject.read(*(point for point in points if "USER_REGISTER" not in point))}
    for reading in found.values():
        assert (reading.value is None) is (reading.quality == "unknown")
    # POS_ABS can only be written; EN too, but there is a pin of that name.
    unknown = {point for point, reading in found.items() if reading.value is None}
    assert {"table.M1_POS_ABS", "table.M1_STOP", "table.JOG_SPEED"} <= unknown
    assert found["table.M1_EN"].value == 0.0
    assert len(found) - len(unknown) > 100


def test_every_kind_of_fault_says_what_it_takes() -> None:
    found = {kind["name"]: kind for kind in of(small()).do(command.ListFaultKinds()).value}
    assert set(found) == set(KINDS)
    assert json.loads(json.dumps(found)) == found
    stuck = found["stuck"]
    assert (stuck["layer"], stuck["occasion"], stuck["lines"]) == ("physics", "always", [])
    assert [one.pop("messages")["permitted"]["id"] for one in stuck["parameters"][:2]] == ["simulation.text", "simulation.to"]
    assert stuck["parameters"][:2] == [
        {"name": "pin", "meaning": "Which input or output.", "permitted": "text", "default": "", "words": [], "required": True},
        {
            "name": "value",
            "meaning": "The level; volts on analog inputs.",
            "permitted": "numbers 0 to 10",
            "default": "the one it has",
            "words": [],
            "required": False,
        },
    ]
    assert found["slipping-coupling"]["elements"] == ["shaft"]
    assert {"gate", "relay", "supply"} <= set(found["stuck-output"]["elements"])
    assert stuck["elements"] == []
    (nth,) = (one for one in found["crc"]["parameters"] if one["name"] == "nth")
    assert nth["default"] == "each time"
    assert next(one for one in found["flip"]["parameters"] if one["name"] == "direction")["words"] == ["in", "out"]


def test_what_is_not_there_is_misuse_and_changes_nothing() -> None:
    subject = of(small())
    with pytest.raises(Misuse, match="no controller is called 'd'"):
        subject.do(do.Set((("a", "IN1", 1.0), ("d", "IN1", 1.0))))
    assert subject.read("a.IN1")[0].value == 0.0
    with pytest.raises(Misuse, match="M9"):
        subject.do(command.Enable("a", 9))


def test_what_a_world_in_virtual_time_cannot_do_is_refused_with_what_it_can() -> None:
    with pytest.raises(Refusal, match=r"^save is not supported here; supported are describe, read, pins"):
        of(small()).do(command.Save("/tmp/x.json"))


def test_steps_end_at_a_moment_a_condition_or_the_next_event() -> None:
    subject = of(small())
    subject.do(command.Enable("a", 1))
    subject.do(command.Move("a", 1, to=20.0))
    found = subject.do(command.Advance(until="a.M1.position > 5")).value
    assert (found["came"], found["idle"]) == (True, False)
    found = subject.do(command.Advance(duration=SECOND, until="a.M1.position < 0")).value
    assert (found["came"], found["idle"]) == (False, False)
    found = subject.do(command.Advance()).value
    assert (found["came"], found["idle"], found["events"]) == (False, True, [])
    with pytest.raises(Misuse, match="to_ns = 1: this world is at"):
        subject.do(command.Advance(to=1))


def test_an_answer_that_comes_at_once_is_in_the_result_of_a_request() -> None:
    at_once = of(
        World.from_toml("[[mic488]]\nname = 'a'\nline = 'bus'\n[[line]]\nname = 'bus'\nkind = 'modbus'\ntiming = 'off'\n")
    )
    assert at_once.do(do.Request("bus", 1, READ_POSITION[1:-2], SECOND)).value == {"pdu": "030400000000"}
    later = of(feeder())
    subscription = later.subscribe(filter_of(["frame"]), 9)
    assert later.do(do.Request("bus", 1, READ_POSITION[1:-2], SECOND)).value == {"pdu": None}
    later.do(command.Advance(duration=SECOND))
    frames = [event.payload.to_json() for event in subscription.take().events]
    assert frames[:2] == [
        {"client": "script", "direction": "in", "data": READ_POSITION.hex(), "words": "read M1_POS_ACT"},
        {
            "client": "script",
            "direction": "out",
            "data": with_crc(bytes.fromhex("01 03 04 00 00 00 00")).hex(),
            "words": "read M1_POS_ACT = 0 mm",
        },
    ]


# ---------------------------------------------------------------------- whatever comes

NAMES = st.sampled_from(["table", "drum", "x", "bus", "chips", "start", "nobody", "table.IN8", "drum.B3", "1", "crc", ""])
LEAVES = st.none() | st.booleans() | st.integers(-5, 5) | st.sampled_from([2**63, -1.5, 1e308]) | NAMES | st.text(max_size=6)
VALUES = LEAVES | st.lists(LEAVES, max_size=3) | st.dictionaries(NAMES, LEAVES, max_size=3)


@st.composite
def messages(draw: st.DrawFn) -> dict[str, Any]:
    row = COMMANDS[draw(st.sampled_from(list(COMMANDS)))]
    fields = {field.name: draw(VALUES) for field in row.fields if draw(st.booleans())}
    if row.name == "step":  # one that is granted goes on for that long
        fields = {"for_ns": draw(st.integers(-1, 10**7))}
    return {"do": row.name, "id": draw(LEAVES), **fields, **draw(st.dictionaries(st.text(max_size=3), LEAVES, max_size=1))}


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(given=st.lists(messages(), max_size=8))
def test_no_exception_escapes_the_dispatcher(given: list[dict[str, Any]]) -> None:
    subject = of(feeder())
    for message in given:
        answer = said(subject, **message)
        assert ("ok" in answer) is not ("error" in answer)
        assert answer.get("error", {}).get("code") in (None, "misuse", "refusal")


@settings(max_examples=60, deadline=None)
@given(line=st.binary(max_size=80) | st.text(max_size=40).map(str.encode))
def test_every_line_has_an_answer(line: bytes) -> None:
    subject = of(small())

    def fail(error: Exception) -> None:
        raise error

    assert start(respond(lambda wanted, _: subject.answer(wanted), line, fail)).result()["error"]


TEXTS = ("$R0 = 5\nDELAY 100\n", "A;1;2;3;4\n", "f640\nr\n", "[\nw100\n]\n", "x1\n")
DEEDS = st.one_of(
    st.builds(command.Advance, duration=st.integers(0, 2 * SECOND)),
    st.builds(command.Advance, duration=st.just(SECOND), until=st.sampled_from(["x.position < 110", "drum.moving"])),
    st.builds(lambda pin, level: do.Set((("table", pin, level),)), st.sampled_from(["IN8", "IN9"]), st.sampled_from([0.0, 1.0])),
    st.builds(do.Press, st.just("start"), st.sampled_from([None, 1, 300 * MILLISECOND])),
    st.builds(do.Release, st.just("start")),
    st.builds(command.Move, st.just("table"), st.integers(1, 4), to=st.floats(-10, 10)),
    st.builds(command.Enable, st.just("table"), st.integers(1, 4), st.booleans()),
    st.builds(command.StopAxes, st.just("table"), st.none() | st.integers(1, 4)),
    st.builds(do.Send, st.just("chips"), st.sampled_from([b"r\r", b"x3\rf640\rr\r", b"k\r", b"\\\r"])),
    st.builds(do.Request, st.just("bus"), st.just(1), st.just(READ_POSITION[1:-2]), st.sampled_from([0, MILLISECOND, SECOND])),
    st.builds(do.PowerCycle, st.sampled_from(["table", "drum"])),
    st.builds(do.Turn, st.just("table"), st.integers(2, 4), st.integers(-100, 100)),
    st.builds(do.Couple, st.just("table"), st.integers(2, 4), st.sampled_from(do.COUPLINGS)),
    st.builds(do.Note, st.sampled_from(["here", "there"])),
    st.builds(do.Expect, st.sampled_from(["table.IN8", "idle"])),
    st.builds(do.SetFault, st.sampled_from(["crc nth=2", "no-answer"]).map(read_fault)),
    st.builds(do.ClearFault, st.sampled_from(["crc", "no-answer"])),
    st.builds(command.ControlProgram, st.just("table"), st.sampled_from(["start", "pause", "stop"])),
    st.builds(Download, st.just("table"), st.sampled_from(["program 0", "positions 1"]), st.sampled_from(TEXTS)),
    st.builds(Download, st.just("drum"), st.just("program"), st.sampled_from(TEXTS)),
    st.builds(command.ReadPins),
    st.builds(command.ReadState, st.sampled_from(["table", "drum"])),
    st.tuples(st.just("bus"), st.sampled_from([READ_POSITION, READ_POSITION[:3], b"\0"])),
    st.tuples(st.just("chips"), st.sampled_from([b"x3\rf640\rr\r", b"?\r"])),
)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(deeds=st.lists(DEEDS, max_size=14), follows=st.booleans())
def test_any_interleaving_of_commands_bytes_and_scripts_replays_to_the_same_digest(deeds: list[Any], follows: bool) -> None:
    world = feeder()
    subject = of(world)
    subscription = subject.subscribe(filter_of(["plan", "frame", "edge"]), 5) if follows else None
    for deed in deeds:
        if isinstance(deed, tuple) and len(deed) == 2 and deed[0] in ("bus", "chips"):
            line, data = deed
            world.apply_input(Bytes(line, "tcp-1", world.lines[line].kinds[0], data))
            continue
        try:
            subject.do(deed)
        except (Misuse, Refusal):
            continue
        if subscription is not None:
            subscription.take()
    recording = recording_of(world)
    again = recording.replay()
    assert again.trace.digest() == recording.digest
    assert list(again.trace) == list(world.trace)


def test_events_of_the_same_run_are_the_same() -> None:
    def run() -> list[Event]:
        subject = of(feeder())
        subscription = subject.subscribe(filter_of(), 100_000)
        subject.do(do.Press("start", 300 * MILLISECOND))
        subject.do(command.Advance(duration=20 * SECOND))
        return subscription.take().events

    events = run()
    assert events == run()
    assert {"plan", "edge", "button"} <= {event.kind for event in events}
    assert [event.number for event in events] == sorted({event.number for event in events})


CHIPS = """
[[line]]
name = "bus"
kind = "m1486"
[[m1486]]
name = "lift"
line = "bus"
address = 3
[[m1486]]
name = "other"
line = "bus"
address = 4
"""


def test_an_m1486_is_commanded_by_what_its_host_types() -> None:
    """Manual chapter VII.2: F sets a distance, V the speed in full steps/s, R makes the move; a step is 64 minimum microsteps."""
    subject = of(World.from_toml(CHIPS))
    subscription = subject.subscribe(filter_of(["frame"]), 999)

    def typed() -> str:
        frames = [event.payload for event in subscription.take().events]
        return "".join(frame.data.decode() for frame in frames if isinstance(frame, FramePayload) and frame.direction == "in")

    subject.do(command.Move("lift", 1, by=6400.0))
    assert typed() == "x3\rf6400\rr\r"
    with pytest.raises(Refusal, match="lift is not at rest"):
        subject.do(command.Move("lift", 1, to=0.0))
    subject.do(command.Advance(until="idle"))
    assert [reading.value for reading in subject.read("lift.counter", "other.counter", "lift.U1")] == [6400.0, 0.0, 0.0]
    subject.do(command.Move("lift", 1, to=0.0))
    assert "h\rr\r" in typed()
    subject.do(command.Advance(until="idle"))
    subject.do(command.Jog("lift", 1, -6400.0))
    assert "v100\rg-\rr\r" in typed()
    subject.do(command.Advance(duration=SECOND))
    assert subject.read("lift.velocity") == (("lift.velocity", -6400.0, "min. microsteps/s", "good"),)
    subject.do(command.StopAxes("lift"))
    subject.do(command.Advance(until="idle"))
    assert subject.read("lift.moving")[0].value == 0.0


@pytest.mark.parametrize(
    ("wanted", "message"),
    [
        (command.Move("lift", 1, to=0.5), "position 0.5 min. microsteps: a whole number is needed"),
        (
            command.Move("lift", 1, by=16_000_064.0),
            r"microsteps: F16000064 is out of range: permitted is 1 to",
        ),
        (command.Move("lift", 1, by=7.0), "distance 7 min. microsteps: no multiple of"),
        (command.Move("lift", 1, by=0.0), "distance 0 min. microsteps: F0 is out of range: permitted is 1 to"),
        (command.Move("lift", 2, by=640.0), "no axis 2: an M1486 has one, 1"),
        (command.Jog("lift", 1, 640.0), "velocity 640 min. microsteps/s, V10: V10 is out of range: permitted is 16 to"),
        (command.Home("lift", 1, 5.0), "'lift' is an M1486, which cannot do home; it can do move, jog, stop"),
        (command.Enable("lift", 1), "cannot do enable"),
    ],
)
def test_what_an_m1486_cannot_do_is_refused(wanted: command.Command, message: str) -> None:
    subject = of(World.from_toml(CHIPS))
    with pytest.raises((Misuse, Refusal), match=message):
        subject.do(wanted)
    subject.do(command.Advance(duration=SECOND))
    assert subject.read("lift.counter")[0].value == 0.0


def test_a_position_that_a_chip_does_not_know_is_no_beginning() -> None:
    """M-16: after Kill in a move the counter shows its target."""
    subject = of(World.from_toml(CHIPS))
    subject.do(command.Move("lift", 1, by=640_000.0))
    subject.do(command.Advance(duration=SECOND))
    subject.do(command.StopAxes("lift"))
    subject.do(command.Advance(until="idle"))
    with pytest.raises(Refusal, match=r"lift was stopped in a move: its counter does not show where it is \(M-16\)"):
        subject.do(command.Move("lift", 1, to=0.0))


def test_the_description_has_the_geometry_of_axes() -> None:
    text = """
        [[mic488]]
        name = "a"
        [[axis]]
        name = "x"
        drive = "a.M1"
        unit = "mm"
        pulses_per_unit = 10
        travel = [-5, 90.0]
        switch = [
          { to = "a.IN1", below = -1.0 }, { to = "a.IN2", above = 80 }, { to = "a.IN3", position = 4, width = 2, period = 20 },
        ]
        [[axis]]
        name = "dial"
        drive = "a.M2"
        kind = "rotary"
        unit = "degree"
        pulses_per_unit = 10
    """
    x, dial = of(World.from_toml(text)).description.axes
    assert (x.kind, x.travel, x.pulses_per_unit) == ("linear", (-5.0, 90.0), 10.0)
    assert [(one.pin, one.low, one.high, one.period) for one in x.switches] == [
        ("a.IN1", None, -1.0, None), ("a.IN2", 80.0, None, None), ("a.IN3", 3.0, 5.0, 20.0),
    ]  # fmt: skip
    assert (dial.kind, dial.travel, dial.switches) == ("rotary", None, ())


def test_elements_are_described_with_terminals_and_signals() -> None:
    world = World.from_toml(
        '[[mic488]]\nname = "a"\n[[button]]\nname = "b"\nto = "both.in2"\n[[cylinder]]\nname = "clamp"\nextend = "a.OUT1"\n'
        'stroke = 40.0\n[[cylinder.switch]]\nposition = 20.0\nwidth = 2.0\nto = "a.IN3"\n'
        '[[gate]]\nname = "both"\nkind = "and"\ninputs = 2\n[[wire]]\nfrom = "clamp.extended"\nto = "both.in1"\n'
    )
    description = describe(world)
    assert description.elements == (
        ElementDescription("both", "gate", ("in1", "in2"), ("out",), (), function="and"),
        ElementDescription(
            "clamp", "cylinder", ("extend",), ("extended", "retracted"), (SignalDescription("position", "mm", 0.0, 40.0),),
            DrawingDescription("rod", 40.0, ("position",), 0.0, (SwitchDescription("a.IN3", 19.0, 21.0),)),
        ),
    )  # fmt: skip
    assert set(description.connections) == {
        ConnectionDescription("clamp.extended", "both.in1", inverted=False, delay_ns=0, join=None),
        ConnectionDescription("a.OUT1", "clamp.extend", inverted=False, delay_ns=0, join=None),
        ConnectionDescription("clamp.switch1", "a.IN3", inverted=False, delay_ns=0, join=None),
        ConnectionDescription("b", "both.in2", inverted=False, delay_ns=0, join=None),
    }
    assert read_description(json.loads(json.dumps(description.to_json()))) == description
