"""The page of the studio in a real browser, against a studio in a process of its own. What moves is seen by an independent
Modbus master."""

from __future__ import annotations

import json
import re
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import httpx
from playwright.sync_api import Browser, Locator, Page, expect
from pymodbus.client import ModbusTcpClient
from tests.peers.conftest import Master
from tests.studio.conftest import Process

ROOT = Path(__file__).parent.parent.parent
AXE = ROOT / "studio-web/node_modules/axe-core/axe.min.js"
PICTURES = ROOT / "build/studio"
WAIT_MS = 60_000

expect.set_options(timeout=WAIT_MS)


ONE_PANE = """localStorage.getItem("steptwin.layout") ?? localStorage.setItem("steptwin.layout",
  JSON.stringify({version: 1, value: [{share: 1, panes: [{panel: "axes", share: 1}]}]}))"""
"""A layout that somebody has chosen; a machine in space begins with several panes."""


class Studio:
    """A studio, a master at its Modbus port, and pages that must not complain."""

    def __init__(self, process: Process, browser: Browser) -> None:
        self.process = process
        self._browser = browser
        self._opened = ExitStack()
        self.complaints: list[str] = []
        client = ModbusTcpClient("127.0.0.1", port=process.end_points["tcp"]["port"])
        assert client.connect()
        self._opened.callback(client.close)
        self.master = Master(client)

    def page(self, language: str = "en-US", panel: str | None = "Axes", init_script: str = "", **options: Any) -> Page:
        settings: dict[str, Any] = {"viewport": {"width": 1280, "height": 720}, "locale": language, **options}
        context = self._browser.new_context(**settings)
        self._opened.callback(context.close)
        context.add_init_script(f"{'' if panel is None else ONE_PANE};{init_script}")
        page = context.new_page()
        page.set_default_timeout(WAIT_MS)
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("console", lambda message: self.complaints.append(message.text) if message.type == "error" else None)
        page.goto(self.process.url)
        expect(page.get_by_role("group", name=re.compile("Virtual time|Czas wirtualny"))).to_contain_text(re.compile("live|żywo"))
        if panel is not None:
            show(page, panel)
        return page

    def at(self, axis: int) -> float:
        return self.master.sample(axis).position

    def stands(self, axis: int) -> bool:
        return self.master.sample(axis).velocity == 0.0

    def close(self) -> None:
        self._opened.close()


WIDER = """() => {
  const found = [];
  for (const pane of document.querySelectorAll("main section > .body")) {
    const edge = pane.getBoundingClientRect().left + pane.clientWidth;
    const parts = [...pane.querySelectorAll("*")].filter((part) => !part.closest(".cm-scroller, svg, canvas, .hidden"));
    const hides = (part) => getComputedStyle(part).overflowX !== "visible";
    const shortens = (part) => getComputedStyle(part).textOverflow === "ellipsis" || part.matches("input, select");
    const isShortened = (part) => part !== pane && (shortens(part) || isShortened(part.parentElement));
    for (const part of [pane, ...parts]) {
      if (!part.getClientRects().length || (part !== pane && isShortened(part))) continue;
      const scrolls = hides(part) && part.scrollWidth > part.clientWidth + 1;
      if (scrolls || part.getBoundingClientRect().right > edge + 1)
        found.push(`${part.tagName} ${part.className} "${part.textContent.trim().slice(0, 30)}"`);
    }
  }
  return found;
}"""


def wider_than_panes(page: Page) -> list[str]:
    """What is cut off, scrolls sideways or lies outside of its pane; code and drawings may."""
    return page.evaluate(WIDER)


