"""What a hand at the machine asks of served MIC488s."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from steptwin.errors import Misuse
from steptwin.files.memory import StateDirectory
from steptwin.live.cell import Cell
from steptwin.live.links import Feed
from steptwin.live.rfc2217 import TwinLine, over_network
from steptwin.machine import MILLISECOND, SECOND, Port
from steptwin.mic488.config import AxisConfig, ControllerConfig
from steptwin.served.demo import demo_config
from steptwin.served.mic488 import LineOptions, Mic488Line
from steptwin.wire.rtu import UART_GAP_NS

Ask = Callable[..., Any]
Run = Callable[..., Any]

ENABLE_M1 = bytes.fromhex("05 07D0 FF00")
SAVE = bytes.fromhex("05 0835 FF00")
LOAD = bytes.fromhex("05 0834 FF00")


@pytest.fixture
def asked(run: Run) -> Callable[..., list[Any]]:
    """``asked(line, request, ...)``: the answers of a line's handlers, one after the other at one moment."""

    def play(line: Mic488Line, *requests: Mapping[str, Any]) -> list[Any]:
        async def scene() -> list[Any]:
            loop: Any = asyncio.get_running_loop()
            cell = Cell(line.kernel, loop.clock())
            handlers = line.handlers(cell)
            answers = [json.loads(json.dumps(handlers[request["do"]](request))) for request in requests]
            cell.close()
            return answers

        return run(scene())

    return play


def line(*units: int, config: ControllerConfig | None = None, demo: bool = False) -> Mic488Line:
    return Mic488Line(config or ControllerConfig(), units or (1,), "1.70", demo=demo)


# ---------------------------------------------------------------------- ports

REQUEST = bytes.fromhex("01 03 27 24 00 02 8E B4")
ANSWER = bytes.fromhex("01 03 04 00 00 00 00 FA 33")
BYTE_LINKS: dict[str, Callable[[Mic488Line], Port]] = {
    "pty": lambda line: line.rtu_port("pty"),
    "serial": lambda line: line.rtu_port("serial", UART_GAP_NS, baud=38400),
    "RTU over TCP": lambda line: line.rtu_client_port(),
    "RFC 2217": lambda line: over_network(line.rtu_client_port(), TwinLine()),
}


def in_pieces(served: Mic488Line, port: Port, pause_ms: int, *pieces: bytes) -> bytes:
    """What comes back when pieces arrive with pauses between them; the shell calls at every deadline."""
    answer, now = b"", served.kernel.now
    for piece in pieces:
        answer += port.exchange(piece, now)
        end = now + pause_ms * MILLISECOND
        while (due := port.deadline()) is not None and due < end:
            answer += b"".join(data for _, data in port.to_send(due))
        now = end
        served.kernel.advance(now)
    return answer


@pytest.mark.parametrize("pause_ms", [40, 50, 200, 1000])
@pytest.mark.parametrize("link", BYTE_LINKS)
def test_mic_15_a_request_in_pieces_is_answered_on_every_byte_transport(link: str, pause_ms: int) -> None:
    served = line()
    port = BYTE_LINKS[link](served)
    assert in_pieces(served, port, pause_ms, REQUEST[:3], REQUEST[3:6], REQUEST[6:]) == ANSWER
    (event,) = served.devices[1].events
    assert event.code == "frame-pause"
    assert event.text.startswith(f"a request had a pause of {pause_ms if link != 'serial' else pause_ms - 0.521:.1f} ms inside")


def test_mic_15_a_broadcast_with_a_pause_is_an_event_of_every_unit() -> None:
    served = line(1, 2)
    port = served.rtu_port("pty")
    write = bytes.fromhex("00 06 00 05 00 63 D8 33")
    assert in_pieces(served, port, 2, write[:4], write[4:]) == b""
    assert [[event.code for event in device.events] for device in served.devices.values()] == [["frame-pause"]] * 2


@pytest.mark.parametrize("strict", [False, True])
def test_mic_15_strict_timing_drops_a_request_that_pauses(strict: bool) -> None:
    served = Mic488Line(ControllerConfig(), (1,), "1.70", options=LineOptions(timing=True, strict=strict))
    port = served.rtu_port("pty")
    assert in_pieces(served, port, 50, REQUEST[:3], REQUEST[3:], b"") == (b"" if strict else ANSWER)
    assert in_pieces(served, port, 50, REQUEST, b"") == ANSWER


def test_mic_32_with_real_timing_modbus_tcp_is_a_gateway_to_the_same_controllers() -> None:
    served = Mic488Line(ControllerConfig(), (1,), "1.70", options=LineOptions(timing=True))
    rtu, tcp = served.rtu_port("pty"), served.tcp_port()
    tcp.exchange(bytes.fromhex("000100000006010327240002"), 0)
    assert tcp.deadline() == 2_083_334
    tcp.to_send(2_083_334)
    # While the gateway's response is on its way the controller hears nobody.
    rtu.exchange(REQUEST, 2_083_334)
    assert in_pieces(served, rtu, 100, b"") == b""
    assert [data for _, data in tcp.to_send(served.kernel.now)] == [bytes.fromhex("00010000000701030400000000")]


