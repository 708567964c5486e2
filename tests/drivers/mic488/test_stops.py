"""After a stop of a MIC488 nothing begins that was asked for before it: motions, moments, and drivers for threads and tasks."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import Any

import pytest
from host_rig import Wire, async_driver, run_virtual, task_line, thread_line
from mic488_rig import loaded

from steptwin.drivers import AsyncMic488
from steptwin.drivers.blocking import finish
from steptwin.errors import SteptwinError

OPERATIONS: dict[str, Callable[[AsyncMic488], Awaitable[Any]]] = {
    "move": lambda mic: mic.axis(1).move_by(100.0),
    "endless": lambda mic: mic.axis(1).move_velocity(10.0),
    "jog_bit": lambda mic: mic.axis(1).jog_bit(1, True),
    "home": lambda mic: mic.axis(1).home(-5.0),
    "together": lambda mic: mic.move_together_by({1: 50.0, 2: 20.0}),
    "program": lambda mic: mic.program.start(),
}
STOPS: dict[str, Callable[[AsyncMic488], Awaitable[Any]]] = {
    "axis": lambda mic: mic.axis(1).stop(),
    "controller": lambda mic: mic.stop_all(),
    "program": lambda mic: mic.program.stop(),
}
PROGRAM = "M1 = ON\nA:\nPREL M1 40\nWAITPOS\nPREL M1 -40\nWAITPOS\nJUMP A\n"
MOMENTS_S = (0.0, 0.0004, 0.0012, 0.02, 0.3)
"""At once, while the request and its answer are on their way, and after that."""


def _stops(asked: str) -> tuple[str, ...]:
    """A stop of an axis leaves the other one, and that of a controller the program."""
    return {"program": ("program",), "together": ("controller",)}.get(asked, ("axis", "controller"))


def _trial(asked: str, stop: str, way: str, delay_s: float) -> str | None:
    """What was wrong; None if nothing was."""
    wire = Wire()
    wire.twin.load_program(0, loaded(PROGRAM)[0])
    line: Any = thread_line(wire) if way == "threads" else task_line(wire)
    mic = async_driver(line, wire)

    def positions() -> list[int]:
        return [wire.position(axis) for axis in (1, 2)]

    async def work() -> list[int]:
        await mic.open()
        await mic.enable()
        asking = asyncio.ensure_future(OPERATIONS[asked](mic)) if way == "tasks together" else None
        if asking is None:
            await OPERATIONS[asked](mic)
        await line.sleep(delay_s)
        await STOPS[stop](mic)
        stood = positions()
        if asking is not None:
            with suppress(SteptwinError):  # it says that a stop was requested meanwhile
                await asking
        return stood

    stood = finish(work()) if way == "threads" else run_virtual(wire, work())
    wire.rest(20.0)
    if positions() == stood and not wire.moving(1):
        return None
    return f"{asked}, {way}, stopped ({stop}) after {delay_s:g} s: it stood at {stood}, then at {positions()}"


@pytest.mark.parametrize("way", ["threads", "tasks", "tasks together"])
@pytest.mark.parametrize("asked", OPERATIONS)
def test_nothing_begins_after_a_stop_that_was_asked_for_before_it(asked: str, way: str) -> None:
    """``together``: one task asks, and another one stops it at a moment since then."""
    wrong = [fault for stop in _stops(asked) for delay_s in MOMENTS_S if (fault := _trial(asked, stop, way, delay_s)) is not None]
    assert not wrong, "\n".join(wrong)
