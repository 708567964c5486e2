"""Search for devices and their checks in a real browser; a twin in a process of its own plays the device."""

from __future__ import annotations

import json
import re
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest
from playwright.sync_api import expect
from pymodbus.client import ModbusTcpClient
from studio_page import PICTURES, Studio, button, serious, show
from tests.conftest import until
from tests.peers.conftest import Master


def test_a_device_is_found_checked_and_connected(studio: Studio, serve: Callable[..., Any], tmp_path: Path) -> None:
    twin = serve("--lenient")
    place, typed = f"tcp://127.0.0.1:{twin.tcp_port}", f"127.0.0.1:{twin.tcp_port}"
    page = studio.page(panel="Devices", viewport={"width": 1280, "height": 1000})
    page.get_by_label("Address of the device").fill(typed)
    page.get_by_label("Units").fill("1-3")
    button(page, f"Search {typed}").click()
    found = page.get_by_role("table", name="Found")
    expect(found).to_contain_text(f"{place},unit=1MIC488, firmware 1.70")
    expect(page.get_by_text(f"Tried: {place}")).to_contain_text("unit")

    button(page, f"Check {place},unit=1").click()
    results = page.get_by_role("table", name="Results of the checks")
    row = results.get_by_role("row").filter(has=page.get_by_role("rowheader", name="MIC-3", exact=True))
    expect(row).to_contain_text("refuted")
    expect(row).to_contain_text("expected exception 02 (illegal data address), came answer 03 02 00 00")
    PICTURES.mkdir(parents=True, exist_ok=True)
    page.screenshot(path=PICTURES / "devices.png")
    with page.expect_download() as download:
        button(page, "Download report").click()
    download.value.save_as(tmp_path / "report.json")
    report = json.loads((tmp_path / "report.json").read_text())
    assert (report["device"]["at"], report["counts"]["refuted"]) == (place, 2)

    button(page, f"Connect {place},unit=1").click()
    expect(button(page, "Disconnect mic488")).to_be_visible()
    expect(page.get_by_text("REAL", exact=True).first).to_be_visible()
    master = ModbusTcpClient("127.0.0.1", port=twin.tcp_port)
    assert master.connect()
    assert master.read_holding_registers(10010, count=4, device_id=1).registers == [0, 0, 0, 0]  # nothing moves, all is off
    master.close()


def test_a_device_at_a_serial_port_is_connected_moved_and_disconnected(studio: Studio, serve: Callable[..., Any]) -> None:
    twin = serve()
    page = studio.page(panel="Devices")
    address = page.get_by_label("Address of the device")
    address.fill(f"{twin.pty},unit=1")
    address.press("Enter")
    expect(button(page, "Disconnect mic488")).to_be_visible()
    expect(page.get_by_role("banner").get_by_text("REAL")).to_be_visible()
    in_tree = page.get_by_role("complementary", name="Controllers").get_by_role("region", name="mic488")
    expect(in_tree).to_have_css("outline-style", "none")

    show(page, "Axes")
    client = ModbusTcpClient("127.0.0.1", port=twin.tcp_port)
    assert client.connect()
    master = Master(client)
    assert master.status(1) == 0  # connecting has switched nothing on
    enable = button(page, "Enable mic488 M1")
    enable.click()
    expect(enable).to_have_attribute("aria-pressed", "true")
    assert master.status(1) != 0
    jog = button(page, "Jog mic488 M1 +")
    jog.hover()
    page.mouse.down()
    until(lambda: master.sample(1).velocity > 0, "the device moves")
    expect(in_tree).to_have_css("outline-style", "solid")
    expect(in_tree.get_by_role("img", name="moving").first).to_be_visible()
    page.screenshot(path=PICTURES / "device-moving.png")
    page.mouse.up()
    until(lambda: master.sample(1).velocity == 0.0, "it stands after the button was let go")
    expect(in_tree).to_have_css("outline-style", "none")
    assert studio.stands(1), "the twin beside it has not been told anything"
    assert studio.at(1) == 0.0
    client.close()

    show(page, "Devices")
    button(page, "Disconnect mic488").click()
    expect(page.get_by_text("No device is connected.")).to_be_visible()
    expect(in_tree).to_have_count(0)
    expect(page.get_by_role("banner").get_by_text("REAL")).to_have_count(0)


