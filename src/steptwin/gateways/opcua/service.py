"""What is behind the nodes: present values, commands, and the values of what clients subscribe to."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from typing import Any

from asyncua import ua
from asyncua.server.address_space import AddressSpace, AttributeValue

from steptwin.datasheet import Argument, Limits
from steptwin.errors import LineFailure, Refusal
from steptwin.gateways.clients import GatewayClient
from steptwin.gateways.contract import GatewaySubject
from steptwin.gateways.leases import JogLeases
from steptwin.gateways.opcua.addressspace import ArrayNode, BoundMethod, PointNode
from steptwin.gateways.opcua.limits import AT_ONCE
from steptwin.gateways.opcua.nodetypes import data_value, number_of, status
from steptwin.gateways.opcua.past import PastNodes
from steptwin.gateways.points import GatewayPoint, PointValue, State
from steptwin.gateways.sampling import Sample, Sampler
from steptwin.subject.commands import Jog, ReadPoints, StopAxes

ARRAY_PAUSE = 10
"""Arrays take long to read: they are looked at once in so many publications."""


_NOTHING = object()


class WatchedNode:
    """A variable that clients follow: ``attribute`` has its value in the address space, ``shown`` is the last one."""

    __slots__ = ("attribute", "point", "shown")

    def __init__(self, point: GatewayPoint, attribute: AttributeValue) -> None:
        self.point = point
        self.attribute = attribute
        self.shown: object = _NOTHING

    @property
    def is_followed(self) -> bool:
        return bool(self.attribute.datachange_callbacks)

    async def notify(self, sample: Sample, value: PointValue) -> None:
        """As the library's `write_attribute_value`, which looks for the node and checks the type of each value."""
        fresh = data_value(value, self.point.type, sample.at, is_answered=sample.state is not None)
        self.attribute.value = fresh
        for handle, call in list(self.attribute.datachange_callbacks.items()):
            with suppress(KeyError):  # a client has just ended this subscription
                await call(handle, fresh)


class WatchedNodes:
    """Variables of one controller that clients follow."""

    def __init__(self) -> None:
        self._groups: dict[str, list[WatchedNode]] = {}
        self._state: State | None = None
        """Of the last sample; None: everything has to be looked at."""

    def add(self, point: GatewayPoint, attribute: AttributeValue) -> None:
        group = self._groups.setdefault(point.group, [])
        if not any(node.point is point for node in group):
            group.append(WatchedNode(point, attribute))
        self._state = None

    def forget(self, points: Iterable[GatewayPoint]) -> None:
        """Whoever follows these has been told values that were read: the next ones are told, whatever they are."""
        for point in points:
            for node in self._groups.get(point.group, ()):
                if node.point is point:
                    node.shown = _NOTHING

    def keep_followed(self) -> bool:
        """Only those that are followed; whether there are any."""
        groups = {name: [node for node in nodes if node.is_followed] for name, nodes in self._groups.items()}
        self._groups = {name: nodes for name, nodes in groups.items() if nodes}
        return bool(self._groups)

    def changes(self, sample: Sample) -> Iterator[tuple[WatchedNode, PointValue]]:
        """Those with another value than before, and this value."""
        before, self._state = self._state, sample.state
        for nodes in self._groups.values():
            if sample.state is None:
                for node in nodes:
                    node.shown = _NOTHING
                    yield node, None
                continue
            point = nodes[0].point
            part = point.part(sample.state)
            if before is not None and point.part(before) is part:
                continue
            for node in nodes:
                value = node.point.of(part)
                if node.shown != value:
                    node.shown = value
                    yield node, value


