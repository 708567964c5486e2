"""Taking workpieces in space: a suction cup takes what closes it, jaws take what is between them.

Of several that hold the same workpiece the first has it. When that lets go of it, the next one takes it over where it is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from math import floor
from typing import ClassVar, NamedTuple, TypeAlias

from steptwin.controller import Nanos
from steptwin.messages import Message
from steptwin.motion.trig import cosine, sine
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.frames import check_upright, sources_of
from steptwin.simulation.components.probe import Probe
from steptwin.simulation.components.resting import resting_of
from steptwin.simulation.components.workpieces import REACH_NM, Lie, body_in, lie_in
from steptwin.simulation.mechanics.workpiece import Workpiece
from steptwin.simulation.scheduler.scheduler import Scheduler, TerminalBlock
from steptwin.simulation.space.bodies import Body, Box, Cylinder, half_height
from steptwin.simulation.space.frames import NM_PER_MM, Direction, Frame
from steptwin.simulation.space.tops import height_over
from steptwin.state import Plain, Stateful

HOLDS = Message("simulation.cup-holds-workpiece", "{cup} holds {workpiece}")
LETS_GO = Message("simulation.cup-lets-go-of-workpiece", "{cup} lets go of {workpiece}")


Draw: TypeAlias = Callable[[Lie, Body], Lie]


class Held(NamedTuple):
    """A workpiece and where it is in the frame of what holds it."""

    workpiece: Workpiece
    lie: Lie


class Grasp(Stateful):
    """A `steptwin.simulation.components.workpieces.Holder` of one workpiece, with those that lie on it.

    Jaws take one that their probe meets; a cup one whose top face closes it and meets its probe.
    """

    FIXED: ClassVar[tuple[str, ...]] = (
        "_block",
        "_body",
        "_draw",
        "_frame",
        "_frames",
        "_inside",
        "_probe",
        "_radius",
        "_resting",
        "_workpieces",
    )
    __slots__ = (*FIXED, "_held", "_holds", "dropped")

    def __init__(self, block: TerminalBlock, context: ElementContext, probe: Body, draw: Draw, radius: int | None = None) -> None:
        """``draw``: where a workpiece is when it is held, of where it was in the frame of the probe. ``radius``: of a cup, nm."""
        self._block = block
        check_upright(block.name, probe.frame)
        self._frames = context.frames
        self._frame = probe.frame
        self._workpieces = context.objects.workpieces
        self._resting = resting_of(context, block.scheduler)
        self._draw = draw
        self._radius = radius or 0
        self._inside: Probe | None = None
        """Meets what a cup is deeper in than it may be pressed."""
        if radius is None:
            self._probe = Probe(probe, {}, self._workpieces)
        else:
            self._probe = Probe(probe, {}, self._workpieces, lambda body: _closing(body, radius))
            deep = Body(probe.name, probe.frame, Box((0, 0, 1)), (0, 0, REACH_NM + 1))
            self._inside = Probe(deep, {}, self._workpieces)
        self._holds = False
        """Whether it takes what it meets, also when another one lets go of that."""
        self._held: Held | None = None
        self._body: tuple[Held, Body] | None = None
        self.dropped = 0
        self._workpieces.holders.append(self)

    # ------------------------------------------------------------------ what it meets

    def met(self, now: Nanos) -> Body | None:
        """The workpiece that it would take: the highest, then the first by name."""
        bodies, falling = self._workpieces.bodies(), self._workpieces.falling()
        there = (name for name in self._probe.met(now) if name not in falling)
        tops = [(height_over(bodies[name], self._frame, (0, 0, 0), now, self._radius), name) for name in there]
        found = min(((top, name) for top, name in tops if top is not None), default=None)
        return None if found is None or (self._inside is not None and self._inside.holds(now)) else bodies[found[1]]

    def width_of(self, body: Body, along: Direction, now: Nanos) -> Fraction:
        """mm of a workpiece in a direction of its frame."""
        shape = body.shape
        if not isinstance(shape, Box):
            return Fraction(2 * shape.radius, NM_PER_MM)
        angle_q = lie_in(body.frame, self._frame, now).yaw_q - along.axis
        width = abs(cosine(angle_q)) * shape.half[0] + abs(sine(angle_q)) * shape.half[1]
        return Fraction(2 * floor(width + 0.5), NM_PER_MM)

    def is_met(self, now: Nanos) -> bool:
        return self.met(now) is not None

    def change(self, now: Nanos) -> Nanos | None:
        changes = [self._probe.change(now)]
        if self._inside is not None and self._probe.holds(now):
            changes.append(self._inside.change(now))
        return min((change for change in changes if change is not None), default=None)

    @property
    def depends_on(self) -> Callable[[], Iterable[str]]:
        """Names of parts that change where it is, or where workpieces are; known when all that has some is there."""
        return lambda: (*self.sources, *self._workpieces.sources)

    # ------------------------------------------------------------------ holding

    @property
    def name(self) -> str:
        return self._block.name

    @property
    def frame(self) -> Frame:
        return self._frame

    @property
    def workpiece(self) -> Workpiece | None:
        return None if self._held is None else self._held.workpiece

    @property
    def mass(self) -> float:
        held = self.workpiece
        return 0.0 if held is None else held.mass + self._resting.mass_on(held.name)

    def hold(self, now: Nanos) -> None:
        """Take what it meets, unless another one has it."""
        self._holds = True
        body = self.met(now)
        if body is not None and not any(body.name in one.bodies() for one in self._others()):
            self._take(body, self._draw(lie_in(body.frame, self._frame, now), body), now)

    def release(self, now: Nanos) -> None:
        """Let go of what it has. Another one that holds it, too, takes it over; else it lies on what is below it, or falls."""
        self._holds = False
        if self._held is not None:
            workpiece, body = self._held.workpiece, self._workpieces.bodies()[self._held.workpiece.name]
            self.report(LETS_GO(cup=self.name, workpiece=workpiece.name), workpiece.name, "released")
            following = next(
                (one for one in self._others() if one.workpiece is None and one._holds and one.met(now) is body), None
            )
            if following is not None:
                following._take(body, lie_in(body.frame, following.frame, now), now)
                return
            self._held = None
            if not self._resting.release(workpiece, body.frame, now):
                self.dropped += 1

    def _others(self) -> Iterable[Grasp]:
        return (one for one in self._workpieces.of(Grasp) if one is not self)

    def _take(self, body: Body, lie: Lie, now: Nanos) -> None:
        self._held = Held(self._workpieces.take(body.name, now), lie)
        self.report(HOLDS(cup=self.name, workpiece=body.name), body.name, "held")

    def report(self, text: str, name: str, what: str) -> None:
        """Record an event with a workpiece."""
        block = self._block
        facts = ("workpiece", name), ("element", block.name), ("what", what)
        block.scheduler.record(block.scheduler.owner(block.name), "event", "workpiece", text, *facts)
        block.scheduler.notify(block.name)

    # ------------------------------------------------------------------ a holder

    @property
    def scheduler(self) -> Scheduler:
        return self._block.scheduler

    @property
    def sources(self) -> Iterable[str]:
        return (self._block.name, *sources_of(self._frames.carrying(self._frame)))

    def version(self) -> object:
        return self._held

    def bodies(self) -> Mapping[str, Body]:
        held = self._held
        if held is None:
            return {}
        if self._body is None or self._body[0] is not held:
            self._body = held, body_in(held.workpiece, self._frame, held.lie)
        return {held.workpiece.name: self._body[1]}

    def supports(self) -> Iterable[Body]:
        return ()

    def take(self, name: str, now: Nanos) -> Workpiece:
        (found,) = (held.workpiece for held in (self._held,) if held is not None and held.workpiece.name == name)
        self._held = None
        self._block.scheduler.notify(self._block.name)
        return found

    def put(self, workpiece: Workpiece, on: Body, lie: Lie, now: Nanos) -> bool:
        """Never: it has no supports."""
        return False

    def set_state(self, plain: Plain) -> None:
        super().set_state(plain)
        self._body = None
        self._probe.forget()
        if self._inside is not None:
            self._inside.forget()


def _closing(body: Body, radius: int) -> Body | None:
    """The part of a top face over which the middle of a cup is closed by it; None where the face is too small."""
    shape, (x, y, z) = body.shape, body.centre
    half_x, half_y = shape.half[:2] if isinstance(shape, Box) else (shape.radius, shape.radius)
    if min(half_x, half_y) < radius:
        return None
    room_x, room_y = half_x - radius + 1, half_y - radius + 1  # 1 nm more: its edge belongs to it
    part = Box((room_x, room_y, 0)) if isinstance(shape, Box) else Cylinder(room_x, 0)
    return Body(body.name, body.frame, part, (x, y, z + half_height(shape)))
