"""Branches of the world of a studio: from a moment of the past, with an outcome of their own, which the world does not notice."""

from __future__ import annotations

import re
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest
from playwright.sync_api import expect
from studio_page import Studio, button, serious, show
from tests.conftest import until
from tests.studio.conftest import Process, StudioWorld
from tokens import tokens_file

WORLD = """
    [world]
    name = "cell"
    [[line]]
    name = "bus"
    kind = "modbus"
    tcp = "127.0.0.1:0"
    [[mic488]]
    name = "table"
    line = "bus"
    program = "cell.prg"
    start = true
"""
PROGRAM = """\
$R4 = 0
DELAY 2
IF IN3 = ON
$R4 = 2
ELSE
$R4 = 1
ENDIF
"""
TOKENS = "operator piotr operator-0123456789\nviewer hall viewer-01234567890\n"


@pytest.fixture
def studio_world() -> StudioWorld:
    return StudioWorld(WORLD, {"cell.prg": PROGRAM})


def ask(url: str, request: str, token: str | None = None, /, **fields: object) -> Any:
    headers = {} if token is None else {"authorization": f"Bearer {token}"}
    return httpx.post(f"{url.rstrip('/')}/api/do/{request}", json=fields, headers=headers, timeout=60).json()


def value(url: str, point: str) -> float:
    return float(ask(url, "read", points=[point])["ok"][0]["value"])


def decided(url: str) -> float:
    """What the program has made of the input; 0: nothing yet."""
    return value(url, "table.USER_REGISTER[4]:real")


def test_a_branch_has_another_outcome_and_the_world_is_unchanged(start_studio: Callable[..., Process]) -> None:
    studio = start_studio()
    until(lambda: decided(studio.url) == 1, "the program has decided")
    begun = ask(studio.url, "start_branch", at_ns="1000000000")["ok"]
    assert (begun["branch"], begun["from_ns"]) == (1, "1000000000")
    assert ask(studio.url, "branches")["ok"] == [begun]
    branch = begun["url"]
    assert value(branch, "time") == 1.0  # and it stands there
    assert decided(branch) == 0
    assert "ok" in ask(branch, "set", levels={"table.IN3": 1})
    assert ask(branch, "step", for_ns="1500000000")["ok"]
    assert value(branch, "time") == 2.5
    assert decided(branch) == 2
    assert decided(studio.url) == 1
    assert value(studio.url, "table.IN3") == 0
    assert ask(branch, "traffic")["ok"]["lines"][0]["clients"] == 0
    assert ask(branch, "recordings")["error"]["code"] == "refusal"  # nothing of a branch is recorded
    assert "ok" in ask(studio.url, "end_branch", branch=1)
    with pytest.raises(httpx.ConnectError):
        httpx.get(branch)
    assert ask(studio.url, "branches")["ok"] == []
    assert ask(studio.url, "end_branch", branch=1)["error"]["message"] == "no branch 1: open are none"


def test_a_branch_of_the_present_a_branch_of_that_and_a_moment_that_is_not_kept(start_studio: Callable[..., Process]) -> None:
    studio = start_studio()
    until(lambda: decided(studio.url) == 1, "the program has decided")
    first = ask(studio.url, "start_branch")["ok"]
    begin = int(first["from_ns"])
    assert begin > 2e9
    assert decided(first["url"]) == 1
    ask(first["url"], "step", for_ns="500000000")
    second = ask(first["url"], "start_branch", at_ns=str(begin + 250_000_000))["ok"]
    assert value(second["url"], "time") * 1e9 == pytest.approx(begin + 250_000_000)
    outside = ask(first["url"], "start_branch", at_ns="1000000000")["error"]  # its past begins with it
    assert outside["code"] == "misuse"
    assert "1 s" in outside["message"]


def test_branches_end_with_the_studio_however_it_ends(start_studio: Callable[..., Process]) -> None:
    clean, killed = start_studio(), start_studio()
    urls = [ask(one.url, "start_branch")["ok"]["url"] for one in (clean, killed)]
    assert [value(url, "time") > 0 for url in urls] == [True, True]
    clean.end()
    killed.process.send_signal(signal.SIGKILL)
    for url in urls:
        until(lambda url=url: not answers(url), "the branch has ended")


