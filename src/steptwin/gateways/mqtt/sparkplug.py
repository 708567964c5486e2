"""The Sparkplug face: an edge node whose devices are the controllers (Sparkplug B, version 3.0 of the specification).

Values are read whether a broker is there or not. What changes before the births is kept, up to a number, and follows them as
historical data.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections import deque
from collections.abc import Callable, Coroutine, Iterable, Iterator, Mapping
from datetime import UTC, datetime
from typing import NamedTuple

from aiomqtt import Message

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse, SteptwinError
from steptwin.eventloop import endless
from steptwin.gateways.clients import GatewayClient
from steptwin.gateways.contract import GatewaySubject
from steptwin.gateways.mqtt.connection import BrokerLink, Publication, SessionOver
from steptwin.gateways.mqtt.sparkplugcodec import (
    SparkplugMetric,
    SparkplugPayload,
    SparkplugType,
    SparkplugValue,
    decode_payload,
    encode_payload,
)
from steptwin.gateways.mqtt.sparkplugmetrics import BDSEQ, DROPPED, REBIRTH, RESULT, MetricRow, Namespace
from steptwin.gateways.points import CLOCK, GatewayPoint, State
from steptwin.gateways.sampling import Sample, Sampler
from steptwin.subject.commands import Command

AT_MOST = 500
"""Metrics in one message."""
COUNTED = 256
"""Values of seq and bdSeq: 0 to 255."""
CLOCK_S = 1.0
"""Period at which the time is read."""
MOST_COMMANDS = 1000


class _Change(NamedTuple):
    """``device``: None for the edge node."""

    device: str | None
    row: MetricRow
    value: SparkplugValue
    at: int
    is_historical: bool


class _Device:
    """State of a device, or of the edge node."""

    def __init__(self, rows: tuple[MetricRow, ...]) -> None:
        self.rows = rows
        self.values: dict[int, SparkplugValue] = {row.alias: row.start for row in rows}
        self.at = _now()
        self.answers = False
        self.is_seen = False
        self.is_born = False
        """In this session."""
        self.state: State | None = None
        """State of the last sample."""
        self.groups: dict[str, list[tuple[MetricRow, GatewayPoint]]] = {}
        """Metrics that show points, by the part of a state in which these are."""
        for row in rows:
            if row.point is not None:
                self.groups.setdefault(row.point.group, []).append((row, row.point))

    def shown(self, sample: Sample) -> Iterator[tuple[MetricRow, SparkplugValue]]:
        """The values of a sample that may be others than those of the last one."""
        before, self.state = self.state, sample.state
        for rows in self.groups.values():
            first = rows[0][1]
            part = None if sample.state is None else first.part(sample.state)
            if part is None or before is None or first.part(before) is not part:
                yield from ((row, None if part is None else point.typed_in(part)) for row, point in rows)


class SparkplugFace:
    """Shows ``subject`` as an edge node. A `Face`."""

    def __init__(
        self,
        namespace: Namespace,
        rows: Mapping[str | None, tuple[MetricRow, ...]],
        subject: GatewaySubject,
        sampler: Sampler,
        anybody: GatewayClient,
        *,
        interval: Nanos,
        store: int,
    ) -> None:
        self._topic = namespace
        self._subject = subject
        self._sampler = sampler
        self._anybody = anybody
        self._interval_s = interval / SECOND
        self._devices = {name: _Device(of) for name, of in rows.items()}
        self._changes: deque[_Change] = deque(maxlen=store)
        self._dropped = 0
        self._clock_at = 0.0
        self._bdseq = 0
        self._has_session = False
        """Whether a session has had this number."""
        self._seq = 0
        self._is_born = False
        self._host = asyncio.Event()
        """The primary host is online; set where there is none."""
        self._host_at = -1
        """Timestamp of its last state."""
        self._wants_rebirth = False
        self._news = asyncio.Event()
        """There is something to be published."""
        self._watching: asyncio.Task[None] | None = None
        self._doing: set[asyncio.Task[None]] = set()

    def start(self, failed: Callable[[str], None]) -> None:
        """``failed``: as of `endless`."""
        self._watching = endless(self._watch(), failed)

    def close(self) -> None:
        for task in (self._watching, *self._doing):
            if task is not None:
                task.cancel()

    # ------------------------------------------------------------------ values, with or without a broker

    async def _watch(self) -> None:
        loop = asyncio.get_running_loop()
        self._sampler.watch(name for name in self._devices if name is not None)
        while True:
            samples = await self._sampler.changed(self._interval_s)
            if "time" in self._subject.description.commands and loop.time() - self._clock_at >= CLOCK_S:
                self._clock_at = loop.time()
                samples.append(await self._sampler.take(CLOCK))
            for sample in samples:
                self._look(sample)

    def _look(self, sample: Sample) -> None:
        name = None if sample.controller == CLOCK else sample.controller
        device = self._devices[name]
        answers = sample.state is not None
        # Births and deaths tell what appears and disappears; without a session it is kept like other changes.
        is_reported = not device.is_seen or (answers != device.answers and self._is_born)
        if answers != device.answers:
            self._news.set()
        device.answers, device.is_seen = answers, True
        device.at = round(sample.at.timestamp() * 1000)
        for row, value in device.shown(sample):
            if is_reported:
                device.values[row.alias] = value
            elif value != device.values[row.alias]:
                self._change(name, row, value, device.at)

    def _change(self, name: str | None, row: MetricRow, value: SparkplugValue, at: int) -> None:
        device = self._devices[name]
        device.values[row.alias] = value
        if len(self._changes) == self._changes.maxlen:
            self._dropped += 1
        self._news.set()
        self._changes.append(_Change(name, row, value, at, is_historical=not device.is_born))

    # ------------------------------------------------------------------ the session

    def will(self) -> Publication:
        """bdSeq is the next one with every session (tck-id-topics-nbirth-bdseq-increment), not with each try to connect."""
        if self._has_session:
            self._bdseq = (self._bdseq + 1) % COUNTED
        self._has_session = False
        return self._death()

    def _death(self) -> Publication:
        payload = SparkplugPayload(timestamp=_now(), metrics=(self._bdseq_metric(),))
        return Publication(self._topic("NDEATH"), encode_payload(payload), qos=1)

    def _bdseq_metric(self) -> SparkplugMetric:
        return SparkplugMetric(name=BDSEQ, timestamp=_now(), type=SparkplugType.INT64, value=self._bdseq)

    async def run(self, link: BrokerLink) -> None:
        self._has_session = True
        await link.subscribe(self._topic("NCMD"), retained=False)
        await link.subscribe(self._topic("DCMD", "+"), retained=False)
        self._host_at = -1
        self._host.clear()
        if self._topic.state is None:
            self._host.set()
        else:
            await link.subscribe(self._topic.state, retained=True)
        await self._host.wait()
        await self._bear(link)
        while True:
            self._news.clear()
            if self._wants_rebirth:
                self._wants_rebirth = False
                await self._bear(link)
            await self._follow_devices(link)
            await self._publish_changes(link)
            await self._news.wait()

    async def leave(self, link: BrokerLink) -> None:
        await link.publish(self._death())

    def lost(self) -> None:
        self._is_born = False
        for device in self._devices.values():
            device.is_born = False
        self._keep([one._replace(is_historical=True) for one in self._changes])

    # ------------------------------------------------------------------ births and deaths

    async def _bear(self, link: BrokerLink) -> None:
        """NBIRTH with seq 0, and DBIRTH of each device that answers; no data comes between (tck-id-payloads-nbirth-seq)."""
        node = self._devices[None]
        self._seq = 0
        for row in node.rows:
            if row.name == DROPPED:
                node.values[row.alias] = self._dropped
        metrics = (self._bdseq_metric(), *(row.birth(node.values[row.alias], _now()) for row in node.rows))
        await self._send(link, "NBIRTH", None, metrics)
        self._is_born = node.is_born = True
        for name, device in self._devices.items():
            if name is not None and device.answers:
                await self._bear_device(link, name, device)

    async def _bear_device(self, link: BrokerLink, name: str, device: _Device) -> None:
        device.is_born = True  # from here on changes are live
        metrics = tuple(row.birth(device.values[row.alias], device.at) for row in device.rows)
        await self._send(link, "DBIRTH", name, metrics)

    async def _follow_devices(self, link: BrokerLink) -> None:
        for name, device in self._devices.items():
            if name is None or device.answers == device.is_born:
                continue
            if device.answers:
                await self._bear_device(link, name, device)
            else:
                device.is_born = False
                await self._send(link, "DDEATH", name, ())

    async def _publish_changes(self, link: BrokerLink) -> None:
        """In their order, as far as their device is born; those of others wait."""
        ready = [one for one in self._changes if self._devices[one.device].is_born]
        if not ready:
            return
        self._keep([one for one in self._changes if not self._devices[one.device].is_born])
        found: list[Publication] = []
        first = 0
        while first < len(ready):
            together = _together(ready, first)
            device = together[0].device
            metrics = [one.row.data(one.value, one.at, is_historical=one.is_historical) for one in together]
            found.append(self._publication("NDATA" if device is None else "DDATA", device, metrics))
            first += len(together)
        try:
            await link.publish_all(found)
        except BaseException:
            self._keep([*ready, *self._changes])  # some may come twice, with the same moments; none is lost
            raise

    def _keep(self, changes: list[_Change]) -> None:
        """The newest of them, as many as are kept."""
        most = self._changes.maxlen or 0
        self._dropped += max(len(changes) - most, 0)
        self._changes = deque(changes, maxlen=most)

    async def _send(self, link: BrokerLink, kind: str, device: str | None, metrics: Iterable[SparkplugMetric]) -> None:
        await link.publish(self._publication(kind, device, metrics))

    def _publication(self, kind: str, device: str | None, metrics: Iterable[SparkplugMetric]) -> Publication:
        payload = SparkplugPayload(timestamp=_now(), metrics=tuple(metrics), seq=self._seq)
        self._seq = (self._seq + 1) % COUNTED
        return Publication(self._topic(kind, device), encode_payload(payload))

    # ------------------------------------------------------------------ from the host

    def take(self, link: BrokerLink, message: Message) -> None:
        topic = str(message.topic)
        if topic == self._topic.state:
            self._take_state(link, message.payload)
            return
        if message.retain or not self._is_born:
            return
        device = None if topic == self._topic("NCMD") else topic.rpartition("/")[2]
        if device not in self._devices:
            return
        try:
            metrics = decode_payload(message.payload).metrics
        except Misuse:
            return
        if len(self._doing) >= MOST_COMMANDS:
            self._publish_answer(device, f"{MOST_COMMANDS} commands are being done already")
            return
        task = asyncio.create_task(self._do_all(device, metrics))
        self._doing.add(task)
        task.add_done_callback(self._doing.discard)

    def _take_state(self, link: BrokerLink, payload: bytes) -> None:
        """A state that is older than the one before does not count (…-edge-node-termination-host-offline-timestamp)."""
        with contextlib.suppress(ValueError, TypeError, KeyError, RecursionError):
            found = json.loads(payload)
            is_online, at = found["online"], found["timestamp"]
            if not isinstance(is_online, bool) or not isinstance(at, int) or at < self._host_at:
                return
            self._host_at = at
            if is_online:
                self._host.set()
            elif self._is_born:
                raise SessionOver(f"the primary host {self._topic.host} is offline")
            else:
                self._host.clear()

    async def _do_all(self, name: str | None, metrics: Iterable[SparkplugMetric]) -> None:
        """All are begun at once, in their order: a stop does not wait for the motion before it."""
        rows = self._devices[name].rows
        begun: list[Coroutine[None, None, None]] = []
        for metric in metrics:
            row = next((row for row in rows if row.name == metric.name), None) or next(
                (row for row in rows if metric.name is None and row.alias == metric.alias), None
            )
            if name is None and row is not None and row.name == REBIRTH:
                self._wants_rebirth |= metric.value is True
                self._news.set()
            elif name is not None:
                begun.append(self._do(name, row, metric))
        await asyncio.gather(*begun)

    async def _do(self, name: str, row: MetricRow | None, metric: SparkplugMetric) -> None:
        called = row.name if row is not None else metric.name or f"alias {metric.alias}"
        try:
            wanted = _command(row, metric)
        except Misuse as error:
            self._anybody.refused(self._subject, "write", {"controller": name, "metric": called, "value": str(metric.value)})
            self._publish_answer(name, f"{called}: {error}")
            return
        try:
            await self._anybody.do(self._subject, wanted)
            result = f"{called}: done"
        except SteptwinError as error:
            result = f"{called}: {error}"
        self._publish_answer(name, result)

    def _publish_answer(self, name: str | None, result: str) -> None:
        for one in self._devices[name].rows:
            if one.name == RESULT:
                self._change(name, one, result, _now())


def _command(row: MetricRow | None, metric: SparkplugMetric) -> Command:
    """Raises `Misuse`."""
    if row is None:
        raise Misuse("the device has no metric of that name")
    if row.command is None:
        raise Misuse("it can only be read")
    if metric.is_historical:
        raise Misuse("a command is not historical")
    return row.command(metric.value)


def _together(changes: list[_Change], begin: int) -> list[_Change]:
    """Those from ``begin`` on that can be in one message: each metric once, so that all of its values have their moments."""
    first = changes[begin]
    aliases: set[int] = set()
    found: list[_Change] = []
    for one in changes[begin : begin + AT_MOST]:
        if (one.device, one.is_historical) != (first.device, first.is_historical):
            break
        if one.row.alias in aliases and not one.is_historical:
            break
        aliases.add(one.row.alias)
        found.append(one)
    return found


def _now() -> int:
    """ms since 1970, UTC: by the wall clock, which only stamps."""
    return round(datetime.now(UTC).timestamp() * 1000)
