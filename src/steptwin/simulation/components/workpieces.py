"""All workpieces in space, wherever they are: on belts, in cups and jaws, in nests, on bodies, on each other."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from math import inf
from typing import Any, NamedTuple, Protocol, TypeVar

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.simulation.components.mount import UPRIGHT, to_nm
from steptwin.simulation.mechanics.workpiece import Workpiece
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.space.bodies import Body, Box, Cylinder, Shape, half_height
from steptwin.simulation.space.frames import Frame, Joint, Vector, Z, pose
from steptwin.simulation.space.pieces import standing
from steptwin.simulation.space.sweeps import Sweep, Sweeps, SweptBody, meet, sweep
from steptwin.simulation.space.tops import top_below
from steptwin.simulation.toml.values import number, permitting

WORKPIECES = "workpieces"
"""Name by which sensors have all of them; the name of the part that has those which rest."""
REACH_NM = 2_000_000
"""Height from which a workpiece is put down. From higher up it falls. As far may it be pressed into what it is put on."""
SOON_NS = 4 * SECOND
"""Least time for which contacts with what moves without an end are looked for first: with most of that there is none by then."""
FEW_ENDLESS = 10
"""As many that move without an end are looked at at once: that costs less than to keep where they come soon."""


H = TypeVar("H")


class Lie(NamedTuple):
    """Where a workpiece is in a frame: the middle of its lower face, in nm, and its turn about z."""

    at: Vector
    yaw_q: float = 0.0


class Rest(NamedTuple):
    """A workpiece on an element, on another workpiece, or on the floor (empty)."""

    workpiece: Workpiece
    on: str
    lie: Lie


class Holder(Protocol):
    """Something that workpieces are on, or in."""

    @property
    def name(self) -> str:
        """The name by which others see its changes."""
        ...

    @property
    def scheduler(self) -> Scheduler:
        """The scheduler that it is in."""
        ...

    @property
    def sources(self) -> Iterable[str]:
        """Controllers and elements whose changes change where its workpieces are."""
        ...

    def version(self) -> object:
        """A value that changes whenever it has other workpieces, or has them elsewhere."""
        ...

    def bodies(self) -> Mapping[str, Body]:
        """Its workpieces by name: the same body while it stays where it is on its holder."""
        ...

    def supports(self) -> Iterable[Body]:
        """Bodies on which workpieces can be put, besides workpieces."""
        ...

    def take(self, name: str, now: Nanos) -> Workpiece:
        """A workpiece leaves it."""
        ...

    def put(self, workpiece: Workpiece, on: Body, lie: Lie, now: Nanos) -> bool:
        """Put a workpiece on one of its supports, in the frame of that. Whether it lies there: not where another one is in its
        way."""
        ...


_LENGTH = number(0.0, 100_000.0, above=True)


@permitting("[length, width, height] or [diameter, height], mm; or a number, for a cube")
def size_of_workpiece(value: Any) -> tuple[float, ...]:
    if isinstance(value, list) and len(value) in (2, 3):
        return tuple(map(_LENGTH, value))
    if isinstance(value, list):
        raise Misuse(f"{value!r}: expected [length, width, height] or [diameter, height], in mm")
    return (_LENGTH(value),) * 3


def workpiece_of(name: str, size: Sequence[float], mass: float, marks: tuple[tuple[int, int], ...] = ()) -> Workpiece:
    """``size`` in mm: of a box, or diameter and height of a cylinder."""
    lengths = [to_nm(one) for one in size]
    is_round = len(lengths) == 2
    length, width, height = (lengths[0], lengths[0], lengths[1]) if is_round else lengths
    return Workpiece(name, length, mass, marks, width, height, is_round)


def shape_of(workpiece: Workpiece) -> Shape:
    half = workpiece.height // 2
    return (
        Cylinder(workpiece.length // 2, half) if workpiece.is_round else Box((workpiece.length // 2, workpiece.width // 2, half))
    )


def body_in(workpiece: Workpiece, frame: Frame | None, lie: Lie) -> Body:
    """The body of a workpiece on a frame, which is a frame of its own: others may lie on it."""
    shape = shape_of(workpiece)
    turned = None if lie.yaw_q == 0.0 else Joint(standing(lie.yaw_q), UPRIGHT, turns=True)
    return Body(workpiece.name, Frame(workpiece.name, frame, lie.at, turned), shape, (0, 0, half_height(shape)))


def lie_in(frame: Frame, seen_from: Frame, now: Nanos) -> Lie:
    """Where a frame is in another one, if it is upright there."""
    at = pose(frame, seen_from, now)
    return Lie(at.at, at.angle_q if at.about == Z else 0.0)


class Below(NamedTuple):
    """Support on which a workpiece is put."""

    holder: Holder | None
    """Its holder; None for another workpiece."""
    body: Body
    gap: int
    """How far its top is below, nm; negative: the workpiece is pressed in."""


class Workpieces:
    """The workpieces of all holders, in the order in which these were built."""

    __slots__ = (
        "_bodies",
        "_endless",
        "_holder_of",
        "_is_soon_known",
        "_motions",
        "_order",
        "_plans",
        "_soon",
        "_supports",
        "_sweeps",
        "_swept",
        "_until",
        "_version",
        "falling",
        "holders",
        "moves",
    )

    def __init__(self) -> None:
        self.holders: list[Holder] = []
        self.falling: Callable[[], Collection[str]] = frozenset
        """Names of those that fall, and of those on them: nothing takes them, and nothing can be put on them."""
        self._version: object = None
        self._bodies: Mapping[str, Body] = {}
        self._holder_of: Mapping[str, Holder] = {}
        self._swept: dict[str, SweptBody] = {}
        self._sweeps = Sweeps()
        self._endless = 0
        """Count of those that move without an end along an axis."""
        self._soon = Sweeps()
        self._until: Nanos = 0
        """The moment up to which `_soon` says where they come, if `_is_soon_known`."""
        self._is_soon_known = False
        self._supports: dict[Body, SweptBody] = {}
        """Supports with where they may come."""
        self._order: Mapping[str, int] = {}
        self._motions: tuple[Callable[[], object], ...] = ()
        """The versions of all that moves them."""
        self._plans: list[object] | None = None
        self.moves = 0
        """Count that `follow` raises whenever one came or went, or moves in another way."""

    @property
    def sources(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(source for holder in self.holders for source in holder.sources))

    def of(self, kind: type[H]) -> list[H]:
        """The holders of one class."""
        return [one for one in self.holders if isinstance(one, kind)]

    def bodies(self) -> Mapping[str, Body]:
        """All of them by name: the same mapping while none is taken or put."""
        version = [holder.version() for holder in self.holders]
        if version != self._version:
            found = [(holder, holder.bodies()) for holder in self.holders]
            self._bodies = {name: body for _, bodies in found for name, body in bodies.items()}
            self._holder_of = {name: holder for holder, bodies in found for name in bodies}
            for name in [name for name, one in self._swept.items() if self._bodies.get(name) is not one.body]:
                del self._swept[name]
                self._sweeps.discard(name)
                self._soon.discard(name)
            self._order = {name: place for place, name in enumerate(self._bodies)}
            self._motions = tuple(dict.fromkeys(one for name in self._bodies for one in self.swept(name).versions))
            self._plans = None
            self._version = version
        return self._bodies

    def swept(self, name: str) -> SweptBody:
        """A workpiece, with where it may come before its plan changes."""
        known = self._swept.get(name)
        if known is None:
            known = self._swept[name] = SweptBody(self._bodies[name])
        return known

    def follow(self, now: Nanos) -> int:
        """Renew where they may come, and count in how many ways they have moved until now."""
        bodies = self.bodies()
        plans = [version() for version in self._motions]
        if plans != self._plans:
            self._plans = plans
            self.moves += 1
            for name in bodies:
                self._sweeps.put(name, self.swept(name).sweep(now))
            self._endless, self._is_soon_known = self._sweeps.endless, False
        return self.moves

    def near(self, its: Sweep) -> list[str]:
        """Those that may come there before the plan of one changes, in their order, as `follow` has found them."""
        return sorted(self._sweeps.near(its), key=self._order.__getitem__)

    def near_soon(self, its: Sweep, now: Nanos) -> tuple[list[str], Nanos | None]:
        """Those that may come there up to a moment, in their order, and that moment; None where no other ones come later."""
        if self._endless <= FEW_ENDLESS:
            return self.near(its), None
        if not now + SOON_NS <= self._until <= now + 2 * SOON_NS:
            self._until, self._is_soon_known = now + 2 * SOON_NS, False
        if not self._is_soon_known:
            self._is_soon_known = True
            for name in self._bodies:
                self._soon.put(name, self.swept(name).soon(now, self._until))
        return sorted(self._soon.near(its), key=self._order.__getitem__), self._until

    def forget(self) -> None:
        """Find them and where they may come anew: a snapshot was restored, and holders make other bodies."""
        self._version = None
        self._swept.clear()
        self._supports.clear()
        self._sweeps, self._soon = Sweeps(), Sweeps()

    def holder_of(self, name: str) -> Holder | None:
        """Holder of the workpiece called ``name``, if that is there."""
        self.bodies()
        return self._holder_of.get(name)

    def take(self, name: str, now: Nanos) -> Workpiece:
        """Take one from where it is."""
        self.bodies()
        return self._holder_of[name].take(name, now)

    def below(self, workpiece: str, frame: Frame, now: Nanos) -> Below | None:
        """Support of a workpiece whose lower face has its middle at the origin of a frame; None where nothing is."""
        (x, y, _), (its_x, its_y, z) = sweep(Body(workpiece, frame, Box((0, 0, 0))), now)
        below = Sweep((x, y, -inf), (its_x, its_y, z + REACH_NM))
        self.follow(now)
        bodies, falling = self.bodies(), self.falling()
        supports = {
            body.name: (holder, body)
            for holder in self.holders
            for body in holder.supports()
            if meet(below, self._supports.setdefault(body, SweptBody(body)).sweep(now))
        }
        there = {name: bodies[name] for name in self.near(below) if name != workpiece and name not in falling}
        others = {name: (None, body) for name, body in there.items() if not body.is_on(frame)}
        every = {**supports, **others}
        found = top_below((body for _, body in every.values()), frame, (0, 0, REACH_NM), now)
        return None if found is None else Below(every[found.body.name][0], found.body, found.gap - REACH_NM)
