"""Text goes out in order, and a reader that stops or leaves stops nobody."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from typing import TextIO

import pytest

from steptwin.live import output
from steptwin.live.output import Output


class Pipe:
    def __init__(self) -> None:
        self.reading, writing = os.pipe()
        self.stream: TextIO = os.fdopen(writing, "w", encoding="utf-8")

    def read_all(self) -> str:
        """Everything up to the end of the stream."""
        self.stream.close()
        with os.fdopen(self.reading, encoding="utf-8") as file:
            return file.read()


@pytest.fixture
def pipe() -> Iterator[Pipe]:
    made = Pipe()
    yield made
    made.stream.close()


def test_lines_come_out_in_order(pipe: Pipe) -> None:
    pipe.stream.write("before\n")
    out = Output(pipe.stream)
    for number in range(1000):
        out.line(f"line {number} →")
    out.close()
    assert pipe.read_all().splitlines() == ["before", *(f"line {number} →" for number in range(1000))]


def test_a_reader_that_stops_stops_nobody_and_is_told_what_he_missed(pipe: Pipe, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(output, "MOST_WAITING", 10)
    monkeypatch.setattr(output, "PATIENCE_S", 100.0)
    out = Output(pipe.stream)
    filling = "x" * 200_000  # more than a pipe holds
    out.line(filling)
    while out._waiting.qsize():  # the thread has it and hangs
        time.sleep(0.001)
    started = time.monotonic()
    for number in range(25):
        out.line(f"line {number}")
    assert time.monotonic() - started < 50.0
    text = ""
    while "left out" not in text:
        text += os.read(pipe.reading, 65536).decode()
    out.close()
    assert text.splitlines() == [filling, *(f"line {number}" for number in range(10)), "(15 lines left out: they were not read)"]
    os.close(pipe.reading)


def test_a_reader_that_has_stopped_does_not_hold_up_the_end(pipe: Pipe, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(output, "PATIENCE_S", 0.05)
    out = Output(pipe.stream)
    out.line("x" * 200_000)
    started = time.monotonic()
    out.close()
    assert time.monotonic() - started < 50.0
    os.close(pipe.reading)


def test_a_reader_that_has_left_is_no_error(pipe: Pipe) -> None:
    out = Output(pipe.stream)
    os.close(pipe.reading)
    for _ in range(100):
        out.line("nobody reads this")
    out.close()
    out.line("nor this")
    with pytest.raises(BrokenPipeError):
        os.write(pipe.stream.fileno(), b"the reader has left")


def test_a_stream_somebody_made_non_blocking(pipe: Pipe) -> None:
    os.set_blocking(pipe.stream.fileno(), False)
    out = Output(pipe.stream)
    out.line("x" * 200_000)
    text = b""
    while not text.endswith(b"\n"):
        text += os.read(pipe.reading, 65536)
    out.close()
    assert len(text) == 200_001
    os.close(pipe.reading)


def test_what_the_encoding_cannot_say_is_replaced() -> None:
    reading, writing = os.pipe()
    with os.fdopen(writing, "w", encoding="ascii") as stream:
        out = Output(stream)
        out.line("→ ok")
        out.close()
    with os.fdopen(reading) as file:
        assert file.read() == "? ok\n"


def test_no_output_at_all() -> None:
    out = Output(None)
    out.line("into the void")
    out.close()
    assert not out.isatty()


def test_a_file_for_rich(pipe: Pipe) -> None:
    out = Output(pipe.stream)
    assert out.write("abc") == 3
    out.flush()
    assert not out.isatty()
    out.close()
    assert pipe.read_all() == "abc"
