"""The M1486 driver over real lines: a served twin over pty and TCP, and a scripted peer that is none of ours."""

from __future__ import annotations

import asyncio
import os
import threading
import tty
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from steptwin.drivers import LineLost
from steptwin.drivers.m1486 import M1486, AsyncM1486, AsyncM1486Line, ChipReason, M1486Line, PositionUnknown

Serve = Callable[..., Any]
KNOWN = {"start_stop": 200, "acceleration": 50000, "velocity": 2000, "profile": 25000, "microstep": 1, "qualification": 1}


def test_two_chips_over_a_pty(serve_m1486: Serve) -> None:
    twin = serve_m1486("--variant", "B", "--chain", "0,7", "--line-timing", "real")
    with M1486Line(str(twin.pty), baud=4800) as line:
        chips = [M1486(line, address) for address in (0, 7)]
        for chip in chips:
            chip.open()
            chip.configure(**KNOWN)
        for chip in chips:
            chip.move_by(200.0)
        assert [chip.wait().position for chip in chips] == [200.0, 200.0]
        chips[1].run(-1)
        chips[1].stop()
        assert chips[1].wait(60.0, check=False).reason is ChipReason.STOPPED
        assert chips[1].position() < 200.0
        chips[0].move_by(20000.0)
        chips[0].stop()
        chips[0].wait(check=False)
        with pytest.raises(PositionUnknown):
            chips[0].position()


def test_a_download_for_asyncio_over_tcp(serve_m1486: Serve, tmp_path: Path) -> None:
    twin = serve_m1486("--variant", "B", "--tcp", "127.0.0.1:0")

    async def main() -> None:
        async with AsyncM1486Line(f"tcp://127.0.0.1:{twin.tcp_port}") as line:
            chip = AsyncM1486(line)
            await chip.open()
            await chip.download("[\nf640\nl3\nr\ne\n]\n")
            assert (await chip.wait(60.0)).reason is ChipReason.DONE
            assert await chip.counter() == 1920

    asyncio.run(main())


class Script(threading.Thread):
    """A peer that knows the echo and a table of answers; it was not written from the twin."""

    def __init__(self, port: int, answers: dict[bytes, bytes]) -> None:
        super().__init__(daemon=True)
        self._port = port
        self._answers = answers
        self.lines: list[bytes] = []

    def run(self) -> None:
        line = b""
        listens = True
        try:
            while data := os.read(self._port, 64):
                for byte in data:
                    if byte != 0x0D:
                        line += bytes((byte,))
                        if listens:
                            os.write(self._port, bytes((byte,)))
                        continue
                    self.lines.append(line)
                    if listens:
                        os.write(self._port, b"\r" + self._answers.get(line, b""))
                    if line[:1] == b"x":
                        listens = line in (b"xf", b"xg")  # open address pins
                    line = b""
        except OSError:
            pass


@contextmanager
def scripted(answers: dict[bytes, bytes]) -> Generator[tuple[str, Script]]:
    ours, theirs = os.openpty()
    tty.setraw(ours)
    tty.setraw(theirs)
    script = Script(ours, answers)
    script.start()
    try:
        yield os.ttyname(theirs), script
    finally:
        os.close(theirs)
        script.join(10)
        os.close(ours)


def test_a_scripted_peer() -> None:
    answers = {b"u20": b"A", b"u15": b"\2", b"u16": b"\1", b"u17": b"\2", b"u18": b"\xff", b"u19": b"\0"}
    answers |= {b"u1": b"\x40", b"u2": b"\x06", b"u3": b"\0"}
    with scripted(answers) as (path, script), M1486(path) as chip:
        assert chip.variant.title == "M1486A"
        assert chip.position() == 25.0
        script.lines.clear()
        chip.move_to(26.0)
        assert [line for line in script.lines if line[:1] != b"u"] == [b"g1664", b"r"]
        chip.stop()
        assert script.lines[-1] == b"k"


def test_a_port_that_is_none_is_told(tmp_path: Path) -> None:
    with pytest.raises(LineLost, match="cannot open serial port"):
        M1486(str(tmp_path / "none")).open()
