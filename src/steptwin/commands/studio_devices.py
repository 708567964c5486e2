"""`steptwin studio --device ...` without a world: what serves the page, and nothing whose time goes on."""

from __future__ import annotations

import sys
from collections.abc import Awaitable, Callable
from contextlib import ExitStack

from steptwin.commands.up_world import UpOptions
from steptwin.errors import Misuse
from steptwin.live.cell import Cell
from steptwin.live.clock import Clock
from steptwin.live.output import Output
from steptwin.live.server import Server, clear_ready_file
from steptwin.machine import Nanos

OF_WORLD = {
    "moment": "--from",
    "seed": "--seed",
    "state": "--state",
    "speed": "--speed",
    "name": "--name",
    "session": "--session",
    "trace": "--trace",
    "faults": "--fault",
    "control": "--control",
    "strict": "--strict",
    "listen_any": "--listen-any",
    "log_frames": "--log-frames",
    "allow_outside": "--allow-outside",
}
"""Options that say something of a world."""


def check_without_world(options: UpOptions) -> None:
    """Raises `Misuse` for an option that needs a world."""
    usual = UpOptions(world=None)
    for key, option in OF_WORLD.items():
        if getattr(options, key) != getattr(usual, key):
            raise Misuse(f"{option} is about a world, and with --device alone there is none: give a MACHINE.toml too")


class _Nothing:
    """Nothing to advance. See `steptwin.live.cell.Advancing`."""

    stale = False

    def __init__(self) -> None:
        self.now: Nanos = 0

    def advance(self, now: Nanos) -> None:
        self.now = now

    def deadline(self) -> Nanos | None:
        return None


async def serve_without_world(options: UpOptions, addition: Callable[[Server], Awaitable[None]]) -> None:
    """Serve what ``addition`` opens until SIGINT, SIGTERM or SIGHUP."""
    with ExitStack() as stack:
        output = Output(sys.stdout)
        stack.callback(output.close)
        if options.ready_file is not None:
            clear_ready_file(options.ready_file)
        server = Server(Cell(_Nothing(), Clock()), output.line)
        try:
            await addition(server)
            if options.ready_file is not None:
                server.write_ready_file(options.ready_file)
            for end_point in server.end_points:
                output.line(f"  {end_point.protocol}  {end_point.place}")
            output.line("Ctrl-C ends")
            await server.until_ended()
        finally:
            await server.close()
