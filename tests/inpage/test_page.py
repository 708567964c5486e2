"""The studio with its twin inside the page, from a folder of static files, in a real browser and in Node."""

from __future__ import annotations

import base64
import json
import re
import runpy
import subprocess
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from pages import PAGES, blocks
from playwright.sync_api import Browser, FilePayload, Locator, Page, expect
from pymodbus.client import ModbusTcpClient
from studio_page import WAIT_MS, button, show
from tests.conftest import STEPTWIN
from tests.inpage.conftest import Handler
from tests.peers.conftest import Master
from tests.studio.conftest import browser, require_node, web_builder  # noqa: F401  fixtures
from web_serial import WebSerial

from steptwin import Misuse, World
from steptwin.campaign.campaign import Campaign
from steptwin.live.studio.demo import FOLDER

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
SECONDS = 1.0
LOADING_MS = 120_000


FAILED_UPDATE = """async () => {
  const ready = await navigator.serviceWorker.ready;
  await ready.update();
  const worker = ready.installing ?? ready.waiting;
  if (worker === null) return "redundant";
  return new Promise((done) => worker.addEventListener("statechange", () => done(worker.state)));
}"""
"""What becomes of a newer version."""


class Demo:
    """The demo in its page, loaded once for all tests, and what the browser complains about or asks elsewhere."""

    def __init__(self, started: Browser, address: str) -> None:
        self.complaints: list[str] = []
        self.elsewhere: list[str] = []
        self.context = started.new_context(viewport={"width": 1280, "height": 720}, locale="en-US")
        self.context.on(
            "request", lambda asked: None if asked.url.startswith((address, "blob:")) else self.elsewhere.append(asked.url)
        )
        self.serial = WebSerial(self.context)
        self.page = self.tab()
        self.page.goto(address)

    def tab(self) -> Page:
        page = self.context.new_page()
        page.set_default_timeout(WAIT_MS)
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("console", lambda said: self.complaints.append(said.text) if said.type in ("error", "warning") else None)
        return page


@pytest.fixture(scope="module")
def demo(address: str, browser: Browser) -> Iterator[Demo]:  # noqa: F811
    made = Demo(browser, address)
    yield made
    assert made.complaints == [], "\n".join(made.complaints)
    assert made.elsewhere == []
    made.context.close()


@pytest.fixture(scope="module")
def of_docs() -> dict[str, Any]:
    """The extension of the documentation that makes links."""
    return runpy.run_path(str(ROOT / "docs/_ext/studio_links.py"))


def time_of(page: Page) -> Locator:
    return page.get_by_role("group", name="Virtual time")


def fragment(text: bytes) -> str:
    change = zlib.compressobj(9, zlib.DEFLATED, -15)
    return "#world=" + base64.urlsafe_b64encode(change.compress(text) + change.flush()).decode().rstrip("=")


def linked(**fields: object) -> str:
    return fragment(json.dumps({"description": "", "programs": {}, **fields}).encode())


WRONG = {
    "#world=%%%": "damaged",
    fragment(b"[]"): "damaged",
    fragment(b"\xff"): "damaged",
    "#world=" + "A" * 8200: "6150 bytes packed; at most 6144",
    fragment(b'{"description": "' + b" " * (1 << 18) + b'"}'): "more than the 262144 bytes",
    linked(model="m.gltf"): "it has model;",
    linked(description=1): "it has no description",
    linked(programs=[]): "it has no programs",
    linked(programs={"a.py": ""}): "a.py is no program",
    linked(programs={"a.html": ""}): "a.html is no program",
    linked(programs={"../a.prg": ""}): "../a.prg is no program",
    linked(programs={"a.prg": 1}): "a.prg is no program",
}


