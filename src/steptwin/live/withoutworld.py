"""`steptwin studio --device ...` and `steptwin bridge`: a server for devices, without a world and its virtual time."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from steptwin.controller import Nanos
from steptwin.live.clock import Clock
from steptwin.live.options import LogOptions
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.server import Server, clear_ready_file


class _Nothing:
    """A world without contents, for a real-time driver. See `steptwin.live.realtimedriver.Advanceable`."""

    is_dirty = False

    def __init__(self) -> None:
        self.now: Nanos = 0

    def advance(self, now: Nanos) -> None:
        self.now = now

    def deadline(self) -> Nanos | None:
        return None


async def serve_without_world(
    ready_file: Path | None, addition: Callable[[Server], Coroutine[Any, Any, None]], log: LogOptions
) -> None:
    """Serve what ``addition`` opens until SIGINT, SIGTERM or SIGHUP."""
    with ExitStack() as stack:
        output = log.output()
        stack.callback(output.close)
        stack.enter_context(log.tracing("devices", output.notice))
        if ready_file is not None:
            clear_ready_file(ready_file)
        server = Server(RealTimeDriver(_Nothing(), Clock()), output.notice)
        try:
            if not await server.unless_ended(addition(server)):
                return
            if ready_file is not None:
                server.write_ready_file(ready_file)
            places = [f"  {end_point.protocol}  {end_point.place}" for end_point in server.end_points]
            output.begin([*places, "Ctrl-C ends"], server.announcement())
            await server.until_ended()
        finally:
            await server.close()
