"""The studio inside a page: its size, how long it loads, how fast its twin is, how soon it stops, what memory it takes.

``python -m bench.inpage 30`` lets it run at 20 × for 30 minutes instead of half a minute. Needs `make site` and Chromium.
"""

from __future__ import annotations

import contextlib
import functools
import gzip
import os
import shutil
import statistics
import sys
import tempfile
import threading
import time
from collections.abc import Generator
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from playwright.sync_api import BrowserContext, Page, Playwright, sync_playwright

SITE = Path(__file__).parents[1] / "build/site"
RUNS = 5
SPEEDS: tuple[float | str, ...] = (0.01, 1, 5, 20, 100, 1000, "max")
STOPS = 30
SECONDS = 10.0
SAMPLE_S = 10.0
FROM = 1 / 3
"""Memory is compared from this part of the time on."""
MB = 1e6
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
AXES_ONLY = """localStorage.setItem("steptwin.layout",
  JSON.stringify({version: 1, value: [{share: 1, panes: [{panel: "axes", share: 1}]}]}));"""
WATCH = """
window.tasks = [];
new PerformanceObserver((list) => window.tasks.push(...list.getEntries().map(({ startTime, duration }) => [startTime, duration])))
  .observe({ type: "longtask", buffered: true });
window.pythons = [];
window.Worker = class extends Worker {
  constructor(address, options) {
    super(address, options);
    if (String(address).includes("python")) window.pythons.push(this);
  }
};
const look = () => {
  const shown = document.querySelector('[aria-label="M1 position"]')?.textContent?.trim();
  if (shown && window.drawn === undefined) window.drawn = performance.now();
  if (shown && shown !== "0.00" && shown !== "—") window.moved = performance.now();
  else requestAnimationFrame(look);
};
requestAnimationFrame(look);
"""
"""Tasks that block keys (50 ms and more), the workers with Python, when the machine is seen, and when it has moved."""
TALK = """
window.Talk = class {
  constructor(on) {
    this.on = on;
    this.next = 1;
    this.asked = new Map();
    this.worker = window.pythons[0];
    this.worker.addEventListener("message", ({ data }) => {
      if (data.on !== on || !("messages" in data)) return;
      for (const message of data.messages) {
        const asked = this.asked.get(message.id);
        if (asked === undefined) continue;
        this.asked.delete(message.id);
        asked.done([performance.now() - asked.from, message]);
      }
    });
    this.worker.postMessage({ open: on });
  }
  ask(name, fields = {}) {
    const id = this.next++;
    const from = performance.now();
    return new Promise((done) => {
      this.asked.set(id, { from, done });
      setTimeout(() => done([20000, { error: { code: "timeout", message: "no answer in 20 s" } }]), 20000);
      this.worker.postMessage({ send: JSON.stringify({ do: name, ...fields, id }), on: this.on });
    });
  }
};
window.rest = (ms) => new Promise((done) => setTimeout(done, ms));
window.stops = async (count, before) => {
  const found = [];
  for (let n = 0; n < count; n++) {
    const asked = before && window.asker.ask(before.name, before.fields);
    await window.rest(before ? (before.after ?? 5) : Math.random() * 40);
    found.push((await window.stopper.ask("stop_all"))[0]);
    if (asked) await asked;
  }
  return found;
};
"""
"""Connections of their own to the twin, beside that of the page."""


@contextlib.contextmanager
def server() -> Generator[str]:
    class Quiet(SimpleHTTPRequestHandler):
        def handle(self) -> None:
            with contextlib.suppress(ConnectionError):  # the browser may leave
                super().handle()

        def log_message(self, format: str, *arguments: object) -> None:  # noqa: A002  that of the library
            """Nobody reads it."""

    serving = ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=SITE))
    thread = threading.Thread(target=serving.serve_forever)
    thread.start()
    try:
        yield f"http://127.0.0.1:{serving.server_port}/try/"
    finally:
        serving.shutdown()
        thread.join()
        serving.server_close()


def load() -> str:
    return f"load {os.getloadavg()[0]:.1f}"


def sizes() -> None:
    """The studio, and the documentation beside it."""

    def of(paths: list[Path]) -> str:
        stored = sum(path.stat().st_size for path in paths)
        packed = sum(len(gzip.compress(path.read_bytes(), 9, mtime=0)) for path in paths)
        return f"gzip -9 {packed / MB:.2f} MB, as stored {stored / MB:.2f} MB"

    files = [path for path in SITE.rglob("*") if path.is_file()]
    studio = [path for path in files if path.is_relative_to(SITE / "try")]
    print(f"size of try/: {of(studio)} (goals 9 and 20 MB)")
    print(f"size of the documentation: {of([path for path in files if path not in studio])}")


def median(values: list[float]) -> str:
    return f"{statistics.median(values):.2f} s (most {max(values):.2f})"


