"""Display data of the axes of a trace: their unit, and the terminals with their pulses or currents.

A trace has pulses only. The display data are static: they are read from a controller once and stored with the trace.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import NamedTuple, TypeAlias

from steptwin.controller import MICROSECOND, Nanos


class StepOutputs(NamedTuple):
    """STEP and DIR of one axis."""

    step: str = "STEP"
    dir: str | None = "DIR"
    """None if the controller has this pin itself, so that its edges are in the trace."""
    active_low: bool = False
    width_ns: Nanos = 5 * MICROSECOND
    """Drawn width of a pulse; less if the next one follows within twice this time."""


class PhaseOutputs(NamedTuple):
    """Two phase currents, −127…127, that follow a waveform (`steptwin.motion.waveforms`)."""

    phases: tuple[str, str] = ("PHASE1", "PHASE2")
    characteristic: int = 1
    """The initial characteristic; edges of ``characteristic_pin`` in the trace change it."""
    characteristic_pin: str = "N"


SLIPS, STUCK, LIFT_SHARE, SPRING_SHARE = "slips", "stuck", "lift_share", "frequency_share"
"""Edges ``ELEMENT.NAME`` that faults record: 1 while a coupling slips or a follower is stuck; the share of the lift of a worn
cam, of the frequency of a slack belt."""


class MovedChannel(NamedTuple):
    """Channel of what an axis moves besides its load, as a function of the pulses P of the load (`Mechanics`).

    A shaft is at ``offset`` + ``per_pulse`` · P. A follower is lifted by that angle, as ``points`` say. A carriage swings about
    it, with ``spring``. A gantry and a tool are moved by the load of ``other``, too.
    """

    name: str
    signal: str
    """``position`` or ``angle``."""
    unit: str
    per_pulse: float
    offset: float = 0.0
    coupling: str = ""
    """The shaft whose coupling, or the belt of a tool that, may slip."""
    points: tuple[tuple[float, float], ...] = ()
    """Angle and lift, by angle."""
    turn: float = 360.0
    """Angle after which the points begin anew."""
    spring: tuple[float, float] | None = None
    """Frequency (Hz) and damping ratio."""
    other: tuple[str, str] | None = None
    """Controller and subject of the other axis of a gantry or a tool."""
    other_per_pulse: float = 0.0
    other_coupling: str = ""
    """As ``per_pulse`` and ``coupling``, of the other axis."""

    @property
    def steepest(self) -> float:
        """The most that it moves for a unit of the angle, or 1."""
        if not self.points:
            return 1.0
        around = [*self.points, (self.points[0][0] + self.turn, self.points[0][1])]
        return max(abs((y1 - y0) / (a1 - a0)) for (a0, y0), (a1, y1) in pairwise(around))


class Mechanics(NamedTuple):
    """The mechanics of an axis, which have a name, a unit and a zero of their own.

    Its true position is (pulses of the load + ``zero_p``) / ``pulses_per_unit``; negative where positive pulses go down.
    """

    name: str
    unit: str
    pulses_per_unit: float
    zero_p: int = 0
    is_ideal: bool = True
    """Whether the load is at the commanded position, unless a ``load`` of the trace states otherwise."""
    moved: tuple[MovedChannel, ...] = ()
    """Elements that it moves."""

    @property
    def position_name(self) -> str:
        return f"{self.name}_true_position_{self.unit}"


class AxisChannel(NamedTuple):
    """``pulses_per_unit``: units of its profiles in one ``unit``."""

    name: str
    unit: str = "imp"
    pulses_per_unit: float = 1.0
    outputs: StepOutputs | PhaseOutputs = StepOutputs()
    mechanics: Mechanics | None = None

    # Names of variables and columns.

    @property
    def position_name(self) -> str:
        return f"{self.name}_position_{self.unit}"

    @property
    def counted_name(self) -> str:
        return f"{self.name}_since_power_on_{self.unit}"

    @property
    def velocity_name(self) -> str:
        return f"{self.name}_velocity_{self.unit}_s"


AxisViews: TypeAlias = Mapping[tuple[str, str], AxisChannel]
"""By controller and subject of its ``plan`` records (``"1"``…)."""


def plain_view(axis: str) -> AxisChannel:
    """The view of an axis of which nothing is known."""
    return AxisChannel(f"M{axis}", outputs=StepOutputs(f"M{axis}_STEP", f"M{axis}_DIR"))
