"""What a property costs: processor time of runs of the examples with one, with all of them, and without.

A run is as in a campaign: the world from its blueprint, 20 s, the verdict. Runs alternate, and the shortest of each counts: a
busy computer changes little. ``TURNS`` in the environment: how often.
"""

from __future__ import annotations

import gc
import os
import statistics
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from bench.campaigns import WORLD
from steptwin.campaign.properties import read_property, watch_together
from steptwin.files.world import World

EXAMPLES = Path(__file__).parent.parent / "examples" / "worlds"
SECONDS = 20.0
TURNS = int(os.environ.get("TURNS", "12"))


def _properties(world: World) -> Iterator[str]:
    """A place, an output, an answer in time, and two comparisons that meet."""
    controller = next(iter(world.controllers))
    sheet = world.kind(controller).datasheet(world.controllers[controller])
    moving = next(point.path for point in sheet.points if point.path.endswith("moving"))
    yield f"after {controller}.{moving} within 100 s not {controller}.{moving}"
    output = next((pin for pin in world.controllers[controller].pins() if pin.startswith("OUT")), None)
    if output is not None:
        yield f"count({controller}.{output}) < 100000"
    for axis in list(world.axes)[:1]:
        yield f"always {axis}.position < 100000"
        if output is not None:
            yield f"never ({axis}.position > 100000 and {controller}.{output})"


def _cost(first: World, texts: Sequence[str]) -> float:
    begin = time.process_time()
    world = World(first.blueprint, keep_trace=False, keep_inputs=False)
    watches = watch_together([read_property(text) for text in texts], world)
    world.run(until=SECONDS)
    for watch in watches:
        watch.verdict()
    return time.process_time() - begin


def main() -> None:
    worlds = {path.stem: World.load(path, keep_trace=False, keep_inputs=False) for path in _files()}
    worlds["nothing but an axis"] = World.from_toml(WORLD, keep_trace=False, keep_inputs=False)
    shares: list[float] = []
    together: list[float] = []
    for name, world in worlds.items():
        texts = list(_properties(world))
        kinds = [(), *((text,) for text in texts), tuple(texts)]
        least = dict.fromkeys(kinds, float("inf"))
        gc.disable()
        for _ in range(TURNS):
            for kind in kinds:
                least[kind] = min(least[kind], _cost(world, kind))
            gc.collect()
        gc.enable()
        without = least[()]
        for text in texts:
            shares.append(least[text,] / without - 1.0)
            print(f"{name}: {without * 1e3:.1f} ms, {shares[-1]:+.1%} with {text}", flush=True)
        together.append((least[tuple(texts)] / without - 1.0) / len(texts))
        print(f"{name}: {together[-1]:+.1%} for each of {len(texts)} together", flush=True)
    for what, found in (("one alone", shares), ("each of several", together)):
        median, below = statistics.median(found), sum(share < 0.1 for share in found)
        print(f"{what}: {min(found):.1%} to {max(found):.1%}, median {median:.1%}; {below} of {len(found)} below 10 %")


def _files() -> list[Path]:
    return sorted([*EXAMPLES.glob("*.toml"), *(path for path in EXAMPLES.glob("*/*.toml") if path.stem == path.parent.name)])


if __name__ == "__main__":
    main()
