"""Places in the text of a description: found, changed without changing anything else, and refused where they are not theirs."""

from __future__ import annotations

from pathlib import Path

import pytest

from steptwin.errors import Misuse, Refusal
from steptwin.files.world import read_beside
from steptwin.simulation.components.mount import places
from steptwin.simulation.describe.description import read_world
from steptwin.simulation.describe.placement import placing

EXAMPLES = Path(__file__).parents[3] / "examples" / "worlds"
TEXT = """\
[[mic488]]
name = "table"
[[axis]]
name = "x"   # a rail
drive = "table.M1"
pitch = 4.0
along = "+y"
[[carriage]]
name = "slide"
axis = "x"
frequency = 8.0
[[body]]
name = "head"
on = "slide"
at = [ 0, 12.5,   # beside it
       30.0 ]  # above
size = [10, 10, 10]
"""


def test_only_the_numbers_that_differ_are_written() -> None:
    spec = read_world("w", TEXT)
    here = placing(spec, TEXT, "head")
    assert (here.at, here.line, here.old, here.text) == ((0.0, 12.5, 30.0), 15, here.new, TEXT)
    found = placing(spec, TEXT, "head", (-5, 12.5, 40.0))
    assert (
        found.text == TEXT.replace("[ 0, 12.5,", "[ -5, 12.5,").replace("30.0 ]", "40.0 ]") == TEXT.replace(found.old, found.new)
    )
    assert placing(spec, found.text, "head", here.at).text == TEXT


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_place_that_is_not_written_becomes_a_line(end: str) -> None:
    text = TEXT.replace("\n", end)
    found = placing(read_world("w", text), text, "x", (0.1, 0, 250))
    assert found[:4] == ((0.0, 0.0, 0.0), 5, "", "at = [0.1, 0, 250]")
    assert found.text == text.replace("# a rail", f"# a rail{end}at = [0.1, 0, 250]")


@pytest.mark.parametrize("path", sorted(EXAMPLES.rglob("*.toml")), ids=lambda path: path.stem)
def test_every_place_of_the_examples_is_found_or_refused(path: Path) -> None:
    text = path.read_text("utf-8")
    if "[parameters]" in text:
        return
    spec = read_world(path.name, text, read=lambda name: read_beside(path.parent, name))
    for name, its in places(spec.elements.mounts).items():
        if its is not spec.elements.mounts[name]:
            with pytest.raises(Refusal, match=f"{name} has no place of its own"):
                placing(spec, text, name)
            continue
        if spec.text.place(its.path)[1] is not None:
            with pytest.raises(Refusal, match=rf"of {name} is in line \d+ of parts/.*\[\[use\]\] in line \d+"):
                placing(spec, text, name)
            continue
        (x, y, z) = placing(spec, text, name).at
        moved = placing(spec, text, name, (x + 1, y, z - 2.5)).text
        assert placing(spec, moved, name).at == (x + 1, y, z - 2.5)
        assert len(set(moved.splitlines()) - set(text.splitlines())) == 1


def test_what_has_no_place_of_its_own_is_refused() -> None:
    spec = read_world("w", TEXT)
    with pytest.raises(Refusal, match="slide has no place of its own: it stands where x is"):
        placing(spec, TEXT, "slide")
    with pytest.raises(Misuse, match="'table' has no place in space"):
        placing(spec, TEXT, "table")
    with pytest.raises(Refusal, match="another one than that of this machine"):
        placing(spec, TEXT.replace('"head"', '"other"'), "head")
    with pytest.raises(Refusal, match="another one than that of this machine"):
        placing(spec, "[[body", "head")


def test_what_is_written_in_another_form_is_refused() -> None:
    """A new line would end a table that stands in one."""
    text = (
        TEXT[: TEXT.index("[[body]]")]
        + 'body = [{ name = "head", size = [1, 1, 1] }, { name = "tip", on = "head", size = [1, 1, 1] }]\n'
    )
    text = text[text.index("body =") :] + text[: text.index("body =")]
    spec = read_world("w", text)
    with pytest.raises(Refusal, match=r"another form than \[\[body\]\]"):
        placing(spec, text, "head", (1, 0, 0))
