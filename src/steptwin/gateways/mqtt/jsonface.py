"""The JSON face: retained values by group, events, commands with answers."""

from __future__ import annotations

import asyncio
import contextlib
import secrets
from collections.abc import Awaitable, Mapping

from aiomqtt import Message, MqttError

from steptwin.controller import SECOND
from steptwin.errors import Refusal
from steptwin.gateways.contract import GatewaySubject
from steptwin.gateways.mqtt.connection import BrokerLink, Publication, SessionOver
from steptwin.gateways.mqtt.homeassistant import discovery
from steptwin.gateways.mqtt.jsoncommands import COMMANDS, JsonCommands, JsonRequest
from steptwin.gateways.mqtt.jsontopics import (
    ANSWER,
    DESCRIPTION,
    DO,
    EVENTS,
    INSTANCE,
    ONLINE,
    ControllerText,
    Topics,
    encode,
)
from steptwin.gateways.mqtt.options import MqttSpec
from steptwin.gateways.points import CLOCK
from steptwin.gateways.sampling import Sample, Sampler
from steptwin.subject.dispatch import failure
from steptwin.subject.subscriptions import Filter

KINDS = frozenset({"status", "report", "note", "fault", "button", "input"})
"""Kinds of events that are published."""
CLOCK_S = 1.0
"""How often the time is published."""
MOST_COMMANDS = 1000
"""Commands that are being done, and answers that are on their way."""
LONGEST_TOPIC = 1000


