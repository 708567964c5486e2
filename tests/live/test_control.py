"""The control endpoint: one line asked, one line answered, whatever is asked."""

from __future__ import annotations

import asyncio
import json
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from control_rig import Desk, answer_to, answers_to, misuse, ok, read_answer, served, turns

from steptwin.live import control
from steptwin.live.control import ControlEndpoint
from steptwin.simulation.toml.addresses import Address
from steptwin.subject.dispatch import FORM

TOKEN_FIRST = 'the first line of a connection is {"token": TOKEN}, with the token of this twin'
FORM_ERROR = {"error": {"code": "misuse", "message": FORM()}}


@pytest.fixture(autouse=True)
def own_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return tmp_path / "steptwin"


@pytest.mark.parametrize(
    ("request_", "answer"),
    [
        (b'{"do": "note", "text": "a"}\n', ok("a")),
        (b'{"do": "note", "text": "a", "id": 7}\n', {"id": 7, **ok("a")}),
        (b'{"do": "note", "text": "a", "id": "x", "version": 2}\n', {"id": "x", **ok("a")}),
        (b'{"do": "note", "text": "refuse", "id": 0}\n', {"id": 0, **misuse("not permitted: 7")}),
        (b'{"do": "note", "text": "deny"}\n', {"error": {"code": "refusal", "message": "not now"}}),
        (b'{"do": "note", "text": "a", "version": 1}\n', misuse("version = 1: this subject has version 2")),
        (b'{"do": "note", "text": "a", "version": true}\n', misuse("version = True: this subject has version 2")),
        (b'{"do": "note", "txt": "a"}\n', misuse("note: no field 'txt' (did you mean 'text'?); fields are text")),
        (b"\n", FORM_ERROR),
        (b"[]\n", FORM_ERROR),
        (b'{"do": []}\n', FORM_ERROR),
        (b'{"say": "note"}\n', FORM_ERROR),
        (b"\xff\xfe\n", FORM_ERROR),
        (b"[" * 60000 + b"\n", FORM_ERROR),
        (b'{"do": "note", "text": "a", "id": %s}\n' % (b"9" * 5000), FORM_ERROR),
        (b'{"do": "turn", "controller": "a", "axis": 1, "counts": NaN}\n', None),
        (b'{"do": "turn", "controller": "a", "axis": 1, "counts": 1e999}\n', None),
        (b"x" * 1_048_577, misuse("a request has at most 1048576 bytes")),
    ],
)
def test_whatever_is_asked_is_answered(request_: bytes, answer: Any) -> None:
    found = served(lambda endpoint: answer_to(endpoint, request_))
    assert found == answer if answer is not None else found["error"]["code"] == "misuse"


@pytest.mark.parametrize("identity", [True, 1.5, [], {}, "", "x" * 201, "a\nb", 2**63, -(2**63)])
def test_what_is_no_id(identity: object) -> None:
    line = json.dumps({"do": "note", "text": "a", "id": identity}).encode() + b"\n"
    found = served(lambda endpoint: answer_to(endpoint, line))
    assert found["error"]["message"].endswith("expected a text of at most 200 characters, or a whole number below 2^63")


def test_requests_of_one_connection_are_answered_in_order() -> None:
    lines = b"".join(b'{"do": "note", "text": "a", "id": %d}\n' % n for n in range(500))
    found = served(lambda endpoint: answers_to(endpoint, lines[:1000], lines[1000:1001], lines[1001:]))
    assert found == [{"id": n, **ok("a", n + 1)} for n in range(500)]


def test_a_wrong_request_does_not_end_a_connection() -> None:
    lines = b'nonsense\n{"do": "fly"}\n{"do": "note", "text": "a"}\n'
    first, second, third = served(lambda endpoint: answers_to(endpoint, lines))
    assert first == FORM_ERROR
    assert second["error"]["message"].startswith("no command 'fly'; commands are describe, ")
    assert third == ok("a")


def test_an_exception_of_a_subject_is_an_answer_and_told_to_the_loop() -> None:
    told: list[dict[str, Any]] = []

    async def play(endpoint: ControlEndpoint) -> Any:
        asyncio.get_running_loop().set_exception_handler(lambda _, context: told.append(context))
        return await answer_to(endpoint, b'{"do": "note", "text": "break", "id": 1}\n')

    message = "internal error, please report it: KeyError: 'x'"
    assert served(play) == {"id": 1, "error": {"code": "internal", "message": message}}
    assert [repr(context["exception"]) for context in told] == ["KeyError('x')"]


def test_a_request_that_ends_early_is_answered() -> None:
    found = served(lambda endpoint: answer_to(endpoint, b'{"do": "note"}'))
    assert found["error"]["message"].startswith("the request has no end of line")


