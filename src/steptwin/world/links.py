"""Keys of ``[[line]]`` that open it for programs outside. What opens it is a transport (`steptwin.live.transports`)."""

from __future__ import annotations

from steptwin.world.reader import optional
from steptwin.world.values import address_value, text_value

LINK_KEYS = (
    optional(text_value, "pty", "path of a pseudo terminal for a live client"),
    optional(text_value, "serial", "a real serial port"),
    optional(address_value, "tcp", "HOST:PORT for live clients (Modbus TCP, or raw characters)"),
    optional(address_value, "rtu_tcp", "HOST:PORT for live clients of RTU over TCP"),
    optional(address_value, "rfc2217", "HOST:PORT of a network serial port (RFC 2217) for live clients"),
)
"""In the order in which they are opened."""
