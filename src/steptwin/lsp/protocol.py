"""Duties of every server by the protocol, where pygls does otherwise: no second copy of texts, an answer to every request."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any, TypeAlias

from lsprotocol import types as lsp
from pygls.exceptions import JsonRpcException, JsonRpcInvalidParams, JsonRpcInvalidRequest, JsonRpcServerNotInitialized
from pygls.protocol import LanguageServerProtocol, lsp_method

Handling: TypeAlias = Generator[Any, Any, Any]
"""In the form of pygls' own handlers, which yield the functions to call."""


class Protocol(LanguageServerProtocol):
    """Only the session stores texts: pygls' workspace would store each a second time, and reads files that are not open.

    Every request has an answer: pygls gives none to one whose parameters are wrong, and none after a shutdown.
    """

    _is_initialized = False
    is_shut_down = False

    def structure_message(self, data: dict[str, Any]) -> Any:
        try:
            return super().structure_message(data)
        except JsonRpcException as error:
            if "id" in data and "method" in data:
                text = f"{data['method']}: its parameters are not those of the protocol"
                self.refuse(data["id"], JsonRpcInvalidParams(text) if isinstance(error, JsonRpcInvalidParams) else error)
            return None

    def handle_message(self, message: Any) -> None:
        if not hasattr(message, "jsonrpc"):
            return  # refused, or no message of the protocol
        method, number = getattr(message, "method", None), getattr(message, "id", None)
        if method is None or number is None:
            super().handle_message(message)
        elif method == lsp.INITIALIZE:
            if self._is_initialized:
                self.refuse(number, JsonRpcInvalidRequest("initialize is the first request, and comes once"))
            else:
                self._is_initialized = True
                super().handle_message(message)
        elif not self._is_initialized:
            self.refuse(number, JsonRpcServerNotInitialized("the first request is initialize"))
        elif self.is_shut_down:
            self.refuse(number, JsonRpcInvalidRequest("the server has been shut down"))
        else:
            self.is_shut_down = method == lsp.SHUTDOWN
            super().handle_message(message)

    def refuse(self, number: int | str | None, error: JsonRpcException) -> None:
        """Answer a request with an error; None: a message whose number cannot be read."""
        self._send_data(lsp.ResponseErrorMessage(id=number, error=error.to_response_error()))

    @lsp_method(lsp.TEXT_DOCUMENT_DID_OPEN)
    def lsp_text_document__did_open(self, params: lsp.DidOpenTextDocumentParams) -> Handling:
        yield self.fm.features[lsp.TEXT_DOCUMENT_DID_OPEN], (params,), None

    @lsp_method(lsp.TEXT_DOCUMENT_DID_CHANGE)
    def lsp_text_document__did_change(self, params: lsp.DidChangeTextDocumentParams) -> Handling:
        yield self.fm.features[lsp.TEXT_DOCUMENT_DID_CHANGE], (params,), None

    @lsp_method(lsp.TEXT_DOCUMENT_DID_CLOSE)
    def lsp_text_document__did_close(self, params: lsp.DidCloseTextDocumentParams) -> Handling:
        yield self.fm.features[lsp.TEXT_DOCUMENT_DID_CLOSE], (params,), None
