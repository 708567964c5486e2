"""The page in a real browser, against a studio in a process of its own. What moves is seen by an independent Modbus master.

The pictures of `test_every_panel` are in build/studio.
"""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
from playwright.sync_api import Browser, Page, expect
from studio_page import Studio, button, downloaded, enable, number, show, virtual_time_ns
from tests.conftest import until
from tests.studio.conftest import Process

from steptwin.simulation.components.registry import ELEMENTS

# ---------------------------------------------------------------------- other panels


def test_overview_says_what_there_is_and_where_programs_connect(studio: Studio) -> None:
    page = studio.page(panel="Overview")
    region = page.get_by_role("region", name="Overview").last
    expect(region.get_by_role("row", name=re.compile("^table"))).to_contain_text("MIC488 1.70")
    expect(region).to_contain_text(f"127.0.0.1:{studio.process.end_points['tcp']['port']}")
    studio.master.enable(1)
    assert studio.master.status(1) == 1
    button(page, "Power-cycle table").click()
    until(lambda: studio.master.status(1) == 0, "the controller was off: its drive is")
    studio.master.move(1, 5.0)
    expect(region).to_contain_text("Alarms")
    expect(region.get_by_role("row", name=re.compile("motion is ignored|not enabled|ignored", re.IGNORECASE))).to_be_visible()


def test_overview_counts_what_lines_carry(studio: Studio) -> None:
    page = studio.page(panel="Overview")
    bus = page.get_by_role("table", name="Lines").get_by_role("row", name=re.compile("^bus"))
    expect(bus.get_by_role("cell").nth(4)).to_have_text("0")
    for _ in range(3):
        assert studio.master.client.read_holding_registers(9999, count=1, device_id=1).isError()
    studio.master.words(10052, 2)
    expect(bus.get_by_role("cell")).to_have_text(["modbus", "1", re.compile(r"\d+"), "4", "▲ 3", "0"])
    ask(studio, "send", line="chips", text="x7\rf64\r")
    expect(page.get_by_role("row", name=re.compile("^chips")).get_by_role("cell").nth(3)).to_have_text("2")


def test_inputs_are_set_and_forced(studio: Studio) -> None:
    page = studio.page(panel="I/O")
    button(page, "Set IN3").click()
    until(lambda: studio.master.inputs(5002, 1) == [True], "the master sees IN3")
    expect(page.get_by_role("img", name="IN3 level")).to_have_accessible_name("IN3 level")
    expect(button(page, "Set IN3")).to_have_attribute("aria-pressed", "true")
    page.get_by_label("Force IN4").select_option("1")
    until(lambda: studio.master.inputs(5003, 1) == [True], "the master sees the forced input")
    button(page, "Set IN4").click()
    expect(page.get_by_label("Force IN4")).to_have_value("1")
    assert studio.master.inputs(5003, 1) == [True]
    page.get_by_label("Force IN4").select_option("")
    until(lambda: studio.master.inputs(5003, 1) == [False], "the input is free again")
    button(page, "Switch OUT2").click()
    until(lambda: studio.master.client.read_coils(6001, count=1, device_id=1).bits[0], "the output is on")
    page.get_by_label("Set AIN1").fill("4,2")
    page.get_by_label("Set AIN1").press("Enter")
    expect(page.get_by_label("AIN1 level")).to_have_text("4.20")


def test_registers_are_found_read_and_written(studio: Studio) -> None:
    page = studio.page(panel="Registers")
    page.locator("body").press("/")
    expect(page.get_by_role("searchbox")).to_be_focused()
    page.keyboard.type("410053")
    page.get_by_label("New value of M1_VMAX").fill("55.5")
    button(page, "Write M1_VMAX").click()
    until(lambda: studio.master.real(studio.master.words(10052, 2)) == 55.5, "the master reads it")
    expect(page.get_by_label("M1_VMAX", exact=True)).to_have_text("55.5")
    page.get_by_label("New value of M1_VMAX").fill("-1")
    button(page, "Write M1_VMAX").click()
    expect(page.get_by_role("alert").last).to_contain_text("−1: permitted is more than 0")
    button(page, "Undo writing M1_VMAX").click()
    until(lambda: studio.master.real(studio.master.words(10052, 2)) == 40.0, "it is as before")
    page.get_by_role("searchbox").fill("AXIS_CTR_MODE")
    for _ in range(2):
        page.get_by_label("Write AXIS_CTR_MODE").select_option("1")
        expect(page.get_by_label("AXIS_CTR_MODE", exact=True)).to_have_text("1 · TRIGGER")
        button(page, "Undo writing AXIS_CTR_MODE").click()
        expect(page.get_by_label("AXIS_CTR_MODE", exact=True)).to_have_text("0 · DIRECT")
    studio.master.word(10, 7)
    page.get_by_label("Group").select_option("user")
    expect(page.get_by_label("USER_REGISTER[10]", exact=True)).to_have_text("7")
    button(page, "REAL").click()
    page.get_by_label("First user register").fill("20")
    page.get_by_label("New value of USER_REGISTER[20]:real").fill("1.5")
    page.keyboard.press("Enter")
    until(lambda: studio.master.real(studio.master.words(20, 2)) == 1.5, "the master reads the REAL")


