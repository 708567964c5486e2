"""Workpieces that lie on parts of the machine, in nests, on each other and on the floor, and those that fall."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from functools import partial
from math import sqrt
from typing import ClassVar, NamedTuple

from steptwin.controller import SECOND, Nanos
from steptwin.messages import Message
from steptwin.simulation.components.beltspace import BeltSpace, add_belts
from steptwin.simulation.components.bodytable import BodySpec, body_of
from steptwin.simulation.components.conveyor import COLLIDES, CONVEYOR
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.frames import Frames, check_upright, sources_of, tilting_axis
from steptwin.simulation.components.nesttable import NestSpec
from steptwin.simulation.components.probe import Probe, unless_on
from steptwin.simulation.components.workpieces import (
    REACH_NM,
    WORKPIECES,
    Below,
    Lie,
    Rest,
    Workpieces,
    body_in,
    lie_in,
    workpiece_of,
)
from steptwin.simulation.mechanics.belt import Placed
from steptwin.simulation.mechanics.workpiece import Workpiece
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.space.bodies import Body, half_height
from steptwin.simulation.space.contacts import Pair
from steptwin.simulation.space.frames import FLOOR, NM_PER_MM, Direction, Frame, Joint, Z
from steptwin.simulation.space.pieces import falling
from steptwin.simulation.space.sweeps import meet
from steptwin.state import Plain, Stateful

GRAVITY_NM_S2 = 9.80665e9
DOWN = Direction(Z, -1)

FALLS = Message("simulation.workpiece-falls", "{workpiece} falls {height:g} mm")
LIES_ON = Message("simulation.workpiece-lies-on", "{workpiece} lies on {on}")
LIES_ON_FLOOR = Message("simulation.workpiece-lies-on-floor", "{workpiece} lies on the floor")


MEETS = Message("simulation.workpiece-meets-another", "{workpiece} and {other} collide")
LEAVES = Message("simulation.workpiece-leaves", "{workpiece} leaves with {other}")
LIES_CROOKED = Message("simulation.workpiece-lies-crooked", "{workpiece} lies crooked on {on}")


class Fall(NamedTuple):
    """A workpiece in the air, which falls straight down. ``lie``: from the floor of the world, where it began to fall."""

    workpiece: Workpiece
    lie: Lie
    begins: Nanos
    ends: Nanos

    @classmethod
    def of(cls, workpiece: Workpiece, lie: Lie, height: int, begins: Nanos) -> Fall:
        """``height`` in nm."""
        return cls(workpiece, lie, begins, begins + round(sqrt(2.0 * height / GRAVITY_NM_S2) * SECOND))

    @property
    def body(self) -> Body:
        way = falling(self.begins, self.ends, GRAVITY_NM_S2)
        frame = Frame(f"{self.workpiece.name}.fall", None, self.lie.at, Joint(way, DOWN))
        return body_in(self.workpiece, frame, Lie((0, 0, 0), self.lie.yaw_q))


class Piles(NamedTuple):
    """Facts that follow from the workpieces that rest, found once for each change of them."""

    rests: tuple[Rest, ...]
    lowest: Mapping[str, str]
    """Element that each of them lies on, through others."""
    count: Mapping[str, int]
    """By what they lie on, through others."""
    crooked: Mapping[str, int]
    """Those among them that are aligned neither to a cell nor to the one below."""
    mass: Mapping[str, float]
    """kg by what they lie on, through others."""


class Resting(Stateful):
    """A `steptwin.simulation.components.workpieces.Holder`, and a part of a scheduler.

    What lies on a workpiece goes wherever that goes, also out of the world at the end of a belt. What loses
    what it lies on otherwise, and what is let go of higher than `REACH_NM` above what is below it, falls straight down for
    √(2 h / g), and lies on what is below it then; if that is lower, it falls on. It lies on a workpiece that comes below it
    meanwhile; what it meets otherwise is an event.
    """

    FIXED: ClassVar[tuple[str, ...]] = (
        "_bodies",
        "_frames",
        "_masses",
        "_nests",
        "_piles",
        "_probes",
        "_scheduler",
        "_seen",
        "_supports",
        "_workpieces",
    )
    __slots__ = (*FIXED, "_due", "_falls", "_met", "_put", "_rests")

    def __init__(
        self,
        scheduler: Scheduler,
        frames: Frames,
        workpieces: Workpieces,
        supports: Mapping[str, Body],
        nests: Mapping[str, NestSpec],
    ) -> None:
        self._scheduler = scheduler
        self._frames = frames
        self._workpieces = workpieces
        self._supports = supports
        self._nests = nests
        self._rests = tuple(rest for nest in nests.values() for rest in nest.workpieces())
        self._falls: tuple[Fall, ...] = ()
        self._probes: dict[str, Probe] = {}
        """Probes of those that fall, and of those on them."""
        self._met: tuple[tuple[str, ...], ...] = ()
        """Pairs of which one falls, and has met the other."""
        self._due: Nanos | None = None
        """When one that falls meets another one, or has come down."""
        self._put: dict[str, int] = {}
        """Numbers of the last workpieces of nests into which others than those of the beginning were put."""
        self._bodies: dict[str, tuple[Rest | Fall, Frame | None, Body]] = {}
        """As they were made: a body stays the same while nothing below it changes."""
        self._piles: Piles | None = None
        self._masses: Mapping[str, float] = {}
        """Those that carriers know."""
        self._seen: Mapping[str, Body] | None = None
        """All workpieces when it was updated last: without others, nothing comes to those that rest."""

    # ------------------------------------------------------------------ a holder

    @property
    def name(self) -> str:
        return WORKPIECES

    @property
    def scheduler(self) -> Scheduler:
        return self._scheduler

    @property
    def sources(self) -> Iterable[str]:
        return (WORKPIECES, *sources_of(one for body in self._supports.values() for one in self._frames.carrying(body.frame)))

    def version(self) -> object:
        return self._rests, self._falls

    def supports(self) -> Iterable[Body]:
        return self._supports.values()

    def bodies(self) -> Mapping[str, Body]:
        others = {name: body for one in self._workpieces.holders if one is not self for name, body in one.bodies().items()}
        its = {one.workpiece.name: one for one in (*self._rests, *self._falls)}
        made: dict[str, Body] = {}
        for name in its:
            self._make(name, its, others, made)
        self._bodies = {name: one for name, one in self._bodies.items() if name in made}
        return made

    def _make(self, name: str, its: Mapping[str, Rest | Fall], others: Mapping[str, Body], made: dict[str, Body]) -> Body | None:
        """The body of one that rests or falls, as are those below it; None where what it lies on is gone."""
        if name in others or name in made:
            return others.get(name) or made[name]
        one, known = its.get(name), self._bodies.get(name)
        if one is None:
            return None
        frame: Frame | None = None
        if isinstance(one, Rest) and one.on in self._supports:
            frame = self._supports[one.on].frame
        elif isinstance(one, Rest) and one.on:
            below = self._make(one.on, its, others, made)
            frame = below.frame if below is not None else known[1] if known is not None else None
        if known is None or known[0] != one or known[1] is not frame:
            body = one.body if isinstance(one, Fall) else body_in(one.workpiece, frame, one.lie)
            self._bodies[name] = known = one, frame, body
        made[name] = known[2]
        return known[2]

    def take(self, name: str, now: Nanos) -> Workpiece:
        (found,) = (one.workpiece for one in (*self._rests, *self._falls) if one.workpiece.name == name)
        self._rests = tuple(rest for rest in self._rests if rest.workpiece.name != name)
        self._falls = tuple(fall for fall in self._falls if fall.workpiece.name != name)
        self._scheduler.notify(WORKPIECES)
        return found

    def put(self, workpiece: Workpiece, on: Body, lie: Lie, now: Nanos) -> bool:
        """It lies on a support, or on another workpiece; aligned, where that is a nest, or in one."""
        found = self._aligned(on.name, lie)
        self._rests = (*self._rests, Rest(workpiece, on.name, found or lie))
        is_crooked = found is None
        text = (LIES_CROOKED if is_crooked else LIES_ON)(workpiece=workpiece.name, on=on.name)
        self._report(text, workpiece.name, "crooked" if is_crooked else "on")
        self._report_overlaps(workpiece, on.name, now)
        return True

    def next_in(self, nest: NestSpec, now: Nanos) -> Rest | None:
        """A further workpiece of a nest, in the first cell of the lowest layer that is not full; None where another one is in its
        way."""
        above = {rest.on: rest for rest in self._rests if rest.on != nest.name}
        lowest = {rest.lie.at[:2]: rest for rest in self._rests if rest.on == nest.name}
        piles: list[list[Rest]] = []
        for middle in nest.middles:
            pile = [lowest[middle]] if middle in lowest else []
            while pile and (further := above.get(pile[-1].workpiece.name)) is not None:
                pile.append(further)
            piles.append(pile)
        cell = min(range(len(piles)), key=lambda n: len(piles[n]))
        number = self._put.get(nest.name, nest.filled) + 1
        workpiece = workpiece_of(f"{nest.name}.{number}", nest.workpiece or (), nest.mass)
        if piles[cell]:
            below = piles[cell][-1].workpiece
            rest = Rest(workpiece, below.name, Lie((0, 0, below.height)))
            frame = self._workpieces.bodies()[below.name].frame
        else:
            rest, frame = Rest(workpiece, nest.name, Lie((*nest.middles[cell], 0))), self._supports[nest.name].frame
        body = body_in(workpiece, frame, rest.lie)
        return None if any(Pair(body, other).overlap(now) for other in self._workpieces.bodies().values()) else rest

    def add(self, nest: NestSpec, rest: Rest) -> None:
        """Put a further workpiece into a nest, as `next_in` has found it."""
        self._put[nest.name] = self._put.get(nest.name, nest.filled) + 1
        self._rests = (*self._rests, rest)
        self._report(LIES_ON(workpiece=rest.workpiece.name, on=rest.on), rest.workpiece.name, "on")

    def _aligned(self, on: str, lie: Lie) -> Lie | None:
        """Where a workpiece is that is put on something; None where it lies crooked, in a nest."""
        nest = self._nests.get(self.piles().lowest.get(on, on))
        return lie if nest is None else _aligned(nest, on, lie)

    def _report_overlaps(self, workpiece: Workpiece, on: str, now: Nanos) -> None:
        """Report the workpieces that one overlaps where it is put."""
        every, name = self._workpieces.bodies(), workpiece.name
        own, around = every[name], self._workpieces.swept(name).sweep(now)
        near = [other for other in every if other != name and meet(around, self._workpieces.swept(other).sweep(now))]
        for other in near:
            if _pair(name, other) not in self._met and Pair(own, every[other]).overlap(now):
                self._report(COLLIDES(workpiece=name, other=other, belt=on), workpiece.name, "collides")

    def mass_on(self, name: str) -> float:
        """kg of all that lies on something, through others."""
        return self.piles().mass.get(name, 0.0)

    def piles(self) -> Piles:
        found = self._piles
        if found is None or found.rests is not self._rests:
            found = self._piles = self._piled()
        return found

    def falling(self) -> Collection[str]:
        """Names of those that fall, and of those on them."""
        falls = {fall.workpiece.name for fall in self._falls}
        return falls | {name for name, lowest in self.piles().lowest.items() if lowest in falls} if falls else falls

    def _piled(self) -> Piles:
        on = {rest.workpiece.name: rest.on for rest in self._rests}
        lowest: dict[str, str] = {}
        for name, below in on.items():
            through, last = [name], below
            while last in on and last not in lowest:
                through.append(last)
                last = on[last]
            lowest |= dict.fromkeys(through, lowest.get(last, last))
        crooked: Counter[str] = Counter()
        mass: dict[str, float] = {}
        for rest in self._rests:
            last = lowest[rest.workpiece.name]
            mass[last] = mass.get(last, 0.0) + rest.workpiece.mass
            nest = self._nests.get(last)
            if nest is not None and _aligned(nest, rest.on, rest.lie) != rest.lie:
                crooked[nest.name] += 1
        return Piles(self._rests, lowest, Counter(lowest.values()), crooked, mass)

    # ------------------------------------------------------------------ letting go

    def release(self, workpiece: Workpiece, frame: Frame, now: Nanos) -> bool:
        """Something lets go of a workpiece, the middle of whose lower face is at the origin of a frame. Whether it lies there;
        otherwise it falls."""
        found = self._workpieces.below(workpiece.name, frame, now)
        lie = lie_in(frame, FLOOR, now)
        height = _height(lie, found)
        if height <= REACH_NM:
            return self._lay(workpiece, frame, found, now)
        self._falls = (*self._falls, Fall.of(workpiece, lie, height, now))
        self._report(FALLS(workpiece=workpiece.name, height=height / NM_PER_MM), workpiece.name, "falls")
        return False

    def drop_from(self, belt: BeltSpace, placed: Placed, now: Nanos) -> bool:
        """Let a workpiece fall at the end of a belt, unless the following belt begins there."""
        frame = belt.beyond_end(placed, now)
        if frame is not None:
            self.release(placed.workpiece, frame, now)
        return frame is not None

    def _lay(self, workpiece: Workpiece, frame: Frame, found: Below | None, now: Nanos) -> bool:
        """It lies on what is below it, otherwise on the floor. Whether it does: not where another workpiece is in its way."""
        if found is not None:
            (x, y, _), yaw_q = lie_in(frame, found.body.frame, now)
            lie = Lie((x, y, found.body.centre[2] + half_height(found.body.shape)), yaw_q)
            if (found.holder or self).put(workpiece, found.body, lie, now):
                return True
        (x, y, z), yaw_q = lie_in(frame, FLOOR, now)
        self._rests = (*self._rests, Rest(workpiece, "", Lie((x, y, z if z < -REACH_NM else 0), yaw_q)))
        self._report(LIES_ON_FLOOR(workpiece=workpiece.name), workpiece.name, "on the floor")
        self._report_overlaps(workpiece, FLOOR.name, now)
        return found is None

    def take_along(self, name: str, now: Nanos) -> None:
        """All that lies on a workpiece leaves the world with it."""
        for one, below in self.piles().lowest.items():
            if below == name:
                self.take(one, now)
                self._report(LEAVES(workpiece=one, other=name), one, "leaves")

    # ------------------------------------------------------------------ part of a scheduler

    def update(self, now: Nanos) -> None:
        there = self._workpieces.bodies()
        if there is self._seen and not self._falls:
            return
        self._seen = there
        for rest in self._rests:
            if rest.on and rest.on not in self._supports and rest.on not in there:
                self.release(self.take(rest.workpiece.name, now), there[rest.workpiece.name].frame, now)
        for fall in self._falls:
            if fall.ends <= now:
                self._land(fall, now)
        self._meet(now)
        self._weigh()
        moments = [fall.ends for fall in self._falls]
        moments += (due for probe in self._probes.values() if (due := probe.change(now)) is not None)
        self._due = min(moments, default=None)

    def _land(self, fall: Fall, now: Nanos) -> None:
        """End a fall, unless what was below it has gone lower."""
        workpiece, frame = fall.workpiece, self._workpieces.bodies()[fall.workpiece.name].frame
        found, lie = self._workpieces.below(workpiece.name, frame, now), lie_in(frame, FLOOR, now)
        height = _height(lie, found)
        others = tuple(one for one in self._falls if one is not fall)
        if height > REACH_NM:
            self._falls = (*others, Fall.of(workpiece, fall.lie, fall.lie.at[2] - lie.at[2] + height, fall.begins))
            self._scheduler.notify(WORKPIECES)
        else:
            self._falls = others
            self._lay(workpiece, frame, found, now)

    def _meet(self, now: Nanos) -> None:
        """Let those that fall lie on workpieces that they come to from above, and report what they meet otherwise."""
        there = self._workpieces.bodies()
        lowest = self.piles().lowest
        self._probes = {name: self._probe(there[name], there[lowest.get(name, name)]) for name in self.falling()}
        falls, met = {fall.workpiece.name: fall for fall in self._falls}, list[tuple[str, ...]]()
        for name, probe in self._probes.items():
            for other in probe.met(now):
                found = self._workpieces.below(name, there[name].frame, now) if name in falls else None
                if found is not None and found.body.name == other:
                    self._land(falls[name], now)
                    break
                met.append(_pair(name, other))
                if met[-1] not in self._met:
                    self._report(MEETS(workpiece=name, other=other), name, "collides")
        self._met = tuple(dict.fromkeys(met))

    def _weigh(self) -> None:
        """Let those notice that carry more or less on a workpiece."""
        before, after = self._masses, self.piles().mass
        self._masses = after
        if before is after:
            return
        for name in {**before, **after}:
            holder = self._workpieces.holder_of(name) if before.get(name) != after.get(name) else None
            if holder is not None:
                holder.scheduler.notify(holder.name)

    def _probe(self, body: Body, lowest: Body) -> Probe:
        """Meets other workpieces than those that fall with one."""
        known = self._probes.get(body.name)
        if known is not None and known.body is body:
            return known
        return Probe(body, {}, self._workpieces, partial(unless_on, (lowest.frame,)))

    def deadline(self) -> Nanos | None:
        return self._due

    def set_state(self, plain: Plain) -> None:
        super().set_state(plain)
        self._bodies.clear()
        self._probes.clear()
        self._workpieces.forget()

    def _report(self, text: str, name: str, what: str) -> None:
        scheduler = self._scheduler
        facts = ("workpiece", name), ("element", WORKPIECES), ("what", what)
        scheduler.record(scheduler.first, "event", "workpiece", text, *facts)
        scheduler.notify(WORKPIECES)


def _height(lie: Lie, found: Below | None) -> int:
    """How far a workpiece may fall, nm: to what is below it, or to the floor, which ends nothing that is lower."""
    return found.gap if found is not None else max(lie.at[2], 0)


def _pair(one: str, other: str) -> tuple[str, ...]:
    return tuple(sorted((one, other)))


def _aligned(nest: NestSpec, on: str, lie: Lie) -> Lie | None:
    return nest.aligned(lie) if on == nest.name else nest.snapped(lie, (0, 0))


def resting_of(context: ElementContext, scheduler: Scheduler) -> Resting:
    """That of a world. With it all that has workpieces in space is made, when something first needs it; what has a place is built
    before."""
    workpieces, frames = context.objects.workpieces, context.frames
    if there := workpieces.of(Resting):
        return there[0]
    described = context.objects.described
    nests = {spec.name: spec for spec in described.mounts.values() if isinstance(spec, NestSpec)}
    specs = (spec for spec in described.mounts.values() if isinstance(spec, BodySpec) and spec.holds_workpieces)
    bodies = (body_of(spec, frames) for spec in specs)
    supports = {body.name: body for body in bodies if tilting_axis(body.frame) is None}
    for name, nest in nests.items():
        check_upright(name, frames.base(name))
        supports[name] = nest.bottom(frames.base(name))
    made = Resting(scheduler, frames, workpieces, supports, nests)
    add_belts(context.objects)
    for conveyor in context.objects.built(CONVEYOR).values():
        conveyor.takes_along, conveyor.mass_on = made.take_along, made.mass_on
    for belt in workpieces.of(BeltSpace):
        belt.conveyor.drop = partial(made.drop_from, belt)
    workpieces.holders.append(made)
    workpieces.falling = made.falling
    scheduler.add_part(made, lambda: workpieces.sources, WORKPIECES)
    return made
