"""Faults of elements, set on the page and seen on the machine that it draws."""

from __future__ import annotations

import re

import httpx
import pytest
from playwright.sync_api import expect
from studio_page import Studio, button, enable, show
from tests.conftest import until
from tests.studio.conftest import TABLE, StudioWorld

WORLD = (
    TABLE
    + """
    [[axis]]
    name = "x"
    drive = "table.M1"
    kind = "rotary"
    [[shaft]]
    name = "wheel"
    axis = "x"
    ratio = 36.0
    [[gate]]
    name = "both"
    kind = "and"
    inputs = ["table.OUT1", "table.OUT2"]
"""
)


@pytest.fixture
def studio_world() -> StudioWorld:
    return StudioWorld(WORLD)


def angle(studio: Studio) -> float:
    """Of the wheel, degrees, from the API of the studio."""
    answer = httpx.get(f"{studio.process.url}/api/points?names=wheel.angle").json()
    return float(answer["ok"][0]["value"])


def test_a_coupling_slips_and_holds_again(studio: Studio) -> None:
    page = studio.page()
    enable(page)
    show(page, "Faults")
    page.get_by_label("Kind of fault").select_option("slipping-coupling")
    element = page.get_by_label("element", exact=True)
    # The gate has no coupling.
    expect(element.locator("option")).to_have_text([re.compile("."), "wheel"])
    element.select_option("wheel")
    button(page, "Set fault").click()
    expect(page.get_by_role("row", name=re.compile("^slipping-coupling "))).to_contain_text("element=wheel")
    studio.master.move(1, 5.0)
    until(lambda: studio.at(1) == 5.0 and studio.stands(1), "the axis has turned")
    assert angle(studio) == 0.0
    button(page, "Clear slipping-coupling").click()
    expect(page.get_by_text("No fault is set.")).to_be_visible()
    studio.master.move(1, 8.0)
    until(lambda: studio.at(1) == 8.0 and studio.stands(1), "the axis has turned on")
    assert angle(studio) > 0.0
    page.get_by_label("Kind of fault").select_option("stuck-output")
    expect(element.locator("option")).to_have_text([re.compile("."), "both"])


def test_an_output_sticks_and_only_inputs_bounce(studio: Studio) -> None:
    page = studio.page()
    show(page, "Faults")
    pin = page.get_by_label("pin", exact=True)
    page.get_by_label("Kind of fault").select_option("bounce")
    expect(pin.locator("option", has_text=re.compile("^OUT1$"))).to_have_count(0)
    expect(pin.locator("option", has_text=re.compile("^IN1$"))).to_have_count(1)
    page.get_by_label("Kind of fault").select_option("stuck")
    pin.select_option("OUT1")
    page.get_by_label("value", exact=True).select_option("1")
    button(page, "Set fault").click()
    expect(page.get_by_role("row", name=re.compile("^stuck "))).to_contain_text("pin=OUT1")
    answer = httpx.get(f"{studio.process.url}/api/points?names=both.in1").json()
    assert answer["ok"][0]["value"] == 1.0
