"""The debugger of the program panel in a real browser. What stands and what goes on is seen by a Modbus master of its own."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Locator, Page, expect
from studio_page import PICTURES, WAIT_MS, Studio, button, serious, show
from tests.conftest import until
from tests.studio.conftest import Process, StudioWorld
from tests.studio.test_page_program import choose, text_of

from steptwin.files.recording import recording_of, save
from steptwin.files.world import World

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
    program = "cell.prg"
    start = true
    [[line]]
    name = "chips"
    kind = "m1486"
    tcp = "127.0.0.1:0"
    [[m1486]]
    name = "drum"
    line = "chips"
    address = 7
    program = "drum.m1486"
"""
PROGRAM = """\
n = 0
LOOP:
n = n + 1
$R4 = n
JUMP PART
DELAY 0.2
JUMP LOOP
PART:
$R6 = n * 2
OUT3 = ON
RETURN
"""
CHIP = "[\n:5\n@1\nL2\n+1\nE\n'2\nW5\nJ1\n@2\n+2\n.\n]\n"


@pytest.fixture
def studio_world() -> StudioWorld:
    return StudioWorld(WORLD, {"cell.prg": PROGRAM, "drum.m1486": CHIP})


def count(studio: Studio) -> float:
    """How often the program has gone round, as the master reads it from $R4."""
    return studio.master.real(studio.master.words(4, 2))


def double(studio: Studio) -> float:
    return studio.master.real(studio.master.words(6, 2))


def opened(studio: Studio, language: str = "en-US") -> Page:
    page = studio.page(language, panel="Program" if language == "en-US" else None)
    expect(text_of(page).locator("span[class^=tok-]").first).to_be_visible()
    return page


def beside(page: Page, line: int) -> Locator:
    """Where a click sets a breakpoint."""
    return page.locator(".cm-lineNumbers .cm-gutterElement").get_by_text(str(line), exact=True)


def stop(page: Page) -> Locator:
    return page.get_by_label("Where the debugger stands")


def frame(page: Page, depth: int = 0) -> Locator:
    return page.get_by_role("list", name="Call stack").get_by_role("listitem").nth(depth)


def variable(page: Page, name: str) -> Locator:
    return page.get_by_role("table", name="Variables").get_by_role("row").filter(has_text=name).get_by_role("cell").first


def value(page: Page, name: str) -> Locator:
    return page.get_by_role("table", name="Variables").get_by_role("button", name=f"Set {name}: ")


def test_a_breakpoint_stops_the_world_and_steps_go_on_from_there(studio: Studio) -> None:
    page = opened(studio)
    until(lambda: count(studio) > 0, "the program runs")
    beside(page, 4).click()
    expect(stop(page)).to_contain_text("breakpoint")
    expect(page.get_by_role("list", name="Breakpoints")).to_contain_text("table program 0, line 4")
    expect(frame(page)).to_have_text("LOOP line 4")
    # n has been counted up already, the register has not: the world stands before the line.
    n = int(count(studio)) + 1
    expect(value(page, "n")).to_have_text(str(n))
    button(page, "Step over, table").click()
    expect(frame(page)).to_have_text("LOOP line 5")
    assert (count(studio), double(studio)) == (n, 2 * (n - 1))
    button(page, "Step in, table").click()
    expect(frame(page)).to_have_text("PART line 9")
    expect(frame(page, 1)).to_have_text("LOOP line 6")
    assert double(studio) == 2 * (n - 1)
    button(page, "Step out, table").click()
    expect(frame(page)).to_have_text("LOOP line 6")
    assert double(studio) == 2 * n
    assert count(studio) == n
    beside(page, 4).click()
    expect(page.get_by_role("list", name="Breakpoints")).to_have_count(0)
    button(page, "Continue").click()
    until(lambda: count(studio) > n + 1, "the world goes on")


def test_a_step_back_looks_at_the_past_and_the_machine_is_taken_back_on_request(studio: Studio) -> None:
    page = opened(studio)
    beside(page, 9).click()
    expect(frame(page)).to_have_text("PART line 9")
    expect(frame(page, 1)).to_have_text("LOOP line 6")
    n = int(count(studio))
    button(page, "Step back, table").click()
    expect(stop(page)).to_contain_text("the past")
    expect(frame(page)).to_have_text("LOOP line 5")
    button(page, "Run back to the last breakpoint").click()
    expect(frame(page)).to_have_text("PART line 9")
    expect(frame(page, 1)).to_have_text("LOOP line 6")
    expect(variable(page, "n")).to_have_text(str(n - 1))
    # The world itself has not moved: the master sees the present.
    assert count(studio) == n
    button(page, "Take the machine back to here…").click()
    button(page, "Take it back: what happened since is undone").click()
    expect(page.get_by_role("group", name="The past")).to_have_count(0)
    until(lambda: count(studio) == n - 1, "the machine is where it was")
    button(page, "Step over, table").click()
    expect(frame(page)).to_have_text("PART line 10")
    assert double(studio) == 2 * (n - 1)


