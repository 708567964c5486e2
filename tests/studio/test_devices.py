"""Devices in the studio: a twin in a process of its own plays the device, and a Modbus master beside the studio watches it."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Self

import pytest
from pymodbus.client import ModbusTcpClient
from tests.conftest import STEPTWIN, until
from tests.peers.conftest import Master
from tests.studio.conftest import WORLD, Process
from typer.testing import CliRunner

from steptwin.cli import app
from steptwin.drivers.mic488.snapshot import Mic488Snapshot
from steptwin.errors import Misuse

HOLD_S = 0.4
"""The hold time of the driver's jog."""


class Twin:
    """``steptwin up`` with a MIC488 and an M1486; ends and begins again at the same ports."""

    def __init__(self, directory: Path) -> None:
        self._directory = directory
        self._ports = {"bus": 0, "chips": 0}
        self.start()

    def start(self) -> None:
        first, bus, chips = WORLD.split("127.0.0.1:0")
        at_ports = f"127.0.0.1:{self._ports['bus']}".join((first, bus)) + f"127.0.0.1:{self._ports['chips']}" + chips
        (self._directory / "hall.toml").write_text(at_ports)
        ready = self._directory / "ready.json"
        environment = {**os.environ, "XDG_RUNTIME_DIR": str(self._directory), "TERM": "dumb"}
        command = [STEPTWIN, "up", "hall.toml", "--ready-file", "ready.json"]
        with (self._directory / "out").open("w") as out:
            self._process = subprocess.Popen(command, cwd=self._directory, env=environment, stdout=out, stderr=out)
        until(lambda: ready.exists() or self._process.poll() is not None, "the twin is ready")
        points = json.loads(ready.read_text())["end_points"]
        self._ports = {point["line"]: point["port"] for point in points if point["line"] is not None}

    @property
    def bus(self) -> str:
        return f"127.0.0.1:{self._ports['bus']}"

    @property
    def chips(self) -> str:
        return f"tcp://127.0.0.1:{self._ports['chips']},chip=7"

    def master(self) -> ModbusTcpClient:
        client = ModbusTcpClient("127.0.0.1", port=self._ports["bus"])
        assert client.connect()
        return client

    def end(self) -> None:
        self._process.terminate()
        self._process.wait(30)


@pytest.fixture
def twin(tmp_path: Path) -> Iterator[Twin]:
    found = Twin(tmp_path)
    yield found
    found.end()


@pytest.fixture
def master(twin: Twin) -> Iterator[Master]:
    client = twin.master()
    yield Master(client)
    client.close()


class Viewer:
    """A page without a browser."""

    def __init__(self, process: Process) -> None:
        self._socket = process.connect()
        self._id = 0
        self.pushed: list[dict[str, Any]] = []
        self.ok("hello", version=2)
        until(lambda: self._receive() and self.newest("hello") is not None, "the state has come")

    def _receive(self) -> bool:
        with contextlib.suppress(TimeoutError):
            self.pushed.append(json.loads(self._socket.recv(timeout=0.1)))
        return True

    def ask(self, do: str, **fields: object) -> dict[str, Any]:
        self._id += 1
        self._socket.send(json.dumps({"do": do, "id": self._id, **fields}))
        while True:
            message = json.loads(self._socket.recv(timeout=60))
            if message.get("id") == self._id:
                return message
            self.pushed.append(message)

    def ok(self, do: str, **fields: object) -> Any:
        answer = self.ask(do, **fields)
        assert "error" not in answer, answer
        return answer["ok"]

    def newest(self, member: str) -> Any:
        return next((one[member] for one in reversed(self.pushed) if member in one), None)

    def wait_for(self, holds: Callable[[Self], object], what: str) -> None:
        until(lambda: self._receive() and holds(self), what)

    def place(self) -> float | None:
        """Of the sample that has come last."""
        samples = self.events("sample")
        return samples[-1]["position"] if samples else None

    def events(self, kind: str) -> list[dict[str, Any]]:
        return [event for one in self.pushed for event in one.get("events", ()) if event["kind"] == kind]

    def renew(self, lease: int, until_holds: Callable[[], bool]) -> None:
        """As a page does, every 80 ms or so."""

        def renewed() -> bool:
            self.ok("renew", lease=lease)
            return until_holds()

        until(renewed, "the axis jogs")


