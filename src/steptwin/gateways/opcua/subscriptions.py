"""Subscriptions that carry the changes of a thousand controllers.

The library copies every value deeply, for each subscription, and encodes notifications field by field: two thirds of what a
notification costs. Values here are never changed, so nothing is copied, and the usual ones are packed directly.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Coroutine
from datetime import UTC, datetime, timedelta
from typing import Any

from asyncua import ua
from asyncua.server.address_space import AddressSpace
from asyncua.server.internal_subscription import InternalSubscription
from asyncua.server.monitored_item_service import MonitoredItemService
from asyncua.ua.ua_binary import struct_to_binary

from steptwin.gateways.opcua.nodetypes import standard

_TYPE = standard(ua.ObjectIds.DataChangeNotification_Encoding_DefaultBinary)
_EPOCH = datetime(1601, 1, 1, tzinfo=UTC)
_MICROSECOND = timedelta(microseconds=1)
_MEMBERS = 0x07
"""Value, status and source timestamp of a DataValue follow (OPC 10000-6, 5.2.2.17)."""
_NUMBERS = {
    ua.VariantType.Boolean: struct.Struct("<IBB?Iq"),
    ua.VariantType.Int64: struct.Struct("<IBBqIq"),
    ua.VariantType.Double: struct.Struct("<IBBdIq"),
}
_TEXT = struct.Struct("<IBBi")
_TEXT_END = struct.Struct("<Iq")
_COUNT = struct.Struct("<i")
_NO_DIAGNOSTICS = _COUNT.pack(0)
_GOOD = 0

Publish = Callable[..., Coroutine[Any, Any, None]]


class MonitoredItems(MonitoredItemService):
    """The monitored items of one subscription; a dead band counts from the value that was notified last."""

    def __init__(self, subscription: InternalSubscription, space: AddressSpace, on_end: Callable[[], None]) -> None:
        """``on_end`` is called when items are deleted, also because a client is gone."""
        super().__init__(subscription, space)
        self._on_end = on_end
        self._notified: dict[int, ua.DataValue] = {}
        """By handle: what the client knows."""

    async def datachange_callback(self, handle: int, value: ua.DataValue, error: ua.StatusCode | None = None) -> None:
        if error is not None:
            await super().datachange_callback(handle, value, error)
            return
        identity = self._monitored_datachange[handle]
        item = self._monitored_items[identity]
        if item.mode == ua.MonitoringMode.Disabled:
            self._notified.pop(handle, None)
            return
        before = self._notified.get(handle)
        if before is not None and not _differs(before, value, item.filter):
            return
        self._notified[handle] = value
        notification = ua.MonitoredItemNotification(item.client_handle or 0, value)
        await self.isub.enqueue_datachange_event(identity, notification, item.queue_size)

    def delete_monitored_items(self, ids: list[int]) -> list[ua.StatusCode]:
        codes = super().delete_monitored_items(ids)
        for handle in self._notified.keys() - self._monitored_datachange.keys():
            del self._notified[handle]
        self._on_end()
        return codes


def _differs(before: ua.DataValue, value: ua.DataValue, what: Any) -> bool:
    """Whether a client that has the filter ``what`` is told (OPC 10000-4, 7.22.2)."""
    if before.StatusCode != value.StatusCode:
        return True
    is_filter = isinstance(what, ua.DataChangeFilter)
    trigger = what.Trigger if is_filter else ua.DataChangeTrigger.StatusValue
    if trigger == ua.DataChangeTrigger.Status:
        return False
    if trigger == ua.DataChangeTrigger.StatusValueTimestamp and before.SourceTimestamp != value.SourceTimestamp:
        return True
    old = None if before.Value is None else before.Value.Value
    new = None if value.Value is None else value.Value.Value
    if old == new:
        return False
    is_band = is_filter and what.DeadbandType == ua.DeadbandType.Absolute
    if is_band and isinstance(old, int | float) and isinstance(new, int | float):
        return abs(new - old) > float(what.DeadbandValue)
    return True


def packing(publish: Publish) -> Publish:
    """``publish``, the way to the client, with data changes that are encoded already."""

    async def packed(result: ua.PublishResult, *request: Any) -> None:
        data: list[Any] = result.NotificationMessage.NotificationData
        for place, one in enumerate(data):
            if isinstance(one, ua.DataChangeNotification):
                data[place] = ua.ExtensionObject(_TYPE, data_changes(one))
        await publish(result, *request)

    return packed


def data_changes(notification: ua.DataChangeNotification) -> Any:
    """The bytes of a DataChangeNotification (OPC 10000-4, 7.25.2)."""
    items = [_item(one) for one in notification.MonitoredItems]
    return b"".join((_COUNT.pack(len(items)), *items, _NO_DIAGNOSTICS))


def _item(one: ua.MonitoredItemNotification) -> bytes:
    value: Any = one.Value
    variant, at = value.Value, value.SourceTimestamp
    is_usual = (
        value.StatusCode is not None and value.StatusCode.value == _GOOD and value.ServerTimestamp is None and at is not None
    )
    if not is_usual or variant.is_array:
        return struct_to_binary(one)
    kind = variant.VariantType
    ticks = (at - _EPOCH) // _MICROSECOND * 10
    numbers = _NUMBERS.get(kind)
    if numbers is not None:
        return numbers.pack(one.ClientHandle, _MEMBERS, kind.value, variant.Value, _GOOD, ticks)
    if kind is ua.VariantType.String and variant.Value is not None:
        text = variant.Value.encode()
        return _TEXT.pack(one.ClientHandle, _MEMBERS, kind.value, len(text)) + text + _TEXT_END.pack(_GOOD, ticks)
    return struct_to_binary(one)