def test_two_viewers_see_the_same_breakpoints_and_the_same_stop(studio: Studio) -> None:
    page, other = opened(studio), opened(studio)
    beside(page, 4).click()
    expect(frame(page)).to_have_text("LOOP line 4")
    expect(other.get_by_role("list", name="Breakpoints")).to_contain_text("line 4")
    expect(frame(other)).to_have_text("LOOP line 4")
    expect(stop(other)).to_contain_text("breakpoint")
    button(page, "Step over, table").click()
    expect(frame(other)).to_have_text("LOOP line 5")
    button(page, "Step back, table").click()
    expect(frame(other)).to_have_text("LOOP line 4")
    expect(stop(other)).to_contain_text("the past")
    expect(other.get_by_role("group", name="The past")).to_be_visible()
    other.reload()
    expect(stop(other)).to_contain_text("the past")
    expect(other.get_by_role("group", name="The past")).to_be_visible()
    # Who has control steps and sets; the other one takes it over first.
    button(other, "Step over, table").click()
    expect(other.get_by_role("alert")).to_contain_text("control")
    button(page, "Continue").click()
    expect(other.get_by_role("group", name="The past")).to_have_count(0)
    expect(stop(other)).to_contain_text("breakpoint")


def test_a_condition_a_hit_count_and_a_text_are_given_in_a_form(studio: Studio) -> None:
    page = opened(studio)
    beside(page, 9).click(modifiers=["Shift"])
    form = page.get_by_role("form", name="Breakpoint in line 9")
    form.get_by_label("Log text").fill("n is {n}")
    form.get_by_role("button", name="Set").click()
    expect(form).to_have_count(0)
    expect(page.get_by_role("log", name="Log").get_by_text("n is").first).to_be_visible()
    expect(page.locator(".dot.log")).to_have_count(1)
    beside(page, 4).click(modifiers=["Shift"])
    form = page.get_by_role("form", name="Breakpoint in line 4")
    form.get_by_label("Condition").fill("n > ")
    form.get_by_role("button", name="Set").click()
    expect(page.get_by_role("alert").filter(has_text="n > ")).to_be_visible()
    form.get_by_label("Condition").fill("n % 5 = 0")
    form.get_by_label("Hit count").fill("2")
    form.get_by_role("button", name="Set").click()
    expect(frame(page)).to_have_text("LOOP line 4")
    n = int(count(studio)) + 1
    assert n % 5 == 0
    expect(variable(page, "n")).to_have_text(str(n))
    button(page, "Edit breakpoint: table program 0, line 4").click()
    expect(form.get_by_label("Condition")).to_have_value("n % 5 = 0")
    form.get_by_label("Condition").fill("n % 7 = 0")
    form.get_by_label("Hit count").fill("")
    form.get_by_role("button", name="Set").click()
    expect(form).to_have_count(0)
    button(page, "Continue").click()
    until(lambda: int(count(studio)) % 7 == 6 and count(studio) > n - 1, "it stops at the other condition")
    expect(page.get_by_role("list", name="Breakpoints").get_by_role("listitem")).to_have_count(2)


def test_values_are_watched_and_set_and_stop_when_they_change(studio: Studio) -> None:
    page = opened(studio)
    beside(page, 3).click()
    expect(frame(page)).to_have_text("LOOP line 3")
    beside(page, 3).click()
    watched = page.get_by_label("Expression to watch")
    watched.fill("n * 10")
    watched.press("Enter")
    value(page, "n").click()
    page.get_by_label("New value of n").fill("400 + 100")
    page.keyboard.press("Enter")
    expect(variable(page, "n")).to_have_text("500")
    expect(page.get_by_role("table", name="Watches")).to_contain_text("5000")
    page.get_by_label("Value that changes").fill("$R6")
    page.get_by_role("textbox", name="Condition").fill("> 1003")
    page.keyboard.press("Enter")
    expect(page.get_by_role("list", name="Breakpoints")).to_contain_text("$R6 of table")
    button(page, "Continue").click()
    expect(stop(page)).to_contain_text("value: $R6 > 1003")
    assert (count(studio), double(studio)) == (502, 1004)


