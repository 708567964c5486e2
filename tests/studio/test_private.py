"""What is private stays private: who needs a token for what, and where requests may write."""

from __future__ import annotations

import contextlib
import io
import json
import os
from collections.abc import Callable, Generator, Iterator
from dataclasses import replace
from http.client import HTTPConnection
from pathlib import Path
from queue import Queue
from typing import Any
from urllib.request import url2pathname

import pytest
from tests.studio.conftest import WORLD, Process, StudioWorld
from websockets.exceptions import ConnectionClosed

from steptwin.access.roles import Role
from steptwin.access.tokens import Token
from steptwin.errors import Misuse
from steptwin.live.studio.drawing import WorldArrangement
from steptwin.live.studio.openpage import OpenedPage
from steptwin.live.studio.owntokens import own_tokens
from steptwin.live.studio.start import DEFAULT, AccessInfo
from steptwin.simulation.describe.arrangement import DrawnPosition
from steptwin.simulation.describe.description import read_world
from steptwin.studio.rest import NO_TOKEN
from steptwin.studio.viewers import REFUSED as CLOSED

CAMPAIGN = '[campaign]\nname = "doors"\nworld = "hall.toml"\nruns = 1\n[[property]]\nname = "n"\nnever = "table.IN1"\n'


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
        self.process = Process(own, StudioWorld(), "--trace", "ring 100", "--with-token").wait_until_ready()

    def over_rest(self, name: str, /, **fields: object) -> Any:
        return json.loads(post(self.process, name, self.process.token, **fields)[1])

    def over_websocket(self, name: str, /, **fields: object) -> Any:
        socket = self.process.connect()
        socket.send(json.dumps({"do": "hello", "version": 2, "token": self.process.token, "id": 0}))
        socket.send(json.dumps({"do": name, "id": 1, **fields}))
        while (answer := json.loads(socket.recv(60))).get("id") != 1:
            pass
        socket.close()
        return answer


def request(process: Process, method: str, path: str, token: str | None, body: str | None = None) -> tuple[int, str]:
    """Status and text of the answer. A client of httpx for each of hundreds of requests would take seconds."""
    connection = HTTPConnection("127.0.0.1", process.end_points["http"]["port"], timeout=60)
    with contextlib.closing(connection):
        connection.request(method, path, body, {} if token is None else {"authorization": f"Bearer {token}"})
        answer = connection.getresponse()
        return answer.status, answer.read().decode()


def post(process: Process, name: str, token: str | None, /, **fields: object) -> tuple[int, str]:
    return request(process, "POST", f"/api/do/{name}", token, json.dumps(fields))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Folder]:
    found = Folder(tmp_path_factory.mktemp("private"))
    try:
        yield found
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
    ("save", {"file": "settings.json"}, "is not a recording of a world"),
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
        WorldArrangement(read_world(file.name, WORLD), ["table.M1"], file).save((DrawnPosition("table.M1", 10, 20),))
        for file in (link, real)
    ]
    assert [one.file for one in saved] == [None, str(real)]
    assert real.read_text() == saved[0].text == saved[1].text != WORLD


# ---------------------------------------------------------------------- ways in


class Visitor:
    """Somebody at a studio, with a token or without. Each way in says whether it let the visitor in."""

    def __init__(self, process: Process, token: str | None) -> None:
        self._process = process
        self._token = token

    def get(self, path: str) -> bool:
        return request(self._process, "GET", path, self._token)[0] != NO_TOKEN

    def post(self, name: str, **fields: object) -> bool:
        return post(self._process, name, self._token, **fields)[0] != NO_TOKEN

    def hello(self, path: str) -> bool:
        """Who is not let in is told why, and the connection is closed."""
        socket = self._process.connect(path)
        token = {} if self._token is None else {"token": self._token}
        socket.send(json.dumps({"do": "hello", "version": 2, **token}))
        if "error" not in json.loads(socket.recv(60)):
            socket.close()
            return True
        with pytest.raises(ConnectionClosed):
            socket.recv(60)
        assert socket.close_code == CLOSED
        return False

    def stop_before_hello(self, name: str, **fields: object) -> bool:
        socket = self._process.connect()
        socket.send(json.dumps({"do": name, **fields}))
        answer = json.loads(socket.recv(60))
        socket.close()
        return "error" not in answer


PUBLIC: dict[str, Callable[[Visitor], bool]] = {
    "page": lambda visitor: visitor.get("/"),
    "openapi": lambda visitor: visitor.get("/openapi.json"),
    "POST stop": lambda visitor: visitor.post("stop", controller="table"),
    "POST stop_all": lambda visitor: visitor.post("stop_all"),
    "stop before hello": lambda visitor: visitor.stop_before_hello("stop", controller="table"),
    "stop_all before hello": lambda visitor: visitor.stop_before_hello("stop_all"),
}
"""The same for everybody who has steptwin; and stops, which are always possible."""
OF_THE_WORLD: dict[str, Callable[[Visitor], bool]] = {
    "GET describe": lambda visitor: visitor.get("/api/describe"),
    "GET state": lambda visitor: visitor.get("/api/state"),
    "GET points": lambda visitor: visitor.get("/api/points?names=time"),
    "GET recordings": lambda visitor: visitor.get("/api/recordings/none.json"),
    "POST read": lambda visitor: visitor.post("read", points=["time"]),
    "POST resume": lambda visitor: visitor.post("resume"),
    "POST save": lambda visitor: visitor.post("save", file="../elsewhere.json"),
    "WebSocket": lambda visitor: visitor.hello("/ws"),
    "editor": lambda visitor: visitor.hello("/editor"),
}
OF_DEVICES: dict[str, Callable[[Visitor], bool]] = {
    "POST connect": lambda visitor: visitor.post("connect", address=""),
    "POST scan": lambda visitor: visitor.post("scan", kind="none"),
    "POST verify": lambda visitor: visitor.post("verify"),
    "POST work": lambda visitor: visitor.post("work"),
}
NOBODY, WRONG, RIGHT = "no token", "a wrong token", "the token"


