"""The program panel in a real browser: help while typing, download. What the twin does is seen by a Modbus master."""

from __future__ import annotations

import json
import re

import httpx
import pytest
from playwright.sync_api import Locator, Page, expect
from studio_page import AXE, Studio, button
from tests.conftest import until
from tests.studio.conftest import StudioWorld

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
    positions = "cell.csv"
    [mic488.M1]
    unit = "mm"
    gear = 100.0
    [[line]]
    name = "chips"
    kind = "m1486"
    tcp = "127.0.0.1:0"
    [[m1486]]
    name = "drum"
    line = "chips"
    address = 7
"""
PROGRAM = "LOOP:\n$R0 = $R0 + 1\nDELAY 0.1\nJUMP LOOP\n"
TABLE = "HOME;1;x;x;x\nPICK;5;x;x;x\n"


@pytest.fixture
def studio_world() -> StudioWorld:
    return StudioWorld(WORLD, {"cell.prg": PROGRAM, "cell.csv": TABLE})


def text_of(page: Page, name: str = "cell.prg") -> Locator:
    return page.get_by_role("textbox", name=f"Text of {name}")


def begin(page: Page, name: str = "cell.prg") -> None:
    """With the cursor in a new line at the beginning of the text, when the editor server is there."""
    text_of(page, name).click()
    expect(text_of(page, name).locator("span[class^=tok-]").first).to_be_visible()
    page.keyboard.press("Control+Home")
    page.keyboard.press("Enter")
    page.keyboard.press("ArrowUp")


def write(page: Page, text: str, name: str = "cell.prg") -> None:
    """In the place of the whole text."""
    text_of(page, name).click()
    page.keyboard.press("Control+a")
    page.keyboard.press("Delete")
    page.keyboard.insert_text(text)


def choose(page: Page, address: str) -> None:
    page.get_by_label("Text", exact=True).select_option(f"steptwin:///{address}")


def user_register(studio: Studio, number: int) -> float:
    response = httpx.get(f"{studio.process.url}/api/points", params={"names": f"table.USER_REGISTER[{number}]:real"})
    return response.json()["ok"][0]["value"]


def findings(page: Page) -> Locator:
    return page.get_by_role("complementary", name="Findings")


def test_a_mistake_is_found_while_it_is_typed_and_mended(studio: Studio) -> None:
    page = studio.page(panel="Program")
    begin(page)
    page.keyboard.type("DELAI 1")
    expect(findings(page)).to_contain_text("unknown statement DELAI")
    expect(page.get_by_text("The text differs from what is in the twin.")).to_be_visible()
    wrong = text_of(page).locator(".cm-lintRange-error").first
    wrong.hover()
    page.get_by_role("tooltip").or_(page.locator(".cm-tooltip")).get_by_role("button").first.click()
    expect(text_of(page)).to_contain_text("DELAY 1")
    expect(findings(page)).not_to_contain_text("DELAI")
    button(page, "As in the twin").click()
    expect(page.get_by_text("The text differs from what is in the twin.")).to_have_count(0)
    expect(text_of(page)).not_to_contain_text("DELAY 1")


def test_a_name_is_completed_explained_and_renamed_in_both_texts(studio: Studio) -> None:
    page = studio.page(panel="Program")
    begin(page)
    page.keyboard.type("MOVEPTP @P")
    option = page.get_by_role("option", name=re.compile("^PICK"))
    expect(option).to_be_visible()
    option.click()
    page.keyboard.press("Enter")
    expect(text_of(page)).to_contain_text("MOVEPTP @PICK")
    tip = page.locator(".cm-lsp-hover-tooltip")

    def is_explained() -> bool:
        """An explanation is asked for when the mouse moves; a change of the text, as by findings, ends that."""
        page.mouse.move(5, 5)
        text_of(page).get_by_text("MOVEPTP").hover()
        page.wait_for_timeout(1000)
        return tip.count() > 0

    until(is_explained, "the statement is explained")
    expect(tip).to_contain_text("MOVEPTP")
    page.keyboard.press("Control+Home")
    for _ in range(11):
        page.keyboard.press("ArrowRight")
    page.keyboard.press("F2")
    page.get_by_label("New name").fill("TAKE")
    page.keyboard.press("Enter")
    expect(text_of(page)).to_contain_text("MOVEPTP @TAKE")
    choose(page, "table/positions-0.csv")
    expect(text_of(page, "cell.csv")).to_contain_text("TAKE;5;x;x;x")


def test_a_program_is_downloaded_and_runs(studio: Studio) -> None:
    page = studio.page(panel="Program")
    begin(page)
    write(page, "$R4 = 7\n$R6 = 1 +\nEND\n")
    download = button(page, "Download cell.prg into table")
    download.click()
    refusal = page.get_by_role("alert").filter(has_text="It was not downloaded")
    expect(refusal).to_contain_text("cell.prg:2:")
    assert studio.master.words(10003)[0] == 0
    write(page, "$R4 = 7\nWAITING:\nDELAY 1\nJUMP WAITING\n")
    download.click()
    expect(refusal).to_have_count(0)
    expect(page.get_by_text("cell.prg is in table now.")).to_be_visible()
    expect(page.get_by_text("The text differs from what is in the twin.")).to_have_count(0)
    button(page, "Start the program of table").click()
    until(lambda: studio.master.words(10003)[0] == 1, "the master sees that it runs")
    until(lambda: user_register(studio, 4) == 7.0, "the new program has written its register")
    expect(page.get_by_role("status").filter(has_text="running, line 3")).to_be_visible()
    download.click()
    expect(refusal).to_contain_text("stop it first")
    button(page, "Stop the program of table").click()
    until(lambda: studio.master.words(10003)[0] == 0, "the master sees that it has stopped")


def test_a_draft_outlives_the_page(studio: Studio) -> None:
    page = studio.page(panel="Program")
    begin(page)
    page.keyboard.type("// kept")
    kept = "localStorage['steptwin.drafts'] ?? ''"
    until(lambda: "// kept" in page.evaluate(kept), "the browser has the draft")
    page.reload()
    expect(text_of(page)).to_contain_text("// kept")
    expect(page.get_by_text("The text differs from what is in the twin.")).to_be_visible()

    # Of two tabs with it the one in which it was changed first keeps it; the other one says that.
    text_of(page).click()
    page.keyboard.type("// of the first")
    until(lambda: "// of the first" in page.evaluate(kept), "the browser has the draft")
    other = page.context.new_page()
    other.goto(page.url)
    text_of(other).click()
    other.keyboard.type("// of the second")
    expect(other.get_by_text("Another tab")).to_be_visible()
    assert "// of the second" not in page.evaluate(kept)


def test_positions_are_taught(studio: Studio) -> None:
    page = studio.page(panel="Program")
    begin(page)
    choose(page, "table/positions-0.csv")
    assert httpx.post(f"{studio.process.url}/api/do/enable", json={"controller": "table", "axis": 1}).status_code == 200
    move = {"controller": "table", "axis": 1, "to": 12.5}
    assert httpx.post(f"{studio.process.url}/api/do/move", json=move).status_code == 200
    until(lambda: studio.at(1) == 12.5 and studio.stands(1), "the axis is there")
    page.get_by_label("Row", exact=True).fill("PICK")
    for axis in ("M2", "M3", "M4"):
        page.get_by_label(axis, exact=True).uncheck()
    button(page, "Take position").click()
    expect(text_of(page, "cell.csv")).to_contain_text("PICK;12.5;x;x;x")
    button(page, "Download cell.csv into table").click()
    expect(page.get_by_text("cell.csv is in table now.")).to_be_visible()
    asked = {"controller": "table", "place": "positions 0"}
    answer = httpx.post(f"{studio.process.url}/api/do/program_text", json=asked).json()["ok"]
    assert answer["text"] == "HOME;1;x;x;x\nPICK;12.5;x;x;x\n"


def test_a_position_is_taught_in_the_panel_of_the_axes(studio: Studio) -> None:
    studio.master.enable(1)
    studio.master.move(1, 12.5)
    page = studio.page(panel="Axes")
    expect(page.get_by_label("M1 position", exact=True)).to_have_text("12.50")
    page.get_by_text("Teach position").click()
    teaching = page.get_by_role("group", name="Teach position of table")
    for axis in ("M2", "M3", "M4"):
        teaching.get_by_label(axis, exact=True).uncheck()

    def teach(name: str) -> None:
        teaching.get_by_label("Row", exact=True).fill(name)
        button(page, "Take position").first.click()
        expect(page.get_by_text(f"{name} is in table")).to_be_visible()

    teach("PICK")
    teach("PLACE")
    button(page, "Open beside").click()
    page.get_by_label("Panel", exact=True).last.select_option(label="Program")
    choose(page, "table/positions-0.csv")
    table = text_of(page, "cell.csv")
    expect(table).to_contain_text("HOME;1;x;x;xPICK;12.5;x;x;xPLACE;12.5;x;x;x")
    choose(page, "table/program-0.prg")
    teach("THERE")  # into the open editor
    expect(table).to_contain_text("PLACE;12.5;x;x;xTHERE;12.5;x;x;x")
    button(page, "Download cell.csv into table").click()
    expect(page.get_by_text("cell.csv is in table now.")).to_be_visible()


def test_the_memory_that_a_text_takes_is_shown(studio: Studio) -> None:
    page = studio.page(panel="Program")
    memory = findings(page)
    expect(memory).to_contain_text("Program bank 3 / 4000 statements")
    expect(memory).to_contain_text("Statements in an image 48 bytes")
    write(page, "$R4 = 7\nEND\n")
    expect(memory.get_by_label("Program bank")).to_have_attribute("value", "2")
    write(page, "$R4 = \n")
    expect(memory).to_contain_text("Known for a text without errors.")
    choose(page, "table/positions-0.csv")
    expect(memory).to_contain_text("Position bank 2 /")
    expect(memory).to_contain_text("Positions in an image 36 bytes")
    choose(page, "drum/program.m1486")
    expect(memory).to_contain_text("0 / 254 bytes")
    text_of(page, "program").click()
    page.keyboard.type("f640\nr\n")
    expect(memory).to_contain_text("5 / 254 bytes")


def test_a_chip_is_given_a_program_and_typed_to(studio: Studio) -> None:
    page = studio.page(panel="Program")
    choose(page, "drum/program.m1486")
    text = text_of(page, "program")
    text.click()
    page.keyboard.type("f640\nr\n")
    button(page, "Download program into drum").click()
    points = f"{studio.process.url}/api/points?names=drum.position"
    until(lambda: httpx.get(points).json()["ok"][0]["value"] == 640.0, "the drum has turned")
    button(page, "Terminal").click()
    typed = page.get_by_label("To send to chips")
    for command in ("b640", "r"):
        typed.fill(command)
        typed.press("Enter")
    until(lambda: httpx.get(points).json()["ok"][0]["value"] == 0.0, "the drum has turned back")
    typed.press("ArrowUp")
    typed.press("ArrowUp")
    expect(typed).to_have_value("b640")
    typed.press("Enter")
    typed.fill("b600")
    typed.press("Enter")
    refused = "drum: wrong data: 600 is not a multiple of 64 minimum microsteps (M1); the program stops"
    expect(page.get_by_role("log", name="What went over chips")).to_contain_text(refused)


def test_the_keyboard_is_enough(studio: Studio) -> None:
    """Space and figures are typed, nothing is stopped by them; Tab leaves the text; Download by Enter."""
    page = studio.page(panel="Program")
    begin(page)
    page.keyboard.type("// 1 , ; / ?")
    expect(text_of(page)).to_contain_text("// 1 , ; / ?")
    page.keyboard.press("Tab")
    expect(text_of(page)).not_to_be_focused()
    button(page, "Download cell.prg into table").press("Enter")
    expect(page.get_by_text("cell.prg is in table now.")).to_be_visible()


def test_escape_closes_what_is_open_and_stops_where_nothing_is(studio: Studio) -> None:
    page = studio.page(panel="Program")
    button(page, "Start the program of table").click()
    until(lambda: studio.master.words(10003)[0] == 1, "it runs")
    begin(page)
    for opened in ("Control+Space", "Control+f"):
        page.keyboard.press(opened)
        expect(page.locator(".cm-tooltip-autocomplete, .cm-search").first).to_be_visible()
        page.keyboard.press("Escape")
        expect(page.locator(".cm-tooltip-autocomplete, .cm-search")).to_have_count(0)
    page.keyboard.press("Escape")
    expect(text_of(page)).not_to_be_focused()
    page.keyboard.press("?")
    page.keyboard.press("Escape")
    expect(page.get_by_role("dialog")).to_have_count(0)
    assert studio.master.words(10003)[0] == 1
    page.keyboard.press("Escape")
    until(lambda: studio.master.words(10003)[0] == 2, "it is paused, so that its drives stay on")


@pytest.mark.parametrize("language", ["en-US", "pl-PL"])
def test_axe_finds_nothing_serious(studio: Studio, language: str) -> None:
    page = studio.page(language, panel=None)
    page.get_by_role("navigation").get_by_role("button", name="Program", exact=True).click()
    expect(page.locator(".cm-content span[class^=tok-]").first).to_be_visible()
    page.evaluate(AXE.read_text())
    found = page.evaluate("axe.run({resultTypes: ['violations']})")
    serious = [one for one in found["violations"] if one["impact"] in ("serious", "critical")]
    assert not serious, json.dumps(serious, indent=1)[:3000]


def test_findings_are_in_polish_and_the_words_of_a_program_stay(studio: Studio) -> None:
    page = studio.page(panel="Program")
    write(page, "JUMP coil\nDELAI 1\n")
    expect(findings(page)).to_contain_text("there is no label coil")
    page.get_by_label("Language").select_option("pl")
    found = page.get_by_role("complementary", name="Uwagi")
    # A coil is a "cewka" in a data sheet.
    expect(found).to_contain_text("nie ma etykiety coil")
    expect(found).to_contain_text("zdefiniuj etykietę coil: w osobnej linii")
    expect(found).to_contain_text("nieznana instrukcja DELAI")
    page.get_by_label("Język").select_option("en")
    choose(page, "drum/program.m1486")
    write(page, "J5\n", "program")
    expect(findings(page)).to_contain_text("there is no label 5")
    page.get_by_label("Language").select_option("pl")
    expect(found).to_contain_text("nie ma etykiety 5")
