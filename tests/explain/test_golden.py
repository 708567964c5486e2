"""Explanations as users read them. ``python tests/explain/test_golden.py`` makes the files anew: read their diff."""

from __future__ import annotations

import json
import re
from contextlib import chdir
from pathlib import Path

import pytest

from steptwin.cli.explain import explanations
from steptwin.explain.jsondata import to_json
from steptwin.explain.picture import picture
from steptwin.explain.text import text

REPOSITORY = Path(__file__).parents[2]
GOLDEN = Path(__file__).parent / "golden"
EXAMPLES = REPOSITORY / "examples"
CASES = {
    "feeder.txt": EXAMPLES / "mic488" / "feeder.prg",
    "pick_and_place.txt": EXAMPLES / "mic488" / "pick_and_place.prg",
    "traps.txt": GOLDEN / "traps.prg",
    "traps.json": GOLDEN / "traps.prg",
    "waits.txt": GOLDEN / "waits.prg",
    "chip_waits.txt": GOLDEN / "chip_waits.m1486",
    "chain.txt": EXAMPLES / "m1486" / "example6.m1486",
    "chip_traps.txt": GOLDEN / "chip_traps.m1486",
    "chip_traps.json": GOLDEN / "chip_traps.m1486",
}
INNERMOST = re.compile(r"[\[{]\n[^\[\]{}]*[\]}]")
"""Objects and lists without others in them: they are one line."""
PICTURE = REPOSITORY / "docs" / "images" / "explain-feeder.svg"
"""The picture of docs/explain.md."""


def made(name: str) -> str:
    path = CASES[name]
    found = explanations(path, {})
    if name.endswith(".json"):
        written = json.dumps([to_json(one) for one in found], ensure_ascii=False, indent=1) + "\n"
        return INNERMOST.sub(lambda match: " ".join(match[0].split()), written)
    return "\n".join(text(one) for one in found).replace(str(path), path.name)


def made_picture() -> str:
    path = CASES["feeder.txt"]
    with chdir(path.parent):  # the width depends on the title, in which the path is
        return picture(explanations(Path(path.name), {}))


@pytest.mark.parametrize("name", CASES)
def test_an_explanation(name: str) -> None:
    assert made(name) == (GOLDEN / name).read_text(encoding="utf-8")


def test_the_picture_of_the_documentation() -> None:
    assert made_picture() == PICTURE.read_text(encoding="utf-8")


if __name__ == "__main__":
    for name in CASES:
        (GOLDEN / name).write_text(made(name), encoding="utf-8")
    PICTURE.write_text(made_picture(), encoding="utf-8")
