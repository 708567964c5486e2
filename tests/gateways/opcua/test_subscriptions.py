"""Notifications: when there is one, and its bytes."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine, Iterable
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
from asyncua import ua
from asyncua.server.address_space import AddressSpace
from asyncua.ua.ua_binary import struct_to_binary

from steptwin.gateways.opcua.addressspace import node_id
from steptwin.gateways.opcua.nodetypes import status
from steptwin.gateways.opcua.subscriptions import MonitoredItems, data_changes, packing

NOW: Any = datetime(2026, 3, 1, 12, 30, 5, 123457, tzinfo=UTC)
NODE = node_id("x")
ABSOLUTE = ua.DataChangeFilter(ua.DataChangeTrigger.StatusValue, ua.DeadbandType.Absolute, 1.0)
TIMESTAMP = ua.DataChangeFilter(ua.DataChangeTrigger.StatusValueTimestamp)
STATUS = ua.DataChangeFilter(ua.DataChangeTrigger.Status)


def data(value: Any, kind: ua.VariantType = ua.VariantType.Double, *, code: int = 0, at: Any = NOW) -> ua.DataValue:
    return ua.DataValue(ua.Variant(value, kind), status(code), at)


@pytest.mark.parametrize(
    "value",
    [
        data(True, ua.VariantType.Boolean),
        data(-(1 << 40), ua.VariantType.Int64),
        data(2.5),
        data("zażółć °", ua.VariantType.String),
        data("", ua.VariantType.String),
        data(None, ua.VariantType.String),
        data(7, ua.VariantType.UInt16),
        data(1.0, at=None),
        data(1.0, code=ua.StatusCodes.UncertainLastUsableValue),
        data(None, ua.VariantType.Null, code=ua.StatusCodes.BadNoData),
        data([1, 2, 3], ua.VariantType.UInt16),
        data([1.5], ua.VariantType.Double),
        ua.DataValue(ua.Variant(1.0), SourceTimestamp=NOW, ServerTimestamp=NOW),
    ],
    ids=repr,
)
def test_bytes_are_those_of_the_library(value: ua.DataValue) -> None:
    notification = ua.DataChangeNotification([ua.MonitoredItemNotification(number, value) for number in (1, 70_000)])
    assert data_changes(notification) == struct_to_binary(notification)


def test_what_is_published_is_packed_and_events_stay_what_they_are() -> None:
    sent: list[ua.PublishResult] = []

    async def publish(result: ua.PublishResult, request: str) -> None:
        assert request == "request"
        sent.append(result)

    result = ua.PublishResult()
    changes = ua.DataChangeNotification([ua.MonitoredItemNotification(5, data(1.0))])
    events = ua.EventNotificationList()
    result.NotificationMessage.NotificationData = [changes, events]
    plain = struct_to_binary(result)
    way: Coroutine[Any, Any, None] = packing(publish)(result, "request")
    asyncio.run(way)
    assert sent == [result]
    assert struct_to_binary(result) == plain


class Subscription:
    """What a subscription of the library is for its items."""

    data = ua.CreateSubscriptionResult()
    max_queue_size = 100

    def __init__(self) -> None:
        self.seen: list[Any] = []

    async def enqueue_datachange_event(self, identity: int, one: ua.MonitoredItemNotification, size: int) -> None:
        assert one.Value.Value is not None
        self.seen.append(one.Value.Value.Value)


def notified(values: Iterable[ua.DataValue], what: Any = None, mode: Any = ua.MonitoringMode.Reporting) -> list[Any]:
    """What a client with this filter sees of values that are written one after another."""
    subscription: Any = Subscription()
    ended: list[None] = []

    async def act() -> None:
        space = AddressSpace()
        node = space._nodes[NODE] = _node(data(0.0))
        items = MonitoredItems(subscription, space, lambda: ended.append(None))
        request = ua.MonitoredItemCreateRequest()
        request.ItemToMonitor.NodeId = NODE
        request.ItemToMonitor.AttributeId = ua.AttributeIds.Value
        request.MonitoringMode = mode
        request.RequestedParameters.Filter = what
        parameters = ua.CreateMonitoredItemsParameters(ItemsToCreate=[request])
        (result,) = await items.create_monitored_items(parameters)
        for value in values:
            await space.write_attribute_value(NODE, ua.AttributeIds.Value, value)
        items.delete_all_monitored_items()
        assert not node.attributes[ua.AttributeIds.Value].datachange_callbacks
        assert result.StatusCode.is_good()

    asyncio.run(act())
    assert ended == [None]
    return list(subscription.seen)


def _node(value: ua.DataValue) -> Any:
    from asyncua.server.address_space import AttributeValue, NodeData

    node = NodeData(NODE)
    node.attributes[ua.AttributeIds.Value] = AttributeValue(value)
    return node


def test_the_first_value_and_every_other_one() -> None:
    assert notified([data(0.0), data(1.0), data(1.0), data(2.0)]) == [0.0, 1.0, 2.0]


def test_a_dead_band_counts_from_the_value_that_was_notified() -> None:
    """A slow motion comes through, although each step is within the band."""
    assert notified([data(step * 0.4) for step in range(1, 9)], ABSOLUTE) == pytest.approx([0.0, 1.2, 2.4])


def test_another_status_is_told_whatever_the_dead_band() -> None:
    assert notified([data(0.5, code=ua.StatusCodes.UncertainLastUsableValue), data(0.5)], ABSOLUTE) == [0.0, 0.5, 0.5]


@pytest.mark.parametrize(("what", "seen"), [(TIMESTAMP, [0.0, 0.0, 1.0]), (None, [0.0, 1.0]), (STATUS, [0.0])])
def test_triggers(what: Any, seen: list[float]) -> None:
    assert notified([data(0.0, at=NOW + timedelta(seconds=1)), data(1.0, at=NOW + timedelta(seconds=1))], what) == seen


def test_an_item_that_is_disabled_is_told_nothing() -> None:
    assert notified([data(1.0)], mode=ua.MonitoringMode.Disabled) == []
