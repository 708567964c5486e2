"""The filter and folding of many controllers, in a browser."""

from __future__ import annotations

import pytest
from playwright.sync_api import Page, expect
from studio_page import PICTURES, Studio, button, serious, show
from tests.studio.conftest import StudioWorld

PRESSES = [f"press-{number:02}" for number in range(1, 16)]
DRUMS = [f"drum-{number:02}" for number in range(1, 16)]
WORLD = (
    """[world]
name = "hall"
[[line]]
name = "bus"
kind = "modbus"
tcp = "127.0.0.1:0"
[[line]]
name = "chips"
kind = "m1486"
[[axis]]
name = "gantry"
drive = "press-11.M2"
[[axis]]
name = "ram"
drive = "press-12.M1"
[[gate]]
name = "joined"
kind = "and"
inputs = ["press-11.OUT1", "press-11.OUT2"]
[[gate]]
name = "elsewhere"
kind = "and"
inputs = ["press-12.OUT1", "press-12.OUT2"]
[[relay]]
name = "behind"
[[wire]]
from = "elsewhere.out"
to = "behind.coil"
"""
    + "".join(f'[[mic488]]\nname = "{name}"\nline = "bus"\nunit = {unit}\n' for unit, name in enumerate(PRESSES, 1))
    + "".join(f'[[m1486]]\nname = "{name}"\nline = "chips"\naddress = {address}\n' for address, name in enumerate(DRUMS))
)


@pytest.fixture
def studio_world() -> StudioWorld:
    return StudioWorld(WORLD)


def check_what_can_be_chosen(page: Page) -> None:
    """While press-11 is shown alone."""
    panels = page.get_by_role("main")
    for panel in ("Registers", "Configuration"):
        show(page, panel)
        expect(panels.get_by_label("Controller", exact=True).locator("option")).to_have_text(["press-11"])
    show(page, "Calculator")
    axes = [f"press-11 M{axis}" for axis in (1, 2, 3, 4)]
    expect(panels.get_by_label("Axis", exact=True).locator("option")).to_have_text(axes)
    show(page, "Scope")
    button(page, "Choose signals").click()
    expect(panels.get_by_label("press-11 IN1", exact=True)).to_be_visible()
    expect(panels.get_by_label("press-10 IN1", exact=True)).to_have_count(0)


def test_one_of_thirty_controllers_is_found_in_all_lists(studio: Studio) -> None:
    page = studio.page(bypass_csp=True)
    tree, panels = page.get_by_role("complementary", name="Controllers"), page.get_by_role("main")
    found = tree.get_by_role("region", name="press-11")
    expect(tree.get_by_role("heading")).to_have_count(30 + 1)  # and the lines
    expect(page.get_by_role("region", name="press-11 M2", exact=True)).to_have_count(0)  # not of the first axes

    page.screenshot(path=PICTURES / "filter-none.png")
    page.keyboard.press("f")
    page.keyboard.type("MIC488 Gantry")
    expect(page.get_by_text("1 of 30 controllers")).to_be_visible()
    expect(tree.get_by_role("heading")).to_have_count(1 + 1)
    expect(found).to_be_visible()
    expect(page.get_by_role("region", name="press-11 M2", exact=True)).to_be_visible()
    page.screenshot(path=PICTURES / "filter-axes.png")

    show(page, "I/O")
    pins = panels.get_by_role("region", name="press-11")
    expect(panels.get_by_role("heading", level=2)).to_have_count(1)
    expect(pins.get_by_role("group", name="Inputs", exact=True)).to_be_visible()
    fold = pins.get_by_role("button", name="Parts of press-11")
    fold.press("Enter")
    expect(fold).to_have_attribute("aria-expanded", "false")
    expect(pins.get_by_role("group")).to_have_count(0)
    expect(found.get_by_role("listitem")).to_have_count(0)
    expect(found.get_by_role("img", name="at rest")).to_have_count(4)  # whether it moves is seen all the same

    button(page, "Wiring").click()
    expect(panels.get_by_role("heading", name="elsewhere")).to_have_count(0)
    expect(panels.get_by_role("heading", name="joined")).to_be_visible()
    show(page, "Machine")
    drawn = panels.locator("[data-name]")
    expect(drawn).to_have_count(2)
    assert drawn.evaluate_all("cards => cards.map(card => card.dataset.name)") == ["gantry", "joined"]
    button(page, "Arrange").click()
    assert {"ram", "elsewhere", "behind"} < {*drawn.evaluate_all("cards => cards.map(card => card.dataset.name)")}
    button(page, "✓ Done").click()
    expect(drawn).to_have_count(2)
    check_what_can_be_chosen(page)

    show(page, "Overview")
    controllers = panels.get_by_role("table").first
    expect(controllers.get_by_role("rowheader")).to_have_text(["press-11"])
    button(page, "Show all").press("Enter")
    expect(controllers.get_by_role("rowheader")).to_have_count(30)
    button(page, "Fold all").press("Enter")
    show(page, "Axes")
    button(panels.page, "Unfold all").wait_for()
    expect(tree.get_by_role("listitem")).to_have_count(0)
    expect(panels.get_by_role("button", name="Parts of", exact=False)).to_have_count(30)
    panels.get_by_role("button", name="Parts of drum-03").press("Enter")
    expect(page.get_by_role("region", name="drum-03", exact=True)).to_have_count(2)  # in the tree, and its axis
    expect(tree.get_by_role("listitem")).to_have_count(1)
    page.screenshot(path=PICTURES / "filter-folded.png")
    assert serious(page) == []

    polish = studio.page("pl-PL", panel="Osie")
    polish.get_by_label("Filtr sterowników").last.fill("drum-07")
    expect(polish.get_by_text("sterowniki: 1 z 30")).to_be_visible()
    polish.screenshot(path=PICTURES / "filter-pl.png")
