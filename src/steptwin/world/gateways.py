"""``[gateway.NAME]``: protocols through which other programs see the controllers of a world.

The tables are here; what serves them is in `steptwin.gateways`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from steptwin.world.reader import TomlText, optional, read_table
from steptwin.world.sense import TableRows
from steptwin.world.tomlplaces import Path
from steptwin.world.values import address_value

GATEWAY = "gateway"


@dataclass(frozen=True, slots=True, kw_only=True)
class GatewaySpec:
    """A gateway as its table describes it."""

    kind: str
    listen: str
    """HOST:PORT where it is reached."""
    path: Path = ()


def _rows(kind: str, listen: str) -> TableRows:
    keys = (optional(address_value, "listen", "HOST:PORT where it is reached", listen),)
    return TableRows(written=f"[{GATEWAY}.{kind}]", keys=keys)


GATEWAYS: Mapping[str, TableRows] = {"prometheus": _rows("prometheus", "127.0.0.1:9488")}
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
            yield GatewaySpec(kind=kind, path=path, **read_table(text, path, table, GATEWAYS[kind].keys))
        else:
            fix = text.key_replacement(path, kind, list(GATEWAYS))
            near = text.near(kind, list(GATEWAYS))
            text.wrong(path, "D004", f"there is no [{GATEWAY}.{kind}]{near}", f"permitted: {_written()}", fix)


def _written() -> str:
    return ", ".join(rows.written for rows in GATEWAYS.values())
