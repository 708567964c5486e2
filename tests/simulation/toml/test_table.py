from typing import Any

import pytest

from steptwin.errors import Misuse
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.table import TableSpec, key, read_spec, table, table_in, tables_in
from steptwin.simulation.toml.values import flag, number, whole, word
from steptwin.tables import IncompleteTable


@table()
class Painted(TableSpec):
    coat: int = key(whole(1, 9), "how many coats", default=1, order=1)
    colour: str = key(word("red", "green"), "of paint", default="red")


@table("[house.roof]")
class Roof(Painted):
    angle: float = key(number(0.0, 90.0), "degrees", kinds=("gabled",))


@table("[[house.door]]")
class Door(TableSpec):
    wide: float = key(number(0.0), "m", name="width")
    glass: bool = key(flag, "whether it has a pane", default=False)
    wired: bool = key(flag, "whether the pane is reinforced", default=False, needs="glass")
    steel: bool = key(flag, "whether it is of steel", default=False, excludes=("glass",))

    def check(self, text: TomlText) -> None:
        if self.wide > 3.0:
            text.wrong((*self.path, "width"), "D007", f"{self.wide:g} m is a gate")


@table("[house]")
class House(TableSpec):
    kind: str = key(word("flat", "gabled"), "of roof", default="gabled")
    roof: Roof | None = table_in("roof", Roof)
    doors: tuple[Door, ...] = tables_in("door", Door)


def _read(written: str) -> tuple[House | None, list[str]]:
    text = TomlText("house.toml", written)
    found = read_spec(text, ("house",), House, text.data["house"])
    return found, [f"{one.code} {one.message}" for one in text.findings]


def test_a_table_and_the_tables_in_it_become_values() -> None:
    found, wrong = _read(
        "[house]\nroof.angle = 30\n[[house.door]]\nwidth = 1\n[[house.door]]\nwidth = 2\nglass = true\nwired = true"
    )
    assert not wrong
    assert found == House(
        path=("house",),
        kind="gabled",
        roof=Roof(path=("house", "roof"), coat=1, colour="red", angle=30.0),
        doors=(
            Door(path=("house", "door", 0), wide=1.0),
            Door(path=("house", "door", 1), wide=2.0, glass=True, wired=True),
        ),
    )


def test_a_table_stands_for_a_list_of_one() -> None:
    found, wrong = _read("[house]\n[house.door]\nwidth = 4")
    assert wrong == ["D007 4 m is a gate"]
    assert found is not None
    assert found.roof is None
    assert len(found.doors) == 1


@pytest.mark.parametrize(
    ("written", "wrong"),
    [
        ("roof = {}", "D005 [house.roof]: angle is missing"),
        ("kind = 'flat'\nroof.angle = 1", "D007 angle means nothing for kind = 'flat'"),
        ("kind = 'round'\nroof.angle = 1", "D003 [house]: kind: 'round': permitted are flat, gabled"),
        (
            "roof = { angle = 1, colour = 'gren' }",
            "D003 [house.roof]: colour: 'gren' (did you mean 'green'?): permitted are red, green",
        ),
        ("door = [{ width = 1, wired = true }]", "D007 wired means nothing without glass"),
        ("door = [{ width = 1, steel = true, glass = true }]", "D007 glass and steel exclude each other"),
        (
            "door = [{ wide = 1 }]",
            "D004 [house.door] has no 'wide' | D005 [house.door]: width is missing",
        ),
        ("window = 1", "D004 [house] has no 'window'"),
    ],
)
def test_what_is_wrong_is_reported(written: str, wrong: str) -> None:
    assert " | ".join(_read(f"[house]\n{written}")[1]) == wrong


def test_keys_of_base_classes_precede_unless_their_order_says_otherwise() -> None:
    assert [one.name for one in Roof.rows.keys] == ["colour", "angle", "coat"]


def _with(**fields: Any) -> None:
    types = dict.fromkeys(fields, Any)
    table("[x]")(type("X", (TableSpec,), {**fields, "__annotations__": types}))


def test_rules_name_keys_that_there_are() -> None:
    with pytest.raises(IncompleteTable, match=r"\[x\] has no key b"):
        _with(a=key(flag, "?", default=False, needs="b"))
    with pytest.raises(Misuse, match=r"\[x\]: two keys have one name"):
        _with(a=key(flag, "?", default=False), b=key(flag, "!", default=False, name="a"))
