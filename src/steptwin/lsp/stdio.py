"""The editor server on standard input and output.

Requests are answered one after the other, because an answer belongs to one state of the texts. Messages are read meanwhile: a
request that is cancelled while it waits is never begun, and the one that is being answered is interrupted. The thread that
reads raises a signal for that, whose handler runs in the main thread, between two steps of the answer.
"""

from __future__ import annotations

import asyncio
import gc
import json
import signal
import sys
import traceback
from _thread import interrupt_main
from collections.abc import Generator
from contextlib import contextmanager
from threading import Thread, current_thread, main_thread
from typing import Any, BinaryIO, cast

from lsprotocol import types as lsp
from pygls.exceptions import JsonRpcParseError, JsonRpcRequestCancelled
from pygls.io_ import StdoutWriter

from steptwin.baseprotocol import own_stdin, read_body
from steptwin.errors import Misuse
from steptwin.lsp.editorserver import EditorServer
from steptwin.lsp.protocol import Protocol
from steptwin.lsp.server import server
from steptwin.system import OWN_SIGNAL

_COLLECT_AFTER = 100_000
"""Objects after which Python looks for garbage: trees of programs are many small objects, none of them in cycles."""


def serve_stdio() -> int:
    """Serve the client on standard input and output until it goes. Returns the exit code: 1 for an exit without a shutdown."""
    gc.set_threshold(_COLLECT_AFTER)
    try:
        return asyncio.run(serve(own_stdin(), sys.stdout.buffer))
    except BrokenPipeError:
        sys.stderr.write("steptwin lsp: the editor is gone\n")
        return 1
    except KeyboardInterrupt:
        return 0


async def serve(source: BinaryIO, target: BinaryIO) -> int:
    """Serve one client on two streams; returns the exit code."""
    made = server()
    protocol = cast(Protocol, made.protocol)
    protocol.set_writer(StdoutWriter(target))
    messages: asyncio.Queue[dict[str, Any] | Misuse | None] = asyncio.Queue()
    cancelled: set[object] = set()
    """Numbers of requests that wait; the notification, which comes behind them, removes its number."""
    try:
        with _interrupts(made, cancelled):
            Thread(target=_read, args=(source, asyncio.get_running_loop(), messages, cancelled), daemon=True).start()
            return await _answer(made, protocol, messages, cancelled)
    finally:
        made.end()


async def _answer(
    made: EditorServer, protocol: Protocol, messages: asyncio.Queue[dict[str, Any] | Misuse | None], cancelled: set[object]
) -> int:
    """Answer until the client goes; the exit code."""
    while (message := await messages.get()) is not None:
        if isinstance(message, Misuse):
            sys.stderr.write(f"steptwin lsp: {message}\n")
            return 1
        method, number = message.get("method"), message.get("id")
        if method == lsp.EXIT:
            return 0 if protocol.is_shut_down else 1
        if method == lsp.CANCEL_REQUEST:
            cancelled.discard(_number(message))
        elif isinstance(number, int | str) and number in cancelled:
            protocol.refuse(number, JsonRpcRequestCancelled(f"{method}: cancelled before it was begun"))
        else:
            made.number = number if isinstance(number, int | str) else None
            _handle(protocol, message)
    return 0


@contextmanager
def _interrupts(made: EditorServer, cancelled: set[object]) -> Generator[None]:
    """Let `OWN_SIGNAL` interrupt the answer to a request that is cancelled, where this is the main thread."""

    def interrupt(*_: object) -> None:
        if made.is_answering and made.number is not None and made.number in cancelled:
            made.is_answering = False  # once
            raise JsonRpcRequestCancelled("cancelled while it was answered")

    if current_thread() is not main_thread():
        yield
        return
    before = signal.signal(OWN_SIGNAL, interrupt)
    try:
        yield
    finally:
        signal.signal(OWN_SIGNAL, before)


def _read(
    source: BinaryIO,
    loop: asyncio.AbstractEventLoop,
    messages: asyncio.Queue[dict[str, Any] | Misuse | None],
    cancelled: set[object],
) -> None:
    """Put each message into the queue of ``loop``: a `Misuse` or None is the last."""
    while True:
        message: dict[str, Any] | Misuse | None
        try:
            body = read_body(source)
            message = None if body is None else _structure(body)
        except Misuse as error:
            message = error
        except (OSError, ValueError):
            message = None
        if isinstance(message, dict) and message.get("method") == lsp.CANCEL_REQUEST:
            cancelled.add(_number(message))
            interrupt_main(OWN_SIGNAL)
        try:
            loop.call_soon_threadsafe(messages.put_nowait, message)
        except RuntimeError:
            return  # the loop is closed: the client does not read any more
        if not isinstance(message, dict) or message.get("method") == lsp.EXIT:
            return


def _structure(body: bytes) -> dict[str, Any]:
    """The message in a body; an empty one for what is not a message."""
    try:
        message = json.loads(body)
    except (ValueError, RecursionError):
        return {}
    return message if isinstance(message, dict) else {}


def _number(notification: dict[str, Any]) -> object:
    """The number of the request that a notification cancels."""
    params = notification.get("params")
    number = params.get("id") if isinstance(params, dict) else None
    return number if isinstance(number, int | str) else None


def _handle(protocol: Protocol, message: dict[str, Any]) -> None:
    if message.get("jsonrpc") != "2.0":
        protocol.refuse(None, JsonRpcParseError('a message is an object of JSON with "jsonrpc": "2.0"'))
        return
    try:
        protocol.handle_message(protocol.structure_message(message))
    except BrokenPipeError:
        raise
    except Exception:  # noqa: BLE001 - the session goes on
        traceback.print_exc()
