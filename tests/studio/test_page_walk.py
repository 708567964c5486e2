"""Every panel with devices of each kind, in a real browser: nothing fails or is empty without a reason, and nothing is said
that is true of twins only. Twins in processes of their own play the devices; the studio does not find them as twins."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from playwright.sync_api import Browser, Locator, Page, expect
from studio_page import button, panels_of, show, wider_than_panes
from tests.studio.conftest import Process

OF_TWINS = re.compile(r"\b(twins?|virtual\w*|world\w*|simulat\w*|descriptions?)\b", re.IGNORECASE)
ABOUT_TWINS = {
    "Devices": (
        "Digital shadow",
        "Does it behave as the twin does?",
        "no twin",
        "a twin needs the configuration of the controller",
    ),
}
"""What a panel of devices says of twins."""
VENDORS = Path(__file__).parents[2] / "docs/vendor-programs.md"


class Kind(NamedTuple):
    """Devices, and what each panel says of them."""

    served: str
    options: tuple[str, ...]
    addresses: Callable[[Any], tuple[str, ...]]
    says: Mapping[str, str]


COMMON = {
    "Scope": "Choose signals",
    "Devices": "Nothing moves by it",
    "Audit log": "Nobody has commanded anything yet",
}
KINDS = {
    "MIC488, over TCP and a serial line": Kind(
        "serve",
        ("--demo",),
        lambda twin: (f"127.0.0.1:{twin.tcp_port}", str(twin.pty)),
        COMMON
        | {
            "Overview": "Nothing listens here: other programs connect to the devices themselves",
            "Axes": "sampled",
            "I/O": "What no register shows is left out: AIN1, AIN2, ERR",
            "Registers": "Cyclic read",
            "Configuration": "Read from the registers of mic488",
            "Calculator": "the pulses in a unit are not known (config=FILE behind the address of a device)",
            "Frames": "read M1_POS_ACT … M4_POS_ACT",
        },
    ),
    "M1486, two on one line": Kind(
        "serve_m1486",
        ("--chain", "0,7"),
        lambda twin: tuple(f"tcp://127.0.0.1:{twin.tcp_port},kind=m1486,chip={chip}" for chip in (0, 7)),
        COMMON
        | {
            "Overview": "Nothing listens here: other programs connect to the devices themselves",
            "Axes": "sampled",
            "I/O": "they are not asked for: that would overwrite a value that its program may need",
            "Registers": "Cyclic read",
            "Configuration": "no command reads its settings: their present values are unknown",
            "Calculator": "Start/stop velocity",
            "Frames": "echo of 'x7",
        },
    ),
}


@pytest.fixture(params=KINDS)
def walked(
    request: pytest.FixtureRequest, start_studio: Callable[..., Process], browser: Browser
) -> Iterator[tuple[Kind, Process, Page, list[str]]]:
    kind = KINDS[request.param]
    twin = request.getfixturevalue(kind.served)(*kind.options)
    process = start_studio("--itself", *(part for place in kind.addresses(twin) for part in ("--device", place)))
    context = browser.new_context(viewport={"width": 1280, "height": 900}, locale="en-US")
    page = context.new_page()
    complaints: list[str] = []
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)
    page.goto(process.url)
    yield kind, process, page, complaints
    context.close()


def body_of(page: Page, panel: str) -> Locator:
    return page.get_by_role("region", name=panel, exact=True).last


def test_every_panel(walked: tuple[Kind, Process, Page, list[str]]) -> None:
    kind, _, page, complaints = walked
    expect(page.get_by_role("navigation").get_by_role("button")).to_have_count(len(kind.says))
    names = panels_of(page)
    assert set(names) == set(kind.says)
    for name in names:
        show(page, name)
        body = body_of(page, name)
        expect(body).to_contain_text(kind.says[name])
        text = body.inner_text()
        for allowed in ABOUT_TWINS.get(name, ()):
            text = text.replace(allowed, "")
        assert OF_TWINS.findall(text) == [], (name, text)
        assert body.get_by_role("slider").count() == (1 if name == "Axes" else 0), name
        assert [alert for alert in page.get_by_role("alert").all_inner_texts() if alert] == [], name
    for row in re.findall(r"^\| (?!function|---)(.+) \|$", VENDORS.read_text("utf-8"), re.MULTILINE):
        named = re.findall(r"\*\*([^*]+)\*\*( \(twins\))?", row.partition(" | ")[2])
        assert {panel for panel, of_twins in named if not of_twins} <= set(names), row
    check_what_is_switched_and_written(kind, page)
    page.set_viewport_size({"width": 390, "height": 844})
    page.reload()  # without the tree
    for name in names:
        show(page, name)
        expect(body_of(page, name)).to_contain_text(kind.says[name] if name != "Audit log" else "viewer 1")
        assert wider_than_panes(page) == [], name
    assert complaints == []


def check_what_is_switched_and_written(kind: Kind, page: Page) -> None:
    show(page, "Configuration")
    body = body_of(page, "Configuration")
    if kind.served == "serve_m1486":
        page.get_by_label("Controller", exact=True).select_option("m1486-7")
        velocity = page.get_by_label("New value of Velocity")
        velocity.fill("900")
        button(page, "Send Velocity to m1486-7").click()
        expect(velocity).to_have_value("")
        show(page, "Frames")
        page.get_by_role("searchbox").last.fill("V800")
        page.get_by_label("Characters to send").fill("X7 V 800")
        button(page, "Send characters").click()
        expect(body_of(page, "Frames")).to_contain_text("V800  Velocity 800 step/s")
        return
    expect(body.get_by_label("M1 Gear")).to_have_value("")
    expect(body.get_by_label("M1 Acc")).to_have_value("50")
    body.get_by_label("M1 Acc").fill("400")
    body.get_by_label("M1 Acc").press("Enter")
    rows = body.get_by_role("table").get_by_role("row")
    expect(rows).to_have_count(2)
    expect(rows.last).to_contain_text("M1_ACC")
    button(page, "Write to mic488").click()
    expect(body).to_contain_text("Nothing was changed here that a register has.")
    show(page, "I/O")
    switch = button(page, "Switch mic488 M1_EN")
    for level in ("true", "false"):
        switch.click()
        expect(switch).to_have_attribute("aria-pressed", level)
