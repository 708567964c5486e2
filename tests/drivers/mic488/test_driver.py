"""The controller as a whole: opening, the status in four frames, registers by name and raw, units by GEAR, frames in words."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from host_rig import MemoryEndpoint, Wire, async_driver, driver, run_virtual, spindles, task_line, thread_line
from mic488_rig import loaded

from steptwin.controller import SECOND
from steptwin.drivers import (
    AsyncMic488,
    Mic488,
    ModbusLine,
    ModbusRefusal,
    NotReady,
    ProgramState,
    Unconfirmed,
    load_config,
)
from steptwin.drivers.blocking import finish
from steptwin.drivers.exchange import Overtaken, SentLate
from steptwin.drivers.lineaddress import LineAddress
from steptwin.drivers.mic488.frames import FrameLog
from steptwin.drivers.mic488.lines import ThreadModbusLine, modbus_exchanger
from steptwin.drivers.modbus import ModbusQuery
from steptwin.errors import Misuse
from steptwin.mic488.config import ControllerConfig
from steptwin.mic488.registermap import DataType
from steptwin.mic488.registers import register_map
from steptwin.wire import pdu, rtu
from steptwin.wire.pdu import BitsResponse, ReadRequest, WriteCoilRequest, WriteRegistersRequest
from steptwin.wire.slave import FrameDirection

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


@pytest.mark.parametrize("firmware", ["1.23", "1.40", "1.70"])
def test_a_status_takes_four_frames(firmware: str) -> None:
    wire = Wire(firmware=firmware)
    mic = driver(wire)
    mic.enable(1, 2)
    mic.set_output(3, True)
    mic.axis(1).move_velocity(5.0)
    wire.sleep(2.0)
    wire.twin.set_pin("IN12", 1.0, wire.now)
    wire.sleep(0.1)
    wire.sent.clear()
    status = mic.status()
    assert len(wire.sent) == 4
    assert status.velocities == (5.0, 0.0, 0.0, 0.0)
    assert status.positions[0] == pytest.approx(wire.position() / 100, abs=0.2)
    assert status.units == ("mm",) * 4
    assert status.axes == (2, 1, 0, 0)
    assert [number for number, on in enumerate(status.inputs, start=1) if on] == [12]
    assert [number for number, on in enumerate(status.outputs, start=1) if on] == [3]
    assert status.controller == (0 if firmware == "1.70" else None)
    assert status.program == ProgramState.STOPPED


def test_a_hundred_frames_a_second_at_most() -> None:
    wire = Wire()
    mic = driver(wire)
    wire.sent.clear()
    begin = wire.now
    for _ in range(50):
        mic.status()
    assert len(wire.sent) <= (wire.now - begin) / SECOND * 100 + 1


# ---------------------------------------------------------------------- DATA_TYPE


def dint(wire: Wire) -> None:
    wire.twin.data_type = DataType.DINT


def test_data_type_is_set_to_real_when_the_driver_opens(caplog: pytest.LogCaptureFixture) -> None:
    wire = Wire()
    dint(wire)
    driver(wire)
    assert wire.twin.data_type == DataType.REAL
    assert "unit 1: DATA_TYPE was DINT and is set to REAL" in caplog.text


def test_who_only_looks_changes_nothing_and_reads_units_by_gear() -> None:
    wire = Wire()
    dint(wire)
    wire.twin.axes[0].set_coordinate(1234, wire.now)
    mic = driver(wire, observe=True)
    assert wire.twin.data_type == DataType.DINT
    assert mic.get_shown("M1_POS_ACT") == {"M1_POS_ACT": (12.34, "mm")}
    assert mic.status().positions[0] == 12.34
    bare = driver(wire, observe=True, config=None)
    assert bare.get_shown("M1_POS_ACT") == {"M1_POS_ACT": (1234, "imp")}
    assert bare.status().units[0] == "imp"


def test_with_dint_motions_need_gear() -> None:
    wire = Wire()
    dint(wire)
    mic = driver(wire, observe=True)
    mic.enable()
    mic.axis(1).move_to(3.0)
    assert mic.axis(1).wait().position_u == 3.0
    assert wire.position() == 300
    bare = driver(wire, observe=True, config=None)
    with pytest.raises(NotReady, match="M1_POS_ABS takes pulses, and GEAR is not known: give the configuration"):
        bare.axis(1).move_to(5.0)
    assert wire.position() == 300


def test_gear_and_units_of_a_twin_need_no_file() -> None:
    wire = Wire()
    dint(wire)
    mic = driver(wire, observe=True, config=None, scales=[("mm", 100.0), ("degree", 2.5), ("imp", 1.0), ("mm", 100.0)])
    assert [mic.axis(n).unit for n in (1, 2, 3)] == ["mm", "degree", "imp"]
    mic.enable(1)
    mic.axis(1).move_to(3.0)
    assert str(mic.axis(1).wait()) == "M1: target reached at 3 mm"
    assert wire.position() == 300


def test_gear_and_units_come_from_the_vendors_file(tmp_path: Path) -> None:
    path = tmp_path / "machine.cfg"
    path.write_text(CFG)
    assert load_config(path).axes[1].gear == 2.5
    mic = driver(Wire(), config=str(path))
    assert [mic.axis(n).unit for n in (1, 2, 3)] == ["mm", "degree", "imp"]
    with pytest.raises(Misuse, match=r"cannot read .*none.cfg: no such file"):
        load_config(tmp_path / "none.cfg")
    path.write_text("[Axis0]\nGear=much\n")
    with pytest.raises(Misuse, match="Gear"):
        driver(Wire(), config=path)


# ---------------------------------------------------------------------- by name and raw


def test_registers_by_name() -> None:
    wire = Wire()
    mic = driver(wire)
    mic.set("M2_ACC", 12.5)
    mic.set("OUT5", 1)
    mic.set("USER_REGISTER[10]:real", 1.5)
    mic.set("USER_REGISTER[12]", 7)
    names = ("M2_ACC", "OUT5", "USER_REGISTER[10]:real", "USER_REGISTER[12]", "m_status")
    wire.sent.clear()
    assert mic.get(*names) == dict(zip(names, (12.5, True, 1.5, 7, 0), strict=True))
    # ControlRegisters registers; axes; user registers; outputs.
    assert len(wire.sent) <= 5
    assert mic.get_shown("M2_ACC", "OUT5") == {"M2_ACC": (12.5, "mm/s²"), "OUT5": (True, "")}


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("M1_POS_AKT", 1, "M1_POS_AKT"),
        ("IN3", 1, "IN3 can only be read"),
        ("OUT3", 2, r"OUT3 = 2: permitted are 0 \(OFF\) and 1 \(ON\)"),
        ("PROGRAM_CTRL", 9, "PROGRAM_CTRL = 9: permitted"),
        ("USER_REGISTER[3]:real", 1, "REALs begin at even registers"),
        ("USER_REGISTER[9999]", 1, "user register 9999 as WORD is outside 0 to"),
        ("USER_REGISTER", 1, r"choose one of USER_REGISTER\[0\] to"),
        ("USER_REGISTER[1]", 70000, "permitted 0…65535"),
        ("M1_EN[2]", 1, "M1_EN is one value of type BIT"),
        ("?", 1, "is not a name of a value"),
    ],
)
def test_what_cannot_be_written_is_refused_before_it_is_sent(name: str, value: float, text: str) -> None:
    wire = Wire()
    mic = driver(wire)
    wire.sent.clear()
    with pytest.raises(Misuse, match=text):
        mic.set(name, value)
    assert [frame[1] for _, frame in wire.sent] in ([], [3])


def test_raw_access() -> None:
    wire = Wire()
    mic = driver(wire)
    wire.twin.user[5] = 77
    assert mic.registers(5, 2) == (77, 0)
    assert mic.request(WriteCoilRequest(6001, True)) == WriteCoilRequest(6001, True)
    assert mic.request(ReadRequest(1, 6000, 3)) == BitsResponse(1, b"\2")
    with pytest.raises(
        ModbusRefusal, match=r"unit 1: read .*was refused: the controller does not have this register.*exception 02"
    ) as caught:
        mic.registers(9000, 2)
    assert caught.value.code == 2


def test_the_program() -> None:
    mic = driver(Wire())
    mic.program.select(2, 1)
    assert mic.get("PROG_BANK_SEL", "POS_BANK_SEL") == {"PROG_BANK_SEL": 2, "POS_BANK_SEL": 1}
    assert mic.program.state() is ProgramState.STOPPED
    mic.program.stop()
    with pytest.raises(Misuse, match="PROG_BANK_SEL = 99"):
        mic.program.select(99)


# ---------------------------------------------------------------------- frames in words


@pytest.mark.parametrize("tcp", [False, True])
def test_every_frame_is_logged_in_words(tcp: bool) -> None:
    log: list[str] = []
    wire = Wire(tcp=tcp)
    mic = driver(wire, log=log)
    mic.enable(1)
    mic.axis(1).move_to(12.0)
    mic.axis(1).position()
    assert len(log) == 2 * len(wire.sent)
    text = "\n".join(log)
    assert "unit 1: write M1_POS_ABS = 12 mm" in text
    assert "unit 1: write M_ENABLE = M1" in text or "unit 1: write M_ENABLE" in text
    assert "M1_POS_ACT = " in text


def test_who_is_what() -> None:
    mic = driver(Wire())
    assert repr(mic) == "<Mic488 unit 1 on memory, firmware 1.70>"
    assert (mic.place, mic.unit, mic.firmware, mic.config) == ("memory", 1, "1.70", spindles())
    with pytest.raises(Misuse, match="unit 0 is outside 1 to 247"):
        Mic488(thread_line(Wire()), 0)
    with pytest.raises(Misuse, match="unit 256 is outside 0 to 255"):
        Mic488(thread_line(Wire(tcp=True)), 256)
    assert [Mic488(thread_line(Wire(tcp=True)), unit).unit for unit in (0, 255)] == [0, 255]
    with pytest.raises(Misuse, match="a time-out of 0 s is outside"):
        Mic488(thread_line(Wire()), timeout_s=0.0)
    assert driver(Wire(config=ControllerConfig()), config=None).config is None


@pytest.mark.parametrize("axis", [1, 2, 3, 4])
def test_a_stop_of_any_axis_overtakes_the_start_of_the_program(axis: int) -> None:
    """A program moves whatever it likes."""
    wire = Wire()
    mic = driver(wire)
    shared = mic._driver._unit.shared

    def now() -> int:
        shared.stops[axis] = 1  # of another thread, right after the call
        return wire.now

    mic._driver.line.now = now  # type: ignore[method-assign]
    sent = len(wire.sent)
    with pytest.raises(Overtaken, match="a stop was requested meanwhile"):
        mic.program.start()
    assert len(wire.sent) == sent


def test_a_running_program_is_paused_before_what_waits_and_ended_by_a_stop() -> None:
    wire = Wire()
    twin = wire.twin
    mic = driver(wire)
    asked: list[tuple[object, bool, int | None]] = []
    unit = mic._driver._unit
    inner = unit.write

    async def write(item: object, value: object, **options: Any) -> None:
        asked.append((value, options.get("urgent", False), options.get("most_attempts")))
        await inner(item, value, **options)  # type: ignore[arg-type]

    unit.write = write  # type: ignore[method-assign]
    stops = list(unit.shared.stops)
    mic.program.pause()
    mic.program.stop()
    assert asked == [(ProgramState.PAUSED, True, 5), (ProgramState.STOPPED, True, 5)]
    counted = [after - before for after, before in zip(unit.shared.stops, stops, strict=True)]
    assert counted == [2, 0, 0, 0, 0]
    assert twin.program.state == ProgramState.STOPPED
    wire.severed = True
    with pytest.raises(Unconfirmed, match="the program could not be stopped: the controller cannot be reached"):
        mic.program.stop()
    with pytest.raises(Unconfirmed, match="the program could not be paused: the controller cannot be reached"):
        mic.program.pause()


# ---------------------------------------------------------------------- stops


def moving() -> tuple[Wire, Mic488]:
    """M1 runs at JOG_SPEED, by its coil."""
    wire = Wire()
    wire.twin.program.banks.programs[0], _ = loaded("MAIN:\nDELAY 0.1\nJUMP MAIN\n")
    mic = driver(wire)
    mic.enable(1)
    mic.set_jog_speed(5.0)
    mic.axis(1).jog_bit(1, True)
    return wire, mic


STOPS = (("M1_STOP", 1), ("M_STOP", 1), ("M1_JOG_PLUS", 0), ("M1_JOG_MINUS", 0), ("PROGRAM_CTRL", 0), ("PROGRAM_CTRL", 2))


@pytest.mark.parametrize(("name", "value"), STOPS)
def test_what_stops_is_written_by_name_and_what_is_behind_it_in_the_same_write(name: str, value: float) -> None:
    """It does not refuse itself, nor what follows."""
    wire, mic = moving()
    mic.program.start()
    mic.set(name, value)
    wire.rest(1.0)
    assert wire.moving() is ((name, value) in (("M1_JOG_MINUS", 0), ("PROGRAM_CTRL", 2)))
    states: dict[tuple[str, float], ProgramState] = {
        ("PROGRAM_CTRL", 0): ProgramState.STOPPED,
        ("PROGRAM_CTRL", 2): ProgramState.PAUSED,
    }
    assert wire.twin.program.state is states.get((name, value), ProgramState.RUNNING)
    mic.stop_all()
    there = mic.axis(1).position()
    finish(mic._driver.set_all((name, value), ("M1_EN", 1), ("M1_POS_REL", 5.0)))
    wire.rest(5.0)
    assert mic.axis(1).position() == pytest.approx(there + 5.0)


def test_a_stop_of_another_client_between_own_stops_refuses_the_rest() -> None:
    wire, mic = moving()
    shared = mic._driver._unit.shared

    def stop(_: bytes) -> None:
        wire.before_each = None
        shared.stops[1] += 1

    wire.before_each = stop
    with pytest.raises(Overtaken):
        finish(mic._driver.set_all(("M_STOP", 1), ("M1_POS_REL", 5.0)))


ENDS: dict[str, Callable[[AsyncMic488], Awaitable[Any]]] = {
    "axis": lambda mic: mic.axis(1).stop(),
    "axis switched off": lambda mic: mic.axis(1).disable(),
    "all": lambda mic: mic.stop_all(),
    "all switched off": lambda mic: mic.disable(),
    "halt": lambda mic: mic.halt(),
    "program paused": lambda mic: mic.program.pause(),
    "program stopped": lambda mic: mic.program.stop(),
    "by name": lambda mic: mic.set("M1_STOP", 1),
    "raw": lambda mic: mic.request(WriteRegistersRequest(register_map("1.70").of("M_STOP").address, (1,))),
}


MOTIONS: tuple[Callable[[AsyncMic488], Awaitable[Any]], ...] = (
    lambda mic: mic.axis(1).move_to(200.0),
    lambda mic: mic.set("M1_POS_ABS", 200.0),
    lambda mic: mic.request(WriteRegistersRequest(register_map("1.70").of("POS_ABS", 1).address, (0, 0))),
    lambda mic: mic.program.start(),
)


@pytest.mark.parametrize("how", ENDS)
def test_what_is_asked_for_while_a_stop_is_unanswered_is_refused(how: str) -> None:
    wire = Wire()

    async def story() -> None:
        async with async_driver(task_line(wire), wire) as mic:
            for motion in MOTIONS:
                await mic.enable(1)
                stop = asyncio.ensure_future(ENDS[how](mic))
                await asyncio.sleep(0.0)
                assert not stop.done()
                with pytest.raises((Overtaken, NotReady)):  # the drive may be off already
                    await motion(mic)
                await stop

    run_virtual(wire, story())


def test_a_program_that_may_have_been_started_too_late_is_paused_and_its_axes_are_stopped_in_any_case() -> None:
    wire, mic = moving()
    unit = mic._driver._unit

    async def late() -> None:
        async with unit.stopping_if_late(1, program=True):
            raise SentLate("the start", SECOND)

    with pytest.raises(SentLate):
        finish(late())
    wire.rest(1.0)
    assert not wire.moving()
    mic.axis(1).jog_bit(1, True)
    program_ctrl = register_map("1.70").of("PROGRAM_CTRL").address.to_bytes(2, "big")

    def lose_pauses(frame: bytes) -> None:
        wire.severed = frame[2:4] == program_ctrl

    wire.before_each = lose_pauses
    with pytest.raises(Unconfirmed, match="a request was sent too late, and the program could not be paused"):
        finish(late())
    wire.rest(1.0)
    assert not wire.moving()


@pytest.mark.parametrize(("lost", "is_confirmed"), [(0, True), (1, True), (4, True), (5, False)])
def test_a_halt_pauses_the_program_although_frames_are_lost(lost: int, is_confirmed: bool) -> None:
    wire, mic = moving()
    mic.program.start()
    m_stop, program_ctrl = (register_map("1.70").of(key).address.to_bytes(2, "big") for key in ("M_STOP", "PROGRAM_CTRL"))
    seen: list[bytes] = []

    def lose(frame: bytes) -> None:
        seen.append(frame[2:4])
        is_pause = frame[1] == 6 and frame[2:4] == program_ctrl
        wire.severed = is_pause and seen.count(program_ctrl) <= lost

    wire.before_each = lose
    if is_confirmed:
        mic.halt()
        assert wire.twin.program.state is ProgramState.PAUSED
    else:
        with pytest.raises(Unconfirmed, match="the program could not be paused"):
            mic.halt()
    assert seen.count(m_stop) == 2


@pytest.mark.parametrize(("timeout_s", "patience_s"), [(0.3, 5.0), (0.8, 5.0), (1.0, 6.0), (2.0, 12.0)])
def test_what_moves_is_sent_within_5_s_or_twice_the_time_of_its_tries(timeout_s: float, patience_s: float) -> None:
    """Of a driver that tries three times."""
    unit = driver(Wire(), timeout_s=timeout_s)._driver._unit
    assert unit.tries == 3
    assert unit.permission(1).patience_ns == patience_s * SECOND
    assert unit.permission(1, patience_ns=7).patience_ns == 7
    stopped, other = unit.permission(1, 3), unit.permission(2)
    unit.shared.stops[3] += 1
    assert (stopped.is_stopped(), other.is_stopped()) == (True, False)


def test_the_face_for_threads_passes_all_its_arguments_on() -> None:
    said: list[str] = []
    config = spindles()
    mic = Mic488("/dev/none", 7, baud=9600, firmware="1.40", config=config, timeout_s=0.75, observe=True, log=said.append)
    driver = mic._driver
    assert (mic.unit, mic.place, mic.firmware, mic.config) == (7, "/dev/none", "1.40", config)
    assert (driver._unit.timeout_ns, driver._observe) == (750_000_000, True)
    assert isinstance(driver.line, ThreadModbusLine)
    discipline = driver.line._engine.discipline
    # 8 characters of 11 bits there and 7 back: gap and time on the wire are those of the baud rate.
    assert discipline.allowance_ns(ModbusQuery(7, pdu.ReadRequest(3, 0, 1))) == pytest.approx(15 * 10 * SECOND / 9600, rel=0.11)
    discipline.start(ModbusQuery(7, pdu.ReadRequest(3, 10000, 1)), 0, urgent=False)
    assert len(said) == 1
    assert said[0].endswith("unit 7: read DATA_TYPE")


def test_frames_are_put_into_words_only_for_a_log() -> None:
    for log, is_observed in ((lambda _: None, True), (None, False)):
        line: Any = Mic488("tcp://127.0.0.1:5020", log=log)._driver.line
        assert (line._engine.discipline.on_frame is not None) is is_observed


@pytest.mark.parametrize("frames_per_second", [0.0, -1.0])
def test_a_pace_is_above_0(frames_per_second: float) -> None:
    with pytest.raises(Misuse, match="frames per second: must be above 0"):
        ModbusLine("tcp://127.0.0.1:5020", frames_per_second=frames_per_second)


def test_a_data_type_that_no_mic488_has_is_told() -> None:
    wire = Wire()
    wire.severed = True

    def reply(frame: bytes) -> None:
        count = int.from_bytes(frame[4:6], "big")
        wire.inject(rtu.encode_frame(1, bytes((3, 2 * count, 0, 7, *bytes(2 * count - 2)))), after=wire.latency)

    wire.before_each = reply
    with pytest.raises(NotReady, match="memory: unit 1 reads DATA_TYPE = 7, which is not a value of a MIC488"):
        driver(wire)


def test_a_jog_that_is_released_too_late_does_not_stop_what_another_master_moves() -> None:
    wire = Wire()
    mic = driver(wire)
    mic.enable(1)
    jog = mic.axis(1).jog(5.0)
    jog.__enter__()
    wire.sleep(5.0)
    target = register_map("1.70").of("POS_ABS", 1).address
    wire.twin.execute(pdu.encode_request(pdu.WriteRegistersRequest(target, (0, 0x41A0))), wire.now)
    jog.release()
    assert str(jog.end).startswith("M1: not held (5.")
    wire.rest()
    assert wire.position() == 2000


@pytest.mark.parametrize("output", [1, 8])
def test_outputs_from_the_first_to_the_last(output: int) -> None:
    wire = Wire()
    mic = driver(wire)
    mic.set_output(output, True)
    assert [number for number, on in enumerate(wire.twin.outputs, start=1) if on] == [output]
    assert mic.outputs()[output - 1]
    with pytest.raises(Misuse, match="9"):
        mic.set_output(9, True)
    with pytest.raises(Misuse, match="0"):
        mic.set_output(0, True)


@pytest.mark.parametrize("timeout_s", [0.0, -1.0, 60.5])
def test_time_outs_have_bounds(timeout_s: float) -> None:
    with pytest.raises(Misuse, match=f"a time-out of {timeout_s:g} s is outside 0 to 60 s"):
        Mic488("/dev/none", timeout_s=timeout_s)
    Mic488("/dev/none", timeout_s=60.0)


@pytest.mark.parametrize("framed", [False, True])
def test_frames_in_words_of_both_sorts_of_lines(*, framed: bool) -> None:
    """Read 2 words from 10020; with the address and the CRC of RTU, or the header of Modbus TCP."""
    log: list[str] = []
    _, shared = modbus_exchanger(LineAddress(MemoryEndpoint(Wire()), framed=framed), None, log.append)
    frames = shared["frames"]
    assert isinstance(frames, FrameLog)
    request = bytes.fromhex("03 27 24 00 02")
    frame = bytes.fromhex("00 01 00 00 00 06 01") + request if framed else rtu.encode_frame(1, request)
    frames.observe(0, FrameDirection.IN, frame)
    assert len(log) == 1
    assert "M1_POS_ACT" in log[0]