def test_a_wrong_link_is_refused_with_what_is_wrong_in_it(address: str, browser: Browser, of_docs: dict[str, Any]) -> None:  # noqa: F811
    context = browser.new_context(locale="en-US")
    page = context.new_page()
    for wrong, words in WRONG.items():
        page.goto("about:blank")
        page.goto(address + wrong)
        expect(page.get_by_role("alert")).to_contain_text(words)
        assert page.workers == []

    # That of the documentation is read; another one in the same tab takes its place.
    page.goto(address + of_docs["link"]('[[mic488]]\nname = "zażółć"\n', {}))
    expect(page.locator("pre")).to_have_text('[[mic488]]\nname = "zażółć"\n')
    context.close()


@pytest.mark.parametrize(
    ("language", "text", "whole"),
    [
        ("toml", '[[mic488]]\nname = "table"\n', [True]),
        ("toml", '[[mic488]]\nname = "table"\nprogram = "a.prg"\n', [False]),  # a file is missing
        ("toml", '[[mic488]]\nname = "table"\n[gateway.mqtt]\n', [False]),  # needs a service
        ("toml", '[world]\nname = "empty"\n', [False]),
        ("wbc", "NONSENSE\n", [False]),
        ("text", "F640\n", []),
        ("sh", "steptwin run examples/worlds/plotter/plotter.toml", [True]),  # with its program and its positions
        ("sh", "steptwin run examples/worlds/two_stations/two_stations.toml", [False]),  # has a part
        ("sh", "steptwin run examples/m1486/example2.m1486\nsteptwin check examples/m1486/example2.m1486", [True]),
    ],
)
def test_what_is_whole_in_the_documentation_has_links(
    of_docs: dict[str, Any], language: str, text: str, whole: list[bool]
) -> None:
    assert [of_docs["is_whole"](*world) for _, *world in of_docs["worlds"](language, text)] == whole


def test_each_program_of_the_documentation_has_a_link(of_docs: dict[str, Any]) -> None:
    programs = [block for page in PAGES for block in blocks(page) if block.language in of_docs["AROUND"]]
    assert len(programs) > 1
    for block in programs:
        ((_, *world),) = of_docs["worlds"](block.language, block.code)
        assert of_docs["is_whole"](*world), f"{block.page}:{block.line}"


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


def test_a_part_that_the_server_gives_wrongly_is_named(address: str, browser: Browser) -> None:  # noqa: F811
    context = browser.new_context(locale="en-US")
    page = context.new_page()
    for file, answer, words in (
        ("steptwin.modules", {"status": 404}, "404"),
        ("steptwin.modules", {"body": "wrong"}, "it did not come as it was built"),
        ("pyodide.mjs", {"content_type": "text/plain"}, "the server sends it as text/plain; it has to be text/javascript"),
    ):
        context.route(f"**/{file}", lambda route, _, answer=answer: route.fulfill(**answer))
        page.goto(address)
        expect(page.get_by_role("status").first).to_contain_text(re.compile(rf"could not be loaded: .*/python/{file}: {words}"))
        context.unroute(f"**/{file}")
    context.close()


