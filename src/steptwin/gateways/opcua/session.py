"""Sessions of clients: they read present values, write points, call methods and subscribe. Everything else is the library's.

The public interface of asyncua gives the role of a client neither to a method nor to what sets a value, one status code for
neither of several writes, and reads the next request of a connection when the one before has been answered: a stop would wait
for the motion before it. It accepts filters that it does not know, and counts a dead band from the last value rather than from
the one that was notified. So this module derives from its internal server and session, and nothing else does: it replaces
services of OPC UA (those that `AbstractSession` names), ``process_message`` and ``send_response`` of a connection (which leaves
DiagnosticInfos empty), and ``isub`` of monitored items.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from contextvars import ContextVar
from dataclasses import dataclass, replace
from itertools import count
from typing import Any, NamedTuple, Protocol

from asyncua import ua
from asyncua.common.utils import Buffer
from asyncua.crypto.permission_rules import User, UserRole
from asyncua.server.internal_server import InternalServer
from asyncua.server.internal_session import InternalSession
from asyncua.ua.ua_binary import nodeid_from_binary, struct_from_binary

from steptwin.access.roles import Role
from steptwin.errors import LineFailure, Misuse, Refusal, SteptwinError
from steptwin.gateways.clients import GatewayClient, NotPermitted, address_text
from steptwin.gateways.contract import ClientState
from steptwin.gateways.opcua.filters import ChangeFilter, Reading, change_filter, differs
from steptwin.gateways.opcua.indexranges import check_range, part_of
from steptwin.gateways.opcua.limits import AT_ONCE, MOST_READ
from steptwin.gateways.opcua.nodetypes import standard, status

CODES: tuple[tuple[type[SteptwinError], int], ...] = (
    (NotPermitted, ua.StatusCodes.BadUserAccessDenied),
    (LineFailure, ua.StatusCodes.BadCommunicationError),
    (Refusal, ua.StatusCodes.BadInvalidState),
    (Misuse, ua.StatusCodes.BadInvalidArgument),
    (SteptwinError, ua.StatusCodes.BadUnexpectedError),
)
"""Status codes of errors, the first that fits."""
MOST_AT_ONCE = 64
"""Requests of one connection that wait. Calls are bounded by their devices: a stop among them is never refused here."""
NOBODY = GatewayClient("nobody", Role.VIEWER)
"""Before a session is activated."""

ADDITIONAL_INFO = 0x80
"""Bit of ReturnDiagnostics: a text for each operation (OPC 10000-4, 7.12 and 7.33)."""
_reasons: ContextVar[list[str] | None] = ContextVar("reasons", default=None)
"""Reasons of what the request is refused for, by operation; None where its client has not asked for them."""

_CALL = standard(ua.ObjectIds.CallRequest_Encoding_DefaultBinary)
_WRITE = standard(ua.ObjectIds.WriteRequest_Encoding_DefaultBinary)
_MAY_WAIT = frozenset(
    {
        _CALL,
        standard(ua.ObjectIds.ReadRequest_Encoding_DefaultBinary),
        _WRITE,
        standard(ua.ObjectIds.HistoryReadRequest_Encoding_DefaultBinary),
        standard(ua.ObjectIds.CreateMonitoredItemsRequest_Encoding_DefaultBinary),
    }
)


@dataclass
class GatewayUser(User):
    """A user of the library's, who is always its ``User``: nobody changes nodes from outside."""

    client: GatewayClient = NOBODY

    def __post_init__(self) -> None:
        self.role = UserRole.User


ANONYMOUS = User(role=UserRole.Anonymous)


class SessionRequests(Protocol):
    """Requests of sessions to the gateway."""

    async def refresh(self, nodes: Iterable[ua.NodeId]) -> None:
        """Give the variables among ``nodes`` their present values."""
        ...

    async def write(self, client: GatewayClient, node: ua.NodeId, value: ua.Variant | None) -> None:
        """Raises `ua.UaStatusCodeError` and `SteptwinError`."""
        ...

    async def call(
        self, client: GatewayClient, session: object, node: ua.NodeId, method: ua.NodeId, given: Sequence[ua.Variant]
    ) -> None:
        """Raises as `write`."""
        ...

    async def history(self, params: ua.HistoryReadParameters, one: ua.HistoryReadValueId) -> ua.HistoryReadResult:
        """The past values of a node. Raises `ua.UaStatusCodeError`."""
        ...

    def refused(self, client: GatewayClient, do: str, fields: Mapping[str, object]) -> None:
        """Record a write or call that is not a command."""
        ...

    def leave(self, session: object) -> None:
        """A session ends."""
        ...

    def watch(self, nodes: Iterable[ua.NodeId]) -> None:
        """Clients subscribe to these."""
        ...


