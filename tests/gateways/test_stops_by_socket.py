"""One stop of each way and each kind of controller over a real socket.

`test_stops` has the whole table in virtual time; the command line is in `tests/cli`.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from typing import Any

import httpx
import pytest
from asyncua.sync import Client
from gateway_rig import running
from tests.conftest import until
from websockets.sync.client import connect

from steptwin.gateways.opcua.addressspace import node_id
from steptwin.live.remote import RemoteSubject
from steptwin.subject import commands as command
from steptwin.world.inputs import Download

WORLD = """
[world]
name = "hall"
[gateway.opcua]
listen = "127.0.0.1:0"
[[line]]
name = "bus"
tcp = "127.0.0.1:0"
[[line]]
name = "chips"
kind = "m1486"
tcp = "127.0.0.1:0"
[[mic488]]
name = "table"
line = "bus"
[mic488.M1]
acc = 20000.0
vel = 5000.0
[[m1486]]
name = "ram"
line = "chips"
address = 7
variant = "B"
[[m1486]]
name = "eeprom"
line = "chips"
address = 9
variant = "E1"
"""
LOOPING = "[\n@5\nF6400\nR\nW50\nB6400\nR\nJ5\n]"
CHIPS = ("ram", "eeprom")
MACHINES = ("table", *CHIPS)
QUIET_S = 0.7
"""Longer than a command lies in an EEPROM."""

Places = Mapping[str, Mapping[str, Any]]
Stop = Callable[[str, Places, RemoteSubject], None]


def by_control(machine: str, places: Places, hall: RemoteSubject) -> None:
    hall.do(command.StopAxes(machine))


def by_rest(machine: str, places: Places, hall: RemoteSubject) -> None:
    answer = httpx.post(f"{places['http']['url']}api/do/stop", json={"machine": machine})
    assert (answer.status_code, answer.json()["ok"]) == (200, {"program": "stopped"})


def by_websocket(machine: str, places: Places, hall: RemoteSubject) -> None:
    with connect(f"ws://127.0.0.1:{places['http']['port']}/ws") as socket:
        socket.send(json.dumps({"do": "stop", "machine": machine, "axis": 1}))
        assert json.loads(socket.recv(10.0))["ok"] == {"program": "stopped"}


def by_opcua(machine: str, places: Places, hall: RemoteSubject) -> None:
    with Client(places["opcua"]["url"]) as client:
        client.get_node(f"ns=2;s={machine}").call_method(node_id("types.Controller.Stop"))


def moving(hall: RemoteSubject, machine: str) -> bool:
    (reading,) = hall.read("table.M1.moving" if machine == "table" else f"{machine}.moving")
    return reading.value == 1.0


def position(hall: RemoteSubject, machine: str) -> float | None:
    (reading,) = hall.read("table.M1.position" if machine == "table" else f"{machine}.position")
    return reading.value


@pytest.fixture(scope="module")
def hall(tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder = tmp_path_factory.mktemp("hall")
    (folder / "hall.toml").write_text(WORLD)
    options = ("--open-to-local-users", "--http", "127.0.0.1:0", "--no-browser")
    with pytest.MonkeyPatch.context() as patch, running(folder, "studio", "hall.toml", *options) as found:
        patch.setenv("XDG_RUNTIME_DIR", str(folder))
        with RemoteSubject("hall") as remote:
            yield found, remote


@pytest.mark.parametrize("stop", [by_control, by_rest, by_websocket, by_opcua])
def test_all_stop_and_stay_there(stop: Stop, hall: Any) -> None:
    places, remote = hall
    remote.do(command.Enable("table", 1))
    for machine in MACHINES:
        remote.do(command.Jog(machine, 1, 1000.0 if machine == "table" else 64_000.0))
    for machine in MACHINES:
        until(lambda machine=machine: moving(remote, machine), "it moves")
        stop(machine, places, remote)
        until(lambda machine=machine: not moving(remote, machine), "it stands")
    stood = [position(remote, machine) for machine in MACHINES]
    time.sleep(QUIET_S)
    assert [position(remote, machine) for machine in MACHINES] == stood
    assert not any(moving(remote, machine) for machine in MACHINES)


def test_stop_all_ends_the_programs_of_the_chips(hall: Any) -> None:
    places, remote = hall
    for machine in CHIPS:
        remote.do(Download(machine, "program", LOOPING))
    until(lambda: moving(remote, "ram"), "one moves, and the other one is being typed")
    answer = httpx.post(f"{places['http']['url']}api/do/stop_all")
    assert (answer.status_code, answer.json()["ok"]["machines"]) == (200, ["table", "ram", "eeprom"])
    until(lambda: not moving(remote, "ram"), "it stands")
    stood = [position(remote, machine) for machine in CHIPS]
    time.sleep(QUIET_S)
    assert [position(remote, machine) for machine in CHIPS] == stood
