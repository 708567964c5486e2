"""Gateways and history: the start of a server of OPC UA, rows into databases, what a gateway costs a Modbus master.

Times are processor time of the process, so that they mean something on a busy computer. ``CONTROLLERS``, ``ROWS`` and
``REQUESTS`` in the environment make it smaller.
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Generator, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from steptwin.history.database import read_url
from steptwin.history.rows import PointRow, RowBatch, RunHead, SampleRow
from steptwin.history.spool import Spool
from steptwin.history.writer import HistoryWriter

STEPTWIN = Path(sys.executable).with_name("steptwin")
LINE = '[world]\nname = "hall"\n[[line]]\nname = "bus"\ntcp = "127.0.0.1:0"\n[[mic488]]\nname = "table"\nline = "bus"\n'
OPCUA = '[gateway.opcua]\nlisten = "127.0.0.1:0"\n'
OTHERS = '[gateway.epics]\nprefix = "ST:"\nlisten = "127.0.0.1:0"\n[gateway.prometheus]\nlisten = "127.0.0.1:0"\n'
HISTORY = '[history]\ndatabase = "sqlite:///h.db"\n'
READ = bytes.fromhex("000100000006010327240028")
"""40 registers from 10020."""
ROUNDS, BATCH, POINTS = 9, 5000, 1000
BEGAN_US = 1_800_000_000_000_000


def size(name: str, usual: int) -> int:
    return int(os.environ.get(name, usual))


@dataclass
class Served:
    """``steptwin up`` of a description, and the processor time that it has taken, s."""

    process: subprocess.Popen[bytes]
    ready: dict[str, Any]
    idle: float = 0.0
    costs: list[float] = field(default_factory=list)

    def cpu_s(self) -> float:
        tasks = Path(f"/proc/{self.ready['pid']}/task")
        return sum(int((task / "schedstat").read_text().split()[0]) for task in tasks.iterdir()) / 1e9


@contextlib.contextmanager
def served(text: str) -> Generator[Served]:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "hall.toml").write_text(text)
        environment = {**os.environ, "XDG_RUNTIME_DIR": name}
        command = [STEPTWIN, "up", "hall.toml", "--ready-file", "ready.json"]
        with subprocess.Popen(command, cwd=folder, env=environment, stdout=subprocess.DEVNULL) as process:
            try:
                while not (folder / "ready.json").exists():
                    if process.poll() is not None:
                        raise SystemExit("steptwin up has ended")
                    time.sleep(0.05)
                yield Served(process, json.loads((folder / "ready.json").read_text()))
            finally:
                process.terminate()


def start(controllers: int) -> None:
    text = "".join(f'[[mic488]]\nname = "t{number}"\n' for number in range(controllers))
    for title, gateway in (("alone", ""), ("OPC UA", OPCUA)):
        begin = time.monotonic()
        with served(text + gateway) as one:
            wall = time.monotonic() - begin
            print(f"start of {controllers} MIC488, {title}: {one.cpu_s():.1f} s of processor time, {wall:.1f} s in all")


def batches(rows: int) -> Iterator[RowBatch]:
    for number in range(rows // BATCH):
        at = number * 100_000
        samples = [SampleRow(row % POINTS, at * 1000 + row, BEGAN_US + at + row, row * 0.1) for row in range(BATCH)]
        yield RowBatch(run="one", number=number + 1, time=at * 1000, at_us=BEGAN_US + at, samples=samples)


def write(url: str, rows: int) -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        points = tuple(PointRow(f"t{number // 10}.p{number}", "mm", "number") for number in range(POINTS))
        spool = Spool(folder / "spool")
        spool.begin(RunHead(key="one", subject="hall", is_virtual=True, began_ns=0, began_us=BEGAN_US, points=points))
        writer = HistoryWriter(read_url(url, folder), spool, print)
        writer.prepare()
        all_of = list(batches(rows))
        wall, cpu = time.monotonic(), time.process_time()
        writer.start()
        for batch in all_of:
            spool.append(batch)
        while spool.waiting:
            time.sleep(0.01)
        wall, cpu = time.monotonic() - wall, time.process_time() - cpu
        writer.close()
        spool.close()
    print(f"history, {url.partition(':')[0]}: {rows / cpu:.0f} rows in a second of processor time, {rows / wall:.0f} in a second")


def history(rows: int) -> None:
    write("sqlite:///h.db", rows)
    root = Path(__file__).parents[1]
    sys.path[:0] = [str(root), str(root / "tests" / "support")]  # the server is that of the tests
    from postgres import postgres_server, programs

    where = programs()
    if where is None:
        print("history, postgresql: it is not installed")
        return
    with postgres_server(where) as server:
        write(server.url, rows)


def read(one: Served, connection: socket.socket, requests: int) -> None:
    cpu, wall = one.cpu_s(), time.monotonic()
    for _ in range(requests):
        connection.sendall(READ)
        connection.recv(200)
    wall = time.monotonic() - wall
    one.costs.append((one.cpu_s() - cpu - one.idle * wall) / requests)


def master(requests: int) -> None:
    """Requests in a second of a processor that is only used for this: what the gateway takes without requests counts, too."""
    texts = {"alone": LINE, "OPC UA, EPICS, metrics": LINE + OPCUA + OTHERS, "history, too": LINE + OPCUA + OTHERS + HISTORY}
    with contextlib.ExitStack() as stack:
        all_of = {title: stack.enter_context(served(text)) for title, text in texts.items()}
        links: dict[str, socket.socket] = {}
        for title, one in all_of.items():
            port = next(point["port"] for point in one.ready["end_points"] if point["kind"] == "tcp")
            links[title] = stack.enter_context(socket.create_connection(("127.0.0.1", port)))
            links[title].setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            cpu, wall = one.cpu_s(), time.monotonic()
            time.sleep(5)
            one.idle = (one.cpu_s() - cpu) / (time.monotonic() - wall)
        for _ in range(ROUNDS):
            for title, one in all_of.items():
                read(one, links[title], requests)
        rates = {title: (1 - one.idle) / statistics.median(one.costs) for title, one in all_of.items()}
    for title, one in all_of.items():
        less = f"{100 * (1 - rates[title] / rates['alone']):.1f} % less; {100 * one.idle:.2f} % at rest"
        print(f"master, {title}: {rates[title]:.0f} reads of 40 registers in a second, {less}")


def main() -> None:
    start(size("CONTROLLERS", 100))
    history(size("ROWS", 300_000))
    master(size("REQUESTS", 4000))
