"""The control endpoint: one line asked, one line answered, whatever is asked."""

from __future__ import annotations

import asyncio
import json
import os
import socket
import stat
from collections.abc import Awaitable, Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from steptwin.errors import LineFailure, Misuse, Refusal
from steptwin.live import control
from steptwin.live.control import ControlEndpoint, ask, private_directory, running, runtime_directory

FORM_ERROR = {"error": 'a request is a line of JSON: {"do": NAME, ...}', "misuse": True}


@pytest.fixture(autouse=True)
def own_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return tmp_path / "steptwin"


def refuse(request: Mapping[str, Any]) -> object:
    raise Misuse("not permitted: 7")


def deny(request: Mapping[str, Any]) -> object:
    raise Refusal("not now")


def break_down(request: Mapping[str, Any]) -> object:
    return request["x"]


HANDLERS: dict[str, Callable[[Mapping[str, Any]], object]] = {
    "echo": dict,
    "refuse": refuse,
    "deny": deny,
    "break": break_down,
}


async def turns() -> None:
    """Let the loop finish what it has begun with connections that come and go."""
    for _ in range(5):
        await asyncio.sleep(0)


def served(play: Callable[[ControlEndpoint], Awaitable[Any]], name: str = "twin") -> Any:
    async def scene() -> Any:
        endpoint = ControlEndpoint(name, HANDLERS)
        await endpoint.open()
        try:
            return await play(endpoint)
        finally:
            await turns()
            await endpoint.close()
            await turns()

    return asyncio.run(scene())


async def answer_to(endpoint: ControlEndpoint, *parts: bytes) -> Any:
    reader, writer = await asyncio.open_unix_connection(str(endpoint.path))
    for part in parts:
        writer.write(part)
        await writer.drain()
        await asyncio.sleep(0)
    answer = await reader.read()
    writer.close()
    return json.loads(answer)


@pytest.mark.parametrize(
    ("request_", "answer"),
    [
        (b'{"do": "echo", "x": [1, null]}\n', {"ok": {"do": "echo", "x": [1, None]}}),
        (b'{"do": "refuse"}\nmore', {"error": "not permitted: 7", "misuse": True}),
        (b'{"do": "fly"}\n', {"error": "this twin cannot do 'fly': it can echo, refuse, deny, break", "misuse": True}),
        (b"\n", FORM_ERROR),
        (b"[]\n", FORM_ERROR),
        (b'{"do": []}\n', FORM_ERROR),
        (b'{"say": "echo"}\n', FORM_ERROR),
        (b"\xff\xfe\n", FORM_ERROR),
        (b"[" * 60000 + b"\n", FORM_ERROR),
        (b"x" * 70000, {"error": "a request has at most 65536 bytes", "misuse": True}),
    ],
)
def test_whatever_is_asked_is_answered(request_: bytes, answer: object) -> None:
    assert served(lambda endpoint: answer_to(endpoint, request_)) == answer


@pytest.mark.parametrize(
    ("request_", "message"),
    [
        (b'{"do": "echo", "x": %s}' % (b"9" * 400), "a number is not finite, or not below 2^63"),
        (b'{"do": "echo", "x": %s}' % (b"9" * 5000), FORM_ERROR["error"]),
        (b'{"do": "echo", "x": [1e999]}', "a number is not finite, or not below 2^63"),
        (b'{"do": "echo", "x": -Infinity}', "a number is not finite, or not below 2^63"),
        (b'{"do": "echo", "x": NaN}', "a number is not finite, or not below 2^63"),
        (b'{"do": "echo", "a\\u0000b": 1}', "'a\\x00b': a text takes neither NUL nor surrogates"),
        (b'{"do": "echo", "x": "\\udcff"}', "'\\udcff': a text takes neither NUL nor surrogates"),
        (b'{"do": "echo", "x": "%s"}' % (b"x" * 5000), "a text of 5000 characters: permitted are at most 4096"),
    ],
)
def test_values_that_no_handler_has_to_expect(request_: bytes, message: str) -> None:
    assert served(lambda endpoint: answer_to(endpoint, request_ + b"\n")) == {"error": message, "misuse": True}


def test_an_exception_of_a_handler_is_an_answer_and_told_to_the_loop() -> None:
    told: list[dict[str, Any]] = []

    async def play(endpoint: ControlEndpoint) -> Any:
        asyncio.get_running_loop().set_exception_handler(lambda _, context: told.append(context))
        return await answer_to(endpoint, b'{"do": "break"}\n')

    assert served(play) == {"error": "internal error, please report it: KeyError: 'x'"}
    assert [repr(context["exception"]) for context in told] == ["KeyError('x')"]


def test_a_request_that_ends_early_is_answered() -> None:
    async def play(endpoint: ControlEndpoint) -> Any:
        reader, writer = await asyncio.open_unix_connection(str(endpoint.path))
        writer.write(b'{"do": "echo"}')
        writer.write_eof()
        answer = await reader.read()
        writer.close()
        return json.loads(answer)

    assert served(play)["error"].startswith("the request has no end of line")


def test_half_a_request_is_dropped_after_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(control, "TIMEOUT_S", 0.02)
    answer = served(lambda endpoint: answer_to(endpoint, b'{"do": '))
    assert answer["error"].startswith("no complete request within 0.02 s")


def test_a_request_in_pieces() -> None:
    assert served(lambda endpoint: answer_to(endpoint, b'{"do": ', b'"echo"', b"}\n")) == {"ok": {"do": "echo"}}


