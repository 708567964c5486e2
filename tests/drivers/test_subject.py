"""Devices as subjects: what they do, what they cannot know, and that they and the two other subjects agree."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Iterator
from typing import Any

import pytest
from device_rig import Rig
from host_rig import Wire, async_driver, driver, run_virtual, task_line
from mic488_rig import loaded

from steptwin.controller import SECOND
from steptwin.drivers.blocking import finish
from steptwin.drivers.exchange import Overtaken
from steptwin.drivers.m1486.subject import M1486Part
from steptwin.drivers.mic488.subject import Mic488Part
from steptwin.drivers.mic488.sync import Mic488
from steptwin.drivers.subject import AsyncDeviceSubject, DeviceSubject, RawEffect
from steptwin.errors import LineFailure, Misuse, Refusal, SteptwinError
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.registers import register_map
from steptwin.mic488.status import ControllerStatus
from steptwin.simulation.faults import read as read_fault
from steptwin.simulation.script import steps as do
from steptwin.subject import commands as command
from steptwin.subject.commands import type_of
from steptwin.subject.contract import read_description
from steptwin.subject.events import read_event
from steptwin.subject.payloads import FramePayload, SamplePayload
from steptwin.subject.subscriptions import Subscription, filter_of
from steptwin.subject.world import WorldSubject


@pytest.fixture
def rig() -> Iterator[Rig]:
    rig = Rig()
    with rig.mic, rig.chip:
        yield rig


@pytest.fixture
def table(rig: Rig) -> DeviceSubject:
    return rig.mic.subject("table")


@pytest.fixture
def drum(rig: Rig) -> DeviceSubject:
    return rig.chip.subject("drum")


# ---------------------------------------------------------------------- what only twins can do


ONLY_TWINS = (do.Set((("table", "IN3", 1.0),)), do.SetFault(read_fault("busy unit=1")), do.PowerCycle("table"), command.Pause())


@pytest.mark.parametrize("wanted", ONLY_TWINS, ids=lambda wanted: type(wanted).__name__)
def test_what_only_a_twin_can_do_is_refused(table: DeviceSubject, wanted: command.Command) -> None:
    with pytest.raises(Refusal, match=r"is not possible for this device \(bus\); possible are describe, read, pins, .*write"):
        table.do(wanted)
    assert type_of(wanted).name not in table.description.commands


def test_the_description_of_a_device(table: DeviceSubject, rig: Rig) -> None:
    twin = WorldSubject(rig.world).description.controllers[0]
    found = table.description
    (controller,) = found.controllers
    assert (controller.name, controller.unit, controller.datasheet) == (twin.name, twin.unit, twin.datasheet)
    assert (controller.is_real, twin.is_real) == (True, False)
    assert read_description(json.loads(json.dumps(found.to_json()))) == found
    assert found.lines[0].baud is None


def test_pulses_are_unknown_without_the_configuration() -> None:
    bare = Mic488("tcp://127.0.0.1:1", firmware="1.70")
    axes = bare.subject().description.controllers[0].datasheet.axes
    assert {(axis.unit, axis.pulses_per_unit) for axis in axes} == {("u", None)}


def test_a_request_gives_the_answer_of_the_controller(table: DeviceSubject) -> None:
    # Function 3, POS_ACT of M1 at 10020: two words; 9800 is a hole: exception 2.
    assert table.do(do.Request("bus", 1, bytes.fromhex("0327240002"), SECOND)).value == {"pdu": "030400000000"}
    assert table.do(do.Request("bus", 1, bytes.fromhex("0326480001"), SECOND)).value == {"pdu": "8302"}
    with pytest.raises(Misuse, match="unit = 2: this subject is the device with address 1"):
        table.do(do.Request("bus", 2, bytes.fromhex("0327240002"), SECOND))
    with pytest.raises(Misuse, match="no line is called 'buss'"):
        table.do(do.Request("buss", 1, bytes.fromhex("0327240002"), SECOND))


def test_nothing_is_written_where_one_name_is_wrong(table: DeviceSubject) -> None:
    with pytest.raises(Misuse, match="M1_STATUS can only be read"):
        table.do(do.Write((("table", "OUT2", 1.0), ("table", "M1_STATUS", 1.0))))
    assert table.read("table.OUT2")[0].value == 0.0


@pytest.mark.parametrize(
    ("point", "message"),
    [
        ("tabel.IN1", "nothing is called 'tabel' .did you mean 'table'"),
        ("table.M1_POS", "no point 'M1_POS'; there are status, program, M1.status"),
        ("table.hr:10021", "this is the second word of M1_POS_ACT"),
    ],
)
def test_points_that_cannot_be_read(table: DeviceSubject, point: str, message: str) -> None:
    with pytest.raises(Misuse, match=message):
        table.read(point)


def test_user_registers_are_points(table: DeviceSubject) -> None:
    table.do(do.Write((("table", "USER_REGISTER[12]:real", 1.5),)))
    assert table.read("table.USER_REGISTER[12]:real")[0].value == 1.5


def test_time_begins_with_the_subject(table: DeviceSubject, rig: Rig) -> None:
    rig.time.sleep(2.0)
    assert table.read("time")[0].value == table.do(command.Time()).value["time_s"] == 2.0
    assert table.do(command.Time()).time == 2 * SECOND


def test_a_line_that_fails_is_a_failure(table: DeviceSubject, rig: Rig) -> None:
    rig.world.apply_input(do.SetFault(read_fault("no-answer lost=answer")))
    with pytest.raises(LineFailure):
        table.read("table.M1.position")


# ---------------------------------------------------------------------- events


def framed(subject: DeviceSubject, act: Any) -> list[tuple[str, str, str]]:
    """Direction, bytes and meaning of the frames meanwhile."""
    subscription = subject.subscribe(filter_of(["frame"]), 99)
    subscription.take()
    act()
    events = Subscription.take(subscription).events  # without a poll
    subscription.close()
    assert {event.controller for event in events} <= {subject.description.lines[0].name}
    seen = [event.payload for event in events if isinstance(event.payload, FramePayload)]
    assert {one.client for one in seen} <= {"steptwin"}
    return [(one.direction, one.data.hex(), one.words) for one in seen]


def failing(act: Any) -> None:
    with pytest.raises(SteptwinError):
        act()


def test_frames_of_a_mic488(table: DeviceSubject, rig: Rig) -> None:
    """With names of registers, as the driver knows them; of this unit only; an answer that does not come is one without bytes."""
    wire = [("in", "010507d4ff00"), ("out", "010507d4ff00")]
    seen = framed(table, lambda: table.do(command.StopAxes("table", 1)))[:2]
    assert [(way, data[12:]) for way, data, _ in seen] == wire
    assert [words for _, _, words in seen] == ["unit 1: write M1_STOP = ON", "unit 1: wrote M1_STOP = ON"]
    line: Any = rig.mic._driver.line
    other = Mic488(line, 2, firmware="1.70")
    assert framed(table, lambda: failing(other.open)) == []

    def read_in_vain() -> None:
        rig.world.apply_input(do.SetFault(read_fault("no-answer lost=answer")))
        failing(lambda: table.read("table.M1.position"))

    seen = framed(table, read_in_vain)
    asked, missed = seen[0], [(way, data, words) for way, data, words in seen if not data]
    assert asked[0] == "in"
    assert [(way, "no answer to 'unit 1: read" in words) for way, _, words in missed] == [("out", True)] * 3


def test_frames_of_an_m1486(drum: DeviceSubject) -> None:
    """Whole lines with their meaning, and their echo. The driver selects the chip, whose address may come first."""
    line = drum.description.lines[0].name
    with pytest.raises(Misuse, match="X7 selects another chip: this device is chip 3"):
        drum.do(do.Send(line, b"X7\rV900\r"))
    seen = framed(drum, lambda: drum.do(do.Send(line, b"X3\rV900\r")))
    assert seen == [
        ("in", b"u20\r".hex(), "U20  Upload 20"),
        ("out", b"u20\r".hex(), "echo of 'u20\\r'"),
        ("out", b"B".hex(), "U20 type letter in ASCII = 66"),
        ("in", b"v900\r".hex(), "V900  Velocity 900 step/s"),
        ("out", b"v900\r".hex(), "echo of 'v900\\r'"),
    ]


def test_frames_are_observed_only_while_they_are_followed(table: DeviceSubject, drum: DeviceSubject, rig: Rig) -> None:
    lines: list[Any] = [rig.mic._driver.line, rig.chip._driver.line]
    modbus, chips = (line._engine.discipline for line in lines)
    subscriptions = [subject.subscribe(filter_of(["frame"]), 9) for subject in (table, drum)]
    assert None not in (modbus.on_frame, chips.on_bytes)
    for subscription in subscriptions:
        subscription.close()
    assert (modbus.on_frame, chips.on_bytes) == (None, None)
    table.subscribe(filter_of(), 9)
    assert modbus.on_frame is None


def test_events_of_a_device_come_from_polling(table: DeviceSubject, rig: Rig) -> None:
    subscription = table.subscribe(filter_of(), 99)
    assert [(event.kind, event.payload.to_json()["position"]) for event in subscription.take().events] == [("sample", 0.0)] * 4
    table.do(command.Enable("table", 1))
    table.do(command.Move("table", 1, to=10.0))
    rig.world.apply_input(do.Set((("table", "IN7", 1.0),)))
    rig.time.sleep(0.3)
    events = subscription.take().events
    assert [(event.kind, event.axis) for event in events] == [("sample", "1"), ("edge", None), ("edge", None), ("status", "1")]
    assert [event.text for event in events][1:] == ["M1_EN: 1", "IN7: 1", "M1: moving to position"]
    sample = events[0].payload
    assert isinstance(sample, SamplePayload)
    assert sample.position is not None
    assert 0.0 < sample.position < 10.0
    assert sample.velocity is not None
    assert 0.0 < sample.velocity <= 40.0
    assert sample.unit == "mm"
    assert [read_event(json.loads(json.dumps(event.to_json()))) for event in events] == events
    assert subscription.take().events == []  # not before the next period
    subscription.close()


def test_what_the_controller_and_its_program_do_is_told_in_words(table: DeviceSubject, rig: Rig) -> None:
    subscription = table.subscribe(filter_of(["status"]), 99)
    twin = rig.world.mic488["table"].device
    told = []
    for shown in (True, False):
        twin.set_master_error(shown, rig.time.now())
        rig.time.sleep(0.3)
        told += subscription.take().events
    assert [(event.text, event.axis) for event in told] == [
        ("controller: Modbus master communication error", None),
        ("controller: ok", None),
    ]
    assert told[0].payload.to_json()["code"] == "controller-status"
    assert told[0].payload.to_json()["facts"] == {"status": ControllerStatus.MASTER_ERROR}


def test_a_device_that_nobody_follows_is_not_polled(table: DeviceSubject, rig: Rig) -> None:
    subscription = table.subscribe(filter_of(), 99)
    subscription.close()
    frames = WorldSubject(rig.world).subscribe(filter_of(["frame"]), 9)
    rig.time.sleep(1.0)
    subscription.take()
    assert frames.take().events == []
    table.read("table.IN1")
    assert len(frames.take().events) > 1


@pytest.mark.parametrize("period_s", [0.5, 60.0])
def test_a_device_is_polled_at_the_period_that_was_asked_for(rig: Rig, period_s: float) -> None:
    table = rig.mic.subject("table", period_s=period_s)
    begin = rig.time.now()
    subscription = table.subscribe(filter_of(["edge"]), 9)
    rig.world.apply_input(do.Set((("table", "IN7", 1.0),)))
    due = begin + round(period_s * SECOND)
    rig.time.advance(due - 1)
    assert subscription.take().events == []
    rig.time.advance(due)
    assert [event.text for event in subscription.take().events] == ["IN7: 1"]


@pytest.mark.parametrize("period_s", [0.019, 60.5, float("nan")])
def test_periods_at_which_no_device_is_polled(rig: Rig, period_s: float) -> None:
    with pytest.raises(Misuse, match=r"period_s = .*: permitted are 0.02 to 60 s"):
        rig.mic.subject("table", period_s=period_s)
    rig.mic.subject("table", period_s=0.02)


def test_a_slow_follower_loses_the_oldest_and_is_told_how_many(table: DeviceSubject, rig: Rig) -> None:
    subscription = table.subscribe(filter_of(["sample"]), 3)
    missed, events = subscription.take()
    assert (missed, [event.axis for event in events]) == (1, ["2", "3", "4"])


# ---------------------------------------------------------------------- for asyncio


def test_tasks_have_the_same() -> None:
    wire = Wire()

    async def play() -> None:
        async with async_driver(task_line(wire), wire) as mic:
            subject = AsyncDeviceSubject("table", Mic488Part(mic))
            subscription = subject.subscribe(filter_of(["status"]), 9)
            running = asyncio.create_task(subject.run())
            await asyncio.sleep(0.5)
            await subject.do(command.Enable("table", 1))
            await asyncio.sleep(1.0)
            running.cancel()
            assert [event.text for event in subscription.take().events] == ["M1: on at rest"]

    run_virtual(wire, play())


# ---------------------------------------------------------------------- parts of subjects


def test_units_are_known_without_asking(table: DeviceSubject, drum: DeviceSubject, rig: Rig) -> None:
    sent = rig.world.now
    mic, chip = table._driver, drum._driver
    units = {point: mic.unit_of(point) for point in ("table.M1_POS_ACT", "table.M1_ACC", "table.ENC2_IMP", "table.IN1", "time")}
    assert units == {"table.M1_POS_ACT": "mm", "table.M1_ACC": "mm/s²", "table.ENC2_IMP": "imp", "table.IN1": "", "time": "s"}
    units = {point: mic.unit_of(f"table.{point}") for point in ("M2_VEL_ACT", "M2_STATUS", "AIN1", "M1.velocity")}
    assert units == {"M2_VEL_ACT": "imp/s", "M2_STATUS": "", "AIN1": "V", "M1.velocity": "mm/s"}
    assert [chip.unit_of(f"drum.{point}") for point in ("counter", "Velocity", "B3", "variable")] == [
        "min. microsteps", "min. microsteps/s", "", "",
    ]  # fmt: skip
    for subject, message in ((mic, "no point 'x'"), (chip, "'x' is not a point of an M1486: there are position, velocity")):
        with pytest.raises(Misuse, match=message):
            subject.unit_of(f"{subject.name}.x")
    assert rig.world.now == sent


def test_a_device_that_was_lost_is_unknown_until_it_is_asked_again(table: DeviceSubject, drum: DeviceSubject, rig: Rig) -> None:
    """An unknown sample of each axis; then all axes anew, as at first."""
    for subject, axes in ((table._driver, 4), (drum._driver, 1)):
        subscription = subject.subscribe(filter_of(["sample"]), 99)
        finish(subject.poll())
        assert len(subscription.take().events) == axes
        finish(subject.poll())
        assert subscription.take().events == []
        newest = [event.payload.to_json() for event in subject.samples()]
        assert len(newest) == axes
        subject.forget()
        unknown = [event.payload.to_json() for event in subscription.take().events]
        assert [event.payload.to_json() for event in subject.samples()] == unknown
        assert unknown == [{"axis": one["axis"], "position": None, "unit": one["unit"], "velocity": None} for one in newest]
        finish(subject.poll())
        assert [event.payload.to_json() for event in subscription.take().events] == newest


def test_after_a_loss_the_same_device_is_there(rig: Rig) -> None:
    mic, chip = Mic488Part(rig.mic._driver), M1486Part(rig.chip._driver)
    finish(mic.reconnect())
    finish(chip.reconnect())
    assert finish(mic.values(["M1_POS_ACT"]))["M1_POS_ACT"][0] is not None
    assert finish(chip.values(["COUNTER"]))["COUNTER"][0] is not None


def test_after_a_loss_another_controller_is_there() -> None:
    """Its registers are elsewhere."""
    wire = Wire(firmware="1.23")
    part = Mic488Part(driver(wire, firmware=None)._driver)
    finish(part.reconnect())
    wire.twins[1] = Mic488Device(wire.config, "1.70")
    wire.open()
    with pytest.raises(Refusal, match=r"memory: another controller is there: firmware 1\.70 instead of 1\.23"):
        finish(part.reconnect())


def test_dead_man_jogs_are_those_of_the_drivers(rig: Rig) -> None:
    mic, chip = Mic488Part(rig.mic._driver), M1486Part(rig.chip._driver)
    rig.mic.enable(1)
    rows = (
        (mic.dead_man_jog(command.Jog("table", 1, -3.0)), "table.M1.velocity", -3.0),
        (chip.dead_man_jog(command.Jog("drum", 1, -300.0)), "drum.velocity", -300.0 * 64),
    )
    for held, point, velocity in rows:
        finish(held.__aenter__())
        assert finish(held.hold())
        rig.time.sleep(0.05)
        assert rig.world.read(point) == velocity
        assert held.end is None
        finish(held.__aexit__(None, None, None))
        assert held.end is not None
    with pytest.raises(Misuse, match="axis = 2: an M1486 has axis 1 only"):
        chip.dead_man_jog(command.Jog("drum", 2, 50.0))


def test_settings_are_kept_as_json(rig: Rig) -> None:
    """Of a MIC488 a snapshot that can be written back; of a chip what it sends, and the settings that this driver has made."""
    mic, chip = Mic488Part(rig.mic._driver), M1486Part(rig.chip._driver)
    rig.mic.set("M1_ACC", 77.0)
    rig.chip.configure(velocity=900)
    rig.chip.command("t80")
    found = json.loads(finish(mic.settings_text()))
    assert "77.0" in json.dumps(found)
    shown = json.loads(finish(chip.settings_text()))
    assert (shown["format"], shown["settings"]["velocity"], shown["settings"]["acceleration"]) == (
        "steptwin M1486 settings 1", 900, None,
    )  # fmt: skip
    assert shown["flags"]["80"] is True
    assert finish(chip.settings_text()).startswith('{\n  "format": ')  # lines for people


def test_the_description_and_the_time_as_commands(table: DeviceSubject, rig: Rig) -> None:
    assert table.do(command.Describe()).value == table.description.to_json()
    rig.time.sleep(2.5)
    time = table.do(command.Time()).value
    assert isinstance(time, dict)
    assert (time["world"], time["time_ns"], time["paused"], time["speed"]) == (
        "table",
        str(round(time["time_s"] * SECOND)),
        False,
        1.0,
    )
    assert time["time_s"] == pytest.approx(2.5, abs=0.1)


def test_what_a_program_does_is_an_event(table: DeviceSubject, rig: Rig) -> None:
    rig.world.mic488["table"].device.load_program(0, loaded("WAIT IN5 = ON\n")[0])
    subscription = table.subscribe(filter_of(["status"]), 99)
    table.do(command.ControlProgram("table", "start"))
    rig.time.sleep(1.0)
    (event,) = subscription.take().events
    assert (event.text, event.payload.to_json()["facts"]) == ("program: running", {"state": 1})
    table.do(command.ControlProgram("table", "pause"))
    rig.time.sleep(1.0)
    assert [event.text for event in subscription.take().events] == ["program: paused"]
    table.do(command.ControlProgram("table", "stop"))
    rig.time.sleep(1.0)
    assert [event.text for event in subscription.take().events] == ["program: stopped"]


@pytest.mark.parametrize("request_", [b"", b"\x03", b"\x03\x00\x00\x00", b"\x10\x00\x00\x00\x01\x02\x00"])
def test_a_request_that_is_none_is_not_sent(table: DeviceSubject, request_: bytes) -> None:
    with pytest.raises(Misuse, match=f"pdu = {request_.hex()}: "):
        table.do(do.Request("bus", 1, request_, SECOND))


@pytest.mark.parametrize(
    ("pdu", "effect"),
    [
        ("0300000001", RawEffect.LOOK),
        ("0507d4ff00", RawEffect.STOP),  # M1_STOP ON
        ("0507d40000", RawEffect.WRITE),
        ("0507d80000", RawEffect.STOP),  # M1_JOG_PLUS OFF
        ("0507d8ff00", RawEffect.WRITE),
        ("100064000102", RawEffect.WRITE),  # cut
        ("10271400010200ff", RawEffect.WRITE),  # several registers
        ("1027130001020002", RawEffect.STOP),  # PROGRAM_CTRL PAUSE, as one of several
    ],
)
def test_raw_requests_that_stop_are_known(rig: Rig, pdu: str, effect: RawEffect) -> None:
    part = Mic488Part(rig.mic._driver)
    assert part.effect_of(do.Request("bus", 1, bytes.fromhex(pdu), SECOND)) is effect


@pytest.mark.parametrize(
    ("key", "value", "effect"), [("M_STOP", 1, "stop"), ("PROGRAM_CTRL", 0, "stop"), ("PROGRAM_CTRL", 1, "write")]
)
def test_writes_of_words_that_stop_are_known(rig: Rig, key: str, value: int, effect: str) -> None:
    part = Mic488Part(rig.mic._driver)
    address = register_map("1.70").of(key).address
    pdu = bytes((6,)) + address.to_bytes(2, "big") + value.to_bytes(2, "big")
    assert part.effect_of(do.Request("bus", 1, pdu, SECOND)).value == effect


@pytest.mark.parametrize(
    ("values", "effect"),
    [
        ({"M1_STOP": 1}, "stop"),
        ({"M_STOP": 3, "PROGRAM_CTRL": 2}, "stop"),
        ({"M_STOP": 0}, "write"),
        ({"M1_STOP": 1, "M2_POS_ABS": 5.0}, "write"),
        ({"OUT1": 1}, "write"),
        ({}, "write"),
    ],
)
def test_writes_of_registers_that_stop_are_known(rig: Rig, values: dict[str, float], effect: str) -> None:
    part = Mic488Part(rig.mic._driver)
    assert part.effect_of(do.Write(tuple(("table", name, value) for name, value in values.items()))).value == effect


@pytest.mark.parametrize(
    ("name", "value", "is_refused"),
    [
        ("M1_POS_ABS", 0.0, True),
        ("M1_HOME", 0.0, True),
        ("M1_JOG_PLUS", 1.0, True),
        ("M1_POS_REL", 0.5, True),
        ("M1_POS_REL", 0.0, False),
        ("M1_VEL_ABS", 0.0, False),
        ("M1_VEL_REL", 0.0, False),
        ("M1_JOG_PLUS", 0.0, False),
    ],
)
def test_motions_that_are_ignored_with_the_drive_off_are_refused(
    table: DeviceSubject, name: str, value: float, is_refused: bool
) -> None:
    """Position 0 is a motion, velocity 0 and distance 0 are none."""
    wanted = do.Write((("table", name, value),))
    if is_refused:
        with pytest.raises(Refusal, match="M1 of unit 1 is switched off"):
            table.do(wanted)
    else:
        table.do(wanted)


def test_a_stop_between_the_values_of_a_write_refuses_the_rest(table: DeviceSubject, rig: Rig) -> None:
    unit = rig.mic._driver._unit
    rig.mic.axis(1).enable()
    inner = unit.write

    async def write(item: Any, value: Any, **options: Any) -> None:
        await inner(item, value, **options)
        unit.shared.stops[1] += 1  # another client stops M1 meanwhile

    unit.write = write  # type: ignore[method-assign]
    with pytest.raises(Overtaken, match="a stop was requested meanwhile"):
        table.do(do.Write((("table", "OUT1", 1.0), ("table", "M1_POS_ABS", 5.0))))


def test_a_raw_request_that_stops_goes_before_those_that_wait(
    table: DeviceSubject, rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    unit, asked = rig.mic._driver._unit, list[bool]()
    exchange = unit._exchange

    async def noted(query: Any, urgent: bool, *rest: Any) -> bytes:
        asked.append(urgent)
        return await exchange(query, urgent, *rest)

    monkeypatch.setattr(unit, "_exchange", noted)
    for pdu in ("0507d4ff00", "0327240002"):  # M1_STOP ON; POS_ACT of M1
        table.do(do.Request("bus", 1, bytes.fromhex(pdu), SECOND))
    assert asked == [True, False]
