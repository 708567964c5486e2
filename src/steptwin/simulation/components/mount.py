"""Where elements are in space: the element that carries one, its origin there, and the direction in which it carries others.

An element that is mounted has a frame (`steptwin.simulation.space`), which is at its origin while the element is at position 0.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from math import floor
from typing import Any, NamedTuple, TypeAlias

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.simulation.mechanics.scale import exact_fraction
from steptwin.simulation.space.frames import AXES, NM_PER_MM, Direction, Vector, X, Z
from steptwin.simulation.space.pieces import Motion
from steptwin.simulation.toml.table import TableSpec, key, table
from steptwin.simulation.toml.values import frame_name, number, permitting

FARTHEST_MM = 100_000.0
_COORDINATE = number(-FARTHEST_MM, FARTHEST_MM)


def to_nm(mm: float) -> int:
    """The whole nm nearest to a length as it is written."""
    return floor(exact_fraction(mm) * NM_PER_MM + Fraction(1, 2))


@permitting("[x, y, z] in mm")
def point(value: Any) -> Vector:
    """A point, in nm."""
    if not isinstance(value, list) or len(value) != len(AXES):
        raise Misuse(f"{value!r}: expected [x, y, z] in mm")
    x, y, z = (to_nm(_COORDINATE(one)) for one in value)
    return x, y, z


FORWARD, UPRIGHT = Direction(X, 1), Direction(Z, 1)
DIRECTIONS = {str(one): one for axis in range(len(AXES)) for one in (Direction(axis, 1), Direction(axis, -1))}


@permitting(", ".join(DIRECTIONS), tuple(DIRECTIONS))
def direction(value: Any) -> Direction:
    found = DIRECTIONS.get(value) if isinstance(value, str) else None
    if found is None:
        raise Misuse(f"{value!r}: permitted are {', '.join(DIRECTIONS)}")
    return found


@table()
class MountSpec(TableSpec):
    """Where an element is in space. It is only there if one of these keys is given, or another element is on it."""

    on: str | None = key(frame_name, "the element that carries it; without it the floor does", default=None, order=2)
    at: Vector | None = key(point, "[x, y, z] of its origin on that element, mm; default [0, 0, 0]", default=None, order=2)

    @property
    def holds_workpieces(self) -> bool:
        """Whether workpieces may be on it, or in it."""
        return False

    @property
    def moves_others(self) -> bool:
        """Whether it may move what is on it. Otherwise that has its place before it is built."""
        return False

    @property
    def is_mounted(self) -> bool:
        return self.on is not None or self.at is not None

    @property
    def origin(self) -> Vector:
        return self.at or (0, 0, 0)

    @property
    def mounted_as(self) -> str | None:
        """The element whose place it has where none of its own keys is given."""
        return None


@table()
class MoverSpec(MountSpec):
    """An element that moves what is on it along one direction, or turns it about one."""

    along: Direction | None = key(
        direction,
        "direction in which it moves what is on it, or about which it turns: +x, -z ...; default +x, of turns +z",
        default=None,
        order=2,
    )

    @property
    def moves_others(self) -> bool:
        return True

    @property
    def is_mounted(self) -> bool:
        return self.along is not None or super().is_mounted

    def towards(self, usual: Direction = FORWARD) -> Direction:
        return self.along or usual


Block: TypeAlias = Callable[[bool, Nanos, str], None]
"""Lets a drive stand while something blocks it: whether it does, when, and its name."""


class Movement(NamedTuple):
    """How an element moves what is on it, by one of its signals."""

    signal: str
    """The name of its position: ``position``, ``angle``."""
    motion: Motion
    """nm, or quarter turns."""
    along: Direction
    per_unit: float
    """mm, or degrees, for a unit of the signal."""
    blocks: tuple[Block, ...]
    """Blocks its drives."""
    sources: tuple[str, ...]
    """Controllers and elements whose changes change the motion."""
    turns: bool = False
    travel: tuple[float, float] | None = None
    """Where the signal may be, if that is known."""
    heading: Callable[[Nanos], int] = lambda now: 0
    """The way in which its drive is to move, +1 or -1, also while something blocks it; 0: not known, or none."""


def places(mounts: Mapping[str, MountSpec]) -> dict[str, MountSpec]:
    """The tables that say where elements are, by the names of those that have a place."""
    carrying = {its.on for its in mounts.values()}
    found: dict[str, MountSpec] = {}
    for name, its in mounts.items():
        other = None if its.is_mounted or its.mounted_as is None else mounts.get(its.mounted_as)
        place = other or its
        if place.is_mounted or name in carrying:
            found[name] = place
    return found