def test_an_m1486_is_debugged_and_keys_are_enough(studio: Studio) -> None:
    page = opened(studio)
    choose(page, "drum/program.m1486")
    text = text_of(page, "drum.m1486")
    expect(text.locator("span[class^=tok-]").first).to_be_visible()
    text.click()
    page.keyboard.press("Control+Home")
    for _ in range(4):
        page.keyboard.press("ArrowDown")
    page.keyboard.press("F9")
    expect(frame(page)).to_contain_text("line 5")
    before = frame(page).inner_text()
    page.keyboard.press("F11")
    expect(frame(page)).not_to_have_text(before)
    page.keyboard.press("Control+F10")
    expect(frame(page)).to_have_text(before)
    expect(stop(page)).to_contain_text("the past")
    page.keyboard.press("F10")
    expect(frame(page)).not_to_have_text(before)
    page.keyboard.press("F8")
    expect(frame(page)).to_have_text(before)


def test_the_picture_of_the_documentation_and_what_axe_finds(studio: Studio) -> None:
    page = studio.page(panel="Program", bypass_csp=True)
    expect(text_of(page).locator("span[class^=tok-]").first).to_be_visible()
    button(page, "Skip").click()
    beside(page, 4).click(modifiers=["Shift"])
    form = page.get_by_role("form", name="Breakpoint in line 4")
    form.get_by_label("Condition").fill("n % 10 = 0")
    form.get_by_role("button", name="Set").click()
    watched = page.get_by_label("Expression to watch")
    watched.fill("$R6 / 2")
    watched.press("Enter")
    expect(frame(page)).to_have_text("LOOP line 4")
    expect(page.get_by_role("table", name="Watches")).to_contain_text(re.compile("[0-9]"))
    PICTURES.mkdir(parents=True, exist_ok=True)
    page.screenshot(path=PICTURES / "debugger.png")
    assert serious(page) == []


def test_a_recording_is_looked_through(start_studio: Callable[..., Process], browser: Browser, tmp_path: Path) -> None:
    world = World.from_toml('[[mic488]]\nname = "table"\nprogram = "cell.prg"\nstart = true\n', {"cell.prg": PROGRAM.encode()})
    world.run(for_="20s")
    save(recording_of(world), tmp_path / "s.json")
    context = browser.new_context(viewport={"width": 1280, "height": 720}, locale="en-US")
    page = context.new_page()
    page.set_default_timeout(WAIT_MS)
    page.goto(start_studio("--itself", str(tmp_path / "s.json"), "--view").url)
    show(page, "Program")
    last = variable(page, "n")
    expect(last).to_have_text(re.compile("^[0-9]+$"))
    n = int(last.inner_text())
    expect(page.get_by_role("group", name="Debugger").get_by_role("button")).to_have_count(0)
    page.locator("body").press(",")
    past = page.get_by_role("group", name="The past")
    past.get_by_role("slider").fill("1000")
    expect(past).to_contain_text("10.0")
    expect(last).to_have_text(re.compile(f"^({n // 2 - 1}|{n // 2}|{n // 2 + 1})$"))
    expect(past.get_by_role("button", name="Take the machine back to here…")).to_have_count(0)
    past.get_by_role("button", name="To the present").click()
    expect(last).to_have_text(str(n))
    context.close()


def test_why_answers_and_a_click_on_a_cause_shows_its_moment(studio: Studio) -> None:
    page = opened(studio)
    until(lambda: count(studio) >= 3, "the program goes round")
    page.get_by_label("Why is it so?").fill("OUT3 == 1")
    button(page, "Why?").click()
    causes = page.get_by_role("status", name="Causes")
    expect(causes).to_contain_text("OUT3 == 1 is true, since 0.")
    became, executed = causes.get_by_role("button").filter(has_text=re.compile("OUT3")).all()
    expect(became).to_contain_text("table table.OUT3 became 1")
    expect(executed).to_contain_text("table line 10 `OUT3 = ON` was executed")
    expect(executed).to_have_attribute("aria-current", "false")
    executed.click()
    expect(page.get_by_role("group", name="The past")).to_be_visible()
    expect(executed).to_have_attribute("aria-current", "true")
    expect(variable(page, "n")).to_have_text("1")
    assert count(studio) >= 3


def test_why_answers_what_is_no_question(studio: Studio) -> None:
    page = opened(studio)
    page.get_by_label("Why is it so?").fill("drum.program")
    button(page, "Why?").click()
    expect(page.get_by_role("status", name="Causes")).to_contain_text("no signal 'drum.program'")