def test_requests_that_wait_for_the_line_end_with_their_connection(run: Run) -> None:
    """Whatever still holds the connection's objects."""

    async def scene() -> list[int]:
        loop: Any = asyncio.get_running_loop()
        served = Mic488Line(ControllerConfig(), (1,), "1.70", options=LineOptions(timing=True))
        cell = Cell(served.kernel, loop.clock())
        feeds = [Feed(cell, served.tcp_port(), Deaf()) for _ in range(2)]
        for number in range(8):
            feeds[0].take(bytes((0, number, 0, 0, 0, 6, 1, 6, 0, number, 0, 1)))
        await asyncio.sleep(0.0255)
        feeds[0].close()
        await asyncio.sleep(10)
        feeds[1].take(bytes.fromhex("000100000006010300000001"))
        await asyncio.sleep(10)
        feeds[1].close()
        cell.close()
        return list(served.devices[1].user[:8])

    assert run(scene()) == [1, 1, 1, 0, 0, 0, 0, 0]


class Deaf:
    def write(self, data: bytes) -> None:
        """To nobody."""


# ---------------------------------------------------------------------- pins


def test_pins_are_shown_and_set(asked: Ask) -> None:
    before, after = asked(line(), {"do": "pin"}, {"do": "pin", "set": {"in3": 1, "AIN1": 4.2}})
    assert len(before) == 20 + 2 + 8 + 4 + 1
    assert {name for name, value in before.items() if value} == set()
    assert {name: value for name, value in after.items() if value} == {"IN3": 1.0, "AIN1": 4.2}


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"IN1": 1, "IN21": 1}, "no input pin 'IN21': inputs are IN1 to IN20 and AIN1 to AIN2"),
        ({"IN1": 1, "OUT1": 1}, "no input pin 'OUT1': inputs are IN1 to IN20 and AIN1 to AIN2"),
        ({"IN1": 1, "IN2": 0.5}, "IN2 = 0.5: a digital input is 0 or 1"),
        ({"IN1": 1, "AIN1": 10.5}, "AIN1 = 10.5 V: an analog input takes 0 to 10 V"),
        ({"IN1": 1, "AIN1": float("nan")}, "AIN1 = nan V: an analog input takes 0 to 10 V"),
        ({"IN1": 1, "AIN1": "high"}, "AIN1 = 'high': a pin takes a number"),
        ([1], '"set" = [1]: expected {NAME: VALUE, ...}'),
    ],
)
def test_all_pins_are_set_or_none(asked: Ask, changes: object, text: str) -> None:
    served = line()
    with pytest.raises(Misuse) as refusal:
        asked(served, {"do": "pin", "set": changes})
    assert str(refusal.value) == text
    assert served.devices[1].pins()["IN1"] == 0.0


# ---------------------------------------------------------------------- encoders


def test_shafts_are_turned_and_coupled(asked: Ask) -> None:
    _, shafts = asked(line(), {"do": "encoder", "set": {"2": 40}}, {"do": "encoder", "set": {"2": -7, "3": "blocked"}})
    assert shafts == [
        {"axis": 1, "counts": 0, "turned_by": "drive"},
        {"axis": 2, "counts": 33, "turned_by": "drive"},
        {"axis": 3, "counts": 0, "turned_by": "blocked"},
        {"axis": 4, "counts": 0, "turned_by": "drive"},
    ]


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"1": 5, "5": 1}, "no axis '5': axes are numbered 1 to 4"),
        ({"1": 5, "x": 1}, "no axis 'x': axes are numbered 1 to 4"),
        ({"1": 5, "2": "wind"}, "M2 = 'wind': an encoder is turned by drive, free, blocked, or by +N or -N counts"),
        ({"1": 5, "2": None}, "M2 = None: an encoder is turned by drive, free, blocked, or by +N or -N counts"),
    ],
)
def test_all_shafts_are_turned_or_none(asked: Ask, changes: object, text: str) -> None:
    served = line()
    with pytest.raises(Misuse) as refusal:
        asked(served, {"do": "encoder", "set": changes})
    assert str(refusal.value) == text
    assert served.devices[1].axes[0].encoder_counts(0) == 0


# ---------------------------------------------------------------------- state and power


