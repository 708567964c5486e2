"""Twins to which nobody sends anything: programs that run from power-up run on time, whatever the output goes to."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from tests.conftest import STEPTWIN

FILES = {
    "chip.m1486": "[\nw300\nu20\nw300\nu16\n]\n",
    "mover.prg": "DELAY 0,3\nPREL M1 10\n",  # W207: the drive is never enabled, which is what the event below says
    "mover.cfg": "[WBC_PROGRAM]\nActivate=1\n",
    "world.toml": '[world]\nname = "w"\n[[mic488]]\nname = "a"\nconfig = "mover.cfg"\nprogram = "mover.prg"\n',
}


class Twin(NamedTuple):
    """A command and the line that shows that its machines act by themselves."""

    command: tuple[str, ...]
    acts: str


TWINS = {
    "m1486": Twin(
        ("serve", "m1486", "--variant", "B", "--program", "chip.m1486", "--tcp", "127.0.0.1:0"),
        "0.601000 s  chipF      U16 sends 01H",
    ),
    "mic488": Twin(
        ("serve", "mic488", "--config", "mover.cfg", "--program", "mover.prg", "--tcp", "127.0.0.1:0"),
        "0.301000 s  mic488     position command ignored: M1 is not enabled",
    ),
    "world": Twin(("up", "world.toml"), "0.301000 s  a          position command ignored: M1 is not enabled"),
    "fault": Twin(
        ("serve", "m1486", "--variant", "B", "--tcp", "127.0.0.1:0", "--fault", "supply-drop at_s=0.3 for_s=0.3"),
        "0.600000 s  chipF      power-on",
    ),
}


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A directory with the files of the twins, and a place of its own for what twins share."""
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return tmp_path


def wait_for(text: str, output: Callable[[], str]) -> None:
    deadline = time.monotonic() + 60
    while text not in output():
        assert time.monotonic() < deadline, f"no {text!r} in {output()!r}"
        time.sleep(0.01)


def end(process: subprocess.Popen[bytes]) -> None:
    process.send_signal(signal.SIGINT)
    assert process.wait(60) == 0


@pytest.mark.parametrize("twin", TWINS.values(), ids=TWINS)
def test_output_to_a_pipe(here: Path, twin: Twin) -> None:
    received = bytearray()

    def output() -> str:
        with suppress(BlockingIOError):
            received.extend(os.read(pipe, 4096))
        return received.decode()

    with subprocess.Popen([STEPTWIN, *twin.command], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
        assert process.stdout is not None
        pipe = process.stdout.fileno()
        os.set_blocking(pipe, False)
        try:
            wait_for(twin.acts, output)
            end(process)
        finally:
            process.kill()


@pytest.mark.parametrize("name", ["m1486", "mic488"])
def test_output_to_a_file(here: Path, name: str) -> None:
    file = here / "out"
    with file.open("w") as out, subprocess.Popen([STEPTWIN, *TWINS[name].command], stdout=out, stderr=out) as process:
        try:
            wait_for(TWINS[name].acts, file.read_text)
            end(process)
        finally:
            process.kill()
    assert process.returncode == 0


def test_a_client_that_only_listens_hears_the_program(serve_m1486: Callable[..., Any], tmp_path: Path) -> None:
    """Its first byte comes while nothing has been sent to the chip."""
    (tmp_path / "p.m1486").write_text("[\n@1\nw50\nu20\nj1\n]\n")
    twin = serve_m1486("--variant", "B", "--program", str(tmp_path / "p.m1486"))
    pty = os.open(twin.pty, os.O_RDWR | os.O_NOCTTY)
    try:
        with socket.create_connection(("127.0.0.1", twin.tcp_port), timeout=60) as client:
            assert client.recv(1) == b"B"
        assert os.read(pty, 1) == b"B"
    finally:
        os.close(pty)
