"""The sessions of clients: they read present values, write points and call methods. Everything else is the library's."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

from asyncua import ua
from asyncua.crypto.permission_rules import User, UserRole
from asyncua.server.internal_server import InternalServer
from asyncua.server.internal_session import InternalSession

from steptwin.access.roles import Role
from steptwin.errors import LineFailure, Misuse, Refusal, SteptwinError
from steptwin.gateways.clients import GatewayClient, NotPermitted, address_text
from steptwin.gateways.contract import ClientState
from steptwin.gateways.opcua.indexranges import part_of
from steptwin.gateways.opcua.limits import AT_ONCE, MOST_READ
from steptwin.gateways.opcua.nodetypes import status
from steptwin.gateways.opcua.subscriptions import MonitoredItems, Publish, packing

CODES: tuple[tuple[type[SteptwinError], int], ...] = (
    (NotPermitted, ua.StatusCodes.BadUserAccessDenied),
    (LineFailure, ua.StatusCodes.BadCommunicationError),
    (Refusal, ua.StatusCodes.BadInvalidState),
    (Misuse, ua.StatusCodes.BadInvalidArgument),
    (SteptwinError, ua.StatusCodes.BadUnexpectedError),
)
"""Status codes of errors, the first that fits."""


NOBODY = GatewayClient("nobody", Role.VIEWER)
"""Before a session is activated."""


@dataclass
class GatewayUser(User):
    """A user of the library's, who is always its ``User``: nobody changes nodes from outside."""

    client: GatewayClient = NOBODY

    def __post_init__(self) -> None:
        self.role = UserRole.User


ANONYMOUS = User(role=UserRole.Anonymous)


class SessionRequests(Protocol):
    """What sessions ask of the gateway."""

    async def refresh(self, nodes: Iterable[ua.NodeId]) -> None:
        """Give the variables among ``nodes`` their present values."""
        ...

    async def write(self, client: GatewayClient, node: ua.NodeId, value: ua.Variant | None) -> None:
        """Raises `ua.UaStatusCodeError` and `SteptwinError`."""
        ...

    async def call(
        self, client: GatewayClient, session: object, node: ua.NodeId, method: ua.NodeId, given: Sequence[ua.Variant]
    ) -> None:
        """As `write`."""
        ...

    async def history(self, params: ua.HistoryReadParameters, one: ua.HistoryReadValueId) -> ua.HistoryReadResult:
        """The past of one node. Raises `ua.UaStatusCodeError`."""
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

    def unwatched(self) -> None:
        """Some of them have no subscription any more."""
        ...


class GatewayServer(InternalServer):
    """The library's server with sessions of this gateway."""

    service: SessionRequests

    def create_session(
        self,
        name: str,
        user: User = ANONYMOUS,
        external: bool = False,
    ) -> InternalSession:
        return GatewaySession(self, self.aspace, self.subscription_service, name, user=user, external=external)

    def clients(self) -> list[ClientState]:
        """Those whose sessions have been activated."""
        sessions = self._external_sessions.values()
        return [one.present() for one in sessions if isinstance(one, GatewaySession) and one.is_activated()]


class GatewaySession(InternalSession):
    """A session of a client."""

    def __init__(self, server: GatewayServer, *arguments: Any, **named: Any) -> None:
        super().__init__(server, *arguments, **named)
        self._service = server.service

    @property
    def _client(self) -> GatewayClient:
        client = self.user.client if isinstance(self.user, GatewayUser) else NOBODY
        return replace(client, place=f"OPC UA, {address_text(self.name)}")

    def present(self) -> ClientState:
        client = self._client
        own = (one for one in self.subscription_service.subscriptions.values() if one.session_id == self.session_id)
        items = [item for one in own for item in one.monitored_item_srv._monitored_items.values()]  # no other way in the library
        names = [str(item.read_value_id.NodeId.Identifier) for item in items if item.read_value_id is not None]
        return ClientState(client.name, address_text(self.name), client.role.title, tuple(dict.fromkeys(names)))

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

    async def write(self, params: ua.WriteParameters) -> list[ua.StatusCode]:
        """As `call`."""
        return await asyncio.gather(*(self._code(self._write(one), "write", one) for one in params.NodesToWrite))

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
        return await asyncio.gather(*(self._call(one) for one in params))

    async def _call(self, one: ua.CallMethodRequest) -> ua.CallMethodResult:
        result = ua.CallMethodResult()
        calling = self._service.call(self._client, self, one.ObjectId, one.MethodId, one.InputArguments)
        result.StatusCode = await self._code(calling, "call", one)
        return result

    async def _code(self, action: Awaitable[None], do: str, asked: ua.WriteValue | ua.CallMethodRequest) -> ua.StatusCode:
        """The status code of what is done. What the gateway itself refuses is in the audit log, too."""
        try:
            await action
        except ua.UaStatusCodeError as error:
            code = ua.StatusCode(error.code)
            self._service.refused(self._client, do, {**_asked(asked), "code": code.name})
            return code
        except SteptwinError as error:
            return status(next(code for kind, code in CODES if isinstance(error, kind)))
        return ua.StatusCode()

    async def close_session(self, delete_subs: bool = True) -> None:
        self._service.leave(self)
        await super().close_session(delete_subs)

    async def create_subscription(
        self,
        params: ua.CreateSubscriptionParameters,
        callback: Publish,
        request_callback: Callable[..., Any] | None = None,
    ) -> ua.CreateSubscriptionResult:
        result = await super().create_subscription(params, packing(callback), request_callback)
        subscription = self.subscription_service.subscriptions[result.SubscriptionId]
        subscription.monitored_item_srv = MonitoredItems(subscription, self.aspace, self._service.unwatched)
        return result

    async def transfer_subscriptions(
        self, params: ua.TransferSubscriptionsParameters, callback: Publish
    ) -> list[ua.TransferResult]:
        return await super().transfer_subscriptions(params, packing(callback))

    async def create_monitored_items(self, params: ua.CreateMonitoredItemsParameters) -> list[ua.MonitoredItemCreateResult]:
        wanted = [one.ItemToMonitor.NodeId for one in params.ItemsToCreate]
        await self._service.refresh(wanted)
        results = await super().create_monitored_items(params)
        self._service.watch(node for node, result in zip(wanted, results, strict=True) if result.StatusCode.is_good())
        return results


def _asked(asked: ua.WriteValue | ua.CallMethodRequest) -> dict[str, object]:
    """Fields of the audit log for what a client wants."""
    if isinstance(asked, ua.WriteValue):
        value = None if asked.Value.Value is None else asked.Value.Value.Value
        return {"node": asked.NodeId.to_string(), "value": str(value)}
    given = [str(one.Value) for one in asked.InputArguments]
    return {"object": asked.ObjectId.to_string(), "method": asked.MethodId.to_string(), "arguments": ", ".join(given)}
