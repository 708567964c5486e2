"""How messages go to a broker: together, and in their order."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from typing import Any

import pytest
from aiomqtt import MqttError

from steptwin.gateways.mqtt.connection import AT_ONCE, Publication, _ClientLink, publish_packet


class SomeClient:
    def __init__(self) -> None:
        self.seen: list[tuple[str, str]] = []
        self.is_lost = False

    def send(self, all_of: Iterable[Publication]) -> bool:
        if not self.is_lost:
            self.seen += [("sent", one.topic) for one in all_of]
        return not self.is_lost

    async def publish(self, topic: str, *given: Any) -> None:
        if self.is_lost:
            raise MqttError("lost")
        self.seen.append(("waited for", topic))


def test_messages_without_confirmation_are_not_waited_for_one_by_one() -> None:
    client: Any = SomeClient()
    link = _ClientLink(client)
    asyncio.run(link.publish_all(Publication(str(number), b"") for number in range(2 * AT_ONCE)))
    assert [topic for _, topic in client.seen] == [str(number) for number in range(2 * AT_ONCE)]
    assert [topic for how, topic in client.seen if how == "waited for"] == [str(AT_ONCE)]


def test_those_with_confirmation_stay_in_their_order() -> None:
    client: Any = SomeClient()
    all_of = [Publication("a", b""), Publication("b", b"", qos=1), Publication("c", b""), Publication("d", b"", correlation=b"1")]
    asyncio.run(_ClientLink(client).publish_all(all_of))
    assert client.seen == [("sent", "a"), ("waited for", "b"), ("sent", "c"), ("waited for", "d")]


@pytest.mark.parametrize(
    ("payload", "length"), [(b"", "04"), (b"x" * 123, "7f"), (b"x" * 124, "80 01"), (b"x" * 16380, "80 80 01")]
)
def test_the_packet_of_a_message(payload: bytes, length: str) -> None:
    """MQTT 5, 3.3 and 1.5.5: type 3 with RETAIN, remaining length in groups of seven bits, topic, no properties, payload."""
    packet = publish_packet(Publication("t", payload, retain=True))
    assert packet == bytes.fromhex(f"31 {length} 00 01 74 00") + payload


def test_a_lost_broker_is_told() -> None:
    client: Any = SomeClient()
    client.is_lost = True
    with pytest.raises(MqttError):
        asyncio.run(_ClientLink(client).publish_all([Publication("a", b"")]))
