"""An M1486 behind a driver as a subject: what it does, and what it cannot know."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from typing import Any

import pytest
from chip_rig import ChipWire, chip_task_line
from device_rig import Rig
from line_rig import run_virtual

from steptwin.controllerstate import ControllerState, ProgramActivity
from steptwin.drivers.blocking import finish
from steptwin.drivers.m1486 import M1486, AsyncM1486, Busy
from steptwin.drivers.m1486.subject import M1486Part
from steptwin.drivers.subject import DeviceSubject, RawEffect
from steptwin.errors import Misuse, Refusal, SteptwinError
from steptwin.jsonvalues import read
from steptwin.simulation.script import steps as do
from steptwin.subject import commands as command
from steptwin.subject.contract import UNKNOWN
from steptwin.subject.subscriptions import filter_of
from steptwin.subject.world import WorldSubject


@pytest.fixture
def rig() -> Iterator[Rig]:
    rig = Rig()
    with rig.mic, rig.chip:
        yield rig


@pytest.fixture
def drum(rig: Rig) -> DeviceSubject:
    return rig.chip.subject("drum")


def test_an_m1486_moves_and_is_unknown_meanwhile(drum: DeviceSubject, rig: Rig) -> None:
    assert drum.description.controllers[0].datasheet.axes[0].unit == "step"
    assert drum.description.controllers[0].controls == ("move", "jog", "stop", "program")
    assert drum.description.controllers[0].unit == 3
    assert [reading.value for reading in drum.read("drum.B1", "drum.U3", "drum.U20")] == [None, 0.0, ord("B")]
    drum.do(command.Move("drum", 1, by=5000.0))
    moving = {reading.point: reading for reading in drum.read("drum.counter", "drum.moving", "drum.B1", "drum.position")}
    assert {reading.quality for reading in moving.values()} == {UNKNOWN}
    rig.time.sleep(60.0)
    values = {reading.point: reading.value for reading in drum.read("drum.counter", "drum.moving", "drum.U20", "drum.position")}
    assert values == {"drum.counter": 5000 * 64, "drum.moving": 0.0, "drum.U20": ord("B"), "drum.position": None}
    assert rig.world.read("drum.counter") == 5000 * 64


def test_the_state_of_an_m1486_is_known_at_rest(drum: DeviceSubject, rig: Rig) -> None:
    """Every upload that a state has is that of the twin; levels are unknown, because reading them takes the internal variable."""
    twin = WorldSubject(rig.world)
    drum.do(do.Send("chips", b"t41\r"))
    drum.read("drum.counter", "drum.variable", *(f"drum.U{number}" for number in (14, 17, 18, 19)))
    found, there = (read(ControllerState, subject.do(command.ReadState("drum")).value) for subject in (drum, twin))
    known = ("counter", "counter_valid", "variable", "flags_on", "functions_on")
    assert {name: value for name, value in found.details.items() if value is not None} == {n: there.details[n] for n in known}
    assert found.details.keys() == there.details.keys()
    assert (found.kind, found.variant, found.program.state) == (there.kind, there.variant, ProgramActivity.STOPPED)
    assert found.pins == dict.fromkeys(there.pins)
    drum.do(command.Move("drum", 1, by=5000.0))
    found = read(ControllerState, drum.do(command.ReadState("drum")).value)
    assert (found.program.state, found.axes[0].position, found.axes[0].moving) == (None, None, None)
    assert {found.status.text, found.axes[0].status.text, found.program.text} == {"moves, waits or runs its program"}
    rig.time.sleep(60.0)
    found = read(ControllerState, drum.do(command.ReadState("drum")).value)
    assert {found.status.text, found.axes[0].status.text, found.program.text} == {"is at rest"}
    rig.time.sleep(60.0)
    found = read(ControllerState, drum.do(command.ReadState("drum")).value)
    assert (found.axes[0].position, found.axes[0].velocity, found.axes[0].moving) == (None, 0.0, False), "not read yet"
    drum.read("drum.counter")
    assert read(ControllerState, drum.do(command.ReadState("drum")).value).axes[0].position == 5000.0


def test_an_m1486_jogs_and_stops(drum: DeviceSubject, rig: Rig) -> None:
    subscription = drum.subscribe(filter_of(), 9)
    subscription.take()
    drum.do(command.Jog("drum", 1, -50.0))
    rig.time.sleep(2.0)
    assert [event.text for event in subscription.take().events] == [
        "moves, waits or runs its program",
        "axis 1: the position is not known",
    ]
    assert rig.world.read("drum.velocity") == -50.0 * 64
    drum.do(command.StopAxes("drum", 1))
    rig.time.sleep(2.0)
    status, sample = subscription.take().events
    assert status.text == "is at rest"
    assert sample.payload.to_json()["velocity"] == 0.0
    assert rig.world.read("drum.velocity") == 0.0
    rig.time.sleep(2.0)
    assert subscription.take().events == []
    assert {reading.value for reading in drum.read("drum.moving", "drum.velocity")} == {0.0}
    drum.do(command.Jog("drum", 1, 50.0))
    rig.time.sleep(2.0)
    assert rig.world.read("drum.velocity") == 50.0 * 64
    drum.do(command.StopAxes("drum"))


def test_an_m1486_is_moved_and_shown_in_the_unit_of_its_driver(rig: Rig) -> None:
    """40 full steps per millimetre, 0 at 100 mm of the counter."""
    line: Any = rig.chip._driver.line
    with M1486(line, 3, steps_per_unit=40.0, unit="mm", origin_u=100 * 40 * 64) as chip:
        drum = chip.subject("drum")
        drum.do(command.Move("drum", 1, to=-60.0))
        rig.time.sleep(60.0)
        assert rig.world.read("drum.counter") == 40 * 40 * 64
        (sample,) = drum.subscribe(filter_of(), 9).take().events
        assert sample.payload.to_json() == {"axis": "1", "position": -60.0, "unit": "mm", "velocity": 0.0}
        drum.do(command.Move("drum", 1, by=-2.0))
        rig.time.sleep(60.0)
        assert rig.world.read("drum.counter") == 38 * 40 * 64
        drum.do(command.Jog("drum", 1, 0.5))
        rig.time.sleep(1.0)
        assert rig.world.read("drum.velocity") == 0.5 * 40 * 64


def test_of_an_m1486_only_what_was_asked_for_is_followed(drum: DeviceSubject, rig: Rig) -> None:
    samples, states = drum.subscribe(filter_of(["sample"]), 9), drum.subscribe(filter_of(["status"]), 9)
    drum.do(command.Move("drum", 1, by=5000.0))
    found = []
    for pause in (2.0, 60.0):
        rig.time.sleep(pause)
        found.append([[event.kind for event in subscription.take().events] for subscription in (samples, states)])
    assert found == [[["sample", "sample"], ["status"]], [["sample"], ["status"]]], "where it stood, not known, where it stands"
    samples.close()
    frames = WorldSubject(rig.world).subscribe(filter_of(["frame"]), 99)
    drum.do(do.Send("chips", b"t80\r"))
    states.take()
    rig.time.sleep(1.0)
    states.take()
    asked = "".join(event.text for event in frames.take().events)
    assert "U20 " in asked, "is it at rest"
    assert "U1 " not in asked, "the counter is of no use to whoever follows states"


def test_an_m1486_that_begins_to_move_while_it_is_looked_at(
    drum: DeviceSubject, rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was at rest when it was asked, and its counter is not to be had any more."""
    subscription = drum.subscribe(filter_of(), 9)
    subscription.take()
    drum.do(do.Send("chips", b"t80\r"))

    async def moves(*numbers: int) -> int:
        raise Busy("it moves")

    monkeypatch.setattr(rig.chip._driver._unit, "read", moves)
    rig.time.sleep(1.0)
    assert [event.text for event in subscription.take().events] == ["axis 1: the position is not known"]


