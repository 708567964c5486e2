"""The Sparkplug face with an independent host: MQTT.js and sparkplug-payload, which checks births, seq and bdSeq."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

import pytest
from gateway_rig import running, served
from mosquitto import Mosquitto
from node_client import NodeClient
from tests.conftest import STEPTWIN, until

WORLD = """
    [[line]]
    name = "bus"
    tcp = "127.0.0.1:0"
    [[mic488]]
    name = "table"
    line = "bus"
    [[m1486]]
    name = "feed"
    [gateway.mqtt]
    broker = "127.0.0.1:{port}"
    interval = "20ms"
    registers = ["table.USER_REGISTER[5]"]
    role = "engineer"
    sparkplug = {{ group = "plant", node = "hall"{host} }}
"""
NODE = {"node": "hall"}


@pytest.fixture
def broker(require_peer: Callable[[str], str], tmp_path: Path) -> Generator[Mosquitto]:
    with Mosquitto(require_peer, tmp_path) as found:
        yield found


class Host:
    def __init__(self, client: NodeClient, broker: Mosquitto) -> None:
        self._client = client
        client("connect", url=f"mqtt://127.0.0.1:{broker.port}")
        self.seen: list[dict[str, Any]] = []

    def __call__(self, do: str, **given: Any) -> Any:
        return self._client(do, **given)

    def look(self) -> list[dict[str, Any]]:
        self.seen.extend(self._client("seen"))
        return self.seen

    def kinds(self) -> list[tuple[str, str | None]]:
        return [(one["kind"], one["device"]) for one in self.look()]

    def value(self, name: str, device: str | None = "table") -> Any:
        return self._client("value", **NODE, device=device, name=name)["value"]

    def is_alive(self, device: str | None = None) -> bool:
        return self._client("value", **NODE, device=device, name="")["alive"]

    def write(self, name: str, kind: str, value: Any, device: str = "table") -> None:
        self._client("write", **NODE, group="plant", device=device, name=name, type=kind, value=value)

    def state(self, timestamp: int, *, online: bool) -> None:
        self._client("state", host="scada", online=online, timestamp=timestamp)

    def check(self) -> None:
        assert self._client("violations") == []


@pytest.fixture
def host(require_peer: Callable[[str], str], broker: Mosquitto, tmp_path: Path) -> Generator[Host]:
    with NodeClient(require_peer("node"), "sparkplug.js", tmp_path) as client:
        yield Host(client, broker)
        client("close")


def test_births_data_and_death(host: Host, broker: Mosquitto, tmp_path: Path) -> None:
    with served(WORLD.format(port=broker.port, host=""), tmp_path):
        until(lambda: host.is_alive("feed"), "all are born")
        assert host.kinds()[:3] == [("NBIRTH", None), ("DBIRTH", "table"), ("DBIRTH", "feed")]
        metrics = {one["name"]: one for one in host.seen[1]["metrics"]}
        velocity = metrics["M1/velocity"]
        assert (velocity["type"], velocity["value"], velocity["properties"]["engUnit"]) == ("Double", 0, "imp/s")
        assert metrics["registers/USER_REGISTER[5]"]["properties"]["engHigh"] == 65535
        assert (metrics["M1/moving"]["type"], metrics["status_code"]["type"], metrics["status"]["value"]) == (
            "Boolean",
            "Int64",
            "ok",
        )
        assert metrics["program/line"]["value"] is None
        assert abs(host.seen[1]["time"] - time.time() * 1000) < 60_000
        host.write("M1/Commands/Enable", "Boolean", True)
        until(lambda: host.value("M1/enabled") is True, "its drive is on")
        host.write("M1/Commands/MoveTo", "Double", 40.0)
        until(lambda: host.value("M1/position") == 40.0, "it arrives")
        host.write("registers/USER_REGISTER[5]", "Double", 77)
        until(lambda: host.value("registers/USER_REGISTER[5]") == 77, "it is written")
        until(lambda: host.value("Time/virtual_time", None) > 1.0, "the node has data of its own")
    until(lambda: not host.is_alive(), "it says good-bye")
    assert [one for one in host.kinds() if one[0] == "NDEATH"] == [("NDEATH", None)]
    host.check()


def test_seq_goes_round(host: Host, broker: Mosquitto, tmp_path: Path) -> None:
    with served(WORLD.format(port=broker.port, host="").replace("20ms", "1ms"), tmp_path):
        until(lambda: host.is_alive("feed"), "all are born")
        host.write("M1/Commands/Enable", "Boolean", True)
        until(lambda: host.value("M1/enabled") is True, "its drive is on")
        host.write("M1/Commands/MoveTo", "Double", 1e6)
        until(lambda: len(host.look()) > 300, "more than 256 messages come")
        assert {one["seq"] for one in host.seen} >= set(range(256))
        host.check()


def test_a_rebirth_on_demand(host: Host, broker: Mosquitto, tmp_path: Path) -> None:
    with served(WORLD.format(port=broker.port, host=""), tmp_path):
        until(lambda: host.is_alive("feed"), "all are born")
        begin = len(host.look())
        host("command", **NODE, group="plant", metrics=[{"name": "Node Control/Rebirth", "type": "Boolean", "value": True}])
        until(lambda: ("DBIRTH", "feed") in host.kinds()[begin:], "all are born again")
        births = [one["bdSeq"] for one in host.look() if one["kind"] == "NBIRTH"]
        assert births == [0, 0], "of the same session"
        assert ("NDEATH", None) not in host.kinds()
        host.check()


def test_commands_that_are_refused(host: Host, broker: Mosquitto, tmp_path: Path) -> None:
    def told(text: str) -> None:
        until(lambda: text in (host.value("Commands/Result") or ""), f"{text!r} is told")

    with served(WORLD.replace('role = "engineer"', "").format(port=broker.port, host=""), tmp_path):
        until(lambda: host.is_alive("feed"), "all are born")
        host.write("M1/Commands/Enable", "Boolean", True)
        told("M1/Commands/Enable: enable is for the role operator")
        host.write("Commands/Stop", "Boolean", True)
        told("Commands/Stop: done")
    with served(WORLD.format(port=broker.port, host=""), tmp_path):
        until(lambda: host.is_alive("feed"), "all are born")
        host.write("M1/Commands/MoveTo", "String", "far")
        told("'far': expected a number")
        host.write("registers/USER_REGISTER[5]", "Double", 70_000)
        told("permitted are numbers from 0 to 65535")
        enable = {"name": "M1/Commands/Enable", "type": "Boolean", "value": True}
        host("command", **NODE, group="plant", device="table", metrics=[{**enable, "isHistorical": True}])
        told("a command is not historical")
        host("command", **NODE, group="plant", device="table", metrics=[enable], retain=True)
        broker.publish("spBv1.0/plant/DCMD/hall/table", "no protocol buffer")
        host.write("M1/Commands/MoveBy", "Double", 1e300)
        told("M1/Commands/MoveBy: ")
        assert host.value("M1/enabled") is False, "what is retained is not done"


def test_the_broker_goes_and_comes_back(host: Host, broker: Mosquitto, tmp_path: Path) -> None:
    host.state(1, online=True)
    with served(WORLD.format(port=broker.port, host=', host = "scada"'), tmp_path, is_quiet=False):
        until(lambda: host.is_alive("feed"), "all are born")
        host.write("M1/Commands/Enable", "Boolean", True)
        until(lambda: host.value("M1/enabled") is True, "its drive is on")
        host.write("M1/Commands/MoveTo", "Double", 2000.0)
        until(lambda: (host.value("M1/position") or 0) > 1, "it moves")
        begin = len(host.look())
        broker.kill()
        until(lambda: "connection refused" in (tmp_path / "output").read_text(), "it is missed")
        broker.start()
        until(lambda: host("connected"), "the host is there again")
        host.state(2, online=True)
        until(lambda: host.value("M1/position") == 2000.0, "it arrives")
        later = host.look()[begin:]
        births = [one for one in later if one["kind"] == "NBIRTH"]
        assert len(births) == 1
        assert births[0]["bdSeq"] > 0
        data = [metric for one in later if one["kind"] == "DDATA" for metric in one["metrics"] if metric["name"] == "M1/position"]
        born = next(one["time"] for one in later if one["kind"] == "DBIRTH")
        stored = [one for one in data if one["historical"]]
        assert len(stored) > 3, "what changed meanwhile comes afterwards"
        assert all(one["time"] <= born for one in stored)
        assert [one["time"] for one in data] == sorted({one["time"] for one in data}), "in order, and once"
        assert [one["value"] for one in data] == sorted(one["value"] for one in data)
        host.check()


def test_the_primary_host_is_waited_for(host: Host, broker: Mosquitto, tmp_path: Path) -> None:
    host.state(1000, online=False)
    with served(WORLD.format(port=broker.port, host=', host = "scada"'), tmp_path, is_quiet=False) as points:
        assert points["mqtt"]["topic"] == "spBv1.0/plant/+/hall/#"
        until(lambda: broker.is_subscribed("spBv1.0/STATE/scada"), "it waits for the host")
        host.state(900, online=True)
        host.state(1001, online=False)
        until(lambda: broker.retained("spBv1.0/STATE/scada")["timestamp"] == 1001, "the states are there")
        assert host.kinds() == [], "an older state does not count"
        host.state(1002, online=True)
        until(lambda: host.is_alive("feed"), "all are born")
        host.state(1001, online=False)
        host.write("M1/Commands/Enable", "Boolean", True)
        until(lambda: host.value("M1/enabled") is True, "it goes on")
        host.state(1003, online=False)
        until(lambda: not host.is_alive(), "it says good-bye")
        assert host.kinds()[-1] == ("NDEATH", None)
        host.state(1004, online=True)
        until(lambda: host.is_alive("feed"), "all are born again")
        host.check()


def test_the_death_of_a_gateway_that_is_lost(host: Host, broker: Mosquitto, tmp_path: Path) -> None:
    (tmp_path / "hall.toml").write_text(WORLD.format(port=broker.port, host=""))
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(tmp_path)}
    process = subprocess.Popen([STEPTWIN, "up", "hall.toml"], cwd=tmp_path, env=environment, stdout=subprocess.DEVNULL)
    try:
        until(lambda: host.is_alive("feed"), "all are born")
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    until(lambda: not host.is_alive(), "its will is published")
    assert host.look()[-1]["bdSeq"] == 0
    host.check()


def test_a_device_that_is_lost_is_dead_and_born_again(host: Host, broker: Mosquitto, tmp_path: Path) -> None:
    with running(tmp_path, "serve", "mic488", "--tcp", "127.0.0.1:0") as points:
        port = points["tcp"]["port"]
        (tmp_path / "cell.toml").write_text(
            f'[[device]]\nname = "table"\naddress = "127.0.0.1:{port},kind=mic488"\n[gateway.mqtt]\n'
            f'broker = "127.0.0.1:{broker.port}"\ninterval = "20ms"\nsparkplug = {{ group = "plant", node = "hall" }}\n'
        )
        bridge = running(tmp_path, "bridge", "cell.toml")
        bridge.__enter__()
        try:
            until(lambda: host.is_alive("table"), "it is born")
        except BaseException:
            bridge.__exit__(None, None, None)
            raise
    try:
        until(lambda: not host.is_alive("table"), "it is dead")
        assert host.is_alive()
        with running(tmp_path, "serve", "mic488", "--tcp", f"127.0.0.1:{port}"):
            until(lambda: host.is_alive("table"), "it is born again")
            assert host.value("M1/position") == 0.0
        host.check()
    finally:
        bridge.__exit__(None, None, None)
