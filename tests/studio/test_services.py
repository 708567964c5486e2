"""Gateways, history, audit log and campaigns of a studio: over REST with clients of others, and in the page."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest
from campaigns import CAMPAIGN
from mosquitto import free_port
from node_client import NodeClient
from playwright.sync_api import Browser, expect
from studio_page import PICTURES, Studio, button, downloaded, serious, show
from tests.conftest import until
from tests.studio.conftest import TABLE, Process, StudioWorld

PLANT = (
    TABLE
    + f"""
    [[axis]]
    name = "x"
    drive = "table.M1"
    pitch = 4.0
    start = 10.0
    [gateway.opcua]
    listen = "127.0.0.1:0"
    [gateway.epics]
    prefix = "ST:"
    listen = "127.0.0.1:0"
    [gateway.mqtt]
    broker = "127.0.0.1:{free_port()}"
    [gateway.prometheus]
    listen = "127.0.0.1:0"
    [history]
    database = "sqlite:///kept.db"
    """
)
CAMPAIGN_OF_HALL = CAMPAIGN.replace("world.toml", "hall.toml").replace("runs = 40", "runs = 6") + (
    '\n[[property]]\nname = "stays closed"\nnever = "table.IN1"\n'
)


@pytest.fixture
def studio_world() -> StudioWorld:
    return StudioWorld(PLANT, {"doors.toml": CAMPAIGN_OF_HALL, "broken.toml": "[campaign]\nworld ="})


def ask(process: Process, request: str, /, **fields: object) -> Any:
    return httpx.post(f"{process.url}/api/do/{request}", json=fields, timeout=60).json()


def ok(process: Process, request: str, /, **fields: object) -> Any:
    answer = ask(process, request, **fields)
    assert "ok" in answer, answer
    return answer["ok"]


def gateways(process: Process) -> dict[str, Any]:
    return {one["kind"]: one for one in ok(process, "gateways")}


def kept(process: Process, **interval: float) -> Any:
    (found,) = ok(process, "history_values", points=["table.M1.position"], **interval)["series"]
    return found


@contextmanager
def reader_of(record: str, port: int) -> Generator[None]:
    """A client of Channel Access, pyepics, in a process of its own."""
    environment = {**os.environ, "EPICS_CA_ADDR_LIST": f"127.0.0.1:{port}", "EPICS_CA_AUTO_ADDR_LIST": "NO"}
    program = f"import epics; epics.PV({record!r}, auto_monitor=True).wait_for_connection(60); input()"
    with subprocess.Popen([sys.executable, "-c", program], env=environment, stdin=subprocess.PIPE) as process:
        try:
            yield
        finally:
            process.kill()


def move(process: Process, to: float) -> None:
    ok(process, "enable", controller="table", axis=1)
    ok(process, "move", controller="table", axis=1, to=to)
    until(lambda: ok(process, "read", points=["table.M1.position"])[0]["value"] == to, "the axis is there")


def test_who_uses_the_gateways_and_what_has_been_kept(
    start_studio: Callable[..., Process], require_peer: Callable[[str], str], tmp_path: Path
) -> None:
    studio = start_studio()
    found = gateways(studio)
    assert {kind: one["is_up"] for kind, one in found.items()} == {
        "history": True,
        "opcua": True,
        "epics": True,
        "mqtt": False,
        "prometheus": True,
    }
    assert "refused" in found["mqtt"]["text"]
    assert {kind: found[kind]["shown"] > 20 for kind in ("opcua", "epics", "mqtt")} == dict.fromkeys(
        ("opcua", "epics", "mqtt"), True
    )
    assert [found[kind]["clients"] for kind in ("opcua", "epics", "prometheus")] == [[], [], []]

    with NodeClient(require_peer("node"), "opcua.js", tmp_path) as client:
        client("connect", url=studio.end_points["opcua"]["url"], folder=str(tmp_path / "pki"))
        client("subscribe", node="ns=2;s=table.M1.position", period=50)
        (reader,) = gateways(studio)["opcua"]["clients"]
        assert reader["follows"] == ["table.M1.position"]
        assert reader["role"] == "engineer"
        assert reader["place"].startswith("127.0.0.1:")
        client("close")
    until(lambda: gateways(studio)["opcua"]["clients"] == [], "the client has gone")

    httpx.get(studio.end_points["prometheus"]["url"], headers={"user-agent": "Prometheus/3"})
    assert gateways(studio)["prometheus"]["clients"] == [
        {"name": "Prometheus/3", "place": "127.0.0.1", "role": "viewer", "follows": []}
    ]

    with reader_of("ST:table:M1.RBV", studio.end_points["epics"]["port"]):
        until(lambda: [one["follows"] for one in gateways(studio)["epics"]["clients"]] == [["ST:table:M1.RBV"]], "it is listed")

    move(studio, 5)
    until(lambda: kept(studio)["values"][-1:] == [5], "the motion has been kept")
    history = ok(studio, "history")
    assert [run["is_over"] for run in history["runs"]] == [False]
    assert {"point": "table.M1.position", "unit": "mm", "is_text": False} in history["points"]
    position = kept(studio)
    assert position["is_motion"]
    assert len(position["at_s"]) > 4
    middle = position["at_s"][-2]
    part = kept(studio, from_s=middle / 2, to_s=middle)
    assert part["at_s"][0] == pytest.approx(middle / 2)
    assert part["at_s"][-1] <= middle
    assert ok(studio, "compare_history", run=-1, other=-1) == []
    moves = [one for one in ok(studio, "history_writes") if one["what"].startswith("move ")]
    assert [(one["controller"], one["what"], one["outcome"]) for one in moves] == [("table", "move axis = 1, to = 5", "done")]
    assert moves[0]["source"].endswith(" (engineer)")
    assert 0 < moves[0]["at_s"] < position["at_s"][-1]
    assert ok(studio, "history_writes", from_s=0, to_s=moves[0]["at_s"] / 2) == []
    wrong = ask(studio, "history_values", points=["table.M1.place"])["error"]["message"]
    assert wrong == "no point 'table.M1.place' has been kept"
    assert "this is before" in ask(studio, "history_values", points=["table.M1.position"], from_s=5, to_s=1)["error"]["message"]
    late = ask(studio, "history_values", points=["table.M1.position"], to_s=1e300)["error"]
    assert late["code"] == "misuse"
    assert "to_s: 1e+300: expected a number from 0 to" in late["message"]


def test_a_campaign_is_run_and_its_report_reaches_nothing(start_studio: Callable[..., Process]) -> None:
    studio = start_studio()

    def found() -> dict[str, Any]:
        return {one["campaign"]: one for one in ok(studio, "campaigns")}

    assert found()["broken.toml"]["error"].startswith("Invalid value (at")
    assert "ready" not in found()
    doors = found()["doors.toml"]
    assert (doors["done"], doors["total"], doors["result"], doors["is_running"]) == (0, 6, None, False)
    assert ask(studio, "run_campaign", campaign="window.toml")["error"]["code"] == "misuse"
    ok(studio, "run_campaign", campaign="doors.toml")
    again = ask(studio, "run_campaign", campaign="doors.toml")["error"]
    assert (again["code"], again["message"]) == ("refusal", "doors.toml runs: one campaign at a time")
    until(lambda: not found()["doors.toml"]["is_running"], "it has ended")
    doors = found()["doors.toml"]
    assert (doors["done"], doors["error"]) == (6, None)
    assert doors["result"]["failed"] == doors["failed"] == 6  # the door opens before the end of every run
    (closed,) = doors["result"]["properties"]
    assert (closed["name"], closed["failed"]) == ("stays closed", 6)

    report = httpx.get(f"{studio.url}/api/campaigns/{doors['results']}/report.html")
    assert "stays closed" in report.text
    policies = report.headers.get_list("content-security-policy")
    assert [policy.split(";")[0] for policy in policies] == ["sandbox allow-scripts allow-downloads"]
    for file in ("doors.toml", "doors.results/results.db", "doors.results/../hall.toml", "doors.results/none.html"):
        answer = httpx.get(f"{studio.url}/api/campaigns/{file.replace('..', '%2e%2e')}")
        assert answer.status_code == 400, file


def test_the_page_has_them(start_studio: Callable[..., Process], browser: Browser) -> None:
    process = start_studio()
    move(process, 5)
    studio = Studio(process, browser)
    page = studio.page(panel="Gateways", bypass_csp=True)
    table = page.get_by_role("table", name="Gateways")
    expect(table.get_by_role("row", name="OPC UA")).to_contain_text("up")
    expect(table.get_by_role("row", name="MQTT")).to_contain_text("refused")
    httpx.get(process.end_points["prometheus"]["url"], headers={"user-agent": "Prometheus/3"})
    expect(page.get_by_role("table", name="Clients of metrics")).to_contain_text("Prometheus/3")
    page.screenshot(path=PICTURES / "gateways.png")
    wrong = serious(page)

    show(page, "History")
    until(lambda: kept(process)["values"][-1:] == [5], "the motion has been kept")
    button(page, "Read again").click()
    written = page.get_by_role("table", name="Writes and commands").get_by_role("row").filter(has_text="move axis = 1, to = 5")
    expect(written).to_contain_text("done")
    chart = page.get_by_role("img", name="table.M1.position from 0")
    expect(chart.locator("polyline")).to_have_count(1)
    page.get_by_role("searchbox", name="Add a point").fill("table.M1.status")
    button(page, "Add table.M1.status").click()
    expect(page.get_by_role("img", name="table.M1.status from 0")).to_contain_text("moving to position")
    page.screenshot(path=PICTURES / "history.png")
    wrong += serious(page)
    box = chart.bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + box["width"] * 0.25, box["y"] + 20)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * 0.5, box["y"] + 20)
    page.mouse.up()
    end_s = process_length(process)
    until(lambda: abs(float(page.get_by_role("textbox", name="From").input_value()) - end_s / 4) < end_s / 20, "it is zoomed in")
    rows = downloaded(page, "Save as CSV").decode().splitlines()
    assert rows[0] == "point,unit,seconds,value"
    assert any(row.startswith('"table.M1.position","mm",') for row in rows)

    show(page, "Audit log")
    log = page.get_by_role("table", name="Audit log")
    expect(log.get_by_role("row").nth(1)).to_contain_text("controller table, axis 1, to 5")
    page.get_by_role("searchbox", name="Show only").fill("enable table")
    expect(log.get_by_role("row")).to_have_count(2)
    page.screenshot(path=PICTURES / "audit.png")
    wrong += serious(page)

    show(page, "Campaigns")
    button(page, "Run doors").click()
    doors = page.get_by_role("region", name="doors")
    expect(doors).to_contain_text("0.0 % of 6 runs pass")
    with page.context.expect_page() as opened:
        doors.get_by_role("link", name="Report of doors").click()
    expect(opened.value.get_by_role("heading", name="Failures by cause")).to_be_visible()
    page.screenshot(path=PICTURES / "campaigns.png")
    wrong += serious(page)
    studio.close()
    assert studio.complaints == []
    assert wrong == []


def process_length(process: Process) -> float:
    return ok(process, "history")["runs"][-1]["length_s"]
