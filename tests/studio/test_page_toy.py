"""The page with a kind of controller and a kind of device that only the tests know."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from playwright.sync_api import expect
from studio_page import Studio, show
from tests.studio.conftest import TABLE, StudioWorld

SUPPORT = Path(__file__).parents[1] / "support"
COMMAND = f"""
import sys
sys.path.insert(0, {str(SUPPORT)!r})
from toy.kind import registered
from steptwin.cli import main
with registered():
    main()
"""
WORLD = f"""{TABLE}
    [[line]]
    name = "wire"
    kind = "toys"
    [[toy]]
    name = "plaything"
    line = "wire"
"""


@pytest.fixture
def studio_world() -> StudioWorld:
    return StudioWorld(WORLD, command=(sys.executable, "-c", COMMAND))


def test_a_controller_that_the_page_does_not_know_is_shown(studio: Studio) -> None:
    page = studio.page(panel="Overview")
    expect(page.get_by_role("region", name="Overview").last).to_contain_text("plaything")
    show(page, "Axes")
    axes = page.get_by_role("region", name="Axes", exact=True).last
    expect(axes).to_contain_text("plaything")
    show(page, "I/O")
    expect(page.get_by_role("region", name="I/O", exact=True).last).to_contain_text("BUSY")


def test_devices_are_searched_by_the_kinds_that_the_service_names(studio: Studio) -> None:
    page = studio.page(panel="Devices")
    kinds = page.get_by_role("combobox", name="Kind")
    expect(kinds.get_by_role("option")).to_have_text(["all", "MIC488", "M1486"])
    expect(page.get_by_role("region", name="Devices", exact=True).last).to_contain_text("M1486: kind=m1486, chip=0…F")
