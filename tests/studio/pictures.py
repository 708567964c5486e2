"""Pictures for README and docs: ``python -m tests.studio.pictures`` makes those of the demo machine and of elements.

Those of other states are made by the tests, in build/studio, and taken from there, as far as they are newer than the built page.
"""

from __future__ import annotations

import io
import json
import shutil
from pathlib import Path

import httpx
from PIL import Image
from playwright.sync_api import Browser, Locator, Page, sync_playwright
from tests.studio.measure_page import show, studio

from steptwin.live.studio.demo import describe_demo
from steptwin.studio.page import find_page

ROOT = Path(__file__).parents[2]
IMAGES = ROOT / "docs/images"
OF_TESTS = {
    "studio-campaigns": "campaigns",
    "studio-debugger": "debugger",
    "studio-devices": "devices",
    "studio-history": "history",
    "studio-shadow": "shadow",
}
"""Of the documentation, and as tests name them."""
ELEMENTS = """
[[mic488]]
name = "table"
[mic488.M1]
unit = "mm"
gear = 640.0
[[axis]]
name = "z"
drive = "table.M1"
pitch = 5.0
[axis.motor]
torque = [[0, 0.9], [1500, 0.7]]
inertia = 0.00003
mass = 4.0
when_off = "free"
[[gate]]
name = "both"
kind = "and"
inputs = ["table.OUT1", "table.OUT2"]
[[timer]]
name = "later"
kind = "on-delay"
input = "both.out"
time = "400 ms"
[[latch]]
name = "kept"
set = "later.out"
reset = "table.OUT3"
[[counter]]
name = "parts"
up = "table.OUT2"
preset = 5
[[relay]]
name = "safety"
[[wire]]
from = "kept.out"
to = "safety.coil"
[[source]]
name = "oven"
to = "table.AIN1"
kind = "table"
points = [[0, 1.0], [5, 6.0]]
[[conveyor]]
name = "line"
length = 600.0
speed = 200.0
run = "table.OUT1"
feed_every = "900 ms"
workpiece = 60.0
[[conveyor.stop]]
at = 450.0
hold = "table.OUT2"
[[cylinder]]
name = "clamp"
extend = "table.OUT1"
stroke = 50.0
[[gripper]]
name = "jaws"
close = "table.OUT2"
[[vacuum]]
name = "cup"
ejector = "table.OUT1"
[[brake]]
name = "hold"
axis = "z"
torque = 0.6
release = "table.OUT1"
[[load]]
name = "box"
axis = "z"
mass = 12.0
when = "table.OUT2"
"""
ON = {"table.OUT1": 1, "table.OUT2": 1}
COLOURS = 256
BEGUN_MS = 25_000
"""Until the machine works in its cycle, and the curves fill the scope."""
ALONE = [["machine"]]
"""Panels by columns."""
SLOW_MS = 120_000
"""Without a graphics processor."""
GRAPHICS = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")


def opened(page: Page, url: str, columns: list[list[str]] | None = None) -> None:
    """The page with these panels, otherwise with those that it begins with, after its first minute."""
    page.set_default_timeout(SLOW_MS)
    if columns is not None:
        choose(page, columns)
    page.goto(url)
    page.get_by_role("button", name="Skip").click()


def choose(page: Page, columns: list[list[str]]) -> None:
    panes = [{"share": 1, "panes": [{"panel": panel, "share": 1} for panel in column]} for column in columns]
    kept = json.dumps(json.dumps({"version": 1, "value": panes}))
    page.add_init_script(f"localStorage.setItem('steptwin.layout', {kept})")


def picture(of: Page | Locator, name: str) -> None:
    keep(of.screenshot(), name)


def keep(png: bytes, name: str) -> None:
    shot = Image.open(io.BytesIO(png)).convert("RGB")
    shot.quantize(COLOURS, kmeans=2, dither=Image.Dither.NONE).save(IMAGES / f"{name}.png", optimize=True)


def main() -> None:
    chromium = shutil.which("chromium-headless-shell")
    with studio(describe_demo(free_ports=True)) as url, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox", *GRAPHICS])
        page = browser.new_page(viewport={"width": 1600, "height": 900})
        opened(page, url)
        page.wait_for_timeout(BEGUN_MS)
        picture(page, "studio-axes")
        page.close()
        page = browser.new_page(viewport={"width": 1280, "height": 720})
        opened(page, url, ALONE)
        page.wait_for_timeout(BEGUN_MS)
        picture(page, "studio-machine")
        page.get_by_role("button", name="3D", exact=True).click()
        page.get_by_role("button", name="Follow", exact=True).wait_for()
        page.wait_for_timeout(5000)
        picture(page.locator("canvas[data-engine]"), "studio-space")
        show(page, "Scope")
        page.wait_for_timeout(2000)
        picture(page, "studio-scope")
        elements(browser)
    built = (find_page() / "index.html").stat().st_mtime
    for name, of_test in OF_TESTS.items():
        file = ROOT / f"build/studio/{of_test}.png"
        if file.exists() and file.stat().st_mtime > built:
            keep(file.read_bytes(), name)


def elements(browser: Browser) -> None:
    with studio(ELEMENTS) as url:
        page = browser.new_page(viewport={"width": 1700, "height": 1120})
        opened(page, url, ALONE)
        page.wait_for_timeout(2000)
        httpx.post(f"{url}api/do/write", json={"values": ON}).raise_for_status()
        page.wait_for_timeout(4000)
        picture(page.get_by_role("group", name="Elements"), "studio-elements")


if __name__ == "__main__":
    main()
