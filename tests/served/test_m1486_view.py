"""What the live view of M1486 chips shows."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from steptwin.live.cell import Cell
from steptwin.live.lines import banner
from steptwin.live.links import Feed
from steptwin.live.output import Output
from steptwin.live.server import EndPoint
from steptwin.m1486.variants import variant
from steptwin.machine import SECOND, Nanos
from steptwin.served.m1486 import ChainOptions, M1486Line
from steptwin.served.m1486_view import M1486View

Run = Callable[..., Any]
NOW: Nanos = 2 * SECOND


class Nowhere:
    def write(self, data: bytes) -> None:
        """Nobody hears it."""


def screen(run: Run, addresses: list[int], typed: bytes, width: int, height: int) -> list[str]:
    """The screen two seconds after ``typed``."""

    async def scene() -> list[str]:
        loop: Any = asyncio.get_running_loop()
        line = M1486Line(ChainOptions(variant=variant("B"), addresses=addresses, is_written_down=True))
        cell = Cell(line.kernel, loop.clock())
        view = M1486View(line, cell, Output(None))
        view.watch(banner(line, [EndPoint("pty", "/run/m1486", "M1486 line")], []))
        feeds = [line.log_characters(cell), Feed(cell, line.port("pty"), Nowhere())]
        feeds[1].take(typed)
        await asyncio.sleep(NOW / SECOND)
        shown = [text.plain[:width].rstrip() for text in view.lines(cell.enter(), width, height)]
        for feed in feeds:
            feed.close()
        cell.close()
        return shown

    return run(scene())


def test_the_whole_screen(run: Run) -> None:
    typed = b"x7\rv1000\rf640000\rt80\rc2\rr\ru1\rx0\rz5\r"
    assert screen(run, [0, 7], typed, 120, 40) == [
        "M1486B, Step & Direction, addresses 0, 7, 4800 bit/s   Ctrl-C ends",
        "  M1486 line    /run/m1486",
        "",
        "chip 0        2.0 s  waits until B5 is low",
        "position         0   true         0         0.0 step/s   at rest   M1 Q1",
        "memory 16 of 2032 bits   input buffer 0 of 32",
        "variable 0   flags -   functions 48 49 50 51 52 53 54 55",
        "B 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21",
        "  JOG LIMIT SD RST S&D DUAL BOOST DIRECTION",
        "",
        "chip 7        2.0 s  waits for the end of the move  (does not listen)",
        "position    640000   true    123648      1000.0 step/s   move   M1 Q1",
        "memory 112 of 2032 bits   input buffer 0 of 32   next: U1",
        "variable 0   flags 80   functions 48 49 50 51 52 53 54 55",
        "B 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21",
        "  JOG LIMIT SD RST S&D DUAL BOOST DIRECTION",
        "",
        "events",
        "     0.000 s  chip 0: waits until B5 is low",
        "     0.003 s  chip 7: B2 low",
        "     0.004 s  chip 7: moves +640000 to 640000 in 10.128000 s",
        "",
        "characters",
        "     0.000 s  pty     → X7  indeX 7",
        "     0.000 s  pty     → V1000  Velocity 1000 step/s",
        "     0.000 s  pty     → F640000  Forward 640 000 min. microsteps",
        "     0.000 s  pty     → T80  Flag on 80",
        "     0.000 s  pty     → C2  Clear 2",
        "     0.000 s  pty     → R  Run",
        "     0.000 s  pty     → U1  Upload 1",
        "     0.000 s  pty     → X0  indeX 0",
        "     0.000 s  pty     → Z5  Zero 5",
    ]


def test_low_terminals_name_what_they_leave_out(run: Run) -> None:
    low = screen(run, [0, 1, 2, 3], b"", 80, 24)
    assert [line.split()[1] for line in low if line.startswith("chip ")] == ["0", "1"]
    assert "… and 2 more units: make the window higher" in low
    for height in (8, 16, 24, 60):
        assert len(screen(run, [0, 7], b"u1\r" * 50, 80, height)) <= height
