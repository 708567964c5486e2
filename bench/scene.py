"""The machine in space on the page: what a picture of 300 moving workpieces takes, and when the first one is seen."""

from __future__ import annotations

import gzip
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, Page, sync_playwright

from steptwin.live.studio.demo import FOLDER, describe_demo
from steptwin.studio.page import find_page

ALONG, ACROSS = 20, 15
PICTURES = 1000
RUNS = 5
UPDATE_GOAL_MS = 4.0
DRAWING_GOAL_S = 1.0
SOLID_GOAL_S = 2.5
PANEL_GOAL_KB = 220.0
APART_US = 10_000
"""Pictures are drawn farther apart than that, and what one takes is not interrupted for so long."""
GRAPHICS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
WORLD = f"""[world]
name = "magazine"
[[line]]
name = "bus"
kind = "modbus"
tcp = "127.0.0.1:0"
[[mic488]]
name = "table"
line = "bus"
[mic488.M1]
unit = "mm"
gear = 100.0
vel = 100.0
[[axis]]
name = "x"
drive = "table.M1"
unit = "mm"
pulses_per_unit = 100
travel = [0.0, 10000.0]
at = [0, 0, 100]
[[nest]]
name = "tray"
on = "x"
at = [0, 0, 50]
cells = [{ALONG}, {ACROSS}]
pitch = [50, 50]
workpiece = [40, 30, 20]
filled = {ALONG * ACROSS}
[[script]]
name = "on"
at = "0 s"
steps = [{{ write = {{ "table.M1_EN" = 1 }} }}]
[[script]]
name = "go"
at = "0.1 s"
repeat = 1000
steps = [
  {{ write = {{ "table.M1_POS_ABS" = 9900 }} }}, {{ wait = "98 s" }},
  {{ write = {{ "table.M1_POS_ABS" = 0 }} }}, {{ wait = "98 s" }},
]
"""
ONE_PANEL = """localStorage.setItem("steptwin.layout",
  JSON.stringify({version: 1, value: [{share: 1, panes: [{panel: "machine", share: 1}]}]}));"""
CHOSEN = """localStorage.setItem("steptwin.scene", JSON.stringify({version: 3, value:
  {view: "oblique", labels: false, path: false, travel: false, solid: %s}}));"""
KEEP = """window.ask = window.requestAnimationFrame.bind(window);
window.requestAnimationFrame = (draw) => { window.draw = draw; return window.isMeasured ? 1 : window.ask(draw); };"""
DRAW = """async (count) => {
  window.isMeasured = true;
  for (let n = 0; n < count; n++) {
    await new Promise((done) => setTimeout(done, 33));
    window.draw(performance.now());
  }
  window.isMeasured = false;
  window.ask(window.draw);
}"""
SEEN = """const look = () => {
  const part = document.querySelector("%s");
  if (part === null || part.classList.contains("unknown")) requestAnimationFrame(look);
  else requestAnimationFrame(() => (window.seen = performance.now()));
};
requestAnimationFrame(look);"""
FIRST = {False: ("drawing", "svg .solid.moving", DRAWING_GOAL_S), True: ("three dimensions", "canvas:not(.behind)", SOLID_GOAL_S)}


@contextmanager
def studio(text: str) -> Generator[str]:
    """Its address."""
    with tempfile.TemporaryDirectory() as name:
        folder, ready = Path(name), Path(name) / "ready.json"
        (folder / "world.toml").write_text(text)
        shutil.copy(FOLDER / "demo.prg", folder)
        options = ["--http", "127.0.0.1:0", "--no-browser", "--open-to-local-users", "--ready-file", str(ready)]
        command = [sys.executable, "-m", "steptwin", "studio", str(folder / "world.toml"), *options]
        environment = {**os.environ, "XDG_RUNTIME_DIR": name, "TERM": "dumb"}
        with subprocess.Popen(command, stdout=subprocess.DEVNULL, env=environment) as process:
            try:
                while not ready.exists() and process.poll() is None:
                    time.sleep(0.05)
                points = json.loads(ready.read_text())["end_points"]
                yield next(point["url"] for point in points if point["kind"] == "http")
            finally:
                process.terminate()


def load() -> str:
    return f"load {os.getloadavg()[0]:.1f}"


def is_of(node: Mapping[str, Any], *, own: bool) -> bool:
    """Whether a node of a profile begins what scripts of the page do, or, within that, what three.js does."""
    call = node["callFrame"]
    return call["url"].endswith(".js") if own else call["functionName"].endswith("render")


