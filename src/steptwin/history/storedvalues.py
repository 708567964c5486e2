"""Values that a history has stored, for the gateways beside it."""

from __future__ import annotations

import asyncio
from datetime import UTC, datetime

from sqlalchemy.engine import URL

from steptwin.gateways.contract import HistoryValue

MOVING_S = 0.1
"""Interval between two positions of an axis that moves, s."""


class StoredValues:
    """See `steptwin.gateways.contract.HistoryValues`."""

    def __init__(self, url: URL) -> None:
        self._url = url

    async def values(self, point: str, begin: datetime | None, end: datetime | None, most: int | None) -> list[HistoryValue]:
        return await asyncio.to_thread(self._read, point, begin, end, most)

    def _read(self, point: str, begin: datetime | None, end: datetime | None, most: int | None) -> list[HistoryValue]:
        from steptwin.history.reading import HistoryDatabase

        with HistoryDatabase(self._url.render_as_string(hide_password=False)) as history:
            found = history.series(point, begin, end, moving_s=MOVING_S, most=most)
        return [
            HistoryValue(at.replace(tzinfo=UTC), _value(value))
            for at, value in zip(found.at.tolist(), found.values.tolist(), strict=True)
        ]


def _value(value: float | str | None) -> float | str | None:
    return None if value is None or value != value else value  # noqa: PLR0124  NaN
