"""HistoryRead: what the history beside the server has kept."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime

from asyncua import ua
from asyncua.server.history import HistoryDict

from steptwin.errors import LineFailure, Misuse
from steptwin.gateways.contract import PastValues
from steptwin.gateways.opcua.addressspace import PointNode
from steptwin.gateways.opcua.nodetypes import data_value

MOST = 10_000
"""Values in an answer; a client gets the rest with its continuation point."""


class PastNodes(HistoryDict):
    """Reads the variables ``nodes``, with their controllers, from ``past``; what is kept is not the business of the library."""

    def __init__(self, past: PastValues, nodes: Mapping[ua.NodeId, tuple[str, PointNode]]) -> None:
        super().__init__()
        self._past = past
        self._nodes = nodes

    async def read_node_history(
        self, node_id: ua.NodeId, start: datetime | None, end: datetime | None, nb_values: int
    ) -> tuple[list[ua.DataValue], datetime | None]:
        """Backwards where the end is before the start, or the start is missing (OPC 10000-11, 6.4.3)."""
        found = self._nodes.get(node_id)
        if found is None:
            raise ua.UaStatusCodeError(ua.StatusCodes.BadHistoryOperationUnsupported)
        machine, node = found
        first, last = _moment(start), _moment(end)
        is_backwards = first is None or (last is not None and last < first)
        low, high = (last, first) if is_backwards else (first, last)
        most = min(nb_values or MOST, MOST)
        try:
            values = await self._past.values(f"{machine}.{node.point.name}", low, high, None if is_backwards else most + 1)
        except Misuse:
            return [], None
        except LineFailure:
            raise ua.UaStatusCodeError(ua.StatusCodes.BadNoCommunication) from None
        if is_backwards:
            values.reverse()
        rest = values[most].at if len(values) > most and not nb_values else None
        return [data_value(one.value, node.point.type, one.at, is_answered=True) for one in values[:most]], rest


def _moment(given: datetime | None) -> datetime | None:
    """None for what stands for no time: the begin of the clock of Windows."""
    if given is None or given.replace(tzinfo=None) <= ua.get_win_epoch().replace(tzinfo=None):
        return None
    return given if given.tzinfo is not None else given.replace(tzinfo=UTC)
