"""A frame as a line of text."""

from __future__ import annotations

from steptwin.wire.frameline import FrameLine
from steptwin.wire.slave import FrameDirection


def test_time_link_direction_bytes_and_meaning() -> None:
    """The arrow points to the controller for what it receives."""
    asked = FrameLine(1_500_000_000, "com1", FrameDirection.IN, b"\x01\x03", "read")
    assert str(asked) == "    1.500000 s  com1    → 01 03  read"
    assert str(asked._replace(direction=FrameDirection.OUT)) == "    1.500000 s  com1    ← 01 03  read"


def test_without_bytes_the_meaning_is_all() -> None:
    assert str(FrameLine(0, "tcp", FrameDirection.IN, b"", "3 bytes that belong to no frame")) == (
        "    0.000000 s  tcp     → 3 bytes that belong to no frame"
    )
