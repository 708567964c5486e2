"""The page of the studio in a real browser, against a studio in a process of its own. What moves is seen by an independent
Modbus master."""

from __future__ import annotations

import re
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, Locator, Page, expect
from pymodbus.client import ModbusTcpClient
from tests.peers.conftest import Master
from tests.studio.conftest import Process

ROOT = Path(__file__).parent.parent.parent
AXE = ROOT / "studio-web/node_modules/axe-core/axe.min.js"
PICTURES = ROOT / "build/studio"
WAIT_MS = 60_000

expect.set_options(timeout=WAIT_MS)


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

    def page(self, language: str = "en-US", panel: str | None = "Axes", **options: Any) -> Page:
        settings: dict[str, Any] = {"viewport": {"width": 1280, "height": 720}, "locale": language, **options}
        context = self._browser.new_context(**settings)
        self._opened.callback(context.close)
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


def show(page: Page, panel: str) -> None:
    page.get_by_role("navigation").get_by_role("button", name=panel, exact=True).click()
    expect(page.get_by_role("region", name=panel, exact=True).last).not_to_be_empty()


def button(page: Page, name: str) -> Locator:
    return page.get_by_role("button", name=name, exact=True)
