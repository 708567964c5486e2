"""Events of a world as a subject."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from world_rig import small

from steptwin.controller import SECOND
from steptwin.files.world import World
from steptwin.motion.divisions import profile_of
from steptwin.motion.planjson import read_plan
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.inputs import Bytes
from steptwin.subject import commands as command
from steptwin.subject.payloads import PlanPayload
from steptwin.subject.subscriptions import filter_of
from steptwin.subject.world import WorldSubject
from steptwin.wire.crc import with_crc

EXAMPLES = Path(__file__).parents[2] / "examples" / "worlds"


READ_POSITION = with_crc(bytes.fromhex("01 03 27 24 00 02"))


def of(world: World) -> WorldSubject:
    return WorldSubject(world)


def feeder() -> World:
    return World.load(EXAMPLES / "feeder.toml")


def test_events_name_what_led_to_them() -> None:
    subject = of(small())
    subject.world.sync_all()
    subscription = subject.subscribe(filter_of(), 99)
    number = subject.do(do.Press("go")).number
    pressed, *edges = subscription.take().events
    assert (pressed.kind, pressed.cause) == ("button", number)
    assert {edge.cause for edge in edges} == {pressed.number}
    assert [edge.text for edge in edges] == ["go: 1", "IN4: 1"]


def test_what_was_due_before_a_command_has_no_cause_in_it() -> None:
    subject = of(small("[[script]]\nname = 's'\nsteps = [{ wait = '1 s' }, { set = { 'a.IN2' = 1 } }]\n"))
    subscription = subject.subscribe(filter_of(["edge"]), 99)
    subject.do(command.Advance(duration=SECOND))
    subject.do(do.Set((("b", "IN2", 1.0),)))
    first, second = (event for event in subscription.take().events if event.text == "IN2: 1")
    assert first.cause is None
    assert second.cause is not None


def test_nobody_who_follows_costs_nothing() -> None:
    subject = of(small())
    assert subject.world.trace.subscribers == []
    subscription = subject.subscribe(filter_of(["frame"]), 9)
    assert len(subject.world.trace.subscribers) == 1
    subscription.close()
    assert subject.world.trace.subscribers == []


def test_frames_are_followed_on_connections_that_are_there_and_where_nothing_is_recorded() -> None:
    world = feeder()
    subject = of(world)
    world.apply_input(Bytes("bus", "tcp-1", "rtu", READ_POSITION))
    world.run(for_=0.5)
    world.stop_recording()
    subscription = subject.subscribe(filter_of(["frame"], ["bus"]), 99)
    world.apply_input(Bytes("bus", "tcp-1", "rtu", READ_POSITION))
    world.run(for_=0.5)
    frames = [plain for event in subscription.take().events if (plain := event.payload.to_json())["client"] == "tcp-1"]
    assert frames[0] == {"client": "tcp-1", "direction": "in", "data": READ_POSITION.hex(), "words": "read M1_POS_ACT"}
    assert [frame["direction"] for frame in frames] == ["in", "out"]
    subscription.close()
    world.apply_input(Bytes("bus", "tcp-1", "rtu", READ_POSITION))
    assert subscription.take().events == []


def test_bytes_that_belong_to_no_frame_are_counted_among_the_frames() -> None:
    world = feeder()
    subscription = of(world).subscribe(filter_of(["frame"], ["bus"]), 99)
    world.apply_input(Bytes("bus", "tcp-1", "rtu", b"\x55\x55\x55"))
    world.run(for_=5)
    world.apply_input(Bytes("bus", "tcp-1", "rtu", READ_POSITION))
    world.run(for_=0.5)
    frames = [event.payload.to_json() for event in subscription.take().events]
    noise = [str(frame["words"]).split(maxsplit=1) for frame in frames if not frame["data"]]
    assert sum(int(count) for count, _ in noise) == 3
    assert {what for _, what in noise} <= {"byte that belongs to no frame", "bytes that belong to no frame"}


def test_frames_of_chips_are_lines_and_characters() -> None:
    text = "[[m1486]]\nname = 'drum'\nline = 'bus'\naddress = 7\n[[line]]\nname = 'bus'\nkind = 'm1486'\n"
    world = World.from_toml(text)
    subscription = of(world).subscribe(filter_of(["frame"]), 99)
    world.apply_input(Bytes("bus", "tcp-1", "raw", b"X7\rU3\r"))
    world.run(for_=1)
    assert [event.payload.to_json() for event in subscription.take().events] == [
        {"client": "tcp-1", "direction": "in", "data": b"X7\r".hex(), "words": "X7  indeX 7"},
        {"client": "tcp-1", "direction": "in", "data": b"U3\r".hex(), "words": "U3  Upload 3"},
        {"client": "line", "direction": "out", "data": "00", "words": "U3 position, high byte = 0"},
    ]


def test_the_plans_of_a_run_give_every_position_the_controller_shows() -> None:
    """Who watches computes positions itself, from the plain numbers and nothing else."""
    world = feeder()
    subject = of(world)
    plans = {(e.controller, e.axis): e for e in subject.plans(filter_of())}
    subscription = subject.subscribe(filter_of(["plan", "coordinate"]), 10_000)
    axes = [(m.name, a) for m in subject.description.controllers for a in m.datasheet.axes]
    scales = {(name, str(a.number)): a.pulses_per_unit for name, a in axes if a.pulses_per_unit is not None}
    origins: dict[tuple[str, str | None], int] = {}
    for _ in range(200):
        world.run(for_=0.05)
        for event in subscription.take().events:
            plain = json.loads(json.dumps(event.to_json()))
            key = event.controller, event.axis
            origins[key] = plain["origin"]
            if event.kind == "plan":
                plans[key] = event
        for (controller, axis), event in plans.items():
            if controller != "table":
                continue
            assert isinstance(event.payload, PlanPayload)
            plan = profile_of(read_plan(json.loads(json.dumps(event.to_json()))["plan"]))
            origin = origins.get((controller, axis), event.payload.origin or 0)
            shown = (plan.count(world.now) + origin) / scales[controller, str(axis)]
            assert shown == pytest.approx(world.read(f"{controller}.M{axis}.position"), abs=1e-9)
    assert len({event.number for event in plans.values()}) > 1


def test_words_of_a_note_are_a_value_of_its_message() -> None:
    words = "the chip shop waits 5 ms"
    subject = of(small(f"[[script]]\nname = 's'\nsteps = [{{ note = '{words}' }}]\n"))
    subscription = subject.subscribe(filter_of(["note"]), 99)
    subject.do(command.Advance(duration=SECOND))
    (note,) = subscription.take().events
    assert note.to_json()["messages"] == {"text": {"id": "subject.note", "values": {"note": words}}}