def answers(url: str) -> bool:
    try:
        return httpx.get(url, timeout=60).is_success
    except httpx.TransportError:
        return False


def test_roles_and_the_most_branches(start_studio: Callable[..., Process], tmp_path: Path) -> None:
    tokens_file(tmp_path, TOKENS)
    studio = start_studio("--tokens", str(tmp_path / "tokens"))
    viewer, operator = "viewer-01234567890", "operator-0123456789"
    refused = ask(studio.url, "start_branch", viewer)["error"]["message"]
    assert refused == "start_branch is for the role operator; hall has the role viewer"
    url = ask(studio.url, "start_branch", operator)["ok"]["url"]
    assert httpx.post(f"{url}api/do/read", json={"points": ["time"]}).status_code == 401  # the tokens are those of the studio
    assert "ok" in ask(url, "step", operator, for_ns="1000000")
    assert ask(url, "step", viewer, for_ns="1000000")["error"]["code"] == "refusal"
    for _ in range(3):
        assert "ok" in ask(studio.url, "start_branch", operator)
    most = ask(studio.url, "start_branch", operator)["error"]["message"]
    assert most == "too many branches: the limit is 4; end one"
    assert len(ask(studio.url, "branches", viewer)["ok"]) == 4


def test_there_is_none_where_others_can_reach_the_studio(start_studio: Callable[..., Process], tmp_path: Path) -> None:
    tokens_file(tmp_path, TOKENS)
    studio = start_studio("--http", "0.0.0.0:0", "--remote", "--tokens", str(tmp_path / "tokens"))
    url = f"http://127.0.0.1:{studio.end_points['http']['port']}"
    assert "from the computer of the studio only" in ask(url, "start_branch", "operator-0123456789")["error"]["message"]


def test_the_time_panel_branches_from_the_moment_that_is_shown(studio: Studio) -> None:
    page = studio.page(panel="Time")
    until(lambda: studio.master.real(studio.master.words(4, 2)) == 1, "the program has decided")
    page.get_by_label("Moment to look at").fill("1")
    button(page, "Look at this moment").click()
    button(page, "Branch from 1.000 s").click()
    rows = page.get_by_role("table", name="Branches").get_by_role("row")
    expect(rows).to_have_count(1)
    expect(rows).to_contain_text("from 1.000 s")
    with page.context.expect_page() as opened:
        page.get_by_role("link", name="Open branch 1").click()
    branch = opened.value
    expect(branch.get_by_role("heading", level=1)).to_have_text("steptwin cell")
    expect(branch.get_by_role("banner")).to_contain_text("Branch 1 from 1.000 s")
    expect(branch.get_by_role("group", name="Virtual time")).to_contain_text("paused")
    expect(branch.get_by_role("region", name="First minute")).to_have_count(0)
    show(branch, "I/O")
    button(branch, "Set IN3").click()
    expect(button(branch, "Set IN3")).to_have_attribute("aria-pressed", "true")
    branch.get_by_role("group", name="Virtual time").get_by_role("button", name="Let time go on").click()
    until(lambda: decided(branch.url) == 2, "the branch has decided otherwise")
    branch.close()
    assert studio.master.real(studio.master.words(4, 2)) == 1
    button(page, "End branch 1").click()
    expect(page.get_by_role("table", name="Branches")).to_have_count(0)


def test_the_branches_in_polish(studio: Studio) -> None:
    page = studio.page("pl-PL", panel="Czas", bypass_csp=True, color_scheme="dark")
    button(page, "Odgałęzienie od teraz").click()
    with page.context.expect_page() as opened:
        page.get_by_role("link", name="Otwórz odgałęzienie 1").click()
    branch = opened.value
    branch.emulate_media(color_scheme="light")
    expect(branch.locator("html")).to_have_attribute("data-theme", "light")
    branch.emulate_media(color_scheme="dark")
    expect(branch.locator("html")).to_have_attribute("data-theme", "dark")
    expect(branch.get_by_role("banner")).to_contain_text(re.compile(r"Odgałęzienie 1 od \d+\.\d{3} s"))
    assert [*serious(page), *serious(branch)] == []
