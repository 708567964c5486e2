"""Worlds and snapshots go from one process to another, and go on there as here."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from steptwin.files.world import World
from steptwin.simulation.world.snapshot import SimulationSnapshot

EXAMPLES = Path(__file__).parents[2] / "examples" / "worlds"


def go_on(world: World, snapshot: SimulationSnapshot, until: float) -> tuple[str, str]:
    """The digests of a world that came from another process: as it goes on, and after it went back to a snapshot."""
    world.run(until=until)
    went_on = world.trace.digest()
    world.restore(snapshot)
    world.run(until=until)
    return went_on, world.trace.digest()


def test_a_world_and_its_snapshot_go_on_alike_in_another_process() -> None:
    with World.load(EXAMPLES / "press" / "press.toml") as world:
        world.fault("no-air element=ram from_s=2.1 until_s=2.15")
        world.run(until=2.0)
        snapshot = world.snapshot()
        world.run(until=3.0)
        with ProcessPoolExecutor(1, get_context("spawn")) as other:
            went_on, again = other.submit(go_on, world, snapshot, 5.0).result()
        world.run(until=5.0)
        assert (went_on, again) == (world.trace.digest(), world.trace.digest())
