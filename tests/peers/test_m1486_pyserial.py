"""A conversation with M1486 chips as a script with pyserial has it, over a pty, at real baud rates."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from itertools import pairwise
from typing import Any

import pytest
import serial

pytestmark = pytest.mark.peers

Serve = Callable[..., Any]


@contextmanager
def opened(twin: Any, baud: int) -> Generator[serial.Serial]:
    with serial.Serial(str(twin.pty), baudrate=baud, timeout=60) as port:
        yield port


def times(twin: Any, pattern: str) -> list[float]:
    """The virtual moments, in seconds, of what the twin said about the line."""
    return [float(line.split()[0]) for line in twin.lines if re.search(pattern, line)]


def moments(twin: Any, pattern: str, count: int) -> list[float]:
    """The same, when there are so many: text comes a little after what it tells of."""
    deadline = time.monotonic() + 30
    while len(found := times(twin, pattern)) < count:
        assert time.monotonic() < deadline, twin.lines
        time.sleep(0.01)
    assert len(found) == count
    return found


@pytest.mark.parametrize(("kind", "baud", "seconds"), [("B2x", 9600, 0.5), ("B", 300, 60.0)])
def test_characters_take_their_time(serve_m1486: Serve, kind: str, baud: int, seconds: float) -> None:
    """Four characters go to the chip; while it uploads three bytes, each leaves a character's time after the one before."""
    twin = serve_m1486("--variant", kind, "--baud", str(baud), "--line-timing", "real", "--log-frames")
    with opened(twin, baud) as port:
        began = time.monotonic()
        port.write(b"[\ru20\ru16\ru15\r]\r")
        assert port.read(3) == b"B\x01\x02"
        took = time.monotonic() - began
    character = 10 / baud
    typed = 2 + 4 + 4 + 4 + 2
    # Every character has to be on the wire before the next; the wall may be late, but never early.
    assert (typed + 3) * character < took < seconds + (typed + 3) * character
    # In virtual time all is exact: the log has microseconds.
    (written,) = moments(twin, r"→ 5b 0d", 1)
    sent = moments(twin, r"line +←", 3)
    assert sent[0] - written >= (typed + 1) * character - 2e-6
    gaps = [later - earlier for earlier, later in pairwise(sent)]
    assert gaps == pytest.approx([max(character, 0.001 if baud == 300 else 0.0005)] * 2, abs=2e-6)
    announced = moments(twin, r"U20 sends", 1)
    assert announced[0] - written == pytest.approx(typed * character, abs=2e-6)
    assert sent[0] - announced[0] == pytest.approx(character, abs=2e-6)


def test_a_session(serve_m1486: Serve) -> None:
    """What a script does: type, wait for the byte that says that it is done, ask where the motor stands."""
    twin = serve_m1486("--variant", "B", "--chain", "0,7", "--baud", "4800")
    with opened(twin, 4800) as port:
        port.write(b"x7\rc100\rv2000\rf12800\rr\ru1\ru2\ru3\r")
        assert int.from_bytes(port.read(3), "little") == 12800
        port.write(b"h\rr\ru1\ru2\ru3\r")
        assert int.from_bytes(port.read(3), "little") == 0
        port.write(b"x0\rt41\ru20\r")  # echo from here on
        assert port.read(5) == b"u20\rB"


def test_a_full_buffer_is_answered(serve_m1486: Serve) -> None:
    """Compression rests while the motor runs: the 32 characters of a B fill up, then 5EH."""
    twin = serve_m1486("--variant", "B")
    with opened(twin, 4800) as port:
        port.write(b"g+\rr\r")
        deadline = time.monotonic() + 30
        while not times(twin, "moves on"):
            assert time.monotonic() < deadline
            time.sleep(0.01)
        port.write(b"f1\r" * 11)
        assert port.read(4) == bytes((~ord("\r") & 0xFF, ~ord("f") & 0xFF, ~ord("1") & 0xFF, 0x5E))
        port.write(b"k\r")


def test_the_port_opened_anew_by_the_next_program(serve_m1486: Serve) -> None:
    twin = serve_m1486("--variant", "B")
    for _ in range(5):
        with opened(twin, 4800) as port:
            port.write(b"u20\r")
            assert port.read(1) == b"B"
