"""The true position of an axis while its drive follows one plan, in closed form from its initial state.

All positions are whole pulses in the frame of the mechanics, whose zero is given by the description of the axis. The *field* is
the commanded position. The *rotor* follows the field, less the lost pulses, and stops where a hard stop or insufficient torque
holds it. The *load* follows the rotor through backlash of ``play`` pulses: it is at the rotor after upward motion, and ``play``
above it after downward motion. One that a constant torque pulls, more than friction holds, lies on one side of the play all the
time (`Build.lies`), but where a hard stop holds it.

A rotor that was held synchronises at the nearest position with the electrical angle of the field as soon as the field stops or
reverses: the loss is a whole number of electrical periods (four full steps). If that position is up to two full steps before a
stop, the rotor springs back to it; if it is beyond the stop, the rotor leaves the stop when the field has returned that far.

The torque of the field on a rotor that lags by x is T·sin(2π·x/λ), λ being an electrical period, four full steps::

    lag       −λ/2           0          +λ/2          +λ         +3λ/2
    torque      0  pulls →   0  ← pulls   0  pulls →   0  ← pulls   0
             unstable     stable      unstable      stable     unstable

So it settles at the nearest multiple of λ, which is at most λ/2 away: two full steps.

Between two reversals of the field, rotor and load are constant or have a constant distance to the field: a trajectory is a list
of such sections. While the rotor of a `Build.coasts_unpowered` axis has no current, or has lost its field, its motion
(`steptwin.simulation.mechanics.coasting`) is in the place of the field, and the load keeps its distance to the rotor.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from dataclasses import dataclass
from math import ceil, inf
from operator import attrgetter
from typing import NamedTuple

from steptwin.controller import SECOND, Nanos
from steptwin.messages import Message, MessageText
from steptwin.motion import Profile, Segment
from steptwin.motion.divisions import Plan, profile_of
from steptwin.points import turning_points_of
from steptwin.simulation.mechanics.motor import StepperMotor
from steptwin.simulation.mechanics.pullout import Pullout
from steptwin.simulation.mechanics.resonance import ResonanceInterval, resonance_intervals

UNFOLLOWED = Message("simulation.no-longer-follows", "it no longer follows its field")


@dataclass(frozen=True, slots=True)
class Build:
    """Construction data of an axis, in pulses of the mechanics."""

    sign: int = 1
    """Direction for positive pulses."""
    zero: int = 0
    """Position of the axis at count 0 of its drive."""
    low: int | None = None
    high: int | None = None
    """Hard stops of the load."""
    play: int = 0
    period_p: int = 1
    """Electrical period of the motor (four full steps): pulses are lost in multiples of it."""
    motor: StepperMotor | None = None
    coasts_unpowered: bool = False
    """Whether the load moves the rotor while no current does."""
    may_lose_power: bool = False
    """Whether something besides the controller can take the current from the motor."""

    @property
    def lies(self) -> int | None:
        """How far above the rotor a load lies that a constant torque pulls: 0, or the play; None: where motion has left it."""
        motor = self.motor
        if not self.play or motor is None or abs(motor.load) <= motor.friction:
            return None
        return 0 if motor.load > 0.0 else self.play

    def load_at(self, rotor: int, load: int) -> int:
        """Where the load is that was at ``load`` before its rotor came to ``rotor``."""
        lies = self.lies
        if lies is None:
            return min(max(load, rotor), rotor + self.play)
        place = rotor + lies
        if self.low is not None:
            place = max(place, self.low)
        return place if self.high is None else min(place, self.high)

    @property
    def may_coast(self) -> bool:
        """Whether the rotor may move otherwise than its field."""
        return self.coasts_unpowered or (self.motor is not None and self.motor.overruns)

    @property
    def ideal(self) -> bool:
        """Whether the load is always at the position of the field."""
        is_free = self.low is None and self.high is None and self.play == 0
        return is_free and self.motor is None and not self.may_lose_power


class MechanicalState(NamedTuple):
    """State of an axis at a moment."""

    rotor: int
    load: int
    stalled: bool = False
    """Whether the motor has stalled."""
    behind: int = 0
    """Distance of the rotor's equilibrium position behind the field. The rotor is there unless something holds it."""


