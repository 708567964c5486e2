"""The connection to a broker: it comes back by itself, with a pause that grows.

Each connection is a session of its own (clean start, no expiry): what was sent to a gateway that was not there is never done
later, and nothing that it had sent is sent again.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import secrets
import ssl
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from aiomqtt import Client, Message, MqttError, ProtocolVersion, Will
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties
from paho.mqtt.subscribeoptions import SubscribeOptions

from steptwin.errors import Misuse
from steptwin.eventloop import endless
from steptwin.simulation.toml.addresses import Address
from steptwin.system import reason

FIRST_PAUSE_S, LONGEST_PAUSE_S = 0.25, 30.0
STEADY_S = 10.0
"""After a session of this length the pauses begin anew."""
MOST_INCOMING = 1000
"""Limit of messages that wait to be processed; more are dropped."""
AT_ONCE = 32
"""Messages that wait at the same time until they have left."""
CANCEL_AGAIN_S = 0.1
LONGEST_CLOSE_S = 2.0
"""A broker that does not answer is not waited for when the gateway is closed."""


class SessionOver(Exception):
    """A session ends in order because of what a face has seen; the text is for the user. The will is not published."""


class Publication(NamedTuple):
    topic: str
    payload: bytes
    qos: int = 0
    retain: bool = False
    correlation: bytes | None = None


class BrokerLink(Protocol):
    """A session with the broker."""

    async def publish(self, one: Publication) -> None:
        """Raises `MqttError` where the broker is lost."""
        ...

    async def publish_all(self, all_of: Iterable[Publication]) -> None:
        """In their order. Raises as `publish`, for some of them."""
        ...

    async def subscribe(self, topic: str, *, retained: bool) -> None:
        """``retained``: whether what the broker has kept comes, too. All of it has come when a later `subscribe` returns."""
        ...


class Face(Protocol):
    """Side of a gateway that a broker sees."""

    def will(self) -> Publication:
        """Publication of the broker when this session is lost. Called once for each session, before all others."""
        ...

    async def run(self, link: BrokerLink) -> None:
        """Publish what there is and what changes, until cancelled. Raises `MqttError`, `SessionOver`."""
        ...

    def take(self, link: BrokerLink, message: Message) -> None:
        """A message has come. Raises `SessionOver`."""
        ...

    async def leave(self, link: BrokerLink) -> None:
        """Say good-bye: the session ends in order, because the gateway is closed or by `SessionOver`."""
        ...

    def lost(self) -> None:
        """The session has ended."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Broker:
    """Where the broker is, and how it is talked to."""

    address: Address
    keep_alive_s: int
    user: str | None = None
    password: str | None = None
    tls: Callable[[], ssl.SSLContext] | None = None
    """Called for each session, because certificates are renewed. Raises `Misuse`; None: not encrypted."""


