"""The shell of the page around its panels, in a browser."""

from __future__ import annotations

import gzip
import re
import signal
from collections.abc import Callable

import pytest
from playwright.sync_api import Browser, Locator, Page, expect
from studio_page import AXE, PICTURES, Studio, button, show
from tests.studio.conftest import Process

PANELS = (
    *("Overview", "Axes", "I/O", "Scope", "Program", "Calculator", "Registers", "Configuration", "Frames", "Faults", "Time"),
    *("Recordings", "Devices"),
)


LARGEST_FIRST_LOAD = 400_000


def enable(page: Page, axis: str = "M1") -> None:
    button(page, f"Enable {axis}").click()
    expect(button(page, f"Enable {axis}")).to_have_attribute("aria-pressed", "true")


def number(output: Locator) -> float:
    return float(output.inner_text().replace("−", "-"))


def test_two_people_and_one_control(studio: Studio) -> None:
    first, second = studio.page(), studio.page()
    enable(first)
    expect(first.get_by_role("group", name="Control")).to_contain_text("you have control")
    button(second, "Enable M2").click()
    expect(second.get_by_role("alert").last).to_contain_text("control")
    assert studio.master.status(2) == 0
    second.get_by_role("button", name=re.compile("^Take over")).click()
    expect(second.get_by_role("group", name="Control")).to_contain_text("you have control")
    enable(second, "M2")
    assert studio.master.status(2) == 1


def test_panes_are_remembered(studio: Studio) -> None:
    page = studio.page()
    button(page, "Open beside").click()
    page.get_by_label("Panel", exact=True).last.select_option(label="Time")
    expect(page.get_by_label("World time")).to_be_visible()
    page.reload()
    expect(page.get_by_label("World time")).to_be_visible()
    expect(page.get_by_label("M1 position", exact=True)).to_be_visible()
    button(page, "Close panel Time").click()
    page.get_by_label("Language").select_option("pl")
    expect(button(page, "Zatrzymaj wszystko")).to_be_visible()
    page.reload()
    expect(button(page, "Zatrzymaj wszystko")).to_be_visible()
    expect(page.get_by_label("World time")).to_have_count(0)


def test_a_studio_that_does_not_answer_is_seen_and_comes_back_by_itself(studio: Studio) -> None:
    page = studio.page()
    enable(page)
    studio.process.process.send_signal(signal.SIGSTOP)
    expect(page.get_by_role("status").first).to_contain_text("does not answer")
    studio.process.process.send_signal(signal.SIGCONT)
    expect(page.get_by_role("status").first).to_be_empty()
    page.get_by_label("Target M1").fill("4")
    page.get_by_label("Target M1").press("Enter")
    expect(page.get_by_label("M1 position", exact=True)).to_have_text("4.00")


def test_keys_are_told(studio: Studio) -> None:
    page = studio.page()
    page.locator("body").press("?")
    dialog = page.get_by_role("dialog", name="Keys")
    expect(dialog).to_contain_text("Stop all, from everywhere")
    expect(dialog).to_contain_text("not an emergency stop")
    page.keyboard.press("Escape")
    expect(dialog).to_have_count(0)


def test_the_first_load_is_small_and_local(studio: Studio, browser: Browser) -> None:
    bodies: dict[str, bytes] = {}
    context = browser.new_context()
    page = context.new_page()
    page.on("response", lambda response: bodies.update({response.url: b""}))
    page.goto(studio.process.url)
    expect(page.get_by_label("M1 position", exact=True)).to_be_visible()
    assert all(url.startswith(studio.process.url) for url in bodies)
    for url in list(bodies):
        bodies[url] = page.request.get(url).body()
    context.close()
    assert len(bodies) > 3
    assert sum(len(gzip.compress(body)) for body in bodies.values()) < LARGEST_FIRST_LOAD


SIZES = {"1280x720": (1280, 720), "wide": (1920, 1080), "tablet": (820, 1180)}
POLISH = dict(
    zip(
        PANELS,
        (
            "Przegląd",
            "Osie",
            "We/Wy",
            "Oscyloskop",
            "Program",
            "Kalkulator",
            "Rejestry",
            "Konfiguracja",
            "Ramki",
            "Usterki",
            "Czas",
            "Nagrania",
            "Urządzenia",
        ),
        strict=True,
    )
)


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_nothing_serious_is_wrong_for_assistive_technology(studio: Studio, theme: str) -> None:
    if not AXE.exists():
        pytest.skip("axe-core is not installed; 'make types' installs it")
    page = studio.page(color_scheme=theme, bypass_csp=True)
    page.add_script_tag(path=AXE)
    found: list[str] = []
    for panel in PANELS:
        show(page, panel)
        page.wait_for_function("document.fonts.status === 'loaded'")
        result = page.evaluate("() => axe.run(document, {resultTypes: ['violations']})")
        for violation in result["violations"]:
            if violation["impact"] in ("serious", "critical"):
                where = "; ".join(str(node["target"]) for node in violation["nodes"][:4])
                found.append(f"{panel}: {violation['id']}: {violation['help']}: {where}")
    assert found == []


@pytest.mark.parametrize(("theme", "language"), [("light", "en-US"), ("dark", "pl-PL")])
def test_pictures(start_studio: Callable[..., Process], browser: Browser, theme: str, language: str) -> None:
    """Of every panel of the demo machine; nothing is wider than the window, and Stop all is in sight."""
    studio = Studio(start_studio("--demo"), browser)
    PICTURES.mkdir(parents=True, exist_ok=True)
    for size, (width, height) in SIZES.items():
        page = studio.page(language, panel=None, viewport={"width": width, "height": height}, color_scheme=theme)
        for number, panel in enumerate(PANELS, 1):
            show(page, panel if language == "en-US" else POLISH[panel])
            page.screenshot(path=PICTURES / f"{size}-{theme}-{language[:2]}-{number}.png")
            assert page.evaluate("document.documentElement.scrollWidth") <= width, (size, panel)
            box = button(page, "Stop all" if language == "en-US" else "Zatrzymaj wszystko").bounding_box()
            assert box is not None
            assert box["x"] >= 0
            assert box["x"] + box["width"] <= width
            assert box["y"] + box["height"] <= height
    studio.close()
    assert studio.complaints == []