def position(master: Master) -> float:
    return master.sample(1).position


def stands(master: Master) -> bool:
    return master.sample(1).velocity == 0.0


def test_devices_are_described_sampled_and_moved(twin: Twin, master: Master, start_studio: Callable[..., Process]) -> None:
    viewer = Viewer(start_studio("--itself", "--device", twin.bus, "--device", twin.chips))
    hello = viewer.newest("hello")
    assert [(one["name"], one["real"]) for one in hello["description"]["controllers"]] == [("mic488", True), ("m1486-7", True)]
    assert hello["virtual"] is False
    assert not {"pause", "fault", "set"} & set(hello["description"]["commands"])
    viewer.ok("subscribe", kinds=["sample"])
    viewer.ok("watch", points=["mic488.M1.position"], rate=10)
    viewer.ok("enable", controller="mic488", axis=1)
    viewer.ok("move", controller="mic488", axis=1, to=20)
    until(lambda: position(master) == 20.0, "the master sees the axis there")
    viewer.wait_for(lambda one: one.place() == 20.0, "the last sample is there")
    viewer.wait_for(lambda one: one.newest("values") == {"1": [[0, 20.0]]}, "the value is there")
    form = viewer.ok("configuration", controller="mic488")  # what registers show, and nothing else
    shown = {f"{part['name']}.{one['name']}": one["text"] for part in form["sections"] for one in part["settings"] if one["text"]}
    ramps = {f"Axis{axis}.{key}": "1000" for axis in range(1, 4) for key in ("Acc", "Dec", "Vel")}
    assert shown == {"Axis0.Acc": "400", "Axis0.Dec": "400", "Axis0.Vel": "40"} | ramps
    assert (form["is_file"], form["diagnostics"]) == (False, [])
    edited = viewer.ok("edit_configuration", controller="mic488", text="", changes={"Axis1.Acc": "5"})
    assert (edited["points"], edited["diagnostics"]) == ({"M2_ACC": 5.0}, [])
    viewer.ok("move", controller="m1486-7", axis=1, by=100)
    viewer.wait_for(lambda one: one.events("sample")[-1]["position"] == 100.0, "the chip has moved")
    assert None in [one["position"] for one in viewer.events("sample") if one["controller"] == "m1486-7"]
    assert viewer.ask("set", levels={"mic488.IN1": 1})["error"]["code"] == "refusal"
    assert viewer.ok("stop_all") == {"controllers": ["mic488", "m1486-7"], "scripts": []}


def test_a_jog_ends_with_its_lease_and_with_the_studio(twin: Twin, master: Master, start_studio: Callable[..., Process]) -> None:
    process = start_studio("--itself", "--device", twin.bus)
    viewer = Viewer(process)
    viewer.ok("enable", controller="mic488", axis=1)
    lease = viewer.ok("jog", controller="mic488", axis=1, velocity=10.0)["lease"]
    viewer.renew(lease, lambda: position(master) > 5.0)
    until(lambda: stands(master), "nobody has renewed it, so it stands")
    lease = viewer.ok("jog", controller="mic488", axis=1, velocity=10.0)["lease"]
    begin = position(master)
    viewer.renew(lease, lambda: position(master) > begin + 3.0)
    process.process.send_signal(signal.SIGSTOP)
    try:
        there = position(master)
        until(lambda: stands(master), "the studio stands still, so the axis does")
        assert position(master) <= there + 10.0 * HOLD_S + 10.0**2 / (2 * 400.0) + 0.1
    finally:
        process.process.send_signal(signal.SIGCONT)
    there = position(master)
    assert viewer.ask("renew", lease=lease)["error"]["code"] == "refusal"
    assert position(master) == there


def test_a_chip_is_jogged_by_short_moves(twin: Twin, start_studio: Callable[..., Process]) -> None:
    viewer = Viewer(start_studio("--itself", "--device", twin.chips))
    viewer.ok("subscribe", kinds=["sample"])
    lease = viewer.ok("jog", controller="m1486-7", axis=1, velocity=600.0)["lease"]
    for _ in range(10):
        viewer.ok("renew", lease=lease)
        viewer._receive()
    viewer.ok("let_go", lease=lease)
    viewer.wait_for(lambda one: one.place(), "it stands, and its place is known")
    place = viewer.place()
    assert place is not None
    assert place % 90 == 0, "whole moves of 0.15 s"