def check_who_is_let_in(studio: Process, to_the_world: set[str]) -> None:
    for who, token in ((NOBODY, None), (WRONG, "wrong-0123456789abcdef"), (RIGHT, studio.token)):
        visitor = Visitor(studio, token)
        expected = {
            **dict.fromkeys(PUBLIC, True),
            **dict.fromkeys(OF_THE_WORLD, who in to_the_world),
            **dict.fromkeys(OF_DEVICES, who == RIGHT),
        }
        assert {way: enter(visitor) for way, enter in {**PUBLIC, **OF_THE_WORLD, **OF_DEVICES}.items()} == expected, who


@contextlib.contextmanager
def started(folder: Path, *options: str) -> Generator[Process]:
    process = Process(folder, StudioWorld(), *options)
    try:
        yield process.wait_until_ready()
        process.end()
    finally:
        process.close()


def test_who_is_let_in_to_a_file_of_the_user(folder: Folder) -> None:
    check_who_is_let_in(folder.process, {RIGHT})


def test_who_is_let_in_to_a_demo_before_and_after_a_device_is_connected(folder: Folder, tmp_path: Path) -> None:
    with started(tmp_path, "--itself", "--with-token") as studio:
        check_who_is_let_in(studio, {NOBODY, RIGHT})
        device = f"127.0.0.1:{folder.process.end_points['tcp']['port']}"
        assert '"ok": {"controller": "real"}' in post(studio, "connect", studio.token, address=device, name="real")[1]
        check_who_is_let_in(studio, {RIGHT})


def test_who_is_let_in_where_others_reach_it(tmp_path: Path) -> None:
    with started(tmp_path, "--http", "0.0.0.0:0", "--remote") as studio:
        check_who_is_let_in(studio, {RIGHT})


def test_all_requests_are_behind_the_same_door(folder: Folder) -> None:
    """Also those that are not in the tables above."""
    paths = json.loads(request(folder.process, "GET", "/openapi.json", None)[1])["paths"]
    assert len(paths) > 80
    asked = [(method.upper(), path) for path, methods in paths.items() for method in methods]
    let_in = {path for method, path in asked if request(folder.process, method, path, None, "{}")[0] != NO_TOKEN}
    assert let_in == {"/api/do/stop", "/api/do/stop_all"}


# ---------------------------------------------------------------------- the token


def test_the_token_is_in_a_file_and_nowhere_else(folder: Folder) -> None:
    """It is the same after a restart; neither output nor ready file nor command line has it."""
    process = folder.process
    path = Path(process.environment["XDG_STATE_HOME"]) / "steptwin/tokens"
    assert path.stat().st_mode & 0o777 == 0o600
    assert f"{process.url}/ (tokens: {path})" in process.output
    shown = [process.output, process.ready_file.read_text(), Path(f"/proc/{process.process.pid}/cmdline").read_text()]
    texts = [line.split()[2] for line in path.read_text().splitlines() if not line.startswith("#")]
    assert len({*texts}) == 3
    assert not any(text in one for text in texts for one in shown)


def test_own_tokens_are_made_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    path, made = own_tokens()
    assert [token.role for token in made] == [Role.ENGINEER, Role.OPERATOR, Role.VIEWER]
    assert own_tokens() == (path, made)
    assert [one.name for one in path.parent.iterdir()] == ["tokens"]
    path.chmod(0o644)
    with pytest.raises(Misuse, match=f"chmod 600 {path}"):
        own_tokens()
    monkeypatch.setenv("XDG_STATE_HOME", str(path))
    with pytest.raises(Misuse, match=r"cannot be kept in .* give --tokens FILE, or --open-to-local-users"):
        own_tokens()


def test_the_printed_address_has_the_token_or_names_its_file(monkeypatch: pytest.MonkeyPatch) -> None:
    """The page says so where it asks for one; a token itself is shown on a terminal only."""
    token = Token(Role.ENGINEER, "anna", "anna-0123456789abcdef")
    access = AccessInfo(DEFAULT, None, (token,), Path("tokens"), Role.ENGINEER, is_demo=False)
    url = "http://127.0.0.1:8488/"
    for is_terminal, text in ((True, f"{url}#token={token.text}"), (False, f"{url} (tokens: tokens)")):
        monkeypatch.setattr("sys.stdout", io.StringIO())
        monkeypatch.setattr("sys.stdout.isatty", lambda is_terminal=is_terminal: is_terminal)
        assert access.place(url) == text
        assert replace(access, is_demo=True).place(url) == f"{url} (devices: tokens in tokens)"
    assert replace(access, tokens=(), file=None).place(url) == url


def test_the_browser_gets_the_token_in_a_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is handed over on no command line, and the file goes with the studio."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    opened: Queue[str] = Queue()
    monkeypatch.setattr("webbrowser.open", opened.put)
    page = OpenedPage("http://127.0.0.1:8488/#token=a&b", is_secret=True, port=8488)
    path = Path(url2pathname(opened.get(timeout=60).removeprefix("file://")))
    assert path.stat().st_mode & 0o777 == 0o600
    assert path.parent.stat().st_mode & 0o777 == 0o700
    assert 'content="0; url=http://127.0.0.1:8488/#token=a&amp;b"' in path.read_text()
    page.close()
    assert not path.exists()
