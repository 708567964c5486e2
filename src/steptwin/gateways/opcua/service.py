"""Values and commands behind the nodes: present values, commands, and the values of what clients subscribe to."""

from __future__ import annotations

import asyncio
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

from asyncua import Server, ua

from steptwin.datasheet import Argument, Limits
from steptwin.errors import LineFailure, Refusal
from steptwin.gateways.clients import GatewayClient
from steptwin.gateways.contract import GatewaySubject
from steptwin.gateways.leases import JogLeases
from steptwin.gateways.opcua.addressspace import AddressSpaceBuilder, BoundMethod, PointNode
from steptwin.gateways.opcua.historyread import HistoryNodes
from steptwin.gateways.opcua.limits import AT_ONCE
from steptwin.gateways.opcua.nodetypes import data_value, number_of, status
from steptwin.gateways.points import PointValue, State
from steptwin.gateways.sampling import Sample, Sampler
from steptwin.subject.commands import Jog, ReadPoints, StopAxes

ARRAY_PAUSE = 10
"""Publications between two reads of an array, because arrays take long to read."""


_NOTHING = object()


class WatchedNodes:
    """Variables of one controller to which clients subscribe."""

    def __init__(self) -> None:
        self._groups: dict[str, dict[ua.NodeId, PointNode]] = {}
        self._notified: dict[ua.NodeId, PointValue] = {}
        """The last value of each; missing: the next one is notified, whatever it is."""
        self._state: State | None = None
        """State of the last sample; None: every value has to be compared."""

    def add(self, node: PointNode) -> None:
        self._groups.setdefault(node.point.group, {})[node.id] = node
        self._state = None

    def forget(self, nodes: Iterable[PointNode]) -> None:
        """These have got values from a direct read: always notify the next sample."""
        for node in nodes:
            self._notified.pop(node.id, None)

    def keep(self, followed: Collection[ua.NodeId]) -> bool:
        """Keep those that are in ``followed``; return whether there are any."""
        groups = {
            name: {identity: node for identity, node in nodes.items() if identity in followed}
            for name, nodes in self._groups.items()
        }
        self._groups = {name: nodes for name, nodes in groups.items() if nodes}
        return bool(self._groups)

    def changes(self, sample: Sample) -> Iterator[tuple[PointNode, PointValue]]:
        """Those with another value than before, and this value."""
        before, self._state = self._state, sample.state
        for nodes in self._groups.values():
            if sample.state is None:
                for node in nodes.values():
                    self._notified.pop(node.id, None)
                    yield node, None
                continue
            point = next(iter(nodes.values())).point
            part = point.part(sample.state)
            if before is not None and point.part(before) is part:
                continue
            for node in nodes.values():
                value = node.point.of(part)
                if self._notified.get(node.id, _NOTHING) != value:
                    self._notified[node.id] = value
                    yield node, value


class NodeService:
    """The `SessionRequests` of sessions, for the nodes that ``builder`` has added to ``server``."""

    def __init__(
        self,
        server: Server,
        subject: GatewaySubject,
        sampler: Sampler,
        builder: AddressSpaceBuilder,
        history: HistoryNodes | None,
    ) -> None:
        self._server = server
        self._subject = subject
        self._sampler = sampler
        self._points = builder.points
        self._methods = builder.methods
        self._arrays = builder.arrays
        self._history = history
        self._watched_arrays: dict[ua.NodeId, int] = {}
        """Subscribed arrays, and publications until they are read again."""
        self._of_node = builder.nodes()
        self._leases = JogLeases(subject)
        self._watched: dict[str, WatchedNodes] = {}
        """Subscribed nodes, by controller."""

    # ------------------------------------------------------------------ values

    async def refresh(self, nodes: Iterable[ua.NodeId]) -> None:
        wanted: dict[str, list[PointNode]] = {}
        for node in nodes:
            if node in self._arrays:
                await self._show_array(node)
            found = self._of_node.get(node)
            if found is not None:
                wanted.setdefault(found[0], []).append(found[1])
        for controller, points in wanted.items():
            await self._show(await self._sampler.take(controller), points)

    async def refresh_all(self) -> None:
        for controller, points in self._points.items():
            await self._show(await self._sampler.take(controller), points)

    def watch(self, nodes: Iterable[ua.NodeId]) -> None:
        for node in nodes:
            if node in self._arrays:
                self._watched_arrays.setdefault(node, 0)
            found = self._of_node.get(node)
            if found is not None:
                controller, point = found
                self._watched.setdefault(controller, WatchedNodes()).add(point)
                self._sampler.hasten(controller)
        self._sampler.watch(self._watched)

    def keep_followed(self, followed: Collection[ua.NodeId]) -> None:
        """Forget nodes to which no client subscribes any more."""
        self._watched_arrays = {node: left for node, left in self._watched_arrays.items() if node in followed}
        kept = {controller: nodes for controller, nodes in self._watched.items() if nodes.keep(followed)}
        if len(kept) < len(self._watched):
            self._watched = kept
            self._sampler.watch(kept)

    async def publish(self, within_s: float) -> None:
        """Notify the clients of what has changed, or of nothing ``within_s``."""
        for sample in await self._sampler.changed(within_s):
            watched = self._watched.get(sample.controller)
            if watched is not None:
                for node, value in watched.changes(sample):
                    await self._write(sample, node, value)

    async def publish_arrays(self) -> None:
        for node, left in list(self._watched_arrays.items()):
            self._watched_arrays[node] = left - 1 if left > 0 else ARRAY_PAUSE
            if left <= 0:
                await self._show_array(node)

    async def _show(self, sample: Sample, points: Sequence[PointNode]) -> None:
        for number, node in enumerate(points, 1):
            await self._write(sample, node, None if sample.state is None else node.point.read(sample.state))
            if number % AT_ONCE == 0:
                await asyncio.sleep(0)
        watched = self._watched.get(sample.controller)
        if watched is not None:
            watched.forget(points)

    async def _write(self, sample: Sample, node: PointNode, value: PointValue) -> None:
        fresh = data_value(value, node.point.type, sample.at, is_answered=sample.state is not None)
        await self._server.write_attribute_value(node.id, fresh)

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
        await self._server.write_attribute_value(node, fresh)

    async def history(self, params: ua.HistoryReadParameters, one: ua.HistoryReadValueId) -> ua.HistoryReadResult:
        if self._history is None:
            raise ua.UaStatusCodeError(ua.StatusCodes.BadHistoryOperationUnsupported)
        return await self._history.read(params.HistoryReadDetails, one, release=params.ReleaseContinuationPoints)

    # ------------------------------------------------------------------ commands

    async def write(self, client: GatewayClient, node: ua.NodeId, value: ua.Variant | None) -> None:
        found = self._of_node.get(node)
        if found is None or found[1].point.write is None:
            known = self._server.read_attribute_value(node, ua.AttributeIds.NodeClass).StatusCode
            is_known = known is not None and known.is_good()
            raise ua.UaStatusCodeError(ua.StatusCodes.BadNotWritable if is_known else ua.StatusCodes.BadNodeIdUnknown)
        controller, there = found
        point = there.point
        number = number_of(value, point.type)
        if number is None or point.write is None:
            raise ua.UaStatusCodeError(ua.StatusCodes.BadTypeMismatch)
        _check_range(number, point.limits)
        await client.do(self._subject, point.write(number))
        await self._show(await self._sampler.take(controller), (there,))

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
