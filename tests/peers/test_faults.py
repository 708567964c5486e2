"""What a master that was not written here sees of the faults of a served twin."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from typing import Any

import pytest
from pymodbus import FramerType
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.exceptions import ModbusIOException

pytestmark = pytest.mark.peers

WAIT_S = 3.0
"""How long the client waits for an answer; delays here are far from it on both sides."""


def read(client: Any) -> str:
    """What a request came to."""
    try:
        answer = client.read_holding_registers(10020, count=2, device_id=1)
    except ModbusIOException:
        return "no answer"
    return f"exception {answer.exception_code}" if answer.isError() else "answer"


def test_time_out_and_exception_on_tcp(serve: Callable[..., Any]) -> None:
    twin = serve(
        "--demo", "--fault", "busy function=3 address=10020-10027 nth=2", "--fault", "no-answer nth=3", "--fault", "late nth=9"
    )
    with ModbusTcpClient("127.0.0.1", port=twin.tcp_port, timeout=WAIT_S, retries=0) as client:
        assert [read(client) for _ in range(3)] == ["answer", "exception 6", "no answer"]
    fault = twin.command("fault", "--json")
    assert [(active["name"], active["acted"]) for active in json.loads(fault.stdout)] == [
        ("busy", 1),
        ("no-answer", 1),
        ("late", 0),
    ]


@pytest.mark.parametrize("way", ["pty", "rtu-tcp"])
def test_a_wrong_crc_and_a_wrong_byte_are_no_answer(way: str, serve: Callable[..., Any]) -> None:
    twin = serve("--demo", "--fault", "crc nth=2", "--fault", "flip nth=20 bit=3")
    if way == "pty":
        client: Any = ModbusSerialClient(str(twin.pty), baudrate=38400, timeout=WAIT_S, retries=0)
    else:
        client = ModbusTcpClient("127.0.0.1", port=twin.rtu_tcp_port, framer=FramerType.RTU, timeout=WAIT_S, retries=0)
    with client:
        # Answers have nine bytes: the 20th is the second of the third answer.
        assert [read(client) for _ in range(4)] == ["answer", "no answer", "no answer", "answer"]


def test_faults_are_set_and_removed_while_a_client_is_connected(serve: Callable[..., Any]) -> None:
    twin = serve("--demo")
    with ModbusTcpClient("127.0.0.1", port=twin.tcp_port, timeout=WAIT_S, retries=0) as client:
        assert read(client) == "answer"
        assert twin.command("fault").stdout == "no faults\n"
        assert twin.command("fault", "exception", "code=4", "name=sick").stdout == (
            "sick  exception name=sick code=4  (acted 0 times)\n"
        )
        assert [read(client), read(client)] == ["exception 4", "exception 4"]
        assert twin.command("fault", "--clear", "sick").stdout == "no faults\n"
        assert read(client) == "answer"
    assert [line for line in twin.lines if "sick: refused with exception 04" in line]


def test_a_delayed_answer_comes_by_itself(serve: Callable[..., Any]) -> None:
    twin = serve("--demo", "--fault", "delay for_ms=300 nth=1")
    with ModbusTcpClient("127.0.0.1", port=twin.tcp_port, timeout=60, retries=0) as client:
        begin = time.monotonic()
        assert read(client) == "answer"
        assert time.monotonic() - begin >= 0.3
