"""What viewers cost: processor time of the service, and requests that a Modbus master on the same twin loses.

python tests/studio/measure.py [VIEWERS]   (without other load on the computer)
"""

from __future__ import annotations

import asyncio
import json
import multiprocessing
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from pymodbus.client import ModbusTcpClient
from websockets.asyncio.client import connect

from steptwin.live.studio.demo import FOLDER, describe_demo

SECONDS = 10.0
Counts = Any
"""A number that processes share."""
POINTS = [f"table.M{axis}.{what}" for axis in (1, 2, 3) for what in ("position", "velocity", "status")]


class Counter(asyncio.Protocol):
    """Counts what a viewer is sent and decodes nothing, so that viewers take little of a core that a master needs."""

    def __init__(self, counts: Counts) -> None:
        self._counts = counts

    def data_received(self, data: bytes) -> None:
        self._counts.value += data.count(b'"values"')


async def view(url: str, until: float, counts: Counts) -> None:
    async with connect(url, max_size=None, compression=None, ping_interval=None) as socket:
        for message in (
            {"do": "hello", "version": 2},
            {"do": "watch", "points": [*POINTS, "time"], "rate": 30},
            {"do": "subscribe", "id": 1},
        ):
            await socket.send(json.dumps(message))
        socket.transport.set_protocol(Counter(counts))
        await asyncio.sleep(until - time.monotonic())
        socket.transport.set_protocol(socket)
        socket.transport.abort()


def view_all(url: str, viewers: int, until: float, counts: Counts) -> None:
    async def views() -> None:
        await asyncio.gather(*(view(url, until, counts) for _ in range(viewers)))

    asyncio.run(views())


def poll(port: int, until: float, counts: Counts) -> None:
    """A master that reads again and again."""
    with ModbusTcpClient("127.0.0.1", port=port) as client:
        while time.monotonic() < until:
            client.read_holding_registers(10020, count=8, device_id=1)
            counts.value += 1


def cpu_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def measure(url: str, port: int, pid: int, viewers: int, *, polls: bool) -> tuple[float, float, float]:
    """Share of a core, updates a second of each viewer, requests a second of the master."""
    until = time.monotonic() + 2 + SECONDS
    updates, requests = multiprocessing.Value("q", 0), multiprocessing.Value("q", 0)
    clients = [multiprocessing.Process(target=view_all, args=(url, viewers, until, updates))] if viewers else []
    clients += [multiprocessing.Process(target=poll, args=(port, until, requests))] if polls else []
    for client in clients:
        client.start()
    time.sleep(2)  # they are connected then
    before, seen = cpu_s(pid), (updates.value, requests.value)
    time.sleep(SECONDS)
    used = cpu_s(pid) - before
    found = (updates.value - seen[0]) / SECONDS / max(viewers, 1), (requests.value - seen[1]) / SECONDS
    for client in clients:
        client.join()
    return used / SECONDS, *found


def main() -> None:
    viewers = int(sys.argv[1]) if len(sys.argv) > 1 else 50
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "demo.toml").write_text(describe_demo(free_ports=True))
        (folder / "demo.prg").write_bytes((FOLDER / "demo.prg").read_bytes())
        ready = folder / "ready.json"
        command = ["steptwin", "studio", str(folder / "demo.toml"), "--http", "127.0.0.1:0", "--no-browser"]
        command.append("--open-to-local-users")
        environment = {**os.environ, "XDG_RUNTIME_DIR": name, "TERM": "dumb"}
        with subprocess.Popen(
            [sys.executable, "-m", *command, "--ready-file", str(ready)], stdout=subprocess.DEVNULL, env=environment
        ) as process:
            try:
                while not ready.exists():
                    time.sleep(0.05)
                points = {point["kind"]: point for point in reversed(json.loads(ready.read_text())["end_points"])}
                url = points["http"]["url"].replace("http", "ws", 1) + "ws"
                port = points["tcp"]["port"]
                for count, polls in ((0, False), (viewers, False), (0, True), (viewers, True)):
                    share, updates, requests = measure(url, port, process.pid, count, polls=polls)
                    print(f"{count:3} viewers: {share:5.1%} of a core, {updates:4.1f} updates/s each; master {requests:6.0f}/s")
            finally:
                process.terminate()


if __name__ == "__main__":
    main()