def test_a_fault_is_set_and_cleared(studio: Studio) -> None:
    page = studio.page(panel="Faults")
    page.get_by_label("Kind of fault").select_option("exception")
    page.get_by_label("code", exact=True).fill("6")
    button(page, "Set fault").click()
    read = lambda: studio.master.client.read_holding_registers(10010, count=1, device_id=1)  # noqa: E731
    until(lambda: read().isError(), "requests are refused")
    assert read().exception_code == 6
    expect(page.get_by_role("row", name=re.compile("^exception "))).to_contain_text("exception code=6")
    button(page, "Clear exception").click()
    until(lambda: not read().isError(), "requests are answered")
    expect(page.get_by_text("No fault is set.")).to_be_visible()


def test_time_stands_steps_and_goes_on(studio: Studio) -> None:
    page = studio.page(panel="Time")
    now = page.get_by_label("World time")
    page.locator("body").press("p")
    expect(page.get_by_role("group", name="Virtual time")).to_contain_text("paused")
    stood_ns = virtual_time_ns(studio)
    expect(now).to_have_text(seconds_text(stood_ns))
    page.get_by_label("Duration of a step").fill("0.25")
    button(page, "Step by a duration").click()
    expect(now).to_have_text(seconds_text(stood_ns + 250_000_000))
    assert virtual_time_ns(studio) == stood_ns + 250_000_000
    button(page, "0.1×").click()
    expect(button(page, "0.1×")).to_have_attribute("aria-pressed", "true")
    page.get_by_label("Speed of time").fill("0")
    button(page, "Set speed").click()
    expect(page.get_by_role("alert").last).to_contain_text("0: permitted is")
    expect(button(page, "0.1×")).to_have_attribute("aria-pressed", "true")
    page.locator("body").press("p")
    page.get_by_label("Condition").fill("table.M1.position > 3 and")
    button(page, "Step until a condition").click()
    expect(page.get_by_role("alert").last).to_contain_text("table.M1.position > 3 and")


def test_the_page_goes_back_with_the_world(studio: Studio) -> None:
    page = studio.page()
    ask(studio, "snapshot", name="before")
    studio.master.enable(1)
    studio.master.move(1, 20.0)
    expect(page.get_by_label("M1 position", exact=True)).to_have_text("20.00")
    show(page, "Time")
    expect(page.get_by_label("World time")).not_to_have_text("0.000000")
    back = ask(studio, "restore", name="before")
    expect(page.get_by_label("World time")).to_have_text(seconds_text(int(back["time_ns"])))
    expect(page.get_by_role("group", name="Virtual time")).to_contain_text("paused")
    expect(page.get_by_role("contentinfo", name="Events")).to_contain_text("back at snapshot before")
    show(page, "Axes")
    expect(page.get_by_label("M1 position", exact=True)).to_have_text("0.00")
    expect(button(page, "Enable M1")).to_have_attribute("aria-pressed", "false")
    for _ in range(20):  # more often than a connection may follow events: nothing is asked for twice
        ask(studio, "restore", name="before")
    ask(studio, "resume", speed=1.0)
    enable(page)
    page.get_by_label("Target M1").fill("4")
    page.get_by_label("Target M1").press("Enter")
    expect(page.get_by_label("M1 position", exact=True)).to_have_text("4.00")


