"""Sessions of a running studio: saved, replayed by another process, exported, and opened as views."""

from __future__ import annotations

import csv
import json
import os
import re
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest
from playwright.sync_api import Browser, Page, expect
from studio_page import Studio, button
from tests.conftest import STEPTWIN, until
from tests.studio.conftest import Process
from tokens import tokens_file

TOKENS = "operator piotr operator-0123456789\nviewer hall viewer-01234567890\n"


def ask(process: Process, request: str, token: str | None = None, /, **fields: object) -> Any:
    headers = {} if token is None else {"authorization": f"Bearer {token}"}
    return httpx.post(f"{process.url}/api/do/{request}", json=fields, headers=headers, timeout=60).json()


def fetch(process: Process, file: str, token: str | None = None) -> httpx.Response:
    headers = {} if token is None else {"authorization": f"Bearer {token}"}
    return httpx.get(f"{process.url}/api/recordings/{file}", headers=headers, timeout=60)


def move(process: Process) -> None:
    ask(process, "enable", controller="table", axis=1)
    ask(process, "move", controller="table", axis=1, to=5)
    until(lambda: ask(process, "read", points=["table.M1.position"])["ok"][0]["value"] == 5, "the axis is there")


def test_a_session_is_saved_and_replayed_by_another_process(start_studio: Callable[..., Process]) -> None:
    studio = start_studio()
    move(studio)
    saved = ask(studio, "save_recording", name="first")["ok"]
    path = studio.directory / "first.json"
    assert saved["name"] == "first"
    assert saved["bytes"] == path.stat().st_size
    replayed = subprocess.run([STEPTWIN, "replay", str(path)], capture_output=True, text=True, check=True)
    assert "the same, digest" in replayed.stdout

    found = ask(studio, "recordings")["ok"]
    assert [one["name"] for one in found["saved"]] == ["first"]  # and not the ready file, which is JSON too
    assert found["folder"] == str(studio.directory)
    assert found["recording"]["inputs"] == len(json.loads(path.read_text())["inputs"])
    assert found["recording"]["is_full"] is False
    assert found["past"]["from_ns"] == "0"
    assert found["trace"] == {"kind": "none", "file": None, "records": None, "most_records": None, "from_ns": None}

    again = ask(studio, "save_recording", name="first")["error"]
    assert (again["code"], again["message"]) == ("refusal", f"{path} is there already: give another name")
    assert ask(studio, "save_recording", name="../elsewhere")["error"]["code"] == "misuse"
    assert re.fullmatch(r"hall-\d{8}-\d{6}", ask(studio, "save_recording")["ok"]["name"])


def test_what_the_options_record(start_studio: Callable[..., Process], tmp_path: Path) -> None:
    studio = start_studio("--session", str(tmp_path / "s.json"), "--trace", "ring 40")
    move(studio)
    found = ask(studio, "recordings")["ok"]
    assert found["recording"]["file"] == str(tmp_path / "s.json")
    assert found["trace"]["kind"] == "ring"
    assert 0 < found["trace"]["records"] <= found["trace"]["most_records"] == 40
    studio.end()
    assert (tmp_path / "s.json").exists()
    traced = start_studio("--trace", str(tmp_path / "t.jsonl"))
    assert ask(traced, "recordings")["ok"]["trace"]["file"] == str(tmp_path / "t.jsonl")


def test_exports_of_a_session(start_studio: Callable[..., Process]) -> None:
    studio = start_studio()
    move(studio)
    ask(studio, "save_recording", name="first")
    assert fetch(studio, "first.json").content == (studio.directory / "first.json").read_bytes()
    vcd = fetch(studio, "first.vcd")
    assert vcd.headers["content-disposition"] == 'attachment; filename="first.vcd"'
    assert b"$enddefinitions" in vcd.content
    *_, last = csv.DictReader(fetch(studio, "first.csv").text.splitlines())
    assert float(next(value for name, value in last.items() if name.startswith("table.M1") and "position" in name)) == 5.0
    assert b"<title>hall</title>" in fetch(studio, "first.html").content
    for file, code in (("first.exe", "misuse"), ("second.vcd", "misuse"), ("..%2Fhall.toml", None)):
        answer = fetch(studio, file)
        assert answer.status_code in (400, 404)
        if code is not None:
            assert answer.json()["error"]["code"] == code