def loading(page: Page, address: str) -> dict[str, float]:
    """Moments in seconds since the navigation, and the longest task in milliseconds."""
    page.goto(address)
    while page.evaluate("window.moved === undefined"):  # the policy of the page permits no condition as text
        page.wait_for_timeout(100)
    page.wait_for_timeout(500)
    found: dict[str, float] = page.evaluate("""() => {
      const at = (name) => performance.getEntriesByName(name).at(-1)?.startTime ?? NaN;
      const [moved, tasks] = [window.moved, window.tasks];
      return {paint: at("first-contentful-paint") / 1000, drawn: window.drawn / 1000, python: at("python") / 1000,
        modules: at("modules") / 1000, world: at("world") / 1000, moved: moved / 1000,
        task: Math.max(0, ...tasks.map(([, duration]) => duration))};
    }""")
    return found


def tasks(context: BrowserContext, address: str) -> None:
    """The longest tasks of the main thread while a page is loaded, in processor time, which others that use the processors do
    not make longer."""
    page = context.new_page()
    session = page.context.new_cdp_session(page)
    events: list[dict[str, Any]] = []
    ended: list[bool] = []
    session.on("Tracing.dataCollected", lambda data: events.extend(data["value"]))
    session.on("Tracing.tracingComplete", lambda _: ended.append(True))
    session.send("Tracing.start", {"categories": "disabled-by-default-devtools.timeline", "transferMode": "ReportEvents"})
    loading(page, address)
    session.send("Tracing.end")
    while not ended:
        page.wait_for_timeout(50)
    names = {(one["pid"], one["tid"]): one["args"]["name"] for one in events if one["name"] == "thread_name"}
    found = [one for one in events if one["name"] == "RunTask" and names.get((one["pid"], one["tid"])) == "CrRendererMain"]
    longest = sorted((one.get("tdur", 0) / 1000 for one in found), reverse=True)[:5]
    print(f"longest tasks while it loads, in processor time [ms]: {', '.join(f'{ms:.0f}' for ms in longest)} (goal 50); {load()}")


def show_loading(what: str, found: list[dict[str, float]], goal_s: float) -> None:
    phases = ", ".join(f"{name} {statistics.median(one[name] for one in found):.2f}" for name in list(found[0])[:-2])
    moved = median([one["moved"] for one in found])
    blocked = ", ".join(f"{one['task']:.0f}" for one in found)
    print(f"{what}: motion after {moved} (goal {goal_s:g} s); medians of phases [s]: {phases}; {load()}")
    print(f"{what}: longest task of the main thread in each run [ms], 0: below 50: {blocked} (goal 50)")


def loads(playwright: Playwright, address: str) -> None:
    cold, warm = [], []
    for _ in range(RUNS):
        with tempfile.TemporaryDirectory() as profile, browser(playwright, profile) as context:
            page = context.new_page()
            cold.append(loading(page, address))
            page.get_by_title("can be opened without a network").wait_for(timeout=120_000)
            page.close()
            warm.append(loading(context.new_page(), address))
    with tempfile.TemporaryDirectory() as profile, browser(playwright, profile) as context:
        tasks(context, address)
    show_loading("cold", cold, 8)
    show_loading("warm", warm, 4)


@contextlib.contextmanager
def browser(playwright: Playwright, profile: str) -> Generator[BrowserContext]:
    context = playwright.chromium.launch_persistent_context(
        profile,
        executable_path=shutil.which("chromium"),
        args=FLAGS,
        viewport={"width": 1280, "height": 720},
        locale="en-US",
    )
    context.add_init_script(WATCH)
    try:
        yield context
    finally:
        context.close()


def open_twin(context: BrowserContext, address: str) -> Page:
    """A page without the drawing of the machine, and two connections beside it."""
    context.add_init_script(AXES_ONLY)
    page = context.new_page()
    loading(page, address)
    page.evaluate(TALK)
    page.evaluate("""async () => {
      [window.asker, window.stopper] = [new Talk(901), new Talk(902)];
      for (const talk of [asker, stopper]) await talk.ask("hello", {version: 2, kinds: []});
    }""")
    return page


def ask(page: Page, name: str, /, **fields: object) -> tuple[float, Any]:
    """Milliseconds, and the answer."""
    ms, message = page.evaluate("([name, fields]) => asker.ask(name, fields)", [name, fields])
    return ms, message.get("ok", message.get("error"))


def virtual_s(page: Page) -> float:
    return int(ask(page, "time")[1]["time_ns"]) / 1e9


def speed(page: Page) -> None:
    for wanted in (20, "max"):
        ask(page, "resume", speed=wanted)
        page.evaluate("() => { window.tasks = []; }")
        begin, began = virtual_s(page), time.monotonic()
        page.wait_for_timeout(SECONDS * 1000)
        passed, took = virtual_s(page) - begin, time.monotonic() - began
        blocked = [duration for _, duration in page.evaluate("window.tasks")]
        longest = f"{max(blocked):.0f} ms" if blocked else "below 50 ms"
        goal = " (goal 20)" if wanted == 20 else ""
        print(f"speed {wanted}: {passed / took:.1f} × real time{goal}; longest task {longest}; {load()}")
    ask(page, "resume", speed=1)


