"""``steptwin bridge``: a device over TCP behind OPC UA, for an independent client; the device is a served twin."""

from __future__ import annotations

import json
import socket
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from gateway_rig import running
from node_client import NodeClient
from pymodbus.client import ModbusTcpClient
from tests.conftest import until

CELL = """
    [[device]]
    name = "table"
    address = "127.0.0.1:{port},kind=mic488"
    [gateway.opcua]
    listen = "127.0.0.1:0"
    [gateway.modbus]
    listen = "127.0.0.1:0"
"""
AXIS = "ns=2;s=table.M1"


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        return int(listening.getsockname()[1])


def check_masters(bridge: int, device: int) -> None:
    """Several through the bridge, and one at the device itself."""
    with ExitStack() as stack:
        one, two, direct = (
            stack.enter_context(ModbusTcpClient("127.0.0.1", port=port, timeout=20)) for port in (bridge, bridge, device)
        )
        assert not one.write_registers(100, [7, 8], device_id=1).isError()
        assert two.read_holding_registers(100, count=2, device_id=1).registers == [7, 8]
        assert direct.read_holding_registers(100, count=2, device_id=1).registers == [7, 8]
        assert two.read_holding_registers(9000, count=1, device_id=1).exception_code == 2


def test_a_device_is_driven_lost_and_found(require_peer: Callable[[str], str], tmp_path: Path) -> None:
    port = free_port()
    (tmp_path / "cell.toml").write_text(CELL.format(port=port))
    device = ("serve", "mic488", "--tcp", f"127.0.0.1:{port}")
    with ExitStack() as stack:
        client = stack.enter_context(NodeClient(require_peer("node"), "opcua.js", tmp_path))

        def read(what: str) -> tuple[Any, str]:
            found = client("read", node=f"{AXIS}.{what}")
            return found["value"], found["status"]

        def call(method: str, value: dict[str, Any]) -> str:
            return client("call", object=AXIS, method=f"ns=2;s=types.Axis.{method}", given=[value])

        with running(tmp_path, *device):
            points = stack.enter_context(running(tmp_path, "bridge", "cell.toml", "--audit", "audit"))
            client("connect", url=points["opcua"]["url"], folder=str(tmp_path / "client"))
            assert call("Enable", {"type": "boolean", "value": True}) == "Good"
            assert call("MoveTo", {"type": "double", "value": 40}) == "Good"
            until(lambda: read("position") == (40.0, "Good"), "it has arrived")
            with ModbusTcpClient("127.0.0.1", port=port) as master:
                words = master.read_holding_registers(10020, count=2, device_id=1).registers
            check_masters(points["modbus"]["port"], port)
            assert master.convert_from_registers(words, master.DATATYPE.FLOAT32, word_order="little") == 40.0
        until(lambda: read("position") == (None, "BadNoCommunication"), "it is lost")
        with ModbusTcpClient("127.0.0.1", port=points["modbus"]["port"], timeout=20) as master:
            assert master.write_register(100, 1, device_id=1).exception_code == 0x0B
        assert call("MoveTo", {"type": "double", "value": 80}) == "BadCommunicationError"
        with running(tmp_path, *device):
            until(lambda: read("position")[1] == "Good", "it is found")
            assert (read("position"), read("velocity"), read("enabled")) == ((0.0, "Good"), (0.0, "Good"), (False, "Good"))
            assert call("MoveTo", {"type": "double", "value": 5}) == "BadInvalidState", "its drive is off now"
            client("close")
    entries = [json.loads(line) for line in (tmp_path / "audit").read_text().splitlines()]
    masters = [entry["fields"]["pdu"] for entry in entries if entry["viewer"].startswith("master (Modbus TCP, 127.0.0.1:")]
    assert masters == ["10006400020400070008", "0600640001"]
    entries = [entry for entry in entries if entry["do"] != "request"]
    assert all(entry["viewer"].startswith("anonymous (OPC UA, 127.0.0.1:") for entry in entries)
    assert [(entry["do"], entry["fields"].get("to"), entry["outcome"]) for entry in entries] == [
        ("enable", None, "done"),
        ("move", 40.0, "done"),
        ("move", 80.0, "failure"),
        ("move", 5.0, "refusal"),
    ]
