"""The studio with its twin inside the page, from a folder of static files, in a real browser and in Node."""

from __future__ import annotations

import base64
import json
import re
import subprocess
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect
from studio_page import WAIT_MS, button, show
from tests.studio.conftest import browser, require_node, web_builder  # noqa: F401  fixtures

from steptwin import Misuse, World

EXAMPLES = Path(__file__).parents[2] / "examples"
SECONDS = 1.0
LOADING_MS = 120_000


@pytest.mark.timeout(300)
def test_the_demo_moves_in_a_page_without_a_service(address: str, browser: Browser) -> None:  # noqa: F811
    complaints: list[str] = []
    elsewhere: list[str] = []
    context = browser.new_context(viewport={"width": 1280, "height": 720}, locale="en-US")
    page = context.new_page()
    page.set_default_timeout(WAIT_MS)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("console", lambda message: complaints.append(message.text) if message.type in ("error", "warning") else None)
    context.on("request", lambda asked: None if asked.url.startswith((address, "blob:")) else elsewhere.append(asked.url))
    page.goto(address)

    # The machine at its beginning is there before Python, and nothing can be done with it yet.
    expect(page.get_by_role("status").first).to_contain_text("Python")
    expect(page.get_by_label("M1 position", exact=True)).to_have_text("0.00")
    expect(button(page, "Enable M1")).to_be_disabled()
    expect(page.get_by_role("group", name="Virtual time")).to_contain_text("live", timeout=LOADING_MS)
    expect(page.get_by_label("M1 position", exact=True)).not_to_have_text("0.00")

    # What needs a service is named, and what it needs.
    for panel, words in {"Devices": "on a computer", "Recordings": "files of a computer", "Gateways": "with ports"}.items():
        show(page, panel)
        expect(page.get_by_text(words)).to_be_visible()

    # A wrong program is found while it is typed.
    show(page, "Program")
    text = page.get_by_role("textbox", name="Text of demo.prg")
    text.click()
    expect(text.locator("span[class^=tok-]").first).to_be_visible(timeout=LOADING_MS)
    page.keyboard.press("Control+Home")
    page.keyboard.insert_text("NONSENSE\n")
    expect(page.get_by_role("button", name=re.compile("NONSENSE"))).to_be_visible()

    show(page, "Faults")
    page.get_by_label("Kind of fault").select_option("crc")
    button(page, "Set fault").click()
    expect(page.get_by_role("row", name=re.compile("^crc "))).to_be_visible()

    # Its cause, out of the past; and a click on that shows its moment.
    show(page, "Axes")
    page.get_by_role("button", name=re.compile("^Why")).first.click()
    causes = page.get_by_role("status", name="Causes")
    causes.get_by_role("listitem").first.get_by_role("button").click()
    expect(page.get_by_role("group", name="The past")).to_be_visible()
    assert complaints == []
    assert elsewhere == []
    context.close()


def test_all_examples_have_the_digests_of_cpython(built: Path, require_node: None) -> None:  # noqa: F811
    worlds, expected = [], {}
    for path in sorted(EXAMPLES.rglob("*.toml")):
        try:
            world = World.load(path)
        except Misuse:  # a campaign, or a world in parts
            continue
        files = {name: base64.b64encode(content).decode() for name, content in world.blueprint.files.items()}
        text = world.spec.text.source.text
        worlds.append({"name": str(path), "text": text, "files": files, "seconds": SECONDS})
        world.run(for_=SECONDS)
        expected[str(path)] = world.trace.digest()
    assert len(worlds) > 8
    node = str(web_builder().node_folder() / "node")
    script = str(Path(__file__).with_name("digests.mjs"))
    ran = subprocess.run(
        [node, script, str(built / "python")], input=json.dumps(worlds), capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stderr
    assert json.loads(ran.stdout) == expected


def test_a_part_that_the_server_does_not_give_is_named(address: str, browser: Browser) -> None:  # noqa: F811
    context = browser.new_context(locale="en-US")
    context.route("**/steptwin.zip", lambda route: route.fulfill(status=404))
    page = context.new_page()
    page.goto(address)
    expect(page.get_by_role("status").first).to_contain_text(re.compile(r"could not be loaded: .*/python/steptwin\.zip: 404"))
    context.close()
