"""The mechanics of an axis: rotor and load with hard stops, backlash and motor, and the encoders on them.

A `Mechanism` follows the plans of one drive. An ideal one, whose load always is at the commanded position, costs no computing
time; otherwise each plan gives a `Trajectory` in closed form. Positions in pulses of the mechanics.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import ClassVar, NamedTuple, Protocol

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.motion import Profile
from steptwin.motion.divisions import profile_of
from steptwin.motioncontroller import Drive
from steptwin.simulation.mechanics.effort import Effort
from steptwin.simulation.mechanics.motor import NO_BURDEN, Burden
from steptwin.simulation.mechanics.rotorhold import RotorHold
from steptwin.simulation.mechanics.trajectory import Build, LoadSection, MechanicalState, Trajectory
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.wires import PinName
from steptwin.state import Plain, Stateful

_OUTDATED = -1
"""A revision that no drive has."""
FOLLOW_NS: Nanos = 10 * MILLISECOND
"""Interval at which a controller that follows an encoder is notified while the encoder turns."""


class Shaft(NamedTuple):
    """The motion of an encoder shaft: a trajectory, in the frame of the drive's counted position. Immutable."""

    trajectory: Trajectory
    on_load: bool

    def count(self, now: Nanos) -> int:
        state = self.trajectory.at(now)
        build = self.trajectory.build
        return ((state.load if self.on_load else state.rotor) - build.zero) * build.sign


class EncoderShaft(Protocol):
    """The motion of an encoder shaft. Immutable."""

    def count(self, now: Nanos) -> int:
        """Its position in whole steps."""
        ...


class EncoderReader(Protocol):
    """A controller that reads encoders. Axes count from 1."""

    def gear_encoder(self, axis: int, counts: int, pulses: int, now: Nanos, /) -> None:
        """Set the resolution: ``counts`` of the encoder per ``pulses`` of its shaft."""
        ...

    def follow_shaft(self, axis: int, shaft: EncoderShaft, now: Nanos, /) -> None:
        """Couple the encoder to ``shaft`` from now on."""
        ...

    def turn_encoder(self, axis: int, counts: int, now: Nanos, /) -> None:
        """Turn the encoder by ``counts`` at once."""
        ...


@dataclass(frozen=True, slots=True)
class EncoderBuild:
    """An encoder that the controller ``device``, called ``controller`` in the scheduler, reads for its axis ``axis`` (from 1).

    ``counts`` (negative: backwards) per ``pulses`` of the drive that turns it; None: as the controller is configured.
    """

    controller: str
    device: EncoderReader
    axis: int
    on_load: bool = False
    counts: int | None = None
    pulses: int = 1


IS_CAUGHT = Message("simulation.is-caught", "{axis} is caught, {pulses} pulses behind")
PUSHES_UPPER = Message("simulation.pushes-upper-stop", "{axis} pushes against its upper hard stop")
PUSHES_LOWER = Message("simulation.pushes-lower-stop", "{axis} pushes against its lower hard stop")
LEAVES_UPPER = Message(
    "simulation.leaves-upper-stop", "{axis} no longer pushes against its upper hard stop, {pulses} pulses behind"
)
LEAVES_LOWER = Message(
    "simulation.leaves-lower-stop", "{axis} no longer pushes against its lower hard stop, {pulses} pulses behind"
)
HAS_NO_POWER = Message("simulation.axis-has-no-power", "{axis} has no power")
HAS_POWER_AGAIN = Message("simulation.axis-has-power-again", "{axis} has power again")
FOLLOWS = Message("simulation.follows-its-field", "{axis} follows its field, {pulses} pulses behind")
STANDS = Message("simulation.stands-behind", "{axis} stands, {pulses} pulses behind")


NO_POWER = "no power"
"""Name of the blocker of a rotor that stands without current; no element is called so."""


