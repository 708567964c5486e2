"""Digests of the example worlds and of the world of all elements: the same with every Python, on every processor.

Regenerate with ``python tests/simulation/test_same_everywhere.py`` where behaviour has changed, and read what the change was.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from steptwin.files.world import World

FOLDERS = Path(__file__).parents[2] / "examples" / "worlds", Path(__file__).parent / "one_dimensional"
"""The examples, and worlds without keys of space."""
GOLDEN = Path(__file__).parent / "golden" / "digests.txt"
FAULTS = {
    "hoist": "worn-brake element=hold share=0.2",
    "pick_and_place_1d": "leak element=cup from_s=8.2 until_s=8.4",
    "pick_and_place": "leak element=cup from_s=8.2 until_s=8.4",
    "plotter": "stall machine=cell axis=3 at_s=4 for_s=0.5",
    "winder": "dead-motor element=reel from_s=8",
}
"""What makes more happen."""
RUN_S = 20


def names() -> list[str]:
    files = (file for folder in FOLDERS for file in folder.rglob("*.toml"))
    return sorted(file.stem for file in files if "[parameters]" not in file.read_text())


def digest(name: str) -> str:
    (file,) = (file for folder in FOLDERS for file in folder.rglob(f"{name}.toml"))
    with World.load(file, seed=7) as world:
        if name in FAULTS:
            world.fault(FAULTS[name])
        world.run(until=RUN_S)
        if world.now < RUN_S * 10**9:
            world.run(until=RUN_S)
        return world.trace.digest()


@pytest.mark.parametrize("name", names())
def test_the_digest_is_the_recorded_one(name: str) -> None:
    recorded = dict(line.split() for line in GOLDEN.read_text().splitlines())
    assert recorded.keys() == set(names())
    assert digest(name) == recorded[name]


if __name__ == "__main__":
    GOLDEN.write_text("".join(f"{name} {digest(name)}\n" for name in names()))
