"""The digital shadow of a device: a served twin plays the device, and another Modbus master makes it behave otherwise."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from playwright.sync_api import Browser, WebSocket, expect
from pymodbus.client import ModbusTcpClient
from studio_page import PICTURES, button, show
from tests.conftest import until
from tests.peers.conftest import Master
from tests.studio.conftest import Process

CONFIG = "[Axis0]\nUnit=3\nGear=100\nAcc=400\nDec=400\nVel=40\n"
M1_VMAX = 10052


class Rig:
    """A studio with one device, and a master at that device."""

    def __init__(self, studio: Process, port: int) -> None:
        self.studio = studio
        self._client = ModbusTcpClient("127.0.0.1", port=port)
        assert self._client.connect()
        self.master = Master(self._client)

    def ask(self, request: str, /, **fields: object) -> Any:
        return httpx.post(f"{self.studio.url}/api/do/{request}", json=fields, timeout=30).json()

    def ok(self, request: str, /, **fields: object) -> Any:
        answer = self.ask(request, **fields)
        assert "error" not in answer, answer
        return answer["ok"]

    def state(self) -> Any:
        return self.ok("shadow_state", controller="mic488")

    def samples(self) -> list[list[float | None]]:
        return self.state()["axes"][0]["samples"]

    def until_at(self, position: float) -> None:
        """There are no samples before the device has been polled once."""
        until(lambda: [one[1] for one in self.samples()[-1:]] == [position], f"the device is seen at {position}")

    def close(self) -> None:
        self._client.close()


@pytest.fixture
def rig(start_studio: Callable[..., Process], serve: Callable[..., Any], tmp_path: Path) -> Iterator[Rig]:
    (tmp_path / "machine.cfg").write_text(CONFIG)
    twin = serve("--config", str(tmp_path / "machine.cfg"))
    place = f"tcp://127.0.0.1:{twin.tcp_port},config={tmp_path / 'machine.cfg'}"
    found = Rig(start_studio("--itself", "--device", place), twin.tcp_port)
    yield found
    found.close()


def test_a_device_that_does_as_the_twin(rig: Rig) -> None:
    rig.master.reals(10040, 12.5)  # a setting that the configuration has not
    rig.ok("enable", controller="mic488", axis=1)
    rig.ok("shadow", controller="mic488")
    rig.ok("move", controller="mic488", axis=1, to=20)
    rig.until_at(20.0)
    rig.ok("move", controller="mic488", axis=1, by=-3)
    rig.until_at(17.0)
    rig.ok("write", values={"mic488.M1_ACC": 200})
    rig.ok("move", controller="mic488", axis=1, to=40)
    until(lambda: rig.master.sample(1).position > 18, "it moves")
    rig.ok("stop", controller="mic488", axis=1)
    until(lambda: rig.master.sample(1).velocity == 0, "it stands")
    stood = rig.master.sample(1).position
    until(
        lambda: rig.samples()[-1][1:3] == pytest.approx([stood, stood], abs=0.005), "the twin stands there, too"
    )  # half a pulse
    state = rig.state()
    assert (state["first"], state["registers"], state["problems"]) == (None, [], [])
    assert state["compared"] > 30
    assert len({sample[1] for sample in rig.samples()}) > 5  # it was seen on its way


def test_a_parameter_that_the_twin_has_not(rig: Rig) -> None:
    rig.ok("enable", controller="mic488", axis=1)
    rig.ok("shadow", controller="mic488")
    rig.ok("move", controller="mic488", axis=1, to=2)
    rig.until_at(2.0)
    before = rig.samples()[-1][0]
    rig.master.reals(M1_VMAX, 10.0)  # instead of 40 mm/s: nobody tells the twin
    rig.ok("move", controller="mic488", axis=1, to=42)
    until(lambda: rig.state()["first"] is not None, "the difference is seen")
    state = rig.state()
    first = state["first"]
    assert before is not None
    assert int(first["at_ns"]) > before * 1e9
    if first["what"] == "M1":  # the registers may have been compared before it moved
        assert first["device"] < first["twin"] - 0.02
    rig.until_at(42.0)
    until(
        lambda: [(one["what"], one["device"], one["twin"]) for one in rig.state()["registers"]] == [("M1_VMAX", 10, 40)],
        "the register",
    )
    assert rig.state()["axes"][0]["first"]["what"] == "M1"
    rig.ok("shadow", controller="mic488", on=False)
    assert rig.state() is None


def test_a_jog_is_taken_over(rig: Rig) -> None:
    socket = rig.studio.connect()

    def tell(**message: object) -> dict[str, Any]:
        socket.send(json.dumps({**message, "id": 1}))
        while True:
            answer = json.loads(socket.recv(timeout=30))
            if answer.get("id") == 1:
                return answer

    rig.ok("enable", controller="mic488", axis=1)
    rig.ok("shadow", controller="mic488")
    rig.ok("release_control")
    tell(do="hello", version=2)
    lease = tell(do="jog", controller="mic488", axis=1, velocity=10)["ok"]["lease"]
    until(lambda: "ok" in tell(do="renew", lease=lease) and rig.master.sample(1).position > 2, "it is jogged")
    tell(do="let_go", lease=lease)
    until(lambda: rig.master.sample(1).velocity == 0, "it stands")
    stood = rig.master.sample(1).position
    until(
        lambda: rig.samples()[-1][1:3] == pytest.approx([stood, stood], abs=0.005), "the twin stands there, too"
    )  # half a pulse
    assert any(sample[3] is None for sample in rig.samples())
    assert rig.state()["first"] is None


def test_where_there_is_no_twin(rig: Rig, serve: Callable[..., Any], serve_m1486: Callable[..., Any]) -> None:
    other = serve()
    rig.ok("connect", address=f"tcp://127.0.0.1:{other.tcp_port}", name="bare")
    refused = rig.ask("shadow", controller="bare")["error"]["message"]
    assert refused.endswith("a twin needs the configuration of the controller: connect it with config=FILE")
    rig.ok("connect", address=f"tcp://127.0.0.1:{serve_m1486().tcp_port},kind=m1486", name="chip")
    assert "no twin beside an M1486" in rig.ask("shadow", controller="chip")["error"]["message"]
    rig.ok("enable", controller="mic488", axis=1)
    rig.ok("move", controller="mic488", axis=1, to=40)
    assert "a twin can be made at rest: M1 runs" in rig.ask("shadow", controller="mic488")["error"]["message"]
    assert "no device is called 'mic'; there are mic488" in rig.ask("shadow", controller="mic")["error"]["message"]


def test_the_settings_as_a_text(rig: Rig) -> None:
    text = rig.ok("settings", controller="mic488")["text"]
    assert json.loads(text)["values"]["M1_VMAX"] == 40.0


def test_the_difference_is_drawn(rig: Rig, browser: Browser, tmp_path: Path) -> None:
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    asked: list[str] = []

    def opened(socket: WebSocket) -> None:
        socket.on("framesent", lambda frame: asked.append(str(frame)))

    page.on("websocket", opened)
    page.goto(rig.studio.url)
    show(page, "Devices")
    with page.expect_download() as download:
        button(page, "Download settings of mic488").click()
    download.value.save_as(tmp_path / "settings.json")
    assert json.loads((tmp_path / "settings.json").read_text())["firmware"] == "1.70"
    button(page, "Start the digital shadow of mic488").click()
    region = page.get_by_role("region", name="Digital shadow of mic488")
    expect(region.get_by_role("status")).to_contain_text("no difference so far")
    rig.ok("take_control", over=True)
    rig.ok("enable", controller="mic488", axis=1)
    rig.master.reals(M1_VMAX, 10.0)
    rig.ok("move", controller="mic488", axis=1, to=20)
    expect(region.get_by_role("status")).to_contain_text("first difference")
    expect(region.get_by_role("img", name="M1: device and twin")).to_be_visible()
    rig.until_at(20.0)
    expect(region.get_by_role("row", name="M1_VMAX 10 40")).to_be_visible()
    page.screenshot(path=PICTURES / "shadow.png")
    asked.clear()
    page.wait_for_timeout(2000)
    assert 1 <= sum("shadow_state" in frame for frame in asked) <= 6, "it is asked for twice a second"
    button(page, "End the digital shadow of mic488").click()
    expect(region).to_have_count(0)
    page.close()
