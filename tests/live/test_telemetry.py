"""Traces of requests: with the SDK's exporter in memory, and to a receiver of OTLP that knows nothing of the SDK."""

from __future__ import annotations

import asyncio
import subprocess
import sys
import threading
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any

import pytest
from gateway_rig import GatewayWorld, running
from opentelemetry.sdk.trace import ReadableSpan
from opentelemetry.sdk.trace.export import SimpleSpanProcessor
from opentelemetry.sdk.trace.export.in_memory_span_exporter import InMemorySpanExporter
from opentelemetry.trace import StatusCode
from pymodbus.client import ModbusTcpClient
from tests.conftest import until

from steptwin.access.roles import Role
from steptwin.errors import Misuse, SteptwinError
from steptwin.gateways.clients import GatewayClient
from steptwin.live.telemetry import exporting, traces_to
from steptwin.live.tracedport import TracedPort, traced
from steptwin.simulation.kinds.mic488.line import ModbusBus
from steptwin.subject import commands as command
from steptwin.tracing import NoSpan, is_traced, span

WORLD = """
[[line]]
name = "bus"
tcp = "127.0.0.1:0"
[[mic488]]
name = "table"
line = "bus"
"""


@contextmanager
def spans() -> Generator[InMemorySpanExporter]:
    exporter = InMemorySpanExporter()
    with traces_to(SimpleSpanProcessor(exporter), "hall"):
        yield exporter


def tree(exporter: InMemorySpanExporter) -> dict[str, str | None]:
    """The name of the parent of each span."""
    found: tuple[ReadableSpan, ...] = exporter.get_finished_spans()
    names = {one.context.span_id: one.name for one in found if one.context is not None}
    return {one.name: None if one.parent is None else names[one.parent.span_id] for one in found}


def test_nothing_is_traced_without_a_tracer() -> None:
    assert not is_traced()
    with span("gateway move", {"command": "move"}) as traced_span:
        assert isinstance(traced_span, NoSpan)


def test_a_command_of_a_client_has_its_parts_and_polling_is_left_out() -> None:
    subject = GatewayWorld(WORLD)
    client = GatewayClient("anna", Role.OPERATOR, "OPC UA")
    with spans() as exporter:
        with span("twin state", {}, is_part=True):
            """A gateway that looks."""
        asyncio.run(client.do(subject, command.Enable("table", 1, on=True)))
        with pytest.raises(SteptwinError):
            asyncio.run(client.do(subject, command.Move("table", 9, to=1.0)))
    found = exporter.get_finished_spans()
    assert [one.name for one in found] == ["gateway enable", "gateway move"]
    assert dict(found[0].attributes or {}) == {
        "steptwin.command": "enable", "steptwin.client": "anna (OPC UA)", "steptwin.role": "operator"
    }  # fmt: skip
    assert [one.status.status_code for one in found] == [StatusCode.UNSET, StatusCode.ERROR]
    assert found[0].resource.attributes["service.name"] == "steptwin"
    assert not is_traced()


def test_a_request_over_a_line_has_the_device_as_its_part() -> None:
    world = GatewayWorld(WORLD).world
    line = world.lines["bus"]
    assert isinstance(line, ModbusBus)
    line.serve_by(lambda devices: traced(devices, {1: "table"}))
    place = line.connect("tcp-1", "tcp")
    port = TracedPort(place.inner, "bus")
    port.used_by("127.0.0.1:5000")
    with spans() as exporter:
        assert port.exchange(bytes.fromhex("0001000000060106270f0001"), 0)[7] == 0x86
    assert tree(exporter) == {"device table": "line bus", "line bus": None}
    device, over = (dict(one.attributes or {}) for one in exporter.get_finished_spans())
    assert (device["steptwin.function"], device["steptwin.outcome"]) == (6, "refusal")
    assert (over["steptwin.source"], over["steptwin.answer"]) == ("127.0.0.1:5000", "000100000003018602")


class _Receiver(BaseHTTPRequestHandler):
    received: list[tuple[str, bytes]]

    def do_POST(self) -> None:
        data = self.rfile.read(int(self.headers["content-length"]))
        self.received.append((f"{self.path} {self.headers['content-type']}", data))
        self.send_response(200)
        self.end_headers()

    def log_message(self, format: str, *arguments: Any) -> None:  # noqa: A002
        """Quiet."""


@pytest.fixture
def receiver() -> Iterator[tuple[str, list[tuple[str, bytes]]]]:
    """An address for OTLP over HTTP, and what has come there."""
    _Receiver.received = []
    with HTTPServer(("127.0.0.1", 0), _Receiver) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}/v1/traces", _Receiver.received
        server.shutdown()
        thread.join()


def fields(data: bytes) -> Iterator[tuple[int, bytes | int]]:
    """Number and value of each field of a message of Protocol Buffers."""
    at = 0

    def varint() -> int:
        nonlocal at
        value = shift = 0
        while True:
            byte = data[at]
            at += 1
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return value

    while at < len(data):
        key = varint()
        size = {0: 0, 1: 8, 5: 4}.get(key & 7, -1)
        if size == 0:
            yield key >> 3, varint()
            continue
        size = varint() if size < 0 else size
        yield key >> 3, data[at : at + size]
        at += size


def parts(data: bytes | int, *path: int) -> list[bytes]:
    """The messages under a path of field numbers."""
    found = [data]
    for number in path:
        found = [value for one in found if isinstance(one, bytes) for key, value in fields(one) if key == number]
    return [one for one in found if isinstance(one, bytes)]


def test_a_collector_gets_them(receiver: tuple[str, list[tuple[str, bytes]]], tmp_path: Path) -> None:
    """Field numbers of opentelemetry/proto/trace/v1: resource_spans 1, scope_spans 2, spans 2; of a span: span_id 2, parent 4,
    name 5."""
    url, received = receiver
    (tmp_path / "hall.toml").write_text(WORLD)
    with (
        running(tmp_path, "up", "hall.toml", "--traces", url) as points,
        ModbusTcpClient("127.0.0.1", port=points["tcp"]["port"]) as master,
    ):
        assert not master.write_coil(2000, True, device_id=1).isError()
    until(lambda: received, "spans have come")
    assert {head for head, _ in received} == {"/v1/traces application/x-protobuf"}
    found = [one for _, data in received for one in parts(data, 1, 2, 2)]
    names = {parts(one, 2)[0]: parts(one, 5)[0].decode() for one in found}
    assert {parts(one, 5)[0].decode(): names.get(b"".join(parts(one, 4))) for one in found} == {
        "line bus": None, "device table": "line bus"
    }  # fmt: skip


def test_a_collector_that_is_away_is_told_once() -> None:
    told: list[str] = []
    with exporting("http://127.0.0.1:9/v1/traces", "hall", told.append), span("line bus", {}):
        """One span."""
    assert told == ["traces: http://127.0.0.1:9/v1/traces takes none: spans are lost"]


def test_addresses_are_checked() -> None:
    with (
        pytest.raises(Misuse, match="--traces collector: expected http://HOST:PORT/v1/traces"),
        exporting("collector", "", print),
    ):
        """Never."""


def test_nothing_is_imported_without_the_options() -> None:
    look = "import sys, steptwin.live.running, steptwin.live.bridge; print(sorted(sys.modules))"
    found = subprocess.run([sys.executable, "-c", look], capture_output=True, text=True, check=True, timeout=60)
    assert "steptwin.tracing" in found.stdout
    assert "opentelemetry" not in found.stdout
    assert "structlog" not in found.stdout