COVERED = """() => {
  const found = [];
  for (const part of document.querySelectorAll("main section > .body :is(button, input, select)")) {
    if (!part.checkVisibility() || part.closest(".hidden")) continue;
    part.scrollIntoView({block: "nearest", inline: "nearest"});
    const {left, top, width, height} = part.getBoundingClientRect();
    const over = document.elementFromPoint(left + width / 2, top + height / 2);
    if (over === null || !(part.contains(over) || over.contains(part) || part.labels?.[0]?.contains(over)))
      found.push(`${part.tagName} "${part.ariaLabel ?? part.textContent.trim()}" under ${over?.tagName} ${over?.className}`);
  }
  return found;
}"""


def covered(page: Page) -> list[str]:
    """Buttons and fields of panels that cannot be clicked where they are, also after scrolling to them."""
    return page.evaluate(COVERED)


def panels_of(page: Page) -> list[str]:
    buttons = page.get_by_role("navigation").get_by_role("button").all()
    return [one.get_attribute("aria-label") or one.inner_text().strip() for one in buttons]


def show(page: Page, panel: str) -> None:
    page.get_by_role("navigation").get_by_role("button", name=panel, exact=True).click()
    expect(page.get_by_role("region", name=panel, exact=True).last).not_to_be_empty()


def button(page: Page, name: str) -> Locator:
    return page.get_by_role("button", name=name, exact=True)


def serious(page: Page) -> list[str]:
    """What axe finds wrong on a page that was opened with ``bypass_csp``; `make test` installs axe-core."""
    assert AXE.exists(), "axe-core is not installed: studio-web/build.py install"
    if page.evaluate("typeof axe === 'undefined'"):
        page.add_script_tag(path=AXE)
    page.wait_for_function("document.fonts.status === 'loaded'")
    result = page.evaluate("() => axe.run(document, {resultTypes: ['violations']})")
    return [
        f"{violation['id']}: {violation['help']}: {'; '.join(str(node['target']) for node in violation['nodes'][:4])}"
        for violation in result["violations"]
        if violation["impact"] in ("serious", "critical")
    ]


AT_ONCE = 10
NOTE_FOCUS = """() => {
  window.focused = [];
  const isWanted = WANTED;
  const note = ({ target }) => focused.push([target.ariaLabel ?? "", Boolean(isWanted(target))]);
  document.addEventListener("focusin", note);
  window.noMore = () => document.removeEventListener("focusin", note);
}"""


def tab_until(page: Page, wanted: str) -> list[str]:
    """With the tab key to the first element for which a JavaScript function is true; the names of what had the focus.

    What each key does is noted in the page, so that some are pressed before it is asked; those too many are taken back.
    """
    page.evaluate(NOTE_FOCUS.replace("WANTED", wanted))
    for _ in range(30):
        for _ in range(AT_ONCE):
            page.keyboard.press("Tab")
        focused: list[tuple[str, bool]] = page.evaluate("focused")
        found = next((place for place, (_, is_wanted) in enumerate(focused) if is_wanted), None)
        if found is not None:
            page.evaluate("noMore()")
            for _ in range(AT_ONCE):
                if page.evaluate(f"Boolean(({wanted})(document.activeElement))"):
                    break
                page.keyboard.press("Shift+Tab")
            return [name for name, _ in focused[: found + 1]]
    raise AssertionError(f"the tab key does not reach {wanted}, only {[name for name, _ in focused]}")


def tab_to(page: Page, name: str) -> list[str]:
    """To an element with that name."""
    return tab_until(page, f"(element) => element.ariaLabel === {json.dumps(name)}")


def enable(page: Page, axis: str = "M1") -> None:
    button(page, f"Enable {axis}").click()
    expect(button(page, f"Enable {axis}")).to_have_attribute("aria-pressed", "true")


def virtual_time_ns(studio: Studio) -> int:
    return round(httpx.get(f"{studio.process.url}/api/points?names=time").json()["ok"][0]["value"] * 1e9)


def number(output: Locator) -> float:
    return float(output.inner_text().replace("−", "-"))


def downloaded(page: Page, name: str) -> bytes:
    with page.expect_download() as download:
        button(page, name).click()
    return download.value.path().read_bytes()
