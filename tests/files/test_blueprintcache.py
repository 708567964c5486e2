"""Descriptions that are loaded again."""

from __future__ import annotations

from pathlib import Path

import pytest

from steptwin.errors import Misuse
from steptwin.files import blueprintcache
from steptwin.files.world import World

TEXT = '[[mic488]]\nname = "table"\nprogram = "loop.prg"\nstart = true\n'
PROGRAM = "LOOP:\nDELAY 0.1\nOUT1 = ON\nDELAY 0.1\nOUT1 = OFF\nJUMP LOOP\n"


@pytest.fixture
def cell(tmp_path: Path) -> Path:
    (tmp_path / "loop.prg").write_text(PROGRAM)
    path = tmp_path / "cell.toml"
    path.write_text(TEXT)
    return path


def digest(path: Path, **options: object) -> str:
    world = World.load(path, **options)  # type: ignore[arg-type]
    world.run(for_="1 s")
    return world.trace.digest()


def test_the_same_description_has_the_same_blueprint_and_worlds_of_their_own(cell: Path) -> None:
    one, other = World.load(cell), World.load(cell)
    assert one.blueprint is other.blueprint
    one.run(for_="1 s")
    assert other.time == 0.0
    other.run(for_="1 s")
    assert one.trace.digest() == other.trace.digest()


@pytest.mark.parametrize("options", [{"seed": 3}, {"overrides": {"table.start": False}}])
def test_other_options_are_another_description(cell: Path, options: dict[str, object]) -> None:
    assert World.load(cell, **options).blueprint is not World.load(cell).blueprint  # type: ignore[arg-type]


def test_a_change_of_the_description_or_of_its_files_is_seen(cell: Path) -> None:
    before = digest(cell)
    (cell.parent / "loop.prg").write_text(PROGRAM.replace("0.1", "0.2"))
    assert digest(cell) != before
    cell.write_text(TEXT.replace("start = true", "start = false"))
    assert digest(cell) != before


def test_a_file_that_is_gone_is_named_with_its_place(cell: Path) -> None:
    World.load(cell)
    (cell.parent / "loop.prg").unlink()
    with pytest.raises(Misuse, match=r"cell.toml:3:1: error D009: cannot read .*loop.prg"):
        World.load(cell)


def test_a_memory_that_lasts_is_read_each_time(cell: Path) -> None:
    with World.load(cell, state=cell.parent / "state") as world:
        kept = world.blueprint
    with World.load(cell, state=cell.parent / "state") as world:
        assert world.blueprint is not kept


def test_few_are_kept(cell: Path) -> None:
    for seed in range(2 * blueprintcache.MOST_KNOWN):
        World.load(cell, seed=seed)
    assert len(blueprintcache._KNOWN) == blueprintcache.MOST_KNOWN
