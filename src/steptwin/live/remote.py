"""A world in another process as a subject: the client of its control endpoint; and the search for running twins."""

from __future__ import annotations

import contextlib
import json
import select
import socket
from collections.abc import Iterator, Mapping
from itertools import count
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from steptwin.errors import LineFailure, Misuse
from steptwin.inputfiles import read_bytes
from steptwin.live.control import ANNOUNCEMENT, HAS_LOCAL_SOCKETS, SOCKET, TIMEOUT_S
from steptwin.live.directory import permissions, runtime_directory
from steptwin.subject import commands as command
from steptwin.subject.commands import command_to_json
from steptwin.subject.contract import Description, Reading, Result, read_description
from steptwin.subject.dispatch import raised
from steptwin.subject.events import Event, read_event
from steptwin.subject.subscriptions import EventBatch, Filter, Subscription
from steptwin.subject.time import MOST_SHOWN
from steptwin.system import reason

LONGEST_ANSWER = 64 << 20
"""Bytes of a line from a twin; the description of a thousand controllers has a few million."""
_PIECE = 1 << 16
START = "start one with 'steptwin serve mic488 --demo', 'steptwin serve m1486' or 'steptwin up MACHINE.toml'"


# ---------------------------------------------------------------------- finding


def running() -> list[str]:
    """Names of the running twins of this user. Raises `Misuse` if other users can write to the runtime directory."""
    directory = runtime_directory()
    try:
        if permissions(directory) & 0o022:
            raise Misuse(f"{directory} can be written by other users, so a twin in it may be theirs: chmod 700 it")
    except FileNotFoundError:
        return []
    names = {path.stem for suffix in (SOCKET, ANNOUNCEMENT) for path in directory.glob(f"*{suffix}")}
    return sorted(name for name in names if _answers(name))


def _answers(name: str) -> bool:
    try:
        _connected(name, TIMEOUT_S).close()
    except (OSError, ValueError, LookupError, Misuse):
        return False
    return True


def _connected(name: str, timeout_s: float) -> socket.socket:
    """An authenticated connection to the twin ``name``. Raises `OSError`, `ValueError`, `LookupError`."""
    directory = runtime_directory()
    local = directory / f"{name}{SOCKET}"
    if HAS_LOCAL_SOCKETS and local.exists():
        client = socket.socket(socket.AF_UNIX)
        client.settimeout(timeout_s)
        try:
            client.connect(str(local))
        except OSError:
            client.close()
            raise
        return client
    return _connected_by_tcp(directory / f"{name}{ANNOUNCEMENT}", timeout_s)


def _connected_by_tcp(announcement: Path, timeout_s: float) -> socket.socket:
    said = json.loads(read_bytes(announcement))
    client = socket.create_connection((said["host"], said["port"]), timeout_s)
    try:
        client.sendall(json.dumps({"token": said["token"]}).encode() + b"\n")
        if not client.recv(_PIECE).startswith(b'{"ok"'):  # the token of a twin that is gone, or another program
            raise ConnectionRefusedError(f"{announcement.stem} does not take its token")
    except BaseException:
        client.close()
        raise
    return client


def choose(name: str | None) -> str:
    """The running twin ``name``; None: the only one. Raises `LineFailure` without any, `Misuse` if there are several."""
    names = running()
    if name is None:
        if not names:
            raise LineFailure(f"no twin is running: {START}")
        if len(names) > 1:
            raise Misuse(f"several twins are running: name one: {', '.join(names)}")
        return names[0]
    if name not in names:
        raise LineFailure(f"no twin named {name!r} is running; running: {', '.join(names) or 'none'}")
    return name


# ---------------------------------------------------------------------- the subject


