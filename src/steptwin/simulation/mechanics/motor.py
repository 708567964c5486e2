"""A stepper motor with a pull-out torque curve and a load: when it stalls, and when it synchronises with the field again.

Torques in N·m, speeds in pulses/s. While the torque that a motion needs,

    inertia · acceleration + friction · direction + load,

does not exceed the curve at its speed, the rotor follows the field. Where it exceeds the curve, the rotor stops at once, and
pulses are lost until the field is slow enough and the torque is sufficient; then the rotor synchronises. One that may move
without current does so meanwhile (`steptwin.simulation.mechanics.catching`). Velocity within a
segment is a polynomial, so both moments are computed in closed form. What it does in a band of resonance is in
`steptwin.simulation.mechanics.resonance`, what it does when its field stops at once in `steptwin.simulation.mechanics.potential`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import inf, sqrt
from typing import Any, NamedTuple, TypeAlias

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.motion import Segment
from steptwin.simulation.mechanics.resonance import MotionPhase, Resonance

FASTEST = 1e15
"""Limit of accelerations without current, pulses/s², far above all that is built, so that no product overflows."""
LOOK_S = 0.001
"""Motions along arcs are no polynomials: they are sampled at this interval, s."""
_NEAR_S = 1e-5
Quadratic: TypeAlias = tuple[float, float, float]
"""q0 + q1·u + q2·u²."""
_SAME = 0.005
"""Relative difference of torques that three digits do not show."""
_SLACK = 1e-12
"""Relative tolerance for rounding when required and available torque are equal."""


class Burden(NamedTuple):
    """A further load of a motor: inertia, N·m per pulse/s², friction, N·m, and a constant torque as that of its own load, N·m."""

    inertia: float
    friction: float
    load: float = 0.0

    def times(self, share: float) -> Burden:
        return Burden(self.inertia * share, self.friction * share, self.load * share)

    def plus(self, other: Burden) -> Burden:
        return Burden(self.inertia + other.inertia, self.friction + other.friction, self.load + other.load)


NO_BURDEN = Burden(0.0, 0.0)


NEEDS_MORE_TORQUE = Message(
    "simulation.needs-more-torque", "the motion needs more than the {has:.3g} N·m that the motor has at this speed"
)
NEEDS_TORQUE = Message("simulation.needs-torque", "the motion needs {need:.3g} N·m, the motor has {has:.3g} N·m")


@dataclass(frozen=True, slots=True)
class StepperMotor:
    """``curve``: points (speed in pulses/s, pull-out torque) from speed 0 on, interpolated linearly; no torque above the last."""

    curve: tuple[tuple[float, float], ...]
    inertia: float
    """Inertia of rotor and load together, N·m per pulse/s²."""
    friction: float
    """Friction torque, against the direction of motion."""
    load: float
    """Constant load torque; positive if it pulls the axis towards lower positions."""
    start_p: float | None
    """Highest start-stop speed, pulses/s: the largest jump of the field's speed that the rotor follows, and the highest speed at
    which a stopped rotor synchronises. None: every jump is followed, and the rotor synchronises where the field stops or
    reverses."""
    detent: float = 0.0
    """Detent torque without current, with a period of a full step."""
    hold: float = 1.0
    """Share of the holding torque while the current is reduced at rest."""
    hold_ns: Nanos = 0
    """How long after the last pulse, or after current was switched on, it is reduced."""
    overruns: bool = False
    """Whether the rotor runs on where the field stops at once and cannot hold it."""
    resonance: Resonance | None = None

    def __post_init__(self) -> None:
        speeds = [speed for speed, _ in self.curve]
        if not self.curve or speeds[0] != 0.0 or any(a >= b for a, b in pairwise(speeds)):
            raise Misuse("a torque curve begins at speed 0, and each speed is higher than the one before")
        if any(torque < 0.0 for _, torque in self.curve) or self.inertia < 0.0 or self.friction < 0.0:
            raise Misuse("torques of a curve, inertia and friction must not be negative")

    def check_coasting(self, brake: float = 0.0) -> None:
        """Raises `Misuse` if the torques are too high for the inertia while no current holds the rotor. ``brake`` in N·m."""
        torque = abs(self.load) + self.friction + brake
        if torque > FASTEST * self.inertia:
            raise Misuse(f"{torque:g} N·m on so small an inertia accelerates by more than {FASTEST:g} imp/s² without current")

    @property
    def catch_p(self) -> float:
        return 0.0 if self.start_p is None else self.start_p

    def follows(self, jump: float) -> bool:
        """Whether the rotor follows a jump of the field's speed (pulses/s)."""
        return self.start_p is None or abs(jump) <= self.start_p * (1.0 + 1e-9)

    def torque(self, speed: float) -> float:
        """Pull-out torque at ``speed`` (pulses/s, not negative); negative above the end of the curve."""
        constant, slope = self._line(speed)
        return constant + slope * speed

    def _line(self, speed: float) -> tuple[float, float]:
        """The linear piece of the curve at ``speed``: its torque extrapolated to speed 0, and its slope."""
        for (s0, t0), (s1, t1) in pairwise(self.curve):
            if speed <= s1:
                slope = (t1 - t0) / (s1 - s0)
                return t0 - slope * s0, slope
        last, torque = self.curve[-1]
        return (torque, 0.0) if speed <= last else (-1.0, 0.0)

    def holds(self) -> bool:
        """Whether the motor holds the load at rest."""
        return abs(self.load) <= self.holding + self.friction

    @property
    def holding(self) -> float:
        """Torque of the field at rest, with the whole current."""
        return self.curve[0][1]

    def phases(self, s: Any, begin_s: float, end_s: float, sign: int) -> Iterator[MotionPhase]:
        """Phases of a segment for its resonance, between passages of the band and of corners of the curve."""
        band = () if self.resonance is None else (self.resonance.low, self.resonance.high)
        if not isinstance(s, Segment):
            for t, speed, need in self._looks(s, begin_s, end_s, sign):
                yield MotionPhase(t, min(t + LOOK_S, end_s), speed, self._use(speed, need))
            return
        begins = [begin_s, *self._corners(s, begin_s, end_s, *band)] if end_s < inf else [begin_s]
        for t0, t1 in zip(begins, [*begins[1:], end_s], strict=True):
            middle = 0.5 * (t0 + t1) if t1 < inf else t0
            speed = abs(s.velocity(middle))
            yield MotionPhase(t0, t1, speed, self._use(speed, self.need_at(s, middle, sign)))

    def _use(self, speed: float, need: float) -> float:
        """The share of its torque that is needed, at most 1."""
        torque = self.torque(speed)
        return 1.0 if torque <= abs(need) else abs(need) / torque

    def needs(self, acceleration: float, direction: int) -> float:
        """Torque required for an acceleration (pulses/s²) while moving in ``direction``."""
        return self.inertia * acceleration + self.friction * direction + self.load

    def need_at(self, s: Any, t_s: float, sign: int) -> float:
        """Torque required at a moment of a segment."""
        if isinstance(s, Segment):
            acceleration = 2.0 * s.c2 + 6.0 * s.c3 * (t_s - s.anchor_s)
        else:
            acceleration = (s.velocity(t_s + _NEAR_S) - s.velocity(t_s - _NEAR_S)) / (2.0 * _NEAR_S)
        return self.needs(sign * acceleration, sign * s.direction)

    def lack(self, s: Any, t_s: float, sign: int) -> str:
        """In words, what the motion needs at a moment of a segment and the motor does not have; empty if it has it."""
        if not isinstance(s, Segment):
            return ""
        need, has = abs(self.need_at(s, t_s, sign)), max(self.torque(abs(s.velocity(t_s))), 0.0)
        if need < has * (1.0 - _SAME):
            return ""
        if need <= has * (1.0 + _SAME):
            return NEEDS_MORE_TORQUE(has=has)
        return NEEDS_TORQUE(need=need, has=has)

    def loses(self, s: Any, begin_s: float, end_s: float, sign: int) -> float | None:
        """First moment from ``begin_s`` on and before ``end_s`` at which the torque is insufficient; seconds of segment ``s``.

        ``sign`` is the direction of the mechanics for positive pulses.
        """
        if not isinstance(s, Segment):
            return self._loses_looking(s, begin_s, end_s, sign)
        if end_s == inf:
            need = self.needs(sign * 2.0 * s.c2, sign * s.direction)
            return begin_s if self._lacks(abs(s.velocity(begin_s)), need) else None
        begins = [begin_s, *self._corners(s, begin_s, end_s)]
        for t0, t1 in zip(begins, [*begins[1:], end_s], strict=True):
            spares, slack = self._spares(s, t0, t1, sign)
            for spare in spares:
                lost = _first_below_0(spare, t0 - s.anchor_s, t1 - s.anchor_s, slack)
                if lost is not None:
                    return lost + s.anchor_s
        return None

    def _spares(self, s: Segment, t0: float, t1: float, sign: int) -> tuple[list[Quadratic], float]:
        """The torque reserve for each direction from ``t0`` to ``t1``, as polynomials, and its tolerance for rounding.

        Time is in seconds since the segment's anchor; between the two moments the speed passes no corner of the curve.
        """
        d = s.direction
        speed = (d * s.c1, d * 2.0 * s.c2, d * 3.0 * s.c3)
        need = (self.needs(sign * 2.0 * s.c2, sign * d), self.inertia * sign * 6.0 * s.c3)
        constant, slope = self._line(abs(s.velocity(0.5 * (t0 + t1))))
        spares = [
            (constant + slope * speed[0] - side * need[0], slope * speed[1] - side * need[1], slope * speed[2])
            for side in (1.0, -1.0)
        ]
        return spares, _SLACK * (abs(constant) + abs(need[0]))

    def _lacks(self, speed: float, need: float) -> bool:
        torque = self.torque(speed)
        return abs(need) > torque + _SLACK * (abs(torque) + abs(need))

    def _corners(self, s: Segment, begin_s: float, end_s: float, *others: float) -> list[float]:
        """Moments at which the speed passes a corner of the curve, or one of ``others``."""
        if s.c2 == 0.0:
            return []
        v0, v1 = abs(s.velocity(begin_s)), abs(s.velocity(end_s))
        inside = {speed for speed in (*(speed for speed, _ in self.curve), *others) if min(v0, v1) < speed < max(v0, v1)}
        return sorted(min(max(s.when_speed(speed), begin_s), end_s) for speed in inside)

    def _loses_looking(self, s: Any, begin_s: float, end_s: float, sign: int) -> float | None:
        return next((t for t, speed, need in self._looks(s, begin_s, end_s, sign) if self._lacks(speed, need)), None)

    def _looks(self, s: Any, begin_s: float, end_s: float, sign: int) -> Iterator[tuple[float, float, float]]:
        """(moment, speed, torque needed), every `LOOK_S`."""
        looks = 0 if end_s == inf else int((end_s - begin_s) / LOOK_S)
        for n in range(looks + 1):
            t = begin_s + n * LOOK_S
            yield t, abs(s.velocity(t)), self.need_at(s, t, sign)

    def catches(self, s: Any, begin_s: float, end_s: float, sign: int) -> float | None:
        """First moment from ``begin_s`` on and before ``end_s`` at which a stopped rotor synchronises with the field.

        The speed of the field is then not above ``start_p``, and the torque is sufficient.
        """
        if not isinstance(s, Segment):
            return self._catches_looking(s, begin_s, end_s, sign)
        if end_s == inf:
            speed, need = abs(s.velocity(begin_s)), self.needs(sign * 2.0 * s.c2, sign * s.direction)
            return begin_s if speed <= self.catch_p and not self._lacks(speed, need) else None
        begins = [begin_s, *self._corners(s, begin_s, end_s, self.catch_p)]
        for t0, t1 in zip(begins, [*begins[1:], end_s], strict=True):
            is_slow = abs(s.velocity(0.5 * (t0 + t1))) <= self.catch_p
            if not is_slow and abs(s.velocity(t0)) > self.catch_p:
                continue
            spares, slack = self._spares(s, t0, t1, sign)
            caught = _first_not_below_0(spares, t0 - s.anchor_s, t1 - s.anchor_s if is_slow else t0 - s.anchor_s, slack)
            if caught is not None:
                return caught + s.anchor_s
        return None

    def _catches_looking(self, s: Any, begin_s: float, end_s: float, sign: int) -> float | None:
        return next(
            (
                t
                for t, speed, need in self._looks(s, begin_s, end_s, sign)
                if speed <= self.catch_p and not self._lacks(speed, need)
            ),
            None,
        )


