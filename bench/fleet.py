"""Many MIC488 controllers in one process, one for every connection: ``fleet.py PORT``."""

from __future__ import annotations

import asyncio
import gc
import socket
import sys

from steptwin.live.clients import Clients
from steptwin.live.clock import Clock
from steptwin.live.descriptors import descriptors
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.tcp_epoll import EpollConnection
from steptwin.mic488.config import ControllerConfig
from steptwin.mic488.device import Mic488Device
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.toml.addresses import Address
from steptwin.wire.slave import TcpSlavePort

ENABLE_ALL = bytes.fromhex("06271e000f")
RUN = [bytes.fromhex("10") + (10068 + 2 * axis).to_bytes(2, "big") + bytes.fromhex("0002040000447a") for axis in range(4)]
"""VEL_ABS = 1000 imp/s."""


async def main(port: int) -> None:
    clock = Clock()
    config = ControllerConfig()
    clients = Clients()
    listener = socket.create_server(("127.0.0.1", port), backlog=1024)
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def accept() -> None:
        client, peer = listener.accept()
        client.setblocking(False)
        scheduler = Scheduler(clock.now())
        device = Mic488Device(config)
        scheduler.add("1", device)
        for request in (ENABLE_ALL, *RUN):
            device.execute(request, scheduler.now)
        EpollConnection(client, Address(*peer), RealTimeDriver(scheduler, clock), TcpSlavePort({1: device}), clients)

    descriptors().await_input(listener.fileno(), accept)
    gc.freeze()
    gc.disable()
    print("ready", flush=True)
    await asyncio.Event().wait()


if __name__ == "__main__":
    import resource

    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
    asyncio.run(main(int(sys.argv[1])))
