"""Faults of a served twin, set and removed by requests of the control endpoint, in virtual time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from steptwin.errors import Misuse
from steptwin.live.cell import Cell
from steptwin.live.clock import Clock
from steptwin.mic488.config import ControllerConfig
from steptwin.served.m1486 import ChainOptions, M1486Line
from steptwin.served.mic488 import Mic488Line
from steptwin.world.faults import Line

READ = bytes.fromhex("01 03 00 63 00 01 74 14")
ANSWER = bytes.fromhex("01 03 02 00 00 b8 44")


def mic488(units: tuple[int, ...] = (1,)) -> Mic488Line:
    return Mic488Line(ControllerConfig(), units, "1.70")


def handlers(line: Mic488Line | M1486Line) -> dict[str, Callable[[Any], Any]]:
    return line.handlers(Cell(line.kernel, Clock(wall_ns=lambda: 0)))


def test_requests_set_remove_and_tell(run: Callable[..., Any]) -> None:
    async def talk() -> None:
        line = mic488()
        fault = handlers(line)["fault"]
        told: list[str] = []
        line.faults.tell(told.append)
        port = line.rtu_client_port()
        assert fault({}) == []
        assert port.exchange(READ, 0) == ANSWER
        (shown,) = fault({"set": ["busy nth=2"]})
        assert shown == {"name": "busy", "fault": "busy nth=2", "seen": 0, "happened": 0}
        assert port.exchange(READ, 0) == ANSWER
        assert port.exchange(READ, 0)[:3] == b"\x01\x83\x06"
        assert line.rtu_client_port().exchange(READ, 0) == ANSWER
        assert told == ["fault busy, 1: refused with exception 06: 03 00 63 00 01"]
        assert [f["name"] for f in fault({"set": ["crc", "echo"], "clear": ["busy"]})] == ["crc", "echo"]
        assert port.exchange(READ, 0)[:8] == READ
        assert fault({"clear": True}) == []
        assert port.exchange(READ, 0) == ANSWER

    run(talk())


def test_a_request_that_cannot_be_done_changes_nothing(run: Callable[..., Any]) -> None:
    async def talk() -> None:
        fault = handlers(mic488())["fault"]
        fault({"set": ["crc"]})
        for request in (
            {"set": ["busy", "bang"]},
            {"set": ["busy", "crc unit=5"]},
            {"set": ["busy"], "clear": ["x"]},
            {"set": 3},
        ):
            with pytest.raises(Misuse):
                fault(request)
        assert [f["name"] for f in fault({})] == ["crc"]

    run(talk())


def test_a_hand_reaches_the_inputs_before_a_switch_that_is_stuck(run: Callable[..., Any]) -> None:
    async def talk() -> None:
        for line, pin in ((mic488(), "IN3"), (M1486Line(ChainOptions()), "B3")):
            requests = handlers(line)
            before = requests["pin"]({})[pin]
            requests["fault"]({"set": [f"stuck pin={pin}"]})
            assert requests["pin"]({"set": {pin: 1 - before}})[pin] == before
            requests["fault"]({"clear": True})
            assert requests["pin"]({})[pin] == 1 - before

    run(talk())


@pytest.mark.parametrize(
    ("fault", "text"),
    [
        ("crc unit=3", "fault crc: unit = 3: served are 1, 2"),
        ("slip", "fault slip: choose a machine: there are 1, 2"),
        ("stall machine=2 axis=9", "fault stall: axis = 9: permitted are 1 to 4"),
        ("flip", "fault flip happens on Modbus RTU and M1486: this twin serves Modbus TCP"),
    ],
)
def test_what_a_twin_does_not_have_cannot_go_wrong(fault: str, text: str) -> None:
    line = mic488((1, 2))
    line.faults.lines = {Line.TCP} if fault == "flip" else {Line.RTU}
    with pytest.raises(Misuse) as refused:
        line.faults.start([fault], 0)
    assert str(refused.value).startswith(text)


def test_chips_have_no_units_and_no_shafts() -> None:
    line = M1486Line(ChainOptions())
    for fault, text in (("busy", "happens on"), ("stall", "has no shaft")):
        with pytest.raises(Misuse, match=text):
            line.faults.start([fault], 0)


def test_the_seed_decides() -> None:
    def refused(seed: int) -> list[bool]:
        line = mic488()
        line.faults.start(["busy probability=0.5"], seed)
        port = line.rtu_client_port()
        return [port.exchange(READ, 0) != ANSWER for _ in range(64)]

    assert refused(1) == refused(1)
    assert refused(1) != refused(2)
