"""Operations of the M1486 driver in a process that is suspended in the middle of them."""

from __future__ import annotations

import contextlib
from collections.abc import Awaitable, Callable
from typing import Any

from chip_rig import ChipWire, chip_line, chip_task_line
from suspension import AT_THE_LAST_MOMENT, Suspension

from steptwin.drivers.blocking import finish
from steptwin.drivers.m1486 import AsyncM1486
from steptwin.drivers.m1486.jog import AsyncM1486Jog
from steptwin.errors import SteptwinError

SETTINGS = {"start_stop": 200, "acceleration": 5000, "velocity": 1000, "profile": 25000, "microstep": 1, "qualification": 1}
AWAY_S = 70.0
"""Longer than any time the driver knows."""
NOT_HELD_S = 0.41
"""Longer than a jog goes on without being held, and than one of its moves takes."""
RACE_U = 30 * 64
"""Minimum microsteps that a motor makes which was started too late and is stopped at once: 0.15 s at 200 steps/s."""


async def _move_and_wait(chip: AsyncM1486) -> None:
    await chip.move_by(500.0)
    await chip.wait()


async def _jog(chip: AsyncM1486) -> None:
    async with AsyncM1486Jog(chip, 400.0) as jog:
        for _ in range(3):
            if not await jog.hold():
                break


OPERATIONS: dict[str, Callable[[AsyncM1486], Awaitable[Any]]] = {
    "move_to": lambda chip: chip.move_to(500.0),
    "move_by": lambda chip: chip.move_by(500.0),
    "run": lambda chip: chip.run(1),
    "seek": lambda chip: chip.seek(1, 1),
    "move and wait": _move_and_wait,
    "jog": _jog,
    "run_block": lambda chip: chip.run_block(["f640", "r"]),
    "start_program": lambda chip: chip.start_program(3),
    "download": lambda chip: chip.download("[\nF640\nR\n]"),
    "download of commands": lambda chip: chip.download("F640\nR"),
    "recover": lambda chip: chip.recover(),
}


def trial(name: str, at: int | None, *, tasks: bool, away_s: float = AWAY_S) -> tuple[int, str]:
    """Do an operation with a suspension at point ``at``: how many points it has, and what was wrong."""
    wire = ChipWire(addresses=(7,))
    suspension = Suspension(wire, away_s)
    line: Any = suspension.task(chip_task_line(wire)) if tasks else suspension.thread(chip_line(wire))
    chip = AsyncM1486(line, 7)
    stood: list[int] = []

    def note() -> None:
        if name == "jog" and away_s < AWAY_S and wire.true(7) == 0:
            return  # it may begin so late, but not begin again
        if not wire.moving(7):
            stood.append(wire.true(7))

    async def work() -> None:
        await chip.open()
        await chip.configure(**SETTINGS)  # type: ignore[arg-type]
        if name == "recover":
            # A program that Kill holds, because function 51 is OFF; it moves once it is let go on.
            await chip.set_function(51, False)
            await chip.download("[\n@3\nF64000\nR\nJ3\n]")
            await line.sleep(0.3)
            await chip.stop()
            await line.sleep(3.0)
        if name == "start_program":
            await chip.download("[\nJ4\n@3\nF640\nR\n@5\nW1000\nJ5\n@4\n]")
            await chip.wait()
        suspension.on_back = note
        suspension.arm(at)
        with contextlib.suppress(SteptwinError):
            await OPERATIONS[name](chip)

    if tasks:
        suspension.run(work())
    else:
        finish(work())
    points = suspension.count
    if at is None:
        assert wire.moving(7) or wire.true(7), f"{name} moves nothing"
    if not stood:
        return points, ""
    suspension.at = None
    last_moment = suspension.what in AT_THE_LAST_MOMENT
    # Nothing that was typed stays in the chip, for the next CR on the line to carry out.
    wire.send(b"\r")
    wire.sleep(20.0)
    moved = abs(wire.true(7) - stood[0])
    if moved > (RACE_U if last_moment else 0):
        return points, f"{name}, suspended {suspension.what} (point {at}): moved by {moved} min. microsteps"
    return points, ""
