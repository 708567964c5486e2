"""``[[line]]``: what connects controllers with their masters. Keys open it for programs outside by a transport
(`steptwin.live.transports`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from steptwin.controller import MILLISECOND, Nanos
from steptwin.durations import duration
from steptwin.errors import Misuse
from steptwin.simulation.toml.reader import Key
from steptwin.simulation.toml.table import TableSpec, key, table
from steptwin.simulation.toml.values import address_value, name_value, number, permitting, text_value, whole, word


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
    one.name: LinkKey(one)
    for one in (
        Key("pty", text_value, "path of a pseudo terminal for a live client", None),
        Key("serial", text_value, "a real serial port", None),
        Key("tcp", address_value, "HOST:PORT for live clients (Modbus TCP, or raw characters)", None),
        Key("rtu_tcp", address_value, "HOST:PORT for live clients of RTU over TCP", None),
        Key("rfc2217", address_value, "HOST:PORT of a network serial port (RFC 2217) for live clients", None),
        Key("tls_tcp", address_value, "HOST:PORT for live clients of Modbus TCP Security, such as 127.0.0.1:8802", None),
    )
}
"""By name, in the order in which they are opened. `steptwin.live.transports.register` adds to it."""

TLS_NEED = {"tls_tcp": "trusted", "trusted": "certificate", "certificate": "key", "key": "tls_tcp"}
"""In a circle: each needs all."""


class TlsFiles(NamedTuple):
    """Files for encrypted connections: PEM files, and a folder of them."""

    certificate: str
    key: str
    trusted: str


MOST_GAP_MS = 10_000


@permitting("more than 0 to 10000 ms: number of ms, or text with unit")
def _gap(value: Any) -> Nanos:
    """Milliseconds, as the command line takes them, or a text such as ``"5 ms"``."""
    found = duration(value) if isinstance(value, str) else round(number(0.0, MOST_GAP_MS, above=True)(value) * MILLISECOND)
    if not 0 < found <= MOST_GAP_MS * MILLISECOND:
        raise Misuse(f"{value!r}: permitted are more than 0 and at most {MOST_GAP_MS} ms")
    return found


@table("[[line]]")
class LineSpec(TableSpec):
    """``links``: addresses of its external links, by key."""

    name: str = key(name_value, "how controllers and scripts name it")
    kind: str = key(text_value, "", default="modbus")
    baud: int | None = key(
        whole(300, 1_000_000), "bit/s; default that of the first controller, the highest of the chips", default=None
    )
    timing: str = key(
        word("real", "strict", "off"),
        "real: characters take their time; strict (modbus): and a pause above 750 us drops a frame; off",
        default="off",
    )
    gap: Nanos | None = key(
        _gap, "silence in ms after which bytes of no frame are given up; default 0.75 on a serial port, else 20", default=None
    )
    certificate: str | None = key(text_value, "tls_tcp: file with the certificate of this line, PEM", default=None)
    key_file: str | None = key(text_value, "tls_tcp: file with its key, PEM", default=None, name="key")
    trusted: str | None = key(
        text_value,
        "tls_tcp: folder with the certificates of clients, or of those who sign them (.pem)",
        default=None,
    )
    links: Mapping[str, str]

    @property
    def is_open(self) -> bool:
        """Whether it has external links."""
        return bool(self.links)

    @property
    def tls(self) -> TlsFiles | None:
        """Files of encrypted links, relative to the description."""
        if self.certificate is None or self.key_file is None or self.trusted is None:
            return None
        return TlsFiles(self.certificate, self.key_file, self.trusted)
