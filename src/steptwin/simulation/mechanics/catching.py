"""When a field catches a rotor that has lost it, and that moves by its load and its friction alone.

A field that passes a rotor has no mean torque. In the frame of the field the rotor moves with its speed less that of the field,
through one potential well after the other, and its mean kinetic energy is as much lower than its whole energy as wells are
deep, on the mean (`steptwin.simulation.mechanics.potential`). So it leaves no well any more when its speed against the field has
come down to

    √(2 · T·λ/2π · √(1 − r²) / J),  r = (load + friction) / T.

The start-stop speed of a motor is the same quantity, measured: the field that catches a rotor at rest.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import replace
from math import ceil, inf
from typing import NamedTuple, TypeAlias

from steptwin.controller import SECOND, Nanos
from steptwin.motion import Profile
from steptwin.simulation.mechanics.coasting import slow_from
from steptwin.simulation.mechanics.loadmotion import polynomials
from steptwin.simulation.mechanics.motor import StepperMotor, roots

Velocity: TypeAlias = tuple[float, float, float]
"""Pulses/s, pulses/s² and pulses/s³ at the beginning of a part."""
_LONG_S = 1.0
"""Into the last part of motions without end."""


class Catch(NamedTuple):
    """Moments from which on a rotor may be caught, and at which it is; None: never, as things are."""

    may_be: Nanos | None
    caught: Nanos | None


def catch_of(motor: StepperMotor, plan: Profile, rotor: Profile, now: Nanos, sign: int, limit: float, *, may_be: bool) -> Catch:
    """When the field of ``plan`` catches a ``rotor``: it is not faster than ``limit`` pulses/s against it, and the torque of the
    ``motor`` with its whole load suffices. ``sign``: direction of the mechanics for positive pulses.

    ``may_be``: whether that may be at once. A rotor that has just left its field has the energy to leave the next wells, too: it
    has to become faster than ``limit`` against a field that moves, first.
    """
    since = now if may_be else None
    strong = replace(motor, start_p=inf)
    for begin, end_s, against in _parts(plan, rotor, now):
        segment = plan.segments[bisect_right(plan.ends, begin - plan.start)]
        begin_s = (begin - plan.start) / SECOND
        for t0, t1, is_slow in _slow(against, limit, end_s):
            if is_slow and since is not None:
                found = strong.catches(segment, begin_s + t0, begin_s + t1, sign)
                if found is not None:
                    return Catch(since, max(begin, plan.start + ceil(found * SECOND)))
            elif not is_slow and since is None:
                since = begin + ceil(t0 * SECOND)
    if plan.end is None or not motor.holds():
        return Catch(since, None)
    rest = max(now, plan.end)
    return Catch(rest if since is None else since, slow_from(rotor, rest, limit))


def _parts(plan: Profile, rotor: Profile, now: Nanos) -> Iterator[tuple[Nanos, float, Velocity]]:
    """(begin, seconds, velocity of the field against the rotor) while the field moves."""
    fields, rotors = _velocities(plan, now), _velocities(rotor, now)
    field, own = next(fields), next(rotors)
    later, later_own = next(fields, None), next(rotors, None)
    at = now
    while plan.end is None or at < plan.end:
        while later is not None and later[0] <= at:
            field, later = later, next(fields, None)
        while later_own is not None and later_own[0] <= at:
            own, later_own = later_own, next(rotors, None)
        until = min((one[0] for one in (later, later_own) if one is not None), default=None)
        (v, a, j), (w, b, k) = _velocity(*field, at), _velocity(*own, at)
        yield at, inf if until is None else (until - at) / SECOND, (v - w, a - b, j - k)
        if until is None:
            return
        at = until


def _velocities(profile: Profile, now: Nanos) -> Iterator[tuple[Nanos, Velocity]]:
    for at, _, v, a, j in polynomials(profile, now, None):
        yield at, (v, a, j)


def _velocity(since: Nanos, velocity: Velocity, now: Nanos) -> Velocity:
    """A velocity that is known since a moment, at a later one."""
    v, a, j = velocity
    u = (now - since) / SECOND
    return v + u * (a + 0.5 * j * u), a + j * u, j


def _slow(velocity: Velocity, limit: float, end: float) -> Iterator[tuple[float, float, bool]]:
    """(begin, end, whether not faster than ``limit``) of the pieces of a part, seconds."""
    v, a, j = velocity
    turns = sorted({u for side in (limit, -limit) for u in roots((v - side, a, 0.5 * j)) if 0.0 < u < end})
    begins = [0.0, *turns]
    for t0, t1 in zip(begins, [*turns, end], strict=True):
        middle = 0.5 * (t0 + t1) if t1 < inf else t0 + _LONG_S
        yield t0, t1, abs(v + middle * (a + 0.5 * j * middle)) <= limit
