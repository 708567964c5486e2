"""The main action of every panel with the keyboard alone; the world is asked whether it was done."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import httpx
from playwright.sync_api import Browser, Page, expect
from studio_page import Studio, button, tab_to, tab_until
from tests.conftest import until
from tests.studio.conftest import Process


def go(page: Page, panel: str) -> None:
    """To a panel, with the tab key and Enter."""
    name = json.dumps(panel)
    tab_until(page, f"(one) => one.closest('nav') && [one.ariaLabel, one.innerText.trim()].includes({name})")
    page.keyboard.press("Enter")
    expect(page.get_by_role("region", name=panel, exact=True).last).not_to_be_empty()


def ask(studio: Studio, request: str, /, **fields: object) -> Any:
    response = httpx.post(f"{studio.process.url}/api/do/{request}", json=fields)
    assert response.status_code == 200, response.text
    return response.json()["ok"]


def press(page: Page, name: str) -> None:
    tab_to(page, name)
    page.keyboard.press("Enter")


def enter(page: Page, name: str, text: str) -> None:
    tab_to(page, name)
    page.keyboard.press("Control+a")
    page.keyboard.type(text)
    page.keyboard.press("Enter")


def test_inputs_registers_time_and_frames(studio: Studio) -> None:
    page = studio.page(panel=None)
    go(page, "I/O")
    press(page, "Set IN3")
    until(lambda: studio.master.inputs(5002, 1) == [True], "the master sees IN3")

    go(page, "Registers")
    tab_to(page, "Find a point")
    page.keyboard.type("M1_ACC")
    expect(page.get_by_label("New value of M1_ACC")).to_be_visible()
    enter(page, "New value of M1_ACC", "123")
    until(lambda: studio.master.real(studio.master.words(10036, 2)) == 123.0, "the master reads it")

    go(page, "Frames")
    enter(page, "Function code and data (hex), or what is read", "05 07 D0 FF 00")
    until(lambda: studio.master.status(1) == 1, "the request has enabled the drive")

    go(page, "Time")
    page.keyboard.press("p")
    until(lambda: ask(studio, "time")["paused"], "time stands")
    stood = int(ask(studio, "time")["time_ns"])
    enter(page, "Duration of a step", "0.25")
    tab_to_text(page, "Step by a duration")
    page.keyboard.press("Enter")
    until(lambda: int(ask(studio, "time")["time_ns"]) >= stood + 250_000_000, "time has gone on")


def test_calculator_configuration_faults_recordings_and_devices(studio: Studio) -> None:
    page = studio.page(panel=None)
    go(page, "Calculator")
    tab_until(page, "(element) => element.id === 'calc-velocity'")
    page.keyboard.press("Control+a")
    page.keyboard.type("25")
    expect(button(page, "Send to M1")).to_be_enabled()
    tab_to_text(page, "Send to M1")
    page.keyboard.press("Enter")
    until(lambda: ask(studio, "read", points=["table.M1_VMAX"])[0]["value"] == 25, "the register has it")

    go(page, "Configuration")
    enter(page, "M1 Acc", "300")
    expect(page.get_by_role("row", name="M1_ACC 400 300 mm/s²")).to_be_visible()
    tab_to_text(page, "Write to table")
    page.keyboard.press("Enter")
    until(lambda: ask(studio, "read", points=["table.M1_ACC"])[0]["value"] == 300, "the register has it")

    go(page, "Faults")
    tab_to(page, "Kind of fault")
    page.keyboard.type("busy")
    expect(button(page, "Set fault")).to_be_enabled()
    tab_to_text(page, "Set fault")
    page.keyboard.press("Enter")
    until(lambda: ask(studio, "faults"), "a fault is set")

    go(page, "Recordings")
    tab_to_text(page, "Save recording")
    page.keyboard.press("Enter")
    until(lambda: ask(studio, "recordings")["saved"], "a recording is saved")

    go(page, "Devices")
    enter(page, "Address of the device", "tcp://127.0.0.1:1")
    expect(page.get_by_role("alert").last).to_contain_text("127.0.0.1:1")


def test_machine_program_scope_and_overview(start_studio: Callable[..., Process], browser: Browser) -> None:
    studio = Studio(start_studio("--demo"), browser)
    page = studio.page(panel=None)
    go(page, "Machine")
    tab_to(page, "Press part")
    page.keyboard.down("Enter")
    until(lambda: studio.master.inputs(5008, 1) == [True], "the master sees the button")
    page.keyboard.up("Enter")
    until(lambda: studio.master.inputs(5008, 1) == [False], "it is released")
    go(page, "Program")
    press(page, "Stop the program of table")
    until(lambda: not running(studio), "the program has stopped")
    press(page, "Start the program of table")
    until(lambda: running(studio), "the program runs")
    go(page, "Overview")
    press(page, "Pause program of table")
    until(lambda: not running(studio), "the program is paused")
    go(page, "Scope")
    tab_to(page, "Curves")
    span = page.get_by_label("Time shown")
    before = span.inner_text()
    page.keyboard.press("+")
    expect(span).not_to_have_text(before)
    page.keyboard.press("a")
    expect(button(page, "Remove cursors")).to_be_visible()
    studio.close()
    assert studio.complaints == []


def running(studio: Studio) -> bool:
    return ask(studio, "read", points=["table.program"])[0]["value"] == 1


def tab_to_text(page: Page, text: str) -> None:
    """To a button without a name of its own."""
    tab_until(page, f"(one) => one.tagName === 'BUTTON' && one.innerText.trim().endsWith({json.dumps(text)})")