def test_the_program_of_an_m1486_is_ended(drum: DeviceSubject, rig: Rig) -> None:
    rig.chip.download("[\n@3\nF640\nR\nW1000\nJ3\n]")
    rig.time.sleep(5.0)
    drum.do(command.ControlProgram("drum", "stop"))
    stood = rig.world.read("drum.counter")
    rig.time.sleep(10.0)
    assert rig.world.read("drum.counter") == stood


def test_characters_for_an_m1486_are_whole_commands_that_move_nothing(drum: DeviceSubject, rig: Rig) -> None:
    line = drum.description.lines[0].name
    drum.do(do.Send(line, b":17\rt80\r"))
    assert drum.read("drum.variable")[0].value == 17.0
    refused = {
        b":18": "each with CR behind it",
        b":18\rf100\rr\r": "motions, files and questions",
        b"": "CR",
        b":18;note\rX3\r:19\r": "X3",
        b":18\rc75\r": "recover",
    }
    for text, message in refused.items():
        with pytest.raises(Misuse, match=message):
            drum.do(do.Send(line, text))
    assert drum.read("drum.variable")[0].value == 17.0


def test_the_rest_of_a_text_for_an_m1486_is_not_sent_behind_a_stop() -> None:
    wire = ChipWire("B", (7,))
    line = chip_task_line(wire)
    chip = AsyncM1486(line, 7)

    async def work() -> None:
        await chip.open()
        part = M1486Part(chip)
        sending = asyncio.ensure_future(part.actions()[do.Send](do.Send("chips", b"x7\rs200\rs300\rt6\r")))
        await line.sleep(0.03)
        await chip.stop()
        with pytest.raises(Refusal, match=r"was not sent.*: a stop was requested meanwhile"):
            await sending
        wire.sent.clear()
        await line.sleep(1.0)
        assert not wire.sent
        assert wire.codes().count("output") == 0

    run_virtual(wire, work())


