"""Subscriptions that carry the changes of a thousand controllers.

The library copies every value deeply, for each subscription, and encodes notifications field by field: two thirds of what a
notification costs. Values here are never changed, so nothing is copied, and the usual ones are packed directly.
"""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Callable, Coroutine
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import Any

from asyncua import ua
from asyncua.server.address_space import AddressSpace
from asyncua.server.internal_subscription import InternalSubscription
from asyncua.server.monitored_item_service import MonitoredItemService
from asyncua.ua.ua_binary import struct_to_binary

from steptwin.gateways.opcua.filters import EVERY_CHANGE, ChangeFilter, change_filter, differs
from steptwin.gateways.opcua.indexranges import check_range, part_of
from steptwin.gateways.opcua.limits import AT_ONCE
from steptwin.gateways.opcua.nodetypes import standard, status

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
        self._filters: dict[int, ChangeFilter] = {}
        """By item, other than every change."""

    async def create_monitored_items(self, params: ua.CreateMonitoredItemsParameters) -> list[ua.MonitoredItemCreateResult]:
        results: list[ua.MonitoredItemCreateResult] = []
        for item in params.ItemsToCreate:
            results.append(await self._create(params, item))
            if len(results) % AT_ONCE == 0:
                await asyncio.sleep(0)
        return results

    async def _create(
        self, params: ua.CreateMonitoredItemsParameters, item: ua.MonitoredItemCreateRequest
    ) -> ua.MonitoredItemCreateResult:
        try:
            check_range(item.ItemToMonitor.IndexRange)
            what = change_filter(self.aspace, item.ItemToMonitor, item.RequestedParameters.Filter)
        except ua.UaStatusCodeError as error:
            refused = ua.MonitoredItemCreateResult()
            refused.StatusCode = ua.StatusCode(error.code)
            return refused
        (result,) = await super().create_monitored_items(replace(params, ItemsToCreate=[item]))
        if result.StatusCode.is_good() and what != EVERY_CHANGE:
            self._filters[result.MonitoredItemId] = what
        return result

    def modify_monitored_items(self, params: ua.ModifyMonitoredItemsParameters) -> list[ua.MonitoredItemModifyResult]:
        return [self._modify(params, item) for item in params.ItemsToModify]

    def _modify(
        self, params: ua.ModifyMonitoredItemsParameters, item: ua.MonitoredItemModifyRequest
    ) -> ua.MonitoredItemModifyResult:
        known = self._monitored_items.get(item.MonitoredItemId)
        refused = ua.MonitoredItemModifyResult()
        if known is None or known.read_value_id is None:
            refused.StatusCode = status(ua.StatusCodes.BadMonitoredItemIdInvalid)
            return refused
        try:
            what = change_filter(self.aspace, known.read_value_id, item.RequestedParameters.Filter)
        except ua.UaStatusCodeError as error:
            refused.StatusCode = ua.StatusCode(error.code)
            return refused
        (result,) = super().modify_monitored_items(replace(params, ItemsToModify=[item]))
        self._filters[item.MonitoredItemId] = what
        return result

    async def datachange_callback(self, handle: int, value: ua.DataValue, error: ua.StatusCode | None = None) -> None:
        if error is not None:
            await super().datachange_callback(handle, value, error)
            return
        identity = self._monitored_datachange[handle]
        item = self._monitored_items[identity]
        if item.mode == ua.MonitoringMode.Disabled:
            self._notified.pop(handle, None)
            return
        if item.read_value_id is not None and item.read_value_id.IndexRange:
            value = part_of(value, item.read_value_id.IndexRange)
        before = self._notified.get(handle)
        if before is not None and not differs(before, value, self._filters.get(identity, EVERY_CHANGE)):
            return
        self._notified[handle] = value
        notification = ua.MonitoredItemNotification(item.client_handle or 0, value)
        await self.isub.enqueue_datachange_event(identity, notification, item.queue_size)

    def delete_monitored_items(self, ids: list[int]) -> list[ua.StatusCode]:
        codes = super().delete_monitored_items(ids)
        for handle in self._notified.keys() - self._monitored_datachange.keys():
            del self._notified[handle]
        for identity in self._filters.keys() - self._monitored_items.keys():
            del self._filters[identity]
        self._on_end()
        return codes


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
