"""Things of the machine in space are moved in the page, which changes their places in the description."""

from __future__ import annotations

import pytest
from playwright.sync_api import Locator, Page, expect
from studio_page import PICTURES, Studio, button
from tests.studio.conftest import StudioWorld

WORLD = """
[[mic488]]
name = "table"
line = "bus"
[[line]]
name = "bus"
kind = "modbus"
tcp = "127.0.0.1:0"
[[use]]
name = "left"
file = "post.toml"
[[body]]
name = "plate"
size = [400, 300, 10]
[[body]]
name = "gate"  # which opens
at = [ 50.5, 0,  10.0 ]   # in front
size = [20, 100, 200]
[[body]]
name = "handle"
on = "gate"
at = [0, 0, 200]
size = [10, 10, 20]
"""
POST = '[parameters]\nat = [-100, 0, 10]\n[[body]]\nname = "post"\nat = "{at}"\nsize = [20, 20, 200]\n'
NAME = "Move things"


@pytest.fixture
def studio_world() -> StudioWorld:
    return StudioWorld(WORLD, {"post.toml": POST})


def drag(page: Page, name: str, right_mm: float, up_mm: float) -> Locator:
    box = page.locator(f'svg .solid[data-element="{name}"]').first.bounding_box()
    ruler = page.locator(".ruler").bounding_box()
    assert box is not None
    assert ruler is not None
    scale = ruler["width"] / float(page.locator(".ruler").inner_text().split()[0])
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + right_mm * scale, y - up_mm * scale, steps=3)
    page.mouse.up()
    return page.get_by_role("group", name=NAME)


def test_things_are_moved_by_mouse_and_keys_and_the_description_is_changed_on_request(studio: Studio) -> None:
    page = studio.page(panel="Machine")
    file = studio.process.directory / "hall.toml"
    button(page, NAME).click()
    bar = drag(page, "gate", 61.3, 20.2)
    expect(bar).to_contain_text("at = [ 50.5, 0,  10.0 ] → at = [ 110.0, 0,  30.0 ]")
    expect(page.locator("svg .copies text")).to_have_text("110, 0, 30")
    expect(page.locator('svg .copies [data-element="handle"]')).not_to_have_count(0)
    page.screenshot(path=PICTURES / "move.png")
    assert file.read_text() == WORLD
    button(page, "Apply").click()
    expect(bar).to_contain_text("gate is written, line 17")
    assert file.read_text() == WORLD.replace("[ 50.5, 0,  10.0 ]", "[ 110.0, 0,  30.0 ]")
    button(page, "Top").click()  # the picture shows what is written, too
    expect(page.locator("svg .copies text")).to_have_text("110, 0, 30")
    button(page, "↶ Undo move").click()
    expect(page.locator("svg .copies text")).to_have_count(0)
    assert file.read_text() == WORLD

    page.get_by_label("Selected").select_option("plate")
    picture = page.get_by_role("application", name="Picture of the machine")
    for key in ("ArrowRight", "ArrowRight", "Alt+ArrowUp"):
        picture.press(key)
    expect(bar).to_contain_text("new line → at = [10, 0.1, 0]")
    picture.press("Escape")
    expect(button(page, "Apply")).to_have_count(0)
    picture.press("ArrowDown")
    expect(bar).to_contain_text("new line → at = [0, -5, 0]")
    button(page, "Discard").click()
    assert file.read_text() == WORLD


def test_what_is_wrong_then_and_what_is_refused_is_said_before(studio: Studio) -> None:
    page = studio.page(panel="Machine")
    button(page, "Side").click()
    button(page, NAME).click()
    page.get_by_label("Selected").select_option("handle")
    bar = drag(page, "handle", 0, -100)
    expect(bar).to_contain_text("handle lies inside gate")
    page.get_by_label("Selected").select_option("left_post")
    drag(page, "left_post", 20, 0)
    expect(bar).to_contain_text("is in line 5 of post.toml, which the [[use]] in line 9 puts in with its parameters")
    expect(button(page, "Apply")).to_have_count(0)
