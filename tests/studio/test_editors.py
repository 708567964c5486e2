"""The editor server over a WebSocket, asked by an independent client."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest
from tests.studio.conftest import Process
from tokens import tokens_file
from websockets.exceptions import ConnectionClosed, InvalidStatus

Start = Callable[..., Process]
CAPABILITIES = {"textDocument": {"publishDiagnostics": {"versionSupport": True}}}
PROGRAM, TABLE = "steptwin:///table/program-0.prg", "steptwin:///table/positions-0.csv"


class Editor:
    """A client of the Language Server Protocol."""

    def __init__(self, studio: Process, token: str | None = None) -> None:
        self.socket = studio.connect("/editor")
        self.socket.send(json.dumps({"do": "hello"} | ({} if token is None else {"token": token})))
        assert json.loads(self.socket.recv(60)) == {"ok": None}
        self.notified: list[dict[str, Any]] = []
        self.capabilities = self.ask("initialize", processId=None, rootUri=None, capabilities=CAPABILITIES)["capabilities"]
        self.notify("initialized")

    def notify(self, method: str, **params: object) -> None:
        self.socket.send(json.dumps({"jsonrpc": "2.0", "method": method, "params": params}))

    def ask(self, method: str, **params: object) -> Any:
        self.socket.send(json.dumps({"jsonrpc": "2.0", "id": 1, "method": method, "params": params}))
        while True:
            message = json.loads(self.socket.recv(60))
            if "method" not in message:
                assert "error" not in message, message
                return message["result"]
            self.notified.append(message)

    def open(self, uri: str, language: str, text: str) -> None:
        self.notify("textDocument/didOpen", textDocument={"uri": uri, "languageId": language, "version": 1, "text": text})

    def diagnostics(self, uri: str, version: int) -> list[dict[str, Any]]:
        """Those of a version, as they are pushed."""
        while True:
            for message in self.notified:
                params = message["params"]
                if message["method"].endswith("publishDiagnostics") and (params["uri"], params.get("version")) == (uri, version):
                    return params["diagnostics"]
            message = json.loads(self.socket.recv(60))
            if "method" in message:
                self.notified.append(message)


def test_texts_of_a_controller_know_each_other(start_studio: Start) -> None:
    editor = Editor(start_studio())
    editor.open(TABLE, "mic488-positions", "HOME;1;2;x;x\nPICK;3;4;x;x\n")
    editor.open(PROGRAM, "wbc", "MOVEPTP @PICKS\n")
    found = editor.diagnostics(PROGRAM, 1)
    assert [one["severity"] for one in found] == [1]
    assert "PICKS" in found[0]["message"]
    at = {"textDocument": {"uri": PROGRAM}, "position": {"line": 0, "character": 9}}
    assert [item["label"] for item in editor.ask("textDocument/completion", **at)["items"]] == ["HOME", "PICK"]
    whole = {"text": "M1 = ON\nMOVEPTP @PICK\n"}
    editor.notify("textDocument/didChange", textDocument={"uri": PROGRAM, "version": 2}, contentChanges=[whole])
    assert not [one for one in editor.diagnostics(PROGRAM, 2) if one["severity"] == 1]
    place = {"textDocument": {"uri": PROGRAM}, "position": {"line": 1, "character": 10}}
    edits = editor.ask("textDocument/rename", **place, newName="TAKE")["changes"]
    assert {uri: [edit["newText"] for edit in found] for uri, found in edits.items()} == {PROGRAM: ["TAKE"], TABLE: ["TAKE"]}


def test_a_text_is_looked_at_with_the_type_of_its_controller(start_studio: Start) -> None:
    """The drum of the demo machine is an M1486B, which has 80 labels; an M1486A has 15."""
    editor = Editor(start_studio("--demo"))
    for controller, severities in (("drum", []), ("other", [1, 1])):
        uri = f"steptwin:///{controller}/program.m1486"
        editor.open(uri, "m1486", "@20\nw1000\nj20\n")
        assert [one["severity"] for one in editor.diagnostics(uri, 1) if one["severity"] == 1] == severities


def test_files_of_the_machine_are_not_read(start_studio: Start) -> None:
    studio = start_studio()
    editor = Editor(studio)
    editor.open((studio.directory / "other.prg").as_uri(), "wbc", "MOVEPTP @PICK\n")
    (studio.directory / "other.csv").write_text("PICK;1;2;3;4\n")
    found = editor.diagnostics((studio.directory / "other.prg").as_uri(), 1)
    assert "table" in found[0]["message"]


def test_who_has_no_token_is_refused(start_studio: Start, tmp_path_factory: pytest.TempPathFactory) -> None:
    tokens = tokens_file(tmp_path_factory.mktemp("tokens"), "viewer hall viewer-0123456789\n")
    studio = start_studio("--tokens", str(tokens))
    for hello in ('{"do": "hello"}', '{"do": "hello", "token": "viewer-0123456780"}', '{"do": "describe"}', "nonsense", "[]"):
        socket = studio.connect("/editor")
        socket.send(hello)
        assert json.loads(socket.recv(60))["error"]["code"] in ("refusal", "misuse")
        with pytest.raises(ConnectionClosed):
            socket.recv(60)
        assert socket.close_code == 4401
    assert Editor(studio, "viewer-0123456789").capabilities["hoverProvider"]


def test_pages_of_other_sites_are_refused(start_studio: Start) -> None:
    studio = start_studio()
    with pytest.raises(InvalidStatus, match="403"):
        studio.connect("/editor", origin="http://example.org")
    with pytest.raises(InvalidStatus, match="404"):
        studio.connect("/other")


@pytest.mark.parametrize(
    ("message", "why"),
    [
        ("nonsense", "no message of the protocol"),
        ("[]", "a message is an object of JSON"),
        (b"binary", "this one is binary"),
    ],
)
def test_what_is_no_message_ends_the_connection(start_studio: Start, message: str | bytes, why: str) -> None:
    editor = Editor(start_studio())
    editor.socket.send(message)
    assert why in json.loads(editor.socket.recv(60))["error"]["message"]
    with pytest.raises(ConnectionClosed):
        editor.socket.recv(60)


def test_a_request_with_wrong_parameters_is_answered_and_the_connection_goes_on(start_studio: Start) -> None:
    editor = Editor(start_studio())
    editor.socket.send('{"jsonrpc": "2.0", "id": "odd", "method": "textDocument/hover", "params": 5}')
    answer = json.loads(editor.socket.recv(60))
    assert answer["id"] == "odd"
    assert answer["error"]["message"] == "textDocument/hover: its parameters are not those of the protocol"
    editor.open(PROGRAM, "wbc", "ED\n")
    assert editor.diagnostics(PROGRAM, 1)


def test_a_client_that_says_exit_does_not_end_the_studio(start_studio: Start) -> None:
    studio = start_studio()
    editor = Editor(studio)
    editor.ask("shutdown")
    editor.notify("exit")
    other = Editor(studio)
    other.open(PROGRAM, "wbc", "ED\n")
    assert other.diagnostics(PROGRAM, 1)
    assert studio.process.poll() is None
