"""Workpieces in the picture of the machine: where they are, by the message of the studio."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Locator, Page, expect
from studio_page import PICTURES, Studio, button
from tests.conftest import until
from tests.studio.conftest import TABLE, StudioWorld

WORLD = (
    TABLE
    + """
    [[cylinder]]
    name = "lift"
    extend = "table.OUT1"
    stroke = 60.0
    at = [0, 0, 250]
    along = "-z"
    [[vacuum]]
    name = "cup"
    ejector = "table.OUT2"
    on = "lift"
    at = [0, 0, -70]
    [[nest]]
    name = "tray"
    at = [0, 0, 100]
    cells = [2, 1]
    workpiece = [40, 30, 20]
    filled = 2
    [[gripper]]
    name = "jaws"
    close = "table.OUT3"
    at = [50, 0, 110]
    along = "+y"
    stroke = 50
    [[beam]]
    name = "barrier"
    at = [20, -60, 165]
    along = "-x"
    length = 80
    to = "table.IN1"
    sees = ["workpieces"]
    [[conveyor]]
    name = "belt"
    length = 200.0
    speed = 20.0
    width = 60
    run = "table.OUT4"
    workpiece = [25, 30]
    feed_every = "4 s"
    at = [-60, -80, 60]
    [[script]]
    name = "go"
    at = "500 ms"
    steps = [
      { write = { "table.OUT1" = 1, "table.OUT4" = 1 } },
      { wait = "1 s" },
      { write = { "table.OUT2" = 1, "table.OUT3" = 1 } },
      { wait = "1 s" },
      { write = { "table.OUT1" = 0 } },
    ]
"""
)


@pytest.fixture
def studio_world() -> StudioWorld:
    return StudioWorld(WORLD)


def pieces(page: Page, on: str) -> Locator:
    return page.locator(f'svg .piece[data-element="{on}"]')


def place(part: Locator) -> tuple[float, float, float, float]:
    """Left, upper edge, right and lower edge."""
    box = part.bounding_box()
    assert box is not None
    return box["x"], box["y"], box["x"] + box["width"], box["y"] + box["height"]


def test_workpieces_are_drawn_where_they_are(studio: Studio) -> None:
    page = studio.page(panel="Machine")
    button(page, "Front").click()
    held = pieces(page, "cup")
    expect(held).to_have_text("tray.1")
    expect(pieces(page, "jaws")).to_have_text("tray.2")
    expect(page.locator('svg .lamp[data-element="cup"]')).to_have_class(re.compile(r"\bon\b"))
    # The lip of the cup is its lowest part: the workpiece hangs at it.
    lip = page.locator('svg .belt[data-element="cup"]').first
    until(lambda: abs(place(held)[1] - place(lip)[3]) < 2, "the workpiece hangs at the cup")
    until(lambda: place(held)[3] < place(pieces(page, "jaws"))[1], "it has been lifted")
    PICTURES.mkdir(parents=True, exist_ok=True)
    page.screenshot(path=PICTURES / "workpieces.png")
    first = pieces(page, "belt").filter(has_text=re.compile("^belt"))
    begin = place(first.first)[0]
    until(lambda: place(first.first)[0] > begin + 5, "a workpiece moves on its belt")
    expect(pieces(page, "tray")).to_have_count(0)
    for _ in range(30):
        page.keyboard.press(",")
        page.wait_for_timeout(200)
        if pieces(page, "tray").count() == 2:
            break
    expect(pieces(page, "tray")).to_have_count(2)
    expect(held).to_have_count(0)
    page.keyboard.press(".")
    expect(held).to_have_count(1)
