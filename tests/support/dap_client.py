"""A small client of the Debug Adapter Protocol, independent of the adapter's own code: messages over the pipes of a process."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from contextlib import suppress
from queue import Queue
from threading import Thread
from typing import Any

from tests.conftest import STEPTWIN

LONG_S = 100.0
"""Bound of a wait for what comes soon."""


class Refused(Exception):
    """A request was not successful."""


class DapClient:
    def __init__(self) -> None:
        self.process = subprocess.Popen(
            [STEPTWIN, "dap"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
        )
        self.events: list[dict[str, Any]] = []
        self._waiting: Queue[dict[str, Any] | None] = Queue()
        self._seq = 0
        self._reader = Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        stream = self.process.stdout
        assert stream is not None
        while header := stream.readline():
            name, _, length = header.decode("ascii").partition(": ")
            assert name == "Content-Length", header
            assert stream.readline() == b"\r\n"
            self._waiting.put(json.loads(stream.read(int(length))))
        self._waiting.put(None)

    def send(self, command: str, **arguments: object) -> int:
        self._seq += 1
        data = json.dumps({"seq": self._seq, "type": "request", "command": command, "arguments": arguments}).encode()
        stream = self.process.stdin
        assert stream is not None
        stream.write(b"Content-Length: %d\r\n\r\n" % len(data) + data)
        stream.flush()
        return self._seq

    def ask(self, command: str, **arguments: object) -> Any:
        """The body of the response. Raises `Refused`."""
        number = self.send(command, **arguments)
        while True:
            message = self._next()
            if message["type"] == "response" and message["request_seq"] == number:
                if not message["success"]:
                    raise Refused(message["message"])
                return message["body"]
            self.events.append(message)

    def event(self, name: str, accept: Callable[[dict[str, Any]], bool] = lambda body: True) -> dict[str, Any]:
        """The body of the next event of that name; others before it are dropped."""
        while True:
            message = self.events.pop(0) if self.events else self._next()
            if message.get("event") == name and accept(message["body"]):
                return message["body"]

    def _next(self) -> dict[str, Any]:
        message = self._waiting.get(timeout=LONG_S)
        assert message is not None, "the adapter has ended"
        return message

    def launch(self, **arguments: object) -> None:
        self.ask("initialize", adapterID="steptwin", linesStartAt1=True, columnsStartAt1=True)
        self.ask("launch", **arguments)
        self.event("initialized")

    def close(self) -> int:
        with suppress(BrokenPipeError):  # an adapter that was detached has ended
            self.send("disconnect")
        return self.end()

    def end(self) -> int:
        """As an editor that ends without a word; the exit code."""
        assert self.process.stdin is not None
        with suppress(BrokenPipeError):
            self.process.stdin.close()
        code = self.process.wait(LONG_S)
        self._reader.join(LONG_S)
        assert self.process.stdout is not None
        self.process.stdout.close()
        return code
