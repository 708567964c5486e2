"""When clients are notified."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
from asyncua import ua

from steptwin.gateways.opcua.addressspace import node_id
from steptwin.gateways.opcua.filters import EVERY_CHANGE, ChangeFilter
from steptwin.gateways.opcua.nodetypes import status
from steptwin.gateways.opcua.session import NotificationQueue

NOW: Any = datetime(2026, 3, 1, 12, 30, 5, 123457, tzinfo=UTC)
NODE = node_id("x")
ABSOLUTE = ChangeFilter(band=1.0)
TIMESTAMP = ChangeFilter(ua.DataChangeTrigger.StatusValueTimestamp)
STATUS = ChangeFilter(ua.DataChangeTrigger.Status)


def data(value: Any, kind: ua.VariantType = ua.VariantType.Double, *, code: int = 0, at: Any = NOW) -> ua.DataValue:
    return ua.DataValue(ua.Variant(value, kind), status(code), at)


class Subscription:
    """What a subscription of the library is for its items."""

    def __init__(self) -> None:
        self.seen: list[Any] = []

    async def enqueue_datachange_event(self, identity: int, one: ua.MonitoredItemNotification, size: int) -> None:
        assert one.Value.Value is not None
        self.seen.append(one.Value.Value.Value)


def notified(values: Iterable[ua.DataValue], what: ChangeFilter = EVERY_CHANGE) -> list[Any]:
    """What a client with this filter sees of values that are written one after another."""
    subscription = Subscription()
    queue = NotificationQueue(subscription)
    request = ua.MonitoredItemCreateRequest(ua.ReadValueId(NODE, ua.AttributeIds.Value))
    number, asked = queue.add(request, what)
    assert asked.RequestedParameters.ClientHandle == number

    async def act() -> None:
        for value in [data(0.0), *values]:
            await queue.enqueue_datachange_event(5, ua.MonitoredItemNotification(number, value), 1)

    asyncio.run(act())
    return subscription.seen


def test_the_first_value_and_every_other_one() -> None:
    assert notified([data(0.0), data(1.0), data(1.0), data(2.0)]) == [0.0, 1.0, 2.0]


def test_a_dead_band_counts_from_the_value_that_was_notified() -> None:
    """A slow motion comes through, although each step is within the band."""
    assert notified([data(step * 0.4) for step in range(1, 9)], ABSOLUTE) == pytest.approx([0.0, 1.2, 2.4])


def test_another_status_is_told_whatever_the_dead_band() -> None:
    assert notified([data(0.5, code=ua.StatusCodes.UncertainLastUsableValue), data(0.5)], ABSOLUTE) == [0.0, 0.5, 0.5]


@pytest.mark.parametrize(("what", "seen"), [(TIMESTAMP, [0.0, 0.0, 1.0]), (EVERY_CHANGE, [0.0, 1.0]), (STATUS, [0.0])])
def test_triggers(what: Any, seen: list[float]) -> None:
    assert notified([data(0.0, at=NOW + timedelta(seconds=1)), data(1.0, at=NOW + timedelta(seconds=1))], what) == seen
