"""Taking workpieces in space: a suction cup takes what closes it, jaws take what is between them."""

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
from steptwin.simulation.components.workpieces import Lie, body_in, lie_in
from steptwin.simulation.mechanics.workpiece import Workpiece
from steptwin.simulation.scheduler.scheduler import TerminalBlock
from steptwin.simulation.space.bodies import Body, Box, Cylinder
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

    It takes one that its probe meets. ``margin``: how far the middle of the probe is inside of that, nm.
    """

    FIXED: ClassVar[tuple[str, ...]] = (
        "_block",
        "_body",
        "_draw",
        "_frame",
        "_frames",
        "_margin",
        "_probe",
        "_resting",
        "_workpieces",
    )
    __slots__ = (*FIXED, "_held", "dropped")

    def __init__(self, block: TerminalBlock, context: ElementContext, probe: Body, draw: Draw, margin: int = 0) -> None:
        """``draw``: where a workpiece is when it is held, of where it was in the frame of the probe."""
        self._block = block
        check_upright(block.name, probe.frame)
        self._frames = context.frames
        self._frame = probe.frame
        self._workpieces = context.objects.workpieces
        self._resting = resting_of(context, block.scheduler)
        self._draw = draw
        self._margin = margin
        self._probe = Probe(probe, {}, self._workpieces, lambda body: _without_margin(body, margin))
        self._held: Held | None = None
        self._body: tuple[Held, Body] | None = None
        self.dropped = 0
        self._workpieces.holders.append(self)

    # ------------------------------------------------------------------ what it meets

    def met(self, now: Nanos) -> Body | None:
        """The workpiece that it would take: the highest, then the first by name."""
        bodies, falling = self._workpieces.bodies(), self._workpieces.falling()
        there = (name for name in self._probe.met(now) if name not in falling)
        tops = [(height_over(bodies[name], self._frame, (0, 0, 0), now, self._margin), name) for name in there]
        found = min(((top, name) for top, name in tops if top is not None), default=None)
        return None if found is None else bodies[found[1]]

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
        return self._probe.change(now)

    @property
    def depends_on(self) -> None:
        """Any change: workpieces may be anywhere."""
        return None

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

    def hold(self, now: Nanos) -> None:
        body = self.met(now)
        if body is not None:
            lie = self._draw(lie_in(body.frame, self._frame, now), body)
            self._held = Held(self._workpieces.take(body.name, now), lie)
            self.report(HOLDS(cup=self.name, workpiece=body.name), body.name, "held")

    def release(self, now: Nanos) -> None:
        """Let go of what it holds, which lies on what is below it, or falls."""
        if self._held is not None:
            workpiece, body = self._held.workpiece, self._workpieces.bodies()[self._held.workpiece.name]
            self._held = None
            self.report(LETS_GO(cup=self.name, workpiece=workpiece.name), workpiece.name, "released")
            if not self._resting.release(workpiece, body.frame, now):
                self.dropped += 1

    def report(self, text: str, name: str, what: str) -> None:
        """Record an event with a workpiece."""
        block = self._block
        facts = ("workpiece", name), ("element", block.name), ("what", what)
        block.scheduler.record(block.scheduler.owner(block.name), "event", "workpiece", text, *facts)
        block.scheduler.notify(block.name)

    # ------------------------------------------------------------------ a holder

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


def _without_margin(body: Body, margin: int) -> Body | None:
    """A body that is smaller by a margin all around, but as high; None where nothing is left."""
    shape = body.shape
    if isinstance(shape, Box):
        x, y, z = shape.half
        inner = Box((x - margin, y - margin, z))
        return body if not margin else None if min(inner.half[:2]) < 0 else Body(body.name, body.frame, inner, body.centre)
    left = shape.radius - margin
    return None if left < 0 else Body(body.name, body.frame, Cylinder(left, shape.half), body.centre)
