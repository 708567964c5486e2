"""A key that does nothing beside the others of its table is refused: of all elements, one rule.

What a world reads of its tables is recorded while it is built, described and run. A key that nothing has read does nothing there,
so giving it is an error; but for those that are read when something happens.
"""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Iterator, Mapping
from typing import Any

import pytest

from steptwin.files.world import World
from steptwin.simulation.components.registry import ELEMENTS
from steptwin.simulation.toml.reader import Key, WorldError
from steptwin.subject.describe import describe

LATER = {
    "axis": {"mm_per_unit"},  # when something is on it
    "conveyor": {"feed_waits", "mass", "marks"},
    "cylinder": {"switching"},
    "vacuum": {"threshold", "build_up", "release"},
}
"""Keys that are read when something comes, or is switched."""
OTHER_FORMS = """
[[mic488]]
name = "c"
[[axis]]
name = "x"
drive = "c.M1"
pitch = 5.0
[[axis]]
name = "y"
drive = "c.M2"
pitch = 5.0
[axis.encoder]
counts_per_unit = 10
[axis.motor]
torque = [[0, 1.0]]
start_speed = 60
[[load]]
name = "weight"
axis = "y"
mass = 1
[[conveyor]]
name = "driven"
axis = "x"
length = 200
[[conveyor]]
name = "placed"
speed = 100
length = 200
at = [0, 300, 0]
[[integrator]]
name = "level"
rate = "c.OUT1"
[[cylinder]]
name = "z"
extend = "c.OUT2"
at = [0, 0, 200]
along = "-z"
[[gripper]]
name = "hand"
close = "c.OUT3"
on = "z"
[[vacuum]]
name = "free"
ejector = "c.OUT3"
[[vacuum]]
name = "placed-cup"
ejector = "c.OUT3"
on = "z"
at = [100, 0, 0]
[[gripper]]
name = "fixed"
close = "c.OUT3"
"""
VALUES = {"pick": "c.OUT1", "place": "c.OUT1"}
"""Of keys without a default."""


@pytest.fixture
def reads(monkeypatch: pytest.MonkeyPatch) -> Mapping[int, set[str]]:
    """What is read of tables, by their `id`, but by their own checks."""
    found: defaultdict[int, set[str]] = defaultdict(set)

    def read(spec: object, name: str) -> Any:
        if sys._getframe(1).f_code.co_name not in ("check", "__eq__", "__hash__"):
            found[id(spec)].add(name)
        return object.__getattribute__(spec, name)

    for element in ELEMENTS.values():
        monkeypatch.setattr(element.spec, "__getattribute__", read, raising=False)
    return found


def idle(world: World, reads: Mapping[int, set[str]]) -> Iterator[tuple[str, Key]]:
    describe(world)
    world.run(for_=0.6)
    for kind, element in ELEMENTS.items():
        for spec in element.named(world.spec.elements[kind]):
            for key in element.rows.keys:
                if (key.attribute or key.name) not in reads[id(spec)] and key.name not in LATER.get(kind, ()):
                    yield spec.name, key


def is_refused(name: str, key: Key) -> bool:
    value = VALUES.get(key.name, key.default)
    try:
        World.from_toml(OTHER_FORMS, overrides={f"{name}.{key.name}": list(value) if isinstance(value, tuple) else value})
    except WorldError as error:
        return key.name in str(error)
    return False


def test_a_key_that_nothing_reads_is_refused(reads: Mapping[int, set[str]]) -> None:
    found = [*idle(World.from_toml(OTHER_FORMS), reads)]
    assert found
    assert [f"{name}.{key.name}" for name, key in found if not is_refused(name, key)] == []