def test_the_state_is_plain_data_in_configured_units(asked: Ask) -> None:
    config = ControllerConfig(axes=(AxisConfig(unit=3, gear=100.0, acc=100.0, dec=100.0, vel=50.0), *(AxisConfig(),) * 3))
    served = line(config=config)
    device = served.devices[1]
    device.execute(ENABLE_M1, 0)
    device.axes[0].move_to(10_000, 0)
    device.touch()
    served.kernel.advance(SECOND)
    (shown,) = asked_at(served, 1)
    assert shown["axes"][0] == {
        "axis": 1,
        "enabled": True,
        "status": 3,
        "status_text": "moving to position",
        "unit": "mm",
        "position": 37.5,
        "velocity": 50.0,
        "position_pulses": 3750,
        "encoder_counts": 3750 * 400 // 3200,
    }
    assert (shown["time_s"], shown["firmware"], shown["status"]) == (1.0, "1.70", 0)
    assert shown["program"] == {"state": "stopped", "program_bank": 0, "position_bank": 0}
    assert (shown["data_type"], shown["axis_control_mode"], shown["user_registers"]) == ("REAL", "DIRECT", {})
    assert shown["pins"]["M1_EN"] == 1.0


def asked_at(served: Mic488Line, unit: int) -> list[Any]:
    from steptwin.served.mic488 import state_of

    return [json.loads(json.dumps(state_of(served.devices[unit], served.kernel.now)))]


def test_a_power_cycle_switches_drives_off(asked: Ask) -> None:
    served = line()
    served.devices[1].execute(ENABLE_M1, 0)
    state, nothing, after = asked(served, {"do": "state"}, {"do": "power-cycle"}, {"do": "state"})
    assert state["axes"][0]["status"] == 1
    assert nothing is None
    assert after["axes"][0]["status"] == 0


# ---------------------------------------------------------------------- several units


def test_each_unit_is_a_controller_of_its_own(asked: Ask) -> None:
    served = line(1, 2, 5)
    asked(served, {"do": "pin", "unit": 5, "set": {"IN1": 1}})
    assert [device.pins()["IN1"] for device in served.devices.values()] == [0.0, 0.0, 1.0]
    assert served.title == "MIC488 firmware 1.70, units 1, 2, 5"


@pytest.mark.parametrize(
    ("units", "unit", "text"),
    [
        ((1, 2), None, "several units are served: choose one with --unit: 1, 2"),
        ((1, 2), 3, "no unit 3: served are 1, 2"),
        ((1,), [1], "no unit [1]: served are 1"),
        ((1,), "1", "no unit 1: served are 1"),
    ],
)
def test_the_unit_must_be_served(asked: Ask, units: tuple[int, ...], unit: object, text: str) -> None:
    with pytest.raises(Misuse) as refusal:
        asked(line(*units), {"do": "state", "unit": unit})
    assert str(refusal.value) == text


def test_events_name_their_unit_where_there_are_several() -> None:
    told: list[str] = []
    for served in (line(1), line(1, 2)):
        served.watch_events(lambda unit, event, served=served: told.append(served.told(unit, event)))
        served.devices[1].execute(bytes.fromhex("10 2764 0002 04 0000 42C8"), 0)
    assert told == ["position command ignored: M1 is not enabled", "unit 1: position command ignored: M1 is not enabled"]


# ---------------------------------------------------------------------- memory


def test_each_unit_has_a_memory_of_its_own_in_the_state_directory(tmp_path: Path) -> None:
    config = ControllerConfig()
    with StateDirectory(tmp_path) as state:
        served = Mic488Line(config, (1, 2), "1.70", state=state)
        for unit in (1, 2):
            served.devices[unit].execute(bytes.fromhex("06 03E8") + unit.to_bytes(2, "big"), 0)
            assert served.devices[unit].execute(SAVE, 0) == SAVE
    with StateDirectory(tmp_path) as state:
        served = Mic488Line(config, (1, 2), "1.70", state=state)
        for unit in (1, 2):
            device = served.devices[unit]
            assert device.user[1000] == 0
            device.execute(LOAD, 0)
            assert device.user[1000] == unit


def test_a_save_the_disk_refuses_is_exception_04_and_an_event(tmp_path: Path) -> None:
    with StateDirectory(tmp_path) as state:
        served = Mic488Line(ControllerConfig(), (1,), "1.70", state=state)
        told: list[str] = []
        served.watch_events(lambda unit, event: told.append(event.text))
        (tmp_path / "mic488-1-user-registers.tmp").mkdir()
        assert served.devices[1].execute(SAVE, 0) == bytes.fromhex("85 04")
    assert told == [f"mic488-1-user-registers cannot be saved in {tmp_path}: Is a directory"]


# ---------------------------------------------------------------------- demo


def test_the_demo_is_four_spindles_with_a_switch_at_each_end() -> None:
    served = line(config=demo_config(), demo=True)
    device = served.devices[1]
    for axis, target_p in zip(device.axes, (-2000, -2000, 30_000, 30_000), strict=True):
        axis.enable(0)
        axis.move_to(target_p, 0)
    device.touch()
    served.kernel.advance(60 * SECOND)
    assert [(int(axis.status), axis.coordinate_p(served.kernel.now)) for axis in device.axes] == [
        (9, -1000),
        (9, -1000),
        (10, 25_000),
        (10, 25_000),
    ]
    on = [name for name, value in device.pins().items() if value and name.startswith("IN")]
    assert on == ["IN1", "IN2", "IN7", "IN8"]