def stops(page: Page) -> None:
    """How long a stop takes to be answered at each speed."""
    for wanted in SPEEDS:
        ask(page, "resume", speed=wanted)
        page.wait_for_timeout(1000)
        report(f"speed {wanted}", page.evaluate("(count) => stops(count, null)", STOPS))


def report(what: str, found: list[float]) -> None:
    print(f"stop, {what}: median {statistics.median(found):.0f} ms, most {max(found):.0f} ms (goal 100)")


def requests(page: Page) -> None:
    """How long it takes while each long request is answered."""
    ask(page, "resume", speed=20)
    page.wait_for_timeout(5000)
    now = virtual_s(page)

    def ns(seconds: float) -> str:
        return str(int(seconds * 1e9))

    text = page.evaluate("fetch('world/demo.prg').then((one) => one.text())")
    long = {
        "why": {"question": "table.M1.position"},
        "past_events": {"from_ns": ns(max(now - 59, 0)), "to_ns": ns(now)},
        "show_moment": {"to_ns": ns(now / 2)},
        "describe": {},
        "resync": {},
        "snapshot": {"name": "measured"},
        "program_memory": {"controller": "table", "place": "program 0", "text": text},
        "download": {"controller": "table", "place": "program 0", "text": text},
        "restore": {"name": "measured"},
        "step": {"for_ns": ns(60)},
    }
    for name, fields in long.items():
        took, answer = ask(page, name, **fields)
        refused = answer.get("message") if isinstance(answer, dict) and "code" in answer else None
        if name == "show_moment":
            ask(page, name)
        ask(page, "resume", speed=20)
        found = page.evaluate("([count, before]) => stops(count, before)", [STOPS // 3, {"name": name, "fields": fields}])
        report(f"during {name} (alone {took:.0f} ms{f', {refused}' if refused else ''})", found)
        ask(page, "show_moment")
    ask(page, "resume", speed=1)


def diagnostics(page: Page) -> None:
    """From a key to what is found; the first time the editor's worker is loaded, too."""
    page.get_by_role("navigation").get_by_role("button", name="Program", exact=True).click()
    text = page.get_by_role("textbox", name="Text of demo.prg")
    text.click()
    found: list[float] = []
    for number in range(4):
        page.keyboard.press("Control+Home")
        began = time.monotonic()
        page.keyboard.insert_text(f"NONSENSE{number}\n")
        page.get_by_role("button", name=f"NONSENSE{number}").first.wait_for(timeout=180_000)
        found.append(time.monotonic() - began)
        page.wait_for_timeout(1000)
    print(
        f"diagnostics of the demo program: {median(found[1:])} (goal 1 s); the first, with the worker, {found[0]:.2f} s; {load()}"
    )


COUNT = """() => {
  const grow = WebAssembly.Memory.prototype.grow;
  self.grown = 0;
  WebAssembly.Memory.prototype.grow = function (pages) {
    self.grown += pages;
    return grow.call(this, pages);
  };
}"""
"""Pages by which WebAssembly grows, of 64 KiB."""


def memory(page: Page, minutes: float) -> None:
    (worker,) = [one for one in page.workers if "python" in one.url]
    worker.evaluate(COUNT)
    session = page.context.new_cdp_session(page)
    ask(page, "resume", speed=20)
    began, begin = time.monotonic(), virtual_s(page)
    found: list[tuple[int, int]] = []
    while (passed := time.monotonic() - began) < minutes * 60:
        if passed >= minutes * 60 * FROM:
            session.send("HeapProfiler.collectGarbage")
            found.append((worker.evaluate("self.grown"), session.send("Runtime.getHeapUsage")["usedSize"]))
        page.wait_for_timeout(min(SAMPLE_S, minutes * 60 / 6) * 1000)
    rate = (virtual_s(page) - begin) / (time.monotonic() - began)
    (pages, heap), most = found[0], max(size for _, size in found)
    print(f"memory in {minutes:g} minutes at {rate:.1f} × real time, from minute {minutes * FROM:.1f} on; {load()}")
    print(f"  WebAssembly: {found[-1][0] - pages} pages more, {pages} before")
    print(f"  JavaScript of the page: {heap / MB:.2f} MB, most {most / MB:.2f} MB, {100 * (most - heap) / heap:+.2f} % (goal 2)")


def main(minutes: float = 0.5) -> None:
    print(f"{os.cpu_count()} processors, {load()}")
    sizes()
    with sync_playwright() as playwright, server() as address:
        loads(playwright, address)
        with tempfile.TemporaryDirectory() as profile, browser(playwright, profile) as context:
            page = open_twin(context, address)
            speed(page)
            requests(page)  # before the past is long
            diagnostics(page)
            stops(page)
        with tempfile.TemporaryDirectory() as profile, browser(playwright, profile) as context:
            memory(open_twin(context, address), minutes)


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
