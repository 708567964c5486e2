"""Services beside a world, by their tables in descriptions: gateways, and the history.

With this module imported, reading a description checks these tables. Rooms that check, edit and serve descriptions import it.
"""

from __future__ import annotations

from typing import NamedTuple

from steptwin.gateways.kinds import GATEWAY_TABLES, read_gateways
from steptwin.gateways.options import GatewaySpec
from steptwin.history.options import HISTORY_TABLE, HistorySpec, read_history
from steptwin.simulation.describe.servicetables import register
from steptwin.simulation.toml.reader import TomlText

for _one in (HISTORY_TABLE, GATEWAY_TABLES):
    register(_one)


class Services(NamedTuple):
    """Services for which the tables of a description ask."""

    gateways: tuple[GatewaySpec, ...]
    history: HistorySpec | None


def read_services(text: TomlText) -> Services:
    """The services of a description; errors are added to ``text``."""
    return Services(read_gateways(text), read_history(text))
