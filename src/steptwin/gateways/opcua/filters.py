"""Filters of monitored items (OPC 10000-4, 7.22): what is supported, and the status codes of what is not."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from typing import Any, NamedTuple

from asyncua import ua

_NUMBERS = range(ua.ObjectIds.SByte, ua.ObjectIds.Double + 1)
"""Types of numbers; the types of variants have the same numbers (OPC 10000-6, 5.1.2)."""

Reading = Callable[[ua.NodeId, ua.AttributeIds], ua.DataValue]
"""Gives the value of an attribute."""


class ChangeFilter(NamedTuple):
    """When a client is notified. ``band``: an absolute dead band, 0 without one."""

    trigger: Any = ua.DataChangeTrigger.StatusValue
    band: float = 0.0

    def trigger_only(self) -> ua.DataChangeFilter:
        """Filter that the library applies."""
        return ua.DataChangeFilter(self.trigger)


EVERY_CHANGE = ChangeFilter()


def change_filter(read: Reading, item: ua.ReadValueId, wanted: Any) -> ChangeFilter:
    """The filter ``wanted`` for the attribute of ``item``; none for events, which the library filters. Raises
    `ua.UaStatusCodeError` for one that is not supported, not valid, or not for this attribute or type."""
    is_none = wanted is None or (isinstance(wanted, ua.ExtensionObject) and wanted.TypeId == ua.NodeId())
    if item.AttributeId == ua.AttributeIds.EventNotifier:
        if is_none:
            raise ua.UaStatusCodeError(ua.StatusCodes.BadEventFilterInvalid)
        if not isinstance(wanted, ua.EventFilter):
            raise ua.UaStatusCodeError(ua.StatusCodes.BadFilterNotAllowed)
        return EVERY_CHANGE
    if is_none:
        return EVERY_CHANGE
    if isinstance(wanted, ua.EventFilter):
        raise ua.UaStatusCodeError(ua.StatusCodes.BadFilterNotAllowed)
    if type(wanted).__name__ != "DataChangeFilter":  # the class that the library decodes is not the one that it exports
        raise ua.UaStatusCodeError(ua.StatusCodes.BadMonitoredItemFilterUnsupported)
    if wanted.DeadbandType == ua.DeadbandType.None_:
        return ChangeFilter(wanted.Trigger)
    if wanted.DeadbandType == ua.DeadbandType.Percent:
        raise ua.UaStatusCodeError(ua.StatusCodes.BadMonitoredItemFilterUnsupported)
    band = float(wanted.DeadbandValue)
    if wanted.DeadbandType != ua.DeadbandType.Absolute or not isfinite(band) or band < 0.0:
        raise ua.UaStatusCodeError(ua.StatusCodes.BadDeadbandFilterInvalid)
    if item.AttributeId != ua.AttributeIds.Value or not _is_number(read, item.NodeId):
        raise ua.UaStatusCodeError(ua.StatusCodes.BadFilterNotAllowed)
    return ChangeFilter(wanted.Trigger, band)


def _is_number(read: Reading, node: Any) -> bool:
    value = read(node, ua.AttributeIds.Value).Value
    if value is not None and value.VariantType != ua.VariantType.Null:
        return value.VariantType.value in _NUMBERS
    kind = read(node, ua.AttributeIds.DataType).Value
    return kind is not None and kind.Value.NamespaceIndex == 0 and kind.Value.Identifier in _NUMBERS


def differs(before: ua.DataValue, value: ua.DataValue, what: ChangeFilter) -> bool:
    """Whether a change is reported to a client that has the filter ``what`` (OPC 10000-4, 7.22.2)."""
    if before.StatusCode != value.StatusCode:
        return True
    if what.trigger == ua.DataChangeTrigger.Status:
        return False
    if what.trigger == ua.DataChangeTrigger.StatusValueTimestamp and before.SourceTimestamp != value.SourceTimestamp:
        return True
    old = None if before.Value is None else before.Value.Value
    new = None if value.Value is None else value.Value.Value
    if old == new:
        return False
    if not what.band or old is None or new is None:
        return True
    if isinstance(old, list) and isinstance(new, list):
        return len(old) != len(new) or any(abs(one - other) > what.band for one, other in zip(old, new, strict=True))
    return bool(abs(new - old) > what.band)
