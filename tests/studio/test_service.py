"""The service as a process, asked by independent clients: httpx, websockets, a Modbus master."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest
from pymodbus.client import ModbusTcpClient
from tests.conftest import until
from tests.peers.conftest import Master
from tests.studio.conftest import Process, StudioWorld
from tests.support.studio_rig import check_answer, check_message
from tokens import tokens_file
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection

from steptwin.controller import MILLISECOND
from steptwin.files.recording import recording_of, save
from steptwin.files.world import World
from steptwin.simulation.script.steps import Set
from steptwin.subject.commands import VERSION
from steptwin.subject.dispatch import LONGEST_REQUEST

Start = Callable[..., Process]


class Page:
    """A viewer over a WebSocket."""

    def __init__(self, socket: ClientConnection, **hello: object) -> None:
        self.socket = socket
        self.pushed: list[dict[str, Any]] = []
        self.answer = self.ask("hello", version=VERSION, **hello)

    def ask(self, name: str, /, **fields: object) -> dict[str, Any]:
        self.socket.send(json.dumps({"do": name, "id": name, **fields}))
        while True:
            message = self.next()
            if "seq" not in message:
                check_answer(name, message)
                return message

    def ok(self, name: str, /, **fields: object) -> Any:
        answer = self.ask(name, **fields)
        assert "ok" in answer, answer
        return answer["ok"]

    def next(self, timeout: float = 60.0) -> dict[str, Any]:
        message = json.loads(self.socket.recv(timeout))
        check_message(message)
        if "seq" in message:
            self.pushed.append(message)
        return message

    def wait_for(self, member: str, condition: Callable[[Any], bool] = lambda _: True) -> Any:
        """The first content of a kind of message for which a condition holds."""
        for _ in range(1000):
            found = [message[member] for message in self.pushed if member in message and condition(message[member])]
            if found:
                return found[0]
            self.next()
        raise AssertionError(f"no {member}")


def page(studio: Process, **hello: object) -> Page:
    return Page(studio.connect(), **hello)


# ---------------------------------------------------------------------- requests


def test_a_page_says_hello_watches_follows_and_moves(start_studio: Start) -> None:
    studio = start_studio()
    page(studio, name="Anna")
    viewer = page(studio, name="Piotr")
    whole = viewer.wait_for("hello")
    assert (whole["description"]["name"], whole["viewers"], whole["role"]) == ("hall", 2, "engineer")
    viewer.ok("watch", points=["table.M1.position"], rate=30)
    viewer.ok("subscribe", id=1, kinds=["plan"])
    viewer.ok("enable", controller="table", axis=1)
    viewer.ok("move", controller="table", axis=1, to=3)
    assert viewer.wait_for("control") == {"viewer": whole["viewer"], "name": "Piotr"}
    viewer.wait_for("events", lambda events: events[-1]["plan"]["final"] == 300.0)
    viewer.wait_for("values", lambda values: values.get("1", [[0, None]])[0][1] == 3.0)
    viewer.wait_for("clock")


def test_it_moves_what_an_independent_master_sees(start_studio: Start) -> None:
    studio = start_studio()
    port = studio.end_points["tcp"]["port"]
    with ModbusTcpClient("127.0.0.1", port=port) as modbus, httpx.Client(base_url=studio.url) as client:
        master = Master(modbus, 1)
        assert client.post("/api/do/enable", json={"controller": "table", "axis": 1}).json()["ok"] is None
        assert client.post("/api/do/move", json={"controller": "table", "axis": 1, "to": 2.5}).status_code == 200
        assert master.follow(1, 3)[-1][2:] == (2.5, 0.0, 4)
        points = client.get("/api/points", params={"names": "table.M1.position,time"}).json()["ok"]
        assert [(one["point"], one["unit"]) for one in points] == [("table.M1.position", "mm"), ("time", "s")]
        assert points[0]["value"] == 2.5
        assert set(client.get("/api/state").json()["ok"]) == {"table", "drum"}
        assert client.get("/api/state", params={"controller": "drum"}).json()["ok"]
        refused = client.get("/api/state", params={"machine": "drum"})
        assert (refused.status_code, refused.json()["error"]["message"]) == (
            400,
            "/api/state: unknown parameter 'machine'; permitted: controller",
        )
        assert client.get("/api/describe").json()["ok"]["name"] == "hall"


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Any:
    process = Process(tmp_path_factory.mktemp("studio"), StudioWorld()).wait_until_ready()
    yield process
    try:
        process.end()
    finally:
        process.close()


@pytest.mark.parametrize(
    ("path", "body", "status", "message"),
    [
        ("/api/do/move", b'{"controller": "table", "axis": 1, "to": "x"}', 400, "to: 'x': expected a number"),
        ("/api/do/move", b"{", 400, "a body is an object of JSON"),
        ("/api/do/move", b"[1]", 400, "a body is an object of JSON"),
        ("/api/do/move", b"[" * 60_000, 400, "a body is an object of JSON"),
        ("/api/do/move", b'{"do": "stop"}', 400, "no field 'do'"),
        ("/api/do/move", b"x" * (LONGEST_REQUEST + 1), 413, f"a body has at most {LONGEST_REQUEST} bytes"),
        ("/api/do/state", b'{"controller": "tabel"}', 400, "did you mean 'table'?"),
        ("/api/do/jog", b'{"controller": "table", "axis": 2, "velocity": 1}', 409, "not enabled"),
        ("/api/do/resume", b'{"speed": "max"}', 400, "--speed max"),
    ],
)
def test_what_is_wrong_is_named_with_its_status(shared: Process, path: str, body: bytes, status: int, message: str) -> None:
    answer = httpx.post(f"{shared.url}{path}", content=body)
    assert (answer.status_code, answer.json()["error"]["code"]) == (status, "refusal" if status == 409 else "misuse")
    assert message in answer.json()["error"]["message"]
    check_message(answer.json())


def test_there_is_no_request_about_a_connection_over_rest(shared: Process) -> None:
    described = httpx.get(f"{shared.url}/openapi.json").json()["paths"]
    assert described["/api/do/move"]["post"]["operationId"] == "move"
    assert described["/api/do/move"]["post"]["description"].endswith(" Role operator, and control.")
    lease = described["/api/do/jog"]["post"]["responses"]["200"]["content"]["application/json"]["schema"]["properties"]["ok"]
    assert lease["required"] == ["lease", "lasts_ms"]
    for name in ("subscribe", "unsubscribe", "watch", "unwatch", "hello", "resync"):
        assert f"/api/do/{name}" not in described
        assert httpx.post(f"{shared.url}/api/do/{name}", json={}).status_code in (404, 405)


# ---------------------------------------------------------------------- access


@pytest.mark.parametrize(
    "headers",
    [{"host": "evil.example"}, {"host": "evil.example:8488"}, {"origin": "http://evil.example"}, {"origin": "null"}],
)
def test_other_sites_are_refused(shared: Process, headers: dict[str, str]) -> None:
    for path in ("/", "/api/describe"):
        answer = httpx.get(f"{shared.url}{path}", headers=headers)
        assert (answer.status_code, answer.json()["error"]["code"]) == (403, "refusal")
    with pytest.raises(InvalidStatus) as refused:
        shared.connect(additional_headers={"Origin": "http://evil.example"})
    assert refused.value.response.status_code == 403


def test_the_own_origin_may_open_a_websocket_and_only_there_is_one(shared: Process) -> None:
    shared.connect(origin=shared.url).close()
    from websockets.sync.client import connect

    with pytest.raises(InvalidStatus) as refused, connect(f"{shared.url.replace('http', 'ws')}/other"):
        pass
    assert refused.value.response.status_code == 404


@pytest.mark.parametrize(
    ("request_", "is_answered"),
    [
        (b"POST /api/do/read HTTP/1.1\r\nHost: HERE\r\nContent-Length: 9\r\n\r\n{", False),
        (b"POST /api/do/read HTTP/1.1\r\nHost: HERE\r\nTransfer-Encoding: chunked\r\n\r\n2\r\n{", False),
        (b"GET / HTTP/1.1\r\nHost: HERE\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n", True),
        (b"POST /api/do/read HTTP/1.1\r\nHost: HERE\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n", True),
    ],
)
def test_a_client_that_goes_away_in_the_middle_is_no_internal_error(shared: Process, request_: bytes, is_answered: bool) -> None:
    port = shared.end_points["http"]["port"]
    with socket.create_connection(("127.0.0.1", port)) as client:
        client.sendall(request_.replace(b"HERE", f"127.0.0.1:{port}".encode()))
        if is_answered:
            assert client.recv(100).startswith(b"HTTP/1.1 ")
        client.shutdown(socket.SHUT_WR)
        while client.recv(10_000):
            pass
    assert httpx.get(f"{shared.url}/api/describe").status_code == 200
    assert "internal error" not in shared.output + shared.errors


def test_the_page_comes_with_its_headers(shared: Process) -> None:
    answer = httpx.get(f"{shared.url}/")
    assert answer.status_code == 200
    assert answer.headers["content-type"] == "text/html; charset=utf-8"
    policy = answer.headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert answer.headers["cache-control"] == "no-cache"
    for path in ("/nothing", "/../pyproject.toml", "/%2e%2e/service.py", "/assets/../../service.py"):
        assert httpx.get(f"{shared.url}{path}").status_code == 404


def tokens(directory: Path) -> dict[str, str]:
    text = {role: f"{role}-0123456789abcdef" for role in ("viewer", "operator", "engineer")}
    tokens_file(directory, "".join(f"{role} {role} {token}\n" for role, token in text.items()))
    return text


def test_where_tokens_are_asked_for_they_give_roles(start_studio: Start, tmp_path: Path) -> None:
    token = tokens(tmp_path)
    studio = start_studio("--tokens", str(tmp_path / "tokens"), "--audit", str(tmp_path / "audit"))
    move = {"controller": "table", "axis": 1, "on": True}

    def post(name: str, role: str | None) -> int:
        headers = {} if role is None else {"authorization": f"Bearer {token.get(role, role)}"}
        return httpx.post(f"{studio.url}/api/do/{name}", json=move if name == "enable" else {}, headers=headers).status_code

    assert [post("enable", role) for role in (None, "wrong", "viewer", "operator")] == [401, 401, 403, 200]
    assert [post("power_cycle", role) for role in ("viewer", "engineer")] == [400, 400]  # without a machine
    assert [post("audit", role) for role in ("operator", "engineer")] == [403, 200]
    assert post("stop_all", "viewer") == 200
    assert httpx.get(f"{studio.url}/api/describe").status_code == 401
    with contextlib.closing(studio.connect()) as socket:
        socket.send('{"do": "hello", "version": 2, "token": "wrong"}')
        assert json.loads(socket.recv())["error"]["message"] == "wrong token"
        with pytest.raises(ConnectionClosed) as closed:
            socket.recv()
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == 4401
    viewer = page(studio, token=token["viewer"])
    assert viewer.answer["ok"]["role"] == "viewer"
    viewer.socket.close()
    entries = [json.loads(line) for line in (tmp_path / "audit").read_text().splitlines()]
    assert [(one["role"], one["do"], one["outcome"]) for one in entries] == [
        ("viewer", "enable", "refusal"),
        ("operator", "enable", "done"),
        ("operator", "audit", "refusal"),
        ("engineer", "audit", "done"),
        ("viewer", "stop_all", "done"),
    ]
    assert (tmp_path / "audit").stat().st_mode & 0o077 == 0


def test_others_reach_it_only_where_that_is_permitted_and_with_a_token(start_studio: Start) -> None:
    studio = start_studio("--http", "0.0.0.0:0", "--remote")
    port = studio.end_points["http"]["port"]
    url = f"http://127.0.0.1:{port}"
    assert httpx.get(f"{url}/api/describe").status_code == 401
    token = studio.token
    assert token not in studio.output
    answer = httpx.get(f"{url}/api/describe", headers={"authorization": f"Bearer {token}"})
    assert answer.status_code == 200
    assert httpx.get(f"{url}/", headers={"host": f"evil.example:{port}"}).status_code == 403


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--http", "0.0.0.0:0"), "others can reach this address"),
        (("--http", "nowhere"), "'nowhere' is not an address"),
        (("--remote",), "--remote permits an --http address that others can reach, but 127.0.0.1:8488 is none"),
        (("--certificate", "c.pem"), "--certificate and --key go together"),
        (("--tokens", "/nowhere/tokens"), "/nowhere/tokens"),
        (("--http", "0.0.0.0:0", "--remote", "--open-to-local-users"), "--open-to-local-users is for an --http address of this"),
        (("--tokens", "t", "--open-to-local-users"), "--open-to-local-users and --tokens exclude each other"),
        (("--view",), "--view shows one recording (.json)"),
        (("--view", "machine.toml"), "machine.toml: --view shows a recording (.json)"),
        (("--view", "s.json", "--speed", "2"), "--speed is not for a recording that is only viewed"),
    ],
)
def test_options_that_do_not_go_together_are_named(options: tuple[str, ...], message: str, tmp_path: Path) -> None:
    from tests.conftest import run_command

    ran = run_command(["studio", *options], {**os.environ, "XDG_STATE_HOME": str(tmp_path)})
    assert ran.returncode == 2, ran.stderr
    assert message in ran.stderr


def test_the_next_free_port_is_taken_and_named(start_studio: Start, monkeypatch: pytest.MonkeyPatch) -> None:
    from steptwin.errors import LineFailure
    from steptwin.httpservice import listen
    from steptwin.live.studio import start as command
    from steptwin.simulation.toml.addresses import Address

    assert Address("127.0.0.1", 8488) == command.DEFAULT
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with listen(Address("127.0.0.1", port), is_fixed=False) as found:
            assert port < found.getsockname()[1] < port + 20
        with pytest.raises(LineFailure, match=f"cannot listen on 127.0.0.1:{port}"):
            listen(Address("127.0.0.1", port), is_fixed=True)


# ---------------------------------------------------------------------- hostile and slow


def test_hostile_messages_end_in_an_error_or_the_end_of_the_connection(shared: Process) -> None:
    for data in ("", "[" * 60_000, '{"do":"hello"}' * 100, b"\x00\xff", '{"do": "hello", "id": {}}', "null"):
        with contextlib.closing(shared.connect()) as socket:
            socket.send(data)
            answer = json.loads(socket.recv())
            check_message(answer)
            assert answer["error"]["code"] == "misuse"
    with contextlib.closing(shared.connect()) as socket:
        socket.send("x" * (LONGEST_REQUEST + 1))
        with pytest.raises(ConnectionClosed):
            socket.recv()
    viewer = page(shared)
    assert viewer.ok("time")
    viewer.socket.close()


def test_who_reads_nothing_slows_nobody(shared: Process) -> None:
    with contextlib.closing(socket.create_connection(("127.0.0.1", shared.end_points["http"]["port"]))) as silent:
        silent.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        host = shared.url.removeprefix("http://")
        silent.sendall(
            f"GET /ws HTTP/1.1\r\nHost: {host}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
        )
        assert b"101" in silent.recv(4096)
        for text in ('{"do":"hello","version":2}', '{"do":"subscribe","id":1}', '{"do":"watch","points":["time"],"rate":30}'):
            data = text.encode()
            mask = b"\0\0\0\0"
            silent.sendall(bytes([0x81, 0x80 | len(data)]) + mask + data)
        viewer = page(shared)
        began = time.monotonic()
        for n in range(200):
            viewer.ok("note", text=str(n))
        assert time.monotonic() - began < 60  # it is served at all
        viewer.socket.close()


# ---------------------------------------------------------------------- jogs


class Cable:
    """Forwards a connection to a port, until it is cut: then nothing passes, and no end is told."""

    def __init__(self, port: int) -> None:
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        self._cut = threading.Event()
        self._ends = [socket.create_connection(("127.0.0.1", port))]
        threading.Thread(target=self._join, daemon=True).start()

    def _join(self) -> None:
        self._ends.append(self._listener.accept()[0])
        for here, there in (self._ends, self._ends[::-1]):
            threading.Thread(target=self._carry, args=(here, there), daemon=True).start()

    def _carry(self, here: socket.socket, there: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while (data := here.recv(65_536)) and not self._cut.is_set():
                there.sendall(data)

    def cut(self) -> None:
        self._cut.set()

    def close(self) -> None:
        for end in (*self._ends, self._listener):
            end.close()


JOGGING = """
import json, socket, sys
from websockets.sync.client import connect

