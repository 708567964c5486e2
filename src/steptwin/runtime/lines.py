"""What a served twin says where no live view is shown: one line for each thing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from steptwin.machine import SECOND
from steptwin.mic488.device import Event
from steptwin.runtime.mic488 import Mic488Line
from steptwin.runtime.output import Output
from steptwin.runtime.server import EndPoint, Server


class Face(Protocol):
    """How a served twin appears to a person."""

    def notice(self, text: str) -> None:
        """Something the person should know."""
        ...

    async def show(self, server: Server, remarks: Sequence[str]) -> None:
        """Tell what is served, with ``remarks``, and what happens until the server ends."""
        ...


def banner(line: Mic488Line, end_points: Sequence[EndPoint], remarks: Sequence[str]) -> list[str]:
    """What is served, where, and what to know about it."""
    places = [f"  {end_point.protocol:<13} {end_point.place}" for end_point in end_points]
    return [line.title, *places, *(f"  {remark}" for remark in remarks), "Ctrl-C ends"]


class Lines:
    """End points, events, notices, and with ``frames`` every frame."""

    def __init__(self, line: Mic488Line, output: Output, *, frames: bool) -> None:
        self._line = line
        self._output = output
        self._frames = frames

    def notice(self, text: str) -> None:
        self._output.line(text)

    async def show(self, server: Server, remarks: Sequence[str]) -> None:
        line, output = self._line, self._output
        for text in banner(line, server.end_points, remarks):
            output.line(text)
        line.watch_events(self._event)
        if self._frames:
            line.frames.sinks.append(lambda frame: output.line(str(frame)))
        await server.until_ended()

    def _event(self, unit: int, event: Event) -> None:
        self._output.line(f"{event.time / SECOND:12.6f} s  {self._line.told(unit, event)}")
