"""The drivers for threads take the arguments of those for asyncio, and leave none out."""

from __future__ import annotations

import inspect
from typing import Any

import pytest
from host_rig import Wire
from line_rig import MemoryEndpoint

from steptwin.controller import MILLISECOND, SECOND
from steptwin.drivers.m1486.driver import AsyncM1486
from steptwin.drivers.m1486.jog import AsyncM1486Jog
from steptwin.drivers.m1486.lines import TALK, AsyncM1486Line, ThreadM1486Line
from steptwin.drivers.m1486.sync import M1486, M1486Jog, M1486Line
from steptwin.drivers.mic488.axis import AsyncMic488Axis
from steptwin.drivers.mic488.driver import AsyncMic488
from steptwin.drivers.mic488.jog import AsyncMic488Jog
from steptwin.drivers.mic488.lines import AsyncModbusLine, ThreadModbusLine
from steptwin.drivers.mic488.sync import Mic488, Mic488Axis, Mic488Jog, ModbusLine
from steptwin.errors import Misuse
from steptwin.mic488.config import ControllerConfig

NOWHERE = "tcp://127.0.0.1:1"
RTU = "rtu-tcp://127.0.0.1:1"


def given(monkeypatch: pytest.MonkeyPatch, kind: type[Any]) -> list[tuple[tuple[Any, ...], dict[str, Any]]]:
    """The arguments with which objects of a class are made from now on."""
    seen: list[tuple[tuple[Any, ...], dict[str, Any]]] = []
    made = kind.__init__

    def note(self: object, *arguments: Any, **named: Any) -> None:
        seen.append((arguments, named))
        made(self, *arguments, **named)

    monkeypatch.setattr(kind, "__init__", note)
    return seen


def test_a_chip_for_threads_takes_all_that_one_for_asyncio_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    seen, lines = given(monkeypatch, AsyncM1486), given(monkeypatch, ThreadM1486Line)
    log: list[str] = []
    options: dict[str, Any] = {
        "baud": 9600, "variant": "C", "steps_per_unit": 12.5, "unit": "mm", "origin_u": 640, "timeout_s": 0.7, "log": log.append,
    }  # fmt: skip
    chip = M1486(NOWHERE, 11, **options)
    assert seen == [((NOWHERE, 11), options)]
    assert lines == [((NOWHERE,), {"baud": 9600, "log": options["log"]})]
    assert (chip.place, chip.address, chip.unit) == (NOWHERE, 11, "mm")
    shared = M1486Line(NOWHERE, baud=2400, log=log.append)
    assert lines[1] == ((NOWHERE,), {"baud": 2400, "log": options["log"]})
    M1486(shared, 3)
    assert seen[1][0] == (shared.line, 3)
    assert shared.place == NOWHERE


def test_a_controller_for_threads_takes_all_that_one_for_asyncio_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    seen, lines = given(monkeypatch, AsyncMic488), given(monkeypatch, ThreadModbusLine)
    log: list[str] = []
    options: dict[str, Any] = {
        "baud": 9600, "firmware": "1.40", "config": ControllerConfig(), "scales": (), "timeout_s": 0.7, "observe": True,
        "log": log.append,
    }  # fmt: skip
    mic = Mic488(RTU, 11, **options)
    assert seen == [((RTU, 11), options)]
    assert lines == [((RTU,), {"baud": 9600, "log": options["log"]})]
    assert (mic.place, mic.unit, mic.firmware, mic.config) == (RTU, 11, "1.40", ControllerConfig())
    shared = ModbusLine(RTU, baud=19200, frames_per_second=20.0, log=log.append)
    assert lines[1] == ((RTU,), {"baud": 19200, "frames_per_second": 20.0, "log": options["log"]})
    Mic488(shared, 3)
    assert seen[1][0] == (shared.line, 3)
    assert (shared.place, [mic.axis(number).number for number in (1, 2, 3, 4)]) == (RTU, [1, 2, 3, 4])
    with pytest.raises(Misuse, match="axis 5"):
        mic.axis(5)