class Mechanism(Stateful):
    """The mechanics of axis ``number`` (from 1) of a controller in ``scheduler``: a part of the scheduler, and a carriage for
    switches."""

    FIXED: ClassVar[tuple[str, ...]] = (
        "_encoders",
        "_name",
        "_power",
        "_revision",
        "_scheduler",
        "_seen",
        "build",
        "controller",
        "number",
    )
    __slots__ = (
        *FIXED,
        "_blockers",
        "_brake",
        "_burden",
        "_burdens",
        "_changed",
        "_changes",
        "_coupled",
        "_trajectory",
        "_due",
        "_falls",
        "_hold",
        "_is_powered",
        "_reported",
        "_reported_trajectory",
        "_rest_due",
        "_simple",
        "_stall_due",
        "_stalled",
        "_stop",
        "_stop_due",
    )

    def __init__(
        self,
        scheduler: Scheduler,
        controller: str,
        number: int,
        build: Build,
        name: str = "axis",
        power: PinName | None = None,
    ) -> None:
        """``power``: the output that gives its motor power; None: it always has some."""
        self._scheduler = scheduler
        self._power = power
        self._name = name
        self.controller = controller
        self.number = number
        self.build = build
        self._encoders: list[EncoderBuild] = []
        """Encoders of its axis that it does not turn."""
        self._coupled = False
        """Whether the encoders were coupled to a trajectory instead of the drive."""
        self._due: Nanos | None = None
        """The next notification of controllers that follow an encoder."""
        self._stalled = False
        self._stall_due: Nanos | None = None
        """The next moment at which the motor stalls or synchronises again."""
        self._stop = 0
        """The hard stop against which the motor pushes, as reported: 1 upper, -1 lower, 0 neither."""
        self._stop_due: Nanos | None = None
        """When that changes next."""
        self._blockers: tuple[str, ...] = ()
        """Names of what blocks the rotor."""
        self._brake = 0.0
        """Torque of the brake, N·m."""
        self._burdens: dict[str, Burden] = {}
        """Further loads, by the names of their elements."""
        self._burden = NO_BURDEN
        """All of them together."""
        self._changed: tuple[int, Burden] | None = None
        """Where the rotor was when they changed, and what it carried until then."""
        self._hold = None if build.motor is None or not build.may_coast else RotorHold(build, build.motor, scheduler.now)
        """None for a rotor that always goes with its field, or stands."""
        self._is_powered = True
        self._falls = False
        self._rest_due: Nanos | None = None
        """When a coasting rotor that moves comes to rest."""
        self._changes = 0
        self._seen: object = None
        """The version of its trajectory of which what depends on it was notified."""
        self._reported: tuple[LoadSection, ...] | None = (LoadSection(scheduler.now, True, 0),)
        """The position of the load as reported last; None while it moves freely."""
        self._reported_trajectory: Trajectory | None = None
        """The trajectory that was reported."""
        self._simple = build.ideal
        """Whether the load always was, and always will be, at the commanded position."""
        drive = scheduler.drive_of(controller, number)
        here = 0 if scheduler.is_blank else build.sign * drive.plan.count(scheduler.now) + build.zero
        place = here + (build.lies or 0)
        if scheduler.is_blank:
            pass  # it is restored, where another one has been
        elif (build.low is not None and place < build.low) or (build.high is not None and place > build.high):
            raise Misuse(
                f"{controller} axis {number} stands at {place} imp, outside its hard stops {build.low} to {build.high} imp"
            )
        self._revision = drive.revision
        self._trajectory = Trajectory(build, drive.plan, scheduler.now, MechanicalState(here, place))
        if self._hold is not None and not scheduler.is_blank:
            self._renew(drive, scheduler.now)

    @property
    def _drive(self) -> Drive:
        return self._scheduler.controllers[self.controller].axes[self.number - 1]

    # ------------------------------------------------------------------ position

    def trajectory(self, now: Nanos) -> Trajectory:
        """The trajectory at ``now``, which is the scheduler's moment or later. A trajectory of later changes nothing: a
        trajectory is renewed at the scheduler's moment."""
        drive = self._drive
        if drive.revision != self._revision or (self._hold is not None and self._hold.is_switched(drive, self._scheduler.now)):
            self._renew(drive, self._scheduler.now)
        return self._trajectory

    def at(self, now: Nanos) -> MechanicalState:
        return self.trajectory(now).at(now)

    def lost(self, now: Nanos) -> int:
        """The number of pulses by which the rotor is below the field; negative: above it."""
        trajectory = self.trajectory(now)
        return trajectory.field(now) - trajectory.at(now).rotor

    def version(self) -> object:
        return self._scheduler.controllers[self.controller].axes[self.number - 1].revision, self._changes

    def grid_position(self, now: Nanos) -> int:
        return self.trajectory(now).load_at(now)

    def reaches(self, position: int, after: Nanos, direction: int) -> Nanos | None:
        return self.trajectory(after).reaches(position, after, direction)

    # ------------------------------------------------------------------ time

    def update(self, now: Nanos) -> None:
        if not self._simple:
            self._follow(now)
        if self._scheduler.is_watched(self._name):
            version = self.version()
            if version != self._seen:
                self._seen = version
                self._scheduler.notify(self._name)

    def _follow(self, now: Nanos) -> None:
        """Process what may change its trajectory, and report it."""
        if self._power is not None:
            self._switch(self._scheduler.level(self._power) != 0.0, now)
        drive = self._drive
        if drive.revision != self._revision or (self._hold is not None and self._hold.is_switched(drive, now)):
            self._renew(drive, now)
            self._scheduler.notify(self.controller)  # switches on it look ahead
        elif self._due is not None and self._due <= now:
            self._turn_encoders(now)
        if self._stall_due is not None and self._stall_due <= now:
            self._watch_motor(now)
            if self._lets_go(now):
                self._renew(drive, now)
                self._scheduler.notify(self.controller)
        if self._stop_due is not None and self._stop_due <= now:
            self._watch_stops(now)
        if self._rest_due is not None and self._rest_due <= now:
            self._watch_fall(now, None)
        self._report_load(now)

    def _report_load(self, now: Nanos) -> None:
        """Report the position of the load, unless it follows from earlier reports or from the plan of the drive."""
        trajectory = self._trajectory
        if trajectory is self._reported_trajectory:
            return
        if self._reported_trajectory is None and self._hold is not None:
            self._watch_fall(now, trajectory.coasting)
        self._reported_trajectory = trajectory
        coasting = trajectory.coasting
        if coasting is not None and coasting.segments:
            self._reported = None
            state = trajectory.at(now)
            moved = Profile(
                coasting.start, coasting.base + (state.load - state.rotor) * self.build.sign, coasting.segments, coasting.final_p
            )
            self._scheduler.record(self.controller, "free", str(self.number), moved)
            return
        sections = _from(trajectory.load_sections(), now)
        if self._reported is None or sections != _from(self._reported, now):
            self._reported = sections
            self._scheduler.record(self.controller, "load", str(self.number), sections)

    def deadline(self) -> Nanos | None:
        """Trajectories are computed in advance: what is due is to be reported, or concerns followers and the current of the
        axis."""
        first = None if self._hold is None else self._hold.due
        for due in (self._due, self._stall_due, self._stop_due, self._rest_due):
            if due is not None and (first is None or due < first):
                first = due
        return first

    def _watch_motor(self, now: Nanos) -> None:
        """Report that the motor has stalled or has synchronised again."""
        stalled = self._trajectory.at(now).stalled
        if stalled is not self._stalled:
            self._stalled = stalled
            text = self._trajectory.stall_of(self._name, now) if stalled else IS_CAUGHT(axis=self._name, pulses=self.lost(now))
            facts = (
                ("axis", self.number),
                ("element", self._name),
                ("stalled", stalled),
                ("lost", 0 if stalled else self.lost(now)),
            )
            self._scheduler.record(self.controller, "event", "stall", text, *facts)
        self._stall_due = self._trajectory.next_stall(now)

    def _watch_stops(self, now: Nanos) -> None:
        """Report that the motor begins to push against a hard stop, and that it no longer does."""
        stop = self._trajectory.stop(now)
        if stop != self._stop:
            pushes, side = stop != 0, "upper" if (stop or self._stop) > 0 else "lower"
            lost = self.lost(now)
            if pushes:
                text = (PUSHES_UPPER if side == "upper" else PUSHES_LOWER)(axis=self._name)
            else:
                text = (LEAVES_UPPER if side == "upper" else LEAVES_LOWER)(axis=self._name, pulses=lost)
            facts = ("axis", self.number), ("element", self._name), ("stop", side), ("pushes", pushes), ("lost", lost)
            self._scheduler.record(self.controller, "event", "hard-stop", text, *facts)
            self._stop = stop
        self._stop_due = self._trajectory.next_stop(now)

    def _lets_go(self, now: Nanos) -> bool:
        """Whether the field loses the rotor at this moment, and the rotor moves by itself from then on."""
        is_free = self.build.coasts_unpowered and not self._blocked and self._trajectory.coasting is None
        return is_free and self._trajectory.at(now).stalled

    def _renew(self, drive: Drive, now: Nanos, state: MechanicalState | None = None, *, rests: bool = False) -> None:
        """Compute a new trajectory after a change of the drive's plan or of the mechanics. ``rests``: a coasting rotor stands
        now."""
        before, plan, was_stalled = self._trajectory, drive.plan, self._stalled
        if state is None:
            if self._simple:
                here = self.build.sign * plan.count(now) + self.build.zero
                state = MechanicalState(here, here)
            else:
                state = before.at(now)
                # After power-off a controller counts from 0 again.
                counted_anew = self.build.sign * (plan.count(now) - before.plan.count(now))
                state = state._replace(behind=state.behind + counted_anew)
        loaded = self._loaded()
        if loaded.lies is not None:
            state = state._replace(load=loaded.load_at(state.rotor, state.load))
        led = profile_of(before.plan) if before.coasting is None else before.coasting
        jump = profile_of(plan).velocity(now) - led.velocity(now)
        is_new = drive.revision != self._revision
        self._revision = drive.revision
        coasting = None
        if self._hold is not None:
            coasting, state = self._hold.motion(
                drive, before, state, now, is_new=is_new, burden=self._carried, stands=self._blocked or rests
            )
        if coasting is not None and self.build.coasts_unpowered:
            jump = 0.0
        is_caught = before.coasting is not None and coasting is None and was_stalled and not state.stalled
        self._trajectory = Trajectory(
            loaded,
            plan,
            now,
            state,
            blocked=self._blocked,
            jump=jump,
            coasting=coasting,
            vibration=before.vibration(now),
            needed=self._needed(drive, now) if is_caught else before.needs(now),
        )
        if self._hold is not None and self._lets_go(now):
            self._watch_motor(now)
            coasting, state = self._hold.motion(
                drive, before, self._trajectory.at(now), now, is_new=is_new, burden=self._carried, stands=False
            )
            self._trajectory = Trajectory(loaded, plan, now, state, coasting=coasting)
        self._changes += 1
        if self._encoders:
            self._turn_encoders(now)
        if self.build.motor is not None:
            self._watch_motor(now)
        if self.build.low is not None or self.build.high is not None:
            self._watch_stops(now)
        if self._hold is not None and self._reported_trajectory is not None:  # while it is built, a brake may be still to come
            self._watch_fall(now, coasting)

    # ------------------------------------------------------------------ load

    @property
    def _carried(self) -> Burden:
        """Burden of the motor besides its own: a further load, and the friction of the brake."""
        return self._burden.plus(Burden(0.0, self._brake))

    def _loaded(self) -> Build:
        """Build with all that a powered motor has to move."""
        motor, more = self.build.motor, self._carried
        if motor is None or more == NO_BURDEN:
            return self.build
        own = Burden(motor.inertia, motor.friction, motor.load).plus(more)
        return replace(self.build, motor=replace(motor, inertia=own.inertia, friction=own.friction, load=own.load))

    def _needed(self, drive: Drive, now: Nanos) -> float | None:
        """The torque that the motion needs of a motor whose field has just caught the rotor, N·m."""
        motor, profile = self._loaded().motor, profile_of(drive.plan)
        part = bisect_right(profile.ends, now - profile.start)
        if motor is None or part >= len(profile.segments):
            return None
        return motor.need_at(profile.segments[part], (now - profile.start) / SECOND, self.build.sign)

    def _watch_fall(self, now: Nanos, coasting: Profile | None) -> None:
        """Report that a rotor that its field does not hold begins to move, and that it rests again or is caught."""
        falls = coasting is not None and coasting.moving(now)
        if falls is not self._falls and self._hold is not None:
            self._falls = falls
            lost = self.lost(now)
            follows = coasting is None and self._trajectory.moves(now) and self._trajectory.leads(now)
            text = self._hold.why(axis=self._name) if falls else (FOLLOWS if follows else STANDS)(axis=self._name, pulses=lost)
            facts = ("axis", self.number), ("element", self._name), ("falls", falls), ("lost", lost)
            self._scheduler.record(self.controller, "event", "fall", text, *facts)
        self._rest_due = coasting.end if coasting is not None and falls else None

    @property
    def has_current(self) -> bool:
        """Whether the motor has current: its controller has switched it on, and nothing has taken its power."""
        return self._is_powered and self._drive.is_energised

    def effort(self, now: Nanos) -> Effort:
        """Effort of the motor at ``now`` and later, as `trajectory` has it."""
        trajectory = self.trajectory(now)
        reduced = None if self._hold is None else self._hold.reduced_from(profile_of(trajectory.plan))
        return Effort(trajectory, self.has_current, reduced)

    def _switch(self, is_powered: bool, now: Nanos) -> None:
        """Give the motor power or take it away; its controller does not notice."""
        if is_powered is self._is_powered:
            return
        state = self.at(now)
        self._is_powered = is_powered
        text = (HAS_POWER_AGAIN if is_powered else HAS_NO_POWER)(axis=self._name)
        facts = ("axis", self.number), ("element", self._name), ("on", is_powered)
        self._scheduler.record(self.controller, "event", "power", text, *facts)
        if self._hold is None or not self.build.coasts_unpowered:
            self.block(not is_powered, now, by=NO_POWER)
            return
        self._hold.is_powered = is_powered
        self._renew(self._drive, now, state)
        self._scheduler.notify(self.controller)

    def brake(self, torque: float, now: Nanos) -> None:
        """Let a brake act on the rotor with ``torque`` N·m."""
        if torque == self._brake:
            return
        state = self.at(now)
        self._brake = torque
        self._renew(self._drive, now, state)
        self._scheduler.notify(self.controller)

    def burden(self, by: str, more: Burden, now: Nanos) -> None:
        """Let the element ``by`` load the rotor with ``more``, in place of what it did before."""
        if more == self._burdens.get(by, NO_BURDEN):
            return
        trajectory, before = self.trajectory(now), self._carried
        self._burdens[by] = more
        self._burden = NO_BURDEN
        for one in self._burdens.values():
            self._burden = self._burden.plus(one)
        state = trajectory.at(now)
        rests = self._hold is not None and self._settles(self._hold, trajectory, before, now)
        self._renew(self._drive, now, state, rests=rests)
        self._scheduler.notify(self.controller)

    def _settles(self, hold: RotorHold, trajectory: Trajectory, before: Burden, now: Nanos) -> bool:
        """Whether a coasting rotor stands whose load changes from ``before`` where it changed the other way the last time."""
        rotor = trajectory.at(now).rotor
        last, self._changed = self._changed, (rotor, before)
        is_again = last is not None and last[1] == self._carried and 4 * abs(last[0] - rotor) <= self.build.period_p
        return is_again and hold.settles(trajectory, before, self._carried, now)

    def pulls(self, now: Nanos) -> bool:
        """Whether the motor follows its field, or would: it has current, has not stalled, and nothing blocks it."""
        return self.has_current and not self._blocked and not self.at(now).stalled

    def next_stall(self, now: Nanos) -> Nanos | None:
        """First moment after ``now`` at which the motor stalls or synchronises again."""
        return self.trajectory(now).next_stall(now)

    # ------------------------------------------------------------------ encoders

    def fit(self, encoder: EncoderBuild, now: Nanos) -> None:
        """Mount an encoder on the rotor or the load."""
        self._encoders.append(encoder)
        if encoder.counts is not None:
            encoder.device.gear_encoder(encoder.axis, encoder.counts, encoder.pulses, now)
        if not self._is_own(encoder):
            self._simple = False
        self._turn_encoders(now)

    @property
    def may_turn(self) -> set[str]:
        """Controllers whose encoders it may turn without an event of theirs."""
        return {encoder.controller for encoder in self._encoders if self.build.may_coast or encoder.controller != self.controller}

    def _turn_encoders(self, now: Nanos) -> None:
        trajectory = self._trajectory
        self._due = None
        for encoder in self._encoders:
            own = self._is_own(encoder)
            exact = own and trajectory.is_exact and not (encoder.on_load and self.build.play)
            if not exact or self._coupled:
                self._coupled = True
                encoder.device.follow_shaft(encoder.axis, Shaft(trajectory, encoder.on_load), now)
            if not own and trajectory.moves(now):
                self._due = now + FOLLOW_NS

    def _is_own(self, encoder: EncoderBuild) -> bool:
        """Whether an encoder belongs to the same axis of the same controller."""
        return (encoder.controller, encoder.axis) == (self.controller, self.number)

    # ------------------------------------------------------------------ faults

    @property
    def _blocked(self) -> bool:
        return bool(self._blockers)

    def block(self, blocked: bool, now: Nanos, by: str = "") -> None:
        """Block the rotor, so that pulses are lost, or release it. It is free when nothing blocks it any more."""
        others = tuple(name for name in self._blockers if name != by)
        if not blocked and others:
            self._blockers = others
            return
        state = self.at(now)
        self._simple = False
        self._blockers = (*others, by) if blocked else ()
        stalled = state.stalled or (not blocked and self.build.motor is not None)
        self._renew(self._drive, now, state._replace(stalled=stalled))
        self._scheduler.notify(self.controller)

    @property
    def period_p(self) -> int:
        """Pulses of an electrical period of the motor."""
        return self.build.period_p

    def heading(self, now: Nanos) -> int:
        """The way in which the field moves within the next millisecond, +1 or -1; 0: it stands."""
        profile = profile_of(self._drive.plan)
        ahead = self.build.sign * (profile.position(now + MILLISECOND) - profile.position(now))
        return (ahead > 0) - (ahead < 0)

    def lose(self, pulses: int, now: Nanos) -> None:
        """Move the rotor ``pulses`` of the drive behind the field, where that goes with positive pulses (negative: ahead), within
        the hard stops."""
        build, (rotor, load, stalled, _) = self._loaded(), self.at(now)
        rotor -= build.sign * pulses
        if build.low is not None:
            rotor = max(rotor, build.low - build.play)
        if build.high is not None:
            rotor = min(rotor, build.high)
        self._simple = False
        behind = self.trajectory(now).field(now) - rotor
        self._renew(self._drive, now, MechanicalState(rotor, build.load_at(rotor, load), stalled, behind))
        self._scheduler.notify(self.controller)

    # Revisions of a drive are not restored, so the state only holds whether the trajectory belongs to the drive's present plan.

    def copy_state(self) -> Plain:
        return super().copy_state(), self._revision == self._drive.revision

    def set_state(self, plain: Plain) -> None:
        """As `Stateful.set_state`; the drive must have been restored before."""
        own, is_current = plain
        super().set_state(own)
        self._revision = self._drive.revision if is_current else _OUTDATED


def _from(reported: tuple[LoadSection, ...], now: Nanos) -> tuple[LoadSection, ...]:
    """The part of a report that concerns ``now`` and later."""
    past = max(bisect_right(reported, now, key=attrgetter("begin")) - 1, 0)
    return (reported[past]._replace(begin=now), *reported[past + 1 :])


class RotorMark:
    """The rotor of a mechanism as a carriage, for the index of an encoder."""

    __slots__ = ("_mechanism",)

    def __init__(self, mechanism: Mechanism) -> None:
        self._mechanism = mechanism

    def version(self) -> object:
        return self._mechanism.version()

    def grid_position(self, now: Nanos) -> int:
        return self._mechanism.at(now).rotor

    def reaches(self, position: int, after: Nanos, direction: int) -> Nanos | None:
        return self._mechanism.trajectory(after).reaches(position, after, direction, rotor=True)
