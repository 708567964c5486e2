"""One stop of each way and each kind of controller over a real socket.

`test_stops` has the whole table in virtual time; the command line is in `tests/cli`.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Generator, Mapping
from contextlib import ExitStack
from shutil import which
from typing import Any, NamedTuple

import httpx
import pytest
from asyncua.sync import Client
from gateway_rig import running
from mosquitto import Mosquitto, Requests
from tests.conftest import until
from websockets.sync.client import connect
from world_rig import TWO_LINES

from steptwin.gateways.opcua.addressspace import node_id
from steptwin.live.remote import RemoteSubject
from steptwin.simulation.world.inputs import Download
from steptwin.subject import commands as command

WORLD = f"""
[world]
name = "hall"
[gateway.opcua]
listen = "127.0.0.1:0"
[gateway.epics]
listen = "127.0.0.1:0"
{TWO_LINES}
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
CONTROLLERS = ("table", *CHIPS)
QUIET_S = 0.7
"""Longer than a command lies in an EEPROM."""

Places = Mapping[str, Mapping[str, Any]]
Stop = Callable[[str, Places, RemoteSubject], None]


def by_control(controller: str, places: Places, hall: RemoteSubject) -> None:
    hall.do(command.StopAxes(controller))


def by_rest(controller: str, places: Places, hall: RemoteSubject) -> None:
    answer = httpx.post(f"{places['http']['url']}api/do/stop", json={"controller": controller})
    assert (answer.status_code, answer.json()["ok"]) == (200, {"program": "stopped"})


def by_websocket(controller: str, places: Places, hall: RemoteSubject) -> None:
    with connect(f"ws://127.0.0.1:{places['http']['port']}/ws") as socket:
        socket.send(json.dumps({"do": "stop", "controller": controller, "axis": 1}))
        assert json.loads(socket.recv(10.0))["ok"] == {"program": "stopped"}


def by_opcua(controller: str, places: Places, hall: RemoteSubject) -> None:
    with Client(places["opcua"]["url"]) as client:
        client.get_node(f"ns=2;s={controller}").call_method(node_id("types.Controller.Stop"))


def by_channel_access(controller: str, places: Places, hall: RemoteSubject) -> None:
    """Of pyepics, in a process of its own."""
    program = f"import epics; assert epics.caput('{controller}:Stop', 1, wait=True, timeout=30) == 1"
    where = {"EPICS_CA_ADDR_LIST": f"127.0.0.1:{places['epics']['port']}", "EPICS_CA_AUTO_ADDR_LIST": "NO"}
    subprocess.run([sys.executable, "-c", program], env={**os.environ, **where}, check=True, timeout=100)


def moving(hall: RemoteSubject, controller: str) -> bool:
    (reading,) = hall.read("table.M1.moving" if controller == "table" else f"{controller}.moving")
    return reading.value == 1.0


def position(hall: RemoteSubject, controller: str) -> float | None:
    (reading,) = hall.read("table.M1.position" if controller == "table" else f"{controller}.position")
    return reading.value


class Hall(NamedTuple):
    places: Places
    remote: RemoteSubject
    broker: Mosquitto | None
    """None where mosquitto is not installed."""


@pytest.fixture(scope="module")
def hall(tmp_path_factory: pytest.TempPathFactory) -> Generator[Hall]:
    folder = tmp_path_factory.mktemp("hall")
    options = ("--open-to-local-users", "--http", "127.0.0.1:0", "--no-browser")
    with ExitStack() as stack:
        broker = None if which("mosquitto") is None else stack.enter_context(Mosquitto(str, folder))
        gateway = "" if broker is None else f'[gateway.mqtt]\nbroker = "127.0.0.1:{broker.port}"\n'
        (folder / "hall.toml").write_text(WORLD + gateway)
        places = stack.enter_context(running(folder, "studio", "hall.toml", *options))
        stack.enter_context(pytest.MonkeyPatch.context()).setenv("XDG_RUNTIME_DIR", str(folder))
        yield Hall(places, stack.enter_context(RemoteSubject("hall")), broker)


@pytest.mark.parametrize("stop", [by_control, by_rest, by_websocket, by_opcua, by_channel_access])
def test_all_stop_and_stay_there(stop: Stop, hall: Hall) -> None:
    check_stops(stop, hall)


def test_all_stop_by_a_broker_and_stay_there(require_peer: Callable[[str], str], hall: Hall) -> None:
    require_peer("mosquitto")
    broker = hall.broker
    assert broker is not None
    until(lambda: broker.retained("steptwin/hall/online") is True, "it is online")
    with broker.subscribe("me/answers") as answers:
        ask = Requests(broker, answers, "steptwin/hall")

        def by_broker(controller: str, places: Places, remote: RemoteSubject) -> None:
            assert ask("stop", controller=controller)["ok"] == {"program": "stopped"}

        check_stops(by_broker, hall)


def check_stops(stop: Stop, hall: Hall) -> None:
    """Each controller stands when its stop has been acknowledged, and none moves again."""
    places, remote, _ = hall
    remote.do(command.Enable("table", 1))
    for controller in CONTROLLERS:
        remote.do(command.Jog(controller, 1, 1000.0 if controller == "table" else 64_000.0))
    for controller in CONTROLLERS:
        until(lambda controller=controller: moving(remote, controller), "it moves")
        stop(controller, places, remote)
        until(lambda controller=controller: not moving(remote, controller), "it stands")
    check_rest(remote)


def check_rest(remote: RemoteSubject) -> None:
    stood = [position(remote, controller) for controller in CONTROLLERS]
    time.sleep(QUIET_S)
    assert [position(remote, controller) for controller in CONTROLLERS] == stood
    assert not any(moving(remote, controller) for controller in CONTROLLERS)


def test_stop_all_ends_the_programs_of_the_chips(hall: Hall) -> None:
    places, remote, _ = hall
    for controller in CHIPS:
        remote.do(Download(controller, "program", LOOPING))
    until(lambda: moving(remote, "ram"), "one moves, and the other one is being typed")
    answer = httpx.post(f"{places['http']['url']}api/do/stop_all")
    assert (answer.status_code, answer.json()["ok"]["controllers"]) == (200, ["table", "ram", "eeprom"])
    until(lambda: not moving(remote, "ram"), "it stands")
    check_rest(remote)
