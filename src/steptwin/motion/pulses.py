"""Projections of profiles with numpy: pulse times, positions and velocities as arrays. Never part of a controller's state.

Every formula is the one of `steptwin.motion.profile`, operation by operation, so that arrays and single looks agree exactly.
"""

from __future__ import annotations

from math import inf
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from steptwin.controller import Nanos
from steptwin.motion.divisions import StepTrain
from steptwin.motion.paths import ArcSegment, Circular
from steptwin.motion.profile import NEWTON_STEPS, Profile, Segment
from steptwin.motion.trig import QUARTER, arcsine_below_45, cosine_near_0, sine_near_0

PulseTimes: TypeAlias = NDArray[np.int64]
Reals: TypeAlias = NDArray[np.float64]

_BLOCK = 4096
"""Pulses computed at a time: the buffers stay in the first- and second-level cache."""
_FEW = 12
"""Up to this number of pulses, single evaluations are faster than arrays."""
_STEPS: Reals = np.arange(_BLOCK, dtype=np.float64)


class _PulseRun(NamedTuple):
    """Pulses ``first``, ``first + step``, … (relative to the base), ``size`` of them, within one segment."""

    segment: int
    first: int
    step: int
    size: int


def pulse_times(profile: Profile, after: Nanos, until: Nanos) -> PulseTimes:
    """Moments of all pulses with ``after`` < time <= ``until``, in order (int64 ns)."""
    return _times(profile, _runs(profile, after, until))


def pulse_runs(profile: Profile, after: Nanos, until: Nanos) -> list[tuple[int, PulseTimes]]:
    """Moments as in `pulse_times`, one pair (direction, times) for each interval of one direction."""
    runs = _runs(profile, after, until)
    times = _times(profile, runs)
    intervals: list[tuple[int, PulseTimes]] = []
    begin = end = 0
    for i, run in enumerate(runs):
        end += run.size
        if i + 1 == len(runs) or runs[i + 1].step != run.step:
            intervals.append((run.step, times[begin:end]))
            begin = end
    return intervals


