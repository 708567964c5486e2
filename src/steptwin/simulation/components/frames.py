"""The frames of a world, by the names of the elements that have one."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.components.elementspec import ElementSpecs
from steptwin.simulation.components.mount import MountSpec, Movement
from steptwin.simulation.space.frames import Frame, Joint, path

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
        self._made: dict[str, Mounted] = {}
        self._movements: dict[Frame, Movement] = {}
        """Of the frames with a joint."""

    def add(self, name: str, moves: Callable[[], Sequence[Movement]]) -> None:
        """Add an element that was built. ``moves``: how it moves what is on it, outermost first."""
        self._moves[name] = moves

    def __getitem__(self, name: str) -> Mounted:
        if name not in self._made:
            if name not in self._places or name not in self._moves:
                raise Misuse(HAS_NO_PLACE(name=name))
            self._made[name] = self._make(name, self._places[name])
        return self._made[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)

    def _make(self, name: str, place: MountSpec) -> Mounted:
        on = None if place.on is None else self[place.on].frame
        frame = base = Frame(name, on, place.origin)
        movements = tuple(self._moves[name]())
        for n, one in enumerate(movements):
            # The first joint is at the origin of its element, each further one is on the one before.
            its = "" if n + 1 == len(movements) else f".{one.signal}"
            joint = Joint(one.motion, one.along, one.turns)
            frame = Frame(name + its, frame if n else on, (0, 0, 0) if n else place.origin, joint)
            self._movements[frame] = one
        return Mounted(self.described[name], place, base, frame, movements)

    def between(self, one: Frame, other: Frame) -> list[Movement]:
        """What moves two frames against each other."""
        return [self._movements[step.frame] for step in path(one, other) if step.frame in self._movements]


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


def sources_of(movements: Iterable[Movement]) -> tuple[str, ...]:
    """Controllers and elements that change these movements."""
    return tuple(dict.fromkeys(source for one in movements for source in one.sources))
