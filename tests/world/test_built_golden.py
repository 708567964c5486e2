"""What is built of descriptions before anything happens: mechanics, references, what is drawn and moved; golden/built.txt.

The worlds are those of golden/elements.txt. Regenerate with ``make golden ARGS=tests/world/test_built_golden.py`` and read the diff.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from steptwin.files.world import World
from steptwin.world.elements import ELEMENTS
from steptwin.world.elements.axis import AXIS

FOLDER = Path(__file__).parent / "golden"
GOLDEN, WORLDS = FOLDER / "built.txt", FOLDER / "elements.txt"
FILE = re.compile(r"^@ (.+)\n", re.MULTILINE)


def worlds() -> dict[str, World]:
    found = {}
    for case in WORLDS.read_text(encoding="utf-8").split("=== ")[1:]:
        name, _, body = case.partition("\n")
        text, *named = FILE.split(body.partition("---\n")[0])
        files = dict(zip(named[::2], (content.encode() for content in named[1::2]), strict=True))
        found[name.partition(",")[0]] = World.from_toml(text, files)
    return found


def described(world: World) -> Iterator[str]:
    yield f"kernels: {'; '.join(' '.join(names) for names in world.blueprint.joined or ())}"
    for name, axis in world.parts.built(AXIS).items():
        yield f"axis {name}: {axis.mechanism.build}, {float(axis.scale.pulses_per_unit):.12g} imp/{axis.scale.unit}"
    for element in ELEMENTS.values():
        for spec in world.spec.elements_of(element):
            refers = (f"{one.one}–{one.other} {'.'.join(map(str, one.path))}" for one in element.refers(spec, world.spec))
            yield f"{'.'.join(map(str, spec.path))}: {', '.join(refers)}"
        for name, built in world.parts.built(element).items():
            if element.drawing is not None:
                yield f"  {name} is drawn: {element.drawing(built)}"
            if element.moved is not None:
                yield from (f"  {name} is moved by {axis.spec.name}: {lane}" for axis, lane in element.moved(built))
    for kernel in world.kernels:
        for number, part in enumerate(kernel.parts):
            watched = sorted(name for name, numbers in kernel._watching.items() if number in numbers)
            yield f"part {number} {type(part).__name__} of {kernel._part_names[number]}: {' '.join(watched)}"


@pytest.fixture(scope="module")
def expected() -> dict[str, list[str]]:
    texts = GOLDEN.read_text(encoding="utf-8").split("=== ")[1:]
    return {name: lines for name, *lines in (text.rstrip("\n").splitlines() for text in texts)}


def test_what_is_built_is_the_reviewed(expected: dict[str, list[str]]) -> None:
    assert {name: [*described(world)] for name, world in worlds().items()} == expected


if __name__ == "__main__":
    texts = ("\n".join([f"=== {name}", *described(world)]) for name, world in worlds().items())
    GOLDEN.write_text("\n".join(texts) + "\n", encoding="utf-8")
