"""HistoryRead with an independent client: node-opcua reads what the history has kept of a motion that pymodbus commanded."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from gateway_rig import served
from node_client import NodeClient
from pymodbus.client import ModbusTcpClient
from tests.conftest import until

WORLD = """
    [world]
    name = "hall"
    [[line]]
    name = "bus"
    tcp = "127.0.0.1:0"
    [[mic488]]
    name = "table"
    line = "bus"
    unit = 1
    [gateway.opcua]
    listen = "127.0.0.1:0"
    [history]
    database = "sqlite:///h.db"
"""
POSITION, ENABLED, STATUS = "ns=2;s=table.M1.position", "ns=2;s=table.pins.M1_EN", "ns=2;s=table.M1.status"
HISTORY_READ = 4


def test_a_client_reads_what_was(require_peer: Callable[[str], str], tmp_path: Path) -> None:
    begin = datetime.now(UTC)
    with served(WORLD, tmp_path) as points, NodeClient(require_peer("node"), "opcua.js", tmp_path) as client:
        client("connect", url=points["opcua"]["url"], folder=str(tmp_path / "client"))
        with ModbusTcpClient("127.0.0.1", port=points["tcp"]["port"]) as master:
            assert not master.write_coil(2000, True, device_id=1).isError()  # M1_EN
            assert not master.write_registers(1012, [0, 400], device_id=1).isError()

        def read(node: str, start: datetime = begin, end: datetime | None = None, most: int = 0) -> dict[str, Any]:
            end = end or datetime.now(UTC) + timedelta(seconds=1)
            return client("history", node=node, start=start.isoformat(), end=end.isoformat(), most=most)

        until(lambda: len(read(ENABLED)["values"]) == 2, "the edge has been kept")
        assert client("read", node=POSITION, attribute="AccessLevel")["value"] & HISTORY_READ
        found = read(ENABLED)
        assert (found["status"], found["more"]) == ("Good", False)
        assert [value for _, value, _ in found["values"]] == [False, True]
        assert {code for _, _, code in found["values"]} == {"Good"}
        page = read(ENABLED, most=1)
        assert (page["status"], page["more"], [value for _, value, _ in page["values"]]) == ("Good", True, [False])
        moments = [moment for moment, _, _ in found["values"]]
        assert moments == sorted(moments)
        backwards = read(ENABLED, datetime.now(UTC) + timedelta(seconds=1), begin)
        assert [value for _, value, _ in backwards["values"]] == [True, False]
        assert read(STATUS)["values"][0][1] == "off"
        assert read("ns=2;s=table.Model")["status"] == "BadHistoryOperationUnsupported"
        assert read(POSITION, begin - timedelta(days=2), begin - timedelta(days=1))["values"] == []
        for level in (False, True, False, True):
            with ModbusTcpClient("127.0.0.1", port=points["tcp"]["port"]) as master:
                assert not master.write_coil(2000, level, device_id=1).isError()
            until(lambda level=level: read(ENABLED)["values"][-1][1] is level, "the edge has been kept")
        span = {"start": begin.isoformat(), "end": (datetime.now(UTC) + timedelta(seconds=1)).isoformat()}
        paged = client("pages", node=ENABLED, most=2, **span)
        assert paged == [[False, True], [False, True], [False, True]]
        assert client("pages", node=ENABLED, most=2, first="none", **span) == "BadContinuationPointInvalid"
        client("close")