class GatewayServer(InternalServer):
    """The library's server with sessions of this gateway."""

    service: SessionRequests
    connections: Callable[[], Iterable[Any]]
    """Gives those of the binary protocol."""

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self._sessions: set[GatewaySession] = set()
        self._queues: dict[int, NotificationQueue] = {}
        """By subscription."""

    def create_session(self, name: str, user: User = ANONYMOUS, external: bool = False) -> InternalSession:
        self._answer_concurrently()
        return GatewaySession(self, self.aspace, self.subscription_service, name, user=user, external=external)

    def lookup_external_session(self, auth_token: ua.NodeId) -> InternalSession | None:
        """Called for a client that comes back over another connection."""
        self._answer_concurrently()
        return super().lookup_external_session(auth_token)

    def _answer_concurrently(self) -> None:
        for one in self.connections():
            if one.processor is not None and "process_message" not in vars(one.processor):
                ConcurrentRequests(one)

    def register_external_session(self, session: InternalSession) -> None:
        super().register_external_session(session)
        if isinstance(session, GatewaySession):
            self._sessions.add(session)

    def unregister_external_session(self, session: InternalSession) -> None:
        super().unregister_external_session(session)
        if isinstance(session, GatewaySession):
            self._sessions.discard(session)

    def queue_notifications(self, number: int) -> None:
        """Put a queue between the monitored items of a new subscription and its notifications."""
        subscription = self.subscription_service.subscriptions[number]
        queue: Any = NotificationQueue(subscription)
        subscription.monitored_item_srv.isub = self._queues[number] = queue

    def queue(self, number: int) -> NotificationQueue | None:
        """That of a subscription, which ends also by its time-out."""
        return self._queues.get(number) if number in self.subscription_service.subscriptions else None

    def followed(self) -> set[ua.NodeId]:
        """The nodes to which clients subscribe."""
        self._queues = {number: queue for number, queue in self._queues.items() if self.queue(number) is queue}
        return {item.what.NodeId for queue in self._queues.values() for item in queue.items.values()}

    def clients(self) -> list[ClientState]:
        """Those whose sessions have been activated."""
        return [one.present() for one in self._sessions if one.is_activated()]


class ConcurrentRequests:
    """The requests of a connection, begun in the order in which they come and answered in that in which they are done.

    The protocol permits it (OPC 10000-4, 4.3). Decryption and sequence numbers stay those of the library.
    """

    def __init__(self, connection: Any) -> None:
        processor = self._processor = connection.processor
        self._transport = connection.transport
        self._process = processor.process_message
        self._close = processor.close
        self._send = processor.send_response
        self._answers: set[asyncio.Task[None]] = set()
        processor.process_message, processor.close = self.process_message, self.close
        processor.send_response = self.send_response

    async def process_message(self, seqhdr: Any, body: Buffer) -> bool:
        head = body.copy()
        service = nodeid_from_binary(head)
        if service not in _MAY_WAIT:
            return bool(await self._process(seqhdr, body))
        if service != _CALL and len(self._answers) >= MOST_AT_ONCE:
            fault = ua.ServiceFault()
            fault.ResponseHeader.ServiceResult = status(ua.StatusCodes.BadTooManyOperations)
            self._processor.send_response(struct_from_binary(ua.RequestHeader, head).RequestHandle, seqhdr, fault)
            return True
        asks_why = service in (_CALL, _WRITE) and struct_from_binary(ua.RequestHeader, head).ReturnDiagnostics & ADDITIONAL_INFO
        task = asyncio.create_task(self._answer(seqhdr, body, [] if asks_why else None))
        self._answers.add(task)
        task.add_done_callback(self._answers.discard)
        return True

    async def _answer(self, seqhdr: Any, body: Buffer, reasons: list[str] | None) -> None:
        _reasons.set(reasons)  # of this task and those that it begins
        if not await self._process(seqhdr, body):
            self._transport.close()  # as the library does

    def send_response(self, handle: Any, seqhdr: Any, response: Any, *rest: Any) -> None:
        reasons = _reasons.get()
        if reasons:
            response.DiagnosticInfos = [ua.DiagnosticInfo(AdditionalInfo=ua.String(text) if text else None) for text in reasons]
        self._send(handle, seqhdr, response, *rest)

    async def close(self) -> None:
        """The connection is lost: what waits is not answered any more."""
        for task in self._answers:
            task.cancel()
        await self._close()


