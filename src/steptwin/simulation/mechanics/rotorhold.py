"""The hold of a field on its rotor: when the rotor coasts, and how: without current, with too little of it, after a stop
without ramp, or after it has lost its field."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from steptwin.controller import Nanos
from steptwin.messages import Message
from steptwin.motion import Profile, at_rest
from steptwin.motion.divisions import profile_of
from steptwin.motioncontroller import Drive
from steptwin.simulation.mechanics.catching import catch_of
from steptwin.simulation.mechanics.coasting import CoastingRotor, slow_from
from steptwin.simulation.mechanics.motor import Burden, StepperMotor
from steptwin.simulation.mechanics.potential import PeriodicPotential
from steptwin.simulation.mechanics.trajectory import Build, MechanicalState, Trajectory
from steptwin.state import Stateful

RUNS_ON = Message("simulation.runs-on", "{axis} runs on after a stop without ramp")
MOVES_WITH_LITTLE_CURRENT = Message("simulation.moves-with-little-current", "{axis} moves with too little current")
MOVES_WITHOUT_FIELD = Message("simulation.moves-without-field", "{axis} moves as its load has it: it has lost its field")
MOVES_WITHOUT_CURRENT = Message("simulation.moves-without-current", "{axis} moves without current")


class RotorHold(Stateful):
    """Whether the field holds its rotor, from moment to moment."""

    FIXED: ClassVar[tuple[str, ...]] = ("_build", "_motor")
    __slots__ = (
        *FIXED,
        "_is_lost",
        "_may_be_caught",
        "_on_since",
        "_overruns",
        "due",
        "has_current",
        "is_coasting",
        "is_powered",
    )

    def __init__(self, build: Build, motor: StepperMotor, now: Nanos) -> None:
        self._build = build
        self._motor = motor
        self._on_since = now
        """Since when there has been current."""
        self._overruns = False
        """Whether the rotor runs on after a stop of its field."""
        self._is_lost = False
        """Whether the rotor has lost its field and moves by itself."""
        self._may_be_caught: Nanos | None = None
        """From when on the field may catch it then."""
        self.is_powered = True
        """Whether the motor has power, so that a drive that is energised gives it current."""
        self.has_current = True
        self.is_coasting = False
        """Whether the field does not hold it: there is no current or too little, or the rotor is too fast."""
        self.due: Nanos | None = None
        """When that may change without an input: the rotor is slow enough, current is reduced, or the field stops at once."""

    def is_switched(self, drive: Drive, now: Nanos) -> bool:
        """Whether current has been switched, or something is due."""
        has_current = drive.is_energised and self.is_powered
        return has_current is not self.has_current or (self.due is not None and self.due <= now)

    @property
    def why(self) -> Message:
        """Message for events about what a coasting rotor does."""
        if self._overruns:
            return RUNS_ON
        if self._is_lost:
            return MOVES_WITHOUT_FIELD
        return MOVES_WITH_LITTLE_CURRENT if self.has_current else MOVES_WITHOUT_CURRENT

    def motion(
        self,
        drive: Drive,
        before: Trajectory,
        state: MechanicalState,
        now: Nanos,
        *,
        is_new: bool,
        burden: Burden,
        stands: bool,
    ) -> tuple[Profile | None, MechanicalState]:
        """The motion of a rotor that its field does not hold from now on, None where it does; and its place as that begins.

        ``before``: its trajectory until now. ``is_new``: the drive has another plan. ``burden``: what it moves besides
        its motor's own. ``stands``: something holds it from now on.
        """
        plan, motor = profile_of(drive.plan), self._motor
        led = profile_of(before.plan) if before.coasting is None else before.coasting
        was_lost, self._is_lost = self._is_lost, False
        loses = state.stalled and not was_lost and before.begin < now and before.leads(now - 1)
        moves = (before.leads(now) or loses) and not stands
        speed = led.velocity(now) if moves else 0.0
        has_current = drive.is_energised and self.is_powered
        if has_current and not self.has_current:
            self._on_since = now
        self.has_current, due, self.due = has_current, self.due, None
        runs_on = self._overruns and self.has_current and not is_new and not stands and due is not None and now < due
        self._overruns = runs_on
        if runs_on:
            self.due = due
            return before.coasting, state
        motion = self._coasting_rotor(state, burden)
        is_weak = self._is_weak(plan, motion, now)
        against = speed - plan.velocity(now) if self._build.coasts_unpowered else speed
        if self._build.coasts_unpowered and not is_weak and not stands:
            if self.is_coasting and plan.moving(now) and not self._catches(motion, speed, against):
                state = state._replace(stalled=True)
            if state.stalled:
                base = (state.rotor - self._build.zero) * self._build.sign
                found = motion.profile(now, base, led.phase(now) if moves else 0.0, speed)
                may_be = self._may_be_caught is not None and self._may_be_caught <= now if was_lost else not moves
                if self._loses(plan, found, motion, now, may_be=may_be):
                    self.is_coasting = self._is_lost = True
                    return found, state
                state, self.is_coasting = state._replace(stalled=False), False
        if not is_weak and (not self.is_coasting or self._catches(motion, speed, against)):
            self.is_coasting = False
            found = None
            if motor.overruns and before.leads(now - 1) and not stands and not state.stalled:
                found = self._overrun(plan, led, motion, state, now)
            if found is None:
                self._watch(plan, motion, now)
            return found, state
        self.is_coasting = True
        if motion.detent is not None and speed == 0.0 and motion.detent.torque > motion.friction + abs(motion.load):
            state = self._at_full_step(state, motion.detent)
        base = (state.rotor - self._build.zero) * self._build.sign
        if stands:
            return at_rest(now, base), state
        found = motion.profile(now, base, led.phase(now) if moves else 0.0, speed)
        if not is_weak:
            self.due = slow_from(found, now, self._limit(motion))
        return found, state

    def _loses(self, plan: Profile, rotor: Profile, motion: CoastingRotor, now: Nanos, *, may_be: bool) -> bool:
        """Whether the field does not catch a rotor at once that moves by itself; when it does is due. ``may_be`` as in
        `catch_of`."""
        motor, sign = self._motor, self._build.sign
        loaded = replace(motor, inertia=motion.inertia, friction=motion.friction, load=motion.load * sign)
        limit = self._limit(motion)
        self._may_be_caught, self.due = catch_of(loaded, plan, rotor, now, sign, limit, may_be=may_be)
        return self.due is None or self.due > now

    def _catches(self, motion: CoastingRotor, speed: float, against: float) -> bool:
        """Whether a field that has become strong enough holds a rotor with ``speed``, ``against`` it, in pulses/s."""
        if speed == 0.0 or not self._build.coasts_unpowered:
            return self._motor.follows(against)
        return abs(against) <= self._limit(motion) * (1.0 + 1e-9)

    def _limit(self, motion: CoastingRotor) -> float:
        """The highest speed against its field at which that catches a rotor, pulses/s: see `catching`."""
        if self._motor.start_p is not None:
            return self._motor.start_p
        field = PeriodicPotential(self._motor.holding, float(self._build.period_p))
        return field.catches_below(motion.inertia, abs(motion.load) + motion.friction)

    def settles(self, trajectory: Trajectory, before: Burden, after: Burden, now: Nanos) -> bool:
        """Whether a coasting rotor, whose load changes from ``before`` to ``after``, swings by less than a full step about this
        place, to which both drive it. Places being whole pulses, it would never come to rest."""
        speed = 0.0 if trajectory.coasting is None else trajectory.coasting.velocity(now)
        if speed == 0.0:
            return False
        direction = 1 if speed > 0.0 else -1
        one, other = (self._coasting_rotor(trajectory.at(now), burden) for burden in (before, after))
        drives_to, drives_back = -direction * one.load - one.friction, direction * other.load - other.friction
        braking = direction * other.load + other.friction
        swing = 0.5 * other.inertia * speed * speed
        return drives_to > 0.0 and drives_back > 0.0 and swing < braking * self._build.period_p / 4

    def _coasting_rotor(self, state: MechanicalState, burden: Burden) -> CoastingRotor:
        build, motor = self._build, self._motor
        away = state.load - state.rotor
        ends = sorted((stop - away - build.zero) * build.sign for stop in (build.low, build.high) if stop is not None)
        return CoastingRotor(
            inertia=motor.inertia + burden.inertia,
            load=(motor.load + burden.load) * build.sign,
            friction=motor.friction + burden.friction,
            low=ends[0] if ends else None,
            high=ends[-1] if ends else None,
            detent=PeriodicPotential(motor.detent, build.period_p / 4) if motor.detent and not self.has_current else None,
        )

    def _is_weak(self, plan: Profile, motion: CoastingRotor, now: Nanos) -> bool:
        """Whether there is no current, or too little for the load."""
        weak_from = self._weak_from(plan, motion)
        return self._build.coasts_unpowered and (not self.has_current or (weak_from is not None and weak_from <= now))

    def _weak_from(self, plan: Profile, motion: CoastingRotor) -> Nanos | None:
        """From when on a field at rest has too little torque for the load: at once, or when the current is reduced."""
        if not self._build.coasts_unpowered or plan.end is None:
            return None
        motor, needed = self._motor, abs(motion.load) - motion.friction
        rests = max(plan.end, self._on_since)
        if needed > motor.holding:
            return rests
        return rests + motor.hold_ns if needed > motor.hold * motor.holding else None

    def reduced_from(self, plan: Profile) -> Nanos | None:
        """From when on the motor has the reduced current of rest; None: never, as things are."""
        is_reduced = self._motor.hold < 1.0 and self.has_current and plan.end is not None
        return max(plan.end or 0, self._on_since) + self._motor.hold_ns if is_reduced else None

    def _watch(self, plan: Profile, motion: CoastingRotor, now: Nanos) -> None:
        """Find when something happens to a rotor that is held."""
        deadlines = [self._weak_from(plan, motion)]
        if self._motor.overruns and plan.end is not None and _speed_into(plan, plan.end):
            deadlines.append(plan.end)
        self.due = min((due for due in deadlines if due is not None and due > now), default=None)

    def _overrun(self, plan: Profile, led: Profile, motion: CoastingRotor, state: MechanicalState, now: Nanos) -> Profile | None:
        """The motion on after a stop of the field at ``now``; None where there is none, or the field holds the rotor."""
        speed = _speed_into(led, now)
        if plan.moving(now) or speed == 0.0:
            return None
        base = (state.rotor - self._build.zero) * self._build.sign
        found = motion.overrun(PeriodicPotential(self._motor.holding, float(self._build.period_p)), now, base, speed)
        if found is not None:
            self.is_coasting = self._overruns = True
            self.due = found.end
        return found

    def _at_full_step(self, state: MechanicalState, detent: PeriodicPotential) -> MechanicalState:
        """At the nearest full step, as far as the stops permit it."""
        build = self._build
        counted = (state.rotor - build.zero) * build.sign
        moved = (detent.nearest(float(counted)) - counted) * build.sign
        if build.low is not None:
            moved = max(moved, build.low - state.load)
        if build.high is not None:
            moved = min(moved, build.high - state.load)
        return state._replace(rotor=state.rotor + moved, load=state.load + moved)


def _speed_into(profile: Profile, now: Nanos) -> float:
    """The velocity with which a field comes to a moment."""
    if profile.end is None or now < profile.end:
        return profile.velocity(now)
    if now > profile.end or not profile.segments:
        return 0.0
    last = profile.segments[-1]
    return last.velocity(last.end_s)