class RemoteSubject:
    """The twin ``name`` that runs in another process; None: the only one that runs.

    Raises `LineFailure` if it does not answer within ``timeout_s``; `Misuse` and `Refusal` as the twin itself.
    """

    def __init__(self, name: str | None = None, *, timeout_s: float = TIMEOUT_S) -> None:
        self.name = choose(name)
        self._timeout_s = timeout_s
        self._received = b""
        self._ids = count(1)
        self._subscriptions: dict[object, _RemoteSubscription] = {}
        self._description: Description | None = None
        try:
            self._socket = _connected(self.name, timeout_s)
        except (OSError, ValueError, LookupError) as error:
            raise self._silent(error) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        self._socket.close()

    @property
    def description(self) -> Description:
        if self._description is None:
            self._description = read_description(self.do(command.Describe()).value)
        return self._description

    def read(self, *points: str) -> tuple[Reading, ...]:
        return tuple(Reading(**reading) for reading in self.do(command.ReadPoints(points)).value)

    def do(self, wanted: command.Command) -> Result:
        if not isinstance(wanted, command.Advance):
            return self._ask(wanted, next(self._ids))
        parts = list(self.advance(wanted))
        events = [event for part in parts for event in part.value["events"]]
        missed = sum(part.value["missed"] for part in parts) + max(0, len(events) - MOST_SHOWN)
        return parts[-1]._replace(value={**parts[-1].value, "events": events[-MOST_SHOWN:], "missed": missed})

    def advance(self, wanted: command.Advance) -> Iterator[Result]:
        """A step in parts, each with its own events. A twin serves others between them, so it answers after a tenth of a second
        and gives the moment to which the step has to go on."""
        while True:
            part = self._ask(wanted, next(self._ids))
            yield part
            if "to_ns" not in part.value:
                return
            wanted = command.Advance(to=int(part.value["to_ns"]), until=wanted.until)

    def subscribe(self, what: Filter, bound: int) -> Subscription:
        subscription, _ = self.subscribe_from_now(what, bound)
        return subscription

    def subscribe_from_now(self, what: Filter, bound: int) -> tuple[Subscription, list[Event]]:
        """As `subscribe`, with the present plans of the axes that ``what`` wants."""
        identity = next(self._ids)
        subscription = self._subscriptions[identity] = _RemoteSubscription(self, identity, what, bound)
        wanted = command.Subscribe(
            tuple(sorted(what.kinds)),
            None if what.controllers is None else tuple(sorted(what.controllers)),
            None if what.axes is None else tuple(sorted(what.axes)),
            bound,
        )
        try:
            answer = self._ask(wanted, identity)
        except BaseException:
            del self._subscriptions[identity]
            raise
        return subscription, [read_event(plan) for plan in answer.value["plans"]]

    def unsubscribe(self, identity: int) -> None:
        if self._subscriptions.pop(identity, None) is not None:
            self.do(command.Unsubscribe(identity))

    # ------------------------------------------------------------------ messages

    def _ask(self, wanted: command.Command, identity: int) -> Result:
        self._send({**command_to_json(wanted), "id": identity})
        for message in self._messages(self._timeout_s):
            if message.get("id") == identity and "event" not in message:
                return _result(message)
            if "id" not in message and "error" in message:
                if not isinstance(message["error"], Mapping):
                    raise self._silent(f"{message['error']!r} is not a response of this version of steptwin")
                raise raised(message["error"])
            self._take_event(message)
        raise self._silent("timed out")

    def _send(self, message: Mapping[str, object]) -> None:
        try:
            self._socket.settimeout(self._timeout_s)
            self._socket.sendall(json.dumps(message).encode() + b"\n")
        except OSError as error:
            raise self._silent(error) from error

    def pump(self, timeout_s: float = 0.0) -> None:
        """Take the received events; wait if there are none."""
        for message in self._messages(timeout_s):
            self._take_event(message)
            if not self._has_more():
                break

    def _has_more(self) -> bool:
        return b"\n" in self._received or bool(select.select([self._socket], [], [], 0)[0])

    def _messages(self, timeout_s: float) -> Iterator[dict[str, Any]]:
        """Messages as they arrive; ends after ``timeout_s`` without one. Raises `LineFailure`."""
        while True:
            while b"\n" not in self._received:
                if len(self._received) > LONGEST_ANSWER:
                    raise self._silent(f"a message of more than {LONGEST_ANSWER} bytes")
                try:
                    if not select.select([self._socket], [], [], timeout_s)[0]:
                        return
                    piece = self._socket.recv(_PIECE)
                except OSError as error:
                    raise self._silent(error) from error
                if not piece:
                    raise self._silent("it has closed the connection")
                self._received += piece
            line, _, self._received = self._received.partition(b"\n")
            try:
                message = json.loads(line)
            except (ValueError, RecursionError) as error:
                raise self._silent(error) from error
            yield message

    def _take_event(self, message: Mapping[str, Any]) -> None:
        subscription = self._subscriptions.get(message.get("id"))
        if subscription is not None and "event" in message:
            subscription.miss(message.get("missed", 0))
            subscription.add(read_event(message["event"]))

    def _silent(self, why: object) -> LineFailure:
        text = reason(why) if isinstance(why, OSError) else why
        return LineFailure(f"the twin {self.name!r} does not answer: {text}")


def _result(message: Mapping[str, Any]) -> Result:
    if "error" in message:
        raise raised(message["error"])
    return Result(message["ok"], int(message["time_ns"]), message["number"])


class _RemoteSubscription(Subscription):
    """Events of a connection, which are fetched when they are taken."""

    __slots__ = ("_remote",)

    def __init__(self, remote: RemoteSubject, identity: int, what: Filter, bound: int) -> None:
        super().__init__(what, bound, lambda _: remote.unsubscribe(identity))
        self._remote = remote

    def take(self, most: int | None = None) -> EventBatch:
        self._remote.pump()
        return super().take(most)


def ask(name: str | None, wanted: command.Command, *, timeout_s: float = TIMEOUT_S) -> Any:
    """The answer of the twin ``name`` (None: the only one running) to one command. Raises as `RemoteSubject`."""
    with contextlib.closing(RemoteSubject(name, timeout_s=timeout_s)) as subject:
        return subject.do(wanted).value