@dataclass(slots=True)
class MonitoredItem:
    what: ua.ReadValueId
    handle: int
    """The client's."""
    filter: ChangeFilter
    size: int = 0
    """Size of the queue of the library."""
    notified: ua.DataValue | None = None
    """The value that the client knows."""


class NotificationQueue:
    """The queue of ``subscription``, into which only comes what the filters of its items let through.

    The library notifies every change that the trigger of a filter selects; items have their numbers here for the handle of the
    client, because the first value comes before the library says how it calls an item.
    """

    def __init__(self, subscription: Any) -> None:
        self.subscription = subscription
        self.items: dict[int, MonitoredItem] = {}
        self.numbers: dict[int, int] = {}
        """By the ids of the library."""
        self._numbers = count(1)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.subscription, name)

    def add(self, request: ua.MonitoredItemCreateRequest, what: ChangeFilter) -> tuple[int, ua.MonitoredItemCreateRequest]:
        """The number of a new item, and what the library is to be asked for."""
        number, asked = next(self._numbers), request.RequestedParameters
        self.items[number] = MonitoredItem(request.ItemToMonitor, asked.ClientHandle, what)
        if request.ItemToMonitor.AttributeId == ua.AttributeIds.EventNotifier:
            return number, request
        return number, replace(request, RequestedParameters=replace(asked, ClientHandle=number, Filter=what.trigger_only()))

    def item(self, identity: int) -> MonitoredItem | None:
        return self.items.get(self.numbers.get(identity, 0))

    def forget(self, identity: int) -> None:
        self.items.pop(self.numbers.pop(identity, 0), None)

    async def enqueue_datachange_event(self, identity: int, one: ua.MonitoredItemNotification, size: int) -> None:
        item = self.items[int(one.ClientHandle)]
        value = part_of(one.Value, item.what.IndexRange)
        if item.notified is None or differs(item.notified, value, item.filter):
            item.notified = value
            notification = ua.MonitoredItemNotification(item.handle, value)
            await self.subscription.enqueue_datachange_event(identity, notification, size)

    async def switch(self, identity: int, read: Reading, *, on: bool) -> None:
        """An item that is enabled again reports its value, also the one that it had before (OPC 10000-4, 5.13.1.3): the library
        compares with that."""
        item = self.item(identity)
        if item is None or item.what.AttributeId == ua.AttributeIds.EventNotifier:
            return
        if not on:
            item.notified = None
        elif item.notified is None:
            value = read(item.what.NodeId, item.what.AttributeId)
            notification = ua.MonitoredItemNotification(self.numbers[identity], value)
            await self.enqueue_datachange_event(identity, notification, item.size)


