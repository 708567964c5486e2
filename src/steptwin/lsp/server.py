"""A server that is ready to start: pygls takes the messages apart and calls the handlers."""

from __future__ import annotations

import inspect
import logging
from collections.abc import Callable
from typing import Any

from pygls.exceptions import JsonRpcInvalidParams, JsonRpcRequestCancelled
from pygls.protocol import json_rpc

from steptwin.lsp.editorserver import EditorServer
from steptwin.lsp.files import Files
from steptwin.lsp.handlers import HANDLERS


def server(files: Files | None = None) -> EditorServer:
    """A server that is ready for one client; without ``files`` it reads those of this machine."""
    logging.getLogger(json_rpc.__name__).addFilter(_is_fault)
    made = EditorServer(files)
    for method, (handler, options) in HANDLERS.items():
        made.feature(method, options)(_bound(made, handler))
    return made


def _is_fault(record: logging.LogRecord) -> bool:
    """Refusals go to the client; pygls would log each with a traceback, too."""
    if str(record.msg).startswith("Unable to deserialize message"):
        return False
    return record.exc_info is None or not isinstance(record.exc_info[1], JsonRpcInvalidParams | JsonRpcRequestCancelled)


def _bound(made: EditorServer, handler: Callable[[EditorServer, Any], Any]) -> Callable[[Any], Any]:
    if inspect.iscoroutinefunction(handler):

        async def later(params: Any) -> Any:
            return await handler(made, params)

        return later

    def now(params: Any) -> Any:
        with made.answering():
            return handler(made, params)

    return now
