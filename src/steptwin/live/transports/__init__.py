"""Transports: the ways in which programs reach a line. Each is a file here and a row in `steptwin.world.links`."""

from __future__ import annotations

from steptwin.live.transports.contract import LinkArguments, OpenLink, Transport
from steptwin.live.transports.pty import PTY
from steptwin.live.transports.rfc2217 import RFC2217
from steptwin.live.transports.serial import SERIAL
from steptwin.live.transports.tcp import RTU_TCP, TCP, VISION
from steptwin.live.transports.tls import TLS_TCP
from steptwin.tables import complete
from steptwin.world.links import LINK_KEYS

TRANSPORTS = complete(
    "key of [[line]]",
    [key.name for key in LINK_KEYS],
    "transport",
    {"tcp": TCP, "rtu_tcp": RTU_TCP, "rfc2217": RFC2217, "pty": PTY, "serial": SERIAL, "tls_tcp": TLS_TCP},
)
"""By the key of ``[[line]]`` that opens it."""

__all__ = ["TRANSPORTS", "VISION", "LinkArguments", "OpenLink", "Transport"]