def test_a_twin_is_put_beside_a_device(studio: Studio, serve: Callable[..., Any], tmp_path: Path) -> None:
    config = tmp_path / "machine.cfg"
    config.write_text("[Axis0]\nUnit=1\nGear=100\nAcc=400\nDec=400\nVel=40\n")
    twin = serve("--config", str(config))
    page = studio.page(panel="Devices", viewport={"width": 1280, "height": 1000}, bypass_csp=True)
    address = page.get_by_label("Address of the device")
    address.fill(f"tcp://127.0.0.1:{twin.tcp_port},config={config}")
    address.press("Enter")
    button(page, "Start the digital shadow of mic488").click()
    beside = page.get_by_role("region", name="Digital shadow of mic488")
    expect(beside).to_contain_text("no difference so far")
    client = ModbusTcpClient("127.0.0.1", port=twin.tcp_port)
    assert client.connect()
    Master(client).reals(10052, 30.0)  # VMAX of M1, by a master that the studio does not know
    expect(beside).to_contain_text("first difference")
    expect(beside.get_by_role("row", name=re.compile("M1_VMAX"))).to_be_visible()
    client.close()
    assert serious(page) == []
    page.screenshot(path=PICTURES / "devices-shadow.png")
    button(page, "End the digital shadow of mic488").click()
    expect(beside).to_have_count(0)


@pytest.mark.parametrize(
    ("language", "chip", "bare"),
    [
        ("en-US", "position is unknown while it moves", "connect it with config=FILE"),
        ("pl-PL", "w ruchu jego pozycja jest nieznana", "podłącz go z config=PLIK"),
    ],
)
def test_a_twin_is_offered_only_where_there_can_be_one(
    studio: Studio, serve: Callable[..., Any], serve_m1486: Callable[..., Any], language: str, chip: str, bare: str
) -> None:
    for name, address in (("chip", f"tcp://127.0.0.1:{serve_m1486().tcp_port},kind=m1486"), ("bare", f"{serve().pty}")):
        answer = httpx.post(f"{studio.process.url}/api/do/connect", json={"address": address, "name": name})
        assert answer.status_code == 200, answer.text
    page = studio.page(language, panel="Devices" if language == "en-US" else "Urządzenia")
    expect(page.get_by_text("chip: ").filter(has_text=chip)).to_be_visible()
    expect(page.get_by_text("bare: ").filter(has_text=bare)).to_be_visible()
    expect(page.get_by_role("button", name=re.compile("twin beside|bliźniaka obok"))).to_have_count(0)
    page.screenshot(path=PICTURES / f"devices-no-twin-{language}.png")


@pytest.mark.parametrize("language", ["en-US", "pl-PL"])
def test_the_panel_on_a_tablet_in_the_dark(studio: Studio, language: str) -> None:
    name = "Devices" if language == "en-US" else "Urządzenia"
    page = studio.page(language, panel=name, viewport={"width": 834, "height": 1112}, color_scheme="dark")
    page.screenshot(path=PICTURES / f"devices-tablet-{language}.png")
    expect(page.get_by_role("heading", name="Search" if language == "en-US" else "Szukanie")).to_be_visible()


def test_a_search_is_cancelled_over_rest(start_studio: Callable[..., Any]) -> None:
    process = start_studio()
    silent = socket.create_server(("127.0.0.1", 0))
    place = f"rtu-tcp://127.0.0.1:{silent.getsockname()[1]}"

    def ask(name: str, **fields: object) -> Any:
        return httpx.post(f"{process.url}/api/do/{name}", json=fields).json()

    assert ask("work")["ok"] is None
    assert ask("scan", places=[place], kind="plc")["error"]["message"] == "kind plc: permitted are any, mic488, m1486"
    assert ask("scan", places=[place], kind="mic488", units="2-247", timeout=1.0)["ok"] is None
    assert ask("verify", address=place)["error"]["message"] == "scan is running: wait, or cancel it"
    assert ask("cancel_work")["ok"] is None
    until(lambda: not ask("work")["ok"]["is_running"], "the search has ended")
    assert ask("work")["ok"]["problems"] == ["cancelled"]
    assert ask("work")["ok"]["found"] == []
    silent.close()
