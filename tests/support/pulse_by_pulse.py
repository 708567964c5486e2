"""Where mechanics are pulse by pulse: an independent way to the trajectories that `steptwin.simulation.mechanics.trajectory` has
in closed form."""

from __future__ import annotations

from steptwin.controller import Nanos
from steptwin.motion.divisions import Plan
from steptwin.simulation.mechanics.trajectory import Build, MechanicalState


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


def pulse_by_pulse(build: Build, plan: Plan, state: MechanicalState, begin: Nanos, until: Nanos) -> list[tuple[Nanos, int, int]]:
    """(moment, rotor, load) after every pulse: each pushes the rotor, stops hold it, it pushes the load."""
    rotor, load = state[:2]
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
