"""What a viewer feels: first paint, interaction to next paint, pictures a second with 100 controllers and 8 curves.

python tests/studio/measure_page.py   (without other load on the computer; needs the built page and chromium)
"""

from __future__ import annotations

import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from playwright.sync_api import Page, sync_playwright

from steptwin.live.studio.demo import FOLDER, describe_demo

CONTROLLERS = 100
ON_A_LINE = 25
CURVES = 8
SECONDS = 10.0
OBSERVE = """() => {
  window.measured = {durations: [], frames: []};
  new PerformanceObserver((list) => {
    for (const entry of list.getEntries()) if (entry.interactionId) window.measured.durations.push(entry.duration);
  }).observe({type: 'event', durationThreshold: 16, buffered: true});
}"""
COUNT = """(ms) => new Promise((done) => {
  const begin = performance.now(); const gaps = []; let last = begin;
  const send = Worker.prototype.postMessage; let drawings = 0;
  Worker.prototype.postMessage = function (message, ...rest) {
    drawings += "drawing" in message;
    return send.call(this, message, ...rest);
  };
  const frame = (now) => {
    gaps.push(now - last); last = now;
    if (now - begin < ms) return requestAnimationFrame(frame);
    Worker.prototype.postMessage = send;
    done([gaps, drawings]);
  };
  requestAnimationFrame(frame);
})"""


