"""Each element in a world that is restored: the same digest as without. Compositions of them: `test_random_compositions.py`."""

from __future__ import annotations

import re

import pytest
from compositions import BASE, PARTS, PROGRAM

from steptwin.files.world import World
from steptwin.simulation.components.registry import ELEMENTS


def test_every_element_is_among_them() -> None:
    there = {table for text in (BASE, *PARTS) for table in re.findall(r"^\[\[([a-z]+)\]\]", text, re.MULTILINE)}
    assert set(ELEMENTS) <= there


@pytest.mark.parametrize("number", range(len(PARTS)))
def test_each_can_be_restored(number: int) -> None:
    text = BASE + PARTS[number]
    found, other = (World.from_toml(text, {"p.prg": PROGRAM}) for _ in range(2))
    for moment in (0.71, 1.503):
        found.run(until=moment)
        snapshot = found.snapshot()
        found.run(until=moment + 0.2)
        other.restore(snapshot)
        other.run(until=moment + 0.2)
        assert other.trace.digest() == found.trace.digest()
