"""Worlds with values by chance: they go on alike from a snapshot and from the past, and their mistakes are found."""

from __future__ import annotations

import pytest
from random_worlds import SCENES, check_it_goes_on_alike, check_mistakes_are_found

from steptwin.simulation.components.registry import ELEMENTS
from steptwin.simulation.describe.steptable import ACTIONS
from steptwin.simulation.faults.kinds import KINDS


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("name", SCENES)
def test_a_world_goes_on_alike(name: str, seed: int) -> None:
    check_it_goes_on_alike(name, seed)


@pytest.mark.parametrize("name", SCENES)
def test_a_description_without_an_error_can_be_built_and_no_other(name: str) -> None:
    check_mistakes_are_found(name, seed=1)


def test_everything_is_in_one_of_them() -> None:
    tables = "\n".join(scene.tables for scene in SCENES.values())
    steps = "\n".join(scene.tables + scene.steps for scene in SCENES.values())
    assert [name for name in ELEMENTS if f"[[{name}]]" not in tables] == []
    assert [name for name in KINDS if name not in tables] == []
    assert [name for name in ACTIONS if f"{{ {name} = " not in steps] == []
