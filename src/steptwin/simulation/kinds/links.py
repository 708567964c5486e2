"""Keys of ``[[line]]`` that open it for programs outside. What opens it is a transport (`steptwin.live.transports`)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from steptwin.simulation.toml.reader import Key, optional
from steptwin.simulation.toml.values import address_value, text_value


@dataclass(frozen=True, slots=True)
class LinkKey:
    """A key of ``[[line]]`` that opens it."""

    key: Key
    like: str | None = None
    """Another one. A kind of line that has no row for this one in its `steptwin.simulation.kinds.kind.LineKind.links` carries
    the same bytes over both. None: such a line cannot be opened so."""

    @property
    def name(self) -> str:
        return self.key.name


LINK_KEYS: dict[str, LinkKey] = {
    key.name: LinkKey(key)
    for key in (
        optional(text_value, "pty", "path of a pseudo terminal for a live client"),
        optional(text_value, "serial", "a real serial port"),
        optional(address_value, "tcp", "HOST:PORT for live clients (Modbus TCP, or raw characters)"),
        optional(address_value, "rtu_tcp", "HOST:PORT for live clients of RTU over TCP"),
        optional(address_value, "rfc2217", "HOST:PORT of a network serial port (RFC 2217) for live clients"),
        optional(address_value, "tls_tcp", "HOST:PORT for live clients of Modbus TCP Security, such as 127.0.0.1:8802"),
    )
}
"""By name, in the order in which they are opened. `steptwin.live.transports.register` adds to it."""

TLS_KEYS = (
    optional(text_value, "certificate", "tls_tcp: file with the certificate of this line, PEM"),
    optional(text_value, "key", "tls_tcp: file with its key, PEM"),
    optional(text_value, "trusted", "tls_tcp: folder with the certificates of clients, or of those who sign them (.pem)"),
)
TLS_NEED = {"tls_tcp": "trusted", "trusted": "certificate", "certificate": "key", "key": "tls_tcp"}
"""In a circle: each needs all."""


class TlsFiles(NamedTuple):
    """What encrypted connections need: PEM files, and a folder of them."""

    certificate: str
    key: str
    trusted: str
