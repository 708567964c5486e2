"""The causes of what happens to axes: their motions, their power, what keeps a rotor from following."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from functools import partial
from typing import Any

from steptwin.controller import SECOND, Nanos
from steptwin.messages import Message, MessageText
from steptwin.motion.divisions import profile_of
from steptwin.motion.profile import Profile
from steptwin.simulation.components.brake import RELEASED, BrakeSpec
from steptwin.simulation.components.load import ACTS, LoadSpec
from steptwin.simulation.components.touch import JAM
from steptwin.simulation.faults.kinds_physics import IS_BLOCKED, LOSES_PULSES
from steptwin.simulation.kinds.programs import Resource, ResourceKind
from steptwin.simulation.mechanics.rotorhold import MOVES_WITH_LITTLE_CURRENT
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.scheduler.wires import PinName
from steptwin.simulation.script import steps as do
from steptwin.why import points
from steptwin.why.answer import ChainLink, Cover
from steptwin.why.chain import Cause, FoundCause, Place, along, covered, nothing, unknown
from steptwin.why.controllers import HOMED
from steptwin.why.log import FALL, JAMS, LAST, OF_MECHANICS, Change, words_of

GIVES_POWER = Message("why.gives-power", ", which gives {axis} its power")
BEGAN_TO_MOVE = Message("why.began-to-move", "{axis} began to move")
FOLLOWS_ENCODER = Message("why.follows-encoder", "{axis} follows its encoder, which {name} turns")
CHANGED_UNDER_WAY = Message("why.changed-under-way", "the motion of {axis}, which was under way, changed")
STOPPED = Message("why.stopped", "{axis} stopped")
PULSES_STOPPED = Message("why.pulses-stopped", "the pulses of {axis} stopped")
AS = Message("why.as", "{what}, as {condition}")
BEGAN_TO_BRAKE = Message("why.began-to-brake", "{axis} began to brake")
MOTION_CHANGED = Message("why.motion-changed", "the motion of {axis} changed, which began at {time:.6f} s")
MOTION_ENDED = Message("why.motion-ended", "the motion of {axis} ended, which began at {time:.6f} s")
HAD_NO_POWER = Message("why.had-no-power", "{axis} had no power from {begin:.6f} s on: the pulses since then moved nothing")
HOLDS = Message("why.holds", "the motor of {axis} holds {torque:g} N·m at rest, as {key} in {where} has it")
STOPPED_AT_SOFT_LIMIT = Message("why.stopped-at-soft-limit", "{axis} stopped at its soft limit {limit}")
STOPPED_WITH_OTHER = Message("why.stopped-with-other", "{axis} stopped with the other axis of its path at the soft limit {limit}")
NOT_BEYOND = Message("why.not-beyond", "{axis} is at its soft limit {limit}: the command moved nothing")
BRAKES_NS: Nanos = SECOND // 10
"""How much later than a load stands its brake may have closed (`steptwin.simulation.components.brake`)."""
MOST_SUMMED = 20
"""Limit of the motions of which a place is the sum that are followed."""
POSITION = "position"
SETTINGS = ("VMAX", "ACC", "DEC")
"""Registers of an axis by which a motion is made."""
REST = 1
"""The status of an axis that is enabled and has not come to a target, such as one of a path that ended before."""
LIMITS = {9: "POSLIM_L", 10: "POSLIM_R"}
"""Registers of its soft limits, by the status at them (manual 4.1)."""


EVENTS_OF_ROTORS = tuple(f"event {name}" for name in (*OF_MECHANICS, *JAMS))


class AxisCauses:
    """Finds the causes of where the loads of axes are. ``causes`` has those of everything else."""

    def __init__(self, causes: Any) -> None:  # Causes, which imports this module
        self._all = causes
        self._log = causes.log
        self._world = causes.log.world

    def motion(
        self, controller: str, axis: str, until: Nanos, mechanics: str = "", before: int = LAST, since: Nanos | None = None
    ) -> FoundCause:
        """The motion of an axis at a moment, begun before an order; of all axes the one that ends last, if ``axis`` is empty.
        With ``mechanics``, the name of the axis, or ``since`` a moment, also those since then that led to where it began."""
        plan = max(self._log.plans_in_force(controller, axis, until, before), key=self._end, default=None)
        if plan is None:
            return None
        record = self._log.record(plan)
        profile = profile_of(record.plan())
        if not profile.segments and not profile.start:  # it has not moved yet
            return None
        if self._log.was_before(plan):
            there = self._all.of(profile.start)
            if there is not None:
                return there.axes.motion(controller, record.subject, until, mechanics, since=since)
        name = f"{controller}.M{record.subject}"
        shown = f"{mechanics} ({name})" if mechanics else name
        if self._log.was_before(plan):
            began = ChainLink(profile.start, controller, BEGAN_TO_MOVE(axis=shown))
            return Cause(began, Place(profile.start), unknown, Cover.MOTION) if profile.segments else None
        place = Place(plan.time, plan.order)
        stopped = PULSES_STOPPED if self._falls(controller, record.subject, plan, profile) else STOPPED
        cover, names = None, SETTINGS
        limit = self.soft_limit(controller, record.subject, plan.time if profile.end is None else profile.end, until)
        of_limit = limit.partition("_")[0].removeprefix("M") or record.subject
        if limit:
            is_own, names = of_limit == record.subject, (limit.partition("_")[2],)
            text = (STOPPED_AT_SOFT_LIMIT if is_own else STOPPED_WITH_OTHER)(axis=shown, limit=limit)
            place = max(place, Place(plan.time if profile.end is None else profile.end))
        elif not profile.segments:
            text, names = stopped(axis=shown), ()
        elif profile.end is not None and profile.end <= until:
            began, place = self._began(controller, plan), max(place, Place(profile.end))
            text = stopped(axis=shown) if _brakes(profile) else MOTION_ENDED(axis=shown, time=began / SECOND)
            names = ()
        elif _brakes(profile):
            text, cover = BEGAN_TO_BRAKE(axis=shown), Cover.MOTION
        else:
            text, cover = self._under_way(controller, plan, shown), Cover.MOTION

        def planned() -> FoundCause:
            found = self._all.controllers.in_controller(controller, plan, Resource(ResourceKind.AXIS, record.subject))
            return covered(self.followed(controller, record.subject, plan.time, plan.order, found), Cover.MOTION)

        def besides() -> Iterator[Cause]:
            if (mechanics or since is not None) and self._shortened(controller, plan) is None:
                yield from self._begun_from(controller, plan, since or 0)
            yield from self.settings(controller, of_limit, place.time, names)
            for one in self._all.controllers.acts_by(controller, plan, record.subject):
                found = self._acted_by(controller, record.subject, one, plan)
                if found is not None:
                    yield found
            yield from self._going_on(controller, plan, mechanics)

        return Cause(ChainLink(place.time, controller, text), place, planned, cover, besides)

    def _begun_from(self, controller: str, plan: Change, since: Nanos) -> Iterator[Cause]:
        """The motions from a moment on that brought an axis to where one by a distance, or with a velocity, began."""
        axis = self._log.record(plan).subject
        for _ in range(MOST_SUMMED):
            is_to_place = any(one.kind is ResourceKind.ORIGIN for one in self._all.controllers.acts_by(controller, plan, axis))
            end = self._end(plan)[0]
            events = self._log.axis_events.get((controller, axis), ())
            if is_to_place or any(one.time == end and self._log.record(one).subject == HOMED for one in events):
                return
            before = max(self._log.plans_in_force(controller, axis, plan.time, plan.order), key=self._end, default=None)
            found = None if before is None else self.motion(controller, axis, plan.time, before=plan.order)
            if before is None:
                self._log.lack()
            if before is None or found is None or found.place.time < since:
                return
            if found.cover is None:
                yield found._replace(cover=Cover.LEVEL)
            plan = before

    def _falls(self, controller: str, number: str, plan: Change, profile: Profile) -> bool:
        """Whether the load of an axis moves by itself when a motion of its pulses ends."""
        axis = self.driven(controller, number)
        end = plan.time if profile.end is None else max(plan.time, profile.end)
        falls = [one for one in self._log.mechanics.get(axis or "", ()) if self._log.record(one).subject == FALL]
        last = max((one for one in falls if one.time <= end), key=lambda one: (one.time, one.order), default=None)
        return last is not None and _begins(self._log.record(last))

    def _going_on(self, controller: str, plan: Change, mechanics: str) -> Iterator[Cause]:
        """The motion that a plan takes no farther."""
        is_shortened = self._shortened(controller, plan) is not None
        axis = self._log.record(plan).subject
        found = self.motion(controller, axis, plan.time, mechanics, plan.order) if is_shortened else None
        if found is not None:
            yield found._replace(cover=Cover.MOTION)

    def _shortened(self, controller: str, plan: Change) -> Change | None:
        """The plan of the motion under way that another one takes no farther: that ends it, or makes it in another way; None for
        a plan with a target of its own."""
        axis = self._log.record(plan).subject
        before = next(iter(self._log.plans_in_force(controller, axis, plan.time, plan.order)), None)
        if before is None:
            return None
        profile, other = profile_of(self._log.record(plan).plan()), profile_of(self._log.record(before).plan())
        is_over = not other.segments or (other.end is not None and other.end <= plan.time)
        if is_over or profile.start < plan.time or profile.end is None or other.start >= plan.time:
            return None
        way = other.segments[-1].direction
        farthest = math.inf if other.end is None else (other.base + other.final_p - profile.base) * way
        # Rounding may give a pulse more.
        return before if -1 <= profile.final_p * way <= farthest + 1 else None

    def _began(self, controller: str, plan: Change) -> Nanos:
        """When the motion began that a plan makes or ends."""
        shortened = self._shortened(controller, plan)
        if shortened is not None:
            return self._began(controller, shortened)
        record = self._log.record(plan)
        began = profile_of(record.plan()).start
        there = self._all.of(began) if self._log.was_before(plan) else None
        earlier = None if there is None else next(iter(there.log.plans_in_force(controller, record.subject, began)), None)
        return began if there is None or earlier is None else there.axes._began(controller, earlier)

    def _under_way(self, controller: str, plan: Change, shown: str) -> MessageText:
        """A motion that goes on, in words: an axis begins to move only where it was at rest before."""
        began, axis = self._began(controller, plan), self._log.record(plan).subject
        if began != plan.time:
            return MOTION_CHANGED(axis=shown, time=began / SECOND)
        before = next(iter(self._log.plans_in_force(controller, axis, plan.time, plan.order)), None)
        profile = None if before is None else profile_of(self._log.record(before).plan())
        moved = profile is not None and profile.start < plan.time and profile.moving(plan.time)
        return CHANGED_UNDER_WAY(axis=shown) if moved else BEGAN_TO_MOVE(axis=shown)

    def _acted_by(self, controller: str, axis: str, one: Resource, plan: Change) -> FoundCause:
        """Cause of something by which the command of a plan acts."""
        if one.kind is ResourceKind.ORIGIN:
            return self.origin(controller, axis, plan.time, plan.order)
        is_noted = self._log.points.series(f"{controller}.{one.name}") is not None
        if is_noted:
            return self._all.controllers.register(controller, one.name, None, plan.time, plan.order)
        return self._all.controllers.written(controller, one.name, plan.time, plan.order)

    def origin(self, controller: str, axis: str, until: Nanos, before: int = LAST) -> FoundCause:
        """The last change of the coordinate of an axis without a motion by a moment, before an order."""
        change = self._log.last_origin(controller, axis, until, before)
        if change is None:
            self._log.never_happened(f"coordinate of axis {axis}")
        wanted = Resource(ResourceKind.ORIGIN, axis)
        found = None if change is None else self._all.controllers.in_controller(controller, change, wanted, f"M{axis}_POS_ACT")
        return covered(found, Cover.LEVEL)

    def coordinate(self, controller: str, axis: str, until: Nanos) -> FoundCause:
        """Cause of the coordinate that an axis has at a moment: its motion, or who wrote it since; both, where it moved on."""
        origin = self.origin(controller, axis, until)
        motion = self.motion(controller, axis, until, since=0 if origin is None else origin.place.time)
        if origin is None and (motion is None or motion.place.time < self._log.begin):
            self._log.lack()  # it may have been written since, before the log
        motion = motion and self._rests(controller, axis, motion, until)
        if motion is None or origin is None or (motion.cover is None and motion.place < origin.place):
            return origin or motion
        first, other = (motion, origin) if motion.place > origin.place else (origin, motion)
        return first._replace(along=(*first.along, other._replace(cover=Cover.MOTION)))

    def settings(self, controller: str, axis: str, until: Nanos, names: Collection[str] = SETTINGS) -> Iterator[Cause]:
        """Who gave an axis the settings that it has at a moment, as far as they have changed."""
        there = self._all.of(until)
        if there is not self._all:
            yield from () if there is None else there.axes.settings(controller, axis, until, names)
            return
        wanted = Resource(ResourceKind.AXIS, axis)
        for name in names:
            point = f"M{axis}_{name}"
            is_noted = self._log.points.series(f"{controller}.{point}") is not None
            since = self._log.since(f"{controller}.{point}", until) if is_noted else None
            if since is not None and since < until and (then := self._all.of(since)) is not None:
                found = covered(then.controllers.at_moment(controller, since, wanted, point), Cover.LEVEL)
                if found is not None:
                    yield found
        plan = max(self._log.plans_in_force(controller, axis, until), key=self._end, default=None) if names == SETTINGS else None
        if plan is not None:
            yield from self._all.controllers.made_by(controller, plan)

    def soft_limit(self, controller: str, axis: str, end: Nanos, until: Nanos) -> str:
        """The register of the soft limit at which a motion has ended, its own or that of the other axis of its path; empty for
        another one."""
        there = self._all.of(end) if end <= until else None
        if there is not self._all:
            return "" if there is None else there.axes.soft_limit(controller, axis, end, until)
        others = self._log.plans_in_force(controller, "", end) if self._status(controller, axis, end) == REST else ()
        together = [self._log.record(one).subject for one in others if self._end(one)[0] == end]
        every = (axis, *(together if axis in together else ()))
        return next((f"M{one}_{name}" for one in every if (name := self._limit(controller, one, end)) is not None), "")

    def _limit(self, controller: str, axis: str, since: Nanos) -> str | None:
        """The soft limit at which an axis has been since a moment, by its status; None where that is of a limit switch."""
        event = self._log.last_axis_event(controller, axis, since)
        is_told = event is not None and event.time == since
        return None if is_told else LIMITS.get(self._status(controller, axis, since))

    def _status(self, controller: str, axis: str, at: Nanos) -> int:
        """The status of an axis at a moment; 0 where its controller has none."""
        series = self._log.points.series(f"{controller}.M{axis}_STATUS")
        return 0 if series is None else int(points.level(series, at))

    def not_beyond(self, controller: str, axis: str, until: Nanos, after: Nanos = -1) -> FoundCause:
        """The last command between two moments that a soft limit did not let begin, if the status of its axis says so since."""
        status, is_at_limit = f"M{axis}_STATUS", self._status(controller, axis, until) in LIMITS
        since = self._log.since(f"{controller}.{status}", until) if is_at_limit else None
        there = None if since is None or since <= after else self._all.of(since)
        name = None if since is None or there is None else there.axes._limit(controller, axis, since)
        if since is None or there is None or name is None or there.axes.ended(controller, axis, since):
            return None
        by = there.controllers.commanded_at(controller, since, Resource(ResourceKind.AXIS, axis), status)
        if by is None:
            return None
        text = NOT_BEYOND(axis=f"{controller}.M{axis}", limit=f"M{axis}_{name}")
        set_by = partial(there.axes.settings, controller, axis, since, (name,))
        place = by.place._replace(number=by.place.number + 1)
        return Cause(ChainLink(place.time, controller, text), place, lambda: by, Cover.LEVEL, set_by)

    def moved(
        self, axis: str, until: Nanos, before: int = LAST, *, is_held: bool = True, since: Nanos | None = None
    ) -> FoundCause:
        """Cause before an order that moved the load of an axis last, or left it where it is: a motion, the power of its motor
        meanwhile, or what keeps its rotor from following the motion. ``is_held``: also what does so since before the motion;
        ``since``: since when it stands, if that is known."""
        built = self._world.axes[axis]
        controller, number = built.spec.drive[0], built.spec.drive[1].removeprefix("M")
        motion, power = self.motion(controller, number, until, axis, before), self.power(axis, until)
        plan = max(self._log.plans_in_force(controller, number, until, before), default=None)
        began = -1 if plan is None else plan.time
        events = list(self._of_rotor(axis, until, before))
        led = [one for one in events if one.time >= began or (is_held and self.holds_rotor(one, events))]
        lasting = [one for one in led if _begins(self._log.record(one)) or self._has_left_it(one, since)]
        event = max(lasting, key=lambda one: (one.time, one.order), default=None)
        if event is None:
            self._log.never_happened(*EVENTS_OF_ROTORS)
        last = max((one.time for one in led), default=0)
        if event is not None and self._log.record(event).subject == FALL and not self.holds_rotor(event, events):
            event = None if motion is not None and motion.link.time > last else event  # its motion has gone on since
        rests = until if since is None else min(until, since + BRAKES_NS)
        is_off = power is not None and not self._log.level(self.power_of(axis), until)
        is_unpowered = power is not None and (is_off or motion is None or motion.link.time < power.link.time)
        if power is not None and is_unpowered:
            there = self._all if is_off else self._all.of(power.link.time) or self._all
            plans = there.log.plans_in_force(controller, number, until if is_off else power.link.time)
            ends = [there.axes._end(one)[0] for one in plans]
            is_unpowered = built.mechanism.build.coasts_unpowered or any(end > power.link.time for end in ends)
        if event is not None and not (is_unpowered and power is not None and self._is_after(power, event)):
            found = self.rotor_event(axis, event)
            return self._caught_by(axis, found, rests) if self._log.record(event).subject == FALL else found
        if event is not None and power is not None and not is_off and self._log.record(event).subject == FALL:
            others = (self._missed(axis, until) or power, covered(motion, Cover.LEVEL))  # it fell on until it was caught
            return self.rotor_event(axis, event)._replace(along=tuple(one for one in others if one is not None))
        if is_unpowered and power is not None:
            let_go = self._let_go(axis, power, rests)
            if 0 <= began < power.link.time and is_off:  # what is later of its motion moves nothing
                motion = self.motion(controller, number, power.link.time, axis)
            in_vain = [] if motion is None else [motion._replace(cover=Cover.LEVEL)]
            off = let_go._replace(along=(*let_go.along, *in_vain))
            return off if is_off else self._regained(axis, let_go, power, motion)
        lost = self._lost_by_fault(axis, until, before, LOSES_PULSES)
        if motion is None and lost is None:
            return self._all.attempts.last(controller, number, until, before)
        motion = motion and self._rests(controller, number, motion, until, before)
        motion = motion and motion._replace(along=(*motion.along, *self._lags(axis, until, before)))
        is_last = lost is not None and (motion is None or (motion.cover is None and lost.place > motion.place))
        return lost if is_last else motion

    def _lags(self, axis: str, until: Nanos, before: int) -> Iterator[Cause]:
        """The last event of a rotor by which it lost pulses, unless its axis was homed or got another coordinate since."""
        controller, name = self._world.axes[axis].spec.drive
        events = list(self._of_rotor(axis, until, before))
        end = next((one for one in reversed(events) if dict(self._log.record(one).facts).get("lost")), None)
        key = controller, name.removeprefix("M")
        homed = [one for one in self._log.axis_events.get(key, ()) if self._log.record(one).subject == HOMED]
        zeroed = max((one.time for one in (*homed, *self._log.origins.get(key, ())) if one.time <= until), default=0)
        lost = self._lost_by_fault(axis, until, before, LOSES_PULSES, since=zeroed)
        yield from (one for one in (lost, self._missed(axis, until, zeroed)) if one is not None)
        if end is None:
            return
        began = next((one for one in reversed(events) if one.time <= end.time and _begins(self._log.record(one))), None)
        if began is not None and (end.time > zeroed or not zeroed):
            yield self.rotor_event(axis, began)._replace(cover=Cover.LEVEL)

    def _has_left_it(self, event: Change, since: Nanos | None) -> bool:
        """Whether the end of an event of a rotor may have left it where it stands since a moment."""
        return self._log.record(event).subject != FALL and (since is None or event.time <= since)

    def _rests(self, controller: str, number: str, motion: Cause, until: Nanos, before: int = LAST) -> Cause:
        """A motion that may be over, along with later commands that moved nothing."""
        if motion.cover is not None:
            return motion
        later = self._all.attempts.last(controller, number, until, before, motion.place.time)
        return motion if later is None else later._replace(along=(*later.along, covered(motion, Cover.LEVEL), *motion.along))

    def _regained(self, axis: str, found: Cause, power: Cause, motion: FoundCause) -> Cause:
        """That a motor has power again, along with the loss of it, during which its motion went on, and with that motion."""
        lost = self._missed(axis, power.place.time) or self.power(axis, power.place.time, power.place.order)
        others = (lost, covered(motion, Cover.LEVEL))
        return found._replace(along=(*found.along, *(one for one in others if one is not None)))

    def _missed(self, axis: str, until: Nanos, since: Nanos = -1) -> FoundCause:
        """The last time without power between two moments, over by then, in which the pulses of an axis went on."""
        signal, (controller, name) = self.power_of(axis), self._world.axes[axis].spec.drive
        back = self.power(axis, until) if signal else None
        for _ in range(MOST_SUMMED):
            lost = None if back is None else self.power(axis, back.place.time, back.place.order)
            there = None if back is None else self._all.of(back.place.time)
            if back is None or lost is None or there is None or not since < back.place.time or lost.place >= back.place:
                return None
            time, begin = back.place.time, lost.place.time
            plans = there.log.plans_in_force(controller, name.removeprefix("M"), time) if there.log.level(signal, time) else ()
            if any(there.axes._end(one)[0] > begin and there.axes.moves(one) for one in plans):
                text, place = HAD_NO_POWER(axis=axis, begin=begin / SECOND), back.place._replace(number=back.place.number + 1)
                return Cause(ChainLink(time, axis, text), place, partial(along, back, [lost]), Cover.LEVEL)
            back = lost
        return None

    def moves(self, plan: Change) -> bool:
        """Whether a plan is one of a motion."""
        return bool(profile_of(self._log.record(plan).plan()).segments)

    def _is_after(self, power: Cause, event: Change) -> bool:
        """Whether a change of power comes after an event of a rotor: what falls by it is recorded before it."""
        if self._log.record(event).subject == FALL:
            return power.place.time > event.time
        return power.place > Place(event.time, event.order)

    def power(self, axis: str, until: Nanos, before: int = LAST) -> FoundCause:
        """The last change by a moment, before an order, of the output that gives the motor of an axis power; None for one that
        always has some."""
        signal = self.power_of(axis)
        found = self._all.last((signal,), until, GIVES_POWER(axis=axis), before) if signal else None
        if signal and found is None and (not self._log.level(signal, until) or self._log.before(signal).since is not None):
            found = self._all.first(signal, GIVES_POWER(axis=axis))  # since before the log, or it has never had any
        return covered(found, Cover.MOTION)

    def _let_go(self, axis: str, power: Cause, until: Nanos) -> Cause:
        """The last that let an axis without power move, or held it: its power or a brake, along with the others."""
        first, *others = sorted((power, *self._brakes(axis, until)), key=lambda one: one.place, reverse=True)
        return first._replace(along=tuple(others))

    def _caught_by(self, axis: str, fall: Cause, until: Nanos) -> Cause:
        """A fall, along with what its brakes did after it."""
        after = [one for one in self._brakes(axis, until) if one.place > fall.place]
        first, *others = sorted((fall, *after), key=lambda one: one.place, reverse=True)
        return first._replace(along=(*first.along, *others))

    def _brakes(self, axis: str, until: Nanos) -> Iterator[Cause]:
        """The last changes of the brakes of an axis."""
        brakes = [name for name, spec in self._all.specs.items() if isinstance(spec, BrakeSpec) and spec.axis == axis]
        found = (covered(self._all.last((f"{name}.{RELEASED.lower()}",), until), Cover.MOTION) for name in brakes)
        yield from (one for one in found if one is not None)

    def power_of(self, axis: str) -> str:
        """The output that gives the motor of an axis power; empty for one that always has some."""
        power = self._world.axes[axis].spec.power
        return "" if power is None else self._all.name(PinName(*power))

    def kept(self, axis: str, begun: Nanos, error: Change) -> FoundCause:
        """Cause that keeps the rotor of an axis from the motion that began at a moment: its power, a stall, a stop, a fault."""
        found = self.moved(axis, error.time, error.order)
        is_motion = found is not None and found.link.subject == self._world.axes[axis].spec.drive[0] and found.link.root is None
        blocked = self._lost_by_fault(axis, error.time, error.order, IS_BLOCKED, LOSES_PULSES, since=begun)
        held = [one for one in (None if is_motion else found, blocked) if one is not None]
        return covered(max(held, key=lambda one: one.place, default=None), Cover.MOTION)

    def slipped(self, axis: str, until: Nanos, subjects: Collection[str] = OF_MECHANICS) -> FoundCause:
        """The last event by a moment after which the rotor of an axis is elsewhere than counted; its motion, if there is none."""
        events = (one for one in self._of_rotor(axis, until) if self._log.record(one).subject in subjects)
        event = max(events, key=lambda one: (one.time, one.order), default=None)
        if event is None:
            self._log.never_happened(*EVENTS_OF_ROTORS)
        found = None if event is None else self.rotor_event(axis, event)
        lost = self._lost_by_fault(axis, until, LAST, LOSES_PULSES, IS_BLOCKED)
        missed = self._missed(axis, until) if subjects is OF_MECHANICS else None
        if missed is not None:
            controller, name = self._world.axes[axis].spec.drive
            motion = covered(self.motion(controller, name.removeprefix("M"), missed.place.time, axis), Cover.MOTION)
            missed = along(missed, [motion])
        last = max((one for one in (found, lost, missed) if one is not None), key=lambda one: one.place, default=None)
        return self.moved(axis, until) if last is None else last

    def is_moving(self, controller: str, axis: str, time: Nanos) -> bool:
        """Whether an axis moves until a moment, or longer."""
        return any(self._end(plan)[0] >= time for plan in self._log.plans_in_force(controller, axis, time))

    def ended(self, controller: str, axis: str, time: Nanos) -> bool:
        """Whether a motion of an axis that began earlier ended at a moment."""
        return any(plan.time < time == self._end(plan)[0] for plan in self._log.plans_in_force(controller, axis, time))

    def _of_rotor(self, axis: str, until: Nanos, before: int = LAST) -> Iterator[Change]:
        """Events by a moment, before an order, after which a rotor does not follow its motion, or does again: of its motor, its
        stops, and what jams it before its motion has ended."""
        controller, name = self._world.axes[axis].spec.drive
        plans = self._log.plans_in_force(controller, name.removeprefix("M"), until, before)
        end = max((self._end(plan)[0] for plan in plans), default=0)
        jams = (one for one in self.jams(axis) if one.time <= end)
        every = (*self._log.mechanics.get(axis, ()), *jams)
        return (one for one in every if (one.time, one.order) < (until, before))

    def jams(self, name: str) -> Iterator[Change]:
        """Events of the collisions that jam an axis or element."""
        for one in self.is_jammed_by(name):
            yield from self._log.mechanics.get(one, ())

    def is_jammed_by(self, name: str) -> Sequence[str]:
        """The collisions and pushers that can jam an axis or element."""
        specs, moves = self._all.specs.items(), f"{name}.{POSITION}"
        jam = [one for one, spec in specs if getattr(spec, "effect", None) == JAM or getattr(spec, "pushes", False)]
        return [one for one in jam if moves in self._all.elements.followed(one)]

    def holds_rotor(self, event: Change, events: Sequence[Change]) -> bool:
        """Whether a rotor has not followed its motion since an event of it."""
        record = self._log.record(event)
        last = max((one for one in events if self._is_like(self._log.record(one), record)), key=lambda one: (one.time, one.order))
        return last is event and _begins(record)

    def _is_like(self, one: TraceRecord, other: TraceRecord) -> bool:
        return one.subject == other.subject and dict(one.facts)["element"] == dict(other.facts)["element"]

    def rotor_event(self, axis: str, event: Change) -> Cause:
        """An event of a rotor, whose cause is what led to it."""
        record = self._log.record(event)
        owner = str(dict(record.facts)["element"])
        condition = getattr(self._all.specs.get(owner), "when", None) if _begins(record) else None
        text = AS(what=words_of(record), condition=condition) if condition else words_of(record)
        if owner == axis:
            before = partial(self._of_rotor_event, axis, event, begins=_begins(record))
        else:
            before = partial(self._all.elements.of_followed, owner, event)
        return Cause(ChainLink(event.time, owner, text), Place(event.time, event.order), before, Cover.MOTION)

    def _of_rotor_event(self, axis: str, event: Change, *, begins: bool) -> FoundCause:
        """The field that a rotor followed no longer, or the command with which it follows again."""
        controller, name = self._world.axes[axis].spec.drive
        wanted = Resource(ResourceKind.AXIS, name.removeprefix("M"))
        motion = self.motion(controller, wanted.name, event.time, axis)
        command = None if begins else self._all.controllers.commanded(controller, event, wanted)
        if command is not None:
            return command
        falls = self._log.record(event).subject == FALL
        found: list[FoundCause] = list(self._that_load(axis, event, falls=falls)) if begins else []
        if begins and motion is not None and motion.place.time == event.time:  # recorded after what it leads to at once
            found.append(motion._replace(place=min(motion.place, Place(event.time, event.order, -1))))
        else:
            current = self._without_current(axis, event) if falls else None
            led = current or self.moved(axis, event.time, event.order, is_held=begins)
            is_weak = words_of(self._log.record(event)).id == MOVES_WITH_LITTLE_CURRENT.id
            found += [covered(led, Cover.LEVEL), self._holding(axis, event)] if is_weak else [led]
        first, *others = sorted((one for one in found if one is not None), key=lambda one: one.place, reverse=True) or (None,)
        return None if first is None else first._replace(along=(*first.along, *others))

    def _that_load(self, axis: str, event: Change, *, falls: bool) -> Iterator[Cause]:
        """The loads and brakes that an axis stalls or falls by at an event, as they changed last: those that act, or do not act
        any more since that moment; and of a fall those that let go."""
        for name, spec in self._all.specs.items():
            if not isinstance(spec, LoadSpec | BrakeSpec) or spec.axis != axis:
                continue
            is_brake = isinstance(spec, BrakeSpec)
            signal = f"{name}.{(RELEASED if is_brake else ACTS).lower()}"
            change = self._log.last_change(signal, event.time, event.order)
            if change is None:
                self._log.lack()
            level = self._log.first_levels.get(signal, 0.0) if change is None else change.value
            counts = bool(level) is (falls or not is_brake) or (change is not None and change.time == event.time)
            if counts and change is not None:
                yield covered(self._all.change(signal, change), Cover.LEVEL) or self._all.change(signal, change)
            elif counts:
                yield self._all.first(signal)._replace(cover=Cover.LEVEL)
                keeping = self._all.holding.of([signal], event.time - 1, None) if event.time else ()
                yield from (one._replace(cover=one.cover or Cover.LEVEL) for one in keeping)

    def _holding(self, axis: str, event: Change) -> Cause:
        """The torque of a motor that has current when its load turns it at rest, and where the description has that."""
        built, (controller, name) = self._world.axes[axis], self._world.axes[axis].spec.drive
        motor, spec = built.mechanism.build.motor, built.spec.motor
        plans = self._log.plans_in_force(controller, name.removeprefix("M"), event.time, event.order)
        on = self._all.last([one for one in (self.power_of(axis), f"{controller}.{name}_EN") if one], event.time)
        rests = max(max((self._end(one)[0] for one in plans), default=0), 0 if on is None else on.place.time)
        is_reduced = motor.hold < 1.0 and event.time >= rests + motor.hold_ns
        key, torque = ("hold_current", motor.hold * motor.holding) if is_reduced else ("torque", motor.holding)
        text = HOLDS(axis=axis, torque=torque, key=key, where=self._world.spec.text.where((*spec.path, key)))
        return Cause(ChainLink(event.time, axis, text), Place(event.time, event.order, -1), nothing)

    def _without_current(self, axis: str, event: Change) -> FoundCause:
        """The last that took the current of a motor by an event: its power, or its controller."""
        controller, name = self._world.axes[axis].spec.drive
        signals = [one for one in (self.power_of(axis), f"{controller}.{name}_EN") if one and self._log.has(one)]
        off = [one for one in signals if not self._log.level(one, event.time)]
        self._log.lack()
        found = self._all.last(off, event.time, GIVES_POWER(axis=axis))
        if found is None and off:
            found = self._all.first(off[0], GIVES_POWER(axis=axis))
        if found is not None:  # a change of the same moment is recorded after what it leads to
            found = found._replace(place=min(found.place, Place(event.time, event.order, -1)))
        return covered(found, Cover.LEVEL)

    def _lost_by_fault(self, axis: str, until: Nanos, before: int, *kinds: Message, since: Nanos = 0) -> FoundCause:
        """The last fault by a moment, before an order, that was reported as one of ``kinds`` at an axis and was not over before
        ``since``."""
        controller, name = self._world.axes[axis].spec.drive
        for change in reversed(self._log.faults.get(controller, ())):
            record = self._log.record(change)
            text = record.value
            if not isinstance(text, MessageText) or text.id not in {kind.id for kind in kinds}:
                continue
            lasts = text.values.get("time", 0.0)
            if isinstance(lasts, float) and change.time + round(lasts * SECOND) < since:
                continue
            if name == f"M{text.values['axis']}" and (change.time, change.order) < (until, before):
                older = self._all.of_fault(record, change.order)
                return Cause(self._all.fault_link(record), Place(change.time, change.order), older, Cover.FAULT)
        self._log.lack_faults()
        return None

    def counted(self, controller: str, number: str, until: Nanos, before: int = LAST, index: int | None = None) -> FoundCause:
        """The last by a moment, before an order, that changed what the counter of an encoder shows: what turned it, or the
        statement before ``index`` that wrote it."""
        end = self._log.last_executed(controller, until) + 1 if index is None else index
        written = self._all.programs.written(controller, Resource(ResourceKind.ENCODER, number), end)
        turned = self._turned(controller, number, until, before) or self._turned_by_drive(controller, number, until, before)
        if written is None or (turned is not None and turned.cover is Cover.MOTION and turned.link.time == turned.place.time):
            return turned or written
        return max((one for one in (written, turned) if one is not None), key=lambda one: one.place)

    def followed(self, controller: str, number: str, time: Nanos, before: int, found: FoundCause) -> FoundCause:
        """Cause that turned the encoder which an axis follows, unless one at the moment is ``found``."""
        inputs = self._world.kind(controller).encoders
        is_over = found is None or found.place.time < time
        if inputs is None or not number or not is_over or not inputs.is_followed(self._world.controller(controller), int(number)):
            return found
        turned, axis = self._turned(controller, number, time, before), self.driven(controller, number)
        follows = None if axis is None else self._encoder_of(axis)
        here = Place(time, before, -1)
        if turned is None or follows is None or turned.place >= here:
            return turned or found
        link = ChainLink(time, controller, FOLLOWS_ENCODER(axis=axis, name=follows))
        return Cause(link, here, lambda: covered(turned, Cover.MOTION))

    def _encoder_of(self, axis: str) -> str | None:
        """The name of what turns the encoder of an axis instead of the axis; None for its own."""
        follows = getattr(self._world.axes[axis].spec.encoder, "follows", None)
        return follows if isinstance(follows, str) else None

    def _turned(self, controller: str, number: str, until: Nanos, before: int) -> FoundCause:
        """The thing other than its own axis that turned an encoder last by a moment: another axis, a belt, a motor, a hand."""
        turned = (
            act
            for act in self._log.acts_before(until, before)
            if isinstance(act.what, do.Turn) and (act.what.controller, str(act.what.axis)) == (controller, number)
        )
        found = [covered(self._all.scripts.acted(act), Cover.LEVEL) for act in turned][:1]
        if not found:
            self._log.lack()
        axis = self.driven(controller, number)
        follows = None if axis is None else self._encoder_of(axis)
        if follows is not None and follows in self._world.axes:
            found.append(self.moved(follows, until, before))
        elif follows is not None:
            found.append(self._all.workpieces.turns(follows, Change(until, 0.0, -1, 0, before)))
        return max((one for one in found if one is not None), key=lambda one: one.place, default=None)

    def _turned_by_drive(self, controller: str, number: str, until: Nanos, before: int) -> FoundCause:
        """The motion of its own axis that turned an encoder last; None for one that something else, or nothing, turns."""
        axis = self.driven(controller, number)
        if axis is not None:
            return self.moved(axis, until, before) if self._encoder_of(axis) is None else None
        acts = self._log.acts_before(until, before)
        coupled = (act.what for act in acts if isinstance(act.what, do.Couple) and act.what.controller == controller)
        coupling = next((what.coupling for what in coupled if str(what.axis) == number), None)
        inputs = self._world.kind(controller).encoders
        if coupling is None and inputs is not None:
            found = inputs.to_json(self._world.controller(controller), self._world.now)
            coupling = next((str(one["turned_by"]) for one in found if str(one["axis"]) == number), None)
        return self.motion(controller, number, until, before=before) if coupling == do.COUPLINGS[0] else None

    def driven(self, controller: str, number: str) -> str | None:
        """The name of the axis that a controller drives; None for one without mechanics."""
        axes = self._world.axes.items()
        return next((name for name, axis in axes if axis.spec.drive == (controller, f"M{number}")), None)

    def _end(self, plan: Change) -> tuple[float, Nanos]:
        """When the motion of a plan ends, which may be never; of several at once, the one planned last."""
        profile = profile_of(self._log.record(plan).plan())
        if not profile.segments:
            return plan.time, plan.time
        return math.inf if profile.end is None else profile.end, plan.time


def _brakes(profile: Profile) -> bool:
    """Whether a motion gets slower from its beginning on and never faster, until it stands."""
    begins = (0.0, *(one.end_s for one in profile.segments))
    slowing = [
        abs(one.velocity(begin)) - abs(one.velocity(one.end_s)) for begin, one in zip(begins, profile.segments, strict=False)
    ]
    return not slowing or (profile.end is not None and slowing[0] > 0.0 and min(slowing) >= 0.0)


def _begins(record: TraceRecord) -> bool:
    """Whether a rotor does not follow its motion from an event on."""
    facts = dict(record.facts)
    return facts.get("what") == JAMS[0] or any(facts.get(one) is True for one in ("stalled", "pushes", "touches", "falls"))
