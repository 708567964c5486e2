"""The control endpoint of a running twin: what an operator does to pins, power and time, over a local socket.

One request and one answer, each a line of JSON: ``{"do": NAME, ...}`` → ``{"ok": RESULT}`` or ``{"error": TEXT}``, with
``"misuse": true`` where the request was wrong. Every request has exactly one answer, whatever it is; one that is not complete in
time is answered with an error. Only the user who started the twin can open the socket, and clients believe no other.
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
from steptwin.files.ownership import InUse, Ownership
from steptwin.live.links import where
from steptwin.mic488.registers import AXES

Handler = Callable[[Mapping[str, Any]], object]

LONGEST_REQUEST = 65536
LONGEST_TEXT = 4096
"""Of a text in a request, in characters; the longest that are meant are paths."""
LARGEST_NUMBER = 1 << 63
TIMEOUT_S = 10.0
"""For a request to be complete, and for its answer to be fetched."""
SUFFIX = ".control"
END_POINTS = "end-points"
"""What every twin is asked for the places where it listens."""
FORM = 'a request is a line of JSON: {"do": NAME, ...}'


def runtime_directory() -> Path:
    """Where sockets and pty links of this user's twins lie."""
    base = os.environ.get("XDG_RUNTIME_DIR")
    return Path(base) / "steptwin" if base else Path(tempfile.gettempdir()) / f"steptwin-{os.getuid()}"


def private_directory(path: Path) -> Path:
    """Make ``path`` for this user alone. Raises `Misuse` where it is something else or belongs to another user."""
    path.mkdir(mode=0o700, parents=True, exist_ok=True)
    if _permissions(path) & 0o077:
        path.chmod(0o700)
    return path


def _permissions(path: Path) -> int:
    """The permission bits of a directory. Raises `Misuse` for what is no directory, or of another user."""
    found = path.lstat()
    if not stat.S_ISDIR(found.st_mode):
        raise Misuse(f"{path} is no directory")
    if found.st_uid != os.getuid():
        raise Misuse(f"{path} belongs to another user")
    return stat.S_IMODE(found.st_mode)


# ---------------------------------------------------------------------- requests


def read_request(line: bytes) -> dict[str, Any]:
    """A request that handlers can rely on: plain texts of bounded length, finite numbers below 2⁶³. Raises `Misuse`."""
    try:
        request = json.loads(line)
    except (ValueError, RecursionError):
        raise Misuse(FORM) from None
    if not isinstance(request, dict) or not isinstance(request.get("do"), str):
        raise Misuse(FORM)
    _check_values(request)
    return request


def _check_values(value: object) -> None:
    if isinstance(value, dict):
        for name, item in value.items():
            _check_values(name)
            _check_values(item)
    elif isinstance(value, list):
        for item in value:
            _check_values(item)
    elif isinstance(value, str):
        if len(value) > LONGEST_TEXT:
            raise Misuse(f"a text of {len(value)} characters: permitted are at most {LONGEST_TEXT}")
        if any(c == "\0" or "\ud800" <= c <= "\udfff" for c in value):
            raise Misuse(f"{value[:40]!r}: a text takes neither NUL nor surrogates")
    elif isinstance(value, int | float) and not abs(value) < LARGEST_NUMBER:
        raise Misuse("a number is not finite, or not below 2^63")


def changes(request: Mapping[str, Any]) -> dict[str, Any]:
    """``set`` of a request: names and values. Raises `Misuse`."""
    found = request.get("set") or {}
    if not isinstance(found, dict):
        raise Misuse(f'"set" = {found!r}: expected {{NAME: VALUE, ...}}')
    return found


def texts(request: Mapping[str, Any], key: str) -> list[str]:
    """A list of texts in a request. Raises `Misuse`."""
    found = request.get(key) or []
    if not isinstance(found, list) or not all(isinstance(text, str) for text in found):
        raise Misuse(f'"{key}" = {found!r}: expected a list of texts')
    return found


def number(name: str, value: object) -> float:
    """The value that a pin or button is to take. Raises `Misuse` for what is no number."""
    if not isinstance(value, int | float):
        raise Misuse(f"{name} = {value!r}: a pin takes a number")
    return float(value)


def axis_number(text: str) -> int:
    """The number of an axis of a MIC488 in a request. Raises `Misuse`."""
    if not (text.isascii() and text.isdigit() and len(text) < 10 and 1 <= int(text) <= AXES):
        raise Misuse(f"no axis {text!r}: axes are numbered 1 to {AXES}")
    return int(text)


# ---------------------------------------------------------------------- serving


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
        """The answer to a request. Any exception is one, too: a client that waits is never left without."""
        try:
            request = read_request(line)
            wanted = request["do"]
            handler = self._handlers.get(wanted)
            if handler is None:
                raise Misuse(f"this twin cannot do {wanted!r}: it can {', '.join(self._handlers)}")
            return {"ok": handler(request)}
        except Misuse as error:
            return {"error": str(error), "misuse": True}
        except SteptwinError as error:
            return {"error": str(error)}
        except Exception as error:  # noqa: BLE001  told to both sides
            asyncio.get_running_loop().call_exception_handler({"message": "a control request failed", "exception": error})
            return {"error": f"internal error, please report it: {type(error).__name__}: {error}"}

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
        self._is_answered = False

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.Transport, transport)
        self._asking.add(self)
        self._wait()

    def _wait(self) -> None:
        self._timer = asyncio.get_running_loop().call_later(TIMEOUT_S, self._late)

    def _late(self) -> None:
        if self._is_answered:
            self.abort()
        else:
            self._reply({"error": f"no complete request within {TIMEOUT_S:g} s: {FORM}", "misuse": True})

    def connection_lost(self, exc: Exception | None) -> None:
        self._timer.cancel()
        self._asking.discard(self)

    def data_received(self, data: bytes) -> None:
        if self._is_answered:
            return
        self._request += data
        line, newline, _ = self._request.partition(b"\n")
        if newline:
            self._reply(self._answer(line))
        elif len(self._request) > LONGEST_REQUEST:
            self._reply({"error": f"a request has at most {LONGEST_REQUEST} bytes", "misuse": True})

    def eof_received(self) -> None:
        if self._request and not self._is_answered:
            self._reply({"error": f"the request has no end of line: {FORM}", "misuse": True})

    def _reply(self, answer: dict[str, object]) -> None:
        self._is_answered = True
        self._request = b""
        self._timer.cancel()
        self._wait()
        self._transport.pause_reading()
        self._transport.write(json.dumps(answer).encode() + b"\n")
        self._transport.close()

    def abort(self) -> None:
        self._timer.cancel()
        self._transport.abort()


# ---------------------------------------------------------------------- asking


def _answers(path: Path) -> bool:
    with socket.socket(socket.AF_UNIX) as client:
        client.settimeout(TIMEOUT_S)
        try:
            client.connect(str(path))
        except OSError:
            return False
    return True


def running() -> list[str]:
    """Names of the twins of this user that answer. Raises `Misuse` where others could have put up their own."""
    directory = runtime_directory()
    try:
        if _permissions(directory) & 0o022:
            raise Misuse(f"{directory} can be written by other users, so a twin in it may be theirs: chmod 700 it")
    except FileNotFoundError:
        return []
    return sorted(path.stem for path in directory.glob(f"*{SUFFIX}") if _answers(path))


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
