"""The server of PV Access: the library's, at the given addresses rather than those of the environment."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable, Mapping

from p4p.server import Server

from steptwin.errors import LineFailure
from steptwin.gateways.contract import ClientState
from steptwin.gateways.epics.pvchannels import PvChannel, RecordProvider
from steptwin.gateways.epics.records import Record
from steptwin.simulation.toml.addresses import Address
from steptwin.system import reason


class PvAccessServer:
    """Serves ``records`` at ``address``; searches over UDP at the port after it, or with port 0 at a free one.

    ``on_leave`` is called with the channel of a client that has gone.
    """

    def __init__(
        self, records: Mapping[str, Record], address: Address, beacons: Address, on_leave: Callable[[object], None]
    ) -> None:
        self._records = dict(records)
        self._address = address
        self._beacons = beacons
        self._on_leave = on_leave
        self._provider: RecordProvider | None = None
        self._server: Server | None = None

    async def open(self) -> Mapping[str, int]:
        """The ports of connections and of searches. Raises `LineFailure`."""
        host, port = self._address
        try:
            # The library would take another port and tell it only to its own log.
            socket.create_server((host, port), reuse_port=False).close()
        except OSError as error:
            raise LineFailure(f"cannot listen on {self._address}: {reason(error)}") from error
        self._provider = RecordProvider(self._records, self._on_leave)
        settings = {
            "EPICS_PVAS_INTF_ADDR_LIST": host,
            "EPICS_PVAS_SERVER_PORT": str(port),
            "EPICS_PVAS_BROADCAST_PORT": str(port + 1 if port else 0),
            "EPICS_PVAS_BEACON_ADDR_LIST": str(self._beacons),
            "EPICS_PVAS_AUTO_BEACON_ADDR_LIST": "NO",
        }
        self._server = Server(providers=[self._provider], conf=settings, useenv=False)
        chosen = self._server.conf()
        found = int(chosen["EPICS_PVAS_SERVER_PORT"])
        if port not in (0, found):
            await self.close()
            raise LineFailure(f"cannot listen on {self._address}: it was taken meanwhile")
        return {"port": found, "search_port": int(chosen["EPICS_PVAS_BROADCAST_PORT"])}

    def clients(self, role: str) -> list[ClientState]:
        """By address, with the channels that they have. Their names are known after their first put."""
        channels = () if self._provider is None else tuple(self._provider.channels)
        found: dict[str, list[PvChannel]] = {}
        for channel in sorted(channels, key=lambda one: one.name):
            found.setdefault(str(channel), []).append(channel)
        return [
            ClientState(next((one.account for one in own if one.account), ""), place, role, tuple(one.name for one in own))
            for place, own in found.items()
        ]

    @property
    def has_clients(self) -> bool:
        return self._provider is not None and bool(self._provider.channels)

    async def close(self) -> None:
        if self._server is not None:
            await asyncio.to_thread(self._server.stop)  # it waits for its threads, which may be waiting for this one
        if self._provider is not None:
            await self._provider.close()
