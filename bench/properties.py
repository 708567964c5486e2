"""What a property costs: processor time of runs with one and without, medians of pairs."""

from __future__ import annotations

import statistics
import time
from pathlib import Path

from bench.campaigns import WORLD
from steptwin.campaign.properties import read_property
from steptwin.files.world import World

HOIST = Path(__file__).parent.parent / "examples" / "worlds" / "hoist" / "hoist.toml"
PAIRS = 5
OF_SHUTTLE = ("always x.position < 600", "never table.IN2", "time between x.position > 10 and x.position < 5 <= 2 s")
OF_HOIST = (
    "always z.position < 700",
    "never-moves-while not hold.released",
    "after cell.M1.moving within 10 s not cell.M1.moving",
)


def _cost(first: World, text: str | None, seconds: float) -> float:
    world = World(first.blueprint, keep_trace=False, keep_inputs=False)
    begin = time.process_time()
    watch = None if text is None else read_property(text).watch(world)
    world.run(until=seconds)
    if watch is not None:
        watch.verdict()
    return time.process_time() - begin


def main() -> None:
    shuttle = World.from_toml(WORLD, keep_trace=False, keep_inputs=False)
    hoist = World.load(HOIST, keep_trace=False, keep_inputs=False)
    for name, world, texts, seconds in (("shuttle, 60 s", shuttle, OF_SHUTTLE, 60.0), ("hoist, 20 s", hoist, OF_HOIST, 20.0)):
        for text in texts:
            pairs = [(_cost(world, None, seconds), _cost(world, text, seconds)) for _ in range(PAIRS)]
            without, with_it = (statistics.median(column) for column in zip(*pairs, strict=True))
            print(f"{name}: {text}: {without * 1e3:.0f} ms, with it {with_it * 1e3:.0f} ms: {with_it / without - 1:+.0%}")


if __name__ == "__main__":
    main()
