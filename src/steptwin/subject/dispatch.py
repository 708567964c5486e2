"""The dispatcher: executes commands, for messages and the command line alike."""

from __future__ import annotations

import json
from collections.abc import Awaitable, Callable, Mapping
from typing import Any, TypeAlias

from steptwin.datatypes import format_short
from steptwin.errors import LineFailure, Misuse, Refusal, SteptwinError
from steptwin.fields import ID
from steptwin.messages import Message, read_message_text, text_of, with_messages
from steptwin.subject.commands import COMMANDS, VERSION, Command, read_command, type_of
from steptwin.subject.contract import Result

LONGEST_REQUEST = 1 << 20
"""Limit of a message, bytes: sufficient for the longest permitted program in any JSON encoding."""
FORM = Message("subject.form-of-a-request", 'a request is a line of JSON: {{"do": NAME, "id": ANY, FIELD: VALUE, ...}}')

Action: TypeAlias = Callable[[Any], object]
"""Executes a command; returns its answer as plain data."""
JsonObject: TypeAlias = dict[str, object]


COMMAND_NOT_SUPPORTED = Message("subject.command-not-supported", "{command} is not supported here; supported are {names}")


class Dispatcher:
    """The actions of commands, by class. ``begin`` returns the number of a command, ``end`` the moment of its execution."""

    def __init__(self, actions: Mapping[Any, Action], begin: Callable[[], int], end: Callable[[], int]) -> None:
        self._actions = dict(actions)
        self._begin = begin
        self._end = end

    def add(self, actions: Mapping[Any, Action]) -> None:
        """Add commands that are executed outside the subject: for its time, files and end points."""
        self._actions.update(actions)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(row.name for row in COMMANDS.values() if row.kind in self._actions)

    def do(self, command: Command) -> Result:
        """Execute a command. Raises `Misuse`, `Refusal`, `LineFailure`."""
        action = self._actions.get(type(command))
        if action is None:
            raise self._unsupported(command)
        number = self._begin()
        try:
            value = action(command)
        finally:
            time = self._end()
        return Result(value, time, number)

    def look(self, command: Command) -> object:
        """The answer to a command from which nothing follows. Raises as `do`."""
        action = self._actions.get(type(command))
        if action is None:
            raise self._unsupported(command)
        return action(command)

    def _unsupported(self, command: Command) -> Refusal:
        return Refusal(COMMAND_NOT_SUPPORTED(command=type_of(command).name, names=list(self.names)))


# ---------------------------------------------------------------------- messages


def read_message(line: bytes, key: str = "do") -> JsonObject:
    """Read a JSON object with a text under ``key``. Raises `Misuse`."""
    try:
        message = json.loads(line)
    except (ValueError, RecursionError):
        raise Misuse(FORM()) from None
    if not isinstance(message, dict) or not isinstance(message.get(key), str):
        raise Misuse(FORM())
    return message


WRONG_ID = Message("subject.wrong-id", "id: {problem}")


def id_of(message: Mapping[str, object]) -> object:
    """The id of a request, None without. Raises `Misuse`."""
    found = message.get("id")
    try:
        return None if found is None else ID.read(found)
    except Misuse as error:
        raise Misuse(WRONG_ID(problem=text_of(error))) from None


def command_of(message: Mapping[str, object]) -> Command:
    """The command in a request. Raises `Misuse`."""
    return read_command(message["do"], fields_of(message))


OTHER_VERSION = Message("subject.other-version", "version = {version}: this subject has version {own}")


def fields_of(message: Mapping[str, object]) -> dict[str, object]:
    """The fields in a request. Raises `Misuse` for another version."""
    version = message.get("version", VERSION)
    if version != VERSION or isinstance(version, bool):
        raise Misuse(OTHER_VERSION(version=format_short(version), own=VERSION))
    fields = dict(message)
    for name in ("do", "id", "version"):
        fields.pop(name, None)
    if message.get("do") == "stop" and "version" not in message and "machine" in fields and "controller" not in fields:
        fields["controller"] = fields.pop("machine")  # a stop of version 1 stops, whatever it is called
    return fields


def answer(result: Result) -> JsonObject:
    return {"ok": result.value, "number": result.number, "time_ns": str(result.time)}


INTERNAL = Message("subject.internal-error", "internal error, please report it: {what}")


def failure(error: Exception) -> JsonObject:
    """An error as a value. ``code``: misuse, refusal, failure (the line or the peer), internal."""
    text = text_of(error) if isinstance(error, SteptwinError) else INTERNAL(what=f"{type(error).__name__}: {error}")
    return {"error": with_messages({"code": code_of(error), "message": text})}


def code_of(error: Exception) -> str:
    if not isinstance(error, SteptwinError):
        return "internal"
    return "misuse" if isinstance(error, Misuse) else "refusal" if isinstance(error, Refusal) else "failure"


def raised(error: Mapping[str, Any]) -> SteptwinError:
    """The exception for an error as a value."""
    kinds: Mapping[str, type[SteptwinError]] = {"misuse": Misuse, "refusal": Refusal, "failure": LineFailure}
    return kinds.get(error["code"], SteptwinError)(read_message_text(error, "message"))


async def respond(
    do: Callable[[Command, object], Awaitable[Result]], line: bytes, on_internal: Callable[[Exception], object]
) -> JsonObject:
    """The answer to any message. ``do`` takes its command and its id; ``on_internal`` is called with unexpected exceptions."""
    found: dict[str, object] = {}
    try:
        message = read_message(line)
        identity = id_of(message)
        found = {} if identity is None else {"id": identity}
        return {**found, **answer(await do(command_of(message), identity))}
    except Exception as error:  # noqa: BLE001  every request must be answered
        if not isinstance(error, SteptwinError):
            on_internal(error)
        return {**found, **failure(error)}