@pytest.mark.parametrize(
    ("threads", "tasks"),
    [
        (Mic488, AsyncMic488),
        (Mic488Axis, AsyncMic488Axis),
        (Mic488Jog, AsyncMic488Jog),
        (M1486, AsyncM1486),
        (M1486Jog, AsyncM1486Jog),
    ],
)
def test_methods_for_threads_have_the_parameters_and_defaults_of_those_for_asyncio(threads: type[Any], tasks: type[Any]) -> None:
    methods = {name: method for name, method in inspect.getmembers(tasks, inspect.isfunction) if not name.startswith("_")}
    both = {name: method for name, method in inspect.getmembers(threads, inspect.isfunction) if name in methods}
    assert both
    for name, method in both.items():
        mine, others = (
            [(one.name, one.kind, one.default) for one in inspect.signature(of).parameters.values()]
            for of in (method, methods[name])
        )
        assert mine == others, name


@pytest.mark.parametrize("kind", [ThreadM1486Line, AsyncM1486Line])
def test_a_line_of_chips_has_its_rate_and_tells_its_characters(kind: type[ThreadM1486Line | AsyncM1486Line]) -> None:
    """Ten bits a character."""
    log: list[str] = []
    line = kind(NOWHERE, baud=1200, log=log.append)
    talk: Any = line.shared[TALK]
    assert talk.wire_ns(12) == pytest.approx(SECOND / 10, abs=20)
    talk.stray(b"\x13u", 0)
    assert [text.split(maxsplit=2)[2] for text in log] == ["← 13 75                     13H u"]


@pytest.mark.parametrize("kind", [ThreadModbusLine, AsyncModbusLine])
def test_a_modbus_line_has_its_pace_and_tells_its_frames(kind: type[ThreadModbusLine | AsyncModbusLine]) -> None:
    log: list[str] = []
    line = kind(RTU, baud=9600, frames_per_second=20.0, log=log.append)
    assert line._engine._interval_ns == 50 * MILLISECOND
    assert (line.shared["tcp"], kind(NOWHERE, frames_per_second=None)._engine._interval_ns) == (False, 0)
    with pytest.raises(Misuse, match=r"^0 frames per second: must be above 0$"):
        kind(NOWHERE, frames_per_second=0.0)
    frames: Any = line.shared["frames"]
    frames.unframed(0, b"\x01\x02")
    assert len(log) == 1


@pytest.mark.parametrize("line", [ModbusLine(NOWHERE), M1486Line(NOWHERE)], ids=["modbus", "chips"])
def test_with_opens_a_line_and_closes_it(line: ModbusLine | M1486Line) -> None:
    wire = Wire()
    line.line._endpoint = endpoint = MemoryEndpoint(wire)
    closed: list[bool] = []
    opens = endpoint.open

    def opened() -> Any:
        channel = opens()
        channel.close = lambda: closed.append(True)
        return channel

    endpoint.open = opened  # type: ignore[method-assign]
    with line as same:
        assert same is line
        assert (wire.opened, closed) == (1, [])
    assert closed == [True]


def test_a_driver_for_asyncio_opens_its_own_line_with_its_baud_rate_and_log(monkeypatch: pytest.MonkeyPatch) -> None:
    log: list[str] = []
    lines = given(monkeypatch, AsyncModbusLine), given(monkeypatch, AsyncM1486Line)
    AsyncMic488("/dev/ttyUSB0", baud=9600, log=log.append)
    AsyncM1486("/dev/ttyUSB0", baud=1200, log=log.append)
    AsyncMic488("/dev/ttyUSB0")
    AsyncM1486("/dev/ttyUSB0")
    assert [[named for _, named in seen] for seen in lines] == [
        [{"baud": 9600, "log": log.append}, {"baud": 38400, "log": None}],
        [{"baud": 1200, "log": log.append}, {"baud": 4800, "log": None}],
    ]
