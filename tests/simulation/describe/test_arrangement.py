"""``[[drawing]]`` of a description: read, checked, and replaced without changing anything else."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from steptwin.errors import Refusal
from steptwin.files.world import World
from steptwin.simulation.describe.arrangement import OTHERS, DrawnPosition, arranged
from steptwin.simulation.describe.description import read_world
from steptwin.simulation.toml.reader import WorldError
from steptwin.subject.world import WorldSubject

TEXT = """\
# a table
[[line]]
name = "bus"
kind = "modbus"

[[mic488]]
name = "table"
line = "bus"

[[axis]]
name = "x"
drive = "table.M1"
pitch = 4.0
# the end
"""


def test_places_are_written_read_replaced_and_removed() -> None:
    first = arranged(TEXT, [DrawnPosition("x", 10, 20), DrawnPosition("tool path", 0, 300)])
    assert first == TEXT + '\n[[drawing]]\nof = "x"\nat = [10, 20]\n\n[[drawing]]\nof = "tool path"\nat = [0, 300]\n'
    assert read_world("w", first).drawing == (DrawnPosition("x", 10, 20), DrawnPosition("tool path", 0, 300))
    second = arranged(first, [DrawnPosition("x", 30, 0)])
    assert read_world("w", second).drawing == (DrawnPosition("x", 30, 0),)
    assert arranged(second, []) == TEXT


def test_what_stands_after_them_stays() -> None:
    text = '[[drawing]] # by hand\nof = "x"\n# why\nat=[1,2]\n\n' + TEXT
    found = arranged(text, [DrawnPosition("x", 5, 6)])
    assert "# why" in found
    assert found.index("# a table") < found.index('of = "x"')
    assert {key: value for key, value in tomllib.loads(found).items() if key != "drawing"} == tomllib.loads(TEXT)


def test_keys_before_all_tables_stay() -> None:
    text = "at = [1, 2]\n" + TEXT
    assert arranged(arranged(text, [DrawnPosition("x", 5, 6)]), []) == text


def test_line_ends_stay() -> None:
    assert arranged(TEXT.replace("\n", "\r\n"), [DrawnPosition("x", 1, 2)]).count("\r\n") == TEXT.count("\n") + 4


@pytest.mark.parametrize("tables", ['drawing = [{of = "x", at = [1, 2]}]\n', '[[drawing]]\nof = "x"\nat = [\n1,\n2]\n'])
def test_tables_in_another_form_are_not_touched(tables: str) -> None:
    text = tables + TEXT if tables.startswith("drawing") else TEXT + tables
    with pytest.raises(Refusal, match="in another form: remove them first"):
        arranged(text, [DrawnPosition("x", 3, 4)])


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ('[[drawing]]\nof = "X"\nat = [0, 0]\n', "no axis or element is called 'X'"),
        ('[[drawing]]\nof = "x"\nat = [0, -1]\n', "-1: permitted are whole numbers from 0 to 20000"),
        ('[[drawing]]\nof = "x"\nat = [0]\n', r"\[0\]: expected \[x, y\]"),
        ('[[drawing]]\nof = "x"\nat = [0, 0]\n' * 2, "there is a \\[\\[drawing\\]\\] of 'x' already"),
        ("[drawing]\nx = 1\n", "drawing"),
    ],
)
def test_errors_have_their_place(tables: str, message: str) -> None:
    with pytest.raises(WorldError, match=message):
        read_world("w", TEXT + tables)


EXAMPLES = sorted((Path(__file__).parents[3] / "examples/worlds").glob("*/*.toml"))


@pytest.mark.parametrize("path", EXAMPLES, ids=[path.stem for path in EXAMPLES])
def test_everything_that_is_drawn_can_have_a_place(path: Path) -> None:
    text = path.read_text("utf-8")
    if "[parameters]" in text:
        pytest.skip("a file for [[use]]")

    def read(name: str) -> bytes:
        return (path.parent / name).read_bytes()

    shown = WorldSubject(World.load(path)).description
    names = [*(part.name for part in (*shown.axes, *shown.elements)), *OTHERS]
    places = tuple(DrawnPosition(name, 10 * n, n) for n, name in enumerate(names))
    assert read_world(path.stem, arranged(text, places), read=read).drawing == places
