"""A stop at a moment after something was asked of a chip, by a driver or by commands for a twin: what begins behind it."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import Any

from chip_rig import ChipWire, chip_line, chip_task_line
from line_rig import run_virtual

from steptwin.controller import SECOND, Nanos
from steptwin.drivers.blocking import finish
from steptwin.drivers.m1486 import AsyncM1486
from steptwin.errors import SteptwinError
from steptwin.files.world import World
from steptwin.simulation.script.control import Seek
from steptwin.simulation.world.inputs import Download
from steptwin.simulation.world.motions import ordered
from steptwin.subject import commands as command
from steptwin.subject.payloads import StatusPayload
from steptwin.subject.subscriptions import filter_of
from steptwin.subject.world import WorldSubject

FAMILIES = ("A", "B", "C", "E1", "E2")
ASKED = ("move", "jog", "seek", "program")
WAYS = ("threads", "tasks", "tasks together", "control", "control over a slow line", "stop_all")
BY_DRIVER = WAYS[:3]
"""``together``: one task asks, and another one stops it at a moment since then."""
PROGRAM = "[\n@5\nF6400\nR\nW50\nB6400\nR\nJ5\n]"
QUIET_S = 4.0
"""Longer than everything that may be under way takes to begin, a program at 300 bit/s excepted."""
ANSWERED_S = 150.0
"""An E type that was stopped while a program was typed is reset."""
BEGINS = ("moves", "seeks")


def trial(family: str, asked: str, way: str, delay_s: float) -> str | None:
    """What was wrong; None if nothing was."""
    stopped_at, begun, is_at_rest = _by_driver(family, asked, way, delay_s) if way in BY_DRIVER else _by_command(
        family, asked, way, delay_s
    )  # fmt: skip
    late = [at for at in begun if at > stopped_at]
    what = f"M1486{family}, {asked}, {way}, stopped after {delay_s:g} s"
    if late:
        return f"{what}: a motion began {(late[0] - stopped_at) / SECOND:.3f} s behind the stop"
    return None if is_at_rest else f"{what}: it moves on"


# ---------------------------------------------------------------------- by a driver


OPERATIONS: dict[str, Callable[[AsyncM1486], Awaitable[Any]]] = {
    "move": lambda chip: chip.move_by(2000.0),
    "jog": lambda chip: chip.run(1),
    "seek": lambda chip: chip.seek(1, 1),
    "program": lambda chip: chip.download(PROGRAM),
}


def _by_driver(family: str, asked: str, way: str, delay_s: float) -> tuple[Nanos, list[Nanos], bool]:
    wire = ChipWire(family, (7,))
    line: Any = chip_line(wire) if way == "threads" else chip_task_line(wire)
    chip = AsyncM1486(line, 7)

    async def work() -> Nanos:
        await chip.open()
        if way != "tasks together":
            await OPERATIONS[asked](chip)
        asking = asyncio.ensure_future(OPERATIONS[asked](chip)) if way == "tasks together" else None
        await line.sleep(delay_s)
        await chip.stop()
        stopped = line.now()
        if asking is not None:
            with suppress(SteptwinError):  # it says that a stop was requested meanwhile
                async with asyncio.timeout(ANSWERED_S):
                    await asking
        return stopped

    stopped_at = finish(work()) if way == "threads" else run_virtual(wire, work())
    # The process has died: nothing is sent any more.
    wire.sleep(QUIET_S)
    return stopped_at, [event.time for _, event in wire.happened if event.code in BEGINS], not wire.moving(7)


# ---------------------------------------------------------------------- by commands for a twin


WORLD = """
[[line]]
name = "chips"
kind = "m1486"
{timing}
[[m1486]]
name = "drum"
line = "chips"
address = 7
variant = "{family}"
"""


def _by_command(family: str, asked: str, way: str, delay_s: float) -> tuple[Nanos, list[Nanos], bool]:
    timing = 'timing = "real"\nbaud = 300' if way == "control over a slow line" else ""
    world = World.from_toml(WORLD.format(family=family, timing=timing))
    subject = WorldSubject(world)
    followed = subject.subscribe(filter_of(["status"]), 100_000)
    match asked:
        case "move":
            subject.do(command.Move("drum", 1, by=128_000.0))
        case "jog":
            subject.do(command.Jog("drum", 1, 64_000.0))
        case "seek":
            world.apply_input(ordered(world, Seek("drum", 1, 1, "B1")))
        case _:
            subject.do(Download("drum", "program", PROGRAM))
    world.advance(world.now + round(delay_s * SECOND))
    world.sync_all()
    subject.do(command.StopAll() if way == "stop_all" else command.StopAxes("drum"))
    stopped_at = world.now
    world.advance(stopped_at + round(QUIET_S * SECOND))
    world.sync_all()
    events = followed.take().events
    begun = [event.time for event in events if isinstance(event.payload, StatusPayload) and event.payload.code in BEGINS]
    return stopped_at, begun, world.read("drum.moving") == 0.0
