"""The contract of a transport, a way in which programs reach a line; one for each key in `steptwin.simulation.kinds.links`."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from steptwin.access.audit import CommandLog
from steptwin.controller import Port
from steptwin.live.clients import Clients
from steptwin.live.links import Link
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.rfc2217 import TwinLine
from steptwin.simulation.kinds.links import TlsFiles


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkArguments:
    """The arguments for opening a link."""

    where: str
    """The value of the key: an address, a path, a device."""
    make_port: Callable[[], Port]
    """A port of the line for one more program."""
    line: TwinLine
    """Present rate and timing of the line, and where events of the link are shown."""
    realtime: RealTimeDriver
    """The real-time driver that takes received bytes as inputs."""
    clients: Clients
    """All clients over TCP, of which there is a limit."""
    listen_any: bool = False
    """Whether addresses that other computers can reach are permitted."""
    tls: TlsFiles | None = None
    """Certificates, for those that encrypt; relative to ``folder``."""
    folder: Path = Path()
    audit: CommandLog | None = None
    """Records the writes of clients that prove who they are."""
    line_name: str = ""


@dataclass(frozen=True, slots=True)
class OpenLink:
    """An open link. ``place`` is its address as text, ``details`` as fields."""

    link: Link
    place: str
    details: Mapping[str, object]


@dataclass(frozen=True, slots=True, kw_only=True)
class Transport:
    kind: str
    """Kind of its end points: ``rtu-tcp``."""
    is_address: bool
    """Whether the value of its key is an address on which it listens."""
    has_several: bool
    """Whether several programs may use it at once; else one after the other."""
    open: Callable[[LinkArguments], Awaitable[OpenLink]]
    """Opens the link. Raises `LineFailure`, or `Misuse` for an invalid value or a kind of link that the system lacks."""
