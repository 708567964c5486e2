"""The traffic of a line of M1486 chips in words: what is an echo, what an upload, what neither."""

from __future__ import annotations

import pytest

from steptwin.controller import MILLISECOND
from steptwin.drivers.m1486.decoder import M1486Decoder
from steptwin.wire.frameline import FrameLine
from steptwin.wire.slave import FrameDirection

DIRECTIONS = {">": FrameDirection.IN, "<": FrameDirection.OUT, "-": None}


def decoded(*heard: tuple[str, str]) -> list[str]:
    """What a decoder says of characters typed (``>``), come (``<``) and on one wire (``-``), one millisecond after the other,
    with a silence (``.``) to its end, or of so many milliseconds (``.100``): the millisecond, direction, bytes, link and
    meaning."""
    frames: list[FrameLine] = []
    decoder = M1486Decoder(frames.append, "A")
    now = 0
    for what, text in heard:
        now += MILLISECOND
        if what.startswith(".") and what != ".":
            now += int(what[1:]) * MILLISECOND
        elif what == ".":
            due = decoder.deadline()
            assert due is not None
            decoder.expire(due - 1)
            assert decoder.deadline() == due
            decoder.expire(now := due)
        else:
            decoder.feed(text.encode("latin-1"), now, DIRECTIONS[what])
    return [" ".join(filter(None, map(str, shown(frame)))) for frame in frames]


def shown(frame: FrameLine) -> tuple[object, ...]:
    arrow = ">" if frame.direction is FrameDirection.IN else "<"
    return frame.time // MILLISECOND, arrow, frame.raw.decode("latin-1").replace("\r", "←"), frame.link, frame.meaning


def test_the_echo_is_told_once_for_a_line_and_is_no_upload() -> None:
    assert decoded((">", "u16\ru2\r"), ("<", "u16\r\x01"), ("<", "u2\r2")) == [
        "1 > u16← U16  Upload 16",
        "1 > u2← U2  Upload 2",
        r"2 < u16← echo of 'u16\r'",
        "2 < \x01 U16 production series = 1",
        r"3 < u2← echo of 'u2\r'",
        "3 < 2 U2 position, middle byte = 50",
    ]


def test_the_echo_of_characters_typed_by_hand_ends_with_a_silence() -> None:
    by_hand = decoded((">", "u1"), ("<", "u"), ("<", "1"), (".", ""), (">", "6\r"), ("<", "6\r\x01"))
    assert by_hand == [
        "3 < u1 echo of 'u1'",
        "104 > u16← U16  Upload 16",
        r"105 < 6← echo of '6\r'",
        "105 < \x01 U16 production series = 1",
    ]


def test_what_was_typed_before_the_echo_was_on() -> None:
    assert decoded((">", "x7\rt41\rv5\r"), ("<", "v5\r"))[3:] == [r"2 < v5← echo of 'v5\r'"]


def test_an_upload_that_looks_like_an_echo() -> None:
    without_echo = decoded((">", "v100\ru2\r"), ("<", "v"), (".", ""), (">", "u3\r"), ("<", "u"), (".", ""))
    assert without_echo == [
        "1 > v100← V100  Velocity 100 step/s",
        "1 > u2← U2  Upload 2",
        "2 < v U2 position, middle byte = 118",
        "103 > u3← U3  Upload 3",
        "104 < u U3 position, high byte = 117",
    ]
    assert decoded((">", "u2\ru3\r"), ("<", "u\x07"))[2:] == [
        "2 < u U2 position, middle byte = 117",
        "2 < \x07 U3 position, high byte = 7",
    ]


@pytest.mark.parametrize(("silence_ms", "is_echo"), [(97, False), (98, True)])
def test_what_was_typed_long_ago_is_not_echoed_any_more(silence_ms: int, *, is_echo: bool) -> None:
    """Function 41 was OFF until then; 100 ms from one byte to the next."""
    heard = decoded((">", "u1\rt41\r"), ("<", "\x05"), (f".{silence_ms}", ""), (">", "u2\r"), ("<", "u2\r\x07"))
    assert heard[2] == "2 < \x05 U1 position, low byte = 5"
    now = 5 + silence_ms
    as_echo = [rf"{now} < u2← echo of 'u2\r'", f"{now} < \x07 U2 position, middle byte = 7"]
    assert (heard[4:] == as_echo) is is_echo