def own_ms(profile: Mapping[str, Any]) -> list[float]:
    """What scripts of the page take for each picture, without three.js and what that calls."""
    nodes = {node["id"]: node for node in profile["nodes"]}
    own: set[int] = set()
    page: set[int] = set()

    def enter(number: int, *, in_page: bool, in_three: bool) -> None:
        in_page = in_page or is_of(nodes[number], own=True)
        in_three = in_three or is_of(nodes[number], own=False)
        page.update([number] if in_page else [])
        own.update([number] if in_page and not in_three else [])
        for child in nodes[number].get("children", ()):
            enter(child, in_page=in_page, in_three=in_three)

    enter(profile["nodes"][0]["id"], in_page=False, in_three=False)
    found, rested_us = [0.0], 0.0
    for sample, delta in zip(profile["samples"], profile["timeDeltas"], strict=True):
        if sample not in page:
            rested_us += delta
            continue
        if rested_us > APART_US:
            found.append(0.0)
        rested_us = 0.0
        found[-1] += delta / 1000 if sample in own else 0.0
    return sorted(found)


def own_bytes(node: Mapping[str, Any], found: Counter[str]) -> Counter[str]:
    """By function, without three.js."""
    if not is_of(node, own=False):
        if is_of(node, own=True):
            found[node["callFrame"]["functionName"]] += node["selfSize"]
        for child in node["children"]:
            own_bytes(child, found)
    return found


def pictures(browser: Browser, url: str, *, is_solid: bool) -> None:
    """What a picture takes in which all workpieces move. The code of the page is that of its own scripts, not of three.js."""
    what = FIRST[is_solid][0]
    page = browser.new_page(viewport={"width": 1920, "height": 1080})
    page.add_init_script(ONE_PANEL + CHOSEN % json.dumps(is_solid) + KEEP)
    page.goto(url)
    page.locator(FIRST[is_solid][1]).first.wait_for(state="attached")
    page.wait_for_timeout(3000)
    session = page.context.new_cdp_session(page)
    session.send("Profiler.enable")
    session.send("Profiler.setSamplingInterval", {"interval": 100})
    session.send("Profiler.start")
    page.evaluate(DRAW, PICTURES)
    spent = own_ms(session.send("Profiler.stop")["profile"])
    median, most, count = statistics.median(spent), spent[int(0.95 * len(spent))], page.locator("svg .piece").count()
    goal = f"goal {UPDATE_GOAL_MS:g} ms"
    print(f"{what} of {count} workpieces: own code median {median:.2f} ms, p95 {most:.2f} ms ({goal}); {load()}")
    options = {"samplingInterval": 1024, "includeObjectsCollectedByMajorGC": True, "includeObjectsCollectedByMinorGC": True}
    session.send("HeapProfiler.startSampling", options)
    page.evaluate(DRAW, PICTURES)
    allocated = own_bytes(session.send("HeapProfiler.stopSampling")["profile"]["head"], Counter())
    most_of = ", ".join(f"{name or '(anonymous)'} {size / PICTURES:.0f}" for name, size in allocated.most_common(8) if size)
    print(f"{what}: own code allocates {sum(allocated.values()) / PICTURES:.0f} bytes for a picture: {most_of}")
    page.close()


def first_view(browser: Browser, url: str, *, is_solid: bool) -> None:
    what, selector, goal = FIRST[is_solid]
    seen: list[float] = []
    for _ in range(RUNS):
        context = browser.new_context(viewport={"width": 1920, "height": 1080})
        context.add_init_script(CHOSEN % json.dumps(is_solid) + SEEN % selector)
        page: Page = context.new_page()
        page.goto(url)
        while (at_ms := page.evaluate("window.seen")) is None:
            page.wait_for_timeout(50)
        seen.append(at_ms / 1000)
        context.close()
    print(f"first view, {what}: median {statistics.median(seen):.2f} s, longest {max(seen):.2f} s (goal {goal:g} s); {load()}")


def panel() -> None:
    """The files of the panel itself, with three.js; not those that all panels share."""
    names = ("Machine-", "space-", "three", "models-")
    files = [
        path for path in (find_page() / "assets").iterdir() if path.name.startswith(names) and path.suffix in (".js", ".css")
    ]
    sizes = {path.name: len(gzip.compress(path.read_bytes(), 9, mtime=0)) / 1000 for path in files}
    print(f"the panel: {sum(sizes.values()):.0f} kB compressed (goal {PANEL_GOAL_KB:g} kB): {sizes}")


def main() -> None:
    panel()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=GRAPHICS)
        with studio(describe_demo(free_ports=True)) as url:
            for is_solid in (False, True):
                first_view(browser, url, is_solid=is_solid)
        with studio(WORLD) as url:
            for is_solid in (False, True):
                pictures(browser, url, is_solid=is_solid)
        browser.close()
