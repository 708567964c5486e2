"""Changes of many controllers behind OPC UA and MQTT at once: what a change takes, and how late independent clients see it.

First what a change takes of a processor: without a gateway, with each of them, with both. Changes come then in batches with
pauses, in which all is done, so that this means something on a busy computer. Then how late clients see changes that come
evenly, with the gateways ``GATEWAYS`` (``opcua,mqtt``). ``CONTROLLERS``, ``RATE`` (changes of each in a second; 0: only the
first part) and ``SECONDS`` in the environment make it another one. The process with world and gateways has one processor, the
clients and the broker another one.

A change is a level at an analog input, which is the time at which it was set: client and server have the same clock.
"""

from __future__ import annotations

import asyncio
import contextlib
import gc
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Generator
from pathlib import Path

from steptwin import World
from steptwin.live.options import LiveOptions, UpOptions
from steptwin.live.running import Running, up_with
from steptwin.simulation.script.steps import Set

HERE = Path(__file__).parent
CLIENTS = HERE.parent / "tests/gateways/clients"
PROCESSORS = sorted(os.sched_getaffinity(0))
PIN = "AIN1"
ROUND_MS = 10_000
"""Levels begin anew: 0 to 10 V."""
TICK_S = 0.01
SETTLE_S = 5.0
CLIENT_ENDED = "the client of OPC UA has ended: make tests/gateways/clients/node_modules/.steptwin installs it"
BATCH, BATCHES, PAUSE_S = 100, 50, 0.1
"""One change of each of 100 controllers."""


def size(name: str, usual: int) -> int:
    return int(os.environ.get(name, usual))


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        return int(listening.getsockname()[1])


# ---------------------------------------------------------------------- the server


def serve(controllers: int, rate: int, seconds: int, file: Path) -> None:
    """A world whose controllers change by themselves from SIGUSR1 on; prints what that took."""

    async def change(running: Running) -> None:
        begin = asyncio.Event()
        asyncio.get_running_loop().add_signal_handler(signal.SIGUSR1, begin.set)
        driven = drive(running, controllers, rate, seconds, begin) if rate else drive_batches(running, controllers, begin)
        tasks.append(asyncio.create_task(driven))

    tasks: list[asyncio.Task[None]] = []
    options = UpOptions(world=file, live=LiveOptions(trace="off"), ready_file=file.with_name("ready.json"))
    up_with(World.from_toml(file.read_text()), options, change)


