"""The arrangement of the machine panel: by mouse and keyboard, kept in the description of the world."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import httpx
import pytest
from playwright.sync_api import Locator, Page, expect
from studio_page import Studio, button, downloaded, show
from tests.studio.conftest import Process, StudioWorld

from steptwin.simulation.describe.arrangement import DrawnPosition
from steptwin.simulation.describe.description import read_world

WORLD = """
    [world]
    name = "cell"
    [[line]]
    name = "bus"
    kind = "modbus"
    tcp = "127.0.0.1:0"
    [[mic488]]
    name = "table"
    line = "bus"
    [[axis]]
    name = "x"
    drive = "table.M1"
    pitch = 4.0
    travel = [0.0, 100.0]
    [[axis]]
    name = "y"
    drive = "table.M2"
    pitch = 4.0
    travel = [0.0, 100.0]
    [[button]]
    name = "go"
    to = "table.IN1"
"""


@pytest.fixture
def studio_world() -> StudioWorld:
    return StudioWorld(WORLD)


def ask(process: Process, request: str, **fields: object) -> Any:
    return httpx.post(f"{process.url}/api/do/{request}", json=fields, timeout=60).json()


def kept(process: Process) -> tuple[DrawnPosition, ...]:
    return read_world("hall", (process.directory / "hall.toml").read_text()).drawing


def test_places_are_kept_in_the_description(start_studio: Callable[..., Process]) -> None:
    studio = start_studio()
    path = studio.directory / "hall.toml"
    assert ask(studio, "drawing")["ok"] == {"places": {}, "file": str(path)}
    saved = ask(studio, "save_drawing", places={"x": [40, 0], "tool path": [0, 200]})["ok"]
    assert saved == {"file": str(path), "name": "hall.toml", "text": path.read_text()}
    assert ask(studio, "drawing")["ok"]["places"] == {"x": [40, 0], "tool path": [0, 200]}
    assert kept(studio) == (DrawnPosition("x", 40, 0), DrawnPosition("tool path", 0, 200))
    path.write_text(path.read_text().replace('name = "cell"', 'name = "cell"  # changed meanwhile'))
    assert "ok" in ask(studio, "save_drawing", places={})
    assert "# changed meanwhile" in path.read_text()
    assert kept(studio) == ()


def test_wrong_places_are_refused(start_studio: Callable[..., Process]) -> None:
    studio = start_studio()
    before = (studio.directory / "hall.toml").read_text()
    assert "no axis or element is called 'z'" in ask(studio, "save_drawing", places={"z": [0, 0]})["error"]["message"]
    for wrong in ([0], [0, -10], [0, 1.5], "here", [0, 10**9]):
        assert ask(studio, "save_drawing", places={"x": wrong})["error"]["code"] == "misuse"
    assert (studio.directory / "hall.toml").read_text() == before


def card(page: Page, name: str) -> Locator:
    return page.locator(f'[data-name="{name}"]')


def corner(page: Page, name: str) -> tuple[int, int]:
    style = card(page, name).get_attribute("style") or ""
    left, top = re.search(r"left: (\d+)px", style), re.search(r"top: (\d+)px", style)
    assert left is not None, style
    assert top is not None, style
    return int(left[1]), int(top[1])


def test_drawing_is_arranged_by_mouse_and_keyboard_undone_and_saved(studio: Studio) -> None:
    page = studio.page(panel="Machine")
    button(page, "Arrange").click()
    handle = button(page, "Move y")
    before = corner(page, "y")
    box = handle.bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 20, box["y"] + 20)
    page.mouse.down()
    page.mouse.move(box["x"] + 60, box["y"] + 60, steps=4)
    page.mouse.move(box["x"] + 120, box["y"] + 150)
    page.mouse.up()
    dragged = (before[0] + 100, before[1] + 130)
    assert corner(page, "y") == dragged
    handle.press("ArrowDown")
    handle.press("Shift+ArrowRight")
    assert corner(page, "y") == (dragged[0] + 50, dragged[1] + 10)
    page.keyboard.press("Control+z")
    button(page, "↶ Undo move").click()
    assert corner(page, "y") == dragged
    button(page, "✓ Done").click()
    button(page, "Save arrangement").click()
    expect(page.get_by_text("has the change")).to_be_visible()
    assert DrawnPosition("y", *dragged) in kept(studio.process)
    again = studio.page(panel="Machine")
    expect(card(again, "y")).to_have_css("left", f"{dragged[0]}px")
    button(again, "Automatic arrangement").click()
    expect(card(again, "y")).to_have_css("position", "relative")
    button(again, "Save arrangement").click()
    expect(again.get_by_text("has the change")).to_be_visible()
    assert kept(studio.process) == ()


def test_the_description_of_a_branch_is_in_no_file_and_is_downloaded(studio: Studio) -> None:
    before = (studio.process.directory / "hall.toml").read_text()
    page = studio.page(panel=None)
    page.goto(ask(studio.process, "start_branch")["ok"]["url"])
    show(page, "Machine")
    button(page, "Arrange").click()
    button(page, "Move x").press("ArrowRight")
    x, y = corner(page, "x")
    text = downloaded(page, "Save arrangement").decode()
    expect(page.get_by_text("cannot be written here")).to_be_visible()
    assert DrawnPosition("x", x, y) in read_world("cell", text).drawing
    assert (studio.process.directory / "hall.toml").read_text() == before
