"""Where requests of browsers may come from.

A page of another site can have a browser ask a server on this computer, under that site's name (DNS rebinding) or across
sites. So the header Host must name the server, and Origin, which browsers send with WebSockets and with what changes
something, must be the server itself.
"""

from __future__ import annotations

from collections.abc import Iterable
from ipaddress import ip_address

from steptwin.errors import Refusal
from steptwin.messages import Message

LOCAL_NAMES = ("localhost", "127.0.0.1", "[::1]")
MOST_SHOWN = 80
"""Characters of a header in a message."""


UNKNOWN_HOST = Message("access.unknown-host", "unknown host name {host}; use {names}")
OTHER_ORIGIN = Message("access.other-origin", "Origin {origin} is another site; only pages of this studio may ask it")


class Origins:
    """Origins of a server at ``port``. ``names``: host names under which it may be asked, besides those of this computer.

    ``by_address``: also by any address in numbers, which no site can have for a name. ``has_tls``: it is asked with https.
    """

    def __init__(self, port: int, names: Iterable[str] = (), *, by_address: bool = False, has_tls: bool = False) -> None:
        self._scheme, usual = ("https", 443) if has_tls else ("http", 80)
        self._ends = {f":{port}", *([""] if port == usual else [])}
        hosts = {name.lower() for name in (*LOCAL_NAMES, *names)}
        self._hosts = {f"{host}{end}" for host in hosts for end in self._ends}
        self._by_address = by_address

    def check(self, host: str | None, origin: str | None) -> None:
        """Raises `Refusal` for headers that do not belong to this server. Who sends no Origin is no browser, or asks nothing that
        changes anything."""
        if host is None or not (host.lower() in self._hosts or (self._by_address and self._is_address(host))):
            raise Refusal(UNKNOWN_HOST(host=_short(host), names=sorted(self._hosts)))
        if origin is not None and origin.lower() != f"{self._scheme}://{host.lower()}":
            raise Refusal(OTHER_ORIGIN(origin=_short(origin)))

    def _is_address(self, host: str) -> bool:
        name, _, port = host.rpartition(":") if host[-1:].isdigit() and ":" in host.rpartition("]")[2] else (host, "", "")
        try:
            ip_address(name.removeprefix("[").removesuffix("]"))
        except ValueError:
            return False
        return (f":{port}" if port else "") in self._ends


def _short(text: str | None) -> str:
    return "(none)" if text is None else repr(text[:MOST_SHOWN])
