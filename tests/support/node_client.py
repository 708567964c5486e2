"""Clients of other makers, which run in node and take requests as lines of JSON."""

from __future__ import annotations

import json
import queue
import subprocess
import threading
from pathlib import Path
from typing import Any, Self

CLIENTS = Path(__file__).resolve().parent.parent / "gateways/clients"
LONGEST_S = 60.0


class NodeClient:
    """The client in ``CLIENTS / module``, until the end of the block."""

    def __init__(self, node: str, module: str, folder: Path) -> None:
        self._process = subprocess.Popen(
            [node, str(CLIENTS / module)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            cwd=folder,
            encoding="utf-8",
        )
        self._answers: queue.Queue[str] = queue.Queue()
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if line.startswith("@"):
                self._answers.put(line[1:])
        self._answers.put('{"error": "the client has ended"}')

    def __call__(self, do: str, **given: Any) -> Any:
        """What it answers. Raises `RuntimeError` with its error."""
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps({"do": do, **given}) + "\n")
        self._process.stdin.flush()
        answer = json.loads(self._answers.get(timeout=LONGEST_S))
        if "error" in answer:
            raise RuntimeError(answer["error"])
        return answer["ok"]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._process.poll() is None:
            self._process.kill()
        self._thread.join(LONGEST_S)
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                stream.close()
        self._process.wait()