class NodeService:
    """The `Service` of sessions, for variables ``points`` by controller and ``methods`` by object and method."""

    def __init__(
        self,
        space: AddressSpace,
        subject: GatewaySubject,
        sampler: Sampler,
        points: Mapping[str, Sequence[PointNode]],
        methods: Mapping[tuple[ua.NodeId, ua.NodeId], BoundMethod],
        arrays: Mapping[ua.NodeId, ArrayNode],
        past: PastNodes | None,
    ) -> None:
        self._space = space
        self._subject = subject
        self._sampler = sampler
        self._points = points
        self._methods = methods
        self._arrays = arrays
        self._past = past
        self._watched_arrays: dict[ua.NodeId, int] = {}
        """What has been subscribed to, and publications until it is read again."""
        self._of_node = {node.id: (machine, node) for machine, nodes in points.items() for node in nodes}
        self._leases = JogLeases(subject)
        self._watched: dict[str, WatchedNodes] = {}
        """What has been subscribed to, by controller."""
        self._has_gone = False
        """Whether a subscription has ended since the last publication."""

    # ------------------------------------------------------------------ values

    async def refresh(self, nodes: Iterable[ua.NodeId]) -> None:
        wanted: dict[str, list[PointNode]] = {}
        for node in nodes:
            if node in self._arrays:
                await self._show_array(node)
            found = self._of_node.get(node)
            if found is not None:
                wanted.setdefault(found[0], []).append(found[1])
        for machine, points in wanted.items():
            await self._show(await self._sampler.take(machine), points)

    async def refresh_all(self) -> None:
        for machine, points in self._points.items():
            await self._show(await self._sampler.take(machine), points)

    def watch(self, nodes: Iterable[ua.NodeId]) -> None:
        for node in nodes:
            if node in self._arrays:
                self._watched_arrays.setdefault(node, 0)
            found = self._of_node.get(node)
            if found is not None:
                machine, point = found
                attribute = self._space[node].attributes[ua.AttributeIds.Value]
                self._watched.setdefault(machine, WatchedNodes()).add(point.point, attribute)
                self._sampler.hasten(machine)
        self._sampler.watch(self._watched)

    def unwatched(self) -> None:
        self._has_gone = True

    async def publish(self, within_s: float) -> None:
        """Notify the clients of what has changed, or of nothing ``within_s``."""
        if self._has_gone:
            self._has_gone = False
            self._forget()
        for sample in await self._sampler.changed(within_s):
            watched = self._watched.get(sample.machine)
            if watched is not None:
                for node, value in watched.changes(sample):
                    await node.notify(sample, value)

    async def publish_arrays(self) -> None:
        for node, left in list(self._watched_arrays.items()):
            self._watched_arrays[node] = left - 1 if left > 0 else ARRAY_PAUSE
            if left <= 0:
                await self._show_array(node)

    def _forget(self) -> None:
        """Nodes that have no subscription any more."""
        for node in list(self._watched_arrays):
            if not self._is_followed(node):
                del self._watched_arrays[node]
        for machine, nodes in list(self._watched.items()):
            if not nodes.keep_followed():
                del self._watched[machine]
        self._sampler.watch(self._watched)

    def _is_followed(self, node: ua.NodeId) -> bool:
        return bool(self._space[node].attributes[ua.AttributeIds.Value].datachange_callbacks)

    async def _show(self, sample: Sample, points: Sequence[PointNode]) -> None:
        for number, node in enumerate(points, 1):
            await self._write(sample, node, None if sample.state is None else node.point.read(sample.state))
            if number % AT_ONCE == 0:
                await asyncio.sleep(0)
        watched = self._watched.get(sample.machine)
        if watched is not None:
            watched.forget(node.point for node in points)

    async def _write(self, sample: Sample, node: PointNode, value: PointValue) -> None:
        fresh = data_value(value, node.point.type, sample.at, is_answered=sample.state is not None)
        await self._space.write_attribute_value(node.id, ua.AttributeIds.Value, fresh)

    async def _show_array(self, node: ua.NodeId) -> None:
        array = self._arrays[node]
        at: Any = datetime.now(UTC)
        try:
            found: Any = (await self._subject.do(ReadPoints(array.elements))).value
        except (LineFailure, Refusal):
            fresh = ua.DataValue(ua.Variant(), status(ua.StatusCodes.BadNoCommunication), at)
        else:
            words = [int(one["value"] or 0) & 0xFFFF for one in found]
            fresh = ua.DataValue(ua.Variant(words, ua.VariantType.UInt16, is_array=True), SourceTimestamp=at)
        await self._space.write_attribute_value(node, ua.AttributeIds.Value, fresh)

    async def history(self, params: ua.HistoryReadParameters, one: ua.HistoryReadValueId) -> ua.HistoryReadResult:
        if self._past is None:
            raise ua.UaStatusCodeError(ua.StatusCodes.BadHistoryOperationUnsupported)
        return await self._past.read(params.HistoryReadDetails, one, release=params.ReleaseContinuationPoints)

    # ------------------------------------------------------------------ commands

    async def write(self, client: GatewayClient, node: ua.NodeId, value: ua.Variant | None) -> None:
        found = self._of_node.get(node)
        if found is None or found[1].point.write is None:
            known = node in self._space
            raise ua.UaStatusCodeError(ua.StatusCodes.BadNotWritable if known else ua.StatusCodes.BadNodeIdUnknown)
        machine, there = found
        point = there.point
        number = number_of(value, point.type)
        if number is None or point.write is None:
            raise ua.UaStatusCodeError(ua.StatusCodes.BadTypeMismatch)
        _check_range(number, point.limits)
        await client.do(self._subject, point.write(number))
        await self._show(await self._sampler.take(machine), (there,))

    async def call(
        self, client: GatewayClient, session: object, node: ua.NodeId, method: ua.NodeId, given: Sequence[ua.Variant]
    ) -> None:
        bound = self._methods.get((node, method))
        if bound is None:
            raise ua.UaStatusCodeError(ua.StatusCodes.BadMethodInvalid)
        row = bound.row
        if len(given) != len(row.arguments):
            missing = len(given) < len(row.arguments)
            raise ua.UaStatusCodeError(ua.StatusCodes.BadArgumentsMissing if missing else ua.StatusCodes.BadTooManyArguments)
        values: list[float] = []
        for argument, variant in zip(row.arguments, given, strict=True):
            number = number_of(variant, argument.type)
            if number is None:
                raise ua.UaStatusCodeError(ua.StatusCodes.BadInvalidArgument)
            if argument.of:
                _check_range(number, _argument(bound, argument.of).limits)
            values.append(number)
        own = [value for value, argument in zip(values, row.arguments, strict=True) if argument.of]
        wanted = row.make(bound.part.name, bound.axis, *own)
        if isinstance(wanted, Jog):
            await self._leases.jog(session, client, wanted, values[-1])
            return
        await client.do(self._subject, wanted)
        if isinstance(wanted, StopAxes):
            self._leases.stopped(wanted)

    def refused(self, client: GatewayClient, do: str, fields: Mapping[str, object]) -> None:
        client.refused(self._subject, do, fields)

    def leave(self, session: object) -> None:
        self._leases.drop(session)

    def close(self) -> None:
        self._leases.close()


def _argument(bound: BoundMethod, name: str) -> Argument:
    """The argument of the command, for this axis."""
    taken = next(one for one in bound.part.takes if (one.command, one.axis) == (bound.row.command, bound.axis))
    return next(one for one in taken.arguments if one.name == name)


def _check_range(number: float, limits: Limits | None) -> None:
    if limits is None:
        return
    is_low = limits.low is not None and (number <= limits.low if limits.is_low_excluded else number < limits.low)
    if is_low or (limits.high is not None and number > limits.high) or number != number:  # noqa: PLR0124  NaN
        raise ua.UaStatusCodeError(ua.StatusCodes.BadOutOfRange)
