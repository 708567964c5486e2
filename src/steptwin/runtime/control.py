"""The control endpoint of a served twin: what a hand at the machine could do, over a local socket.

One request and one answer, each a line of JSON: ``{"do": NAME, ...}`` → ``{"ok": RESULT}`` or ``{"error": TEXT}``,
with ``"misuse": true`` where the request was wrong. Only the
user who started the twin can open the socket.
"""

from __future__ import annotations

import asyncio
import json
import os
import socket
import stat
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, cast

from steptwin.errors import LineFailure, Misuse, Refusal, SteptwinError
from steptwin.runtime.links import where
from steptwin.runtime.ownership import InUse, Ownership

Handler = Callable[[Mapping[str, Any]], object]

LONGEST_REQUEST = 65536
TIMEOUT_S = 10.0
SUFFIX = ".control"
END_POINTS = "end-points"
"""What every twin is asked for the places where it listens."""
FORM = 'a request is a line of JSON: {"do": NAME, ...}'


def runtime_directory() -> Path:
    """Where sockets and pty links of this user's twins lie."""
    base = os.environ.get("XDG_RUNTIME_DIR")
    return Path(base) / "steptwin" if base else Path(tempfile.gettempdir()) / f"steptwin-{os.getuid()}"


def private_directory(path: Path) -> Path:
    """Make ``path`` for this user alone. Raises `Misuse` where it is something else or belongs to somebody else."""
    path.mkdir(mode=0o700, parents=True, exist_ok=True)
    found = path.lstat()
    if not stat.S_ISDIR(found.st_mode):
        raise Misuse(f"{path} is no directory")
    if found.st_uid != os.getuid():
        raise Misuse(f"{path} belongs to another user")
    if stat.S_IMODE(found.st_mode) & 0o077:
        path.chmod(0o700)
    return path


class ControlEndpoint:
    """Listens for requests and answers them with ``handlers``."""

    def __init__(self, name: str, handlers: Mapping[str, Handler]) -> None:
        self.name = name
        self.path = runtime_directory() / f"{name}{SUFFIX}"
        self._handlers = handlers
        self._owned: Ownership | None = None
        self._server: asyncio.Server | None = None
        self._asking: set[_Conversation] = set()

    async def open(self) -> Path:
        """Listen. Raises `Misuse` when a twin of this name is running already."""
        try:
            private_directory(self.path.parent)
            self._owned = Ownership(self.path.with_suffix(".lock"))
            self.path.unlink(missing_ok=True)
            loop = asyncio.get_running_loop()
            self._server = await loop.create_unix_server(lambda: _Conversation(self._answer, self._asking), str(self.path))
            self.path.chmod(0o600)
        except InUse as taken:
            raise Misuse(f"a twin named {self.name!r} is running already ({taken.owner}): give this one another --name") from None
        except OSError as error:
            await self.close()
            raise LineFailure(f"cannot make the control socket {self.path}: {where(error)}") from error
        return self.path

    def _answer(self, line: bytes) -> dict[str, object]:
        try:
            request = json.loads(line)
        except (ValueError, RecursionError):
            return {"error": FORM}
        wanted = request.get("do") if isinstance(request, dict) else None
        if not isinstance(wanted, str):
            return {"error": FORM}
        handler = self._handlers.get(wanted)
        if handler is None:
            return {"error": f"this twin cannot do {wanted!r}: it can {', '.join(self._handlers)}", "misuse": True}
        try:
            return {"ok": handler(request)}
        except Misuse as error:
            return {"error": str(error), "misuse": True}
        except SteptwinError as error:
            return {"error": str(error)}

    async def close(self) -> None:
        if self._server is not None:
            self._server.close()
            for conversation in list(self._asking):
                conversation.abort()
            await self._server.wait_closed()
            self._server = None
            self.path.unlink(missing_ok=True)
        if self._owned is not None:
            self._owned.release()
            self._owned = None


class _Conversation(asyncio.Protocol):
    """One request and its answer."""

    def __init__(self, answer: Callable[[bytes], dict[str, object]], asking: set[_Conversation]) -> None:
        self._answer = answer
        self._asking = asking
        self._request = b""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.Transport, transport)
        self._asking.add(self)

    def connection_lost(self, exc: Exception | None) -> None:
        self._asking.discard(self)

    def data_received(self, data: bytes) -> None:
        self._request += data
        line, newline, _ = self._request.partition(b"\n")
        if newline:
            answer = self._answer(line)
        elif len(self._request) > LONGEST_REQUEST:
            answer = {"error": f"a request has at most {LONGEST_REQUEST} bytes"}
        else:
            return
        self._request = b""
        self._transport.pause_reading()
        self._transport.write(json.dumps(answer).encode() + b"\n")
        self._transport.close()

    def abort(self) -> None:
        self._transport.abort()


def _answers(path: Path) -> bool:
    with socket.socket(socket.AF_UNIX) as client:
        client.settimeout(TIMEOUT_S)
        try:
            client.connect(str(path))
        except OSError:
            return False
    return True


def running() -> list[str]:
    """Names of the twins of this user that answer."""
    directory = runtime_directory()
    return sorted(path.stem for path in directory.glob(f"*{SUFFIX}") if _answers(path)) if directory.is_dir() else []


def ask(name: str | None, request: Mapping[str, object]) -> Any:
    """Ask the twin ``name`` (default: the only one running). Raises `LineFailure`, `Misuse` or `Refusal`."""
    names = running()
    if name is None:
        if not names:
            raise LineFailure("no twin is running: start one with 'steptwin serve' or 'steptwin up'")
        if len(names) > 1:
            raise Misuse(f"several twins are running: choose one with --twin: {', '.join(names)}")
        name = names[0]
    elif name not in names:
        raise LineFailure(f"no twin named {name!r} is running; running: {', '.join(names) or 'none'}")
    with socket.socket(socket.AF_UNIX) as client:
        client.settimeout(TIMEOUT_S)
        try:
            client.connect(str(runtime_directory() / f"{name}{SUFFIX}"))
            client.sendall(json.dumps(request).encode() + b"\n")
            with client.makefile("rb") as stream:
                answer = json.loads(stream.readline())
        except (OSError, ValueError) as error:
            raise LineFailure(f"the twin {name!r} does not answer: {error}") from error
    if "error" in answer:
        raise (Misuse if answer.get("misuse") else Refusal)(answer["error"])
    return answer["ok"]
