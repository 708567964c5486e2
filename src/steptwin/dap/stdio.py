"""The debug adapter on standard input and output."""

from __future__ import annotations

import json
import sys
import traceback
from collections.abc import Mapping
from contextlib import suppress
from itertools import count
from queue import Empty, SimpleQueue
from threading import Thread
from typing import Any, BinaryIO

from steptwin.baseprotocol import message_bytes, own_stdin, read_body
from steptwin.dap.adapter import Adapter
from steptwin.errors import Misuse, SteptwinError


def serve_stdio() -> None:
    """Serve an editor until it goes away."""
    source, target = own_stdin(), sys.stdout.buffer
    sys.stdout = sys.stderr  # nothing but messages may go there
    serve(source, target)


def serve(source: BinaryIO, target: BinaryIO) -> None:
    """Serve one debug session on two streams."""
    _DebugSession(source, target).run()


class _DebugSession:
    def __init__(self, source: BinaryIO, target: BinaryIO) -> None:
        self._source, self._target = source, target
        self._numbers = count(1)
        self._waiting: SimpleQueue[dict[str, Any] | Misuse | None] = SimpleQueue()
        self._adapter = Adapter(self._event)
        self._is_over = False
        """The client no longer reads."""

    def run(self) -> None:
        """Serve until the editor disconnects or is gone; in both cases a twin is left as it was found."""
        Thread(target=self._read, daemon=True).start()
        try:
            self._serve()
        except BrokenPipeError:
            sys.stderr.write("steptwin dap: the editor is gone\n")
        finally:
            self._is_over = True
            with suppress(SteptwinError):
                self._adapter.answer("disconnect", {})

    def _serve(self) -> None:
        while True:
            try:
                patience_s = self._adapter.patience_s
                message = self._waiting.get(block=patience_s != 0.0, timeout=patience_s)
            except Empty:
                self._adapter.go_on()
                continue
            if message is None:
                return
            if isinstance(message, Misuse):
                sys.stderr.write(f"steptwin dap: {message}\n")
                return
            if message.get("type") == "request" and not self._answered(message):
                return

    def _read(self) -> None:
        while True:
            try:
                body = read_body(self._source)
                message = None if body is None else _message(body)
            except Misuse as error:
                self._waiting.put(error)
                return
            except (OSError, ValueError):
                message = None
            self._waiting.put(message)
            if message is None or message.get("command") == "disconnect":
                return

    def _answered(self, request: Mapping[str, Any]) -> bool:
        """Answer a request; False where it was the last."""
        command = str(request.get("command"))
        arguments = request.get("arguments")
        response: dict[str, object] = {"type": "response", "request_seq": request.get("seq", 0), "command": command}
        try:
            body = self._adapter.answer(command, arguments if isinstance(arguments, dict) else {})
        except SteptwinError as error:
            self._write({**response, "success": False, **_failure(str(error))})
            return command != "disconnect"
        except Exception as error:  # noqa: BLE001 - the editor gets the error, and the session goes on
            traceback.print_exc()
            self._write({**response, "success": False, **_failure(f"a mistake in steptwin: {type(error).__name__}: {error}")})
            return command != "disconnect"
        self._write({**response, "success": True, "body": body})
        self._adapter.after(command)
        return command != "disconnect"

    def _event(self, name: str, body: Mapping[str, object]) -> None:
        self._write({"type": "event", "event": name, "body": body})

    def _write(self, message: Mapping[str, object]) -> None:
        if self._is_over:
            return
        self._target.write(message_bytes({"seq": next(self._numbers), **message}))
        self._target.flush()


def _message(body: bytes) -> dict[str, Any]:
    try:
        message = json.loads(body)
    except (ValueError, RecursionError) as error:
        raise Misuse(f"the message is not JSON: {error}") from None
    if not isinstance(message, dict):
        raise Misuse("a message is an object of JSON")
    return message


def _failure(text: str) -> dict[str, object]:
    return {"message": text, "body": {"error": {"id": 1, "format": "{text}", "variables": {"text": text}, "showUser": True}}}
