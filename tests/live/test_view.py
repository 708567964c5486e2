"""What the live view shows, at the widths and heights that terminals have."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any

from rich.console import Console, Group

from steptwin.controller import SECOND
from steptwin.files.world import World
from steptwin.live.clock import Clock
from steptwin.live.display import banner
from steptwin.live.output import Output
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.server import EndPoint
from steptwin.live.view import LiveView, page
from steptwin.live.world import ClientPort, LiveWorld
from steptwin.simulation.describe.generated import LINE, Whole
from steptwin.simulation.describe.generated_m1486 import m1486_world
from steptwin.simulation.describe.generated_mic488 import mic488_world

Run = Callable[..., Any]

END_POINTS = [EndPoint("pty", "/run/mic488", "Modbus RTU"), EndPoint("tcp", "127.0.0.1:5020", "Modbus TCP")]
REMARKS = ["non-volatile memory is lost at the end of this process (--state DIR keeps it)"]

READ_STATUS = bytes.fromhex("0001 0000 0006 01 03 271A 0004")
ENABLE = bytes.fromhex("0001 0000 0006 01 05 07D0 FF00")
MOVE_M1 = bytes.fromhex("0001 0000 000B 01 10 2764 0002 04 0000 42C8")  # to 100
MOVE_M2 = bytes.fromhex("0001 0000 000B 01 10 2766 0002 04 0000 42C8")
START = bytes.fromhex("0001 0000 0006 01 06 2713 0001")


def screen(run: Run, world: World, width: int, height: int, *requests: bytes, kind: str = "tcp") -> list[str]:
    """The screen two seconds after ``requests``, as a terminal of that size shows it."""

    async def scene() -> list[str]:
        live = LiveWorld(world)
        view = LiveView(live, RealTimeDriver(live, Clock()), Output(None))
        view.begin(banner(world, END_POINTS, REMARKS), {})
        port = ClientPort(live, LINE, "tcp-1", kind)
        for request in requests:
            port.exchange(request, 0)
        live.advance(2 * SECOND)
        console = Console(file=io.StringIO(), width=width, height=height)
        with console.capture() as shown:
            console.print(Group(page(view.lines(width, height))))
        return [text.rstrip() for text in shown.get().splitlines()]

    return run(scene())


def demo(*units: int) -> World:
    return World.from_toml(mic488_world(Whole(name="twin"), units or (1,), {}, demo=True))


def test_the_whole_screen(run: Run) -> None:
    assert screen(run, demo(), 80, 26, ENABLE, MOVE_M1, MOVE_M2, READ_STATUS) == [
        "twin: MIC488, unit 1, firmware 1.70   Ctrl-C ends",
        "  Modbus RTU  /run/mic488",
        "  Modbus TCP  127.0.0.1:5020",
        "  non-volatile memory is lost at the end of this process (--state DIR keeps it)",
        "",
        "mic488        2.0 s  ok",
        "program stopped",
        "           position        velocity         encoder   status",
        "M1         43.75 mm      25.00 mm/s             546   3 moving to position",
        "M2          0.00 mm       0.00 mm/s               0   0 off",
        "M3          0.00 mm       0.00 mm/s               0   0 off",
        "M4          0.00 mm       0.00 mm/s               0   0 off",
        "IN  1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20  AIN 0.00 V  0.00 V",
        "OUT 1 2 3 4 5 6 7 8   M1_EN M2_EN M3_EN M4_EN ERR",
        "data_type REAL  axis_control_mode DIRECT",
        "",
        "events",
        "    0.000000 s  mic488     position command ignored: M2 is not enabled",
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
        lines = screen(run, demo(), width, 24, ENABLE, MOVE_M1)
        assert max(map(len, lines)) <= width
        axes = [line for line in lines if line.startswith(("M1 ", "M2 ", "M3 ", "M4 "))]
        assert len(axes) == 4
        head = next(line for line in lines if "position" in line)
        shown = [name for name in ("position", "velocity", "encoder") if name in head]
        assert shown == ["position", "velocity", "encoder"][:columns]
        assert "3 moving" in axes[0] or width == 30


def test_low_terminals_are_never_overfilled(run: Run) -> None:
    for height in (10, 16, 20, 24, 60):
        lines = screen(run, demo(), 80, height, ENABLE, MOVE_M1, *[READ_STATUS] * 50)
        assert len(lines) <= height
    assert sum("M1_STATUS" in line for line in lines) == 60 - 17


def test_several_controllers_one_after_the_other_as_far_as_there_is_room(run: Run) -> None:
    high = screen(run, demo(1, 2, 5), 80, 50)
    assert [line.split()[0] for line in high if " s  ok" in line] == ["mic488-1", "mic488-2", "mic488-5"]
    low = screen(run, demo(1, 2, 5), 80, 24)
    assert [line.split()[0] for line in low if " s  ok" in line] == ["mic488-1"]
    assert "… and 2 more controllers: make the window higher" in low


def test_pulses_have_no_decimals(run: Run) -> None:
    world = World.from_toml(mic488_world(Whole(name="twin"), [1], {}))
    assert "M1            0 imp         0 imp/s               0   0 off" in screen(run, world, 80, 24)


def test_notices_are_among_the_events(run: Run) -> None:
    async def scene() -> list[str]:
        live = LiveWorld(demo())
        view = LiveView(live, RealTimeDriver(live, Clock()), Output(None))
        view.begin(banner(live.world, END_POINTS, REMARKS), {})
        for number in range(9):
            view.notice(f"notice {number}")
        return [text.plain for text in view.lines(80, 40)]

    shown = [line.partition(" s  ")[2] for line in run(scene()) if "notice" in line]
    assert shown == [f"notice {number}" for number in range(4, 9)]


def test_the_program_and_where_it_is(run: Run) -> None:
    text = mic488_world(Whole(name="twin"), [1], {"program": "wait.prg"})
    files = {"wait.prg": b"OUT1 = ON\nWAIT IN1 = ON\n"}
    assert "program stopped" in screen(run, World.from_toml(text, files), 80, 24)
    shown = screen(run, World.from_toml(text, files), 80, 24, START)
    assert "program running, wait.prg:2  WAIT IN1 = ON" in shown


def test_a_chip_its_memory_and_its_lines(run: Run) -> None:
    world = World.from_toml(m1486_world(Whole(name="twin"), [7], {"variant": "B"}))
    shown = screen(run, world, 80, 30, b"s70\ra1000\rf6400\ru16\rr\r", kind="raw")
    assert shown[shown.index("chip7        2.0 s  ok") + 1] == "program has nothing to do"
    assert "M1  6400 min. microsteps 0 min. microsteps/s  at rest" in shown
    assert any("counter 6400 min. microsteps" in line for line in shown)
    assert any("chip7" not in line and "U16" in line for line in shown)
    assert any(line.startswith("B   1 2 3") for line in shown)


def test_loads_that_are_not_where_their_drives_are(run: Run) -> None:
    axis = '\n[[axis]]\nname = "x"\ndrive = "mic488.M1"\nunit = "mm"\npitch = 5.0\nbacklash = 0.5\nstart = 120.0\n'
    world = World.from_toml(mic488_world(Whole(name="twin"), [1], {}) + axis)
    shown = screen(run, world, 80, 30)
    assert shown[shown.index("axis                   load") + 1] == "x                120.000 mm"
