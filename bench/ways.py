"""A controller of `serve` and the same recorded in a file, interleaved: rate, processor time."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Generator
from pathlib import Path
from statistics import median

from bench.__main__ import BIN, REQUESTS, Figures, build, mbap, on_processor, run_client

ROUNDS = 5
SECONDS = 0.3


@contextlib.contextmanager
def twin(folder: Path, name: str, *command: str) -> Generator[tuple[int, int]]:
    """A twin by a real command; its process id and port."""
    ready = folder / f"{name}.json"
    words = [str(BIN / "steptwin"), *command, "--name", f"bench-{name}-{os.getpid()}", "--ready-file", str(ready)]
    process = subprocess.Popen([*on_processor(-1), *words], stdout=subprocess.DEVNULL, start_new_session=True)
    try:
        deadline = time.monotonic() + 20
        while not ready.exists():
            if process.poll() is not None or time.monotonic() > deadline:
                raise RuntimeError(f"{command} did not start")
            time.sleep(0.02)
        (place,) = (place for place in json.loads(ready.read_text())["end_points"] if place["kind"] == "tcp")
        yield process.pid, place["port"]
    finally:
        process.terminate()
        process.wait(10)


def main() -> None:
    print("Requests per second and processor time in us: serve, with --trace FILE; then rate (processor time) of that.")
    with tempfile.TemporaryDirectory() as place, contextlib.ExitStack() as stack:
        folder = Path(place)
        client = build("client.c", folder)
        serve = ("serve", "mic488", "--tcp", "127.0.0.1:0")
        ways = {
            "serve": stack.enter_context(twin(folder, "serve", *serve)),
            "traced": stack.enter_context(twin(folder, "traced", *serve, "--trace", str(folder / "t.jsonl"))),
        }
        for name, (pdu, _) in REQUESTS.items():
            for connections in (1, 16):
                runs: dict[str, list[Figures]] = {way: [] for way in ways}
                for _ in range(ROUNDS):
                    for way, (process, port) in ways.items():
                        found = run_client(client, process, "tcp", port, connections, SECONDS, mbap(pdu).hex())
                        runs[way] += [] if found is None else [found]
                rate = {way: median(run.per_second for run in found) for way, found in runs.items()}
                cpu = {way: median(run.cpu_us for run in found) for way, found in runs.items()}
                cells = "  ".join(f"{rate[way]:7.0f}/s {cpu[way]:6.1f}" for way in ways)
                ratios = f"{rate['traced'] / rate['serve']:5.2f} ({cpu['serve'] / cpu['traced']:5.2f})"
                print(f"{f'{name} ×{connections}':<12} {cells}  {ratios}")
                sys.stdout.flush()


if __name__ == "__main__":
    main()