cable = socket.create_connection(("127.0.0.1", int(sys.argv[2])))
studio = connect(sys.argv[1], sock=cable, max_size=None).__enter__()


def ask(**message):
    studio.send(json.dumps({**message, "id": message["do"]}))
    while True:
        answer = json.loads(studio.recv())
        if answer.get("id") == message["do"]:
            return answer.get("ok")


def jog():
    return ask(do="jog", controller="table", axis=1, velocity=20)


ask(do="hello", version=2)
ask(do="enable", controller="table", axis=1)
lease = jog()
import time
while True:
    print("renewed", flush=True)
    time.sleep(lease["lasts_ms"] / 3000)
    lease = ask(do="renew", lease=lease["lease"]) or jog()  # a busy computer may be late
"""


@pytest.mark.parametrize("fate", ["stopped", "killed", "cut off"])
def test_an_axis_stands_in_time_when_the_page_is_gone(start_studio: Start, fate: str) -> None:
    studio = start_studio()
    watcher = page(studio)
    watcher.ok("subscribe", id="plans", kinds=["plan"], controllers=["table"], axes=["1"])
    cable = Cable(studio.end_points["http"]["port"])
    url = f"{studio.url.replace('http', 'ws', 1)}/ws"
    jogging = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(JOGGING), url, str(cable.port)], stdout=subprocess.PIPE, text=True
    )
    try:
        assert jogging.stdout is not None
        for _ in range(20):
            assert jogging.stdout.readline() == "renewed\n"
        until(lambda: watcher.ok("read", points=["table.M1.velocity"])[0]["value"] == 20.0, "the axis runs")
        match fate:
            case "cut off":
                cable.cut()
            case "stopped":
                jogging.send_signal(signal.SIGSTOP)
            case "killed":
                jogging.kill()
        watcher.ask("time")  # with it, what was sent before is done
        gone = int(watcher.ask("time")["time_ns"])  # no renewal comes later
        until(lambda: watcher.ok("read", points=["table.M1.velocity"])[0]["value"] == 0.0, "the axis stands")
        watcher.wait_for("leases", lambda leases: leases == [])
        watcher.ask("time")
        plans = [e for message in watcher.pushed for e in message.get("events", ()) if e["kind"] == "plan"]
        last = plans[-1]["plan"]
        ends_ns = int(last["start_ns"]) + round((last["segments"][-1][0] if last["segments"] else 0) * 1e9)
        assert ends_ns <= gone + 300 * MILLISECOND
        assert watcher.ok("read", points=["table.M1_VMAX"])[0]["value"] == 40.0
    finally:
        jogging.kill()
        jogging.wait()
        jogging.stdout.close()
        cable.close()
    watcher.socket.close()


def test_the_time_of_the_world_stands_with_the_process_and_a_jog_ends_afterwards(start_studio: Start) -> None:
    """A service that is stopped holds its world up with it."""
    studio = start_studio()
    viewer = page(studio)
    viewer.ok("enable", controller="table", axis=1)
    viewer.ok("jog", controller="table", axis=1, velocity=20)
    began = int(viewer.ask("time")["time_ns"])
    studio.process.send_signal(signal.SIGSTOP)
    time.sleep(1.2)
    studio.process.send_signal(signal.SIGCONT)
    until(lambda: viewer.ok("read", points=["table.M1.velocity"])[0]["value"] == 0.0, "the axis stands")
    assert viewer.ok("read", points=["table.M1.position"])[0]["value"] <= 20 * 0.3
    assert int(viewer.ask("time")["time_ns"]) > began
    viewer.socket.close()


def test_the_demo_machine_is_shown_without_a_file(start_studio: Start) -> None:
    for port in (5020, 5021, 5022):
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                pytest.skip(f"port {port} is in use here")
    studio = start_studio("--itself")
    described = httpx.get(f"{studio.url}/api/describe").json()["ok"]
    assert [one["name"] for one in described["controllers"]] == ["table", "drum", "shuttle"]
    assert studio.end_points["tcp"]["port"] in (5020, 5022)
    assert "Modbus TCP, bus    127.0.0.1:5020" in studio.output
    assert f"studio             {studio.url}/" in studio.output
    until(lambda: httpx.get(f"{studio.url}/api/points?names=table.M3.moving").json()["ok"][0]["value"] == 1.0, "it works")


def test_a_recorded_session_is_shown_and_nobody_changes_it(start_studio: Start, tmp_path: Path) -> None:
    text = '[[mic488]]\nname = "table"\nline = "bus"\n[[line]]\nname = "bus"\nkind = "modbus"\ntcp = "127.0.0.1:0"\n'
    world = World.from_toml(text)
    world.run(for_="2s")
    world.apply_input(Set((("table", "IN3", 1.0),)))
    world.run(for_="3s")
    save(recording_of(world), tmp_path / "s.json")
    tokens = tokens_file(tmp_path, "engineer anna anna-0123456789abcdef\n")
    studio = start_studio("--itself", str(tmp_path / "s.json"), "--view", "--tokens", str(tokens))
    assert list(studio.end_points) == ["http"]
    seen = page(studio, token="anna-0123456789abcdef")
    assert seen.answer["ok"]["role"] == "viewer"
    assert [one["value"] for one in seen.ok("read", points=["time", "table.IN3"])] == [5.0, 1.0]
    assert seen.ok("show_moment", to_ns="1000000000") == {"time_ns": "1000000000", "from_ns": "0"}
    assert [one["value"] for one in seen.ok("read", points=["time", "table.IN3"])] == [1.0, 0.0]
    seen.ok("show_moment")
    assert seen.ask("resume")["error"]["message"] == "resume is for the role operator; anna has the role viewer"
