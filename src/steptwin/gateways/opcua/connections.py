"""Connections of clients, which go on being read while requests wait for a device.

The library answers the requests of a connection one after the other: a stop would be read after the motion before it has been
executed, and reads would stand still as long as a command waits. Here each request that may wait is answered from a task of its
own, as the protocol permits (OPC 10000-4, 4.3).
"""

from __future__ import annotations

import asyncio
from typing import Any, cast

from asyncua import ua
from asyncua.common.utils import Buffer
from asyncua.server.binary_server_asyncio import BinaryServer, OPCUAProtocol
from asyncua.server.server import Server
from asyncua.server.uaprocessor import UaProcessor
from asyncua.ua.ua_binary import nodeid_from_binary, struct_from_binary

from steptwin.gateways.opcua.nodetypes import standard, status

_CALL = standard(ua.ObjectIds.CallRequest_Encoding_DefaultBinary)
_MAY_WAIT = frozenset(
    {
        _CALL,
        standard(ua.ObjectIds.ReadRequest_Encoding_DefaultBinary),
        standard(ua.ObjectIds.WriteRequest_Encoding_DefaultBinary),
        standard(ua.ObjectIds.HistoryReadRequest_Encoding_DefaultBinary),
        standard(ua.ObjectIds.CreateMonitoredItemsRequest_Encoding_DefaultBinary),
    }
)
MOST_AT_ONCE = 64
"""Requests of one connection that wait. Calls are bounded by their devices: a stop among them is never refused here."""


class GatewayConnection(UaProcessor):
    """The requests of one connection, in the order in which they come; answers in the order in which they are there."""

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self._answers: set[asyncio.Task[None]] = set()

    async def process_message(self, seqhdr: Any, body: Buffer) -> bool:
        head = body.copy()
        service = nodeid_from_binary(head)
        if service not in _MAY_WAIT:
            return bool(await super().process_message(seqhdr, body))
        if service != _CALL and len(self._answers) >= MOST_AT_ONCE:
            fault = ua.ServiceFault()
            fault.ResponseHeader.ServiceResult = status(ua.StatusCodes.BadTooManyOperations)
            self.send_response(struct_from_binary(ua.RequestHeader, head).RequestHandle, seqhdr, fault)
            return True
        task = asyncio.create_task(self._answer(seqhdr, body))
        self._answers.add(task)
        task.add_done_callback(self._answers.discard)
        return True

    async def _answer(self, seqhdr: Any, body: Buffer) -> None:
        if not await super().process_message(seqhdr, body):
            self._transport.close()  # as the library does

    async def close(self) -> None:
        """The connection is lost: what waits is not answered any more."""
        for task in self._answers:
            task.cancel()
        await super().close()


class _GatewayProtocol(OPCUAProtocol):
    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        if self.processor is not None:
            self.processor = GatewayConnection(self.iserver, transport, self.limits)
            self.processor.set_policies(self.policies)


class _GatewayListener(BinaryServer):
    def _make_protocol(self) -> OPCUAProtocol:  # no other way in the library
        return _GatewayProtocol(self.iserver, self._policies, self.clients, self.closing_tasks, self.limits)


class ListeningServer(Server):
    """The library's server, with such connections."""

    async def start(self) -> None:
        """As that of the library, which knows one kind of connection only."""
        await self._setup_server_nodes()
        await self.iserver.start()
        try:
            host, port = cast("tuple[str, int]", self._get_bind_socket_info())
            self.bserver = _GatewayListener(self.iserver, host, port, self.limits)
            self.bserver.set_policies(self._policies)
            await self.bserver.start()
        except BaseException:
            await self.iserver.stop()
            raise