class TrajectorySection(NamedTuple):
    """From ``begin`` on the rotor is the field (or the coasting motion) and ``rotor``, or at ``rotor``; likewise the load."""

    begin: Nanos
    direction: int
    rotor_follows: bool
    rotor: int
    load_follows: bool
    load: int
    stalled: bool
    behind: int
    stop: int = 0
    """The hard stop against which the field draws the rotor: 1 upper, -1 lower, 0 neither."""


class LoadSection(NamedTuple):
    """From ``begin`` on the load is ``pulses`` from where the drive has counted to (``follows``), or stands at ``pulses``.

    In pulses of the drive, whose direction and zero it has.
    """

    begin: Nanos
    follows: bool
    pulses: int


STALLS_BY_RESONANCE = Message("simulation.stalls-by-resonance", "{axis} stalls by resonance")
STALLS = Message("simulation.stalls", "{axis} stalls: {why}")
NEEDS_AT_ONCE = Message(
    "simulation.needs-at-once", "the motion needs {need:.3g} N·m at once, more than the rotor can follow of {has:.3g} N·m"
)


class Trajectory:
    """The motion of an axis from ``begin`` on while ``plan`` is in force; immutable.

    ``blocked``: nothing moves the rotor. ``coasting``: its motion without current, in pulses of the drive.
    """

    __slots__ = (
        "_amplitude",
        "_given",
        "_laid",
        "_needed",
        "_now",
        "_resonance_intervals",
        "_settles_s",
        "_shaken",
        "_state",
        "_surprised",
        "begin",
        "blocked",
        "build",
        "coasting",
        "plan",
    )

    def __init__(
        self,
        build: Build,
        plan: Plan,
        begin: Nanos,
        state: MechanicalState,
        *,
        blocked: bool = False,
        jump: float = 0.0,
        coasting: Profile | None = None,
        vibration: float = 0.0,
        needed: float | None = None,
    ) -> None:
        """``jump``: by how much (pulses/s) the speed of the field changes at once at ``begin``. ``vibration`` in full steps.
        ``needed``: the torque that the motion needed until then, N·m; None: as at rest."""
        self.build = build
        self.plan = plan
        self.begin = begin
        self.blocked = blocked
        self.coasting = coasting
        self._laid: list[TrajectorySection] = []
        motor = build.motor
        self._given = self._needed = needed if needed is not None or motor is None else motor.load
        self._settles_s = -inf
        """Until then the rotor is known to keep the field, s of the profile."""
        self._surprised: dict[Nanos, MessageText] = {}
        """Why it loses the field where the torque would suffice if it did not rise at once."""
        self._resonance_intervals: list[ResonanceInterval] = []
        self._amplitude = vibration if motor is None or motor.resonance is None else max(vibration, motor.resonance.least)
        self._shaken: list[Nanos] = []
        if motor is not None and not motor.follows(jump) and profile_of(plan).moving(begin):
            state = state._replace(stalled=True)
        self._state = self._now = state

    # ------------------------------------------------------------------ questions

    @property
    def sections(self) -> list[TrajectorySection]:
        """Computed on first use."""
        if not self._laid:
            self._lay(self.begin)
        return self._laid

    @property
    def is_exact(self) -> bool:
        """Whether not a pulse is lost, before or on this trajectory."""
        begin = self._state
        if self.blocked or self.coasting is not None or begin.rotor != self.field(self.begin):
            return False
        build, profile = self.build, profile_of(self.plan)
        if build.ideal or not profile.segments:
            return True
        return all(p.rotor_follows or (profile.end is not None and p.begin >= profile.end) for p in self.sections) and (
            profile.end is None or self.at(profile.end).rotor == self.field(profile.end)
        )

    def field(self, now: Nanos) -> int:
        return self.build.sign * self.plan.count(now) + self.build.zero

    def moves(self, now: Nanos) -> bool:
        """Whether what the rotor follows moves."""
        return (profile_of(self.plan) if self.coasting is None else self.coasting).moving(now)

    def leads(self, now: Nanos) -> bool:
        """Whether the rotor goes with that."""
        return self._section(now).rotor_follows

    def carries(self, now: Nanos) -> bool:
        """Whether the load goes with that."""
        return self._section(now).load_follows

    def is_in_field(self, now: Nanos) -> bool:
        """Whether the field leads the rotor, or holds it at rest at the place that it has in the field."""
        section = self._section(now)
        if self.coasting is not None or section.stalled or self.blocked:
            return False
        is_there = section.stop == 0 and self.field(now) - section.behind == section.rotor
        return section.rotor_follows or (is_there and not self.moves(now))

    def _lead(self, now: Nanos) -> int:
        """Position that the rotor follows: that of the field, or of the coasting motion."""
        return self.field(now) if self.coasting is None else self.build.sign * self.coasting.count(now) + self.build.zero

    def at(self, now: Nanos) -> MechanicalState:
        """Where everything is at ``now``, not before ``begin``."""
        section = self._section(now)
        lead = self._lead(now) if section.rotor_follows or section.load_follows else 0
        rotor = section.rotor + lead if section.rotor_follows else section.rotor
        load = section.load + lead if section.load_follows else section.load
        return MechanicalState(rotor, load, section.stalled, section.behind)

    def load_at(self, now: Nanos) -> int:
        """The load of `at` alone, which is read most."""
        section = self._section(now)
        if not section.load_follows:
            return section.load
        plan = self.plan if self.coasting is None else self.coasting
        return section.load + self.build.sign * plan.count(now) + self.build.zero

    def position(self, now: Nanos) -> float:
        """Where the load is, between whole pulses as well."""
        section = self._section(now)
        if not section.load_follows:
            return float(section.load)
        lead = profile_of(self.plan) if self.coasting is None else self.coasting
        return section.load + (self.build.zero + self.build.sign * lead.position(now))

    def reaches(self, position: int, after: Nanos, direction: int, *, rotor: bool = False) -> Nanos | None:
        """First moment > ``after`` at which the load (or the rotor) has come to ``position`` in ``direction``, or beyond."""
        first = max(bisect_right(self.sections, after, key=attrgetter("begin")) - 1, 0)
        for i in range(first, len(self.sections)):
            section = self.sections[i]
            end = self.sections[i + 1].begin if i + 1 < len(self.sections) else None
            follows, value = (section.rotor_follows, section.rotor) if rotor else (section.load_follows, section.load)
            if section.begin > after:
                here = value + self._lead(section.begin) if follows else value
                if (here - position) * direction >= 0:
                    return section.begin
            if follows and section.direction == direction:
                time = self._time(position - value, max(after, section.begin))
                if time is not None and (end is None or time < end):
                    return time
        return None

    def turning_points(self, now: Nanos) -> list[Nanos]:
        """Moments after ``now``, in order, between which field, rotor and load each go one way."""
        found = {section.begin for section in self.sections if section.begin > now}  # a segment of the field begins one at least
        if self.coasting is not None:
            found.update(turning_points_of(lambda: profile_of(self.plan))(now))
        return sorted(found)

    def next_stall(self, after: Nanos) -> Nanos | None:
        """First moment > ``after`` at which the rotor loses the field or is caught again."""
        stalled = self._section(after).stalled
        return next(
            (section.begin for section in self.sections if section.begin > after and section.stalled is not stalled), None
        )

    def stop(self, now: Nanos) -> int:
        """The hard stop against which the field draws the rotor, as in `TrajectorySection`."""
        return self._section(now).stop

    def next_stop(self, after: Nanos) -> Nanos | None:
        """First moment > ``after`` at which that changes."""
        stop = self._section(after).stop
        return next((section.begin for section in self.sections if section.begin > after and section.stop != stop), None)

    def vibration(self, now: Nanos) -> float:
        """The amplitude of the rotor about the field, full steps; 0 where no resonance is described."""
        motor = self.build.motor
        if motor is None or motor.resonance is None or not self.sections or not self._resonance_intervals:
            return self._amplitude
        now_s = (now - profile_of(self.plan).start) / SECOND
        before = max(bisect_right(self._resonance_intervals, now_s, key=attrgetter("begin_s")) - 1, 0)
        return self._resonance_intervals[before].at(max(now_s, self._resonance_intervals[before].begin_s), motor.resonance.least)

    def stall_of(self, axis: str, now: Nanos) -> MessageText:
        """The message that the rotor of ``axis`` loses the field in this moment, with its reason."""
        motor, profile = self.build.motor, profile_of(self.plan)
        if now in self._shaken:
            return STALLS_BY_RESONANCE(axis=axis)
        part = bisect_right(profile.ends, now - profile.start)
        if motor is None or part >= len(profile.segments):
            return STALLS(axis=axis, why=UNFOLLOWED())
        lack = motor.lack(profile.segments[part], (now - profile.start) / SECOND, self.build.sign)
        return STALLS(axis=axis, why=lack or self._surprised.get(now) or UNFOLLOWED())

    def needs(self, now: Nanos) -> float | None:
        """The torque that the motion needs just before ``now``, N·m; None where no field leads the rotor."""
        motor, profile = self.build.motor, profile_of(self.plan)
        if motor is None or self.coasting is not None or self._section(now).stalled:
            return None
        if now <= self.begin:
            return self._given
        part = bisect_left(profile.ends, now - profile.start)
        if now <= profile.start or part >= len(profile.segments):
            return motor.load
        return motor.need_at(profile.segments[part], (now - profile.start) / SECOND, self.build.sign)

    def load_sections(self) -> tuple[LoadSection, ...]:
        """Where the load is, with as few entries as possible; for a drive at rest the distance of the load from it."""
        build, end = self.build, profile_of(self.plan).end
        found: list[LoadSection] = []
        for section in self.sections:
            if section.load_follows:
                now = LoadSection(section.begin, True, section.load * build.sign)
            elif end is not None and section.begin >= end:
                now = LoadSection(section.begin, True, (section.load - self.field(section.begin)) * build.sign)
            else:
                now = LoadSection(section.begin, False, (section.load - build.zero) * build.sign)
            if found and found[-1].begin == now.begin:
                found.pop()
            if not found or found[-1][1:] != now[1:]:
                found.append(now)
        return tuple(found)

    def _section(self, now: Nanos) -> TrajectorySection:
        sections = self._laid or self.sections
        after = bisect_left(sections, (now + 1,))
        return sections[after - 1 if after else 0]

    def _time(self, lead: int, after: Nanos) -> Nanos | None:
        return (self.plan if self.coasting is None else self.coasting).pulse_time(
            (lead - self.build.zero) * self.build.sign, after
        )

    # ------------------------------------------------------------------ laying out the sections

    def _lay(self, begin: Nanos) -> None:
        if self.coasting is not None:
            self._lay_coasting(self.coasting)
            return
        profile = profile_of(self.plan)
        if self._keeps_distance(profile):
            self._lay_at_distance(profile)
            return
        at = profile.start
        for part, end in enumerate(profile.ends):
            until = None if end == inf else profile.start + int(end)
            if until is None or until > begin:
                self._segment(part, max(at, begin), until)
            at = at if until is None else until
        if profile.end is not None:
            rest = max(profile.end, begin)
            motor = self.build.motor
            if motor is not None and motor.resonance is not None:
                self._resonance_intervals.append(
                    ResonanceInterval((rest - profile.start) / SECOND, self._amplitude, -motor.resonance.fading)
                )
            if not self.blocked and (not self._now.stalled or motor is None or motor.holds()):
                self._catch(rest)
            self._stand(rest, 1)

    def _keeps_distance(self, profile: Profile) -> bool:
        """Whether rotor and load are one, keep their distance to the field and meet no stop."""
        build, (rotor, load, stalled, behind) = self.build, self._state
        if build.motor is not None or build.play or self.blocked or stalled or rotor != load:
            return False
        if self.field(self.begin) - behind != rotor:
            return False
        if build.low is None and build.high is None:
            return True
        if profile.end is None:
            return False
        places = [build.sign * (profile.base + count) + build.zero - behind for count in profile.counts]
        return (build.low is None or min(places) >= build.low) and (build.high is None or max(places) <= build.high)

    def _lay_at_distance(self, profile: Profile) -> None:
        """Lay the sections where nothing can come between field, rotor and load: most axes, most of the time."""
        behind = self._state.behind
        for begin, direction in profile.legs(self.begin):
            self._laid.append(TrajectorySection(begin, direction * self.build.sign, True, -behind, True, -behind, False, behind))
        if profile.end is not None:
            rest = max(profile.end, self.begin)
            here = self.field(rest) - behind
            self._laid.append(TrajectorySection(rest, 1, False, here, False, here, False, behind))

    def _lay_coasting(self, coasting: Profile) -> None:
        """The rotor goes with the coasting motion, the load keeps its distance to it."""
        rotor, load, stalled, behind = self._state
        away = load - rotor
        for moment, direction in coasting.legs(self.begin):
            self._laid.append(TrajectorySection(moment, direction * self.build.sign, True, 0, True, away, stalled, behind))
        if coasting.end is not None:
            rest = self._lead(coasting.end)
            self._laid.append(
                TrajectorySection(max(coasting.end, self.begin), 1, False, rest, False, rest + away, stalled, behind)
            )

    def _segment(self, part: int, begin: Nanos, end: Nanos | None) -> None:
        """Lay the sections while the field goes one way, in one segment of its profile."""
        start, s = profile_of(self.plan).start, profile_of(self.plan).segments[part]
        direction = s.direction * self.build.sign
        motor = self.build.motor
        if self.blocked:
            self._stand(begin, direction)
            return
        if motor is None:
            self._follow(begin, end, direction)
            return
        end_s = inf if end is None else (end - start) / SECOND
        now, caught, lost = begin, None, None
        is_steady = isinstance(s, Segment) and s.c2 == s.c3 == 0.0
        while True:
            before, now_s = now, (now - start) / SECOND
            if self._now.stalled:
                found = motor.catches(s, now_s, end_s, self.build.sign)
                if found is None or max(now, start + ceil(found * SECOND)) == lost:
                    self._stand(now, direction)
                    return
                now = caught = max(now, start + ceil(found * SECOND))
                if now > before:
                    self._stand(before, direction)
                self._catch(now)
                self._needed = None
            else:
                found = self._loses(motor, part, now_s, end_s)
                if found is None:
                    self._follow(now, end, direction)
                    return
                now = lost = max(now, start + ceil(found * SECOND))
                if now != caught:
                    self._follow(before, now, direction)
                self._now = self._now._replace(stalled=True)
                if now == caught or is_steady:
                    # It would be caught and lost for ever, in one moment or again and again.
                    self._stand(now, direction)
                    return

    def _loses(self, motor: StepperMotor, part: int, now_s: float, end_s: float) -> float | None:
        """When the rotor loses the field in a segment, because it is too weak or vibrates too much."""
        s = profile_of(self.plan).segments[part]
        weak = self._is_too_weak(motor, part, now_s, end_s)
        resonance = motor.resonance
        if resonance is None:
            return weak
        least = resonance.least
        for interval, lost in resonance_intervals(resonance, motor.phases(s, now_s, end_s, self.build.sign), self._amplitude):
            if weak is not None and interval.begin_s >= weak:
                break
            self._resonance_intervals.append(interval)
            if lost is not None and (weak is None or lost < weak):
                self._shaken.append(max(self.begin, profile_of(self.plan).start + ceil(lost * SECOND)))
                weak = lost
        if weak is not None:
            self._resonance_intervals.append(ResonanceInterval(weak, least, -resonance.fading))
            self._amplitude = least
        elif self._resonance_intervals:
            self._amplitude = self._resonance_intervals[-1].at(end_s, least) if end_s < inf else least
        return weak

    def _is_too_weak(self, motor: StepperMotor, part: int, now_s: float, end_s: float) -> float | None:
        """When the rotor loses the field in a segment because its torque does not suffice, or changes too much at once."""
        profile = profile_of(self.plan)
        s = profile.segments[part]
        if motor.inertia == 0.0 or not isinstance(s, Segment):
            return motor.loses(s, now_s, end_s, self.build.sign)
        if now_s >= s.end_s:
            return None  # it has no nanosecond of its own
        pullout = Pullout(motor, self.build.period_p, self.build.sign, profile)
        before, self._needed = self._needed, pullout.need(s, now_s if end_s == inf else min(end_s, s.end_s))
        if before is not None and now_s >= self._settles_s:
            settled = pullout.after_step(part, now_s, before)
            if settled is None:
                moment = max(self.begin, profile.start + ceil(now_s * SECOND))
                self._surprised[moment] = NEEDS_AT_ONCE(need=abs(pullout.need(s, now_s)), has=pullout.torque(s, now_s))
                return now_s
            self._settles_s = settled
        while max(now_s, self._settles_s) < min(s.end_s, end_s):
            lost = motor.loses(s, max(now_s, self._settles_s), end_s, self.build.sign)
            if lost is None:
                return None
            settled = pullout.after_lack(part, lost)
            if settled is None or settled <= lost:
                return lost
            self._settles_s = settled
        self._needed = None
        return None

    def _follow(self, begin: Nanos, end: Nanos | None, direction: int) -> None:
        """The rotor goes with the field until a stop holds it, the load when its play is used up."""
        build = self.build
        if self._is_pushed(begin, direction):
            self._stand(begin, direction, stop=direction)
            return
        self._catch(begin)
        rotor, load, _, behind = self._now
        if self.field(begin) - behind != rotor:
            # Drawn against a stop from which the field comes back.
            left = self._time(rotor + behind, begin)
            self._stand(begin, direction, stop=-direction)
            if left is None or (end is not None and left >= end):
                return
            begin, rotor = left, self.field(left) - behind
        offset = -behind
        slack = 0 if direction > 0 else build.play
        stop = build.high if direction > 0 else None if build.low is None else build.low - build.play
        held = None if stop is None else self._time(stop + direction - offset, begin)
        if held is not None and end is not None and held >= end:
            held = None
        touches = (rotor + slack - load) * direction >= 0
        met = begin if touches else self._time(load - slack + direction - offset, begin)
        if met is not None and ((end is not None and met >= end) or (held is not None and met >= held)):
            met = None
        lies = build.lies
        if lies is not None and lies != slack and held != begin:
            self._follow_lying(begin, lies, end, direction)
        elif held != begin:
            if met != begin:
                self._laid.append(TrajectorySection(begin, direction, True, offset, False, load, False, behind))
            if met is not None:
                self._laid.append(TrajectorySection(met, direction, True, offset, True, offset + slack, False, behind))
        if held is not None and stop is not None:
            self._laid.append(TrajectorySection(held, direction, False, stop, False, stop + slack, False, behind, direction))
        if end is not None:
            rotor = offset + self.field(end)
            if stop is not None and (rotor - stop) * direction > 0:
                rotor = stop
            carried = rotor + slack
            carried = carried if (carried - load) * direction > 0 else load
            self._now = MechanicalState(rotor, carried if lies is None else build.load_at(rotor, load), False, behind)

    def _follow_lying(self, begin: Nanos, lies: int, end: Nanos | None, direction: int) -> None:
        """The load goes before the rotor, which it pulls, until a stop holds it; the rotor goes on through the play."""
        build, (rotor, load, _, behind) = self.build, self._now
        stop, free = build.high if direction > 0 else build.low, True
        stands: Nanos | None = None
        if stop is not None:
            free = (stop - rotor - lies) * direction >= 0
            stands = self._time(stop + direction - lies + behind, begin) if free else begin
        if free:
            self._laid.append(TrajectorySection(begin, direction, True, -behind, True, lies - behind, False, behind))
        if stands is not None and (end is None or stands < end):
            place = load if stop is None else stop
            self._laid.append(TrajectorySection(stands, direction, True, -behind, False, place, False, behind))

    def _is_pushed(self, now: Nanos, direction: int) -> bool:
        """Whether the field goes on against the stop at which the rotor stands."""
        build, rotor = self.build, self._now.rotor
        drawn = self.field(now) - self._now.behind - rotor
        if direction > 0:
            return build.high is not None and rotor >= build.high and drawn > 0
        return build.low is not None and rotor <= build.low - build.play and drawn < 0

    def _stand(self, now: Nanos, direction: int, *, stop: int = 0) -> None:
        rotor, load, stalled, behind = self._now
        self._laid.append(TrajectorySection(now, direction, False, rotor, False, load, stalled, behind, stop))

    def _catch(self, now: Nanos) -> None:
        """The rotor goes to the nearest place that has the electrical angle of the field, or towards it as far as a stop."""
        build, (rotor, load, _, behind) = self.build, self._now
        drawn = self.field(now) - behind
        if drawn != rotor:
            periods = (2 * (drawn - rotor) + build.period_p) // (2 * build.period_p)
            behind += periods * build.period_p
            rotor = drawn - periods * build.period_p
            if build.low is not None:
                rotor = max(rotor, build.low - build.play)
            if build.high is not None:
                rotor = min(rotor, build.high)
            load = build.load_at(rotor, load)
        self._now = MechanicalState(rotor, load, False, behind)
