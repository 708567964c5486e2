"""The example worlds: what it costs to load one, to restore a snapshot and to branch from it, in processor time; each restore and
branch is followed by a run.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from steptwin.errors import SteptwinError
from steptwin.files.world import World

EXAMPLES = Path(__file__).parent.parent / "examples" / "worlds"
RUNS = 40


def least_ms(action: Callable[[], World]) -> float:
    """The least processor time of an action that gives a world, ms."""
    found: list[float] = []
    for _ in range(RUNS):
        begin = time.process_time()
        world = action()
        found.append(time.process_time() - begin)
        world.run(for_="50 ms")
    return min(found) * 1e3


def measure(path: Path, world: World) -> str:
    world.run(for_="2 s")
    snapshot = world.snapshot()

    def restore() -> World:
        world.restore(snapshot)
        return world

    load, back, branch = (least_ms(one) for one in (lambda: World.load(path), restore, lambda: world.branch(snapshot)))
    return f"{path.stem:18}{load:8.2f}{back:9.2f}{branch:8.2f}  {branch / back:.1f} times a restore"


def main() -> None:
    print(f"{'ms':18}{'load':>8}{'restore':>9}{'branch':>8}")
    for path in sorted(EXAMPLES.rglob("*.toml")):
        with suppress(SteptwinError):  # of a piece of a description
            print(measure(path, World.load(path)))


if __name__ == "__main__":
    main()
