"""Pictures of the demo machine for README and docs: ``python -m tests.studio.pictures``.

Those of other states are made by the tests, in build/studio.
"""

from __future__ import annotations

import io
import json
import shutil
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page, sync_playwright
from tests.studio.measure_page import show, studio

from steptwin.commands.demo import describe_demo

IMAGES = Path(__file__).parents[2] / "docs/images"
COLOURS = 256
BEGUN_MS = 25_000
"""Until the machine works in its cycle, and the curves fill the scope."""
ALONE = [["machine"]]
BESIDE = [["axes"], ["machine", "scope"]]
"""Panels by columns."""


def opened(page: Page, url: str, columns: list[list[str]]) -> None:
    """The page with these panels, after its first minute."""
    panes = [{"share": 1, "panes": [{"panel": panel, "share": 1} for panel in column]} for column in columns]
    kept = json.dumps(json.dumps({"version": 1, "value": panes}))
    page.add_init_script(f"localStorage.setItem('steptwin.layout', {kept})")
    page.goto(url)
    page.get_by_role("button", name="Skip").click()


def picture(page: Page, name: str) -> None:
    shot = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
    shot.quantize(COLOURS, kmeans=2, dither=Image.Dither.NONE).save(IMAGES / f"{name}.png", optimize=True)


def main() -> None:
    chromium = shutil.which("chromium")
    with studio(describe_demo(free_ports=True)) as url, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1600, "height": 900})
        opened(page, url, BESIDE)
        page.wait_for_timeout(BEGUN_MS)
        picture(page, "studio-axes")
        page = browser.new_page(viewport={"width": 1280, "height": 720})
        opened(page, url, ALONE)
        page.wait_for_timeout(BEGUN_MS)
        picture(page, "studio-machine")
        show(page, "Scope")
        page.wait_for_timeout(2000)
        picture(page, "studio-scope")


if __name__ == "__main__":
    main()
