"""The service of the studio: page, WebSocket and REST over HTTP, in the event loop of the world that it shows."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable

from fastapi import FastAPI

from steptwin import __version__
from steptwin.access.origin import Origins
from steptwin.httpservice import HttpService, Tls
from steptwin.studio import editors, viewers
from steptwin.studio.editors import Editors
from steptwin.studio.editorthread import EditorThread
from steptwin.studio.guard import Guard
from steptwin.studio.hub import Hub
from steptwin.studio.rest import Rest, describe_api
from steptwin.studio.static import add_page
from steptwin.studio.viewers import Viewers
from steptwin.subject.dispatch import LONGEST_REQUEST

PONG_S = 300.0
"""Time for the answer to a ping, which lies behind a message that is being read. A viewer that reads nothing of it is given
up earlier (`steptwin.studio.viewers`)."""


class StudioService:
    """Serves ``hub`` at ``listening`` until it is closed. A `Link` of a server."""

    def __init__(self, hub: Hub, listening: socket.socket, origins: Origins, tls: Tls | None = None) -> None:
        clock = time.monotonic_ns
        self._viewers = Viewers(hub, clock)
        around = hub.around
        self._analysis = EditorThread()
        editing = Editors(around.gate, around.programs.files, clock, self._analysis)
        sockets = {viewers.PATH: self._viewers.serve, editors.PATH: editing.serve}
        guarded = Guard(make_app(hub, clock), sockets, origins, clock, around.on_internal)
        self._http = HttpService(
            guarded,
            listening,
            tls,
            ws="websockets-sansio",
            ws_max_size=LONGEST_REQUEST,
            ws_ping_timeout=PONG_S,
            ws_per_message_deflate=False,
        )

    def start(self) -> None:
        """Raises `LineFailure` for a certificate that cannot be used."""
        self._http.start()

    async def close(self) -> None:
        await self._viewers.close()
        await self._http.close()
        self._analysis.close()


def make_app(hub: Hub, clock: Callable[[], int]) -> FastAPI:
    """Application behind the guard."""
    app = FastAPI(title="steptwin studio", version=__version__, docs_url=None, redoc_url=None)
    Rest(hub, clock).add_to(app)
    describe_api(app, has_tokens=hub.around.gate.has_tokens)
    add_page(app)
    return app
