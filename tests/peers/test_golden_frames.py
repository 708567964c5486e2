"""The frames the manual prints, byte for byte, through the pty."""

from __future__ import annotations

import os
import select
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

IN1_TO_IN8 = "01 02 13 88 00 08 FD 62"
OUT2_OFF = "01 05 17 71 00 00 98 65"
POS_ACT_1_23 = "01 03 03 FC 00 02 04 7F"
POS_ACT_1_70 = "01 03 27 24 00 02 8E B4"


class Line:
    """The far end of a pty, with bytes as the manual writes them."""

    def __init__(self, path: str) -> None:
        self.file = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)

    def send(self, text: str) -> None:
        os.write(self.file, bytes.fromhex(text))

    def receive(self, count: int, seconds: float = 60.0) -> str:
        """Exactly ``count`` bytes, or what came in the time."""
        data = b""
        deadline = time.monotonic() + seconds
        while len(data) < count and (left := deadline - time.monotonic()) > 0:
            if select.select([self.file], [], [], left)[0]:
                data += os.read(self.file, 256)
        return data.hex(" ").upper()

    def check_answer(self, request: str, answer: str) -> None:
        self.send(request)
        assert self.receive(len(bytes.fromhex(answer))) == answer


@pytest.fixture
def open_line() -> Iterator[Callable[[Any], Line]]:
    lines: list[Line] = []

    def open_(twin: Any) -> Line:
        lines.append(Line(str(twin.pty)))
        return lines[-1]

    yield open_
    for line in lines:
        os.close(line.file)


def test_the_manuals_frames_1_70(serve: Callable[..., Any], open_line: Callable[[Any], Line]) -> None:
    twin = serve("--firmware", "1.70")
    line = open_line(twin)
    line.check_answer(IN1_TO_IN8, "01 02 01 00 A1 88")
    assert twin.command("pin", "IN1=1", "IN8=1").returncode == 0
    # The inputs' filters let a change through after 10 ms.
    deadline = time.monotonic() + 60
    line.send(IN1_TO_IN8)
    while (answer := line.receive(6)) == "01 02 01 00 A1 88" and time.monotonic() < deadline:
        line.send(IN1_TO_IN8)
    assert answer == "01 02 01 81 61 E8"
    line.check_answer("01 05 17 71 FF 00 D9 95", "01 05 17 71 FF 00 D9 95")
    line.check_answer("01 01 17 70 00 08 39 A3", "01 01 01 02 D0 49")
    line.check_answer(OUT2_OFF, OUT2_OFF)
    line.check_answer("01 01 17 70 00 08 39 A3", "01 01 01 00 51 88")
    line.check_answer(POS_ACT_1_70, "01 03 04 00 00 00 00 FA 33")


def test_the_manuals_frames_1_23(serve: Callable[..., Any], open_line: Callable[[Any], Line]) -> None:
    line = open_line(serve("--firmware", "1.23"))
    line.check_answer(POS_ACT_1_23, "01 03 04 00 00 00 00 FA 33")
    line.check_answer(OUT2_OFF, OUT2_OFF)