def test_a_line_that_was_lost_is_connected_again_and_nothing_moves(twin: Twin, start_studio: Callable[..., Process]) -> None:
    viewer = Viewer(start_studio("--itself", "--device", twin.bus))
    viewer.ok("subscribe", kinds=["sample", "status"])
    viewer.ok("enable", controller="mic488", axis=1)
    viewer.wait_for(lambda one: one.place() == 0.0, "the axis is seen")
    twin.end()
    viewer.wait_for(lambda one: one.newest("lost") is not None and one.place() is None, "the loss is seen, and nothing is known")
    refused = viewer.ask("move", controller="mic488", axis=1, to=20)["error"]
    assert (refused["code"], "was not sent" in refused["message"]) == ("failure", True)
    twin.start()
    viewer.wait_for(lambda one: one.newest("lost") is None, "it is there again")
    client = twin.master()
    assert Master(client).sample(1).position == 0.0
    client.close()


def test_settings_are_kept_before_the_first_write(
    twin: Twin, start_studio: Callable[..., Process], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    viewer = Viewer(start_studio("--itself", "--device", twin.bus))
    viewer.ok("subscribe", kinds=["status"])
    viewer.ok("write", values={"mic488.M1_ACC": 300})
    viewer.ok("write", values={"mic488.M1_ACC": 200})
    (kept,) = (tmp_path / "state/steptwin/settings").iterdir()
    assert Mic488Snapshot.from_json(kept.read_text()).values["M1_ACC"] == 400.0
    viewer.wait_for(lambda one: any(str(kept) in event["text"] for event in one.events("status")), "the page is told where")


def test_devices_come_and_go(twin: Twin, start_studio: Callable[..., Process]) -> None:
    viewer = Viewer(start_studio())
    viewer.ok("watch", points=["table.M1.position"])
    assert viewer.ok("connect", address=twin.bus, name="real") == {"controller": "real"}
    viewer.wait_for(
        lambda one: [m["name"] for m in one.newest("hello")["description"]["controllers"]][-1] == "real", "it is shown"
    )
    assert viewer.ask("connect", address=twin.bus, name="table")["error"]["code"] == "misuse"
    assert viewer.ok("read", points=["real.M1.position", "table.M1.position"])[0]["value"] == 0.0
    viewer.ok("disconnect", controller="real")
    viewer.wait_for(
        lambda one: "real" not in json.dumps(one.newest("hello")["description"]["controllers"][-1]["name"]), "it has gone"
    )
    assert viewer.ask("disconnect", controller="table")["error"]["code"] == "misuse"


@pytest.mark.parametrize(
    ("device", "refused"),
    [
        ("tabel=127.0.0.1:1", "--device tabel=127.0.0.1:1: its name must be that of a controller in .*: "),
        ("{chip}={bus}", "--device .*=...: MIC488.* is there, but .* has .*M1486"),
    ],
)
def test_a_device_takes_the_place_of_a_controller_of_its_kind(twin: Twin, tmp_path: Path, device: str, refused: str) -> None:
    chip = next(one["name"] for one in json.loads((tmp_path / "ready.json").read_text())["controllers"] if one["kind"] == "m1486")
    given = device.format(bus=twin.bus, chip=chip)
    arguments = ["studio", str(tmp_path / "hall.toml"), "--http", "127.0.0.1:0", "--no-browser", "--device", given]
    with pytest.raises(Misuse, match=refused):
        CliRunner().invoke(app, arguments, catch_exceptions=False)


def test_devices_in_places_are_no_world(tmp_path: Path) -> None:
    with pytest.raises(Misuse, match="--seed is not for devices without a world"):
        CliRunner().invoke(app, ["studio", str(tmp_path), "--device", "table=127.0.0.1:1", "--seed=2"], catch_exceptions=False)


@pytest.mark.parametrize("option", ["--seed=2", "--from=2s", "--speed=2", "--log-frames"])
def test_options_of_a_world_need_one(option: str) -> None:
    with pytest.raises(Misuse, match=f"{option.partition('=')[0]} is not for devices without a world: give a MACHINE.toml too"):
        CliRunner().invoke(app, ["studio", "--device", "127.0.0.1:1", option], catch_exceptions=False)