def many() -> str:
    """Controllers whose axes go to and fro."""
    parts = ['[world]\nname = "many"\n']
    for line in range(CONTROLLERS // ON_A_LINE):
        parts.append(f'[[line]]\nname = "bus{line}"\nkind = "modbus"\ntcp = "127.0.0.1:0"\n')
        for unit in range(1, ON_A_LINE + 1):
            name = f"c{line * ON_A_LINE + unit}"
            parts.append(f'[[mic488]]\nname = "{name}"\nline = "bus{line}"\nunit = {unit}\n')
            parts.append(
                '[mic488.M1]\nunit = "mm"\ngear = 100.0\nvel = 40.0\n[mic488.M2]\nunit = "mm"\ngear = 100.0\nvel = 30.0\n'
            )
            targets = [
                ", ".join(f'"{name}.M{axis}_{what}" = {value}' for axis in (1, 2))
                for what, value in (("EN", 1), ("POS_ABS", 40), ("POS_ABS", 0))
            ]
            steps = f'{{ write = {{ {targets[1]} }} }}, {{ wait = "2 s" }}, {{ write = {{ {targets[2]} }} }}, {{ wait = "2 s" }}'
            parts.append(f'[[script]]\nname = "on{name}"\nat = "0 s"\nsteps = [{{ write = {{ {targets[0]} }} }}]\n')
            parts.append(f'[[script]]\nname = "go{name}"\nat = "1 s"\nrepeat = 1000000\nsteps = [{steps}]\n')
    return "".join(parts)


@contextmanager
def studio(text: str) -> Generator[str]:
    """Its address."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "world.toml").write_text(text)
        (folder / "demo.prg").write_bytes((FOLDER / "demo.prg").read_bytes())
        ready = folder / "ready.json"
        command = ["-m", "steptwin", "studio", str(folder / "world.toml"), "--http", "127.0.0.1:0", "--no-browser"]
        command.append("--open-to-local-users")
        environment = {**os.environ, "XDG_RUNTIME_DIR": name, "TERM": "dumb"}
        arguments = [sys.executable, *command, "--ready-file", str(ready)]
        with subprocess.Popen(arguments, stdout=subprocess.DEVNULL, env=environment) as process:
            try:
                while not ready.exists() and process.poll() is None:
                    time.sleep(0.05)
                points = json.loads(ready.read_text())["end_points"]
                yield next(point["url"] for point in points if point["kind"] == "http")
            finally:
                process.terminate()


def show(page: Page, panel: str) -> None:
    page.get_by_role("navigation").get_by_role("button", name=panel, exact=True).click()


def first_paint(browser: Any, url: str) -> None:
    paints, contents = [], []
    for _ in range(5):
        context = browser.new_context(viewport={"width": 1920, "height": 1080})
        page = context.new_page()
        page.goto(url)
        page.get_by_label("M1 position", exact=True).wait_for()
        contents.append(page.evaluate("performance.now()"))
        paints.append(page.evaluate("performance.getEntriesByName('first-contentful-paint')[0].startTime"))
        context.close()
    print(f"first contentful paint {statistics.median(paints):.0f} ms, first position shown {statistics.median(contents):.0f} ms")


def interactions(page: Page) -> None:
    """Panels, keys and buttons; each `duration` is from the event to the next picture, in steps of 8 ms."""
    page.evaluate(OBSERVE)
    for _ in range(3):
        for panel in ("Overview", "I/O", "Registers", "Program", "Scope", "Time", "Axes"):
            show(page, panel)
            page.wait_for_timeout(300)
        page.get_by_label("Step M1", exact=True).fill("2")
        page.keyboard.type("12")
        page.get_by_role("button", name="Stop M1", exact=True).click()
        page.keyboard.press("?")
        page.keyboard.press("?")
    page.wait_for_timeout(500)
    durations = sorted(page.evaluate("window.measured.durations"))
    if durations:
        middle = statistics.median(durations)
        print(f"interaction to next paint: median {middle:.0f} ms, longest {durations[-1]:.0f} ms of {len(durations)}")


def pictures(page: Page, what: str) -> None:
    """How many come, and the processor time that one takes in the page: of 16.7 ms there are at 60 a second.

    Curves are drawn by a worker, which gets the next drawing when the last one is on the screen; that is counted, too.
    """
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable", {"timeDomain": "threadTicks"})

    def spent() -> dict[str, float]:
        return {one["name"]: one["value"] for one in session.send("Performance.getMetrics")["metrics"]}

    before = spent()
    gaps, drawings = page.evaluate(COUNT, SECONDS * 1000)
    after = spent()
    names = {"task": "TaskDuration", "script": "ScriptDuration", "style": "RecalcStyleDuration", "layout": "LayoutDuration"}
    each = ", ".join(f"{word} {1000 * (after[name] - before[name]) / len(gaps):.1f} ms" for word, name in names.items())
    drawn = f" (of curves {1000 * drawings / sum(gaps):.1f})" if drawings else ""
    print(f"{what}: {1000 * len(gaps) / sum(gaps):.1f} pictures/s{drawn}, longest gap {max(gaps):.0f} ms; for each: {each}")


def main() -> None:
    chromium = shutil.which("chromium")
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        with studio(describe_demo(free_ports=True)) as url:
            first_paint(browser, url)
            page = browser.new_page(viewport={"width": 1920, "height": 1080}, locale="en-US")
            page.goto(url)
            interactions(page)
            show(page, "Scope")
            pictures(page, "demo machine, scope")
            page.close()
        with studio(many()) as url:
            page = browser.new_page(viewport={"width": 1920, "height": 1080}, locale="en-US")
            page.goto(url)
            show(page, "Axes")
            page.wait_for_timeout(4000)
            pictures(page, f"{CONTROLLERS} controllers, axes")
            show(page, "Scope")
            page.wait_for_timeout(2000)
            page.get_by_role("button", name="Choose signals").click()
            for number in range(1, CURVES // 2 + 1):
                page.get_by_role("searchbox").fill(f"c{number} ")
                for axis in (1, 2):
                    page.get_by_role("checkbox", name=f"c{number} M{axis} position").first.check()
            page.get_by_role("button", name="Choose signals").click()
            page.wait_for_timeout(2000)
            pictures(page, f"{CONTROLLERS} controllers, scope with {CURVES} curves")
            page.close()
        browser.close()


if __name__ == "__main__":
    main()
