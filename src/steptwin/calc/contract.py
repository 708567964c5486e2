"""Input and results of the motion calculator, in the same form for every kind of controller."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from steptwin.calc.units import Dimension
from steptwin.datasheet import Limits
from steptwin.messages import MessageText, with_messages
from steptwin.motion import Profile

DISTANCE, VELOCITY, ACCELERATION, DECELERATION = "distance", "velocity", "acceleration", "deceleration"
START, KNEE = "start_stop", "profile"
MICROSTEP, QUALIFICATION = "microstep", "qualification"
TIME, RISE, CONSTANT, FALL = "time", "acceleration_time", "constant_time", "deceleration_time"


@dataclass(frozen=True, slots=True, kw_only=True)
class MoveQuantity:
    """A quantity of a move."""

    name: str
    meaning: str
    dimension: Dimension
    unit: str
    """``mm/s``."""
    pulses: float = 1.0
    """Pulses (per s, per s²) in one of its unit."""
    limits: Limits
    """Permitted range of its size; a distance may also be negative."""
    choices: tuple[int, ...] = ()
    """All that is permitted, where it is a choice; it cannot be calculated then."""
    default: float | None = None
    same_as: str | None = None
    """The quantity whose value it has where none is given."""
    code: str = ""
    """Name of the register or letter of the command that sets it. Empty: it is given with each motion."""
    back: str = ""
    """The same, for a negative value; ``code`` where there is no difference."""
    detail: str = ""
    """The fact of the controller's state that it is (`steptwin.controllerstate`)."""
    source: str
    """Section of the manual, or id of an assumption."""


class Formula(NamedTuple):
    """A formula of the result."""

    name: str
    text: str
    source: str


class Model(Protocol):
    """A kind of controller, as far as a move from rest to rest goes."""

    @property
    def title(self) -> str: ...
    @property
    def quantities(self) -> tuple[MoveQuantity, ...]:
        """All that determines a move."""
        ...

    def plan(self, values: Mapping[str, float]) -> Profile:
        """As the controller plans it, from position 0, in pulses; ``values`` need not be rounded to what it accepts."""
        ...

    def settable(self, name: str, value: float, values: Mapping[str, float]) -> float:
        """The nearest value that the controller accepts."""
        ...

    def check(self, values: Mapping[str, float]) -> None:
        """Raises `Misuse` for values that do not go together."""
        ...

    def notes(self, values: Mapping[str, float], profile: Profile) -> list[MessageText]:
        """Remarks on them."""
        ...

    def formulas(self, values: Mapping[str, float], profile: Profile) -> list[Formula]: ...


class MovePhase(NamedTuple):
    """A part of a move. Velocities and distance in the units of the quantities."""

    name: str
    start_s: float
    duration_s: float
    from_velocity: float
    to_velocity: float
    distance: float


class RequiredSetting(NamedTuple):
    """A setting that the result needs."""

    name: str
    code: str
    detail: str
    value: float
    unit: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Calculation:
    """A move: the values that the controller accepts, and the resulting times."""

    title: str
    found: str | None
    """The quantity that was calculated, None where all were given."""
    exact: float | None
    """Its value before it was rounded to what the controller takes."""
    values: Mapping[str, float]
    units: Mapping[str, str]
    times: Mapping[str, float]
    """``time`` and the times of acceleration, constant velocity and deceleration [s]."""
    peak: float
    """Highest velocity that is reached."""
    reaches: bool
    """Whether that is the velocity that was asked for."""
    parts: tuple[MovePhase, ...]
    formulas: tuple[Formula, ...]
    notes: tuple[str, ...]
    settings: tuple[RequiredSetting, ...]
    profile: Profile
    """In pulses, from 0 on."""
    pulses: float
    """Pulses in the unit of distance."""
    speed_pulses: float
    """Pulses/s in the unit of velocity."""


def to_json(result: Calculation) -> dict[str, object]:
    """As JSON has values; ``curve`` has points of the profile (`curve`)."""
    found = {
        "title": result.title,
        "found": result.found,
        "exact": result.exact,
        "values": dict(result.values),
        "units": dict(result.units),
        "times": dict(result.times),
        "peak": result.peak,
        "reaches": result.reaches,
        "parts": [part._asdict() for part in result.parts],
        "formulas": [with_messages(formula._asdict()) for formula in result.formulas],
        "notes": list(result.notes),
        "settings": [setting._asdict() for setting in result.settings],
        "curve": [list(point) for point in curve(result)],
    }
    return with_messages(found)


class CurvePoint(NamedTuple):
    """A moment of a move, in the units of its quantities."""

    time_s: float
    position: float
    velocity: float


POINTS_IN_PART = 24
"""Enough for a picture; the last point of a part is the first of the next."""


def curve(result: Calculation) -> list[CurvePoint]:
    """Points to draw: the ends of all parts, and some between them where the curve bends."""
    points = [CurvePoint(0.0, 0.0, 0.0)]
    begin = 0.0
    for segment in result.profile.segments:
        steps = POINTS_IN_PART if segment.c2 else 1
        for step in range(steps + 1):
            t = segment.end_s if step == steps else begin + (segment.end_s - begin) * step / steps
            points.append(CurvePoint(t, segment.position(t) / result.pulses, segment.velocity(t) / result.speed_pulses))
        begin = segment.end_s
    points.append(CurvePoint(begin, result.profile.final_p / result.pulses, 0.0))
    return points
