"""The contacts that a collision compares: of bodies, of what cups and jaws carry, and of workpieces."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from itertools import combinations, product

from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.components.body import BODY
from steptwin.simulation.components.bodycontact import BodyContact, while_there
from steptwin.simulation.components.bodytable import body_of
from steptwin.simulation.components.carriedcontact import CarriedContact
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.frames import bodies_on, check_upright, sources_of
from steptwin.simulation.components.grasp import Grasp
from steptwin.simulation.components.mount import Movement
from steptwin.simulation.components.probe import Probe, unless_on, whole
from steptwin.simulation.components.quantity import condition_of
from steptwin.simulation.components.resting import resting_of
from steptwin.simulation.components.touch import Contact, Meeting
from steptwin.simulation.components.workpieces import WORKPIECES
from steptwin.simulation.logic.condition import SignalCondition
from steptwin.simulation.scheduler.scheduler import TerminalBlock
from steptwin.simulation.space.bodies import Body
from steptwin.simulation.space.contacts import Pair
from steptwin.simulation.space.frames import Frame
from steptwin.simulation.space.sweeps import SweptBody

BODIES_TOUCH = Message("simulation.bodies-touch", "{zone}: {one} and {other} touch")
CANNOT_JAM = Message(
    "simulation.cannot-jam", "effect = 'jam': {one} and {other} are moved against each other by {movers}, which nothing stops"
)


class Compared:
    """A body, a cup or jaws with what they carry, and all workpieces are units; those of one group are compared with those of
    others.

    Raises `Misuse` where nothing can touch, where bodies overlap when the world begins, and where they are to stand and nothing
    that moves them can be stopped.
    """

    def __init__(
        self,
        block: TerminalBlock,
        context: ElementContext,
        between: Iterable[str],
        apart: Iterable[tuple[str, str]],
        *,
        every_body: bool,
        jams: bool,
    ) -> None:
        self._block = block
        self._jams = jams
        self._context = context
        self._described = {one.name: one for one in context.objects.described.of(BODY)}
        self._bodies = {name: body_of(one, context.frames) for name, one in self._described.items()}
        self._swept = {name: SweptBody(body) for name, body in self._bodies.items()}
        self._grasps = {one.name: one for one in context.objects.workpieces.of(Grasp)}
        self._grasping = frozenset(grasp.frame for grasp in self._grasps.values())
        self._moved: list[Movement] = []
        names = tuple(between)
        self._has_workpieces = any(name == WORKPIECES or name in self._grasps for name in names)
        if self._has_workpieces:
            resting_of(context, block.scheduler)
        groups = [[name] for name in self._bodies] if every_body else [self._units(name) for name in names]
        excluded = {frozenset(pair) for one, other in apart for pair in product(self._units(one), self._units(other))}
        pairs = (pair for one, other in combinations(groups, 2) for pair in product(one, other))
        self._wanted = {frozenset(pair): pair for pair in pairs if pair[0] != pair[1] and frozenset(pair) not in excluded}
        self.contacts = (*self._of_bodies(), *self._of_workpieces())
        if not self.contacts:
            raise Misuse("nothing moves these bodies against each other")

    @property
    def depends_on(self) -> tuple[str, ...]:
        """Names of what moves them."""
        pieces = self._context.objects.workpieces.sources if self._has_workpieces else ()
        return (*sources_of(self._moved), *pieces)

    @property
    def reads(self) -> tuple[str, ...]:
        """Names of what has the signals that say which bodies are there."""
        return tuple(owner for one in self._described.values() for owner in one.owners)

    def _units(self, name: str) -> list[str]:
        if name == WORKPIECES or name in self._grasps:
            return [name]
        return bodies_on(self._context.frames[name], self._bodies, name)

    # ------------------------------------------------------------------ bodies

    def _of_bodies(self) -> Iterator[Contact]:
        """Contacts of two bodies, in the order of the description."""
        for one, other in combinations(self._bodies, 2):
            if frozenset((one, other)) in self._wanted and not Pair(self._bodies[one], self._bodies[other]).is_constant:
                conditions = [*self._whens(one), *self._whens(other)]
                contact = BodyContact(self._swept[one], self._swept[other])
                now, is_checked = self._block.scheduler.now, self._context.memo.is_checked
                if not conditions and not is_checked and contact.pair.overlap(now):
                    raise Misuse(f"{one!r} and {other!r} overlap when the world begins")
                moved = self._context.frames.between(self._bodies[one].frame, self._bodies[other].frame)
                text = partial(BODIES_TOUCH, zone=self._block.name, one=one, other=other)
                yield self._contact(while_there(contact, conditions), moved, text, (one, other))

    def _whens(self, name: str) -> list[SignalCondition]:
        """The condition under which a body is there."""
        when = self._described[name].when
        return [] if when is None else [condition_of(when, self._block, self._context)]

    def _contact(
        self,
        meeting: Meeting,
        moved: Iterable[Movement],
        text: Callable[[], str],
        parts: tuple[str, str],
    ) -> Contact:
        those = list(moved)
        blocks = tuple(dict.fromkeys(drive for one in those for drive in one.blocks))
        if self._jams and those and not blocks:
            raise Misuse(CANNOT_JAM(one=parts[0], other=parts[1], movers=sources_of(those)))
        self._moved += those
        return Contact(meeting, blocks, text)

    # ------------------------------------------------------------------ workpieces

    def _of_workpieces(self) -> Iterator[Contact]:
        """Contacts of workpieces, those that are carried apart: what carries them stands with what they touch."""
        done: set[frozenset[str]] = set()
        for pair in self._wanted.values():
            bodies = [name for name in pair if name in self._bodies]
            grasps = [name for name in pair if name in self._grasps]
            if len(bodies) == 2:
                continue
            if bodies and not grasps:
                yield self._lying(bodies[0])
            for grasp in grasps or self._grasps:
                others = bodies or [name for name in pair if name != grasp]
                if (unit := frozenset((grasp, others[0]))) not in done:
                    done.add(unit)
                    yield self._carried(self._grasps[grasp], others[0])

    def _lying(self, name: str) -> Contact:
        """Contacts of a body with any workpiece that nothing carries."""
        body = self._bodies[name]
        check_upright(name, body.frame)
        probe = Probe(body, {}, self._context.objects.workpieces, partial(unless_on, self._grasping))
        text = partial(_touching, self._block, name, probe)
        meeting = while_there(probe, self._whens(name))
        return self._contact(meeting, self._context.frames.carrying(body.frame), text, (name, WORKPIECES))

    def _carried(self, grasp: Grasp, other: str) -> Contact:
        """Contact of what a cup or jaws carry with a body, with what others carry, or with any workpiece."""
        frames, pieces = self._context.frames, self._context.objects.workpieces
        if other in self._bodies:
            check_upright(other, self._bodies[other].frame)
            part = self._swept[other], self._whens(other)
            meeting = CarriedContact(grasp, {other: part}, None, whole)
            moved = frames.between(grasp.frame, self._bodies[other].frame)
        elif other in self._grasps:
            meeting = CarriedContact(grasp, {}, pieces, partial(_only_on, self._grasps[other].frame))
            moved = frames.between(grasp.frame, self._grasps[other].frame)
        else:
            meeting = CarriedContact(grasp, {}, pieces, partial(unless_on, (grasp.frame,)))
            moved = frames.carrying(grasp.frame)
        return self._contact(meeting, moved, partial(_carrying, self._block, meeting), (grasp.frame.name, other))


def _only_on(frame: Frame, body: Body) -> Body | None:
    """A workpiece that a frame carries."""
    return body if body.is_on(frame) else None


def _touching(block: TerminalBlock, body: str, probe: Probe) -> str:
    return BODIES_TOUCH(zone=block.name, one=body, other=", ".join(probe.met(block.scheduler.now)))


def _carrying(block: TerminalBlock, meeting: CarriedContact) -> str:
    one, other = meeting.told(block.scheduler.now)
    return BODIES_TOUCH(zone=block.name, one=one, other=other)
