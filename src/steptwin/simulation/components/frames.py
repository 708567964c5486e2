"""The frames of a world, by the names of the elements that have one."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.components.elementspec import ElementSpecs
from steptwin.simulation.components.mount import MountSpec, Movement, places
from steptwin.simulation.space.bodies import Body
from steptwin.simulation.space.frames import AXES, Frame, Joint, Z, path
from steptwin.simulation.toml.names import Unknown

HAS_NO_PLACE = Message("simulation.has-no-place", "{name!r} has no place in space: give it on, at or along")


class Mounted(NamedTuple):
    """An element in space. ``frame`` carries what is on it; ``base`` is where it stands, before it moves anything."""

    spec: MountSpec
    place: MountSpec
    """The table that says where it is: its own, or that of another element."""
    base: Frame
    frame: Frame
    movements: tuple[Movement, ...]


class Frames(Mapping[str, Mounted]):
    """All elements with a place in space, in the order of the description. An element that carries another one has one, too.

    Frames are made when they are first asked for, after all elements were built. Raises `Misuse` for an element without a place,
    or whose unit is none of a place.
    """

    def __init__(self, described: ElementSpecs) -> None:
        self.described = described.mounts
        self._places = places(self.described)
        self._moves: dict[str, Callable[[], Sequence[Movement]]] = {}
        self._bases: dict[str, Frame] = {}
        self._made: dict[str, Mounted] = {}
        self._movements: dict[Frame, Movement] = {}
        """Movements by the frames with a joint."""

    def add(self, name: str, moves: Callable[[], Sequence[Movement]]) -> None:
        """Add an element that was built. ``moves``: how it moves what is on it, outermost first."""
        self._moves[name] = moves

    def __getitem__(self, name: str) -> Mounted:
        if name not in self._made:
            self._made[name] = self._make(name)
        return self._made[name]

    def base(self, name: str) -> Frame:
        """Where an element stands, which may not be built yet."""
        if name not in self._bases:
            place = self._places.get(name)
            if place is None:
                raise Misuse(HAS_NO_PLACE(name=name))
            self._bases[name] = Frame(name, None if place.on is None else self[place.on].frame, place.origin)
        return self._bases[name]

    def __contains__(self, name: object) -> bool:
        return name in self._places

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)

    def _make(self, name: str) -> Mounted:
        frame = base = self.base(name)
        if name not in self._moves and self.described[name].moves_others:
            raise Unknown(name, HAS_NO_PLACE(name=name))
        place, movements = self._places[name], tuple(self._moves[name]()) if name in self._moves else ()
        for n, one in enumerate(movements):
            # The first joint is at the origin of its element, each further one is on the one before.
            its = "" if n + 1 == len(movements) else f".{one.signal}"
            joint = Joint(one.motion, one.along, one.turns, f"{name}.{one.signal}", one.per_unit)
            frame = Frame(name + its, frame if n else base.on, (0, 0, 0) if n else place.origin, joint)
            self._movements[frame] = one
        return Mounted(self.described[name], place, base, frame, movements)

    def between(self, one: Frame, other: Frame) -> list[Movement]:
        """Movements of two frames against each other."""
        return [self._movements[step.frame] for step in path(one, other) if step.frame in self._movements]

    def movement(self, frame: Frame) -> Movement | None:
        """Movement of a frame with a joint, if an element moves it."""
        return self._movements.get(frame)

    def carrying(self, frame: Frame) -> list[Movement]:
        """Movements of a frame, up to the floor."""
        return [self._movements[one] for one in frame.line() if one in self._movements]


TILTS = Message("simulation.tilts", "{name!r} turns about {axis}: what has to do with workpieces only turns about z")


def tilting_axis(frame: Frame) -> int | None:
    """The axis about which a frame turns, up to the floor, so that it is not always upright; None: it is."""
    joints = (one.joint for one in frame.line() if one.joint is not None and one.joint.turns)
    return next((joint.along.axis for joint in joints if joint.along.axis != Z), None)


def check_upright(name: str, frame: Frame) -> None:
    """Raise `Misuse` for what does not stay upright: workpieces may lie at any angle about z, and turns are only compared where
    they are about one direction."""
    axis = tilting_axis(frame)
    if axis is not None:
        raise Misuse(TILTS(name=name, axis=AXES[axis]))


NO_BODIES = Message("simulation.carries-no-bodies", "{name!r} is no [[body]], and carries none")


def bodies_on(mounted: Mounted, bodies: Mapping[str, Body], name: str) -> list[str]:
    """The names of the bodies that the element ``name`` carries, and its own if it is one. Raises `Misuse` if there is none."""
    found = [other for other, body in bodies.items() if body.is_on(mounted.frame)]
    if not found:
        raise Misuse(NO_BODIES(name=name))
    return found


def sources_of(movements: Iterable[Movement]) -> tuple[str, ...]:
    """Controllers and elements that change these movements."""
    return tuple(dict.fromkeys(source for one in movements for source in one.sources))
