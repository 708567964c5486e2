"""The motion statements of a program: single axes, rows of the position table, lines and arcs of M1 (X) and M2 (Y).

Suffixes as in `steptwin.mic488.axis`; ``w`` positions along a path, in configured units of M1.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple, TypeAlias

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message, text_of
from steptwin.mic488 import path
from steptwin.mic488.axis import MAX_SPEED_P, SLOWEST_RAMP_P, Axis
from steptwin.mic488.path import Path
from steptwin.mic488.program_device import ProgramDevice
from steptwin.mic488.program_registers import position_p
from steptwin.mic488.status import AxisStatus
from steptwin.motion.paths import Arc, Circular, Straight, arc_between, circle
from steptwin.motion.trig import length
from steptwin.tables import complete
from steptwin.wbc.paths import row_problem
from steptwin.wbc.real import ProgramFault, real_text
from steptwin.wbc.statements import HALTS, MOTIONS, ROW_MOTIONS

RowValues: TypeAlias = tuple[float | None, ...]

DEGREES_PER_QUARTER = 90.0


# ---------------------------------------------------------------------- one axis


def move(axis: Axis, keyword: str, value_u: float, now: Nanos) -> None:
    """HOME, VABS, VREL, PABS, PREL."""
    _MOVES[keyword](axis, value_u, now)


_MOVES: Mapping[str, Callable[[Axis, float, Nanos], None]] = complete(
    "motion statement",
    MOTIONS,
    "move",
    {
        "HOME": lambda axis, value_u, now: axis.home(value_u * axis.gear, now),
        "VABS": lambda axis, value_u, now: axis.move_velocity(value_u * axis.gear, now),
        "VREL": lambda axis, value_u, now: axis.change_velocity(value_u * axis.gear, now),
        "PABS": lambda axis, value_u, now: axis.move_to(position_p(axis, value_u, f"PABS M{axis.number}"), now),
        "PREL": lambda axis, value_u, now: axis.move_by(position_p(axis, value_u, f"PREL M{axis.number}"), now),
    },
)


def halt(axis: Axis, keyword: str, now: Nanos) -> None:
    """BRAKE, STOP."""
    _HALTS[keyword](axis, now)


_HALTS: Mapping[str, Callable[[Axis, Nanos], None]] = complete(
    "statement that halts", HALTS, "action", {"BRAKE": Axis.brake, "STOP": Axis.stop}
)


_IN_MOTION = (AxisStatus.VELOCITY, AxisStatus.POSITION, AxisStatus.HOMING, AxisStatus.CORRECTION)


def finished(axis: Axis, now: Nanos) -> bool:
    """Whether a drive has finished, so that WAITPOS does not wait for it (WBC-8)."""
    if axis.status in _IN_MOTION:
        return False
    return not axis.profile.moving(now)


# ---------------------------------------------------------------------- rows


class ChosenRow(NamedTuple):
    """The row that a statement names: ``index`` as it was given, and its parameters."""

    keyword: str
    index: float
    values: RowValues


ROW_PROBLEM = Message("mic488.row-problem", "{keyword} {row}: {problem}")
FIRST_AXES_ARE_NOT_ENABLED = Message("mic488.first-axes-are-not-enabled", "{keyword} ignored: M1 and M2 must be enabled")


def row_motion(device: ProgramDevice, row: ChosenRow, lin_acc_u: float | None, now: Nanos) -> bool | None:
    """MOVEPTP, MOVELIN, MOVELIN_REL, MOVETOCIRC, DOCIRC, DOARC. `ProgramFault` when the row does not allow it.

    ``lin_acc_u`` is LinAcc, if it is set. Returns whether M1 and M2 both move along the new path; None where there is none.
    """
    keyword, index, values = row
    problem = row_problem(keyword, values)
    if problem is not None:
        raise ProgramFault(ROW_PROBLEM(keyword=keyword, row=real_text(index), problem=text_of(problem)))
    if keyword == "MOVEPTP":
        for axis, value_u in zip(device.axes, values, strict=True):
            if value_u is not None:
                move(axis, "PABS", value_u, now)
        return None
    if not all(axis.can_move for axis in device.axes[:2]):
        device.event("drive-off", FIRST_AXES_ARE_NOT_ENABLED(keyword=keyword), now)
        return None
    try:
        return _PATHS[keyword](_Plane(device, lin_acc_u, now), values)
    except Misuse as refusal:
        raise ProgramFault(ROW_PROBLEM(keyword=keyword, row=real_text(index), problem=text_of(refusal))) from None


class _Pace(NamedTuple):
    """Speed and acceleration along a path, as far as they are given; ``steepest``: most pulses per unit of the path."""

    speed_u: float | None
    acc_u: float | None
    steepest: float


PATH_VELOCITY_IS_CLAMPED = Message("mic488.path-velocity-is-clamped", "{speed} {unit}/s along the path is above {most:g} imp/s")


class _Plane:
    """M1 and M2 at rest at ``now``; an axis in motion stops without ramp (WBC-26)."""

    def __init__(self, device: ProgramDevice, lin_acc_u: float | None, now: Nanos) -> None:
        self.device = device
        self.lin_acc_u = lin_acc_u
        self.now = now
        self.axes = self.device.axes[:2]
        for axis in self.axes:
            if axis.profile.moving(now):
                axis.stop(now)
            # A coordinate that has wrapped counts from its new value.
            axis.state(now)
        self.counts = [axis.profile.count(now) for axis in self.axes]

    def place_u(self) -> list[float]:
        """Present coordinates."""
        return [(count + axis.offset_p) / axis.gear for count, axis in zip(self.counts, self.axes, strict=True)]

    def motor_p(self, place_u: tuple[float | None, float | None], what: str) -> list[int]:
        """Motor positions of a place; an axis left alone stays."""
        return [
            count if value_u is None else position_p(axis, value_u, f"{what} M{axis.number}") - axis.offset_p
            for axis, value_u, count in zip(self.axes, place_u, self.counts, strict=True)
        ]

    def line(self, targets_p: list[int], speed_u: float | None) -> bool:
        x, y = self.axes
        travels_p = [target - count for target, count in zip(targets_p, self.counts, strict=True)]
        travel_u = length(travels_p[0] / x.gear, travels_p[1] / y.gear)
        slopes = [travel_p / travel_u if travel_u else 0.0 for travel_p in travels_p]
        curves = tuple(Straight(float(count), slope) for count, slope in zip(self.counts, slopes, strict=True))
        pace = _Pace(speed_u, self.lin_acc_u, max(map(abs, slopes)))
        return self._follow(curves, travel_u, targets_p, pace, corrected=True)

    def arc(self, arc: Arc, targets_p: list[int]) -> bool:
        x, y = self.axes
        travel_u = arc.length
        turn_q = arc.sweep_q / travel_u if travel_u else 0.0
        curves = (
            Circular(arc.centre_x * x.gear - x.offset_p, arc.radius * x.gear, arc.begin_q, turn_q),
            Circular(arc.centre_y * y.gear - y.offset_p, arc.radius * y.gear, arc.begin_q - 1.0, turn_q),
        )
        return self._follow(curves, travel_u, targets_p, _Pace(None, None, max(x.gear, y.gear)), corrected=False)

    def _follow(
        self,
        curves: tuple[Straight, ...] | tuple[Circular, ...],
        travel_u: float,
        targets_p: list[int],
        pace: _Pace,
        *,
        corrected: bool,
    ) -> bool:
        """Run ``travel_u`` along the curves, at most to the first soft limit; whether both axes move.

        WBC-11: what is not given of ``pace`` is M1's.
        """
        first = self.axes[0]
        speed_u = first.vmax_p / first.gear if pace.speed_u is None else pace.speed_u
        if speed_u * pace.steepest > MAX_SPEED_P:
            text = PATH_VELOCITY_IS_CLAMPED(speed=real_text(speed_u), unit=first.config.unit_name, most=MAX_SPEED_P)
            self.device.event("speed-clamped", text, self.now)
            speed_u = MAX_SPEED_P / pace.steepest
        slowest_u = SLOWEST_RAMP_P / first.gear
        up_u = max(pace.acc_u or first.acc_p / first.gear, slowest_u)
        down_u = max(pace.acc_u or first.dec_p / first.gear, slowest_u)
        whole = Path(curves, travel_u, tuple(targets_p), speed_u, up_u, down_u, corrected)
        return path.begin(whole, self.axes, self.now)


def _line(plane: _Plane, row: RowValues) -> bool:
    return plane.line(plane.motor_p((row[0], row[1]), "MOVELIN"), row[2])


def _line_by(plane: _Plane, row: RowValues) -> bool:
    travels_p = [
        position_p(axis, travel_u or 0.0, f"MOVELIN_REL M{axis.number}")
        for axis, travel_u in zip(plane.axes, row[:2], strict=True)
    ]
    return plane.line([count + travel_p for count, travel_p in zip(plane.counts, travels_p, strict=True)], row[2])


def _to_circle(plane: _Plane, row: RowValues) -> bool:
    """WBC-26: on a straight line, at M1's VMAX, for p3 is the radius."""
    return plane.line(plane.motor_p(_circle(row, 0.0).begin, "MOVETOCIRC"), None)


