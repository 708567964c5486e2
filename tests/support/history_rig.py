"""A subject in memory whose past is kept, with a wall clock of its own."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from pathlib import Path

from gateway_rig import GatewayWorld

from steptwin.history.database import engine_of, read_url, upgrade
from steptwin.history.recorder import Recorder, WallAndSteady
from steptwin.history.rows import PointRow, RowBatch, RunHead
from steptwin.history.writing import TableWriter
from steptwin.subject import commands as command
from steptwin.subject.contract import Result

BEGAN_US = 1_800_000_000_000_000


class _GoingWorld(GatewayWorld):
    """A world whose time goes on as the wall clock does."""

    async def do(self, wanted: command.Command, /) -> Result:
        result = await super().do(wanted)
        if isinstance(wanted, command.Time):
            return result._replace(value={**result.value, "paused": False, "speed": 1.0})
        return result


class RecordedWorld:
    """A world, its recorder, and what came of it. The wall clock goes with the time of the world, from `BEGAN_US` on."""

    def __init__(self, text: str, registers: Mapping[str, Sequence[str]] | None = None, dead_band: float = 0.0) -> None:
        self.subject = _GoingWorld(text)
        self.world = self.subject.world
        self.late_us = 0
        """By which both clocks are before the time of the world."""
        self.set_us = 0
        """By which the wall clock has been set forward."""
        clock = WallAndSteady(self.wall_us, self.steady_us)
        self.recorder = Recorder(self.subject, registers or {}, clock=clock, dead_band=dead_band)
        self.heads = [asyncio.run(self.recorder.begin())]
        self.batches: list[RowBatch] = []

    def wall_us(self) -> int:
        return BEGAN_US + self.world.now // 1000 + self.late_us + self.set_us

    def steady_us(self) -> int:
        return self.world.now // 1000 + self.late_us

    def look(self, *, has_room: bool = True) -> list[RowBatch]:
        found = asyncio.run(self.recorder.look(has_room=has_room))
        self.heads += [one for one in found if isinstance(one, RunHead)]
        batches = [one for one in found if isinstance(one, RowBatch)]
        self.batches += batches
        return batches

    def run(self, seconds: float, every_s: float = 0.1) -> None:
        for _ in range(round(seconds / every_s)):
            self.world.run(for_=every_s)
            self.look()

    def end(self) -> None:
        self.look()
        self.batches.append(self.recorder.end())
        self.recorder.close()

    def rows(self, kind: str, name: str) -> list[tuple[float, object]]:
        """(time in s, value or plan) of a point, of all batches."""
        number = [point.name for point in self.heads[0].points].index(name)
        found = [row for batch in self.batches for row in getattr(batch, kind) if row.point == number]
        return [(row.time / 1e9, row[3]) for row in found]

    def written(self, url: str, folder: Path = Path()) -> None:
        """Into a database."""
        write(url, folder, self.heads, self.batches)


def write(url: str, folder: Path, heads: Sequence[RunHead], batches: Sequence[RowBatch]) -> None:
    address = read_url(url, folder)
    engine = engine_of(address)
    writer = TableWriter()
    with engine.begin() as connection:
        upgrade(connection, address)
        for head in heads:
            writer.write(connection, head, [batch for batch in batches if batch.run == head.key])
    engine.dispose()


def head(key: str = "one", points: int = 3) -> RunHead:
    rows = tuple(PointRow(f"table.p{number}", "mm", "number") for number in range(points))
    return RunHead(key=key, subject="cell", is_virtual=True, began_ns=0, began_us=BEGAN_US, points=rows)