def test_every_panel_goes_to_a_moment_of_the_past(studio: Studio) -> None:
    page = studio.page()
    button(page, "Open beside").click()
    page.get_by_label("Panel", exact=True).last.select_option(label="Time")
    position, now = page.get_by_label("M1 position", exact=True), page.get_by_label("World time")
    enable(page)
    studio.master.move(1, 20.0)
    expect(position).to_have_text("20.00")
    page.get_by_label("Moment to look at").fill("0")
    button(page, "Look at this moment").click()
    expect(now).to_have_text("0.000000")
    expect(position).to_have_text("0.00")
    expect(button(page, "Enable M1")).to_have_attribute("aria-pressed", "false")
    expect(button(page, "Enable M1")).to_be_disabled()
    expect(page.get_by_role("group", name="Virtual time")).to_contain_text("in the past")
    assert studio.at(1) == 20.0, "the world goes on meanwhile"
    page.locator("body").press(".")
    expect(position).to_have_text("20.00")
    page.locator("body").press(",")
    expect(page.get_by_role("group", name="The past")).to_be_visible()
    button(page, "To the present").click()
    expect(page.get_by_role("group", name="The past")).to_have_count(0)
    expect(button(page, "Enable M1")).to_be_enabled()
    # The time line goes back by events, and plays on to the present.
    page.get_by_role("slider", name="Time line").press("ArrowLeft")
    expect(page.get_by_role("group", name="The past")).to_be_visible()
    page.get_by_label("Speed of playing").select_option(label="10×")
    page.get_by_role("button", name="Play").click()
    expect(page.get_by_role("group", name="The past")).to_have_count(0)
    # What others do while one looks back is there afterwards; stop works all the time.
    button(page, "Look at this moment").click()
    expect(position).to_have_text("0.00")
    studio.master.move(1, 500.0)
    until(lambda: studio.at(1) > 30.0, "the axis moves")
    page.locator("body").press("Space")
    until(lambda: studio.stands(1), "space has stopped it")
    expect(position).to_have_text("0.00")
    page.locator("body").press(".")
    expect(position).to_have_text(f"{studio.at(1):.2f}")


def test_the_machine_is_taken_back_to_a_moment(studio: Studio) -> None:
    page = studio.page()
    enable(page)
    expect(page.get_by_role("group", name="Virtual time")).to_contain_text("live")
    page.get_by_label("Target M1").fill("20")
    button(page, "Move M1 to").click()
    until(lambda: studio.at(1) == 20.0, "the axis is at 20 mm")
    show(page, "Time")
    page.get_by_label("Moment to look at").fill("0")
    button(page, "Look at this moment").click()
    band = page.get_by_role("group", name="The past")
    button(page, "Take the machine back to here…").click()
    button(page, "Cancel").click()
    assert studio.at(1) == 20.0
    button(page, "Take the machine back to here…").click()
    band.get_by_role("button", name=re.compile("^Take it back")).click()
    expect(band).to_have_count(0)
    expect(page.get_by_role("group", name="Virtual time")).to_contain_text("paused")
    expect(page.get_by_label("World time")).to_have_text("0.000000")
    expect(page.get_by_role("contentinfo", name="Events")).to_contain_text("time went back to here")
    assert studio.at(1) == 0.0
    assert studio.master.status(1) == 0
    page.locator("body").press(".")
    show(page, "Axes")
    enable(page)
    page.get_by_label("Target M1").fill("3")
    page.get_by_label("Target M1").press("Enter")
    until(lambda: studio.at(1) == 3.0, "it goes on from there")


def ask(studio: Studio, request: str, /, **fields: object) -> Any:
    """Over REST, as another program does."""
    response = httpx.post(f"{studio.process.url}/api/do/{request}", json=fields)
    assert response.status_code == 200, response.text
    return response.json()["ok"]


def seconds_text(time_ns: int) -> str:
    """As the page shows it: microseconds, cut off."""
    return f"{time_ns // 1000 / 1e6:.6f}"


def polls_a_request(page: Page) -> None:
    """A list of requests is sent again and again; what is answered is seen without them being sent by hand."""
    for typed in ("m1_status", "03 23 28 00 01"):
        page.get_by_label("Function code and data (hex)").fill(typed)
        button(page, "Add to poll list").click()
    polled = page.get_by_role("region", name="Poll list")
    expect(polled.get_by_role("row")).to_have_count(2)
    polls = polled.get_by_role("button", name="Poll", exact=True)
    polls.click()
    expect(polled.get_by_role("row", name=re.compile("M1_STATUS = "))).to_be_visible()
    expect(polled.get_by_role("row", name=re.compile("▲ exception 02"))).to_be_visible()
    polled.get_by_role("button", name="Remove 0323280001 from the poll list").click()
    expect(polled.get_by_role("row")).to_have_count(1)
    polls.click()


