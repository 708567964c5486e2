"""A program that jogs whenever it reads a line, and writes why each jog ended: ``jogging.py KIND ADDRESS BAUD threads|tasks``."""

from __future__ import annotations

import asyncio
import sys
from typing import Any

from steptwin.drivers import AsyncMic488, Mic488
from steptwin.drivers.m1486 import M1486, AsyncM1486, M1486Line
from steptwin.drivers.m1486.jog import AsyncM1486Jog
from steptwin.drivers.m1486.lines import AsyncM1486Line
from steptwin.errors import SteptwinError

SETTINGS = {"start_stop": 200, "acceleration": 5000, "velocity": 1000, "profile": 25000, "microstep": 1, "qualification": 1}
SPEED = 150.0


def _say(text: object) -> None:
    print(" ".join(str(text).split()), flush=True)


def _with_threads(kind: str, address: str, baud: int) -> None:
    def jog(begin: Any) -> None:
        _say("ready")
        for _ in sys.stdin:
            try:
                with begin() as held:
                    while held.hold():
                        pass
                _say(held.end)
            except SteptwinError as error:
                _say(error)

    if kind == "mic488":
        with Mic488(address) as mic:
            mic.enable(1)
            jog(lambda: mic.axis(1).jog(SPEED))
    else:
        with M1486Line(address, baud=baud) as line, M1486(line, 7, variant=kind) as chip:
            chip.configure(**SETTINGS)
            jog(lambda: chip.jog(SPEED))


async def _with_tasks(kind: str, address: str, baud: int) -> None:
    async def jog(begin: Any) -> None:
        _say("ready")
        while await asyncio.to_thread(sys.stdin.readline):
            try:
                async with begin() as held:
                    while await held.hold():
                        pass
                _say(held.end)
            except SteptwinError as error:
                _say(error)

    if kind == "mic488":
        async with AsyncMic488(address) as mic:
            await mic.enable(1)
            await jog(lambda: mic.axis(1).jog(SPEED))
    else:
        async with AsyncM1486Line(address, baud=baud) as line, AsyncM1486(line, 7, variant=kind) as chip:
            await chip.configure(**SETTINGS)  # type: ignore[arg-type]
            await jog(lambda: AsyncM1486Jog(chip, SPEED))


if __name__ == "__main__":
    kind, address, baud, way = sys.argv[1:]
    if way == "threads":
        _with_threads(kind, address, int(baud))
    else:
        asyncio.run(_with_tasks(kind, address, int(baud)))
