"""Motions: their computed durations and the reasons of their ends.

Suffixes: ``_u`` configured units (u, u/s, u/s²), ``_s`` seconds.
"""

from __future__ import annotations

import enum
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from math import inf

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.mic488.registers import AXIS_STATUS_TEXTS
from steptwin.mic488.status import AxisStatus
from steptwin.motion import MotionState, plan_position

MOVING = frozenset({AxisStatus.VELOCITY, AxisStatus.POSITION, AxisStatus.HOMING, AxisStatus.CORRECTION})

_SCALE = 2**20
"""Pulses per unit assumed for a duration if GEAR is unknown; the result hardly depends on it."""


class Reason(enum.Enum):
    """Why a motion ended."""

    TARGET = "target reached"
    RESTED = "came to rest"
    REST = "at rest"
    LIMIT_L = "stopped at limit L"
    LIMIT_R = "stopped at limit R"
    STOPPED = "stopped by a command"
    POSITION_ERROR = "position error (encoder)"
    DISABLED = "drive switched off"
    DIVERTED = "redirected by another command"
    OVERDUE = "still moving"
    RELEASED = "released"
    NOT_HELD = "not held"
    COMMUNICATION = "communication lost"


_REASONS: dict[int, Reason] = {
    AxisStatus.OFF: Reason.DISABLED,
    AxisStatus.ON: Reason.STOPPED,
    AxisStatus.REACHED: Reason.TARGET,
    AxisStatus.ERROR: Reason.POSITION_ERROR,
    AxisStatus.LIMIT_L: Reason.LIMIT_L,
    AxisStatus.LIMIT_R: Reason.LIMIT_R,
}


class MotionKind(enum.Enum):
    """Kinds of motion commands."""

    POSITION = "position"
    DISTANCE = "distance"
    VELOCITY = "velocity"
    HOMING = "homing"


@dataclass(frozen=True, slots=True)
class MotionCommand:
    """A motion command. ``value_u`` is the position, distance or velocity; ``before`` the status of the axis before it."""

    kind: MotionKind
    value_u: float
    at: Nanos
    before: int


@dataclass(frozen=True, slots=True)
class MoveEnd:
    """The end of a motion of ``axis``. ``ok``: it ended as intended."""

    axis: int
    reason: Reason
    position_u: float | None
    unit: str
    after_s: float
    detail: str = ""
    cause: Exception | None = None

    @property
    def ok(self) -> bool:
        return self.reason in (Reason.TARGET, Reason.RESTED, Reason.REST, Reason.RELEASED)

    def __str__(self) -> str:
        where = "" if self.position_u is None else f" at {self.position_u:g} {self.unit}"
        return f"M{self.axis}: {self.reason.value}{where}{f' ({self.detail})' if self.detail else ''}"


def status_text(code: int) -> str:
    return AXIS_STATUS_TEXTS.get(code, f"unknown status {code}")


ROUNDED = 2.0**-22
"""A position in REAL has 24 bits, and so has its target: what both are rounded by, as a part of the target."""


def arrival(target_u: float, position_u: float, gear: float | None, seen_u: Iterable[float] = ()) -> Reason:
    """How a motion to ``target_u`` ended that stands at ``position_u``, by its status at its target (MIC-14).

    The controller rounds the target to pulses. Without ``gear``, their number in a unit, a pulse is at most the least
    distance of the positions ``seen_u`` from each other and from 0. By the half of it the target may have been rounded; whether
    that is so, or the axis was sent there instead, cannot be known: `Reason.RESTED`.
    """
    rounded = abs(target_u) * ROUNDED
    off = abs(position_u - target_u)
    if gear is not None:
        return Reason.TARGET if off <= 0.51 / gear + rounded else Reason.DIVERTED
    if off <= rounded:
        return Reason.TARGET
    places = sorted({0.0, position_u, *seen_u})
    noise = max(map(abs, places)) * ROUNDED
    steps = [after - before for before, after in pairwise(places) if after - before > noise]
    return Reason.RESTED if off <= 0.51 * min(steps, default=inf) + rounded else Reason.DIVERTED


def end_of(status: int) -> Reason:
    """Why an axis is at rest that has moved."""
    return _REASONS.get(status, Reason.STOPPED)


def reason_of(status: int, motion: MotionCommand | None) -> Reason:
    """Why an axis is at rest; `Reason.REST` without a known motion or after a velocity of 0."""
    if status == AxisStatus.ON and (motion is None or (motion.kind is MotionKind.VELOCITY and motion.value_u == 0.0)):
        return Reason.REST
    return end_of(status)


def travel_s(distance_u: float, velocity_u: float, acc_u: float, dec_u: float, vmax_u: float) -> float | None:
    """The duration (s) of a position move over ``distance_u`` that begins at ``velocity_u``; None if no plan is possible."""
    try:
        reach = max(abs(distance_u), velocity_u * velocity_u / (2.0 * dec_u))
        if reach == 0.0:
            return 0.0
        scale = _SCALE / reach
        state = MotionState(0, 0, 0.0, velocity_u * scale)
        profile = plan_position(state, round(distance_u * scale), acc_u * scale, dec_u * scale, vmax_u * scale)
    except (Misuse, ArithmeticError, ValueError):
        return None
    return 0.0 if profile.end is None else profile.end / SECOND
