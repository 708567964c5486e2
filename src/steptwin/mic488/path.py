"""A line, circle or arc on which M1 and M2 move together, and its end on a soft limit.

Suffixes as in `steptwin.mic488.axis`; ``w`` positions along a path, in configured units of M1.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from steptwin.controller import Nanos
from steptwin.mic488.status import LIMIT, AxisStatus
from steptwin.motion import MotionState, Profile, plan_position, plan_stop
from steptwin.motion.paths import Circular, Straight

NEAR_W = 1e-6
"""A braking that would end this close behind the end of the path ends on it."""


class PathAxis(Protocol):
    """One of the axes of a path, as it needs it."""

    number: int
    profile: Profile
    path: Path | None

    def edge(self, direction: int) -> int | None:
        """The soft limit in ``direction`` as motor position, if there is one."""
        ...

    def follow_path(self, path: Path, profile: Profile, arrival: AxisStatus) -> None: ...
    def overruns(self, now: Nanos) -> None:
        """Report that the axis cannot brake before its soft limit."""
        ...


class Edge(NamedTuple):
    """A soft limit at the end of a path: motor position of the axis there, and the side (±1)."""

    position_p: int
    side: int


class Path(NamedTuple):
    """The path as it was commanded, with its speed and ramps, and how far it goes at present; both axes have the same one."""

    curves: tuple[Straight, ...] | tuple[Circular, ...]
    """Those of M1 and M2."""
    travel_w: float
    """The length of the whole path."""
    targets_p: tuple[int, ...]
    """Motor positions at its end."""
    speed_w: float
    up_w: float
    down_w: float
    is_corrected: bool
    """Whether encoder correction is on (WBC-17): on lines that no limit ends."""
    travel: Profile = Profile(0, 0, (), 0.0)
    """The position on the path."""
    end_w: float = 0.0
    met: tuple[tuple[int, Edge], ...] = ()
    """The soft limits at ``end_w``, by number of the axis."""

    @property
    def has_arrival(self) -> bool:
        """Whether its target is compared with the encoder at its end."""
        return self.is_corrected and not self.met


def begin(path: Path, axes: Sequence[PathAxis], now: Nanos) -> bool:
    """Set out on a path from rest, at most to the first soft limit; whether both axes move."""
    end_w, met = _permitted(path, axes, 0.0)
    _follow(path._replace(end_w=end_w, met=met), axes, MotionState(now, 0, 0.0, 0.0))
    return all(axis.profile.moving(now) for axis in axes)


def keep_within_limits(axes: Sequence[PathAxis], now: Nanos) -> None:
    """Plan the rest of the path anew, if soft limits or coordinates that have been written let it end elsewhere (MIC-40).

    Its axes brake along it with its ramp; where that is too late, with the harder one of both ramps, and they overrun if that is
    too late as well.
    """
    axes = [axis for axis in axes if axis.path is not None]
    path = axes[0].path if axes else None
    if path is None:
        return
    state = MotionState.of(path.travel, now)
    end_w, met = _permitted(path, axes, state.count + state.phase)
    if (end_w, met) != (path.end_w, path.met):
        _follow(path._replace(end_w=end_w, met=met), axes, state)


def _permitted(path: Path, axes: Sequence[PathAxis], begin_w: float) -> tuple[float, tuple[tuple[int, Edge], ...]]:
    """Up to where a path may go that is at ``begin_w``, and the soft limits there."""
    end_w = path.travel_w
    met: dict[int, Edge] = {}
    for axis in axes:
        curve = path.curves[axis.number - 1]
        for side in (-1, 1):
            edge = axis.edge(side)
            beyond_w = None if edge is None else curve.first_beyond(float(edge), side, begin_w, path.travel_w)
            if edge is None or beyond_w is None or beyond_w > end_w:
                continue
            if beyond_w < end_w:
                met.clear()
            end_w = beyond_w
            met[axis.number] = Edge(edge, side)
    return end_w, tuple(met.items())


def _follow(path: Path, axes: Sequence[PathAxis], state: MotionState) -> None:
    """Let the axes go to the end of the path from ``state`` on it."""
    now, end_w, met = state.now, path.end_w, dict(path.met)
    at_w, speed_w = state.count + state.phase, state.velocity

    def rest_w(down_w: float) -> float:
        return at_w + speed_w * speed_w / (2.0 * down_w)

    down_w = path.down_w
    if rest_w(down_w) - end_w > NEAR_W:
        down_w = max(path.up_w, path.down_w)
    is_late = rest_w(down_w) - end_w > NEAR_W
    travel = plan_stop(state, down_w) if is_late else plan_position(state, end_w, path.up_w, down_w, path.speed_w)
    path = path._replace(travel=travel)
    for axis in axes:
        curve, target_p = path.curves[axis.number - 1], path.targets_p[axis.number - 1]
        count = axis.profile.count(now)
        edge = met.get(axis.number)
        if is_late and edge is not None:
            axis.overruns(now)
        final_p: int | None = None
        if not met:
            final_p = target_p
        elif edge is not None and not is_late:
            # An axis that is behind the limit already stays where it is.
            final_p = max(edge.position_p * edge.side, count * edge.side) * edge.side
        arrival = AxisStatus.REACHED if not met else AxisStatus.ON if edge is None else LIMIT[edge.side]
        axis.follow_path(path, curve.profile(travel, count, final_p), arrival)
