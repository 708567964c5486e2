"""No panel is wider than its pane, on a phone and where two share a page, in a browser."""

from __future__ import annotations

from collections.abc import Callable

import httpx
import pytest
from mosquitto import free_port
from playwright.sync_api import Browser
from studio_page import Studio, button, panels_of, show, wider_than_panes
from tests.studio.conftest import Process, StudioWorld

from steptwin.live.studio.demo import describe_demo

PLANT = """
[gateway.opcua]
listen = "127.0.0.1:0"
[gateway.mqtt]
broker = "127.0.0.1:{port}"
[gateway.prometheus]
listen = "127.0.0.1:0"
[history]
database = "sqlite:///kept.db"
"""
DONE = (
    ("enable", {"controller": "table", "axis": 1}),
    ("move", {"controller": "table", "axis": 7, "to": 1e9}),  # refused
    ("save_recording", {"name": "a_recording_with_a_long_name"}),
)


@pytest.fixture
def studio_world() -> StudioWorld:
    return StudioWorld(describe_demo(free_ports=True) + PLANT.format(port=free_port()))


def test_no_panel_is_wider_than_its_pane(start_studio: Callable[..., Process], browser: Browser) -> None:
    """Nor is anything cut off in it, but for code, drawings and texts that end with an ellipsis."""
    process = start_studio()
    for request, fields in DONE:
        httpx.post(f"{process.url}/api/do/{request}", json=fields, timeout=60)
    studio = Studio(process, browser)
    found: dict[str, list[str]] = {}
    for size, width, height in (("phone", 390, 844), ("two panes", 1440, 900)):
        page = studio.page(viewport={"width": width, "height": height})
        if size == "two panes":
            button(page, "Open beside").click()
        for panel in panels_of(page):
            show(page, panel)
            page.wait_for_timeout(300)
            found[f"{size}, {panel}"] = wider_than_panes(page)
        page.context.close()
    studio.close()
    assert len(found) == 2 * 18
    assert {where: parts for where, parts in found.items() if parts} == {}