async def drive_batches(running: Running, controllers: int, begin: asyncio.Event) -> None:
    """What the process takes without changes in the same time does not count."""
    await begin.wait()
    gc.collect()
    gc.freeze()
    taken: list[float] = []
    for count in (0, BATCH):
        cpu, began, done = time.process_time(), time.monotonic(), 0
        for number in range(BATCHES):
            volts = (time.time_ns() // 1_000_000 % ROUND_MS) / 1000
            if count:
                running.control.do(Set(tuple((f"t{(number * count + one) % controllers}", PIN, volts) for one in range(count))))
            done += count
            await asyncio.sleep(PAUSE_S)
        wall = time.monotonic() - began
        taken.append((time.process_time() - cpu) / wall)
    print(json.dumps({"changes": done, "cpu_s": (taken[1] - taken[0]) * wall, "wall_s": wall}), flush=True)


async def drive(running: Running, controllers: int, rate: int, seconds: int, begin: asyncio.Event) -> None:
    await begin.wait()
    gc.collect()
    gc.freeze()
    done = 0
    cpu, began = time.process_time(), time.monotonic()
    while (now := time.monotonic() - began) < seconds:
        due = min(int(now * rate * controllers) - done, controllers)
        volts = (time.time_ns() // 1_000_000 % ROUND_MS) / 1000
        if due:
            running.control.do(Set(tuple((f"t{(done + one) % controllers}", PIN, volts) for one in range(due))))
        done += due
        await asyncio.sleep(TICK_S)
    cpu, wall = time.process_time() - cpu, time.monotonic() - began
    print(json.dumps({"changes": done, "cpu_s": cpu, "wall_s": wall}), flush=True)


# ---------------------------------------------------------------------- clients


@contextlib.contextmanager
def broker(folder: Path) -> Generator[int]:
    port = free_port()
    (folder / "mosquitto.conf").write_text(f"listener {port} 127.0.0.1\nallow_anonymous true\nmax_queued_messages 0\n")
    with subprocess.Popen(["mosquitto", "-c", str(folder / "mosquitto.conf")], stderr=subprocess.DEVNULL) as process:
        time.sleep(0.5)
        try:
            yield port
        finally:
            process.terminate()


def late_ms(seen_ms: float, volts: float) -> float:
    return (seen_ms - round(volts * 1000)) % ROUND_MS


def latencies_of_mqtt(file: Path) -> list[float]:
    found: list[float] = []
    for line in file.read_text(errors="replace").splitlines():
        match = re.match(rf'(\d+\.\d+) .*"{PIN}":([0-9.]+)', line)
        if match and float(match[2]):  # before the first change it is 0
            found.append(late_ms(float(match[1]) * 1000, float(match[2])))
    return found


def told(title: str, late: list[float], seconds: float) -> None:
    late = sorted(late)
    if not late:
        print(f"  {title}: nothing was seen")
        return
    p50, p99 = late[len(late) // 2], late[int(len(late) * 0.99)]
    print(f"  {title}: {len(late) / seconds:.0f} changes/s seen, p50 {p50:.0f} ms, p99 {p99:.0f} ms")


def wait_for(file: Path, maker: subprocess.Popen[bytes], ended: Callable[[], str]) -> None:
    """Until there is a file; raises `SystemExit` if the process that makes it has ended."""
    while not file.exists():
        if maker.poll() is not None:
            raise SystemExit(ended())
        time.sleep(0.1)


def measure(gateways: list[str], controllers: int, rate: int, seconds: int) -> None:
    with tempfile.TemporaryDirectory() as name, contextlib.ExitStack() as stack:
        folder = Path(name)
        os.sched_setaffinity(0, {PROCESSORS[0]})
        text = '[world]\nname = "hall"\n' + "".join(f'[[mic488]]\nname = "t{number}"\n' for number in range(controllers))
        if "opcua" in gateways:
            text += '[gateway.opcua]\nlisten = "127.0.0.1:0"\ninterval = 0.05\n'
        port = 0
        if "mqtt" in gateways:
            port = stack.enter_context(broker(folder))
            text += f'[gateway.mqtt]\nbroker = "127.0.0.1:{port}"\ninterval = 0.05\n'
        (folder / "hall.toml").write_text(text)
        environment = {**os.environ, "XDG_RUNTIME_DIR": name, "NODE_PATH": str(CLIENTS / "node_modules")}
        command = [sys.executable, "-m", "bench.changes", str(controllers), str(rate), str(seconds), str(folder / "hall.toml")]
        with (folder / "errors").open("wb") as errors:
            server = stack.enter_context(
                subprocess.Popen(command, cwd=HERE.parent, env=environment, stdout=subprocess.PIPE, stderr=errors)
            )
        stack.callback(server.terminate)
        os.sched_setaffinity(server.pid, {PROCESSORS[-1]})
        wait_for(folder / "ready.json", server, (folder / "errors").read_text)
        ready = json.loads((folder / "ready.json").read_text())
        clients: list[subprocess.Popen[bytes]] = []
        for point in ready["end_points"]:
            if point["kind"] == "opcua":
                script = ["node", str(HERE / "opcua_changes.js"), point["url"], str(controllers), PIN, str(folder / "opcua")]
                clients.append(subprocess.Popen(script, env=environment, stderr=subprocess.DEVNULL))
        if "mqtt" in gateways:
            out = stack.enter_context((folder / "mqtt").open("wb"))
            listen = ["mosquitto_sub", "-p", str(port), "-t", "steptwin/hall/+/pins", "-F", "%U %p"]
            clients.append(subprocess.Popen(listen, stdout=out))
        for one in clients:
            stack.callback(one.terminate)
        if "opcua" in gateways:
            wait_for(folder / "opcua.ready", clients[0], lambda: CLIENT_ENDED)
        time.sleep(SETTLE_S)
        server.send_signal(signal.SIGUSR1)
        if server.stdout is None:
            raise AssertionError
        found = next(json.loads(line) for line in server.stdout if line.startswith(b'{"changes"'))
        time.sleep(1)
        for one in clients:
            one.terminate()
            one.wait()
        per = found["cpu_s"] / found["changes"] * 1e6
        title = f"{controllers} MIC488, {' and '.join(gateways) or 'no gateway'}"
        if not rate:
            print(f"{title}: {per:.0f} us of processor time for a change")
            return
        used = 100 * found["cpu_s"] / found["wall_s"]
        print(f"{title}: {found['changes'] / found['wall_s']:.0f} changes/s, {used:.0f} % of a processor")
        if "opcua" in gateways:
            rows = [tuple(map(float, line.split())) for line in (folder / "opcua").read_text().splitlines()]
            told("OPC UA (node-opcua)", [late_ms(at, volts) for at, volts in rows if volts], found["wall_s"])
        if "mqtt" in gateways:
            told("MQTT (mosquitto_sub)", latencies_of_mqtt(folder / "mqtt"), found["wall_s"])


def main() -> None:
    if shutil.which("node") is None or shutil.which("mosquitto") is None:
        raise SystemExit("node and mosquitto are needed")
    controllers, rate = size("CONTROLLERS", 100), size("RATE", 10)
    for some in ([], ["opcua"], ["mqtt"], ["opcua", "mqtt"]):
        measure(some, controllers, 0, 0)
    if rate:
        measure(os.environ.get("GATEWAYS", "opcua,mqtt").split(","), controllers, rate, size("SECONDS", 20))


if __name__ == "__main__":
    serve(int(sys.argv[1]), int(float(sys.argv[2])), int(sys.argv[3]), Path(sys.argv[4]))
