"""Characters on a line in words: names of commands from the manual's chapter VII, what chips send from chapter II."""

from __future__ import annotations

import pytest

from steptwin.controller import SECOND
from steptwin.m1486.characterlog import CharacterLog, LineSplitter
from steptwin.m1486.variants import variant
from steptwin.wire.frameline import FrameLine
from steptwin.wire.slave import FrameDirection


def logged(kind: str = "B") -> tuple[CharacterLog, list[FrameLine]]:
    log, lines = CharacterLog(variant(kind)), list[FrameLine]()
    log.sinks.append(lines.append)
    return log, lines


def words(text: str, kind: str = "B") -> str:
    log, lines = logged(kind)
    log.received(0, "tcp", text.encode("latin-1"))
    (line,) = lines
    return line.meaning


@pytest.mark.parametrize(
    ("typed", "meaning"),
    [
        ("r\r", "R  Run"),
        ("V1200\r", "V1200  Velocity 1200 step/s"),
        ("f12800\r", "F12800  Forward 12 800 min. microsteps"),
        ("xA\r", "XA  indeX A"),
        ("i3H12\r", "I3H12  If line 3 is high go to 12"),
        ("i3l12\r", "I3L12  If line 3 is low go to 12"),
        ("i80h1\r", "I80H1  If flag 80 is high go to 1"),
        ("i21h1\r", "I21H1  If line 21 is high go to 1"),
        ("f\r", "F  with the internal variable as number"),
        ("v20001\r", "V20001  out of range"),
        ("; start\r", "a comment"),
        ("\r", "an empty line"),
        ("\n \r", "an empty line"),
        ("12", "2 characters without CR"),
        ("\0r\r", "\0r  no command begins with NUL; the sender ends lines with CR NUL"),
    ],
)
def test_what_a_host_types(typed: str, meaning: str) -> None:
    assert words(typed) == meaning


def test_a_line_that_is_no_command_has_its_text_and_the_reason() -> None:
    text = words("%5\r")
    assert text.startswith("%5  ")
    assert "'%'" in text


def test_labels_are_those_of_the_type() -> None:
    """An A has labels 1 to 15, a B 1 to 80."""
    assert words("@16\r", "A") == "@16  out of range"
    assert words("@16\r", "B").startswith("@16  Address 16")


@pytest.mark.parametrize(
    ("byte", "meaning"),
    [
        (0x5E, "no room in the input buffer: a character is lost"),
        (0x7F, "the input buffer is empty"),
        (0x7E, "three places are free in the input buffer"),
        (ord("r"), "echo of 'r'"),
        (0x7D, "echo of '}'"),
        (~ord("R") & 0xFF, "'R' inverted: it took one of the last three places of the input buffer"),
        (0x80, r"'\x7f' inverted: it took one of the last three places of the input buffer"),
    ],
)
def test_what_chips_send_unasked(byte: int, meaning: str) -> None:
    log, lines = logged()
    log.sent(5 * SECOND, byte)
    assert lines == [FrameLine(5 * SECOND, "line", FrameDirection.OUT, bytes((byte,)), meaning)]


def test_uploaded_bytes_are_named_in_the_order_in_which_they_are_announced() -> None:
    """A byte that was lost on the line does not name the next one; one that was not announced is what it says by itself."""
    log, lines = logged()
    for command, byte in ((1, 10), (2, 20), (3, 10), (7, 0)):
        log.upload(command, byte)
    for byte in (20, 10, 0, 10):
        log.sent(0, byte)
    assert [line.meaning for line in lines] == [
        "U2 position, middle byte = 20",
        "U3 position, high byte = 10",
        "U7 reserved = 0",
        r"echo of '\n'",
    ]


def test_what_is_typed_is_cut_into_lines() -> None:
    """Each with its CR and the moment of its end; what has no CR yet waits."""
    log, lines = logged()
    splitter = LineSplitter(log, "tcp1")
    splitter.take(b"v1", 1)
    splitter.take(b"00\rr\rf", 2)
    assert lines == [
        FrameLine(2, "tcp1", FrameDirection.IN, b"v100\r", "V100  Velocity 100 step/s"),
        FrameLine(2, "tcp1", FrameDirection.IN, b"r\r", "R  Run"),
    ]
    splitter.take(b"64\r", 3)
    assert lines[2:] == [FrameLine(3, "tcp1", FrameDirection.IN, b"f64\r", "F64  Forward 64 min. microsteps")]


def test_characters_without_cr_are_shown_when_they_are_too_many() -> None:
    log, lines = logged()
    splitter = LineSplitter(log, "pty")
    splitter.take(b"a" * 256, 1)
    assert lines == []
    splitter.take(b"a", 2)
    assert [(line.time, line.raw, line.meaning) for line in lines] == [(2, b"a" * 257, "257 characters without CR")]
    splitter.take(b"r\r", 3)
    assert lines[1].raw == b"r\r"


def test_of_bytes_that_never_come_the_last_1000_are_awaited() -> None:
    log, lines = logged()
    for byte in (1, 2):
        log.upload(1, byte)
    for _ in range(999):
        log.upload(2, 3)
    for byte in (1, 2):
        log.sent(0, byte)
    assert [line.meaning.split(" ")[0] for line in lines] == ["echo", "U1"]


def test_a_host_that_ends_its_lines_with_line_feeds_is_noticed_at_the_second() -> None:
    log, lines = logged()
    splitter = LineSplitter(log, "")
    for character in b"\n\nf640\n":
        splitter.take(bytes((character,)), 1)
    assert lines == []
    splitter.take(b"r\n", 2)
    assert [(line.raw, line.meaning) for line in lines] == [
        (b"\n\nf640\nr\n", "9 characters without CR: a line feed ends no command")
    ]
    splitter.take(b"r\n\r", 3)
    assert lines[1].meaning == "R  Run"
