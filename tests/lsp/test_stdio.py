"""The editor server on two streams: headers, the end of a session, requests that are cancelled."""

from __future__ import annotations

import asyncio
import json
import threading
from io import BytesIO
from typing import Any

import pytest

from steptwin.baseprotocol import message_bytes
from steptwin.lsp.editorserver import EditorServer
from steptwin.lsp.stdio import serve

INITIALIZE = {"id": 1, "method": "initialize", "params": {"processId": None, "rootUri": None, "capabilities": {}}}
SHUTDOWN = {"id": 2, "method": "shutdown"}
EXIT = {"method": "exit"}


def served(given: bytes | BytesIO) -> tuple[int, list[dict[str, Any]]]:
    """The exit code and what was answered."""
    answers = BytesIO()
    code = asyncio.run(serve(BytesIO(given) if isinstance(given, bytes) else given, answers))
    bodies = [part.split(b"\r\n\r\n", 1)[1] for part in answers.getvalue().split(b"Content-Length: ")[1:]]
    return code, [json.loads(body) for body in bodies]


def asked(*messages: dict[str, Any]) -> bytes:
    return b"".join(message_bytes({"jsonrpc": "2.0", **message}) for message in messages)


def test_an_exit_without_a_shutdown_ends_with_code_1() -> None:
    assert served(asked(INITIALIZE, SHUTDOWN, EXIT))[0] == 0
    assert served(asked(INITIALIZE, EXIT))[0] == 1
    assert served(asked(EXIT))[0] == 1


def test_a_second_initialize_is_an_error() -> None:
    _, (first, second, last) = served(asked(INITIALIZE, {**INITIALIZE, "id": 7}, SHUTDOWN, EXIT))
    assert "result" in first
    assert (second["id"], second["error"]["code"]) == (7, -32600)
    assert (last["id"], last["result"]) == (2, None)


def test_a_request_that_is_cancelled_while_it_waits_is_not_begun(monkeypatch: pytest.MonkeyPatch) -> None:
    symbols = [{"id": number, "method": "workspace/symbol", "params": {"query": ""}} for number in (5, 6, 5)]
    cancel = {"method": "$/cancelRequest", "params": {"id": 5}}
    all_read = threading.Event()

    class Source(BytesIO):
        def read(self, size: int | None = -1, /) -> bytes:
            body = super().read(size)
            if b'"exit"' in body:
                all_read.set()
            return body

    monkeypatch.setattr(EditorServer, "begin", lambda *_: all_read.wait(10))  # a request that takes long
    _, answers = served(Source(asked(INITIALIZE, *symbols[:2], cancel, symbols[2], SHUTDOWN, EXIT)))
    assert [(one["id"], one.get("error", {}).get("code")) for one in answers] == [
        (1, None), (5, -32800), (6, None), (5, None), (2, None)
    ]  # fmt: skip


def test_a_request_that_is_cancelled_while_it_is_answered_is_interrupted(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """What is known of the texts stays, also the files of a machine whose description cannot be read during typing."""
    texts = {"a.prg": "WAITPOS\n", "b.toml": '[[mic488]]\nname = "x"\nline = "y"\nprogram = "a.prg"\n'}
    opened = [
        {"textDocument": {"uri": f"file:///{name}", "languageId": "", "version": 1, "text": text}} for name, text in texts.items()
    ]
    typed = {"textDocument": {"uri": "file:///b.toml", "version": 2}, "contentChanges": [{"text": "x = [\n" + texts["b.toml"]}]}
    hover = {"textDocument": {"uri": "file:///a.prg"}, "position": {"line": 0, "character": 1}}
    requests = [{"id": number, "method": "textDocument/hover", "params": hover} for number in (4, 5, 6)]
    has_begun, found = threading.Event(), []
    answered = EditorServer.analysed

    def analysed(server: EditorServer, uri: str) -> Any:
        made = answered(server, uri)
        found.append((made and made[0], server.session.related(uri)))
        while len(found) == 2:
            has_begun.set()
        return made

    class Source(BytesIO):
        def read(self, size: int | None = -1, /) -> bytes:
            body = super().read(size)
            if b"cancelRequest" in body:
                assert has_begun.wait(10)
            return body

    monkeypatch.setattr(EditorServer, "analysed", analysed)
    given = asked(
        INITIALIZE,
        *({"method": "textDocument/didOpen", "params": one} for one in opened),
        requests[0],
        {"method": "textDocument/didChange", "params": typed},
        requests[1],
        {"method": "$/cancelRequest", "params": {"id": 5}},
        requests[2],
    )
    _, answers = served(Source(given + asked(SHUTDOWN, EXIT)))
    by_number = {one["id"]: one for one in answers if "id" in one}
    assert by_number[5]["error"]["code"] == -32800
    assert "WAITPOS" in by_number[6]["result"]["contents"]["value"]
    assert found[2][0] is found[1][0]
    assert found[2][1] == found[1][1] == ["file:///b.toml"]
    assert caplog.messages == []


@pytest.mark.parametrize(
    ("header", "reason"),
    [
        (b"Content-Length: many\r\n\r\n", "Content-Length 'many': permitted are 0 to 16777216"),
        (b"Content-Length: -5\r\n\r\n", "Content-Length '-5'"),
        (b"Content-Length: 99999999999\r\n\r\n", "Content-Length '99999999999'"),
        (b"GET / HTTP/1.0\r\n\r\n", "header 'GET / HTTP/1.0': expected Content-Length"),
        (b"x: " + b"Content-Length: 5\r\n" * 70, "a line of more than 1000 bytes"),
    ],
)
def test_a_wrong_header_ends_the_session_with_its_reason(header: bytes, reason: str, capsys: pytest.CaptureFixture[str]) -> None:
    given = header.replace(b"\r\n", b" ", 69) if header.startswith(b"x") else header
    code, answers = served(asked(INITIALIZE) + given + asked(SHUTDOWN, EXIT))
    assert (code, len(answers)) == (1, 1)
    assert reason in capsys.readouterr().err


def test_a_body_that_is_not_json_is_answered_and_the_session_goes_on() -> None:
    code, (_, wrong, last) = served(asked(INITIALIZE) + b"Content-Length: 4\r\n\r\n{no}" + asked(SHUTDOWN, EXIT))
    assert (wrong["error"]["code"], last["id"], code) == (-32700, 2, 0)
