"""Every panel of the demo machine in a browser: on a screen, a tablet, a phone and where two share a page, for eyes and for
assistive technology, in both languages."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from typing import NamedTuple

import httpx
import pytest
from mosquitto import free_port
from playwright.sync_api import Browser, Page
from studio_page import PICTURES, Studio, button, covered, panels_of, serious, show, wider_than_panes
from tests.studio.conftest import Process, StudioWorld

from steptwin.live.studio.demo import describe_demo

PLANT = """
[gateway.opcua]
listen = "127.0.0.1:0"
[gateway.mqtt]
broker = "127.0.0.1:{port}"
[gateway.prometheus]
listen = "127.0.0.1:0"
[history]
database = "sqlite:///kept.db"
"""
DONE = (
    ("enable", {"controller": "table", "axis": 1}),
    ("move", {"controller": "table", "axis": 7, "to": 1e9}),  # refused
    ("save_recording", {"name": "a_recording_with_a_long_name"}),
)

WIDTH_WHEN_DRAWN = """() => new Promise((done) =>
  requestAnimationFrame(() => requestAnimationFrame(() => done(document.documentElement.scrollWidth))))"""
ENGLISH = """() => {
  const words =
    /(?<![\\p{L}_])(the|of|with|which|and|from|that|are|is|not|for|has|have|this|it|its|when|where|after|before|until)(?![\\p{L}_])/iu;
  const found = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    const own = node.parentElement.closest("[lang], .cm-editor, style, script");
    if (own !== null && own !== document.documentElement) continue;
    if (words.test(node.textContent.replace(/\\S*\\/\\S*/g, ""))) found.push(node.textContent.trim());
  }
  return [...new Set(found)];
}"""


class Look(NamedTuple):
    """A page as somebody has it; it is opened in the first of its sizes."""

    name: str
    language: str
    theme: str
    sizes: tuple[tuple[int, int], ...]

    @property
    def stop_all(self) -> str:
        return "Stop all" if self.language == "en-US" else "Zatrzymaj wszystko"


LOOKS = (
    Look("screen", "en-US", "light", ((1280, 720), (1920, 1080))),
    Look("phone", "en-US", "light", ((390, 844),)),
    Look("two panes", "pl-PL", "dark", ((1440, 900),)),
    Look("tablet", "pl-PL", "dark", ((820, 1180),)),
)
FOR_ASSISTIVE_TECHNOLOGY = ("screen", "two panes")
LOW = 330
"""Height of a window with little room for a panel. [px]"""
POLLED = json.dumps({"version": 1, "value": [{"line": "bus", "unit": 1, "pdu": f"03272400{count:02x}"} for count in range(1, 6)]})


@pytest.fixture
def studio_world() -> StudioWorld:
    return StudioWorld(describe_demo(free_ports=True) + PLANT.format(port=free_port()))


@pytest.mark.parametrize("look", LOOKS, ids=lambda look: look.name)
def test_every_panel(start_studio: Callable[..., Process], browser: Browser, look: Look) -> None:
    """Nothing is cut off in it but code, drawings and texts that end with an ellipsis; in a low pane, too, everything can be
    clicked; nothing serious is wrong for assistive technology; English texts of controllers and manuals are marked on the Polish
    page, so that they are read out as English."""
    process = start_studio()
    for request, fields in DONE:
        httpx.post(f"{process.url}/api/do/{request}", json=fields, timeout=60)
    studio = Studio(process, browser)
    width, height = look.sizes[0]
    alone = "Osie" if look.name == "two panes" else None
    options = {"viewport": {"width": width, "height": height}, "color_scheme": look.theme, "bypass_csp": True}
    poll = f"localStorage.setItem('steptwin.frames.poll', {POLLED!r})"
    page = studio.page(look.language, panel=alone, init_script=poll, **options)
    if look.name == "two panes":
        button(page, "Otwórz obok").click()
    PICTURES.mkdir(parents=True, exist_ok=True)
    found: list[str] = []
    panels = panels_of(page)
    for number, panel in enumerate(panels, 1):
        show(page, panel)
        page.wait_for_timeout(300)
        found += [f"{panel}: {what}" for what in faults_of(page, look)]
        page.screenshot(path=PICTURES / f"{look.name.replace(' ', '-')}-{number}.png")
    if look.name == "two panes":
        page.set_viewport_size({"width": width, "height": LOW})
        for panel in panels:
            show(page, panel)
            found += [f"{panel}: in a low window: {what}" for what in covered(page)]
    if look.language == "pl-PL":
        page.get_by_role("button", name=re.compile("Zdarzenia")).click()
        found += [f"Zdarzenia: English: {text}" for text in page.evaluate(ENGLISH)]
    studio.close()
    assert len(panels) == 18
    assert found == []
    assert studio.complaints == []


def faults_of(page: Page, look: Look) -> list[str]:
    """In every size: the page is as wide as its window, and Stop all is in sight."""
    found = serious(page) if look.name in FOR_ASSISTIVE_TECHNOLOGY else []
    if look.language == "pl-PL":
        found += [f"English: {text}" for text in page.evaluate(ENGLISH)]
    for width, height in look.sizes[::-1]:
        if len(look.sizes) > 1:
            page.set_viewport_size({"width": width, "height": height})
        if (drawn := page.evaluate(WIDTH_WHEN_DRAWN)) > width:
            found.append(f"{drawn} instead of {width} px wide")
        found += [f"wider than its pane at {width} px: {part}" for part in wider_than_panes(page)]
        box = button(page, look.stop_all).bounding_box()
        if box is None or not (0 <= box["x"] <= width - box["width"] and 0 <= box["y"] <= height - box["height"]):
            found.append(f"{look.stop_all} at {box} is not in sight of {width} x {height}")
    return found
