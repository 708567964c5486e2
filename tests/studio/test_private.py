"""What is private stays private: who needs a token for what, and where requests may write."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from tests.studio.conftest import WORLD, Process, StudioWorld

from steptwin.commands.studio_drawing import WorldArrangement
from steptwin.world.arrangement import DrawnPlace
from steptwin.world.description import read_world

CAMPAIGN = (
    '[campaign]\nname = "doors"\nworld = "hall.toml"\nruns = 1\n[[property]]\nname = "n"\nnever = "table.IN1"\n'
)


class Folder:
    """A studio with a file of its user, the folder of that file, and what lies beside it."""

    def __init__(self, base: Path) -> None:
        own = base / "own"
        own.mkdir()
        self.precious = base / "settings.json"
        self.precious.write_text('{"precious": 1}')
        (own / "settings.json").write_text('{"precious": 2}')
        (own / "table.csv").write_text("precious")
        (own / "link.json").symlink_to(self.precious)
        (own / "nowhere.json").symlink_to(base / "missing.json")
        (own / "way").symlink_to(base)
        os.link(self.precious, own / "second.json")
        (own / "doors.toml").write_text(CAMPAIGN)
        (own / "doors.results").symlink_to(base)
        self.base = base
        self.process = Process(own, StudioWorld(), "--trace", "ring 100").wait_until_ready()

    def over_rest(self, name: str, /, **fields: object) -> Any:
        return httpx.post(f"{self.process.url}/api/do/{name}", json=fields, timeout=60).json()

    def over_websocket(self, name: str, /, **fields: object) -> Any:
        socket = self.process.connect()
        socket.send('{"do": "hello", "id": 0}')
        socket.send(json.dumps({"do": name, "id": 1, **fields}))
        while (answer := json.loads(socket.recv(60))).get("id") != 1:
            pass
        socket.close()
        return answer


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Folder]:
    found = Folder(tmp_path_factory.mktemp("private"))
    yield found
    try:
        found.process.end()
    finally:
        found.process.close()


WAYS: tuple[Callable[..., Any], ...] = (Folder.over_rest, Folder.over_websocket)
ONLY, LINK, THERE = "requests write into {own} only", "it is a link", "is there already"
REFUSED = (
    ("save", {"file": "{base}/settings.json"}, ONLY),
    ("save", {"file": "../settings.json"}, ONLY),
    ("save", {"file": "{base}/new.json"}, ONLY),
    ("save", {"file": "way/new.json"}, ONLY),
    ("save", {"file": "way/new.vcd"}, ONLY),
    ("save", {"file": "link.json"}, LINK),
    ("save", {"file": "nowhere.json"}, LINK),
    ("save", {"file": "second.json"}, LINK),
    ("save", {"file": "settings.json"}, "is not a session of a world"),
    ("save", {"file": "hall.toml"}, THERE),
    ("save", {"file": "table.csv"}, THERE),
    ("save", {"file": "{own}"}, ONLY),
    ("save_recording", {"name": "../settings"}, "permitted are"),
    ("save_recording", {"name": "way/new"}, "permitted are"),
    ("save_recording", {"name": "link"}, LINK),
    ("save_recording", {"name": "nowhere"}, LINK),
    ("save_recording", {"name": "settings"}, THERE),
    ("run_campaign", {"campaign": "doors.toml"}, LINK),
)


@pytest.mark.parametrize("ask", WAYS)
@pytest.mark.parametrize(("name", "fields", "message"), REFUSED)
def test_requests_write_nowhere_else(
    folder: Folder, ask: Callable[..., Any], name: str, fields: dict[str, str], message: str
) -> None:
    places = {"base": folder.base, "own": folder.process.directory}
    before = contents(folder.base)
    answer = ask(folder, name, **{key: value.format(**places) for key, value in fields.items()})
    assert message.format(**places) in answer["error"]["message"]
    assert contents(folder.base) == before


def contents(base: Path) -> dict[str, bytes]:
    return {str(path): path.read_bytes() for path in base.rglob("*") if path.is_file() and path.name != "out"}


@pytest.mark.parametrize("ask", WAYS)
def test_a_session_is_saved_in_the_folder_and_over_a_session(folder: Folder, ask: Callable[..., Any]) -> None:
    path = folder.process.directory / f"{ask.__name__}.json"
    for name in (path.name, str(path)):
        assert ask(folder, "save", file=name)["ok"]["file"] == str(path)
        assert "steptwin_session" in path.read_text()


def test_a_description_that_is_a_link_is_not_written(tmp_path: Path) -> None:
    """The page gives it as a download then."""
    real, link = tmp_path / "real.toml", tmp_path / "hall.toml"
    real.write_text(WORLD)
    link.symlink_to(real)
    saved = [
        WorldArrangement(read_world(file.name, WORLD), ["table.M1"], file).save((DrawnPlace("table.M1", 10, 20),))
        for file in (link, real)
    ]
    assert [one["file"] for one in saved] == [None, str(real)]
    assert real.read_text() == saved[0]["text"] == saved[1]["text"] != WORLD
