"""Twins as the control endpoint's clients find them: by name, in a directory of their user, by their announcement."""

from __future__ import annotations

import asyncio
import contextlib
import os
import socket
import stat
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from control_rig import Desk, answer_to, ok, served, turns

from steptwin.errors import LineFailure, Misuse, Refusal
from steptwin.live import control, remote
from steptwin.live.control import ControlEndpoint
from steptwin.live.remote import START, ask, running
from steptwin.live.twins import running_twins
from steptwin.simulation.script import steps as do
from steptwin.subject import commands as command


@pytest.fixture(autouse=True)
def own_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return tmp_path / "steptwin"


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
        second = ControlEndpoint("twin", Desk())
        with pytest.raises(Misuse, match=rf"a twin named 'twin' is running already \(process {os.getpid()}\): give .* --name"):
            await second.open()
        await second.close()
        return await answer_to(endpoint, b'{"do": "note", "text": "a"}\n')

    assert served(play) == ok("a")


def test_the_socket_of_a_killed_twin_is_replaced(own_directory: Path) -> None:
    own_directory.mkdir(0o700)
    with socket.socket(socket.AF_UNIX) as dead:
        dead.bind(str(own_directory / "twin.control"))
    assert running() == []
    assert served(lambda endpoint: answer_to(endpoint, b'{"do": "note", "text": "a"}\n')) == ok("a")


def test_a_twin_in_a_directory_that_others_can_write_is_not_believed(own_directory: Path) -> None:
    own_directory.mkdir()
    own_directory.chmod(0o777)
    with pytest.raises(Misuse, match="can be written by other users, so a twin in it may be theirs"):
        ask(None, do.Note("a"))


def test_a_twin_in_a_directory_of_another_user_is_not_believed(own_directory: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own_directory.mkdir(0o700)
    owner = os.getuid()
    monkeypatch.setattr(os, "getuid", lambda: owner + 1)
    with pytest.raises(Misuse, match="belongs to another user"):
        running()


def asked(name: str | None, wanted: command.Command, *names: str) -> Any:
    """Ask while twins of these names are served."""

    async def scene() -> Any:
        endpoints = [ControlEndpoint(each, Desk()) for each in names]
        for endpoint in endpoints:
            await endpoint.open()
        try:
            return await asyncio.to_thread(ask, name, wanted)
        finally:
            await turns()
            for endpoint in endpoints:
                await endpoint.close()
            await turns()

    return asyncio.run(scene())


def test_the_only_twin_is_asked() -> None:
    assert asked(None, do.Note("a"), "one") == {"note": "a"}


def test_a_twin_is_asked_by_name() -> None:
    assert asked("two", do.Note("a"), "one", "two") == {"note": "a"}


def test_what_the_twin_refuses() -> None:
    with pytest.raises(Misuse, match="not permitted: 7"):
        asked(None, do.Note("refuse"), "one")
    with pytest.raises(Refusal, match="not now"):
        asked(None, do.Note("deny"), "one")


@pytest.mark.parametrize(
    ("name", "names", "family", "text"),
    [
        (None, (), LineFailure, f"no twin is running: {START}"),
        (None, ("one", "two"), Misuse, "several twins are running: name one: one, two"),
        ("three", ("one", "two"), LineFailure, "no twin named 'three' is running; running: one, two"),
        ("three", (), LineFailure, "no twin named 'three' is running; running: none"),
    ],
)
def test_which_twin_is_not_clear(name: str | None, names: tuple[str, ...], family: type[Exception], text: str) -> None:
    with pytest.raises(family) as failure:
        asked(name, do.Note("a"), *names)
    assert str(failure.value) == text


def test_a_twin_that_hangs(own_directory: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own_directory.mkdir(0o700)
    with socket.socket(socket.AF_UNIX) as hanging:
        hanging.bind(str(own_directory / "twin.control"))
        hanging.listen()
        with pytest.raises(LineFailure, match="the twin 'twin' does not answer: timed out"):
            ask(None, do.Note("a"), timeout_s=0.02)


def test_a_twin_of_another_version_is_named_and_others_are_listed(own_directory: Path) -> None:
    own_directory.mkdir(0o700)
    with socket.socket(socket.AF_UNIX) as other, ThreadPoolExecutor() as pool:
        other.bind(str(own_directory / "old.control"))
        other.listen()

        def answer() -> None:
            with contextlib.suppress(OSError):  # the socket is shut down at the end
                while True:
                    client, _ = other.accept()
                    with client:
                        if client.recv(1000):  # else it only looks whether there is a twin
                            client.sendall(b'{"error": "unknown request"}\n')

        answers = pool.submit(answer)
        with pytest.raises(LineFailure, match="'old' does not answer: 'unknown request' is not a response of this version"):
            ask("old", do.Note("a"))
        assert running_twins() == []
        other.shutdown(socket.SHUT_RDWR)
        answers.result()


def test_a_twin_without_local_sockets_is_found_by_its_announcement(monkeypatch: pytest.MonkeyPatch, own_directory: Path) -> None:
    monkeypatch.setattr(control, "HAS_LOCAL_SOCKETS", False)
    monkeypatch.setattr(remote, "HAS_LOCAL_SOCKETS", False)
    assert asked(None, do.Note("a"), "one") == {"note": "a"}
    assert list(own_directory.iterdir()) == []


def test_a_step_is_answered_when_its_time_has_passed() -> None:
    """A twin answers after a part of a long one, and says how far it has to go on."""
    done = asked(None, command.Advance(duration=9), "one")
    assert "to_ns" not in done
    assert [event["number"] for event in done["events"]] == list(range(200, 1200))
    assert done["missed"] == 3 + 4 + 200
