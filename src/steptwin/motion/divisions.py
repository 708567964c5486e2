"""STEP pulses on a microstep grid: one pulse every so many units of position, with a change of division in flight.

Positions in units u (M1486: minimum microsteps), speeds in u/s. A profile counts every unit; the train of pulses that it
drives counts only the positions of a grid; it stays on the last one that the profile has passed.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import inf
from typing import NamedTuple, TypeAlias

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.motion.planner import MotionState
from steptwin.motion.profile import Profile, at_rest
from steptwin.motion.ramps import SpeedCurve, plan_forced_stop

_ROUNDING = 1.0 + 1e-9
"""Factor of the limit: a speed that rounding alone puts above it has not passed it. V may be the limit itself."""


class Microstepping(NamedTuple):
    """Units per pulse in the low range, in the high range, and the speed (u/s) above which the high range begins."""

    fine: int
    coarse: int
    limit: float


class Division(NamedTuple):
    """From counted position ``begin`` on, one pulse every ``grid`` units."""

    begin: int
    grid: int


class StepTrain:
    """The pulses of a motion in one direction; immutable.

    ``divisions`` in the order of the motion, the first beginning where the train stood at the start.
    """

    __slots__ = ("direction", "divisions", "microstepping", "profile")

    def __init__(self, profile: Profile, microstepping: Microstepping, divisions: tuple[Division, ...]) -> None:
        self.profile = profile
        self.microstepping = microstepping
        self.divisions = divisions
        self.direction = profile.segments[0].direction if profile.segments else 0
        """+1, −1, or 0 at rest"""

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, StepTrain):
            return NotImplemented
        return (self.profile, self.divisions, self.microstepping) == (other.profile, other.divisions, other.microstepping)

    def __hash__(self) -> int:
        return hash((self.profile, self.divisions))

    def intervals(self) -> Iterator[tuple[int, int | None, int]]:
        """(begin, end, grid) of each division in turn; the last has no end."""
        for i, (begin, grid) in enumerate(self.divisions):
            yield begin, self.divisions[i + 1].begin if i + 1 < len(self.divisions) else None, grid

    def division(self, now: Nanos) -> Division:
        """The division in force at ``now``."""
        reached = self.profile.count(now)
        found = self.divisions[0]
        for division in self.divisions:
            if (reached - division.begin) * self.direction >= 0:
                found = division
        return found

    def count(self, now: Nanos) -> int:
        """Counted position at ``now``, after the last pulse due by ``now``."""
        begin, grid = self.division(now)
        distance = (self.profile.count(now) - begin) * self.direction
        return begin + distance // grid * grid * self.direction

    def pulse_time(self, position: int, after: Nanos) -> Nanos | None:
        """Moment of the first pulse later than ``after`` that reaches or passes ``position``; None if there is none."""
        for begin, end, grid in self.intervals():
            distance = (position - begin) * self.direction
            reached = begin - (-distance // grid) * grid * self.direction
            if distance > 0 and (end is None or (end - reached) * self.direction >= 0):
                return self.profile.pulse_time(reached, after)
        return None


Plan: TypeAlias = Profile | StepTrain
"""The source of the pulses of an axis: its profile, or the train of pulses that the profile drives."""


def profile_of(plan: Plan) -> Profile:
    """The profile of a plan."""
    return plan.profile if isinstance(plan, StepTrain) else plan


def step_train(profile: Profile, begin: int, microstepping: Microstepping, grid: int | None = None) -> StepTrain:
    """The pulses of ``profile``, which moves in one direction, for a train that stands at ``begin`` with division ``grid``
    (the fine one by default).

    M-26: the division changes at the first position on the coarser grid after the limit is passed, and back likewise; to
    the fine one at the latest where the last coarse position before the target is, so that the target is reached exactly.
    Positions on the coarser grid are multiples of it; a train whose fine grid misses them is shifted against them by the
    least amount. Raises `Misuse` when the grids do not fit or the profile turns.
    """
    fine, coarse, limit = microstepping
    if fine < 1 or coarse % fine:
        raise Misuse(f"coarse grid = {coarse} u: must be a multiple of the fine one, {fine} u")
    directions = {s.direction for s in profile.segments}
    if len(directions) > 1:
        raise Misuse("a train of pulses goes one way: this profile turns")
    if coarse == fine or not directions:
        return StepTrain(profile, microstepping, (Division(begin, fine),))
    direction = directions.pop()
    up, down = _fast_interval(profile, limit * _ROUNDING, is_fast=grid == coarse)
    if up is None and grid != coarse:
        return StepTrain(profile, microstepping, (Division(begin, fine),))
    origin = begin % fine

    def next_coarse(position: float) -> int:
        return origin - int(-(position - origin) * direction // coarse) * coarse * direction

    first = begin if up is None else next_coarse(up)
    last: int | None = None
    if profile.end is not None:
        target = profile.base + profile.counts[-1]
        last = target - (target - origin) * direction % coarse * direction
        if down is not None and (next_coarse(down) - last) * direction < 0:
            last = next_coarse(down)
        if (last - first) * direction <= 0:
            return StepTrain(profile, microstepping, (Division(begin, fine),))
    divisions = [Division(first, coarse)]
    if first != begin:
        divisions.insert(0, Division(begin, fine))
    if last is not None:
        divisions.append(Division(last, fine))
    return StepTrain(profile, microstepping, tuple(divisions))


def forced_stop(train: StepTrain, now: Nanos, curve: SpeedCurve, landing: int | None = None) -> StepTrain:
    """The train that replaces ``train`` at K, LIMIT or the end of a seek: down the slope of ``curve`` to its start speed, then
    to the next position of the fine grid (of the coarse one while the division cannot change before), or, with ``landing``,
    to the next multiple of it (64 u: a full step).

    At or below the start speed the stop is at once, on the counted position, unless a landing position is still to be found.
    Landing positions are shifted against their multiples like coarse grids (`step_train`).
    """
    fine, coarse, _ = train.microstepping
    counted = train.count(now)
    grid = train.division(now).grid
    state = MotionState.of(train.profile, now)
    origin = counted % fine
    if abs(state.velocity) <= curve.start and (landing is None or (counted - origin) % landing == 0):
        return step_train(at_rest(now, counted), counted, train.microstepping)
    profile = plan_forced_stop(state, curve, fine if landing is None else landing, origin)
    rest = profile.base + profile.counts[-1]
    if grid == coarse and (rest - counted) * train.direction < coarse:
        profile = plan_forced_stop(state, curve, coarse, origin)
    return step_train(profile, counted, train.microstepping, grid)


def _fast_interval(profile: Profile, limit: float, *, is_fast: bool) -> tuple[float | None, float | None]:
    """Positions at which the speed, which rises and then falls, exceeds ``limit`` and returns to it; None where it does not.

    ``is_fast``: the speed exceeded the limit before this profile began.
    """
    begin_s = 0.0
    up: float | None = None
    down: float | None = None
    fast = is_fast
    for s in profile.segments:
        before = abs(s.velocity(begin_s))
        after = before if s.end_s == inf else abs(s.velocity(s.end_s))
        if not fast and max(before, after) > limit:
            up = profile.base + s.position(begin_s if before > limit else s.when_speed(limit))
            fast = True
        if fast and down is None and after <= limit:
            down = profile.base + s.position(begin_s if before <= limit else s.when_speed(limit))
        begin_s = s.end_s
    return up, down
