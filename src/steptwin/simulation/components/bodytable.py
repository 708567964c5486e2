"""The table of a body: its keys, and its shape."""

from __future__ import annotations

import re
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
from steptwin.simulation.toml.values import flag, name_value, number, permitting, text_value

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
    model: str | None = key(
        model_value, "a file .stl (mm, z up) or .glb (m, y up) that is seen in three dimensions instead of it", default=None
    )
    lit: str | None = key(
        text_value, "the condition under which it shines, such as the output of a lamp, 'table.OUT3'", default=None
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
    def shape(self) -> Shape:
        return shape_of(self.size, self.diameter, self.height)

    @property
    def owners(self) -> tuple[str, ...]:
        """Controllers and elements whose signals say whether it is there."""
        return _owners(self.when)

    @property
    def lit_by(self) -> tuple[str, ...]:
        """Controllers and elements whose signals say whether it shines."""
        return _owners(self.lit)

    def check(self, text: TomlText) -> None:
        if self.size is None and self.diameter is None:
            text.wrong(self.path, "D007", "a body needs size, or diameter and height")
        for name, condition in (("when", self.when), ("lit", self.lit)):
            if condition is not None:
                check_condition(text, self.path, self.name, condition, name)


def _owners(condition: str | None) -> tuple[str, ...]:
    return () if condition is None else tuple(owner for owner in owners_of(condition) if owner != TIME)


def shape_of(size: tuple[float, float, float] | None, diameter: float | None, height: float | None) -> Shape:
    """Lengths, in mm, whose halves are whole nm."""
    if size is not None:
        x, y, z = (to_nm(one) // 2 for one in size)
        return Box((x, y, z))
    return Cylinder(to_nm(diameter or 0.0) // 2, to_nm(height or 0.0) // 2)


def body_of(spec: BodySpec, frames: Frames) -> Body:
    """The body in its frame."""
    shape = spec.shape
    return Body(spec.name, frames[spec.name].frame, shape, (0, 0, half_height(shape)))
