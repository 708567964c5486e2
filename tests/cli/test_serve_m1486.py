"""`steptwin serve m1486` as a user starts it, and a hand at the chips."""

from __future__ import annotations

import os
import signal
import socket
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from steptwin.cli.serve_m1486 import ChipLineOptions, ChipOptions, serve_m1486
from steptwin.cli.serving import Served
from steptwin.errors import Misuse
from steptwin.live.options import LiveOptions

Serve = Callable[..., Any]


class Host:
    """A program on the raw TCP end of the line."""

    def __init__(self, port: int) -> None:
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=60)

    def ask(self, text: str, count: int) -> bytes:
        """Type lines; ``count`` bytes of what the chips say."""
        self.socket.sendall(text.replace("\n", "\r").encode())
        return self.hear(count)

    def hear(self, count: int) -> bytes:
        data = b""
        while len(data) < count:
            data += self.socket.recv(count - len(data))
        return data

    def close(self) -> None:
        self.socket.close()


def wait_for_line(twin: Any, text: str) -> None:
    """The twin says ``text``; a thread of its own prints it."""
    deadline = time.monotonic() + 60
    while not any(text in line for line in twin.lines):
        assert time.monotonic() < deadline, twin.lines
        time.sleep(0.01)


def test_programs_on_tcp_and_pty_share_the_line(serve_m1486: Serve) -> None:
    twin = serve_m1486("--variant", "B", "--chain", "0,7", "--log-frames")
    pty = os.open(twin.pty, os.O_RDWR | os.O_NOCTTY)
    two = Host(twin.tcp_port)
    assert two.ask("x7\nu16\n", 1) == os.read(pty, 1) == b"\x01"  # both are there
    one = Host(twin.tcp_port)
    try:
        assert one.ask("x7\nu20\n", 1) == b"B"
        assert two.hear(1) == b"B"
        assert os.read(pty, 1) == b"B"
        os.write(pty, b"u16\r")
        assert [one.hear(1), two.hear(1), os.read(pty, 1)] == [b"\x01"] * 3
    finally:
        os.close(pty)
        one.close()
        two.close()
    for text in (
        "m1486; chip0: M1486, chip 0, variant B; chip7: M1486, chip 7, variant B",
        "78 37 0d  X7  indeX 7",
        "U20 type letter in ASCII = 66",
    ):
        wait_for_line(twin, text)


def test_what_is_said_to_nobody_is_lost(serve_m1486: Serve) -> None:
    """As on a wire: who opens the port later does not find it."""
    twin = serve_m1486("--variant", "B")
    host = Host(twin.tcp_port)
    assert host.ask("u20\nu20\n", 2) == b"BB"
    twin.state()  # by now everybody has been told
    pty = os.open(twin.pty, os.O_RDWR | os.O_NOCTTY)
    try:
        assert host.ask("u16\n", 1) == b"\x01"
        assert os.read(pty, 10) == b"\x01"
    finally:
        os.close(pty)
        host.close()


def test_a_hand_at_the_chips(serve_m1486: Serve) -> None:
    twin = serve_m1486("--variant", "B", "--chain", "0,A", "--wire", "0.B1=A.B3")
    host = Host(twin.tcp_port)
    assert host.ask("xA\nz3\nu20\nx0\nu16\n", 1) == b"\x01"
    assert "waits until B3 is low" in twin.command("state", "--device", "m1486.A").stdout
    assert twin.command("pin", "--device", "m1486.A", "B3=0").returncode == 0
    assert host.hear(1) == b"B"
    shown = twin.command("pin", "--device", "m1486.a").stdout
    assert "chipA.B3 0" in shown.splitlines()
    assert host.ask("x0\nc1\nu20\n", 1) == b"B"

    assert twin.command("power-cycle").returncode == 0  # of all chips of the line
    lines = twin.command("state", "--device", "m1486.0").stdout.splitlines()
    assert lines[0].startswith("M1486 B, ")
    assert lines[1] == "program has nothing to do"
    shown = dict(line.split(maxsplit=1) for line in lines[5:])
    assert [shown[name] for name in ("address", "baud", "memory_used", "flags_on")] == ["0", "4800 bit/s", "0 bit", "none"]
    refused = twin.command("pin", "B1=0")
    there = "controllers are chip0, chipA; buttons are none"
    assert (refused.returncode, refused.stderr) == (2, f"steptwin: B1: give a pin as CONTROLLER.PIN; {there}\n")
    cannot = twin.command("encoder", "--device", "m1486.0", "M1+1")
    assert (cannot.returncode, cannot.stderr) == (2, "steptwin: 'chip0' is an M1486, which has no encoder\n")
    host.close()


def test_what_was_stored_is_there_after_kill_9(serve_m1486: Serve, tmp_path: Path) -> None:
    options = ("--variant", "E1", "--chain", "1", "--state", str(tmp_path / "state"))
    first = serve_m1486(*options)
    host = Host(first.tcp_port)
    assert host.ask("[\nu20\n]\n", 1) == b"E"
    first.process.send_signal(signal.SIGKILL)
    first.process.wait()
    host.close()
    second = serve_m1486(*options)
    wait_for_line(second, "U20 sends 45H")


def test_a_program_to_switch_on_with(serve_m1486: Serve, tmp_path: Path) -> None:
    (tmp_path / "p.m1486").write_text("[\nz3\nu20\n]\n")
    twin = serve_m1486("--variant", "B", "--program", str(tmp_path / "p.m1486"))
    host = Host(twin.tcp_port)
    twin.command("pin", "B3=0")
    assert host.hear(1) == b"B"
    host.close()


@pytest.mark.parametrize(
    ("line", "chips", "text"),
    [
        ({}, {"variant": "D"}, "no M1486 variant is called 'D'; there are A, B, C, E1, E2"),
        ({"baud": 9600}, {"variant": "B"}, "9600 bit/s: M1486B has 300, 1200, 2400, 4800"),
        ({}, {"chain": "0,G"}, "--chain 0,G: 'G' is not an address"),
        ({}, {"variant": "E1", "chain": "0"}, "address 0: M1486E1 takes 1 to F"),
        ({}, {"interface": "dac"}, "no driver interface is called 'dac'; there are sd, dual, two"),
        ({"line_timing": "fast"}, {}, "--line-timing fast: permitted are 'real' and 'off'"),
        ({}, {"wire": ("B1=B3",)}, "--wire B1=B3: expected FROM=TO"),
        ({"tcp": "0.0.0.0:0"}, {}, "0.0.0.0 is not a loopback address"),
        ({}, {"program": Path("nowhere.m1486")}, "cannot read nowhere.m1486: no such file or directory"),
    ],
)
def test_wrong_options_are_said(line: dict[str, Any], chips: dict[str, Any], text: str) -> None:
    with pytest.raises(Misuse) as refusal:
        serve_m1486(Served(kind="m1486", line=ChipLineOptions(**line)), ChipOptions(**chips))
    assert str(refusal.value).startswith(text)


def test_a_wrong_name_is_refused() -> None:
    with pytest.raises(Misuse, match="--name 'a b': permitted are"):
        serve_m1486(Served(kind="m1486", line=ChipLineOptions(), live=LiveOptions(name="a b")), ChipOptions())


def test_a_program_with_errors_is_shown(tmp_path: Path) -> None:
    path = tmp_path / "p.m1486"
    path.write_text("f640\nj3\n")
    with pytest.raises(Misuse, match=r"p\.m1486:2:"):
        serve_m1486(Served(kind="m1486", line=ChipLineOptions()), ChipOptions(program=path))