def test_a_file_that_is_no_session_is_not_given_away(start_studio: Callable[..., Process]) -> None:
    studio = start_studio()
    (studio.directory / "secret.json").write_text('{"password": 1}')
    assert fetch(studio, "secret.json").status_code == 400
    assert "secret" not in [one["name"] for one in ask(studio, "recordings")["ok"]["saved"]]


def test_an_operator_saves_and_a_viewer_looks(start_studio: Callable[..., Process], tmp_path: Path) -> None:
    tokens_file(tmp_path, TOKENS)
    studio = start_studio("--tokens", str(tmp_path / "tokens"))
    viewer, operator = "viewer-01234567890", "operator-0123456789"
    refused = ask(studio, "save_recording", viewer, name="mine")["error"]["message"]
    assert refused == "save_recording is for the role operator; hall has the role viewer"
    assert ask(studio, "save_recording", operator, name="mine")["ok"]["name"] == "mine"
    assert fetch(studio, "mine.json", viewer).status_code == 200
    assert fetch(studio, "mine.json").status_code == 401


def test_a_view_of_a_session(start_studio: Callable[..., Process]) -> None:
    studio = start_studio()
    move(studio)
    ask(studio, "save_recording", name="first")
    url = ask(studio, "view_recording", name="first")["ok"]["url"]
    points = httpx.get(f"{url}api/points?names=table.M1.position").json()["ok"]
    assert points[0]["value"] == 5.0
    assert httpx.post(f"{url}api/do/save_recording", json={}).status_code == 403  # everybody is a viewer there
    assert httpx.post(f"{url}api/do/recordings", json={}).json()["ok"]["recording"] is None
    assert ask(studio, "view_recording", name="first")["ok"]["url"] == url
    studio.end()
    with pytest.raises(httpx.ConnectError):
        httpx.get(url)


def test_a_broken_session_is_named(start_studio: Callable[..., Process]) -> None:
    studio = start_studio()
    (studio.directory / "torn.json").write_text('{"steptwin_session": 1, "until_ns": 5')
    assert "torn.json" in ask(studio, "view_recording", name="torn")["error"]["message"]
    assert "torn.json" in fetch(studio, "torn.vcd").json()["error"]["message"]


def test_devices_alone_are_not_recorded(start_studio: Callable[..., Process], serve: Callable[..., Any]) -> None:
    twin = serve()
    studio = start_studio("--itself", "--device", f"tcp://127.0.0.1:{twin.tcp_port}")
    answer = ask(studio, "recordings")["error"]
    assert answer["message"] == "no world to record here"


def save_in(page: Page, name: str) -> None:
    page.get_by_label("Name of the file").fill(name)
    button(page, "Save recording").click()
    expect(page.get_by_role("rowheader", name=name, exact=True)).to_be_visible()


def test_the_panel_saves_downloads_and_opens(studio: Studio, tmp_path: Path, browser: Browser) -> None:
    page = studio.page(panel="Recordings")
    now = page.get_by_role("table", name="What is recorded now")
    expect(now.get_by_role("row").filter(has_text="Recording")).to_contain_text("of 200000 inputs")
    expect(now.get_by_role("row").filter(has_text="Trace")).to_contain_text("nothing")
    studio.master.enable(1)
    save_in(page, "shift-1")
    assert (studio.process.directory / "shift-1.json").exists()
    with page.expect_download() as download:
        button(page, "Download shift-1.vcd").click()
    download.value.save_as(tmp_path / "shift.vcd")
    assert "$var" in (tmp_path / "shift.vcd").read_text()
    button(page, "Open a view of shift-1").click()
    link = page.get_by_role("link", name="View of shift-1")
    expect(link).to_have_attribute("href", re.compile(r"http://127\.0\.0\.1:\d+/"))
    with page.context.expect_page() as opened:
        link.click()
    expect(opened.value.get_by_role("group", name="Virtual time")).to_contain_text("paused")
    expect(button(opened.value, "Take control")).to_have_count(0)
    opened.value.close()


def test_a_folder_that_cannot_be_written(start_studio: Callable[..., Process]) -> None:
    studio = start_studio()
    if os.geteuid() == 0:
        (studio.directory / "taken.json").mkdir()
        assert ask(studio, "save_recording", name="taken")["error"]["code"] == "refusal"
    else:
        studio.directory.chmod(0o500)
        assert "cannot write" in ask(studio, "save_recording", name="new")["error"]["message"]
        studio.directory.chmod(0o700)
