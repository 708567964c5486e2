"""The commands for devices with a kind of device that only the tests know: the shell knows it neither."""

from __future__ import annotations

import json
import socket
import threading
import time
from collections.abc import Iterator
from io import StringIO
from pathlib import Path

import pytest
from shell import Shell
from toy.controller import Toy
from toy.driver import registered_driver


@pytest.fixture
def place() -> Iterator[str]:
    """The address of a toy that runs in real time."""
    toy = Toy()
    with socket.create_server(("127.0.0.1", 0)) as server, registered_driver():
        thread = threading.Thread(target=serve, args=(server, toy), daemon=True)
        thread.start()
        yield f"tcp://127.0.0.1:{server.getsockname()[1]},kind=toy"
        server.shutdown(socket.SHUT_RDWR)
        thread.join()


def serve(server: socket.socket, toy: Toy) -> None:
    """Until the server is shut down."""
    begin = time.monotonic_ns()
    while True:
        try:
            client, _ = server.accept()
        except OSError:
            return
        with client:
            while data := client.recv(2):
                client.sendall(toy.execute(data, time.monotonic_ns() - begin))


def test_it_moves_and_is_read(place: str, shell: Shell) -> None:
    assert shell("move", "1=100", "-d", place) == "toy: at rest at 100 pulse\n"
    assert json.loads(shell("move", "M1=-30", "--by", "--json", "-d", place))[0]["position"] == 70
    assert shell("get", "position", "-d", place) == "POSITION  70  pulse\n"
    address = place.partition(",")[0]
    assert shell("info", "-d", place).splitlines() == [f"toy at {address}", "position  70  pulse"]
    assert json.loads(shell("info", "--json", "-d", place)) == {"device": address, "position": 70}
    assert shell("watch", "--count", "1", "-d", place).splitlines()[1].split()[1] == "70"
    assert shell("stop", "--program", "-d", place) == ""
    assert shell.errors == "a toy has no program\n"


def test_it_is_found(place: str, shell: Shell) -> None:
    address = place.partition(",")[0]
    assert json.loads(shell("scan", address, "--kind", "toy", "--json")) == [
        {"address": address, "baud": None, "kind": "toy", "toy": 1, "series": None, "what": "a toy"}
    ]
    shell("scan", address, "--kind", "plc")
    assert (shell.code, shell.errors) == (2, "steptwin: --kind plc: permitted are any, mic488, m1486, toy\n")


def test_a_terminal_takes_its_commands(place: str, shell: Shell, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", StringIO("P 0\nhelp\nX 1\n"))
    assert shell("terminal", "-d", place) == "P 0\nM NUMBER, P 0, H 0\n"
    assert (shell.code, "the toy refuses X 1" in shell.errors) == (1, True)


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["enable"], 2, "a toy has no enable"),
        (["home", "1=5"], 2, "a toy has no home"),
        (["seek", "1=5"], 2, "a toy has no seek"),
        (["jog", "1=5", "--seconds", "1"], 2, "a toy has no jog"),
        (["move", "2=10"], 2, "'2' is not an axis: permitted are 1, or M1"),
        (["move", "1=7"], 2, "7: a toy moves by multiples of 10 pulses"),
        (["get", "speed"], 2, "'speed' is not a value of a toy"),
        (["set", "speed=1"], 2, "nothing of a toy can be set"),
        (["send", "program.toy"], 1, "program.toy was not sent: a toy has no memory"),
        (["record", "s.txt"], 2, "cannot read"),
        (["verify"], 2, "there are no checks of a toy: permitted is a MIC488 or an M1486"),
    ],
)
def test_what_it_does_not_offer_is_refused(
    place: str, shell: Shell, arguments: list[str], code: int, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("program.toy").write_text("M 1, P 10\n")
    shell(*arguments, "-d", place)
    assert (shell.code, message in shell.errors) == (code, True), shell.errors


def test_an_option_of_another_kind_is_refused(place: str, shell: Shell) -> None:
    shell("info", "-d", f"{place},unit=1")
    assert (shell.code, "unit does not go with kind=toy" in shell.errors) == (2, True)
