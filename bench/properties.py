"""What a property costs: processor time of runs of the examples with one and without, medians of pairs."""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterator
from pathlib import Path

from bench.campaigns import WORLD
from steptwin.campaign.properties import read_property
from steptwin.files.world import World

EXAMPLES = Path(__file__).parent.parent / "examples" / "worlds"
SECONDS = 20.0
PAIRS = 5


def _properties(world: World) -> Iterator[str]:
    """A place, an output, an answer in time, and two comparisons that meet."""
    machine = next(iter(world.machines))
    sheet = world.kind(machine).datasheet(world.machines[machine])
    moving = next(point.path for point in sheet.points if point.path.endswith("moving"))
    yield f"after {machine}.{moving} within 100 s not {machine}.{moving}"
    output = next((pin for pin in world.machines[machine].pins() if pin.startswith("OUT")), None)
    if output is not None:
        yield f"count({machine}.{output}) < 100000"
    for axis in list(world.axes)[:1]:
        yield f"always {axis}.position < 100000"
        if output is not None:
            yield f"never ({axis}.position > 100000 and {machine}.{output})"


def _cost(first: World, text: str | None) -> float:
    world = World(first.blueprint, keep_trace=False, keep_inputs=False)
    begin = time.process_time()
    watch = None if text is None else read_property(text).watch(world)
    world.run(until=SECONDS)
    if watch is not None:
        watch.verdict()
    return time.process_time() - begin


def main() -> None:
    worlds = {path.stem: World.load(path, keep_trace=False, keep_inputs=False) for path in _files()}
    worlds["nothing but an axis"] = World.from_toml(WORLD, keep_trace=False, keep_inputs=False)
    shares: list[float] = []
    for name, world in worlds.items():
        for text in _properties(world):
            pairs = [(_cost(world, None), _cost(world, text)) for _ in range(PAIRS)]
            without = statistics.median(one for one, _ in pairs)
            shares.append(statistics.median(other / one for one, other in pairs) - 1.0)
            print(f"{name}: {without * 1e3:.0f} ms, {shares[-1]:+.0%} with {text}")
    print(f"median {statistics.median(shares):.0%}, {sum(share < 0.1 for share in shares)} of {len(shares)} below 10 %")


def _files() -> list[Path]:
    return sorted([*EXAMPLES.glob("*.toml"), *(path for path in EXAMPLES.glob("*/*.toml") if path.stem == path.parent.name)])


if __name__ == "__main__":
    main()
