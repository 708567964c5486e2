"""Input and results of the motion calculator, in the same form for every kind of controller."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, NamedTuple, Protocol

from steptwin.calc.units import Dimension
from steptwin.datasheet import Limits
from steptwin.jsonvalues import NUMBER, UNWRITTEN, JsonForm, Sentence
from steptwin.messages import MessageText
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
    dimension: Annotated[Dimension, UNWRITTEN]
    unit: str
    """``mm/s``."""
    pulses: Annotated[float, "Pulses (per s, per s²) in one of its unit."] = 1.0
    limits: Limits
    """Permitted range of its size; a distance may also be negative."""
    choices: tuple[int, ...] = ()
    """All that is permitted, where it is a choice; it cannot be calculated then."""
    default: float | None = None
    same_as: Annotated[str | None, "The quantity whose value it has where none is given."] = None
    code: Annotated[str, "Register or command that sets it; empty where it is given with a motion."] = ""
    back: Annotated[str, UNWRITTEN] = ""
    """The same, for a negative value; ``code`` where there is no difference."""
    detail: Annotated[str, "The fact of the state that it is."] = ""
    """See `steptwin.controllerstate`."""
    source: str
    """Section of the manual, or id of an assumption."""


class Formula(NamedTuple):
    """A formula of the result."""

    name: Sentence
    text: Sentence
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


class CurvePoint(NamedTuple):
    """A moment of a move, in the units of its quantities."""

    time_s: float
    position: float
    velocity: float


_CURVE = JsonForm(
    {
        "type": "array",
        "items": {"type": "array", "items": NUMBER, "minItems": 3, "maxItems": 3},
        "description": "Time [s], position, velocity.",
    },
    to_json=lambda points: list(map(list, points)),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Calculation:
    """A move: the values that the controller accepts, and the resulting times."""

    title: str
    found: str | None
    """The quantity that was calculated, None where all were given."""
    exact: Annotated[float | None, "Of what was found, before it was made what the controller takes."]
    values: Mapping[str, float]
    units: Mapping[str, str]
    times: Mapping[str, float]
    """``time`` and the times of acceleration, constant velocity and deceleration [s]."""
    peak: float
    """Highest velocity that is reached."""
    reaches: Annotated[bool, "Whether the peak is the velocity."]
    """The one that was asked for."""
    parts: tuple[MovePhase, ...]
    formulas: tuple[Formula, ...]
    notes: tuple[Sentence, ...]
    settings: tuple[RequiredSetting, ...]
    curve: Annotated[tuple[CurvePoint, ...], _CURVE]
    """Points to draw: the ends of all parts, and some between them where the curve bends."""
    profile: Annotated[Profile, UNWRITTEN]
    """In pulses, from 0 on."""


POINTS_IN_PART = 24
"""Enough for a picture; the last point of a part is the first of the next."""


def curve(profile: Profile, pulses: float, speed_pulses: float) -> tuple[CurvePoint, ...]:
    """Points of a profile. ``pulses``: in the unit of distance; ``speed_pulses``: pulses/s in the unit of velocity."""
    points = [CurvePoint(0.0, 0.0, 0.0)]
    begin = 0.0
    for segment in profile.segments:
        steps = POINTS_IN_PART if segment.c2 else 1
        for step in range(steps + 1):
            t = segment.end_s if step == steps else begin + (segment.end_s - begin) * step / steps
            points.append(CurvePoint(t, segment.position(t) / pulses, segment.velocity(t) / speed_pulses))
        begin = segment.end_s
    points.append(CurvePoint(begin, profile.final_p / pulses, 0.0))
    return tuple(points)
