"""A frame on a line as text: time, link, direction, bytes and meaning."""

from __future__ import annotations

from typing import NamedTuple

from steptwin.controller import SECOND, Nanos
from steptwin.wire.slave import FrameDirection


class FrameLine(NamedTuple):
    """One frame; its text is a line of a log."""

    time: Nanos
    link: str
    direction: FrameDirection
    raw: bytes
    meaning: str

    def __str__(self) -> str:
        arrow = "→" if self.direction is FrameDirection.IN else "←"
        raw = f"{self.raw.hex(' ')}  " if self.raw else ""
        return f"{self.time / SECOND:12.6f} s  {self.link:<7} {arrow} {raw}{self.meaning}"
