"""Addresses at which lines listen for network clients."""

from __future__ import annotations

import ipaddress
from collections.abc import Iterable
from typing import NamedTuple

from steptwin.errors import Misuse
from steptwin.numerals import read_whole

LOOPBACK = "127.0.0.1"


class Address(NamedTuple):
    host: str
    port: int

    def __str__(self) -> str:
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"


def parse_address(text: str, *, listen_any: bool) -> Address:
    """``HOST:PORT`` (port 0: any free one). Only loopback unless ``listen_any``: Modbus has no authentication."""
    host, colon, port = text.rpartition(":")
    number = read_whole(port)
    host = host.strip("[]")
    if host in ("", "localhost"):
        host = LOOPBACK  # one address: port 0 would be two ports on the two that "localhost" has
    if not colon or number is None or number > 65535:
        raise Misuse(f"{text!r} is not an address: expected HOST:PORT with a port from 0 to 65535, such as 127.0.0.1:5020")
    if not listen_any and not is_loopback(host):
        raise Misuse(
            f"{host} is not a loopback address: the protocols served here have no authentication, every program that reaches the "
            "port can move the axes; --listen-any permits it"
        )
    return Address(host, number)


def check_addresses(given: Iterable[str | None], *, listen_any: bool) -> None:
    """Raises `Misuse` for what `parse_address` refuses, and for ``--listen-any`` where no address needs it."""
    addresses = [parse_address(text, listen_any=listen_any) for text in given if text is not None]
    if listen_any and all(is_loopback(address.host) for address in addresses):
        where = ", ".join(map(str, addresses)) or "none"
        raise Misuse(
            f"--listen-any permits addresses that others can reach, but there is none (addresses: {where}); "
            "0.0.0.0:PORT is reached from all networks"
        )


def is_loopback(host: str) -> bool:
    """Whether an address is reached from this computer alone."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