def _first_below_0(q: Quadratic, begin: float, end: float, slack: float) -> float | None:
    """First u in begin…end at which q goes below 0 (by more than ``slack`` at the ends)."""
    at_begin, at_end = _at(q, begin), _at(q, end)
    if at_begin < -slack:
        return begin
    if at_begin <= slack and _slope(q, begin) < 0.0:
        # The root is at the beginning, apart from rounding: only the depth of the fall after it decides.
        lowest = end if q[2] <= 0.0 else min(end, -q[1] / (2.0 * q[2]))
        if _at(q, lowest) < -slack:
            return begin
    for u in sorted(u for u in roots(q) if _slope(q, u) < 0.0):
        if begin < u <= end:
            return u if at_end < -slack or u < end else None
    if at_end >= -slack:
        return None
    # A parabola that touches 0 at the beginning has no falling root; otherwise the root is the end, apart from rounding.
    return begin if at_begin <= slack else end


def _first_not_below_0(all_q: list[Quadratic], begin: float, end: float, slack: float) -> float | None:
    """First u from begin on and before end (or at begin) at which no q is below 0; 0 itself counts where q does not fall."""

    def is_up(q: Quadratic, u: float) -> bool:
        value = _at(q, u)
        if value > slack or value < -slack:
            return value > 0.0
        return _slope(q, u) >= 0.0 or (q[2] > 0.0 and _at(q, -q[1] / (2.0 * q[2])) >= -slack)

    rising = sorted(u for q in all_q for u in roots(q) if begin < u < end and _slope(q, u) > 0.0)
    return next((u for u in (begin, *rising) if all(is_up(q, u) for q in all_q)), None)


def _at(q: Quadratic, u: float) -> float:
    return q[0] + u * (q[1] + u * q[2])


def _slope(q: Quadratic, u: float) -> float:
    return q[1] + 2.0 * q[2] * u


def roots(q: Quadratic) -> list[float]:
    """Where q passes through 0."""
    q0, q1, q2 = q
    if q2 == 0.0:
        return [] if q1 == 0.0 else [-q0 / q1]
    inside = q1 * q1 - 4.0 * q2 * q0
    if inside <= 0.0:
        return []
    half = -0.5 * (q1 + (sqrt(inside) if q1 >= 0.0 else -sqrt(inside)))
    return [half / q2, q0 / half]
