"""The live view of a world on a terminal: controllers, what happened last, frames."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Iterable, Mapping, Sequence

from rich.console import Console
from rich.live import Live
from rich.text import Text

from steptwin.controller import SECOND
from steptwin.live.output import Output
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.server import Server
from steptwin.live.view_controller import controller_lines
from steptwin.live.world import LiveWorld
from steptwin.live.world_frames import subscribe_to_frames
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.world.records import ALL, Selection, describe
from steptwin.wire.frameline import FrameLine
from steptwin.wire.slave import FrameDirection

REFRESH_S = 0.1
LINES_KEPT = 200
"""Lines of events and of frames that are kept; the terminal may have room for fewer."""
EVENTS_SHOWN = 5
FEWEST_FRAMES = 4


class LiveView:
    """Controllers, the last events and frames, ten times a second, on the terminal's second screen."""

    def __init__(self, live: LiveWorld, realtime: RealTimeDriver, output: Output, selection: Selection = ALL) -> None:
        self._live = live
        self._selection = selection
        self._realtime = realtime
        self._output = output
        self._console = Console(file=output, force_terminal=True)  # type: ignore[arg-type]
        self._frames: deque[FrameLine] = deque(maxlen=LINES_KEPT)
        self._events: deque[str] = deque(maxlen=EVENTS_SHOWN)
        self._head: list[Text] = []
        self._timer: asyncio.TimerHandle | None = None
        subscribe_to_frames(live, self._frames.append)
        live.world.trace.subscribers.append(self._record)

    def notice(self, text: str) -> None:
        self._events.append(f"{self._live.now / SECOND:12.6f} s  {text}")

    def _record(self, record: TraceRecord) -> None:
        if self._selection.shows(record):
            self._events.append(describe(record))

    def begin(self, head: Sequence[str], announcement: Mapping[str, object], past: Sequence[TraceRecord] = ()) -> None:
        for text in head:
            self._output.line(text)
        self._events.extend(map(describe, filter(self._selection.shows, past)))
        title, *places, ending = head
        self._head = [Text(f"{title}   {ending}", style="bold"), *(Text(text, style="dim") for text in places)]

    async def show(self, server: Server) -> None:
        with Live(console=self._console, auto_refresh=False, screen=True) as screen:
            self._draw(screen)
            try:
                await server.until_ended()
            finally:
                if self._timer is not None:
                    self._timer.cancel()

    def _draw(self, screen: Live) -> None:
        self._timer = asyncio.get_running_loop().call_later(REFRESH_S, self._draw, screen)
        self._realtime.enter()
        self._realtime.leave()
        width, height = self._console.size
        screen.update(page(self.lines(width, height)), refresh=True)

    def lines(self, width: int, height: int) -> list[Text]:
        """The lines of the screen, from top to bottom, as far as there is room."""
        lines = [*self._head, Text()]
        blocks = self._blocks(width)
        for left, block in zip(range(len(blocks), 0, -1), blocks, strict=True):
            if len(lines) + len(block) > height - FEWEST_FRAMES and left < len(blocks):
                lines += [Text(f"… and {left} more controllers: make the window higher", style="yellow"), Text()]
                break
            lines += [*block, Text()]
        if self._events:
            lines += [Text("events", style="bold"), *map(Text, self._events), Text()]
        room = height - len(lines) - 1
        if room > 0 and self._frames:
            shown = list(self._frames)[-room:]
            lines += [Text("frames", style="bold"), *map(_frame, shown)]
        return lines[:height]

    def _blocks(self, width: int) -> list[list[Text]]:
        """The lines of each controller, then those of the axes of the world."""
        world = self._live.world
        world.sync_all()
        return [*(self._controller(name, width) for name in world.controllers), *self._axes()]

    def _controller(self, name: str, width: int) -> list[Text]:
        world = self._live.world
        kind, controller = world.kind(name), world.controllers[name]
        return controller_lines(name, world.state_of(name), kind.datasheet(controller), width)

    def _axes(self) -> list[list[Text]]:
        """The positions of loads that can differ from the counts of their drives."""
        world = self._live.world
        own = {name: axis for name, axis in world.axis.items() if not world.axes[name].mechanism.build.ideal}
        if not own:
            return []
        lines = [Text(f"{'axis':<12}{'load':>15}", style="dim")]
        for name, axis in own.items():
            line = Text(f"{name:<12}{axis.position:>12.3f} {axis.unit}")
            if axis.stalled:
                line.append("  stalled", style="bold red")
            lines.append(line.append(f"  {axis.lost} pulses lost" if axis.lost else "", style="yellow"))
        return [lines]


def page(lines: Iterable[Text]) -> Text:
    page = Text(no_wrap=True, overflow="ellipsis", end="")
    page.append_text(Text("\n").join(lines))
    return page


def _frame(frame: FrameLine) -> Text:
    incoming = frame.direction is FrameDirection.IN
    text = Text(f"{frame.time / SECOND:10.3f} s  {frame.link:<7} ")
    return text.append(f"{'→' if incoming else '←'} {frame.meaning}", style="" if incoming else "dim")
