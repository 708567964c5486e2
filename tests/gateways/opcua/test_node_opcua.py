"""The OPC UA server with an independent client: node-opcua."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Mapping
from pathlib import Path
from typing import Any, TypeAlias

import pytest
from gateway_rig import served
from node_client import NodeClient
from pymodbus.client import ModbusTcpClient
from tests.conftest import until
from tokens import tokens_file

from steptwin.files.certificate import make_certificate

WORLD = """
    [[line]]
    name = "bus"
    tcp = "127.0.0.1:0"
    [[mic488]]
    name = "table"
    line = "bus"
    [[m1486]]
    name = "feed"
    [[axis]]
    name = "x"
    drive = "table.M1"
    [gateway.opcua]
    listen = "127.0.0.1:0"
    registers = ["table.USER_REGISTER[5]", "table.M1_VMAX"]
    interval = "20ms"
"""
AXIS = "ns=2;s=table.M1"


Points: TypeAlias = Mapping[str, Mapping[str, Any]]


@pytest.fixture(scope="module")
def points(tmp_path_factory: pytest.TempPathFactory) -> Generator[Points]:
    """The end points of `WORLD`."""
    with served(WORLD, tmp_path_factory.mktemp("hall")) as found:
        yield found


@pytest.fixture
def stranger(require_peer: Callable[[str], str], tmp_path: Path) -> Generator[NodeClient]:
    """A client that is not connected."""
    with NodeClient(require_peer("node"), "opcua.js", tmp_path) as found:
        yield found


@pytest.fixture
def client(stranger: NodeClient, points: Points, tmp_path: Path) -> Generator[NodeClient]:
    stranger("connect", url=points["opcua"]["url"], folder=str(tmp_path / "client"))
    yield stranger
    stranger("close")


def double(value: float | str) -> dict[str, object]:
    return {"type": "double", "value": value}


def flag(value: bool) -> dict[str, object]:
    return {"type": "boolean", "value": value}


def call(client: NodeClient, method: str, *given: dict[str, object], node: str = AXIS, kind: str = "Axis") -> str:
    return client("call", object=node, method=f"ns=2;s=types.{kind}.{method}", given=list(given))


def read(client: NodeClient, path: str) -> Any:
    found = client("read", node=f"ns=2;s={path}")
    assert found["status"] == "Good", found
    return found["value"]


def test_a_client_moves_an_axis_and_sees_it_move(client: NodeClient, points: Points) -> None:
    assert call(client, "Enable", flag(True)) == "Good"
    client("subscribe", node="ns=2;s=table.M1.position", period=20)
    began = time.time() * 1000
    assert call(client, "MoveTo", double(40.0)) == "Good"
    until(lambda: read(client, "table.M1.moving") is False, "it has arrived")
    with ModbusTcpClient("127.0.0.1", port=points["tcp"]["port"]) as master:
        words = master.read_holding_registers(10020, count=2, device_id=1).registers
    assert master.convert_from_registers(words, master.DATATYPE.FLOAT32, word_order="little") == 40.0
    seen: list[dict[str, Any]] = []
    until(lambda: bool(seen.extend(client("seen")) or (seen[-1:] and seen[-1]["value"] == 40.0)), "the last value comes")
    values = [one["value"] for one in seen]
    assert len(values) > 3
    assert values == sorted(values)
    times = [one["time"] for one in seen[1:]]
    assert times == sorted(times)
    assert all(began - 1000 < one <= time.time() * 1000 for one in times)


def test_a_jog_lasts_as_long_as_its_lease(client: NodeClient) -> None:
    assert call(client, "Enable", flag(True)) == "Good"
    begin = read(client, "table.M1.position")
    assert call(client, "Jog", double(-20.0), double(5.0)) == "Good"
    until(lambda: read(client, "table.M1.position") < begin - 10.0, "it moves for longer than a jog of the controller lasts")
    assert call(client, "Jog", double(-20.0), double(0.1)) == "Good"
    until(lambda: read(client, "table.M1.velocity") == 0.0, "the lease ends")
    assert call(client, "Jog", double(-20.0), double(5.0)) == "Good"
    assert call(client, "Stop") == "Good"
    until(lambda: read(client, "table.M1.velocity") == 0.0, "a stop ends it")
    assert call(client, "Jog", double(0.0), double(1.0)) == call(client, "Jog", double(5.0), double(6.0)) == "BadInvalidArgument"


def test_a_jog_ends_with_its_session(
    client: NodeClient, points: Points, require_peer: Callable[[str], str], tmp_path: Path
) -> None:
    assert call(client, "Enable", flag(True)) == "Good"
    with NodeClient(require_peer("node"), "opcua.js", tmp_path) as other:
        other("connect", url=points["opcua"]["url"], folder=str(tmp_path / "other"))
        assert call(other, "Jog", double(20.0), double(5.0)) == "Good"
        assert call(client, "Jog", double(20.0), double(5.0)) == "BadInvalidState", "another client jogs it"
        other("close")
    until(lambda: read(client, "table.M1.velocity") == 0.0, "it stands")


def test_refusals_have_status_codes(client: NodeClient) -> None:
    assert call(client, "MoveTo", double(1e12)) == "BadOutOfRange"
    assert call(client, "MoveTo", double("Infinity")) == call(client, "MoveTo", double("NaN")) == "BadOutOfRange"
    assert call(client, "MoveTo", flag(True)) == "BadInvalidArgument"
    assert call(client, "MoveTo") == "BadArgumentsMissing"
    assert call(client, "Stop", double(1.0)) == "BadTooManyArguments"
    assert call(client, "Home", double(5.0), node="ns=2;s=feed.M1") == "BadMethodInvalid"
    write = lambda path, value: client("write", node=f"ns=2;s={path}", value=value)  # noqa: E731
    assert write("table.M1.position", double(3.0)) == "BadNotWritable"
    assert write("table.nothing", double(3.0)) == "BadNodeIdUnknown"
    assert write("table.pins.OUT1", double(1.0)) == "BadTypeMismatch"
    assert write("table.registers.USER_REGISTER[5]", double(65536.0)) == "BadOutOfRange"
    assert read(client, "table.registers.USER_REGISTER[5]") == 0


def test_points_are_written(client: NodeClient, points: Points) -> None:
    for path, value in (
        ("table.registers.USER_REGISTER[5]", double(77.0)),
        ("table.pins.OUT2", flag(True)),
        ("table.pins.IN3", flag(True)),
    ):
        assert client("write", node=f"ns=2;s={path}", value=value) == "Good"
        assert read(client, path) == value["value"]
    with ModbusTcpClient("127.0.0.1", port=points["tcp"]["port"]) as master:
        assert master.read_holding_registers(5, count=1, device_id=1).registers == [77]
        assert master.read_coils(6001, count=1, device_id=1).bits[0] is True
        inputs = lambda: master.read_discrete_inputs(5002, count=1, device_id=1).bits[0]  # noqa: E731
        until(inputs, "it is through the filter of the inputs")


def test_user_registers_are_an_array(client: NodeClient, points: Points) -> None:
    path = "table.registers.USER_REGISTER"
    words = lambda: list(read(client, path).values())  # noqa: E731  JSON of a typed array: by index
    with ModbusTcpClient("127.0.0.1", port=points["tcp"]["port"]) as master:
        assert not master.write_registers(1997, [65535, 1, 2], device_id=1).isError()
        assert (len(words()), words()[1997:]) == (2000, [65535, 1, 2])
        assert not master.write_register(1999, 3, device_id=1).isError()
        assert words()[1999] == 3
    assert client("read", node=f"ns=2;s={path}", attribute="ValueRank")["value"] == 1
    assert client("write", node=f"ns=2;s={path}", value=double(1.0)) == "BadNotWritable"


def test_nodes_have_units_ranges_and_what_robotics_clients_look_for(client: NodeClient) -> None:
    names = lambda node: [one[0] for one in client("browse", node=node)]  # noqa: E731
    assert names("ns=2;s=machines") == ["2:Time", "2:table", "2:feed"]
    assert {"2:ParameterSet", "2:MotionProfile", "2:Moving", "2:Enable", "2:MoveTo", "2:Home", "2:Stop"} <= {*names(AXIS)}
    assert {"2:Enable", "2:Home"}.isdisjoint(names("ns=2;s=feed.M1"))
    assert names(f"{AXIS}.ParameterSet") == ["2:ActualPosition", "2:ActualSpeed"]
    assert names(f"{AXIS}.position") == ["EngineeringUnits", "EURange"]
    unknown = client("read", node="ns=2;s=feed.M1.enabled")
    assert (unknown["value"], unknown["status"]) == (None, "BadNoData")
    assert client("read", node="ns=2;s=table.program.state")["value"] == "stopped"
    before = read(client, "time.virtual_time")
    assert read(client, "time.virtual_time") > before


def test_events_come_from_the_controller_and_the_server(client: NodeClient) -> None:
    fields = ["Message", "Severity", "SourceName", "Code"]
    for node in ("ns=0;i=2253", "ns=2;s=table"):
        client("events", node=node, fields=fields, period=20)
    assert call(client, "Start", node="ns=2;s=table.program", kind="Program") == "Good"
    seen: list[dict[str, Any]] = []
    until(lambda: bool(seen.extend(client("seen")) or len(seen) >= 2), "the events come")
    assert {one["node"] for one in seen} == {"ns=0;i=2253", "ns=2;s=table"}
    message, severity, source, code = seen[0]["event"]
    assert (message, severity, source, code) == ("program bank 0 is empty", 800, "table", "program-error")


def test_a_dead_band_has_an_effect(client: NodeClient) -> None:
    path = "table.registers.USER_REGISTER[5]"
    assert client("write", node=f"ns=2;s={path}", value=double(0)) == "Good"
    assert client("subscribe", node=f"ns=2;s={path}", period=20, filter={"type": ABSOLUTE, "band": 10}) == "Good"
    for value in (4, 8, 12, 16, 20, 24):
        assert client("write", node=f"ns=2;s={path}", value=double(value)) == "Good"
        until(lambda value=value: read(client, path) == value, "the value is there")
        time.sleep(0.1)  # several intervals of sampling: nothing says that a value was sampled and passed over
    seen: list[float] = []
    until(lambda: bool(seen.extend(one["value"] for one in client("seen")) or seen[-1:] == [24]), "the last one comes")
    assert seen == [0, 12, 24]


ABSOLUTE, PERCENT = 1, 2
NOT_SUPPORTED = [
    ("table.M1.position", {"type": PERCENT, "band": 5}, "BadMonitoredItemFilterUnsupported"),
    ("table.M1.position", {"type": 7, "band": 5}, "BadDeadbandFilterInvalid"),
    ("table.M1.position", {"type": ABSOLUTE, "band": -1}, "BadDeadbandFilterInvalid"),
    ("table.status", {"type": ABSOLUTE, "band": 1}, "BadFilterNotAllowed"),
    ("table.M1.position", {"average": 100}, "BadMonitoredItemFilterUnsupported"),
]


def test_filters_that_are_not_supported_are_refused(client: NodeClient) -> None:
    for path, wanted, code in NOT_SUPPORTED:
        assert client("subscribe", node=f"ns=2;s={path}", period=20, filter=wanted) == code, wanted


def test_a_range_of_an_array_is_read(client: NodeClient) -> None:
    path = "table.registers.USER_REGISTER"
    assert client("write", node=f"ns=2;s={path}[5]", value=double(77)) == "Good"

    def part(span: str) -> Any:
        found = client("read", node=f"ns=2;s={path}", range=span)
        return list(found["value"].values()) if found["status"] == "Good" else found["status"]

    until(lambda: part("5") == [77], "the value is there")
    assert part("4:6") == [0, 77, 0]
    assert len(part("1998:5000")) == 2
    assert part("2000") == part("5000") == "BadIndexRangeNoData"


def test_a_value_of_bad_quality_is_not_written(client: NodeClient) -> None:
    for status in ("BadSensorFailure", "UncertainLastUsableValue"):
        assert client("write", node="ns=2;s=table.registers.USER_REGISTER[5]", value=double(66), status=status) == (
            "BadWriteNotSupported"
        )
    assert read(client, "table.registers.USER_REGISTER[5]") != 66


SECURE = """
    security = "encrypt"
    certificate = "own/certificate.pem"
    key = "own/key.pem"
    tokens = "tokens"
"""


def test_encrypted_connections_with_roles(stranger: NodeClient, tmp_path: Path) -> None:
    make_certificate(tmp_path / "own", [], 2)
    tokens_file(tmp_path, "viewer screen 0123456789abcdef\noperator press 0123456789abcdeF\n")
    with served(WORLD + SECURE, tmp_path) as points:
        where = {"url": points["opcua"]["url"], "folder": str(tmp_path / "client")}
        secure = {"mode": "SignAndEncrypt", "policy": "Basic256Sha256", **where}
        for wrong in (where, secure, {**secure, "user": "x", "password": "not a token of these"}):
            with pytest.raises(RuntimeError):
                stranger("connect", **wrong)
        stranger("connect", **secure, user="screen", password="0123456789abcdef")
        assert read(stranger, "table.status") == "ok"
        assert call(stranger, "Enable", flag(True)) == "BadUserAccessDenied"
        assert call(stranger, "Stop") == "Good"
        stranger("connect", **secure, user="press", password="0123456789abcdeF")
        assert call(stranger, "Enable", flag(True)) == "Good"
        assert read(stranger, "table.M1.enabled") is True
        stranger("close")
