"""Requests per second and latencies against pymodbus' and libmodbus' servers, in one run on pinned processors.

The server runs on the last processor, the client (C, so that it is not what is measured) on the first. Four axes of the
controller are moving while their positions and velocities are read; the peers serve static registers.
"""

from __future__ import annotations

import argparse
import ast
import contextlib
import importlib
import json
import os
import pty
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
BIN = Path(sys.executable).parent
PROCESSORS = sorted(os.sched_getaffinity(0))

SERVERS = {
    "tcp": "Modbus TCP against both peers.",
    "pty": "RTU on a pty against both.",
    "fleet": "5000 controllers in one process.",
}
USUAL = [*SERVERS, "motion"]


def modules() -> dict[str, str]:
    """Every module with a `main` measures something; by its name, the first sentence of its docstring."""
    found: dict[str, str] = {}
    for path in sorted(HERE.glob("*.py")):
        tree = ast.parse(path.read_text())
        text = ast.get_docstring(tree) or ""
        mains = [part for part in tree.body if isinstance(part, ast.FunctionDef) and part.name == "main"]
        if mains and path.stem != "__main__":
            found[path.stem] = " ".join(text.split("\n\n")[0].split(";")[0].split())
    return found


# name: (request PDU, bytes of the response PDU)
REQUESTS = {
    "FC3x10": (bytes.fromhex("032724000a"), 22),
    "FC3x40": (bytes.fromhex("0327240028"), 82),
    "FC16x2": (bytes.fromhex("1000640002040000447a"), 5),
    "FC5": (bytes.fromhex("051770ff00"), 5),
}


PEERS = ("steptwin", "libmodbus", "pymodbus")


@dataclass(frozen=True)
class Figures:
    per_second: float
    p50_us: float
    p99_us: float
    cpu_us: float
    """Processor time that the server took for each request: what other processes on the machine do matters less to it."""


def build(source: str, folder: Path, *flags: str) -> Path:
    program = folder / Path(source).stem
    subprocess.run(["cc", "-O2", "-o", str(program), str(HERE / source), *flags], check=True)
    return program


def on_processor(number: int) -> list[str]:
    return ["taskset", "-c", str(PROCESSORS[number])]


def free_port() -> int:
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def cpu_ns(process: int) -> int:
    """Processor time that a process of one thread has taken (Linux)."""
    return int(Path(f"/proc/{process}/schedstat").read_text().split()[0])


@contextlib.contextmanager
def server(command: list[str]) -> Generator[int]:
    """A server process on its processor, until it says that it is ready; its process id."""
    process = subprocess.Popen(
        on_processor(-1) + command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, start_new_session=True
    )
    try:
        if process.stdout is None or "ready" not in process.stdout.readline():
            raise RuntimeError(f"{command[:3]} did not start")
        yield process.pid
    finally:
        process.terminate()
        process.wait(10)


@contextlib.contextmanager
def steptwin(folder: Path) -> Generator[tuple[dict[str, dict[str, Any]], int]]:
    """The real thing with four axes moving; its end points and process id."""
    ready = folder / "ready.json"
    command = [str(BIN / "steptwin"), "serve", "mic488", "--tcp", "127.0.0.1:0", "--pty", str(folder / "line")]
    command += ["--name", f"bench-{os.getpid()}", "--ready-file", str(ready)]
    process = subprocess.Popen(on_processor(-1) + command, stdout=subprocess.DEVNULL, start_new_session=True)
    try:
        deadline = time.monotonic() + 10
        while not ready.exists():
            if process.poll() is not None or time.monotonic() > deadline:
                raise RuntimeError("steptwin did not start")
            time.sleep(0.02)
        places = {e["kind"]: e for e in json.loads(ready.read_text())["end_points"]}
        with socket.create_connection(("127.0.0.1", places["tcp"]["port"])) as s:
            for pdu in ["06271e000f", *(f"10{10068 + 2 * axis:04x}0002040000447a" for axis in range(4))]:
                s.sendall(mbap(bytes.fromhex(pdu)))
                if s.recv(300)[7] & 0x80:
                    raise RuntimeError(f"{pdu} was refused")
        yield places, process.pid
    finally:
        process.terminate()
        process.wait(10)


