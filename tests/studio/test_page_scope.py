"""The scope of the page in a real browser."""

from __future__ import annotations

import csv
import itertools
from collections.abc import Callable

from playwright.sync_api import Browser, expect
from studio_page import PICTURES, Studio, button, downloaded, enable, show, virtual_time_ns
from tests.conftest import until
from tests.studio.conftest import Process


def test_the_scope_has_the_curve_of_a_move(studio: Studio) -> None:
    page = studio.page()
    enable(page)
    show(page, "Scope")
    page.get_by_label("Trigger signal").select_option("table.M1.position")
    page.get_by_label("Trigger level").fill("10")
    button(page, "Arm").click()
    expect(page.get_by_text("waiting for the trigger")).to_be_visible()
    studio.master.move(1, 20.0)
    expect(page.get_by_text("triggered at")).to_be_visible()
    expect(button(page, "Follow")).to_have_attribute("aria-pressed", "false")
    until(lambda: studio.at(1) == 20.0, "the axis is at 20 mm")
    button(page, "Follow").click()
    rows = [line.split(",") for line in downloaded(page, "Save as CSV").decode().splitlines()]
    assert rows[0][:2] == ["time [s]", '"M1 position [mm]"']
    positions = [float(row[1]) for row in rows[1:] if row[1]]
    assert (positions[0], positions[-1]) == (0.0, 20.0)
    assert positions == sorted(positions)
    moments = [(float(row[0]), float(row[1])) for row in rows[1:] if row[1]]
    fastest = max((y1 - y0) / (t1 - t0) for (t0, y0), (t1, y1) in itertools.pairwise(moments))
    assert 39.9 < fastest < 40.1  # mm/s, as the description has it
    assert downloaded(page, "Save as PNG").startswith(b"\x89PNG")
    assert b"$var real 64 ! table.M1.position $end" in downloaded(page, "Save as VCD")


def test_the_scope_shows_what_was_before_the_page_was_opened(studio: Studio) -> None:
    studio.master.enable(1)
    studio.master.move(1, 20.0)
    until(lambda: studio.at(1) == 20.0, "the axis is at 20 mm")
    page = studio.page(panel="Scope")

    def positions() -> list[float]:
        rows = [line.split(",") for line in downloaded(page, "Save as CSV").decode().splitlines()]
        column = rows[0].index('"M1 position [mm]"')
        return [float(row[column]) for row in rows[1:] if row[column]]

    button(page, "Zoom out").click()
    until(lambda: min(positions()) == 0.0, "the beginning has come")
    found = positions()
    assert found == sorted(found)
    assert found[-1] == 20.0
    assert any(5 < position < 15 for position in found)


def test_the_scope_has_frames_program_lines_and_phase_currents(start_studio: Callable[..., Process], browser: Browser) -> None:
    studio = Studio(start_studio("--demo"), browser)
    page = studio.page(panel="Scope", viewport={"width": 1280, "height": 800})
    button(page, "Choose signals").click()
    for name in ("bus frames", "table program line", "drum phase current 1"):
        page.get_by_role("searchbox").fill(name)
        page.get_by_role("checkbox", name=name).check()
    button(page, "Choose signals").click()
    for _ in range(20):
        studio.at(1)  # a frame
    begin = virtual_time_ns(studio)
    until(lambda: virtual_time_ns(studio) > begin + 8_000_000_000, "the program has gone on for a while")
    rows = list(csv.DictReader(downloaded(page, "Save as CSV").decode().splitlines()))
    lines = {row["table program line"] for row in rows} - {""}
    assert len(lines) > 3
    assert all(20 < int(line) < 100 for line in lines)
    currents = [float(row["drum phase current 1 [%]"]) for row in rows if row["drum phase current 1 [%]"]]
    assert max(map(abs, currents)) <= 100
    assert not any("frames" in name for name in rows[0])
    page.screenshot(path=PICTURES / "scope-channels.png")
    studio.close()
    assert studio.complaints == []
