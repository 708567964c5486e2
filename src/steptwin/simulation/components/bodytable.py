"""The table of a body: its keys, and its shape."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from steptwin.errors import Misuse
from steptwin.simulation.components.elementspec import NamedSpec
from steptwin.simulation.components.frames import Frames
from steptwin.simulation.components.mount import MountSpec, to_nm
from steptwin.simulation.components.quantity import TIME, check_condition, owners_of
from steptwin.simulation.space.bodies import Body, Box, Cylinder, Shape, half_height
from steptwin.simulation.space.frames import AXES
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import flag, frame_name, name_value, number, permitting, text_value, word

LARGEST_MM = 100_000.0
_LENGTH = number(0.0, LARGEST_MM, above=True)


@permitting("[length, width, height] in mm, above 0")
def size_value(value: Any) -> tuple[float, float, float]:
    if not isinstance(value, list) or len(value) != len(AXES):
        raise Misuse(f"{value!r}: expected [length, width, height] in mm")
    x, y, z = map(_LENGTH, value)
    return x, y, z


@permitting("the name of a file .stl or .glb")
def model_value(value: Any) -> str:
    if not isinstance(value, str) or not value.lower().endswith((".stl", ".glb")):
        raise Misuse(f"{value!r}: expected the name of a file .stl or .glb")
    return value


_COLOR = re.compile(r"#[0-9A-Fa-f]{6}\Z")


@permitting("#RRGGBB")
def color_value(value: Any) -> str:
    if not isinstance(value, str) or not _COLOR.match(value):
        raise Misuse(f"{value!r}: expected a color such as '#c0392b'")
    return value


SHAPES = ("cylinder", "bottle", "cone", "funnel", "wheel")
"""Looks in pictures, within a box or an upright cylinder; `studio-web/src/lib/scene/shapes.ts` has their sections."""


@table("[[body]]")
class BodySpec(NamedSpec, MountSpec):
    """Its origin is the middle of its lower face."""

    name: str = key(name_value, "how others name it")
    size: tuple[float, float, float] | None = key(
        size_value, "of a box: [along x, along y, along z], mm", default=None, excludes=("diameter",)
    )
    diameter: float | None = key(_LENGTH, "of an upright cylinder, mm", default=None, needs="height")
    height: float | None = key(_LENGTH, "of an upright cylinder, mm", default=None, needs="diameter")
    when: str | None = key(text_value, "the condition under which it is there, such as 'door.position > 5'", default=None)
    pushes: bool = key(
        flag, "whether it pushes workpieces across belts that it moves across", default=False, needs="on", excludes=("when",)
    )
    color: str | None = key(color_value, "of its picture: #RRGGBB", default=None)
    shape: str | None = key(
        word(*SHAPES),
        "what it looks like within its size, about the side beside two equal ones; default a box, or a cylinder",
        default=None,
    )
    model: str | None = key(
        model_value, "a file .stl (mm, z up) or .glb (m, y up) that is seen in three dimensions instead of it", default=None
    )
    lit: str | None = key(
        text_value, "the condition under which it shines, such as the output of a lamp, 'table.OUT3'", default=None
    )
    draws: str | None = key(
        text_value,
        "the condition under which it leaves a line in pictures, at the middle of its lower face: a pen, a nozzle",
        default=None,
    )
    draws_on: str | None = key(
        frame_name, "the element with which the line goes on; without it, it stays where it is", default=None, needs="draws"
    )
    line_to: str | None = key(
        frame_name, "an element to which a line goes from its middle in pictures: a wire, a rope, a hose", default=None
    )

    @property
    def is_mounted(self) -> bool:
        """Always: it is nowhere else."""
        return True

    @property
    def holds_workpieces(self) -> bool:
        """Not where it comes and goes."""
        return self.when is None

    @property
    def owners(self) -> tuple[str, ...]:
        """Controllers and elements whose signals say whether it is there."""
        return () if self.when is None else tuple(condition_owners(self.when))

    @property
    def extent(self) -> Shape:
        return extent_of(self.size, self.diameter, self.height)

    @property
    def conditions(self) -> dict[str, str]:
        """By the keys that have one."""
        keys = {"when": self.when, "lit": self.lit, "draws": self.draws}
        return {name: text for name, text in keys.items() if text is not None}

    def check(self, text: TomlText) -> None:
        if self.size is None and self.diameter is None:
            text.wrong(self.path, "D007", "a body needs size, or diameter and height")
        for name, condition in self.conditions.items():
            check_condition(text, self.path, self.name, condition, name)


def condition_owners(condition: str) -> Iterator[str]:
    """Controllers and elements whose signals a condition has."""
    return (owner for owner in owners_of(condition) if owner != TIME)


def extent_of(size: tuple[float, float, float] | None, diameter: float | None, height: float | None) -> Shape:
    """Lengths, in mm, whose halves are whole nm."""
    if size is not None:
        x, y, z = (to_nm(one) // 2 for one in size)
        return Box((x, y, z))
    return Cylinder(to_nm(diameter or 0.0) // 2, to_nm(height or 0.0) // 2)


def body_of(spec: BodySpec, frames: Frames) -> Body:
    """The body in its frame."""
    extent = spec.extent
    return Body(spec.name, frames[spec.name].frame, extent, (0, 0, half_height(extent)))