def test_frames_are_shown_in_words_and_sent(studio: Studio, tmp_path: Path, require_peer: Callable[[str], str]) -> None:
    page = studio.page(panel="Frames")
    frames = page.get_by_role("region", name="Frames of the lines")
    expect(frames).to_contain_text("No frames yet")
    row = frames.get_by_role("row", name=re.compile("read M1_POS_ACT = 0 mm"))
    # Frames from before its subscription has arrived are not for the panel.
    until(lambda: studio.master.words(10020, 2) and row.count() > 0, "a read is shown")
    assert studio.master.client.read_holding_registers(9000, count=1, device_id=1).isError()
    expect(page.get_by_text("errors: 1")).to_be_visible()
    page.get_by_label("Errors only").check()
    expect(frames.get_by_role("row")).to_have_count(2)
    page.get_by_label("Errors only").uncheck()
    page.get_by_label("Show frames with").fill("←")
    expect(frames.get_by_role("img", name="from the controller").first).to_be_visible()
    expect(frames.get_by_role("img", name="to the controller")).to_have_count(0)
    page.get_by_label("Show frames with").fill("")
    page.get_by_label("Function code and data (hex)").fill("05 07 D0 FF 00")
    button(page, "Send request").click()
    until(lambda: studio.master.status(1) == 1, "the request has enabled the drive")
    page.get_by_label("Function code and data (hex)").fill("05 7")
    button(page, "Send request").click()
    expect(page.get_by_role("alert").last).to_contain_text("pairs of hexadecimal digits")
    polls_a_request(page)
    (tmp_path / "frames.pcapng").write_bytes(downloaded(page, "Save as pcapng"))
    command = [require_peer("tshark"), "-r", str(tmp_path / "frames.pcapng"), "-T", "fields", "-e", "modbus.func_code"]
    decoded = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    assert decoded.count("3") >= 4
    assert b"read M1_POS_ACT = 0 mm" in downloaded(page, "Save as CSV")


def test_the_program_shows_the_line_it_is_at(start_studio: Callable[..., Process], browser: Browser) -> None:
    studio = Studio(start_studio("--demo"), browser)
    page = studio.page(panel="Program")
    text = page.get_by_role("region", name="Text of demo.prg")
    expect(text).to_contain_text("PABS M1")
    now = text.locator("[aria-current=step]")
    expect(now).to_have_count(1)
    shown = now.inner_text()
    expect(now).not_to_have_text(shown)  # it goes on
    expect(page.get_by_role("row", name=re.compile("^done"))).to_be_visible()
    button(page, "Stop the program of table").click()
    until(lambda: studio.master.words(10003)[0] == 0, "the master sees that it has stopped")
    expect(now).to_have_count(0)
    button(page, "Start the program of table").click()
    until(lambda: studio.master.words(10003)[0] == 1, "the master sees that it runs")
    expect(now).to_have_count(1)
    studio.close()
    assert studio.complaints == []


def test_the_wiring_is_shown_with_its_levels(start_studio: Callable[..., Process], browser: Browser) -> None:
    studio = Studio(start_studio("--demo"), browser)
    page = studio.page(panel="I/O")
    button(page, "Wiring").click()
    table = page.get_by_role("region", name="Wiring of table")
    expect(table).to_contain_text("x.switch1")
    lamp = table.get_by_role("img", name="table.IN9 level").get_by_role("img")
    expect(lamp).to_have_accessible_name("off")
    button(page, "Press part").hover()
    page.mouse.down()
    expect(lamp).to_have_accessible_name("on")
    page.mouse.up()
    table.get_by_role("button", name="cup.held").click()
    expect(page.get_by_role("region", name="Wiring of cup").locator(".row.marked")).to_contain_text("held")
    button(page, "Levels").click()
    expect(page.get_by_label("Force IN4")).to_be_visible()
    expect(page.get_by_text("↔ cup.held")).to_be_visible()
    studio.close()
    assert studio.complaints == []


