"""Worlds with values by chance do what they did before: golden/random.txt has digests of all that can be seen of each.

Regenerate with ``python tests/simulation/test_random_worlds.py`` where behaviour has changed. ``... NAME SEED`` shows a world
and what happens in it, so that its lines before and after a change can be compared.
"""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from chance import digest
from random_worlds import SCENES, seen, wrong

from steptwin.simulation.components.registry import ELEMENTS
from steptwin.simulation.describe.steptable import ACTIONS
from steptwin.simulation.faults.kinds import KINDS

GOLDEN = Path(__file__).parent / "golden" / "random.txt"
CASES = [(name, seed) for name in SCENES for seed in range(6)]
WRONG = [(name, seed) for name in SCENES for seed in range(2)]


def digests(name: str, seed: int) -> str:
    found = seen(name, seed)
    assert not [line for line in found["values"] if line.startswith(("it goes on", "something else"))]
    return " ".join(f"{what}={digest(lines)}" for what, lines in found.items())


def recorded(name: str, seed: int, what: str) -> str:
    head = f"{name} {seed} {what} "
    (found,) = (line for line in GOLDEN.read_text().splitlines() if line.startswith(head))
    return found.removeprefix(head)


@pytest.mark.parametrize(("name", "seed"), CASES)
def test_a_world_is_and_does_what_it_did(name: str, seed: int) -> None:
    assert digests(name, seed) == recorded(name, seed, "does")


@pytest.mark.parametrize(("name", "seed"), WRONG)
def test_what_is_told_of_mistakes_is_what_it_was(name: str, seed: int) -> None:
    assert digest(wrong(name, seed)) == recorded(name, seed, "tells")


def test_everything_is_in_one_of_them() -> None:
    tables = "\n".join(scene.tables for scene in SCENES.values())
    steps = "\n".join(scene.tables + scene.steps for scene in SCENES.values())
    assert [name for name in ELEMENTS if f"[[{name}]]" not in tables] == []
    assert [name for name in KINDS if name not in tables] == []
    assert [name for name in ACTIONS if f"{{ {name} = " not in steps] == []


if __name__ == "__main__":
    if sys.argv[1:]:
        name, seed = sys.argv[1], int(sys.argv[2])
        for what, lines in (seen(name, seed) | {"mistakes": wrong(name, seed)}).items():
            print(f"--- {what}", *lines, sep="\n")
    else:
        does = [f"{name} {seed} does {digests(name, seed)}\n" for name, seed in CASES]
        tells = [f"{name} {seed} tells {digest(wrong(name, seed))}\n" for name, seed in WRONG]
        GOLDEN.write_text("".join((*does, *tells)))