def test_half_a_request_is_dropped_after_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(control, "TIMEOUT_S", 0.02)

    async def play(endpoint: ControlEndpoint) -> Any:
        reader, writer = await asyncio.open_unix_connection(str(endpoint.path))
        writer.write(b'{"do": "note", "text": "a"}\n{"do": ')
        lines = (await reader.read()).splitlines()
        writer.close()
        return [read_answer(line) for line in lines]

    first, second = served(play)
    assert first == ok("a")
    assert second["error"]["message"].startswith("no complete request within 0.02 s")


def test_who_has_asked_may_be_silent_for_as_long_as_he_likes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(control, "TIMEOUT_S", 0.01)

    async def play(endpoint: ControlEndpoint) -> Any:
        reader, writer = await asyncio.open_unix_connection(str(endpoint.path))
        found = []
        for _ in range(2):
            writer.write(b'{"do": "note", "text": "a"}\n')
            found.append(read_answer(await reader.readline()))
            await asyncio.sleep(0.05)
        writer.close()
        return found

    assert served(play) == [ok("a", 1), ok("a", 2)]


def test_a_request_in_pieces() -> None:
    assert served(lambda endpoint: answer_to(endpoint, b'{"do": ', b'"note", "text"', b': "a"}\n')) == ok("a")


# ---------------------------------------------------------------------- following


async def until(holds: Callable[[], bool]) -> None:
    """Let the loop go on until something holds."""
    async with asyncio.timeout(10):
        while not holds():  # noqa: ASYNC110  the endpoint signals nothing
            await asyncio.sleep(0.001)


async def subscription(endpoint: ControlEndpoint, **fields: object) -> tuple[asyncio.StreamReader, asyncio.StreamWriter, Any]:
    reader, writer = await asyncio.open_unix_connection(str(endpoint.path))
    writer.write(json.dumps({"do": "subscribe", "id": "e", **fields}).encode() + b"\n")
    return reader, writer, read_answer(await reader.readline())


async def next_of(reader: asyncio.StreamReader) -> Any:
    return read_answer(await asyncio.wait_for(reader.readline(), 60))


def test_events_come_after_the_answer_with_its_id_until_they_are_not_wanted_any_more() -> None:
    async def play(endpoint: ControlEndpoint, desk: Desk) -> None:
        reader, writer, answer = await subscription(endpoint)
        assert answer["id"] == "e"
        (plan,) = answer["ok"]["plans"]
        assert (plan["kind"], plan["plan"]["base"]) == ("plan", 7)
        desk.happen(2)
        found = [await next_of(reader) for _ in range(2)]
        assert [(one["id"], one["event"]["number"]) for one in found] == [("e", 0), ("e", 1)]
        assert "missed" not in found[0]
        writer.write(b'{"do": "unsubscribe", "subscription": "e", "id": 2}\n')
        assert (await next_of(reader))["id"] == 2
        assert not desk.subscribers.all
        writer.write(b'{"do": "unsubscribe", "subscription": "e"}\n')
        assert await next_of(reader) == misuse("no subscription has the id 'e'")
        writer.close()

    served(play)


def test_what_one_follows_ends_with_the_connection() -> None:
    async def play(endpoint: ControlEndpoint, desk: Desk) -> None:
        _, writer, _ = await subscription(endpoint)
        assert desk.subscribers.all
        writer.close()
        await until(lambda: not desk.subscribers.all)

    served(play)


def test_follows_need_an_id_of_their_own_and_are_not_too_many() -> None:
    lines = b'{"do": "subscribe"}\n' + b"".join(b'{"do": "subscribe", "id": %d}\n' % (n % 17) for n in range(18))

    async def play(endpoint: ControlEndpoint) -> Any:
        reader, writer = await asyncio.open_unix_connection(str(endpoint.path))
        writer.write(lines)
        found = [await next_of(reader) for _ in range(19)]
        writer.close()
        return found

    found = served(play)
    assert found[0]["error"]["message"] == "subscribe: an id is required; its events carry it"
    assert all("ok" in one for one in found[1:17])
    assert found[17]["error"]["message"] == "subscribe: too many: the limit for a client is 16"
    assert found[18]["error"]["message"] == "subscribe: the id 0 is in use"


def test_a_reader_that_is_slow_misses_events_and_is_told_how_many() -> None:
    async def play(endpoint: ControlEndpoint, desk: Desk) -> tuple[int, int, int]:
        reader, writer, _ = await subscription(endpoint, bound=100)
        happened = 0
        while happened < 40_000:  # more than socket and buffers hold
            desk.happen(1000)
            happened += 1000
            await asyncio.sleep(0)
        waiting = max(conversation._transport.get_write_buffer_size() for conversation in endpoint._clients)
        received = missed = 0
        while received + missed < happened:
            message = await next_of(reader)
            received, missed = received + 1, missed + message.get("missed", 0)
        writer.close()
        return received, missed, waiting

    received, missed, waiting = served(play)
    assert received + missed == 40_000
    assert missed > 0
    assert waiting < 2 * control.MOST_WAITING_BYTES


