"""What the live view shows, at the widths and heights that terminals have."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any

from rich.console import Console, Group
from wbc_rig import loaded

from steptwin.files.programbanks import Banks
from steptwin.live.cell import Cell
from steptwin.live.clock import Clock
from steptwin.live.lines import banner
from steptwin.live.output import Output
from steptwin.live.server import EndPoint
from steptwin.machine import SECOND, Nanos
from steptwin.mic488.config import ControllerConfig
from steptwin.served.demo import demo_config
from steptwin.served.mic488 import LineOptions, Mic488Line
from steptwin.served.view import Mic488View, page

Run = Callable[..., Any]

END_POINTS = [EndPoint("pty", "/run/mic488", "Modbus RTU"), EndPoint("tcp", "127.0.0.1:5020", "Modbus TCP")]
REMARKS = ["non-volatile memory ends with this process (--state DIR keeps it)"]

READ_STATUS = bytes.fromhex("0001 0000 0006 01 03 271A 0004")
ENABLE = bytes.fromhex("0001 0000 0006 01 05 07D0 FF00")
MOVE_M1 = bytes.fromhex("0001 0000 000B 01 10 2764 0002 04 0000 42C8")  # to 100
MOVE_M2 = bytes.fromhex("0001 0000 000B 01 10 2766 0002 04 0000 42C8")


NOW: Nanos = 2 * SECOND


def screen(run: Run, line: Mic488Line, width: int, height: int, requests: tuple[bytes, ...] = ()) -> list[str]:
    """The screen two seconds after ``requests``, as a terminal of that size shows it."""

    async def scene() -> list[str]:
        view = Mic488View(line, Cell(line.kernel, Clock()), Output(None))
        view.watch(banner(line, END_POINTS, REMARKS))
        port = line.tcp_port()
        for request in requests:
            port.exchange(request, 0)
        line.kernel.advance(NOW)
        console = Console(file=io.StringIO(), width=width, height=height)
        with console.capture() as shown:
            console.print(Group(page(view.lines(NOW, width, height))))
        return [text.rstrip() for text in shown.get().splitlines()]

    return run(scene())


def demo(*units: int) -> Mic488Line:
    return Mic488Line(demo_config(), units or (1,), "1.70", demo=True, options=LineOptions(frames=True))


def test_the_whole_screen(run: Run) -> None:
    assert screen(run, demo(), 80, 24, requests=(ENABLE, MOVE_M1, MOVE_M2, READ_STATUS)) == [
        "MIC488 firmware 1.70, unit 1   Ctrl-C ends",
        "  Modbus RTU    /run/mic488",
        "  Modbus TCP    127.0.0.1:5020",
        "  non-volatile memory ends with this process (--state DIR keeps it)",
        "",
        "unit 1        2.0 s  ok",
        "           position        velocity         encoder   status",
        "M1         43.75 mm      25.00 mm/s             546   3 moving to position",
        "M2          0.00 mm       0.00 mm/s               0   0 off",
        "M3          0.00 mm       0.00 mm/s               0   0 off",
        "M4          0.00 mm       0.00 mm/s               0   0 off",
        "IN  1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20",
        "OUT 1 2 3 4 5 6 7 8   AIN 0.00 V  0.00 V  ERR",
        "",
        "events",
        "     0.000 s  position command ignored: M2 is not enabled",
        "",
        "frames",
        "     0.000 s  tcp-1   → write M1_POS_ABS = 100 mm",
        "     0.000 s  tcp-1   ← wrote M1_POS_ABS",
        "     0.000 s  tcp-1   → write M2_POS_ABS = 100 mm",
        "     0.000 s  tcp-1   ← wrote M2_POS_ABS",
        "     0.000 s  tcp-1   → read M1_STATUS … M4_STATUS",
        "     0.000 s  tcp-1   ← read M1_STATUS … M4_STATUS = moving to position (3), of…",
    ]


def test_narrow_terminals_lose_columns_and_ends_of_lines_but_no_axis(run: Run) -> None:
    for width, columns in ((120, 3), (76, 3), (75, 2), (60, 2), (59, 1), (30, 1)):
        lines = screen(run, demo(), width, 24, requests=(ENABLE, MOVE_M1))
        assert max(map(len, lines)) <= width
        axes = [line for line in lines if line.startswith(("M1 ", "M2 ", "M3 ", "M4 "))]
        assert len(axes) == 4
        head = next(line for line in lines if "position" in line)
        assert [name for name in ("position", "velocity", "encoder") if name in head] == ["position", "velocity", "encoder"][
            :columns
        ]
        assert "3 moving" in axes[0] or width == 30


def test_low_terminals_are_never_overfilled(run: Run) -> None:
    for height in (10, 16, 20, 24, 60):
        lines = screen(run, demo(), 80, height, requests=(ENABLE, MOVE_M1, *[READ_STATUS] * 50))
        assert len(lines) <= height
    assert sum("M1_STATUS" in line for line in lines) == 60 - 15


def test_several_units_one_after_the_other_as_far_as_there_is_room(run: Run) -> None:
    high = screen(run, demo(1, 2, 5), 80, 50)
    assert [line.split()[1] for line in high if line.startswith("unit ")] == ["1", "2", "5"]
    low = screen(run, demo(1, 2, 5), 80, 24)
    assert [line.split()[1] for line in low if line.startswith("unit ")] == ["1"]
    assert "… and 2 more units: make the window higher" in low


def test_pulses_have_no_decimals(run: Run) -> None:
    line = Mic488Line(ControllerConfig(), (1,), "1.70", options=LineOptions(frames=True))
    assert "M1            0 imp         0 imp/s               0   0 off" in screen(run, line, 80, 24)


def test_notices_are_among_the_events(run: Run) -> None:
    async def scene() -> list[str]:
        line = demo()
        view = Mic488View(line, Cell(line.kernel, Clock()), Output(None))
        view.watch(banner(line, END_POINTS, REMARKS))
        for number in range(9):
            view.notice(f"notice {number}")
        return [text.plain for text in view.lines(0, 80, 40)]

    shown = [line.partition(" s  ")[2] for line in run(scene()) if "notice" in line]
    assert shown == [f"notice {number}" for number in range(4, 9)]


def test_the_program_and_where_it_is(run: Run) -> None:
    program, _ = loaded("OUT1 = ON\nWAIT IN1 = ON\n")
    line = Mic488Line(ControllerConfig(), [1], "1.70", Banks({0: program}))
    assert "program stopped" in screen(run, line, 80, 24)
    line = Mic488Line(ControllerConfig(), [1], "1.70", Banks({0: program}))
    start = bytes.fromhex("0001 0000 0006 01 06 2713 0001")
    assert "program running, program:2  WAIT IN1 = ON" in screen(run, line, 80, 24, requests=(start,))
