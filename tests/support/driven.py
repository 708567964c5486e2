"""A machine with one axis, for tests of what it drives, and where its mechanics are pulse by pulse."""

from __future__ import annotations

from toy import Bare, ToyAxis

from steptwin.machine import Nanos
from steptwin.motion import MotionState, plan_position
from steptwin.motion.divisions import Plan
from steptwin.world.course import Build, Standing


class Driven(Bare):
    """A machine whose only axis goes where the test says."""

    __slots__ = ("axis",)

    def __init__(self) -> None:
        super().__init__()
        self.axis = ToyAxis()

    @property
    def axes(self) -> tuple[ToyAxis]:
        return (self.axis,)

    def go(self, target: int, now: Nanos) -> None:
        self.axis.follow(plan_position(MotionState.of(self.axis.plan, now), target, 500.0, 500.0, 200.0))
        self.changed()


def changes(plan: Plan, after: Nanos, until: Nanos) -> list[tuple[Nanos, int]]:
    """(moment, count) of every pulse, found by asking for the next one."""
    found = []
    now = after
    while True:
        here = plan.count(now)
        ahead = [t for c in (here - 1, here + 1) if (t := plan.pulse_time(c, now)) is not None]
        if not ahead or min(ahead) > until:
            return found
        now = min(ahead)
        found.append((now, plan.count(now)))


def pulse_by_pulse(build: Build, plan: Plan, standing: Standing, begin: Nanos, until: Nanos) -> list[tuple[Nanos, int, int]]:
    """(moment, rotor, load) after every pulse: each pushes the rotor, stops hold it, it pushes the load."""
    rotor, load = standing[:2]
    count = plan.count(begin)
    low = None if build.low is None else build.low - build.play
    way = [(begin, rotor, load)]
    for moment, new in changes(plan, begin, until):
        rotor += (new - count) * build.sign
        count = new
        if low is not None:
            rotor = max(rotor, low)
        if build.high is not None:
            rotor = min(rotor, build.high)
        load = min(max(load, rotor), rotor + build.play)
        way.append((moment, rotor, load))
    return way