def mbap(pdu: bytes) -> bytes:
    return b"\0\1\0\0" + (len(pdu) + 1).to_bytes(2, "big") + b"\1" + pdu


def rtu(pdu: bytes) -> bytes:
    from steptwin.wire.rtu import encode_frame

    return encode_frame(1, pdu)


def run_client(client: Path, server: int, *arguments: object) -> Figures | None:
    before = cpu_ns(server)
    done = subprocess.run(
        [*on_processor(0), str(client), *map(str, arguments)], capture_output=True, text=True, check=False, close_fds=False
    )
    if done.returncode:
        print(f"  client: {done.stderr.strip()}", file=sys.stderr)
        return None
    count, seconds, p50, p99 = map(float, done.stdout.split())
    return Figures(count / seconds, p50, p99, (cpu_ns(server) - before) / count / 1000)


def row(name: str, results: dict[str, Figures | None]) -> None:
    cells = [_cell(results[who]) for who in PEERS]
    ratios = [_ratio(results["steptwin"], results[who]) for who in PEERS[1:]]
    print(f"{name:<22} {'  '.join(cells)}  {' '.join(ratios)}", flush=True)


def _cell(figures: Figures | None) -> str:
    if figures is None:
        return f"{'failed':>31}"
    return f"{figures.per_second:7.0f}/s {figures.p50_us:6.0f} {figures.p99_us:6.0f} {figures.cpu_us:7.1f}"


def _ratio(ours: Figures | None, theirs: Figures | None) -> str:
    if not ours or not theirs:
        return f"{'-':>14}"
    return f"{ours.per_second / theirs.per_second:6.2f} ({theirs.cpu_us / ours.cpu_us:5.2f})"