def test_an_upload_between_the_characters_of_an_echo() -> None:
    """Its command was typed ahead of the next one, and came back whole."""
    assert decoded((">", "u16\ru2\r"), ("<", "u16\ru2\x01\r\x07"))[2:] == [
        r"2 < u16← echo of 'u16\r'",
        "2 < \x01 U16 production series = 1",
        r"2 < u2← echo of 'u2\r'",
        "2 < \x07 U2 position, middle byte = 7",
    ]


def test_bytes_behind_an_upload_that_are_more_than_were_asked_for() -> None:
    """The comparison with the echo had begun; one of its bytes was the upload, the other came from nowhere."""
    assert decoded((">", "u20\rv5\r"), ("<", "u2"), (".", ""), ("<", "B"))[2:] == [
        "2 < u U20 type letter in ASCII = 117",
        "2 < 2 line echo of '2'",
        "103 < B 'B' where 'v' was typed: a garbled echo, or that of several chips at once",
    ]
    assert decoded((">", "u99\r"), ("<", "\x01"))[1:] == ["2 < \x01 U99 reserved = 1"]


def test_what_several_chips_of_a_line_echo_at_once() -> None:
    assert decoded((">", "urz"), ("<", "ppz"), (".", "")) == [
        "2 < p 'p' where 'u' was typed: a garbled echo, or that of several chips at once",
        "2 < p 'p' where 'r' was typed: a garbled echo, or that of several chips at once",
        "2 < z echo of 'z'",
    ]


def test_reports_of_the_input_buffer_are_no_garbled_echo() -> None:
    """5EH, 7FH, and a character inverted among the last three places, between the echoes."""
    assert decoded((">", "v5\r"), ("<", "v"), ("<", "\x89"), ("<", "^"), ("<", "\x7f"), ("<", "5\r")) == [
        "1 > v5← V5  out of range",
        "2 < v echo of 'v'",
        "3 < \x89 line 'v' inverted: it took one of the last three places of the input buffer",
        "4 < ^ line no room in the input buffer: a character is lost",
        "5 < \x7f line the input buffer is empty",
        r"6 < 5← echo of '5\r'",
    ]
    assert decoded((">", "v5"), ("<", "\x80"))[-1].startswith("2 < \x80 line '\\x7f' inverted")


def test_everything_on_one_wire_is_decoded_as_commands() -> None:
    assert decoded(("-", "u1\r"), ("-", "r\r")) == ["1 > u1← U1  Upload 1", "2 > r← R  Run"]


def test_only_what_was_typed_last_is_compared_with_the_echo() -> None:
    """Far more than an input buffer holds: 4096 characters."""
    assert decoded((">", "+" + "5" * 4096), ("<", "+"), ("<", "5"), (".", ""))[-2:] == [
        "2 < + '+' where '5' was typed: a garbled echo, or that of several chips at once",
        "3 < 5 echo of '5'",
    ]
    assert decoded((">", "+" + "5" * 4095), ("<", "+"), (".", ""))[-1] == "2 < + echo of '+'"


def test_what_function_57_reports_is_no_upload() -> None:
    """7FH and 7EH are no letters of a type; other bytes may be the same, so it counts whether reports were seen or switched."""
    assert decoded((">", "u20\r"), ("<", "u20\r\x7fB"), (">", "u1\r"), ("<", "u1\r\x7f\x7f"), (">", "c57\ru1\r"), ("<", "\x7f"))[
        2:
    ] == [
        "2 < \x7f line the input buffer is empty",
        "2 < B U20 type letter in ASCII = 66",
        "3 > u1← U1  Upload 1",
        r"4 < u1← echo of 'u1\r'",
        "4 < \x7f line the input buffer is empty",
        "4 < \x7f U1 position, low byte = 127",
        "5 > c57← C57  Function off 57",
        "5 > u1← U1  Upload 1",
        "6 < \x7f U1 position, low byte = 127",
    ]
