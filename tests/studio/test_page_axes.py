"""The axes panel of the page, in a browser."""

from __future__ import annotations

from collections.abc import Callable

import httpx
from playwright.sync_api import Browser, expect
from studio_page import Studio, button, enable, tab_to
from tests.conftest import until
from tests.studio.conftest import Process


def test_an_axis_is_enabled_and_moved(studio: Studio) -> None:
    page = studio.page()
    enable(page)
    page.get_by_label("Target M1").fill("20")
    button(page, "Move M1 to").click()
    until(lambda: studio.at(1) == 20.0, "the axis is at 20 mm")
    expect(page.get_by_label("M1 position", exact=True)).to_have_text("20.00")
    expect(page.get_by_label("M1 status")).to_contain_text("position reached")
    page.get_by_label("Step M1", exact=True).fill("2,5")
    button(page, "Step M1 −").click()
    until(lambda: studio.at(1) == 17.5, "the axis has gone back by 2.5 mm")


def test_a_move_that_is_ignored_says_why(studio: Studio) -> None:
    page = studio.page()
    page.get_by_label("Target M1").fill("20")
    button(page, "Move M1 to").click()
    expect(page.get_by_role("alert").last).to_contain_text("position command ignored: M1 is not enabled")
    assert studio.at(1) == 0.0


def test_a_move_while_time_is_paused_says_when_it_begins(studio: Studio) -> None:
    page = studio.page()
    enable(page)
    button(page, "Pause time").click()
    page.get_by_label("Target M1").fill("20")
    button(page, "Move M1 to").click()
    expect(page.get_by_role("alert").last).to_contain_text("Time is paused: M1 moves when it runs again.")
    button(page, "Let time go on").click()
    until(lambda: studio.at(1) == 20.0, "the axis is at 20 mm")


def test_a_jog_lasts_as_long_as_it_is_held(studio: Studio) -> None:
    page = studio.page()
    enable(page)
    button(page, "Jog M1 +").hover()
    page.mouse.down()
    until(lambda: studio.at(1) > 5, "the axis jogs")
    expect(page.get_by_label("M1 status")).not_to_contain_text("on at rest")
    page.mouse.up()
    until(lambda: studio.stands(1), "the axis stands")
    there = studio.at(1)
    expect(page.get_by_label("M1 position", exact=True)).to_have_text(f"{there:.2f}")
    assert studio.at(1) == there


def test_a_program_that_is_in_the_way_of_a_jog_is_paused_there(start_studio: Callable[..., Process], browser: Browser) -> None:
    studio = Studio(start_studio("--demo"), browser)
    page = studio.page()
    jog = button(page, "Jog M1 +")
    jog.hover()
    page.mouse.down()
    expect(page.get_by_role("alert").last).to_contain_text("pause or stop it before an axis is jogged")
    page.mouse.up()
    expect(page.get_by_text("table runs its program, which moves the axes; to move them yourself:")).to_be_visible()
    button(page, "Pause the program of table").click()
    expect(page.get_by_text("table runs its program, which moves the axes; to move them yourself:")).to_have_count(0)
    until(lambda: studio.stands(1), "the axis stands")
    there = studio.at(1)
    jog.hover()
    page.mouse.down()
    until(lambda: studio.at(1) > there, "the axis jogs")
    page.mouse.up()
    expect(page.get_by_text("The program of table is paused.")).to_be_visible()
    button(page, "Resume the program of table").click()
    expect(button(page, "Pause the program of table")).to_be_visible()
    studio.close()
    assert studio.complaints == []


def test_a_jog_of_an_idle_world_begins_at_the_present(studio: Studio) -> None:
    """Nothing has happened for a while: the axis is not put where it would be had it jogged since the last event."""
    page = studio.page()
    enable(page)
    until(lambda: seconds(studio) > 6.0, "nothing happens for some seconds")
    before = seconds(studio)
    button(page, "Jog M1 +").hover()
    page.mouse.down()
    until(lambda: studio.at(1) > 1, "the axis jogs")
    there, gone = studio.at(1), seconds(studio) - before
    page.mouse.up()
    assert there <= 40.0 * (gone + 0.5), "mm, at no more than 40 mm/s since the button was pressed"
    assert gone < 5.0
    until(lambda: studio.stands(1), "the axis stands")


def seconds(studio: Studio) -> float:
    """Of virtual time."""
    answer = httpx.post(f"{studio.process.url}/api/do/read", json={"points": ["time"]}).json()
    return answer["ok"][0]["value"]


def test_a_jog_is_as_fast_as_the_one_before(studio: Studio) -> None:
    """A jog sets the greatest velocity to its own until the axis stands; the next one is a part of what it was before."""
    page = studio.page()
    enable(page)
    full = page.get_by_label("Velocity at 100 % of M1")
    expect(full).to_have_attribute("placeholder", "40")
    for name in ("Jog M1 +", "Jog M1 −", "Jog M1 +"):
        button(page, name).hover()
        page.mouse.down()
        until(lambda: abs(studio.master.sample(1).velocity) == 10.0, "a quarter of 40 mm/s")
        expect(full).to_have_attribute("placeholder", "40")
        page.mouse.up()