def best(runs: list[Figures | None]) -> Figures | None:
    """The run with the median rate: these machines are noisy."""
    good = sorted((r for r in runs if r), key=lambda r: r.per_second)
    return good[len(good) // 2] if good else None


def compare_tcp(client: Path, libmodbus: Path, folder: Path, seconds: float, rounds: int) -> None:
    lib_port, py_port = free_port(), free_port()
    with (
        steptwin(folder) as (places, our_process),
        server([str(libmodbus), "tcp", str(lib_port)]) as lib_process,
        server([sys.executable, "-W", "ignore", str(HERE / "pymodbus_server.py"), "tcp", str(py_port)]) as py_process,
    ):
        ports = {
            "steptwin": (our_process, places["tcp"]["port"]),
            "libmodbus": (lib_process, lib_port),
            "pymodbus": (py_process, py_port),
        }
        measured = [(f"{name} ×{n}", pdu, n, 1) for n in (1, 16, 100) for name, (pdu, _) in REQUESTS.items()]
        # What one client reads another need not have computed again, so here they read different things.
        measured += [(f"FC3x10 ×{n} mixed", REQUESTS["FC3x10"][0], n, 16) for n in (16, 100)]
        for name, pdu, connections, blocks in measured:
            runs: dict[str, list[Figures | None]] = {who: [] for who in ports}
            for _ in range(rounds):
                for who, (process, port) in ports.items():
                    arguments = ("tcp", port, connections, seconds, mbap(pdu).hex(), 0, blocks)
                    runs[who].append(run_client(client, process, *arguments))
            row(f"tcp {name}", {who: best(r) for who, r in runs.items()})


def compare_tty(client: Path, libmodbus: Path, folder: Path, seconds: float, rounds: int) -> None:
    with contextlib.ExitStack() as stack:
        places, process = stack.enter_context(steptwin(folder))
        ends = {"steptwin": (process, places["pty"]["path"])}
        for who, command in {
            "libmodbus": [str(libmodbus), "rtu"],
            "pymodbus": [sys.executable, "-W", "ignore", str(HERE / "pymodbus_server.py"), "rtu"],
        }.items():
            # The peers open one end of a pty as their serial port; the client takes the other by its number.
            master, slave = pty.openpty()
            stack.callback(os.close, master)
            stack.callback(os.close, slave)
            process = stack.enter_context(server([*command, os.ttyname(slave)]))
            os.set_inheritable(master, True)
            ends[who] = (process, f"fd:{master}")
        for name in ("FC3x10", "FC16x2"):
            pdu, size = REQUESTS[name]
            runs: dict[str, list[Figures | None]] = {who: [] for who in ends}
            for _ in range(rounds):
                for who, (process, path) in ends.items():
                    runs[who].append(run_client(client, process, "tty", path, size + 3, seconds, rtu(pdu).hex()))
            row(f"pty {name}", {who: best(r) for who, r in runs.items()})


def fleet(client: Path, seconds: float, controllers: int) -> None:
    port = free_port()
    with server([sys.executable, str(HERE / "fleet.py"), str(port)]) as process:
        figures = run_client(client, process, "rate", port, controllers, seconds, mbap(REQUESTS["FC3x10"][0]).hex(), 10)
    if figures:
        print(
            f"{controllers} controllers in one process, FC3x10 each at 10 Hz: {figures.per_second:.0f}/s, "
            f"p50 {figures.p50_us / 1000:.2f} ms, p99 {figures.p99_us / 1000:.2f} ms"
        )


def main() -> None:
    measured = SERVERS | modules()
    listed = "\n".join(f"  {name:<8} {text}" for name, text in measured.items())
    parser = argparse.ArgumentParser(
        prog="python -m bench",
        description=__doc__,
        epilog=f"what can be measured:\n{listed}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("what", nargs="*", default=USUAL, metavar="WHAT", help=f"see below (default: {' '.join(USUAL)})")
    parser.add_argument("--seconds", type=float, default=0.25, help="of each measurement")
    parser.add_argument("--rounds", type=int, default=9, help="of each measurement, the median counts")
    parser.add_argument("--controllers", type=int, default=5000)
    options = parser.parse_args()
    unknown = [name for name in options.what if name not in measured]
    if unknown:
        parser.error(f"nothing is called {', '.join(unknown)}: there are {', '.join(measured)}")
    if SERVERS.keys() & set(options.what):
        measure_servers(parser, options)
    for name in options.what:
        if name not in SERVERS:
            importlib.import_module(f"bench.{name}").main()


def measure_servers(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    if not shutil.which("cc") or subprocess.run(["pkg-config", "--exists", "libmodbus"], check=False).returncode:
        parser.error("a C compiler and libmodbus are needed: make peers")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        client = build("client.c", folder)
        flags = subprocess.run(["pkg-config", "--cflags", "--libs", "libmodbus"], capture_output=True, text=True, check=True)
        libmodbus = build("libmodbus_server.c", folder, *flags.stdout.split())
        if {"tcp", "pty"} & set(options.what):
            print("Requests per second, p50 and p99 of the answer's time and processor time per request in us;")
            print("then the ratio of requests per second to each peer's, and (of its processor time to ours).")
            print(
                f"{'':<22} {'steptwin':>31}  {'libmodbus (C, select)':>31}  {'pymodbus (async)':>31}  × libmodbus     × pymodbus"
            )
        if "tcp" in options.what:
            compare_tcp(client, libmodbus, folder, options.seconds, options.rounds)
        if "pty" in options.what:
            compare_tty(client, libmodbus, folder, options.seconds, options.rounds)
        if "fleet" in options.what:
            fleet(client, max(5.0, options.seconds), options.controllers)


if __name__ == "__main__":
    main()