def step_times(train: StepTrain, after: Nanos, until: Nanos) -> PulseTimes:
    """Moments of all STEP pulses of ``train`` with ``after`` < time <= ``until``, in order (int64 ns)."""
    profile = train.profile
    runs: list[_PulseRun] = []
    for segment, first, step, size in _runs(profile, after, until):
        last = first + step * (size - 1)
        for begin, end, grid in train.intervals():
            # Positions relative to the base, counted along the direction of motion from where the division begins.
            origin = (begin - profile.base) * step
            low = max(first * step - origin, 1)
            high = last * step - origin
            if end is not None:
                high = min(high, (end - begin) * step)
            low, high = -(-low // grid), high // grid
            if low <= high:
                runs.append(_PulseRun(segment, (origin + low * grid) * step, grid * step, high - low + 1))
    return _times(profile, runs)


def _runs(profile: Profile, after: Nanos, until: Nanos) -> list[_PulseRun]:
    """All pulses of the window, segment by segment."""
    after = max(after, profile.start)
    if until <= after:
        return []
    first = profile.count(after) - profile.base
    last = profile.count(until) - profile.base
    runs: list[_PulseRun] = []
    begin: float = 0
    for i, (s, end) in enumerate(zip(profile.segments, profile.ends, strict=True)):
        if begin <= until - profile.start and after - profile.start < end:
            low = first if begin <= after - profile.start else profile.counts[i]
            high = last if until - profile.start < end else profile.counts[i + 1]
            size = (high - low) * s.direction
            if size > 0:
                runs.append(_PulseRun(i, low + s.direction, s.direction, size))
        begin = end
    return runs


def _times(profile: Profile, runs: list[_PulseRun]) -> PulseTimes:
    out = np.empty(sum(run.size for run in runs), dtype=np.int64)
    done = 0
    for run in runs:
        _fill(profile, run, out[done : done + run.size])
        done += run.size
    return out


def _fill(profile: Profile, run: _PulseRun, out: PulseTimes) -> None:
    """Moments of the pulses of ``run``. The profile itself gives the first and the last, to which limits may apply."""
    index, first, step, size = run
    if size <= _FEW:
        for i in range(size):
            out[i] = profile.start + profile.pulse_ns(index, first + i * step)
        return
    s: Segment | ArcSegment = profile.segments[index]
    steps = _STEPS if step == 1 else _STEPS * step
    buffers = np.empty((4, _BLOCK))
    for at in range(1, size - 1, _BLOCK):
        n = min(_BLOCK, size - 1 - at)
        u = buffers[0, :n]
        np.add(steps[:n], first + step * at, out=u)
        if isinstance(s, ArcSegment):
            _along_arc(s, u, buffers[1:, :n])
        else:
            _solve(s, u, buffers[1:, :n])
        u *= 1e9
        np.ceil(u, out=u)
        part = out[at : at + n]
        part[:] = u
        if profile.start:
            part += profile.start
    for i in (0, size - 1):
        out[i] = profile.start + profile.pulse_ns(index, first + i * step)


# Each function turns positions ``u`` into seconds, in place, and uses three more buffers.


def _along_arc(s: ArcSegment, u: Reals, buffers: Reals) -> None:
    curve = s.curve
    u -= curve.centre_p
    u /= curve.radius_p
    # No pulse inside a run is beyond a turning point; the profile gives its first and last pulses.
    folded = (u < 0.0) if s.half & 1 == 0 else (u >= 0.0)
    np.abs(u, out=u)
    np.subtract(1.0, u, out=u)
    u *= 0.5
    np.sqrt(u, out=u)
    u[:] = arcsine_below_45(u, np.sqrt)
    u *= 2.0
    np.subtract(2.0, u, out=u, where=folded)
    u += 2.0 * s.half
    u -= curve.angle_q
    u /= curve.turn_q
    _solve(s.travel, u, buffers)


def _solve(s: Segment, u: Reals, buffers: Reals) -> None:
    u -= s.c0
    solve = _cruise if s.c2 == 0.0 else _cubic if s.c3 != 0.0 else _from_rest if s.c1 == 0.0 else _ramp
    solve(s, u, buffers)


# Each function turns distances ``u`` from c0 into seconds.


def _cruise(s: Segment, u: Reals, _buffers: Reals) -> None:
    u /= s.c1
    u += s.anchor_s


def _from_rest(s: Segment, u: Reals, _buffers: Reals) -> None:
    u /= s.c2
    np.maximum(u, 0.0, out=u)
    np.sqrt(u, out=u)
    if s.c2 * s.direction > 0.0:
        u += s.anchor_s
    else:
        np.subtract(s.anchor_s, u, out=u)


def _ramp(s: Segment, u: Reals, buffers: Reals) -> None:
    root = buffers[0]
    half = 0.5 * s.c1
    np.multiply(u, s.c2, out=root)
    root += half * half
    np.sqrt(root, out=root)
    if s.direction > 0:
        root += half
    else:
        np.subtract(half, root, out=root)
    u /= root
    u += s.anchor_s


def _cubic(s: Segment, u: Reals, buffers: Reals) -> None:
    x, slope, bend = buffers
    b1, b2, b3 = abs(s.c1), abs(s.c2), abs(s.c3)
    half = 0.5 * b1
    d = np.abs(u, out=u)
    np.multiply(d, b2 / 1.5, out=x)
    x += half * half
    np.sqrt(x, out=x)
    x += half
    np.divide(d, x, out=x)
    for _ in range(NEWTON_STEPS):
        np.multiply(x, 3.0 * b3, out=slope)
        np.subtract(2.0 * b2, slope, out=slope)
        slope *= x
        slope += b1
        np.multiply(x, 2.0 * b3, out=bend)
        np.subtract(b2, bend, out=bend)
        x *= x
        x *= bend
        x += d
        x /= slope
    if s.c2 * s.direction > 0.0:
        np.add(x, s.anchor_s, out=u)
    else:
        np.subtract(s.anchor_s, x, out=u)


def positions(profile: Profile, times: PulseTimes) -> Reals:
    """Real commanded positions (pulses) at ``times`` (int64 ns)."""
    return _evaluate(profile, times, derivative=False)


def velocities(profile: Profile, times: PulseTimes) -> Reals:
    """Commanded velocities (pulses/s) at ``times`` (int64 ns)."""
    return _evaluate(profile, times, derivative=True)


def _evaluate(profile: Profile, times: PulseTimes, *, derivative: bool) -> Reals:
    n = times - profile.start
    out = np.full(n.shape, 0.0 if derivative else profile.base + profile.final_p)
    begin: float = -inf
    for s, end in zip(profile.segments, profile.ends, strict=True):
        chosen = (begin <= n) & (n < end)
        begin = end
        t = n[chosen] / 1e9
        if isinstance(s, ArcSegment):
            out[chosen] = _arc_velocity(s, t) if derivative else profile.base + _arc_position(s.curve, _polynomial(s.travel, t))
        else:
            out[chosen] = _slope(s, t) if derivative else profile.base + _polynomial(s, t)
    return out


def _polynomial(s: Segment, t: Reals) -> Reals:
    u = t - s.anchor_s
    return s.c0 + u * (s.c1 + u * (s.c2 + u * s.c3))


def _slope(s: Segment, t: Reals) -> Reals:
    u = t - s.anchor_s
    return s.c1 + u * (2.0 * s.c2 + u * (3.0 * s.c3))


def _arc_position(curve: Circular, w: Reals) -> Reals:
    return curve.centre_p + curve.radius_p * _sine(curve.angle_q + curve.turn_q * w, quarters=1)


def _arc_velocity(s: ArcSegment, t: Reals) -> Reals:
    curve = s.curve
    angle_q = curve.angle_q + curve.turn_q * _polynomial(s.travel, t)
    return -curve.radius_p * _sine(angle_q) * QUARTER * curve.turn_q * _slope(s.travel, t)


def _sine(angle_q: Reals, quarters: int = 0) -> Reals:
    """Sine of ``angle_q`` plus whole ``quarters``."""
    whole = np.floor(angle_q + 0.5)
    x = (angle_q - whole) * QUARTER
    whole = whole.astype(np.int64) + quarters
    value = np.where(whole & 1, cosine_near_0(x), sine_near_0(x))
    return np.where(whole & 2, 0.0 - value, value)