def test_who_never_asks_does_not_hold_up_the_end() -> None:
    async def scene() -> list[bytes]:
        endpoint = ControlEndpoint("twin", HANDLERS)
        await endpoint.open()
        silent = [await asyncio.open_unix_connection(str(endpoint.path)) for _ in range(3)]
        await turns()
        await asyncio.wait_for(endpoint.close(), 1.0)
        ends = [await reader.read() for reader, _ in silent]
        for _, writer in silent:
            writer.close()
        await turns()
        return ends

    assert asyncio.run(scene()) == [b""] * 3


def test_only_its_user_can_open_it(own_directory: Path) -> None:
    async def play(endpoint: ControlEndpoint) -> list[int]:
        return [stat.S_IMODE(os.stat(path).st_mode) for path in (own_directory, endpoint.path)]

    assert served(play) == [0o700, 0o600]


def test_at_the_end_nothing_is_left(own_directory: Path) -> None:
    async def play(endpoint: ControlEndpoint) -> None: ...

    served(play)
    assert list(own_directory.iterdir()) == []


def test_a_name_has_one_twin() -> None:
    async def play(endpoint: ControlEndpoint) -> Any:
        second = ControlEndpoint("twin", HANDLERS)
        with pytest.raises(Misuse, match=rf"a twin named 'twin' is running already \(process {os.getpid()}\): give .* --name"):
            await second.open()
        await second.close()
        return await answer_to(endpoint, b'{"do": "echo"}\n')

    assert served(play) == {"ok": {"do": "echo"}}


def test_the_socket_of_a_killed_twin_is_replaced(own_directory: Path) -> None:
    own_directory.mkdir(0o700)
    with socket.socket(socket.AF_UNIX) as dead:
        dead.bind(str(own_directory / "twin.control"))
    assert running() == []
    assert served(lambda endpoint: answer_to(endpoint, b'{"do": "echo"}\n')) == {"ok": {"do": "echo"}}


def test_a_directory_that_is_none_or_somebody_elses(own_directory: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    elsewhere = own_directory.with_name("elsewhere")
    elsewhere.mkdir()
    own_directory.symlink_to(elsewhere)
    with pytest.raises(Misuse, match="is no directory"):
        private_directory(own_directory)
    monkeypatch.setattr(os, "getuid", lambda: 12345)
    with pytest.raises(Misuse, match="belongs to another user"):
        private_directory(elsewhere)


def test_a_directory_others_could_enter_is_closed_to_them(own_directory: Path) -> None:
    own_directory.mkdir(mode=0o777)
    own_directory.chmod(0o777)
    private_directory(own_directory)
    assert stat.S_IMODE(own_directory.stat().st_mode) == 0o700


def test_a_twin_in_a_directory_that_others_can_write_is_not_believed(own_directory: Path) -> None:
    own_directory.mkdir()
    own_directory.chmod(0o777)
    with pytest.raises(Misuse, match="can be written by other users, so a twin in it may be theirs"):
        ask(None, {"do": "echo"})


def test_a_twin_in_a_directory_of_another_user_is_not_believed(own_directory: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own_directory.mkdir(0o700)
    owner = os.getuid()
    monkeypatch.setattr(os, "getuid", lambda: owner + 1)
    with pytest.raises(Misuse, match="belongs to another user"):
        running()


def test_without_xdg_the_directory_is_the_users_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("XDG_RUNTIME_DIR")
    assert runtime_directory().name == f"steptwin-{os.getuid()}"


# ---------------------------------------------------------------------- asking


def asked(name: str | None, request: Mapping[str, object], *names: str) -> Any:
    """Ask while twins of these names are served."""

    async def scene() -> Any:
        endpoints = [ControlEndpoint(each, HANDLERS) for each in names]
        for endpoint in endpoints:
            await endpoint.open()
        try:
            return await asyncio.to_thread(ask, name, request)
        finally:
            await turns()
            for endpoint in endpoints:
                await endpoint.close()
            await turns()

    return asyncio.run(scene())


def test_the_only_twin_is_asked() -> None:
    assert asked(None, {"do": "echo"}, "one") == {"do": "echo"}


def test_a_twin_is_asked_by_name() -> None:
    assert asked("two", {"do": "echo"}, "one", "two") == {"do": "echo"}


def test_what_the_twin_refuses() -> None:
    with pytest.raises(Misuse, match="not permitted: 7"):
        asked(None, {"do": "refuse"}, "one")
    with pytest.raises(Refusal, match="not now"):
        asked(None, {"do": "deny"}, "one")


@pytest.mark.parametrize(
    ("name", "names", "family", "text"),
    [
        (None, (), LineFailure, "no twin is running: start one with 'steptwin serve' or 'steptwin up'"),
        (None, ("one", "two"), Misuse, "several twins are running: choose one with --twin: one, two"),
        ("three", ("one", "two"), LineFailure, "no twin named 'three' is running; running: one, two"),
        ("three", (), LineFailure, "no twin named 'three' is running; running: none"),
    ],
)
def test_which_twin_is_not_clear(name: str | None, names: tuple[str, ...], family: type[Exception], text: str) -> None:
    with pytest.raises(family) as failure:
        asked(name, {"do": "echo"}, *names)
    assert str(failure.value) == text


def test_a_twin_that_hangs(own_directory: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(control, "TIMEOUT_S", 0.02)
    own_directory.mkdir(0o700)
    with socket.socket(socket.AF_UNIX) as hanging:
        hanging.bind(str(own_directory / "twin.control"))
        hanging.listen()
        with pytest.raises(LineFailure, match="the twin 'twin' does not answer: timed out"):
            ask(None, {"do": "echo"})
