"""A broker of its own for a test: mosquitto on a free port, which can be killed and come back, and its clients."""

from __future__ import annotations

import getpass
import json
import queue
import socket
import subprocess
import threading
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, Self

from tests.conftest import until

LONGEST_S = 20.0
BASE = "steptwin/plant"
"""Of the topics of a world called plant."""


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        return int(listening.getsockname()[1])


class Mosquitto:
    """Runs from `start` until `kill` or the end of the block. ``options`` are lines of its configuration."""

    def __init__(self, require_peer: Callable[[str], str], folder: Path, *options: str) -> None:
        self._program = require_peer("mosquitto")
        self._publish = require_peer("mosquitto_pub")
        self._subscribe = require_peer("mosquitto_sub")
        self.port = free_port()
        self._folder = folder
        self._configuration = folder / "mosquitto.conf"
        # As root it would become a user that reads no files of tests.
        lines = [
            f"user {getpass.getuser()}",
            f"listener {self.port} 127.0.0.1",
            "log_type all",
            *(options or ("allow_anonymous true",)),
        ]
        self._configuration.write_text("\n".join(lines) + "\n")
        self._process: subprocess.Popen[bytes] | None = None
        self.client_options: Sequence[str] = ()
        """Options that its clients need: users, certificates."""

    def start(self) -> None:
        with (self._folder / "mosquitto.log").open("ab") as log:
            self._process = process = subprocess.Popen(
                [self._program, "-c", str(self._configuration)], cwd=self._folder, stdout=subprocess.DEVNULL, stderr=log
            )

        def listens() -> bool:
            assert process.poll() is None, (self._folder / "mosquitto.log").read_text()
            with socket.socket() as there:
                return there.connect_ex(("127.0.0.1", self.port)) == 0

        until(listens, "mosquitto listens")

    def kill(self) -> None:
        """At once: it says good-bye to nobody, and forgets what it retained."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process = None

    @property
    def process(self) -> subprocess.Popen[bytes]:
        assert self._process is not None
        return self._process

    def _where(self) -> list[str]:
        return ["-h", "127.0.0.1", "-p", str(self.port), "-V", "mqttv5", *self.client_options]

    def is_subscribed(self, topic: str) -> bool:
        """Whether somebody has subscribed to exactly this since it was first started."""
        return f"{topic} (QoS 1)" in (self._folder / "mosquitto.log").read_text()

    def publish(self, topic: str, message: Any, *options: str) -> None:
        """JSON, unless it is a text."""
        text = message if isinstance(message, str) else json.dumps(message)
        subprocess.run(
            [self._publish, *self._where(), "-q", "1", "-t", topic, "-m", text, *options], check=True, timeout=LONGEST_S
        )

    def publish_lines(self, topic: str, messages: Iterable[Any]) -> None:
        """One after the other, without waiting for anything between."""
        text = "".join(f"{json.dumps(message)}\n" for message in messages)
        command = [self._publish, *self._where(), "-q", "0", "-t", topic, "-l"]
        subprocess.run(command, input=text, check=True, timeout=LONGEST_S, encoding="utf-8")

    def subscribe(self, *topics: str) -> Subscription:
        return Subscription([self._subscribe, *self._where(), "-q", "1"], topics)

    def retained(self, topic: str) -> Any:
        """What is retained there, as JSON; None where nothing is."""
        ended = subprocess.run(
            [self._subscribe, *self._where(), "-t", topic, "-C", "1", "-W", "1", "--retained-only", "-F", "%p"],
            capture_output=True,
            text=True,
            check=False,
            timeout=LONGEST_S,
        )
        return json.loads(ended.stdout) if ended.stdout.strip() else None

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.kill()


class Subscription:
    """What mosquitto_sub prints, line by line, until the end of the block."""

    def __init__(self, command: Sequence[str], topics: Sequence[str]) -> None:
        chosen = [word for topic in topics for word in ("-t", topic)]
        # It tells that it has subscribed without flushing.
        self._process = subprocess.Popen(
            ["stdbuf", "-oL", *command, *chosen, "-d", "-F", '{"topic":"%t","retain":%r,"correlation":"%D","payload":%p}'],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            encoding="utf-8",
        )
        self._lines: queue.Queue[str] = queue.Queue()
        self.seen: list[dict[str, Any]] = []
        self._is_there = threading.Event()
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()
        assert self._is_there.wait(LONGEST_S), "it has subscribed"

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if line.startswith('{"topic"'):
                self._lines.put(line)
            elif line.startswith("Subscribed"):
                self._is_there.set()

    def look(self) -> list[dict[str, Any]]:
        """All messages until now."""
        while not self._lines.empty():
            self.seen.append(json.loads(self._lines.get()))
        return self.seen

    def wait_for(self, fits: Callable[[dict[str, Any]], object], what: str) -> dict[str, Any]:
        """The first message that fits."""
        until(lambda: any(fits(one) for one in self.look()), what)
        return next(one for one in self.seen if fits(one))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.terminate()
        self._process.communicate(timeout=LONGEST_S)
        self._thread.join(LONGEST_S)


class Requests:
    """Commands of one client, and what it is answered."""

    def __init__(self, broker: Mosquitto, answers: Subscription, base: str = BASE) -> None:
        self._broker = broker
        self._answers = answers
        self._base = base
        self._number = 0

    def __call__(self, do: str, *options: str, **fields: Any) -> Any:
        self._number += 1
        name = f"r{self._number}"
        where = ["-D", "publish", "response-topic", "me/answers", "-D", "publish", "correlation-data", name]
        self._broker.publish(f"{self._base}/do", {"do": do, **fields}, *where, *options)
        found = self._answers.wait_for(lambda one: one["correlation"] == name, f"{do} is answered")
        return found["payload"]
