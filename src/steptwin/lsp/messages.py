"""The editor server without streams: messages of JSON-RPC come in as texts, others go out."""

from __future__ import annotations

import json
import logging
from collections.abc import Callable

from lsprotocol import types as lsp
from pygls.exceptions import JsonRpcException

from steptwin.errors import Misuse
from steptwin.lsp.files import Files
from steptwin.lsp.server import server


class _Writer:
    """As pygls writes."""

    def __init__(self, send: Callable[[str], None]) -> None:
        self._send = send

    def write(self, data: bytes) -> None:
        self._send(data.decode())

    def close(self) -> None:
        """Nothing is open."""


class MessageServer:
    """For one client, in a running event loop of asyncio. ``send`` is called with what goes out."""

    def __init__(self, files: Files, send: Callable[[str], None]) -> None:
        self._server = server(files)
        self._protocol = self._server.protocol
        self._protocol.set_writer(_Writer(send), include_headers=False)
        # What is wrong with a message is in the answer to it.
        logging.getLogger("pygls").addHandler(logging.NullHandler())
        logging.getLogger("pygls").propagate = False

    @property
    def documents(self) -> int:
        """How many texts are open."""
        return len(self._server.session.open_uris)

    def receive(self, text: str) -> None:
        """Raises `Misuse` for what is no message of the protocol."""
        try:
            data = json.loads(text)
            if not isinstance(data, dict) or data.get("jsonrpc") != "2.0":
                raise Misuse('a message is an object of JSON with "jsonrpc": "2.0"')
            if data.get("method") != lsp.EXIT:  # it would end the process
                self._protocol.handle_message(self._protocol.structure_message(data))
        except (ValueError, RecursionError, JsonRpcException) as error:
            raise error if isinstance(error, Misuse) else Misuse(f"no message of the protocol: {error}") from None

    def close(self) -> None:
        self._server.end()