def test_closing_the_page_ends_a_jog(studio: Studio) -> None:
    page = studio.page()
    enable(page)
    button(page, "Jog M1 −").hover()
    page.mouse.down()
    until(lambda: studio.at(1) < -3, "the axis jogs")
    page.context.close()
    until(lambda: studio.stands(1), "the axis stands")
    assert studio.stands(1)


def test_the_jog_pad_jogs_two_axes_with_keys(studio: Studio) -> None:
    page = studio.page()
    for axis in ("M1", "M2"):
        enable(page, axis)
    page.get_by_role("application", name="Jog pad").focus()
    page.keyboard.down("Numpad9")
    until(lambda: studio.at(1) > 1 and studio.at(2) > 1, "both axes jog")
    page.keyboard.up("Numpad9")
    until(lambda: studio.stands(1) and studio.stands(2), "both axes stand")
    there = studio.at(2)
    page.keyboard.down("ArrowLeft")
    until(lambda: not studio.stands(1), "the first axis jogs")
    # The key is never let go: the focus is.
    page.get_by_label("Target M1").focus()
    until(lambda: studio.stands(1), "the first axis stands")
    assert studio.at(2) == there


def test_a_shortcut_of_the_system_ends_a_jog_of_the_pad(studio: Studio) -> None:
    page = studio.page()
    enable(page, "M1")
    page.get_by_role("application", name="Jog pad").focus()
    page.keyboard.down("ArrowRight")
    until(lambda: studio.at(1) > 1, "the axis jogs")
    page.keyboard.down("Meta")
    until(lambda: studio.stands(1), "the axis stands")
    there = studio.at(1)
    page.keyboard.press("ArrowLeft")
    page.keyboard.up("Meta")
    assert studio.stands(1)
    assert studio.at(1) == there


def test_space_and_escape_stop_what_somebody_else_moves(studio: Studio) -> None:
    page = studio.page()
    studio.master.enable(1)
    studio.master.run(1, 10.0)
    until(lambda: studio.at(1) > 1, "the axis moves")
    page.locator("body").press("Space")
    until(lambda: studio.stands(1), "space has stopped it")
    studio.master.run(1, 10.0)
    until(lambda: not studio.stands(1), "the axis moves")
    field = page.get_by_label("Target M1")
    field.fill("1 2")
    field.press("Space")
    assert not studio.stands(1)
    field.press("Escape")
    assert not studio.stands(1), "the first Escape leaves the field"
    page.keyboard.press("Escape")
    until(lambda: studio.stands(1), "Escape has stopped it")
    studio.master.run(1, 10.0)
    until(lambda: not studio.stands(1), "the axis moves")
    button(page, "Stop all").click()
    until(lambda: studio.stands(1), "the button has stopped it")


def test_a_click_leaves_the_space_key_to_stop(studio: Studio) -> None:
    page = studio.page()
    enable(page)
    studio.master.run(1, 10.0)
    until(lambda: studio.at(1) > 1, "the axis moves")
    page.keyboard.press("Space")
    until(lambda: studio.stands(1), "space has stopped it")
    expect(button(page, "Enable M1")).to_have_attribute("aria-pressed", "true")


def test_everything_about_an_axis_can_be_done_with_the_keyboard(studio: Studio) -> None:
    page = studio.page(panel=None)
    panels = page.get_by_role("navigation").get_by_role("button").all_inner_texts()
    page.keyboard.press(str(panels.index("Overview") + 1))
    expect(page.get_by_role("region", name="Overview").last).to_be_visible()
    page.keyboard.press(str(panels.index("Axes") + 1))
    expect(button(page, "Enable M1")).to_be_visible()
    names = tab_to(page, "Enable M1")
    page.keyboard.press("Enter")
    until(lambda: studio.master.status(1) == 1, "the drive is on")
    tab_to(page, "Target M1")
    page.keyboard.press("Control+a")
    page.keyboard.type("12")
    page.keyboard.press("Enter")
    until(lambda: studio.at(1) == 12.0, "the axis has moved")
    tab_to(page, "Jog M1 +")
    page.keyboard.down("Enter")
    until(lambda: studio.at(1) > 12.0, "the axis jogs")
    page.keyboard.up("Enter")
    until(lambda: studio.stands(1), "the axis stands")
    assert "Stop all" in names


def test_a_chip_has_what_its_data_sheet_has(studio: Studio) -> None:
    page = studio.page()
    expect(page.get_by_label("drum position")).to_have_text("0")
    expect(button(page, "Enable drum")).to_have_count(0)
    expect(button(page, "Home drum")).to_have_count(0)
    page.get_by_label("Step drum", exact=True).fill("6400")
    button(page, "Step drum +").click()
    expect(page.get_by_label("drum position")).to_have_text("6400")


def test_a_jog_that_is_refused_is_not_shown_as_held(studio: Studio) -> None:
    """The drive of M2 is off. The button may stay pressed; what is pressed next is another jog."""
    page = studio.page()
    jog = button(page, "Jog M2 +")
    jog.hover()
    page.mouse.down()
    expect(page.get_by_role("alert").last).to_contain_text("not enabled")
    expect(jog).not_to_have_attribute("data-held", "true")
    page.mouse.up()
