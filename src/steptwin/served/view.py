"""The live view of a served twin in a terminal."""

from __future__ import annotations

import asyncio
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterable, Sequence
from math import ceil, log10
from pathlib import Path

from rich.console import Console
from rich.live import Live
from rich.text import Text

from steptwin.live.cell import Cell
from steptwin.live.lines import ServedLine, banner
from steptwin.live.output import Output
from steptwin.live.server import Server
from steptwin.machine import SECOND, Event, Nanos
from steptwin.mic488.axis import Axis
from steptwin.mic488.device import Mic488
from steptwin.mic488.registers import AXIS_STATUS_TEXTS, CONTROLLER_STATUS_TEXTS
from steptwin.mic488.status import ControllerStatus, Status
from steptwin.served.mic488 import Mic488Line
from steptwin.wire.slave import Direction
from steptwin.words.frames import FrameLine
from steptwin.words.mic488_state import place_of

REFRESH_S = 0.1
LINES_KEPT = 200
"""Of events and of frames; as many as the terminal has room for are shown."""
EVENTS_SHOWN = 5
FEWEST_FRAMES = 4

_STYLES = {
    Status.OFF: "dim",
    Status.VELOCITY: "cyan",
    Status.POSITION: "cyan",
    Status.REACHED: "green",
    Status.ERROR: "bold red",
    Status.HOMING: "magenta",
    Status.CORRECTION: "yellow",
    Status.LIMIT_L: "yellow",
    Status.LIMIT_R: "yellow",
}


class LiveView(ABC):
    """Controllers, the last events and frames, ten times a second, on the terminal's second screen."""

    traffic = "frames"
    """What goes over the line, in a word."""

    def __init__(self, line: ServedLine, cell: Cell, output: Output) -> None:
        self._line = line
        self._cell = cell
        self._output = output
        self._console = Console(file=output, force_terminal=True)  # type: ignore[arg-type]
        self._frames: deque[FrameLine] = deque(maxlen=LINES_KEPT)
        self._events: deque[str] = deque(maxlen=EVENTS_SHOWN)
        self._head: list[Text] = []
        self._timer: asyncio.TimerHandle | None = None

    def notice(self, text: str) -> None:
        self._tell(self._cell.clock.now(), text)

    def _event(self, unit: int, event: Event) -> None:
        self._tell(event.time, self._line.told(unit, event))

    def _tell(self, time: Nanos, text: str) -> None:
        self._events.append(f"{time / SECOND:10.3f} s  {text}")

    async def show(self, server: Server, remarks: Sequence[str]) -> None:
        told = banner(self._line, server.end_points, remarks)
        for text in told:
            self._output.line(text)
        self.watch(told)
        with Live(console=self._console, auto_refresh=False, screen=True) as live:
            self._draw(live)
            try:
                await server.until_ended()
            finally:
                if self._timer is not None:
                    self._timer.cancel()

    def watch(self, told: Sequence[str]) -> None:
        """Begin to take down what happens; ``told`` is what stands above it."""
        self._line.frames.sinks.append(self._frames.append)
        self._line.watch_events(self._event)
        title, *places, ending = told
        self._head = [Text(f"{title}   {ending}", style="bold"), *(Text(text, style="dim") for text in places)]

    def _draw(self, live: Live) -> None:
        self._timer = asyncio.get_running_loop().call_later(REFRESH_S, self._draw, live)
        now = self._cell.enter()
        self._cell.leave()
        width, height = self._console.size
        live.update(page(self.lines(now, width, height)), refresh=True)

    def lines(self, now: Nanos, width: int, height: int) -> list[Text]:
        """What the screen shows, from top to bottom: as much as it has room for."""
        lines = [*self._head, Text()]
        blocks = self.blocks(now, width)
        for left, block in zip(range(len(blocks), 0, -1), blocks, strict=True):
            if len(lines) + len(block) > height - FEWEST_FRAMES and left < len(blocks):
                lines += [Text(f"… and {left} more units: make the window higher", style="yellow"), Text()]
                break
            lines += [*block, Text()]
        if self._events:
            lines += [Text("events", style="bold"), *map(Text, self._events), Text()]
        room = height - len(lines) - 1
        if room > 0 and self._frames:
            shown = list(self._frames)[-room:]
            lines += [Text(self.traffic, style="bold"), *map(_frame, shown)]
        return lines[:height]

    @abstractmethod
    def blocks(self, now: Nanos, width: int) -> list[list[Text]]:
        """The lines of each controller."""