SECOND_AXIS = (command.Move("drum", 2, to=9.0), command.Jog("drum", 2, 50.0), command.StopAxes("drum", 2))


@pytest.mark.parametrize(
    ("wanted", "kind", "message"),
    [
        (command.Home("drum", 1, -5.0), Refusal, "home is not possible for this device"),
        (command.Enable("drum", 1), Refusal, "enable is not possible for this device"),
        (command.ControlProgram("drum", "start"), Refusal, "an M1486 has no command to start its program"),
        (command.Jog("drum", 1, 0.0), Misuse, "the sign of the velocity is the direction"),
        *((wanted, Misuse, "axis = 2: an M1486 has axis 1 only") for wanted in SECOND_AXIS),
        (command.StopAxes("drun"), Misuse, "no controller is called 'drun' .did you mean 'drum'.*; there are drum"),
        (do.Write((("drun", "X", 1.0),)), Refusal, "write is not possible for this device"),
        (command.ReadPoints(("drum.B99",)), Misuse, "'B99' is not a point of an M1486: there are position"),
    ],
)
def test_what_an_m1486_does_not_do(drum: DeviceSubject, wanted: command.Command, kind: type[SteptwinError], message: str) -> None:
    with pytest.raises(kind, match=message):
        drum.do(wanted)


def test_an_m1486_takes_no_requests_of_modbus(rig: Rig) -> None:
    assert M1486Part(rig.chip._driver).effect_of(do.Request("chips", 3, b"\x03", 1)) is RawEffect.WRITE


def test_a_value_is_not_known_of_an_m1486_that_begins_to_move(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    """It was at rest when it was asked."""

    part = M1486Part(rig.chip._driver)
    assert finish(part.values(["variable"])) == {"variable": (0.0, "")}

    async def busy(*numbers: int) -> int:
        raise Busy("it moves")

    monkeypatch.setattr(rig.chip._driver._unit, "read", busy)
    assert finish(part.values(["counter", "variable"])) == {"counter": (None, part.unit_of("counter")), "variable": (0.0, "")}


def test_a_move_that_is_stopped_leaves_the_position_unknown(drum: DeviceSubject, rig: Rig) -> None:
    subscription = drum.subscribe(filter_of(["sample"]), 9)
    subscription.take()
    drum.do(command.Move("drum", 1, by=5000.0))
    rig.time.sleep(1.0)
    drum.do(command.StopAxes("drum", 1))
    rig.time.sleep(2.0)
    assert subscription.take().events[-1].payload.to_json() == {"axis": "1", "position": None, "unit": "step", "velocity": 0.0}