def test_a_reader_that_reads_nothing_is_cut_off(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(control, "TIMEOUT_S", 0.05)

    async def play(endpoint: ControlEndpoint, desk: Desk) -> int:
        _reader, writer = await asyncio.open_unix_connection(str(endpoint.path), limit=1024)
        writer.write(b'{"do": "pause"}\n' * 100)
        await until(lambda: desk.done > 0 and not endpoint._clients)
        writer.transport.abort()
        return desk.done

    assert 0 < served(play) < 20


def test_more_clients_than_there_may_be_are_told_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(control, "MOST_CLIENTS", 2)

    async def play(endpoint: ControlEndpoint) -> Any:
        clients = [await asyncio.open_unix_connection(str(endpoint.path)) for _ in range(3)]
        found = read_answer(await clients[2][0].readline())
        for _, writer in clients:
            writer.close()
        return found

    assert served(play)["error"] == {"code": "failure", "message": "there are 2 clients already, the most possible"}


# ---------------------------------------------------------------------- over TCP


def by_tcp(*lines: bytes) -> list[Any]:
    async def play(endpoint: ControlEndpoint) -> list[Any]:
        assert endpoint.listening is not None
        said = json.loads(endpoint.announcement.read_text())
        assert (said["host"], said["port"]) == (endpoint.listening.host, endpoint.listening.port)
        assert stat.S_IMODE(endpoint.announcement.stat().st_mode) == 0o600
        reader, writer = await asyncio.open_connection(said["host"], said["port"])
        for line in lines:
            writer.write(line.replace(b"TOKEN", said["token"].encode()) + b"\n")
        writer.write_eof()
        found = [read_answer(line) for line in (await reader.read()).splitlines()]
        writer.close()
        return found

    found = served(play, address=Address("127.0.0.1", 0))
    assert isinstance(found, list)
    return found


def test_over_tcp_the_first_line_is_the_token() -> None:
    assert by_tcp(b'{"token": "TOKEN"}', b'{"do": "note", "text": "a"}') == [{"ok": None}, ok("a")]


def test_without_an_address_it_listens_on_a_local_socket_only() -> None:
    async def play(endpoint: ControlEndpoint) -> None:
        assert (endpoint.listening, endpoint.path.exists()) == (None, True)

    served(play)


@pytest.mark.parametrize(
    "first",
    [
        b'{"do": "note", "text": "a"}',
        b'{"token": "0"}',
        b'{"token": "\xc3\xa4"}',
        b'{"token": "TOKENx"}',
        b'{"token": 1}',
        b"",
        b"GET / HTTP/1.1",
    ],
)
def test_without_the_token_nothing_is_done(first: bytes) -> None:
    assert by_tcp(first, b'{"do": "note", "text": "a"}') == [misuse(TOKEN_FIRST)]


# ---------------------------------------------------------------------- coming and going


def test_who_never_asks_does_not_hold_up_the_end() -> None:
    async def scene() -> list[bytes]:
        endpoint = ControlEndpoint("twin", Desk())
        await endpoint.open()
        silent = [await asyncio.open_unix_connection(str(endpoint.path)) for _ in range(3)]
        await turns()
        await asyncio.wait_for(endpoint.close(), 60.0)
        ends = [await reader.read() for reader, _ in silent]
        for _, writer in silent:
            writer.close()
        await turns()
        return ends

    assert asyncio.run(scene()) == [b""] * 3


# ---------------------------------------------------------------------- answers that come later


def test_an_answer_that_comes_later_keeps_its_place() -> None:
    async def play(endpoint: ControlEndpoint, desk: Desk) -> None:
        reader, writer = await asyncio.open_unix_connection(str(endpoint.path))
        writer.write(b'{"do": "note", "text": "later"}\n{"do": "note", "text": "next"}\n')
        writer.write_eof()
        other = await answer_to(endpoint, b'{"do": "note", "text": "other"}\n')
        assert other == ok("other")
        desk.later.put(None)
        assert [read_answer(line) for line in (await reader.read()).splitlines()] == [ok("later", 2), ok("next", 3)]
        writer.close()

    served(play)


def test_a_client_that_leaves_before_its_answer_gets_none() -> None:
    async def play(endpoint: ControlEndpoint, desk: Desk) -> None:
        _, writer = await asyncio.open_unix_connection(str(endpoint.path))
        writer.write(b'{"do": "note", "text": "later"}\n')
        await turns()
        writer.transport.abort()
        await turns()
        desk.later.put(None)
        assert await answer_to(endpoint, b'{"do": "note", "text": "a"}\n') == ok("a", 2)

    served(play)