class GatewaySession(InternalSession):
    """A session of a client."""

    def __init__(self, server: GatewayServer, *arguments: Any, **named: Any) -> None:
        super().__init__(server, *arguments, **named)
        self._server = server
        self._service = server.service

    @property
    def _client(self) -> GatewayClient:
        client = self.user.client if isinstance(self.user, GatewayUser) else NOBODY
        return replace(client, place=f"OPC UA, {address_text(self.name)}")

    def present(self) -> ClientState:
        client, subscriptions = self._client, self.subscription_service.subscriptions
        own = (self._server.queue(number) for number, one in subscriptions.items() if one.session_id == self.session_id)
        names = (str(item.what.NodeId.Identifier) for queue in own if queue is not None for item in queue.items.values())
        return ClientState(client.name, address_text(self.name), client.role.title, tuple(dict.fromkeys(names)))

    # ------------------------------------------------------------------ values

    async def read(self, params: ua.ReadParameters) -> list[ua.DataValue]:
        wanted = params.NodesToRead
        if len(wanted) > MOST_READ:
            raise ua.UaStatusCodeError(ua.StatusCodes.BadTooManyOperations)
        await self._service.refresh(one.NodeId for one in wanted if one.AttributeId == ua.AttributeIds.Value)
        found: list[ua.DataValue] = []
        for first in range(0, len(wanted), AT_ONCE):
            found += await super().read(replace(params, NodesToRead=wanted[first : first + AT_ONCE]))
            await asyncio.sleep(0)  # others are not held up
        return [part_of(value, one.IndexRange) for one, value in zip(wanted, found, strict=True)]

    async def history_read(self, params: ua.HistoryReadParameters) -> list[ua.HistoryReadResult]:
        return [await self._history(params, one) for one in params.NodesToRead]

    async def _history(self, params: ua.HistoryReadParameters, one: ua.HistoryReadValueId) -> ua.HistoryReadResult:
        try:
            return await self._service.history(params, one)
        except ua.UaStatusCodeError as error:
            result = ua.HistoryReadResult()
            result.StatusCode = ua.StatusCode(error.code)
            return result

    # ------------------------------------------------------------------ commands

    async def write(self, params: ua.WriteParameters) -> list[ua.StatusCode]:
        """As `call`."""
        return _told(await asyncio.gather(*(self._code(self._write(one), "write", one) for one in params.NodesToWrite)))

    async def _write(self, one: ua.WriteValue) -> None:
        if one.AttributeId != ua.AttributeIds.Value:
            raise ua.UaStatusCodeError(ua.StatusCodes.BadNotWritable)
        if one.IndexRange:
            raise ua.UaStatusCodeError(ua.StatusCodes.BadIndexRangeInvalid)
        if one.Value.Value is None:
            raise ua.UaStatusCodeError(ua.StatusCodes.BadTypeMismatch)
        has_status = one.Value.StatusCode is not None and one.Value.StatusCode.value != ua.StatusCodes.Good
        if has_status or one.Value.SourceTimestamp is not None or one.Value.ServerTimestamp is not None:
            raise ua.UaStatusCodeError(ua.StatusCodes.BadWriteNotSupported)
        await self._service.write(self._client, one.NodeId, one.Value.Value)

    async def call(self, params: list[ua.CallMethodRequest]) -> list[ua.CallMethodResult]:
        """All are begun at once, in their order: a stop does not wait for the motion before it."""
        codes = _told(await asyncio.gather(*(self._code(self._call(one), "call", one) for one in params)))
        return [ua.CallMethodResult(StatusCode=code) for code in codes]

    async def _call(self, one: ua.CallMethodRequest) -> None:
        await self._service.call(self._client, self, one.ObjectId, one.MethodId, one.InputArguments)

    async def _code(self, action: Awaitable[None], do: str, asked: ua.WriteValue | ua.CallMethodRequest) -> _Outcome:
        """Status of an action. What the gateway itself refuses is in the audit log, too."""
        try:
            await action
        except ua.UaStatusCodeError as error:
            code = ua.StatusCode(error.code)
            self._service.refused(self._client, do, {**_asked(asked), "code": code.name})
            return _Outcome(code)
        except SteptwinError as error:
            return _Outcome(status(next(code for kind, code in CODES if isinstance(error, kind))), str(error))
        return _Outcome(ua.StatusCode())

    async def close_session(self, delete_subs: bool = True) -> None:
        self._service.leave(self)
        await super().close_session(delete_subs)

    # ------------------------------------------------------------------ subscriptions

    async def create_subscription(
        self,
        params: ua.CreateSubscriptionParameters,
        callback: Callable[..., Any],
        request_callback: Callable[..., Any] | None = None,
    ) -> ua.CreateSubscriptionResult:
        result = await super().create_subscription(params, callback, request_callback)
        self._server.queue_notifications(result.SubscriptionId)
        return result

    async def create_monitored_items(self, params: ua.CreateMonitoredItemsParameters) -> list[ua.MonitoredItemCreateResult]:
        queue = self._server.queue(params.SubscriptionId)
        if queue is None:
            return await super().create_monitored_items(params)  # raises what is wrong
        wanted = [one.ItemToMonitor.NodeId for one in params.ItemsToCreate]
        await self._service.refresh(wanted)
        results: list[ua.MonitoredItemCreateResult] = []
        for one in params.ItemsToCreate:
            results.append(await self._monitor(queue, params, one))
            if len(results) % AT_ONCE == 0:
                await asyncio.sleep(0)
        self._service.watch(node for node, result in zip(wanted, results, strict=True) if result.StatusCode.is_good())
        return results

    async def _monitor(
        self, queue: NotificationQueue, params: ua.CreateMonitoredItemsParameters, one: ua.MonitoredItemCreateRequest
    ) -> ua.MonitoredItemCreateResult:
        try:
            check_range(one.ItemToMonitor.IndexRange)
            what = change_filter(self._server.read_attribute_value, one.ItemToMonitor, one.RequestedParameters.Filter)
        except ua.UaStatusCodeError as error:
            refused = ua.MonitoredItemCreateResult()
            refused.StatusCode = ua.StatusCode(error.code)
            return refused
        number, asked = queue.add(one, what)
        (result,) = await super().create_monitored_items(replace(params, ItemsToCreate=[asked]))
        if result.StatusCode.is_good():
            queue.numbers[result.MonitoredItemId] = number
            queue.items[number].size = result.RevisedQueueSize
        else:
            del queue.items[number]
        return result

    async def modify_monitored_items(self, params: ua.ModifyMonitoredItemsParameters) -> list[ua.MonitoredItemModifyResult]:
        queue = self._server.queue(params.SubscriptionId)
        if queue is None:
            return await super().modify_monitored_items(params)  # raises what is wrong
        return [await self._modify(queue, params, one) for one in params.ItemsToModify]

    async def _modify(
        self, queue: NotificationQueue, params: ua.ModifyMonitoredItemsParameters, one: ua.MonitoredItemModifyRequest
    ) -> ua.MonitoredItemModifyResult:
        item, asked = queue.item(one.MonitoredItemId), one.RequestedParameters
        refused = ua.MonitoredItemModifyResult()
        if item is None:
            refused.StatusCode = status(ua.StatusCodes.BadMonitoredItemIdInvalid)
            return refused
        try:
            what = change_filter(self._server.read_attribute_value, item.what, asked.Filter)
        except ua.UaStatusCodeError as error:
            refused.StatusCode = ua.StatusCode(error.code)
            return refused
        if item.what.AttributeId != ua.AttributeIds.EventNotifier:
            item.filter, item.handle = what, asked.ClientHandle
            one = replace(one, RequestedParameters=replace(asked, Filter=what.trigger_only()))
        (result,) = await super().modify_monitored_items(replace(params, ItemsToModify=[one]))
        item.size = result.RevisedQueueSize
        return result

    async def set_monitoring_mode(self, params: ua.SetMonitoringModeParameters) -> list[ua.StatusCode]:
        codes = await super().set_monitoring_mode(params)
        queue = self._server.queue(params.SubscriptionId)
        if queue is not None:
            is_on = params.MonitoringMode != ua.MonitoringMode.Disabled
            for identity in params.MonitoredItemIds:
                await queue.switch(identity, self._server.read_attribute_value, on=is_on)
        return codes

    async def delete_monitored_items(self, params: ua.DeleteMonitoredItemsParameters) -> list[ua.StatusCode]:
        codes = await super().delete_monitored_items(params)
        queue = self._server.queue(params.SubscriptionId)
        if queue is not None:
            for identity in params.MonitoredItemIds:
                queue.forget(identity)
        return codes


class _Outcome(NamedTuple):
    code: ua.StatusCode
    reason: str = ""


def _told(outcomes: Sequence[_Outcome]) -> list[ua.StatusCode]:
    """The codes; the reasons go with the answer, if its client asks for them."""
    reasons = _reasons.get()
    if reasons is not None and any(one.reason for one in outcomes):
        reasons[:] = [one.reason for one in outcomes]
    return [one.code for one in outcomes]


def _asked(asked: ua.WriteValue | ua.CallMethodRequest) -> dict[str, object]:
    """Fields of the audit log for what a client wants."""
    if isinstance(asked, ua.WriteValue):
        value = None if asked.Value.Value is None else asked.Value.Value.Value
        return {"node": asked.NodeId.to_string(), "value": str(value)}
    given = [str(one.Value) for one in asked.InputArguments]
    return {"object": asked.ObjectId.to_string(), "method": asked.MethodId.to_string(), "arguments": ", ".join(given)}
