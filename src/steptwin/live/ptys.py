"""Pseudo terminals where the system has them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from steptwin.controller import Port
from steptwin.errors import Misuse
from steptwin.live.links import PathLink
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.system import HAS_PTYS


def pty_link(realtime: RealTimeDriver, path: Path, make_port: Callable[[], Port]) -> PathLink:
    """A link at ``path``, not yet open. Raises `Misuse` on a system without pseudo terminals."""
    if not HAS_PTYS:
        raise Misuse(
            f"cannot make a pseudo terminal at {path}: they exist on Linux and macOS only; use TCP, RTU over TCP or a network "
            "serial port (RFC 2217)"
        )
    from steptwin.live.pty import PtyLink

    return PtyLink(realtime, path, make_port)