class JsonFace:
    """Shows ``subject`` at ``topics``. A `Face`."""

    def __init__(self, spec: MqttSpec, subject: GatewaySubject, topics: Topics, sampler: Sampler, commands: JsonCommands) -> None:
        self._spec = spec
        self._subject = subject
        self._topics = topics
        self._sampler = sampler
        self._commands = commands
        self._subscription = subject.subscribe(Filter(KINDS), spec.store)
        self._instance = secrets.token_hex(8)
        self._texts: dict[str, ControllerText] = {}
        """Texts that have been published in this session, by controller."""
        self._doing: set[asyncio.Task[None]] = set()
        self._others: dict[str, bytes] = {}
        """Messages of whoever uses these topics, until this gateway does."""
        self._is_online = False

    def close(self) -> None:
        self._subscription.close()
        for task in self._doing:
            task.cancel()

    # ------------------------------------------------------------------ the session

    def will(self) -> Publication:
        return Publication(self._topics(ONLINE), b"false", qos=1, retain=True)

    async def run(self, link: BrokerLink) -> None:
        await self._claim(link)
        about = encode(self._topics.describe([name for name in COMMANDS if name in self._subject.description.commands]))
        await link.publish(Publication(self._topics(DESCRIPTION), about, qos=1, retain=True))
        if self._spec.discovery is not None:
            await link.publish_all(discovery(self._topics, self._subject.description))
        controllers = [name for name in self._topics.groups if name != CLOCK]
        await self._publish(link, await asyncio.gather(*(self._sampler.take(name) for name in controllers)))
        self._sampler.watch(controllers)
        await link.publish(Publication(self._topics(ONLINE), b"true", qos=1, retain=True))
        await link.subscribe(self._topics(DO), retained=False)
        loop, interval_s = asyncio.get_running_loop(), self._spec.interval / SECOND
        at, clock_at = loop.time(), loop.time()
        while True:
            await self._publish(link, await self._sampler.changed(max(at - loop.time(), 0.0)))
            if loop.time() >= at:
                at = loop.time() + interval_s
                await self._publish_events(link)
            if CLOCK in self._topics.groups and loop.time() >= clock_at:
                clock_at = loop.time() + CLOCK_S
                await self._publish(link, [await self._sampler.take(CLOCK)])

    async def _claim(self, link: BrokerLink) -> None:
        """Make sure that nobody else uses these topics: both would do every command. Raises `SessionOver`."""
        self._others.clear()
        await link.subscribe(self._topics(INSTANCE), retained=True)
        await link.subscribe(self._topics(ONLINE), retained=True)
        await link.subscribe(self._topics(f"{INSTANCE}/{self._instance}"), retained=False)
        if self._others.get(ONLINE) == b"true" and self._others.get(INSTANCE) not in (None, self._instance.encode()):
            raise SessionOver(f"another gateway is online at {self._topics.base}: give one of them another topic or name")
        await link.publish(self._own_instance())
        self._is_online = True

    def _own_instance(self) -> Publication:
        return Publication(self._topics(INSTANCE), self._instance.encode(), qos=1, retain=True)

    async def leave(self, link: BrokerLink) -> None:
        if self._is_online:
            await link.publish(self.will())

    def lost(self) -> None:
        self._is_online = False
        self._texts.clear()
        self._commands.lost()

    # ------------------------------------------------------------------ values and events

    async def _publish(self, link: BrokerLink, samples: list[Sample]) -> None:
        found: list[Publication] = []
        for sample in samples:
            controller = sample.controller
            text = self._texts.get(controller)
            if text is None:
                text = self._texts[controller] = ControllerText(self._topics.groups[controller], controller)
            found += [Publication(topic, payload, retain=True) for topic, payload in text.changed(sample)]
        await link.publish_all(found)

    async def _publish_events(self, link: BrokerLink) -> None:
        missed, events = self._subscription.take()
        for event in events:
            data = event.to_json() | ({"missed": missed} if missed else {})
            missed = 0
            await link.publish(Publication(self._topics(EVENTS), encode(data), qos=1))

    # ------------------------------------------------------------------ commands

    def take(self, link: BrokerLink, message: Message) -> None:
        topic = str(message.topic)
        payload = message.payload
        if topic == self._topics(DO):
            self._begin(link, JsonRequest(payload, message.retain, _sender(message)), message)
        elif topic == self._topics(ONLINE):
            self._others[ONLINE] = payload
            if self._is_online and payload == b"false":  # a will of somebody who is gone
                self._start(link.publish(Publication(topic, b"true", qos=1, retain=True)))
        elif topic == self._topics(INSTANCE):
            self._others[INSTANCE] = payload
            if self._is_online and payload > self._instance.encode():
                raise SessionOver(f"another gateway has begun to use {self._topics.base} at the same moment")
            if self._is_online and payload < self._instance.encode():  # it is the other one that gives way
                self._start(link.publish(self._own_instance()))

    def _begin(self, link: BrokerLink, request: JsonRequest, message: Message) -> None:
        if len(self._doing) >= MOST_COMMANDS:
            busy = Refusal(f"{MOST_COMMANDS} commands are being done already")
            self._start(self._send(link, failure(busy), message))
        else:
            self._start(self._do(link, request, message))

    def _start(self, what: Awaitable[None]) -> None:
        task = asyncio.create_task(_quiet(what))
        self._doing.add(task)
        task.add_done_callback(self._doing.discard)

    async def _do(self, link: BrokerLink, request: JsonRequest, message: Message) -> None:
        answer = await self._commands.answer(request)
        if answer is not None:
            await self._send(link, answer, message)

    async def _send(self, link: BrokerLink, answer: Mapping[str, object], message: Message) -> None:
        topic, correlation = _sender(message)
        await link.publish(Publication(topic or self._topics(ANSWER), encode(answer), qos=1, correlation=correlation))


def _sender(message: Message) -> tuple[str | None, bytes | None]:
    """Where the answer goes, and with what."""
    properties = message.properties
    topic = getattr(properties, "ResponseTopic", None)
    if not topic or len(topic) > LONGEST_TOPIC or any(sign in topic for sign in "+#\0"):
        topic = None
    return topic, getattr(properties, "CorrelationData", None)


async def _quiet(what: Awaitable[None]) -> None:
    """The loss of the broker is noticed elsewhere, too."""
    with contextlib.suppress(MqttError):
        await what