CIRCLE_BEGINS_ELSEWHERE = Message(
    "mic488.circle-begins-elsewhere", "DOCIRC begins at {begin}, but the axes are at {place}: go there with MOVETOCIRC"
)


def _do_circle(plane: _Plane, row: RowValues) -> bool:
    arc = _circle(row, row[3] or 0.0)
    begin_p = plane.motor_p(arc.begin, "DOCIRC")
    if any(abs(begin - count) > 1 for begin, count in zip(begin_p, plane.counts, strict=True)):
        position = "({}, {})".format(*map(real_text, plane.place_u()))
        begin = "({}, {})".format(*map(real_text, arc.begin))
        raise ProgramFault(CIRCLE_BEGINS_ELSEWHERE(begin=begin, place=position))
    return plane.arc(arc, plane.motor_p(arc.end, "DOCIRC"))


def _do_arc(plane: _Plane, row: RowValues) -> bool:
    x, y = plane.axes
    x0, y0 = plane.place_u()
    targets_p = plane.motor_p((row[0], row[1]), "DOARC")
    x1, y1 = ((target + axis.offset_p) / axis.gear for target, axis in zip(targets_p, plane.axes, strict=True))
    slack_u = max(1.0 / x.gear, 1.0 / y.gear)
    return plane.arc(arc_between(x0, y0, x1, y1, row[2] or 0.0, outward=row[3] == 0.0, slack=slack_u), targets_p)


def _circle(row: RowValues, angle_deg: float) -> Arc:
    """Angles of rows are clockwise. `row_problem` has found that nothing is missing."""
    x, y, radius = (value or 0.0 for value in row[:3])
    return circle(x, y, radius, -angle_deg / DEGREES_PER_QUARTER)


_PATHS: Mapping[str, Callable[[_Plane, RowValues], bool]] = complete(
    "statement with a row",
    ROW_MOTIONS - {"MOVEPTP"},
    "path",
    {
        "MOVELIN": _line,
        "MOVELIN_REL": _line_by,
        "MOVETOCIRC": _to_circle,
        "DOCIRC": _do_circle,
        "DOARC": _do_arc,
    },
)
