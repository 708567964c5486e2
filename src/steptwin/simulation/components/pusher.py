"""Bodies that push workpieces across belts."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from functools import partial
from math import ceil, floor
from typing import ClassVar, NamedTuple, TypeAlias

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.components.beltspace import BeltSpace
from steptwin.simulation.components.bodycontact import BodyContact
from steptwin.simulation.components.bodytable import BodySpec, body_of
from steptwin.simulation.components.conveyor import CONVEYOR
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.frames import check_upright, sources_of
from steptwin.simulation.components.mount import Block, Movement
from steptwin.simulation.components.probe import Probe, unless_on
from steptwin.simulation.components.resting import resting_of
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.mechanics.belt import Bar, Placed
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.space.bodies import Body, Box
from steptwin.simulation.space.frames import NM_PER_MM
from steptwin.simulation.space.pieces import first_back
from steptwin.simulation.space.sweeps import SweptBody
from steptwin.state import Plain, Stateful

TOUCH_NM = 1000
"""Less than a workpiece and a body overlap when they have come to touch."""

NO_BELTS = Message("simulation.no-belts-to-push-across", "{pusher!r} pushes, but no [[conveyor]] has a place in space")
CANNOT_STAND = Message(
    "simulation.pusher-cannot-stand",
    "{pusher!r} pushes, but {movers} moves it, and cannot stand where a workpiece is in the way",
)
PUSHES = Message("simulation.pushes-workpiece", "{pusher} pushes {workpiece} on {belt}")
RUNS_INTO = Message("simulation.runs-into-workpiece", "{pusher} and {workpiece} collide")
JAMS = Message("simulation.pusher-jams", "{pusher} stands: {workpiece} is pushed against {other}")
JAMS_NO_MORE = Message("simulation.pusher-is-free-again", "{pusher} is free again")


_Strip: TypeAlias = tuple[str, int, int, str]
"""The part of the width of a belt that a workpiece takes: the belt, its middle to the left, the width, what pushes it."""


def _strip_of(belt: BeltSpace, placed: Placed) -> _Strip:
    return belt.conveyor.spec.name, placed.across, placed.width, placed.pusher


class _Pushed(NamedTuple):
    """A workpiece that is pushed, and what may happen to it."""

    placed: Placed
    body: Body
    beside: BodyContact
    """Whether the pusher is still beside it."""
    above: BodyContact
    """Whether its middle is above the belt."""
    against: Probe
    """Other workpieces and other pushers that it is pushed against."""
    close: Probe
    """Those within a millimetre before it."""

    def forget(self) -> None:
        for one in (self.beside, self.above, self.against, self.close):
            one.forget()


class Pusher(Stateful):
    """A body that pushes workpieces on belts, a part of a scheduler.

    Across the belt a workpiece goes where the face of the pusher goes, until that goes back or is no longer beside it; along it
    goes with the belt. It leaves the belt when its middle does. A workpiece that comes along the belt stands before a pusher.
    It stands where that meets another workpiece, or a pusher on its other side.
    """

    FIXED: ClassVar[tuple[str, ...]] = (
        "_belts",
        "_body",
        "_entries",
        "_frames",
        "_probe",
        "_pushed",
        "_resting",
        "_scheduler",
        "_strips",
        "_workpieces",
        "name",
    )
    __slots__ = (*FIXED, "_due", "_jammed", "_lines", "_over", "count")

    def __init__(self, scheduler: Scheduler, context: ElementContext, belts: Iterable[BeltSpace], body: Body) -> None:
        self._scheduler = scheduler
        self._frames = context.frames
        self._workpieces = context.objects.workpieces
        self._resting = resting_of(context, scheduler)
        self._belts = tuple(belts)
        self.name = body.name
        self._body = body
        self._probe = Probe(body, {}, self._workpieces, self._to_meet)
        self._pushed: dict[str, _Pushed] = {}
        self._over: tuple[tuple[str, str], ...] = ()
        """Workpieces that it is in, and cannot push, with what does."""
        self._jammed: tuple[str, str] | None = None
        """A belt, and the workpiece on it that is pushed against another one."""
        self._entries = tuple(
            (belt, BodyContact(SweptBody(body), SweptBody(belt.entry(scheduler.now)))) for belt in self._waiting()
        )
        """Whether it is in the way of feeders that wait for room, by belt."""
        self._strips: dict[tuple[_Strip, _Strip], BodyContact] = {}
        """Whether two strips have something in common."""
        self._lines: tuple[tuple[_Strip, ...], ...] = ()
        """Strips of workpieces that it pushes with those that have something in common with them; the beginnings where it is."""
        self._due: Nanos | None = None
        self.count = 0
        """How often it began to push one."""

    @property
    def is_jammed(self) -> bool:
        return self._jammed is not None

    # ------------------------------------------------------------------ what it meets

    def _to_meet(self, body: Body) -> Body | None:
        """The part of a workpiece that it may touch: not one that it pushes, and none on it."""
        belt, placed = self._on_belt(body.name)
        if belt is not None and placed is not None:
            return None if placed.pusher == self.name else belt.rectangle(placed)
        return unless_on((self._body.frame,), body)

    def _on_belt(self, name: str) -> tuple[BeltSpace | None, Placed | None]:
        found = ((belt, belt.placed(name)) for belt in self._belts)
        return next(((belt, placed) for belt, placed in found if placed is not None), (None, None))

    def _meet(self, name: str, now: Nanos) -> tuple[bool, Nanos | None]:
        """It touches a workpiece that it does not push. Whether it can neither push it nor is a bar for it; when its face goes
        forward, or before that of the one that pushes it."""
        belt, placed = self._on_belt(name)
        if belt is None or placed is None:
            return True, None
        other = belt.rectangle(placed)
        (along, across), (far, aside) = belt.in_belt(self._body, now), belt.halves(self._body)
        (its_along, its_across), (its_far, its_aside) = belt.in_belt(other, now), belt.halves(other)
        to_left, to_right = across + aside - its_across + its_aside, its_across + its_aside - across + aside
        before, behind = its_along + its_far - along + far, along + far - its_along + its_far
        conveyor = belt.conveyor
        by_side = min(to_left, to_right)
        least = by_side if placed.pusher else min(by_side, before, behind)
        way = 1 if by_side == to_left else -1
        if least >= TOUCH_NM:
            return True, None
        if least == by_side:
            is_opposite = bool(placed.pusher) and belt.way(placed.pusher, placed, now) != way
            forward = first_back(belt.gaining(self.name, "" if is_opposite else placed.pusher), now, -way)
            if forward is None or forward > now:
                return False, forward
            if is_opposite:
                self._jam(belt, name, placed.pusher, now)
                return False, None
            # It is moved to where it only touches.
            moved, room = belt.pushing(self.name).at(now), aside + its_aside
            place = ceil(across + room - moved) if way > 0 else floor(across - room - moved)
            conveyor.belt.push(placed, place, self.name)
            self.count += 1
            self._report(PUSHES(pusher=self.name, workpiece=name, belt=conveyor.spec.name), name, "pushed")
        elif least == before:
            conveyor.belt.bars += (Bar(name, conveyor.belt.from_nm(floor(along - far)), self.name),)
        else:
            return True, None
        self._scheduler.notify(conveyor.spec.name)
        return False, None

    # ------------------------------------------------------------------ what it pushes

    def _those(self) -> Iterator[tuple[BeltSpace, Placed]]:
        for belt in self._belts:
            yield from ((belt, placed) for placed in belt.conveyor.belt.workpieces if placed.pusher == self.name)

    def _facts(self, belt: BeltSpace, placed: Placed, way: int) -> _Pushed:
        name = placed.workpiece.name
        body = self._workpieces.bodies()[name]
        known = self._pushed.get(name)
        if known is None or known.placed is not placed or known.body is not body:
            others = partial(unless_on, (body.frame,))
            its, ahead = SweptBody(body), belt.rectangle(placed, across=way * NM_PER_MM)
            pushers = {pusher: SweptBody(other) for pusher, other in belt.pushers.items() if pusher != self.name}
            middle = Body(name, body.frame, Box((0, 0, 1)))
            known = self._pushed[name] = _Pushed(
                placed,
                body,
                BodyContact(SweptBody(self._body), SweptBody(belt.lane(placed))),
                BodyContact(SweptBody(middle), SweptBody(belt.surface)),
                Probe(body, {one: BodyContact(its, swept) for one, swept in pushers.items()}, self._workpieces, others),
                Probe(
                    ahead,
                    {one: BodyContact(SweptBody(ahead), swept) for one, swept in pushers.items()},
                    self._workpieces,
                    others,
                ),
            )
        return known

    def _push_on(self, belt: BeltSpace, placed: Placed, now: Nanos) -> Iterator[Nanos | None]:
        """Let a workpiece go on, or no longer. When something may happen to it."""
        conveyor, name = belt.conveyor, placed.workpiece.name
        way = belt.way(self.name, placed, now)
        facts = self._facts(belt, placed, way)
        back = first_back(belt.pushing(self.name), now, way)
        if not facts.above.holds(now):
            workpiece = belt.take(name, now)
            self._resting.release(workpiece, facts.body.frame, now)
            return
        if not facts.beside.holds(now) or (back is not None and back <= now):
            conveyor.belt.push(placed, belt.conveyor.belt.across_at(placed, now), "")
            self._scheduler.notify(conveyor.spec.name)
            return
        goes_back, before = self._goes_back(belt, way, now), facts.close.met(now)
        if self._jammed == (conveyor.spec.name, name) and (goes_back or not before):
            self._free(now)
        others = [other for other in facts.against.met(now) if other in before]
        if self._jammed is None and others and not goes_back:
            self._jam(belt, name, others[0], now)
        yield from (back, facts.beside.change(now), facts.above.change(now), facts.against.change(now), facts.close.change(now))

    def _goes_back(self, belt: BeltSpace, way: int, now: Nanos) -> bool:
        """Whether it is to go back from a workpiece that it pushes that way, also while it jams."""
        return any(way * sign * one.heading(now) < 0 for one, sign in self._moving(belt))

    def _waiting(self) -> Iterator[BeltSpace]:
        return (belt for belt in self._belts if belt.conveyor.spec.feed_waits)

    def _pass(self, now: Nanos) -> Iterator[Nanos | None]:
        """Let workpieces go on, or come onto a belt, past it and those that it pushes, or no longer. When that changes."""
        strips: dict[tuple[_Strip, _Strip], BodyContact] = {}
        for belt, placed in self._those():
            near = [one for one in self._belts if one.conveyor.spec.name in belt.conveyor.line]
            others = [(one, other) for one in near for other in one.conveyor.belt.workpieces if other is not placed]
            others += [(one, one.conveyor.next_at(0, now)) for one in self._waiting()]
            # Most have their strip in common.
            for strip, (its, other) in {_strip_of(*one): one for one in others}.items():
                key = _strip_of(belt, placed), strip
                strips[key] = self._strips.get(key) or BodyContact(SweptBody(belt.strip(placed)), SweptBody(its.strip(other)))
        self._strips = strips
        lines: list[tuple[_Strip, ...]] = [key for key, contact in strips.items() if contact.holds(now)]
        entries = [(_strip_of(belt, belt.conveyor.next_at(0, now)), contact) for belt, contact in self._entries]
        lines += [(strip,) for strip, contact in entries if contact.holds(now)]
        for contact in (*strips.values(), *(one for _, one in entries)):
            yield contact.change(now)
        if tuple(lines) != self._lines:
            self._lines = tuple(lines)
            for belt in self._belts:
                belt.conveyor.belt.passings += 1
                self._scheduler.notify(belt.conveyor.spec.name)

    def _moving(self, belt: BeltSpace) -> Iterator[tuple[Movement, int]]:
        """Movers of it across a belt, and to which side."""
        for frame, sign in belt.joints_to(self.name):
            movement = self._frames.movement(frame)
            if movement is not None:
                yield movement, sign

    def check(self) -> None:
        """Raise `Misuse` where something moves it across a belt, and nothing of that can be stopped."""
        for belt in self._belts:
            movers = [movement for movement, _ in self._moving(belt)]
            if movers and not self._blocks(belt):
                raise Misuse(CANNOT_STAND(pusher=self.name, movers=sources_of(movers)))

    def _blocks(self, belt: BeltSpace) -> Mapping[Block, None]:
        return dict.fromkeys(block for movement, _ in self._moving(belt) for block in movement.blocks)

    def _jam(self, belt: BeltSpace, name: str, other: str, now: Nanos) -> None:
        self._jammed = belt.conveyor.spec.name, name
        self._report(JAMS(pusher=self.name, workpiece=name, other=other), name, "jams")
        for block in self._blocks(belt):
            block(True, now, self.name)

    def _squeezes(self, met: Collection[str], now: Nanos) -> bool:
        """Whether it still jams before a workpiece that another one pushes against it."""
        belt, placed = (None, None) if self._jammed is None else self._on_belt(self._jammed[1])
        if belt is None or placed is None or not placed.pusher or placed.workpiece.name not in met:
            return False
        return not self._goes_back(belt, belt.way(self.name, placed, now), now)

    def _free(self, now: Nanos) -> None:
        """Let it move on after a jam: nothing is in its way, or it moves back."""
        if self._jammed is None:
            return
        (belt,) = (one for one in self._belts if one.conveyor.spec.name == self._jammed[0])
        name, self._jammed = self._jammed[1], None
        for block in self._blocks(belt):
            block(False, now, self.name)
        self._report(JAMS_NO_MORE(pusher=self.name), name, "free again")

    def _bar(self, belt: BeltSpace, now: Nanos) -> Iterator[Nanos | None]:
        """Let workpieces stand that it is before, or no longer. When that changes."""
        own = belt.conveyor.belt
        kept: list[Bar] = []
        for bar in own.bars:
            placed = belt.placed(bar.workpiece)
            if bar.by == self.name and placed is not None:
                contact = BodyContact(SweptBody(self._body), SweptBody(belt.rectangle(placed, along=TOUCH_NM)))
                if not contact.holds(now):
                    continue
                yield contact.change(now)
            if placed is not None:
                kept.append(bar)
        if len(kept) < len(own.bars):
            own.bars = tuple(kept)
            self._scheduler.notify(belt.conveyor.spec.name)

    # ------------------------------------------------------------------ part of a scheduler

    def update(self, now: Nanos) -> None:
        moments = [due for belt in self._belts for due in self._bar(belt, now)]
        falling = self._workpieces.falling()
        barred = {bar.workpiece for belt in self._belts for bar in belt.conveyor.belt.bars if bar.by == self.name}
        met = [name for name in self._probe.met(now) if name not in falling and name not in barred]
        known, self._over = self._over, ()
        for name in met:
            _, placed = self._on_belt(name)
            one = name, "" if placed is None else placed.pusher
            is_over, forward = (True, None) if one in known else self._meet(name, now)
            moments.append(forward)
            if is_over:
                self._over += (one,)
                if all(name != other for other, _ in known):
                    self._report(RUNS_INTO(pusher=self.name, workpiece=name), name, "collides")
        those = [*self._those()]
        pushed = {placed.workpiece.name: belt.conveyor.spec.name for belt, placed in those}
        self._pushed = {name: known for name, known in self._pushed.items() if name in pushed}
        if self._jammed is not None and pushed.get(self._jammed[1]) != self._jammed[0] and not self._squeezes(met, now):
            self._free(now)
        for belt, placed in those:
            moments += self._push_on(belt, placed, now)
        moments += self._pass(now)
        moments.append(self._probe.change(now))
        self._due = min((due for due in moments if due is not None and due > now), default=None)

    def deadline(self) -> Nanos | None:
        return self._due

    def set_state(self, plain: Plain) -> None:
        super().set_state(plain)
        self._probe.forget()
        self._pushed.clear()
        self._strips = {}
        for _, contact in self._entries:
            contact.forget()

    def _report(self, text: str, name: str, what: str) -> None:
        scheduler = self._scheduler
        facts = ("workpiece", name), ("element", self.name), ("what", what)
        scheduler.record(scheduler.first, "event", "workpiece", text, *facts)
        scheduler.notify(self.name)

    def signals(self) -> Mapping[str, SignalOf]:
        source = (self._scheduler.source(self.name),)
        return {
            "pushed": SignalOf(source, lambda now: float(self.count)),
            "jammed": SignalOf(source, lambda now: float(self.is_jammed)),
        }


def pusher_of(spec: BodySpec, context: ElementContext) -> Pusher:
    """The part that a body is that pushes. Raises `Misuse` for one that turns against a belt or cannot stand, and where there is
    none."""
    frames, workpieces = context.frames, context.objects.workpieces
    conveyors = [one for name, one in context.objects.built(CONVEYOR).items() if name in frames]
    if not conveyors:
        raise Misuse(NO_BELTS(pusher=spec.name))
    scheduler = conveyors[0].block.scheduler
    resting_of(context, scheduler)
    body = body_of(spec, frames)
    check_upright(spec.name, body.frame)
    around = body.shape if isinstance(body.shape, Box) else Box((body.shape.radius, body.shape.radius, body.shape.half))
    belts = workpieces.of(BeltSpace)
    pusher = Body(spec.name, body.frame, around, body.centre)
    for belt in belts:
        belt.add_pusher(pusher)
    made = Pusher(scheduler, context, belts, pusher)
    made.check()
    pushers = (
        frames[one.name].frame for one in context.objects.described.mounts.values() if isinstance(one, BodySpec) and one.pushes
    )
    sources = (*workpieces.sources, *sources_of(moved for frame in pushers for moved in frames.carrying(frame)))
    scheduler.add_part(made, sources, spec.name)
    return made