def test_the_machine_is_drawn_and_its_button_pressed(start_studio: Callable[..., Process], browser: Browser) -> None:
    studio = Studio(start_studio("--demo"), browser)
    page = studio.page(panel="Machine")
    page.get_by_label("Selected").select_option("x")
    place = page.get_by_label("x place")
    expect(place).not_to_have_text("–")
    shown = place.inner_text()
    expect(place).not_to_have_text(shown)  # the program moves it
    expect(page.locator("svg .piece").filter(visible=True).first).to_be_visible()  # a workpiece
    press = button(page, "Press part")
    press.hover()
    page.mouse.down()
    until(lambda: studio.master.inputs(5008, 1) == [True], "the master sees the button")
    page.mouse.up()
    until(lambda: studio.master.inputs(5008, 1) == [False], "it is released")
    button(page, "Stop all").click()
    until(lambda: studio.master.words(10003)[0] == 2, "the program has been paused")
    until(lambda: studio.stands(1) and studio.stands(2), "the axes stand")
    target = 60.0 if studio.at(1) > 100.0 else 140.0
    studio.master.enable(1)
    studio.master.move(1, target)
    until(lambda: studio.at(1) == target, "the axis has moved")
    url = f"{studio.process.url}/api/points?names=x.position"
    true = httpx.get(url).json()["ok"][0]["value"]
    until(lambda: abs(number(place) - true) < 0.02, "the drawing shows where the load is")
    studio.close()
    assert studio.complaints == []


CLAMP = """
[[line]]
name = "bus"
tcp = "127.0.0.1:0"
[[mic488]]
name = "cell"
line = "bus"
[[cylinder]]
name = "clamp"
extend = "cell.OUT1"
stroke = 50.0
[[wire]]
from = "clamp.extended"
to = "cell.IN1"
"""


SYMBOLS = """
[[line]]
name = "bus"
tcp = "127.0.0.1:0"
[[mic488]]
name = "cell"
line = "bus"
[[axis]]
name = "z"
drive = "cell.M1"
pitch = 5.0
[axis.motor]
torque = [[0, 1.0]]
inertia = 0.0001
when_off = "free"
[[gate]]
name = "both"
kind = "and"
inputs = ["cell.OUT1", "cell.OUT2"]
[[latch]]
name = "kept"
set = "both.out"
[[timer]]
name = "later"
input = "both.out"
kind = "on-delay"
time = "1 s"
[[counter]]
name = "parts"
up = "both.out"
preset = 3
[[relay]]
name = "safety"
coil = "both.out"
[[brake]]
name = "hold"
axis = "z"
torque = 0.5
[[collision]]
name = "crash"
when = "z.position > 100"
[[supply]]
name = "power"
feeds = "cell"
[[transducer]]
name = "gap"
of = "z.position"
to = "cell.AIN1"
points = [[0, 1], [100, 9]]
[[vacuum]]
name = "cup"
ejector = "cell.OUT3"
[[load]]
name = "box"
axis = "z"
mass = 2
"""


def test_every_element_is_drawn(start_studio: Callable[..., Process], browser: Browser, tmp_path: Path) -> None:
    """By a track, or by a symbol of its kind: none has lamps only. `test_complete` finds those that are not here."""
    (tmp_path / "symbols.toml").write_text(SYMBOLS)
    studio = Studio(start_studio("--itself", str(tmp_path / "symbols.toml")), browser)
    page = studio.page(panel="Machine")
    expect(page.get_by_role("region", name="box, load")).to_be_visible()
    drawn = {node.get_attribute("data-symbol") for node in page.locator("[data-symbol]").all()}
    there = {kind for kind in re.findall(r"^\[\[(\w+)\]\]", SYMBOLS, re.MULTILINE) if kind in ELEMENTS}
    assert drawn == {kind for kind in there if ELEMENTS[kind].drawing is None} - {"axis", "button", "wire", "source"}
    studio.close()
    assert studio.complaints == []


def test_elements_show_their_terminals_and_values(start_studio: Callable[..., Process], browser: Browser, tmp_path: Path) -> None:
    (tmp_path / "clamp.toml").write_text(CLAMP)
    studio = Studio(start_studio("--itself", str(tmp_path / "clamp.toml")), browser)
    page = studio.page(panel="Machine")
    clamp = page.get_by_role("region", name="clamp, cylinder")
    expect(clamp).to_contain_text("0.0 mm")
    expect(clamp.get_by_role("img", name="clamp retracted: 1")).to_be_visible()
    studio.master.coil(6000, True)
    until(lambda: studio.master.inputs(5000, 1) == [True], "the master sees the sensor")
    expect(clamp).to_contain_text("50.0 mm")
    expect(clamp.get_by_role("img", name="clamp extended: 1")).to_be_visible()
    studio.close()
    assert studio.complaints == []
