"""``[[body]]``: a box or an upright cylinder that something carries: part of a machine, a table, a hand."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.components.builtobjects import BuiltObjects
from steptwin.simulation.components.element import Element
from steptwin.simulation.components.elementspec import ElementSpecs, NamedSpec, Reference
from steptwin.simulation.components.frames import Frames
from steptwin.simulation.components.mount import MountSpec, to_nm
from steptwin.simulation.components.quantity import TIME, check_condition, owners_of
from steptwin.simulation.components.signals import Idle, find_signal
from steptwin.simulation.logic.condition import SignalCondition
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.space.bodies import Body, Box, Cylinder, Shape, half_height
from steptwin.simulation.space.frames import AXES
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import name_value, number, permitting, text_value

LARGEST_MM = 100_000.0
_LENGTH = number(0.0, LARGEST_MM, above=True)


@permitting("[length, width, height] in mm, above 0")
def size_value(value: Any) -> tuple[float, float, float]:
    if not isinstance(value, list) or len(value) != len(AXES):
        raise Misuse(f"{value!r}: expected [length, width, height] in mm")
    x, y, z = map(_LENGTH, value)
    return x, y, z


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
    color: str | None = key(color_value, "of its picture: #RRGGBB", default=None)

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
        """Controllers and elements whose signals are in its condition."""
        return () if self.when is None else tuple(owner for owner in owners_of(self.when) if owner != TIME)

    def check(self, text: TomlText) -> None:
        if self.size is None and self.diameter is None:
            text.wrong(self.path, "D007", "a body needs size, or diameter and height")
        if self.when is not None:
            check_condition(text, self.path, self.name, self.when)


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


PRESENCE_CAN_ONLY_BE_WATCHED = Message(
    "simulation.presence-can-only-be-watched", "whether a body is there can be watched; conditions say themselves when it is"
)


class BuiltBody(NamedTuple):
    spec: BodySpec
    objects: BuiltObjects

    def signals(self) -> Mapping[str, SignalOf]:
        """Whether it is there, where that depends on anything."""
        if self.spec.when is None:
            return {}
        found: list[SignalOf | Idle] = []

        def signal(name: str) -> SignalOf | Idle:
            found.append(find_signal(self.objects, name))
            return found[-1]

        condition = SignalCondition(self.spec.when, signal)
        sources = tuple(dict.fromkeys(source for one in found if isinstance(one, SignalOf) for source in one.sources))
        return {"present": SignalOf(sources, lambda now: float(condition.holds(now)), check=_refuse_presence)}


def _refuse_presence() -> None:
    raise Misuse(PRESENCE_CAN_ONLY_BE_WATCHED())


def _refers(spec: BodySpec, described: ElementSpecs) -> Iterator[Reference]:
    """Nothing for one that stands on the floor, and is always there."""
    if spec.on is not None:
        yield Reference(spec.on, spec.on, (*spec.path, "on"))
    for owner in spec.owners:
        yield Reference(spec.on or spec.owners[0], owner, (*spec.path, "when"))


BODY: Element[BodySpec, BuiltBody] = Element(
    spec=BodySpec,
    refers=_refers,
    build=lambda spec, context: BuiltBody(spec, context.objects),
    signals=BuiltBody.signals,
    moves=lambda spec, body: (),
)
