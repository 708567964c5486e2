"""How messages go to a broker: together, and in their order."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from aiomqtt import MqttError

from steptwin.gateways.mqtt.connection import AT_ONCE, Publication, _ClientLink


class SomeClient:
    """Takes messages into its queue at once, and says later that they have left."""

    def __init__(self) -> None:
        self.seen: list[str] = []
        self.waiting = self.most_waiting = 0
        self.is_lost = False

    async def publish(self, topic: str, *given: Any) -> None:
        if self.is_lost:
            raise MqttError("lost")
        self.seen.append(topic)
        self.waiting += 1
        self.most_waiting = max(self.waiting, self.most_waiting)
        await asyncio.sleep(0)
        self.waiting -= 1


def test_messages_are_not_waited_for_one_by_one_and_stay_in_their_order() -> None:
    client: Any = SomeClient()
    all_of = [Publication(str(number), b"", qos=number % 2) for number in range(AT_ONCE + 1)]
    asyncio.run(_ClientLink(client).publish_all(all_of))
    assert client.seen == [one.topic for one in all_of]
    assert client.most_waiting == AT_ONCE


def test_a_lost_broker_is_told() -> None:
    client: Any = SomeClient()
    client.is_lost = True
    with pytest.raises(MqttError):
        asyncio.run(_ClientLink(client).publish_all([Publication("a", b""), Publication("b", b"")]))