def test_a_page_that_could_not_be_stored_says_why_and_can_be_used(
    address: str,
    browser: Browser,  # noqa: F811
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(Handler, "lacks", "/licences.txt")  # the page itself does not ask for it
    context = browser.new_context(locale="en-US")
    page = context.new_page()
    page.goto(address)
    said = page.get_by_text("not offline")
    expect(said).to_have_attribute("title", re.compile("could not be stored .*/licences.txt: 404"), timeout=LOADING_MS)
    expect(time_of(page)).to_contain_text("live")
    assert page.evaluate("caches.keys()") == []
    context.close()


def test_the_demo_moves_in_a_page_without_a_service(demo: Demo) -> None:
    page = demo.page
    # The machine at its beginning is there before Python, and nothing can be done with it yet.
    expect(page.get_by_role("status").first).to_contain_text("Python")
    expect(page.get_by_label("M1 position", exact=True)).to_have_text("0.00")
    expect(button(page, "Enable M1")).to_be_disabled()
    expect(time_of(page)).to_contain_text("live", timeout=LOADING_MS)
    expect(page.get_by_label("M1 position", exact=True)).not_to_have_text("0.00")

    # What needs a service is named, and what it needs.
    for panel, words in {
        "Devices": "All other devices need the studio on a computer",
        "Gateways": "with ports",
    }.items():
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
    button(page, "To the present").click()


def test_the_recording_is_a_download_that_a_computer_replays_and_the_page_shows(demo: Demo, tmp_path: Path) -> None:
    page = demo.page
    expect(time_of(page)).to_contain_text("live", timeout=LOADING_MS)
    show(page, "Recordings")
    page.get_by_label("Name of the file").fill("mine")
    with page.expect_download() as saved:
        button(page, "Save recording").click()
    expect(page.get_by_text("mine is saved")).to_be_visible()
    assert saved.value.suggested_filename == "mine.json"
    path = tmp_path / "mine.json"
    saved.value.save_as(path)
    replayed = subprocess.run([STEPTWIN, "replay", str(path)], capture_output=True, text=True, check=True)
    assert "the same, digest" in replayed.stdout
    asked = subprocess.run([STEPTWIN, "why", str(path), "table.M1.position"], capture_output=True, text=True, check=True)
    assert "table.M1.position" in asked.stdout

    # It is shown in place of the machine, at its end, and nothing of it can be changed.
    chooser = page.get_by_label("View a recording…")
    chooser.set_input_files(FilePayload(name="wrong.json", mimeType="", buffer=b"no JSON"))
    expect(page.get_by_role("alert").last).to_contain_text("wrong.json is not a recording of a world")
    until_ns = json.loads(path.read_text())["until_ns"]
    chooser.set_input_files(path)
    expect(page.get_by_role("banner").get_by_text("Recording", exact=True)).to_be_visible()
    expect(time_of(page)).to_contain_text(re.compile(rf"paused.*{until_ns / 1e9:.3f}"[:-1], re.DOTALL))
    show(page, "Axes")
    expect(button(page, "Enable M1")).to_be_disabled()
    page.locator("body").press(",")
    expect(page.get_by_role("group", name="The past")).to_be_visible()
    button(page, "Back").click()
    expect(time_of(page)).to_contain_text("live")
    expect(button(page, "Enable M1")).to_be_enabled()


def test_a_branch_is_shown_in_place_of_the_machine(demo: Demo) -> None:
    page = demo.page
    expect(time_of(page)).to_contain_text("live", timeout=LOADING_MS)
    show(page, "Time")
    button(page, "Branch from now").click()
    button(page, "Show branch 1").click()
    branch = page.get_by_role("banner").get_by_text(re.compile(r"Branch 1 from \d+\.\d+ s"))
    expect(branch).to_be_visible()
    expect(time_of(page)).to_contain_text("paused")
    show(page, "Time")
    expect(page.get_by_role("list", name="Where this world comes from").get_by_role("listitem")).to_have_count(2)
    stood = page.get_by_label("World time").inner_text()
    button(page, "Step by a duration").click()
    expect(page.get_by_label("World time")).not_to_have_text(stood)
    button(page, "Back").click()
    expect(branch).to_have_count(0)
    expect(time_of(page)).to_contain_text("live")
    show(page, "Time")
    button(page, "End branch 1").click()
    expect(button(page, "Show branch 1")).to_have_count(0)


def test_the_panels_ask_the_twin_as_a_master_and_a_terminal_do(demo: Demo) -> None:
    page = demo.page
    expect(time_of(page)).to_contain_text("live", timeout=LOADING_MS)
    show(page, "Frames")
    page.get_by_label("Function code and data (hex)").fill("M1_POS_ACT")
    button(page, "Send request").click()
    expect(page.get_by_role("status").filter(has_text="answer 03 04")).to_be_visible()
    button(page, "Add to poll list").click()
    polled = page.get_by_role("region", name="Poll list")
    button(page, "Poll").click()
    expect(polled.get_by_role("row")).to_contain_text("M1_POS_ACT = ")
    shown = polled.get_by_role("row").inner_text()
    expect(polled.get_by_role("row")).not_to_have_text(shown)  # it is asked again, and the axis moves
    button(page, "Poll").click()

    show(page, "Program")
    page.get_by_label("Text", exact=True).select_option("steptwin:///drum/program.m1486")
    button(page, "Terminal").click()
    page.get_by_label("To send to chips").fill("X1")
    page.keyboard.press("Enter")
    page.get_by_label("To send to chips").fill("U1")
    page.keyboard.press("Enter")
    expect(page.get_by_role("log", name="What went over chips")).to_contain_text("←")


def test_a_breakpoint_stops_the_world_and_a_browser_without_room_is_named(demo: Demo) -> None:
    page = demo.page
    expect(time_of(page)).to_contain_text("live", timeout=LOADING_MS)
    show(page, "Program")
    page.get_by_label("Text", exact=True).select_option("steptwin:///table/program-0.prg")
    text = page.get_by_role("textbox", name="Text of demo.prg")
    page.evaluate("""() => {
      window.setItem = Storage.prototype.setItem;
      Storage.prototype.setItem = () => { throw new DOMException('full', 'QuotaExceededError'); };
    }""")
    text.click()
    page.keyboard.press("Control+Home")
    page.keyboard.insert_text("// no room\n")
    expect(page.get_by_text("The browser has no room for this text")).to_be_visible()
    button(page, "As in the twin").click()
    expect(text).not_to_contain_text("no room")
    expect(page.get_by_text("The browser has no room for this text")).to_have_count(0)
    page.evaluate("() => { Storage.prototype.setItem = setItem; }")
    expect(text.locator("span[class^=tok-]").first).to_be_visible(timeout=LOADING_MS)

    line = text.get_by_text("infeed = OFF")
    line.click()
    page.keyboard.press("F9")
    stands = page.get_by_label("Where the debugger stands")
    expect(stands).to_contain_text("breakpoint")
    expect(page.get_by_role("list", name="Call stack").get_by_role("listitem").first).to_have_text("MAIN line 29")
    expect(time_of(page)).to_contain_text("paused")
    line.click()
    page.keyboard.press("F9")
    expect(page.get_by_role("list", name="Breakpoints")).to_have_count(0)
    button(page, "Continue").click()
    expect(time_of(page)).to_contain_text("live")


def test_a_long_step_goes_to_its_end(demo: Demo) -> None:
    page = demo.page
    expect(time_of(page)).to_contain_text("live", timeout=LOADING_MS)
    button(page, "Pause time").click()
    expect(time_of(page)).to_contain_text("paused")
    show(page, "Time")
    now = page.get_by_label("World time")
    stood = float(now.inner_text())
    page.get_by_label("Duration of a step").fill("30")
    button(page, "Step by a duration").click()
    expect(now).to_have_text(f"{stood + 30:.6f}")
    page.locator("body").press("p")
    expect(time_of(page)).to_contain_text("live")


HIDE = """(hidden) => {
  Object.defineProperty(document, "hidden", { value: hidden, configurable: true });
  document.dispatchEvent(new Event("visibilitychange"));
}"""
"""A browser without windows hides no tab."""


def test_a_hidden_tab_goes_on_or_pauses_as_chosen(demo: Demo) -> None:
    page = demo.page
    expect(time_of(page)).to_contain_text("live", timeout=LOADING_MS)
    show(page, "Time")
    choice = page.get_by_label("Pause while this tab is hidden")
    expect(choice).not_to_be_checked()
    page.evaluate(HIDE, True)
    stood = page.get_by_label("World time").inner_text()
    expect(page.get_by_label("World time")).not_to_have_text(stood)
    expect(time_of(page)).to_contain_text("live")
    page.evaluate(HIDE, False)

    choice.check()
    page.evaluate(HIDE, True)
    expect(time_of(page)).to_contain_text("paused")
    page.evaluate(HIDE, False)
    expect(time_of(page)).to_contain_text("live")
    choice.uncheck()


def test_a_campaign_is_ended_in_the_midst_and_has_the_results_of_cpython(demo: Demo, tmp_path: Path) -> None:
    page = demo.page
    expect(time_of(page)).to_contain_text("live", timeout=LOADING_MS)
    show(page, "Campaigns")
    campaign = page.get_by_role("region", name="campaign", exact=True)
    text = campaign.get_by_role("textbox")
    whole = text.input_value()
    workers = len(page.workers)
    text.fill(whole.replace("runs = 30", "runs = 200"))
    button(page, "Run campaign").click()
    expect(campaign).to_contain_text(re.compile(r"[1-9]\d* of 200 runs"), timeout=LOADING_MS)
    assert len(page.workers) == workers + 1
    button(page, "End campaign").click()
    expect(campaign).to_contain_text("ended before its last run")
    until(page, lambda: len(page.workers) == workers, "its worker has ended")
    expect(time_of(page)).to_contain_text("live")
    stood = time_of(page).inner_text()
    expect(time_of(page)).not_to_have_text(stood)

    few = whole.replace("runs = 30", "runs = 4")
    text.fill(few)
    button(page, "Run campaign").click()
    expect(campaign).to_contain_text("of 4 runs pass", timeout=LOADING_MS)
    with page.expect_download() as saved:
        button(page, "Report of campaign").click()
    report = tmp_path / "report.html"
    saved.value.save_as(report)
    for file in FOLDER.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    (tmp_path / "campaign.toml").write_text(few)
    assert Campaign.load(tmp_path / "campaign.toml").run().digest in report.read_text("utf-8")

    text.fill(whole.replace("runs = 30", "runs = 201"))
    button(page, "Run campaign").click()
    expect(campaign).to_contain_text("a page runs at most 200")
    button(page, "Text as at first").click()
    expect(text).to_have_value(whole)


def until(page: Page, condition: Callable[[], bool], what: str) -> None:
    """Wait while bytes of the page pass."""
    for _ in range(1000):
        if condition():
            return
        page.wait_for_timeout(20)
    raise AssertionError(f"not seen: {what}")


def test_a_device_at_a_serial_port_of_the_browser_moves_to_a_target_and_nothing_without_end(
    demo: Demo, serve: Callable[..., Any]
) -> None:
    page = demo.page
    expect(time_of(page)).to_contain_text("live", timeout=LOADING_MS)
    config = EXAMPLES / "mic488/pick_and_place.cfg"
    twin = serve("--config", str(config))
    demo.serial.path = str(twin.pty)
    client = ModbusTcpClient("127.0.0.1", port=twin.tcp_port)
    assert client.connect()
    master = Master(client)
    master.word(10000, 1)  # values in pulses: only a configuration says how many a unit has

    show(page, "Devices")
    button(page, "Choose a serial port…").click()
    address = page.get_by_label("Address of the device")
    expect(address).to_have_value("webserial1")
    address.fill("webserial1,baud=19200,timeout=3")  # bytes go a long way here
    page.get_by_label("Configuration…").last.set_input_files(
        FilePayload(name="a, b.cfg", mimeType="", buffer=config.read_bytes())
    )
    expect(address).to_have_value("webserial1,baud=19200,timeout=3,config=a__b.cfg")
    address.press("Enter")
    expect(button(page, "Disconnect mic488")).to_be_visible()
    assert demo.serial.bauds == [19200]
    expect(page.get_by_role("banner").get_by_text("REAL")).to_be_visible()

    show(page, "Axes")
    button(page, "Enable mic488 M1").click()
    until(page, lambda: master.status(1) == 1, "the drive is on")
    page.get_by_label("Target mic488 M1").fill("30")
    button(page, "Move mic488 M1 to").click()
    until(page, lambda: master.words(10020, 2) == [30 * 80, 0], "the axis is at its target")
    button(page, "Home mic488 M1").click()
    expect(page.get_by_role("alert").last).to_contain_text("need not end by itself")
    assert master.status(1) == 4  # at its target, as before
    jog = button(page, "Jog mic488 M1 +")
    jog.hover()
    page.mouse.down()
    until(page, lambda: master.words(10028, 2) != [0, 0], "it runs while the button is held")
    page.mouse.up()
    until(page, lambda: master.words(10028, 2) == [0, 0], "it brakes")
    client.close()

    show(page, "Devices")
    button(page, "Disconnect mic488").click()
    expect(page.get_by_text("No device is connected.")).to_be_visible()
    expect(page.get_by_role("banner").get_by_text("REAL")).to_have_count(0)


def test_a_link_to_the_machine_opens_another_twin_in_another_tab(demo: Demo, monkeypatch: pytest.MonkeyPatch) -> None:
    expect(time_of(demo.page)).to_contain_text("live", timeout=LOADING_MS)
    button(demo.page, "Share").click()
    expect(demo.page).to_have_url(re.compile("#world="))
    show(demo.page, "Time")
    demo.page.get_by_label("Pause while this tab is hidden").check()  # it is kept: other tabs have it
    other = demo.tab()

    # All of the page is stored meanwhile: this tab has no network.
    expect(demo.page.get_by_title("can be opened without a network")).to_be_visible()
    demo.context.set_offline(True)
    other.goto(demo.page.url)

    # Nothing of it runs before a click. What was typed and not downloaded is not in it.
    expect(other.get_by_role("heading", name="demo.prg")).to_be_visible()
    assert other.workers == []
    shown = "".join(other.locator("pre").all_inner_texts())
    assert 'name = "demo"' in shown
    assert "NONSENSE" not in shown
    button(other, "Open in the studio").click()
    expect(time_of(other)).to_contain_text("live", timeout=LOADING_MS)
    expect(time_of(other)).to_contain_text(re.compile(r"[3-9]\.\d+ s"))
    show(other, "Time")
    choice = other.get_by_label("Pause while this tab is hidden")
    expect(choice).to_be_checked()
    choice.uncheck()
    button(other, "Pause time").click()
    expect(time_of(other)).to_contain_text("paused")
    expect(time_of(demo.page)).to_contain_text("live")

    # Its workers do not answer any more: another twin goes on from its last state, where time stands.
    for worker in other.workers:
        worker.evaluate("() => void setTimeout(() => { for (;;); })")
    expect(other.get_by_role("status").first).to_contain_text("does not answer")
    button(other, "Restart").click()
    expect(other.get_by_role("status").first).to_contain_text("being loaded")
    expect(other.get_by_role("status").first).not_to_contain_text("being loaded", timeout=LOADING_MS)
    expect(time_of(other)).to_contain_text(re.compile(r"paused.*[1-9]\.\d+ s", re.DOTALL))

    # A newer version for which the browser has no room is left out, and this one stays.
    demo.context.set_offline(False)
    monkeypatch.setattr(Handler, "is_newer", True)
    origin = demo.page.evaluate("location.origin")
    storage = demo.context.new_cdp_session(demo.page)
    storage.send("Storage.overrideQuotaForOrigin", {"origin": origin, "quotaSize": 1})
    assert demo.page.evaluate(FAILED_UPDATE) == "redundant"
    storage.send("Storage.overrideQuotaForOrigin", {"origin": origin})
    expect(demo.page.get_by_title("can be opened without a network")).to_be_visible()

    # One that is stored is offered, and does not begin under a twin.
    demo.page.evaluate("async () => { await (await navigator.serviceWorker.ready).update() }")
    button(demo.page, "New version").click()
    expect(demo.page.get_by_text("1 are open")).to_be_visible()
    expect(time_of(demo.page)).to_contain_text("live")
    other.close()
    with demo.page.expect_navigation():
        button(demo.page, "New version").click()
