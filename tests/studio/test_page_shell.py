"""The shell of the page around its panels, in a browser."""

from __future__ import annotations

import gzip
import re
import signal
from collections.abc import Callable

from playwright.sync_api import Browser, Locator, expect
from studio_page import Studio, button, enable, serious, show
from tests.studio.conftest import Process

LARGEST_FIRST_LOAD = 400_000


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


def test_a_page_without_the_right_token_says_so_and_takes_one(start_studio: Callable[..., Process], browser: Browser) -> None:
    process = start_studio("--with-token")
    page = browser.new_page()
    page.goto(f"{process.url}/#token=wrong-0123456789abcdef")
    status, field = page.get_by_role("status").first, page.get_by_label("Token of this studio")
    expect(status).to_contain_text("wrong token")
    with page.expect_response("**/api/do/stop_all") as stopped:
        page.get_by_role("button", name="Stop all").click()
    assert stopped.value.ok
    field.press_sequentially("p1")  # keys of the page, outside of fields
    field.fill("")
    field.press("Enter")
    expect(status).to_contain_text("no token")
    field.fill(process.token)
    button(page, "Give token").click()
    expect(page.get_by_label("M1 position", exact=True)).to_be_visible()
    expect(field).to_have_count(0)
    page.reload()
    expect(page.get_by_label("M1 position", exact=True)).to_be_visible()
    page.close()


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
    expect(dialog).to_contain_text("Close what is open, or leave a field")
    expect(dialog).to_contain_text("not an emergency stop")
    expect(dialog).to_contain_text("1 … 9")
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


def test_nothing_serious_is_wrong_for_assistive_technology_with_open_panels(
    start_studio: Callable[..., Process], browser: Browser
) -> None:
    """The machine that the demo moves, its wiring, a scope with channels, a saved recording."""
    studio = Studio(start_studio("--demo"), browser)
    page = studio.page(panel="Recordings", bypass_csp=True)
    button(page, "Save recording").click()
    expect(page.get_by_role("button", name=re.compile("^Open a view of "))).to_have_count(1)
    found = [f"Recordings: {what}" for what in serious(page)]
    show(page, "Program")
    expect(page.get_by_text("JUMP MAIN").first).to_be_visible()
    found += [f"Program: {what}" for what in serious(page)]
    show(page, "Machine")
    button(page, "Labels").click()
    page.get_by_label("Selected").select_option("infeed")
    found += [f"Machine: {what}" for what in serious(page)]
    show(page, "I/O")
    button(page, "Wiring").click()
    found += [f"Wiring: {what}" for what in serious(page)]
    show(page, "Scope")
    button(page, "Choose signals").click()
    found += [f"Scope: {what}" for what in serious(page)]
    page.locator("body").press("?")
    found += [f"Keys: {what}" for what in serious(page)]
    page.keyboard.press("Escape")
    show(page, "Axes")
    button(page, "Jog shuttle +").hover()
    page.mouse.down()
    found += [f"a held button: {what}" for what in serious(page)]
    page.mouse.up()
    studio.close()
    assert found == []


def test_a_phone_has_its_width_for_the_panels(studio: Studio) -> None:
    """The buttons of the panels keep their names."""
    page = studio.page(viewport={"width": 390, "height": 844})
    rail = page.get_by_role("navigation").first
    box = rail.bounding_box()
    assert box is not None
    assert box["width"] <= 44
    rail.get_by_role("button", name="Registers", exact=True).click()
    expect(page.get_by_role("region", name="Registers", exact=True).last).to_be_visible()
