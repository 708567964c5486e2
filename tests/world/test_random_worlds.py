"""Worlds with values by chance do what they did before: golden/random.txt has digests of all that can be seen of each.

Regenerate with ``python tests/world/test_random_worlds.py`` where behaviour has changed. ``... NAME SEED`` shows a world and what
happens in it, so that its lines before and after a change can be compared.
"""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from random_worlds import SCENES, digest, seen

from steptwin.world.elements import ELEMENTS
from steptwin.world.faults.kinds import KINDS
from steptwin.world.steptable import ACTIONS

GOLDEN = Path(__file__).parent / "golden" / "random.txt"
SEEDS = 6
CASES = [(name, seed) for name in SCENES for seed in range(SEEDS)]


def digests(name: str, seed: int) -> str:
    found = seen(name, seed)
    assert not [line for line in found["values"] if line.startswith(("it goes on", "something else"))]
    return " ".join(f"{what}={digest(lines)}" for what, lines in found.items())


@pytest.mark.parametrize(("name", "seed"), CASES)
def test_a_world_is_and_does_what_it_did(name: str, seed: int) -> None:
    recorded = {tuple(line.split()[:2]): line.split(maxsplit=2)[2] for line in GOLDEN.read_text().splitlines()}
    assert digests(name, seed) == recorded[name, str(seed)]


def test_everything_is_in_one_of_them() -> None:
    tables = "\n".join(scene.tables for scene in SCENES.values())
    steps = "\n".join(scene.tables + scene.steps for scene in SCENES.values())
    assert [name for name in ELEMENTS if f"[[{name}]]" not in tables] == []
    assert [name for name in KINDS if name not in tables] == []
    assert [name for name in ACTIONS if f"{{ {name} = " not in steps] == ["fault", "clear_fault"]  # of each fault


if __name__ == "__main__":
    if sys.argv[1:]:
        for what, lines in seen(sys.argv[1], int(sys.argv[2])).items():
            print(f"--- {what}", *lines, sep="\n")
    else:
        GOLDEN.write_text("".join(f"{name} {seed} {digests(name, seed)}\n" for name, seed in CASES))