class Mic488View(LiveView):
    """Axes, inputs and outputs."""

    def __init__(self, line: Mic488Line, cell: Cell, output: Output) -> None:
        super().__init__(line, cell, output)
        self._devices = line.devices

    def blocks(self, now: Nanos, width: int) -> list[list[Text]]:
        return [_controller(unit, device, now, width) for unit, device in self._devices.items()]


def page(lines: Iterable[Text]) -> Text:
    page = Text(no_wrap=True, overflow="ellipsis", end="")
    page.append_text(Text("\n").join(lines))
    return page


def _frame(frame: FrameLine) -> Text:
    incoming = frame.direction is Direction.IN
    text = Text(f"{frame.time / SECOND:10.3f} s  {frame.link:<7} ")
    return text.append(f"{'→' if incoming else '←'} {frame.meaning}", style="" if incoming else "dim")


def _controller(unit: int, device: Mic488, now: Nanos, width: int) -> list[Text]:
    status = device.status()
    title = Text(f"unit {unit}  {now / SECOND:9.1f} s  ", style="bold")
    title.append(CONTROLLER_STATUS_TEXTS[status], style="green" if status is ControllerStatus.OK else "bold red")
    heads = ["position", "velocity", "encoder"][: _columns(width)]
    head = Text("   " + "".join(f" {text:>15}" for text in heads) + "   status", style="dim")
    return [title, *_program(device), head, *(_axis(axis, now, width) for axis in device.axes), *_pins(device)]


def _program(device: Mic488) -> list[Text]:
    """What the program is at; nothing for a controller without any."""
    place = place_of(device)
    if place is None:
        return [Text("program stopped", style="dim")] if device.program.programs else []
    return [
        Text(f"program {device.program.state.name.lower()}, {Path(place.file).name}:{place.line}  {place.text}", style="cyan")
    ]


def _columns(width: int) -> int:
    """How many columns of numbers have room beside the status."""
    return max(1, min(3, (width - 28) // 16))


def _axis(axis: Axis, now: Nanos, width: int) -> Text:
    unit = axis.config.unit_name
    decimals = min(max(ceil(log10(axis.gear)), 0), 6)
    numbers = [
        f"{axis.coordinate_p(now) / axis.gear:.{decimals}f} {unit}",
        f"{axis.profile.velocity(now) / axis.gear:.{decimals}f} {unit}/s",
        f"{axis.encoder_counts(now)}",
    ][: _columns(width)]
    text = Text(f"M{axis.number} " + "".join(f" {number:>15}" for number in numbers))
    return text.append(f"  {axis.status:2d} {AXIS_STATUS_TEXTS[axis.status]}", style=_STYLES.get(axis.status, ""))


def _pins(device: Mic488) -> list[Text]:
    inputs = _lamps("IN ", device.inputs.filtered)
    outputs = _lamps("OUT", device.outputs)
    outputs.append("  AIN ", style="bold").append("  ".join(f"{volts:.2f} V" for volts in device.analog_v))
    outputs.append("  ERR", style="bold white on red" if device.error_led else "dim")
    return [inputs, outputs]


def _lamps(name: str, states: Iterable[bool]) -> Text:
    text = Text(f"{name} ", style="bold")
    for number, on in enumerate(states, start=1):
        text.append(f"{number}", style="not bold black on green" if on else "not bold dim").append(" ", style="not bold")
    return text
