"""Transports: the ways in which programs reach a line. Each is a file here and a row in `steptwin.simulation.kinds.links`. A
program with a transport of its own registers it before it reads a description: `register`."""

from __future__ import annotations

from steptwin.errors import Misuse
from steptwin.live.transports.contract import LinkArguments, OpenLink, Transport
from steptwin.live.transports.pty import PTY
from steptwin.live.transports.rfc2217 import RFC2217
from steptwin.live.transports.serial import SERIAL
from steptwin.live.transports.tcp import RTU_TCP, TCP, VISION
from steptwin.live.transports.tls import TLS_TCP
from steptwin.simulation.kinds.links import LINK_KEYS, LinkKey
from steptwin.tables import complete

TRANSPORTS: dict[str, Transport] = dict(
    complete(
        "key of [[line]]",
        LINK_KEYS,
        "transport",
        {"tcp": TCP, "rtu_tcp": RTU_TCP, "rfc2217": RFC2217, "pty": PTY, "serial": SERIAL, "tls_tcp": TLS_TCP},
    )
)
"""By the key of ``[[line]]`` that opens it."""


def register(key: LinkKey, transport: Transport) -> None:
    """Let lines of descriptions be opened in one more way from now on. Raises `Misuse` for a name that is taken."""
    if key.name in LINK_KEYS:
        raise Misuse(f"there is a key {key.name!r} of [[line]] already")
    LINK_KEYS[key.name] = key
    TRANSPORTS[key.name] = transport


def forget(name: str) -> None:
    """Undo `register`."""
    del LINK_KEYS[name], TRANSPORTS[name]


__all__ = ["TRANSPORTS", "VISION", "LinkArguments", "OpenLink", "Transport", "forget", "register"]
