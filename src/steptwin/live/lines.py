"""What a served twin says where no live view is shown: one line for each thing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from steptwin.live.output import Output
from steptwin.live.server import EndPoint, Server
from steptwin.machine import SECOND, Event
from steptwin.words.frames import FrameLine


class FrameSource(Protocol):
    """Whatever puts into words what goes over a line."""

    sinks: list[Callable[[FrameLine], None]]


class ServedLine(Protocol):
    """What a face shows of controllers on a line."""

    @property
    def title(self) -> str: ...
    @property
    def frames(self) -> FrameSource: ...
    def watch_events(self, sink: Callable[[int, Event], None]) -> None:
        """Tell ``sink`` unit and event."""
        ...

    def told(self, unit: int, event: Event) -> str:
        """An event in words; the unit is named where there are several."""
        ...


class Face(Protocol):
    """How a served twin appears to a person."""

    def notice(self, text: str) -> None:
        """Something the person should know."""
        ...

    async def show(self, server: Server, remarks: Sequence[str]) -> None:
        """Tell what is served, with ``remarks``, and what happens until the server ends."""
        ...


def banner(line: ServedLine, end_points: Sequence[EndPoint], remarks: Sequence[str]) -> list[str]:
    """What is served, where, and what to know about it."""
    places = [f"  {end_point.protocol:<13} {end_point.place}" for end_point in end_points]
    return [line.title, *places, *(f"  {remark}" for remark in remarks), "Ctrl-C ends"]


class Lines:
    """End points, events, notices, and with ``frames`` every frame."""

    def __init__(self, line: ServedLine, output: Output, *, frames: bool) -> None:
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
