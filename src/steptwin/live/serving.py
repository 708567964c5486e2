"""The common options of commands that serve twins."""

from __future__ import annotations

import os

from steptwin.errors import Misuse
from steptwin.live.output import Output

LONGEST_NAME = 40
"""Paths of sockets are short: about 100 characters in all."""


def check_name(name: str) -> None:
    if not LONGEST_NAME >= len(name) > 0 or not name.replace("-", "").replace("_", "").isalnum():
        raise Misuse(f"--name {name!r}: permitted are 1 to {LONGEST_NAME} letters, digits, '-' and '_'")


def check_line_timing(wanted: str, *real: str) -> None:
    """`Misuse` unless ``wanted`` is one of the ways of ``real`` timing or ``off``."""
    if wanted not in (*real, "off"):
        raise Misuse(f"--line-timing {wanted}: permitted are {', '.join(map(repr, real))} and 'off'")


def shows_live_view(output: Output, *, log_frames: bool) -> bool:
    """Whether ``output`` is a terminal to draw on, and no frames are to be shown there."""
    return output.isatty() and not log_frames and os.environ.get("TERM", "dumb") not in ("dumb", "unknown")
