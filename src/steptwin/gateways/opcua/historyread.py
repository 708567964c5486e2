"""HistoryRead of raw values (OPC 10000-11, 6.4.3): what the history beside the server has kept.

A continuation point has all that is needed to go on, so none is kept, and none expires.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from typing import Any, NamedTuple

from asyncua import ua

from steptwin.errors import LineFailure, Misuse
from steptwin.gateways.contract import HistoryValues
from steptwin.gateways.opcua.addressspace import PointNode
from steptwin.gateways.opcua.nodetypes import data_value, status

MOST = 10_000
"""Values in an answer; a client gets the rest with its continuation point."""
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_MICROSECOND = timedelta(microseconds=1)
_POINT = struct.Struct("<4sqqqIIB")
_MARK = b"past"
_NEVER = -(1 << 63)


class _Reading(NamedTuple):
    """A request for values of the history. Moments in µs since 1970; None: open. ``at`` and ``skip``: go on with the value at
    this moment that comes behind so many others of it."""

    begin: int | None
    end: int | None
    at: int | None = None
    skip: int = 0
    most: int = 0
    has_bounds: bool = False

    @property
    def is_backwards(self) -> bool:
        return self.begin is None or (self.end is not None and self.end < self.begin)

    def pack(self) -> bytes:
        moments = (_NEVER if one is None else one for one in (self.begin, self.end, self.at))
        return _POINT.pack(_MARK, *moments, self.skip, self.most, self.has_bounds)


class _Kept(NamedTuple):
    at: int
    value: ua.DataValue


class HistoryNodes:
    """Reads the variables ``nodes``, with their controllers, from ``history``."""

    def __init__(self, history: HistoryValues, nodes: Mapping[ua.NodeId, tuple[str, PointNode]]) -> None:
        self._history = history
        self._nodes = nodes

    async def read(self, details: Any, wanted: ua.HistoryReadValueId, *, release: bool) -> ua.HistoryReadResult:
        """One node. Backwards where the end is before the start, or the start is missing. Raises `ua.UaStatusCodeError`."""
        found = self._nodes.get(wanted.NodeId)
        if found is None or not isinstance(details, ua.ReadRawModifiedDetails) or details.IsReadModified:
            raise ua.UaStatusCodeError(ua.StatusCodes.BadHistoryOperationUnsupported)
        reading = _continued(wanted.ContinuationPoint) if wanted.ContinuationPoint else _begun(details)
        result = ua.HistoryReadResult()
        if release:
            return result
        most = min(reading.most or MOST, MOST)
        kept = await self._kept(*found, reading, most)
        page = kept[:most]
        if len(kept) > most and (not reading.most or None not in (reading.begin, reading.end)):
            at = kept[most].at
            before = reading.skip if at == reading.at else 0
            result.ContinuationPoint = reading._replace(at=at, skip=before + sum(one.at == at for one in page)).pack()
        result.HistoryData = ua.HistoryData([one.value for one in page])  # type: ignore[assignment]
        result.StatusCode = status(ua.StatusCodes.Good if page else ua.StatusCodes.GoodNoData)
        return result

    async def _kept(self, controller: str, node: PointNode, reading: _Reading, most: int) -> list[_Kept]:
        """In the order in which they are read, one more than ``most`` where there are so many."""
        point, backwards = f"{controller}.{node.point.name}", reading.is_backwards
        low, high = (reading.end, reading.begin) if backwards else (reading.begin, reading.end)
        begin = low if backwards or reading.at is None else reading.at
        bound = most + reading.skip + 2  # the one that held at the begin, and the first of the next page
        try:
            values = await self._history.values(point, _date(begin), _date(high), None if backwards else bound)
            after = []
            if reading.has_bounds and high is not None:
                after = [one for one in await self._history.values(point, _date(high), None, 2) if _micros(one.at) > high][:1]
        except Misuse:
            return []
        except LineFailure:
            raise ua.UaStatusCodeError(ua.StatusCodes.BadNoCommunication) from None
        kept = [_Kept(_micros(one.at), data_value(one.value, node.point.type, one.at, is_answered=True)) for one in values]
        inside = [one for one in kept if (low is None or one.at >= low) and (high is None or one.at <= high)]
        if reading.has_bounds:
            last = [_Kept(_micros(one.at), data_value(one.value, node.point.type, one.at, is_answered=True)) for one in after]
            inside = _bounded(inside, [one for one in kept if low is not None and one.at < low], last, low, high)
        if backwards:
            inside.reverse()
        return _from(inside, reading)


def _bounded(inside: list[_Kept], before: list[_Kept], after: list[_Kept], low: int | None, high: int | None) -> list[_Kept]:
    """With the value before the range and the one behind it, unless there are values at its ends (OPC 10000-11, 6.4.3.2)."""
    found = list(inside)
    if low is not None and not any(one.at == low for one in inside):
        found = [*(before[-1:] or [_missing(low)]), *found]
    if high is not None and not any(one.at == high for one in inside):
        found += after or [_missing(high)]
    return found


def _missing(at: int) -> _Kept:
    moment: Any = _date(at)
    return _Kept(at, ua.DataValue(ua.Variant(), status(ua.StatusCodes.BadBoundNotFound), moment))


def _from(kept: list[_Kept], reading: _Reading) -> list[_Kept]:
    """Those that the pages before have not had."""
    if reading.at is None:
        return kept
    sign = -1 if reading.is_backwards else 1
    rest = [one for one in kept if sign * one.at >= sign * reading.at]
    return rest[reading.skip :]


def _begun(details: Any) -> _Reading:
    begin, end = _moment(details.StartTime), _moment(details.EndTime)
    if begin is None and end is None:
        raise ua.UaStatusCodeError(ua.StatusCodes.BadHistoryOperationInvalid)
    return _Reading(begin, end, most=details.NumValuesPerNode, has_bounds=bool(details.ReturnBounds))


def _continued(point: bytes) -> _Reading:
    if len(point) != _POINT.size or not point.startswith(_MARK):
        raise ua.UaStatusCodeError(ua.StatusCodes.BadContinuationPointInvalid)
    _, begin, end, at, skip, most, has_bounds = _POINT.unpack(point)
    moments = (None if one == _NEVER else one for one in (begin, end, at))
    return _Reading(*moments, skip=skip, most=most, has_bounds=bool(has_bounds))


def _moment(given: datetime | None) -> int | None:
    """None for what stands for no time: the begin of the clock of Windows."""
    if given is None or given.replace(tzinfo=None) <= ua.get_win_epoch().replace(tzinfo=None):
        return None
    return _micros(given if given.tzinfo is not None else given.replace(tzinfo=UTC))


def _micros(at: datetime) -> int:
    return (at - _EPOCH) // _MICROSECOND


def _date(micros: int | None) -> datetime | None:
    return None if micros is None else _EPOCH + micros * _MICROSECOND
