"""``[gateway.NAME]``: protocols through which other programs see the controllers of a world.

The tables are here; what serves them is in `steptwin.gateways`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from steptwin.machine import MILLISECOND, Nanos
from steptwin.world.reader import Key, TomlText, optional, read_table
from steptwin.world.sense import TableRows, check_sense
from steptwin.world.tomlplaces import Path
from steptwin.world.values import address_value, positive_time, text_value, texts, word

GATEWAY = "gateway"
APPLICATION_URI = "urn:steptwin:opcua"
"""Of the OPC UA server; its certificate has it, too (OPC 10000-6, 6.2.2)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GatewaySpec:
    """A gateway as its table describes it; each kind with further keys has a class of its own."""

    kind: str
    listen: str
    """HOST:PORT where it is reached."""
    path: Path = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class OpcUaSpec(GatewaySpec):
    """Files are relative to the description."""

    interval: Nanos
    """How often values that clients subscribe to are looked at, ns."""
    registers: tuple[str, ...]
    """Further points to show: ``MACHINE.POINT``."""
    security: str
    """What connections need at least: ``none``, ``sign``, ``encrypt``."""
    certificate: str | None
    key: str | None
    """Of the server, both PEM."""
    trusted: str | None
    """A folder with the certificates of clients that are admitted; all are where it is None."""
    tokens: str | None
    """A file with tokens (`steptwin.access.tokens`), which are passwords of users."""


class _Kind(NamedTuple):
    rows: TableRows
    make: Callable[..., GatewaySpec]


def _rows(kind: str, listen: str, *keys: Key, need: Mapping[str, str] | None = None) -> TableRows:
    where = optional(address_value, "listen", "HOST:PORT where it is reached", listen)
    return TableRows(written=f"[{GATEWAY}.{kind}]", keys=(where, *keys), need=need or {})


_KINDS: Mapping[str, _Kind] = {
    "prometheus": _Kind(_rows("prometheus", "127.0.0.1:9488"), GatewaySpec),
    "opcua": _Kind(
        _rows(
            "opcua",
            "127.0.0.1:4840",
            optional(positive_time, "interval", "how often values are looked at that clients subscribe to", 100 * MILLISECOND),
            optional(texts, "registers", "further points to show: MACHINE.POINT, such as table.USER_REGISTER[5]", ()),
            optional(word("none", "sign", "encrypt"), "security", "what connections need at least", "none"),
            optional(text_value, "certificate", "file with the certificate of the server, PEM"),
            optional(text_value, "key", "file with its key, PEM"),
            optional(text_value, "trusted", "folder with certificates of clients; only these are admitted"),
            optional(text_value, "tokens", "file with lines ROLE NAME TOKEN; the token is the password of a user"),
            need={"certificate": "key", "key": "certificate", "trusted": "certificate"},
        ),
        OpcUaSpec,
    ),
}

GATEWAYS: Mapping[str, TableRows] = {name: kind.rows for name, kind in _KINDS.items()}
"""The tables of each kind of gateway."""


def read_gateways(text: TomlText) -> Iterator[GatewaySpec]:
    """The gateways of a description; errors are added to ``text``."""
    given = text.data.get(GATEWAY, {})
    if not isinstance(given, Mapping):
        text.wrong((GATEWAY,), "D002", f"[{GATEWAY}] is {given!r}", f"expected tables: {_written()}")
        return
    for kind, table in given.items():
        path = (GATEWAY, kind)
        if kind in GATEWAYS:
            rows = GATEWAYS[kind]
            values = read_table(text, path, table, rows.keys)
            check_sense(text, path, rows, table)
            yield _KINDS[kind].make(kind=kind, path=path, **values)
        else:
            fix = text.key_replacement(path, kind, list(GATEWAYS))
            near = text.near(kind, list(GATEWAYS))
            text.wrong(path, "D004", f"there is no [{GATEWAY}.{kind}]{near}", f"permitted: {_written()}", fix)


def _written() -> str:
    return ", ".join(rows.written for rows in GATEWAYS.values())
