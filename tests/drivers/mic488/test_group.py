"""Axes that begin together, and programs, when the line was busy for too long."""

from __future__ import annotations

import asyncio

import pytest
from host_rig import Fault, Wire, async_driver, driver, run_virtual, task_line

from steptwin.controller import SECOND
from steptwin.drivers import (
    NoAnswer,
    NotReady,
    Overtaken,
    Reason,
    SentLate,
    TooLate,
    Unconfirmed,
)
from steptwin.drivers.exchange import Job
from steptwin.drivers.modbus import ModbusQuery
from steptwin.errors import Misuse
from steptwin.mic488.registermap import DataType
from steptwin.mic488.registers import register_map
from steptwin.mic488.values import encoded, named
from steptwin.wire.pdu import ReadRequest, WriteRegisterRequest

CFG = """[Axis0]
Unit=3
Gear=100
Acc=50
Dec=50
Vel=25
[Axis1]
Unit=2
Gear=2,5
"""


def test_axes_begin_together() -> None:
    wire = Wire()
    mic = driver(wire)
    mic.enable()
    mic.move_together({1: 10.0, 3: 20.0})
    starts = {axis: wire.twin.axes[axis - 1].profile.start for axis in (1, 3)}
    assert starts[1] == starts[3]
    ends = mic.wait(1, 3)
    assert {axis: (end.reason, end.position_u) for axis, end in ends.items()} == {
        1: (Reason.TARGET, 10.0),
        3: (Reason.TARGET, 20.0),
    }
    mic.move_together_by({1: 1.0, 3: -1.0})
    mic.wait()
    mic.run_together({1: 2.0, 3: -2.0})
    wire.sleep(1.0)
    assert mic.status().velocities == (2.0, 0.0, -2.0, 0.0)
    mic.stop_all()
    assert not wire.moving(1)
    assert not wire.moving(3)
    assert wire.twin.trigger_mode == 0
    with pytest.raises(Misuse, match="no axis is given"):
        mic.move_together({})


def test_axes_that_were_stopped_before_they_were_to_begin_leave_no_trace() -> None:
    """Not even the trigger mode is set for them."""
    wire = Wire()
    line = task_line(wire)

    async def main() -> None:
        async with async_driver(line, wire) as mic:
            await mic.enable()
            wire.sent.clear()
            moving = asyncio.create_task(mic.move_together({1: 10.0, 3: 20.0}))
            await asyncio.sleep(0)
            await mic.axis(3).stop()
            with pytest.raises(Overtaken, match=r"AXIS_CTR_MODE = TRIGGER .1.' was not sent: a stop was requested meanwhile"):
                await moving

    run_virtual(wire, main())
    written = [frame for _, frame in wire.sent if frame[1] not in (3, 5)]
    assert written == [ModbusQuery(1, WriteRegisterRequest(10004, 0)).rtu_frame], "direct, to be sure"
    assert not wire.moving(1)


@pytest.mark.parametrize("act", ["set", "request"])
def test_what_may_move_is_not_written_when_the_line_was_busy_for_too_long(act: str) -> None:
    """Another program on the line waits longer than anybody at the machine would; what moves nothing is written nevertheless."""
    wire = Wire()
    mic = driver(wire)
    mic.enable()
    engine = mic._driver.line._engine  # type: ignore[attr-defined]

    def keep_the_line() -> None:
        engine.submit(Job(ModbusQuery(2, ReadRequest(3, 0, 1)), 60 * SECOND))

    request = encoded(named(register_map("1.70"), "M1_VEL_ABS"), 5.0, DataType.REAL)
    keep_the_line()
    with pytest.raises(TooLate, match=r"M1_VEL_ABS.* was not sent: it was requested more than 5 s ago"):
        mic.set("M1_VEL_ABS", 5.0) if act == "set" else mic.request(request)
    assert not wire.moving()
    keep_the_line()
    mic.set("M1_ACC", 7.0)
    assert mic.get("M1_ACC") == {"M1_ACC": 7.0}


def test_no_trigger_mode_is_left_when_its_answer_is_lost() -> None:
    wire = Wire()
    mic = driver(wire)
    mic.enable()
    control = 3 + 2 * 14 + 2
    wire.put(*(Fault("to master", control + lost, "cut") for lost in range(3)))
    with pytest.raises(NoAnswer, match="AXIS_CTR_MODE"):
        mic.move_together({1: 10.0, 3: 20.0})
    assert wire.twin.trigger_mode == 0
    assert not wire.moving(1)


def test_a_program_that_was_started_too_late_is_paused_and_said_to_be_so() -> None:
    """The process is suspended while it writes the frame that starts the program. Its end would switch drives off (MIC-31)."""
    wire = Wire()
    mic = driver(wire)
    start = ModbusQuery(1, WriteRegisterRequest(10003, 1)).rtu_frame

    def suspend(frame: bytes) -> None:
        if frame == start:
            wire.before_each = None
            wire.sleep(70.0)

    wire.before_each = suspend
    with pytest.raises(SentLate, match="was sent more than"):
        mic.program.start()
    pause, stop = ModbusQuery(1, WriteRegisterRequest(10003, 2)), ModbusQuery(1, WriteRegisterRequest(10016, 15))
    assert [frame for _, frame in wire.sent[-2:]] == [pause.rtu_frame, stop.rtu_frame]


def test_a_trigger_mode_that_cannot_be_left_is_told() -> None:
    wire = Wire()
    mic = driver(wire)
    mic.enable()
    back = ModbusQuery(1, WriteRegisterRequest(10004, 0)).rtu_frame

    def cut(frame: bytes) -> None:
        wire.severed = wire.severed or frame == back

    wire.before_each = cut
    with pytest.raises(
        Unconfirmed, match=r"^M1 M3 began to move, but AXIS_CTR_MODE may still be TRIGGER.* \(memory: no answer to"
    ):
        mic.move_together({1: 100.0, 3: 120.0})
    wire.severed, wire.before_each = False, None
    assert (wire.twin.trigger_mode, wire.moving(1), wire.moving(3)) == (1, True, True)
    assert [end.reason for end in mic.wait(1, 3).values()] == [Reason.TARGET] * 2
    with pytest.raises(NotReady, match="TRIGGER mode"):
        mic.axis(1).move_to(1.0)


def test_one_that_fails_ends_the_waiting_for_all() -> None:
    wire = Wire()
    mic = driver(wire)
    mic.enable()
    mic.axis(1).move_to(-20.0)
    mic.axis(2).move_to(200.0)
    ends = mic.wait(1, 2, check=False)
    assert [str(end) for end in ends.values()] == ["M1: stopped at limit L at -10 mm", "M2: target reached at 200 mm"]