class BrokerConnection:
    """Keeps a connection to ``broker`` for ``face`` from `start` until `close`."""

    def __init__(self, broker: Broker, face: Face, notice: Callable[[str], None]) -> None:
        self._broker = broker
        self._face = face
        self._notice = notice
        self._closing = asyncio.Event()
        self._task: asyncio.Task[None] | None = None
        self.lost: str | None = "not connected yet"
        """Why there is no session at present; None while there is one."""
        self._failed: str | None = None
        # The same for all sessions: the broker then ends the one before, and publishes its will, before this one says anything.
        self._client_id = f"steptwin-{secrets.token_hex(8)}"

    def start(self) -> None:
        self._task = endless(self._run(), self.fail)

    def fail(self, text: str) -> None:
        """An error has ended what its face publishes."""
        self._failed = text
        self._notice(f"[gateway.mqtt]: {text}")

    @property
    def trouble(self) -> str | None:
        """Why nothing is published; None while it is."""
        return self._failed or self.lost

    async def close(self) -> None:
        self._closing.set()
        if self._task is not None:
            await asyncio.wait((self._task,), timeout=LONGEST_CLOSE_S)
            await _end((self._task,))

    async def _run(self) -> None:
        loop = asyncio.get_running_loop()
        pause = FIRST_PAUSE_S
        reported = ""
        """Why there is no connection; the same reason is reported once."""

        def connected() -> None:
            nonlocal reported
            self.lost = None
            if reported:
                self._notice(f"{self._where}: connected again")
            reported = ""

        while not self._closing.is_set():
            began = loop.time()
            try:
                await self._session(connected)
            except (MqttError, SessionOver, OSError, ssl.SSLError, Misuse) as error:
                self.lost = _describe_error(error)
                if self.lost != reported:
                    reported = self.lost
                    self._notice(f"{self._where}: {reported}; it is tried again")
            if loop.time() - began >= STEADY_S:
                pause = FIRST_PAUSE_S
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._closing.wait(), pause)
            pause = min(2 * pause, LONGEST_PAUSE_S)

    @property
    def _where(self) -> str:
        return f"[gateway.mqtt]: broker {self._broker.address}"

    async def _session(self, connected: Callable[[], None]) -> None:
        """One session. Raises what ended it; nothing where the gateway is closed."""
        will = self._face.will()
        broker = self._broker
        client = Client(
            broker.address.host,
            broker.address.port,
            username=broker.user,
            password=broker.password,
            tls_context=None if broker.tls is None else broker.tls(),
            identifier=self._client_id,
            protocol=ProtocolVersion.V5,
            clean_start=True,
            keepalive=broker.keep_alive_s,
            timeout=float(broker.keep_alive_s),
            max_queued_incoming_messages=MOST_INCOMING,
            will=Will(will.topic, will.payload, will.qos, will.retain),
            logger=_logger(),
        )
        client.pending_calls_threshold = AT_ONCE
        try:
            async with client:
                connected()
                await self._use(client)
        finally:
            self._face.lost()

    async def _use(self, client: Client) -> None:
        link = _ClientLink(client)
        tasks = [
            asyncio.create_task(self._face.run(link)),
            asyncio.create_task(self._receive(client, link)),
            asyncio.create_task(self._until_closed()),
        ]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            ended = [task for task in tasks if task.done()]
            await _end(tasks)
        failed = [error for task in ended if not task.cancelled() and (error := task.exception()) is not None]
        if not failed or isinstance(failed[0], SessionOver):
            await self._face.leave(link)
        for error in failed:
            raise error

    async def _until_closed(self) -> None:
        await self._closing.wait()

    async def _receive(self, client: Client, link: BrokerLink) -> None:
        async for message in client.messages:
            self._face.take(link, message)


class _ClientLink:
    def __init__(self, client: Client) -> None:
        self._client = client

    async def publish(self, one: Publication) -> None:
        properties: Properties | None = None
        if one.correlation is not None:
            properties = Properties(PacketTypes.PUBLISH)
            properties.CorrelationData = one.correlation
        await self._client.publish(one.topic, one.payload, one.qos, one.retain, properties)

    async def publish_all(self, all_of: Iterable[Publication]) -> None:
        """The library takes each into its queue and then waits for turns of the event loop. It counts those that wait each time,
        so not all are given to it at once."""
        publications = list(all_of)
        for first in range(0, len(publications), AT_ONCE):
            await asyncio.gather(*map(self.publish, publications[first : first + AT_ONCE]))

    async def subscribe(self, topic: str, *, retained: bool) -> None:
        handling = SubscribeOptions.RETAIN_SEND_ON_SUBSCRIBE if retained else SubscribeOptions.RETAIN_DO_NOT_SEND
        options = SubscribeOptions(qos=1, retainAsPublished=True, retainHandling=handling)
        codes = await self._client.subscribe(topic, options=options)
        for code in codes:
            if not isinstance(code, int) and code.is_failure:
                raise SessionOver(f"it does not permit to subscribe to {topic}: {str(code).lower()}")


async def _end(tasks: Iterable[asyncio.Task[None]]) -> None:
    """Cancel tasks until they are done: `asyncio.wait_for` in the library may lose a cancellation (Python 3.11)."""
    for task in tasks:
        while not task.done():
            task.cancel()
            await asyncio.wait((task,), timeout=CANCEL_AGAIN_S)


_LOST = ("unspecified error", "disconnected during message iteration")
"""Names of the library for it."""


def _describe_error(error: Exception) -> str:
    if isinstance(error.__cause__, MqttError):  # why it was lost
        error = error.__cause__
    if isinstance(error, OSError):
        return reason(error)
    text = str(error).partition("] ")
    found = (text[2] if text[0].startswith("[") and text[2] else str(error)).rstrip(".").lower() or type(error).__name__
    return "the connection was lost" if found in _LOST else found


def _logger() -> logging.Logger:
    """The library's own words are not for users."""
    found = logging.getLogger("steptwin.gateways.mqtt")
    found.propagate = False
    if not found.handlers:
        found.addHandler(logging.NullHandler())
    return found
