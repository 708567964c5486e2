"""The static description of one controller: what there is to read, write, connect and expect, and in which units.

A data sheet is made from the controller's own tables and never changes. `steptwin.jsonvalues` makes JSON of it, and reads that.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field


class PointEffect(enum.Enum):
    """Effect of a write."""

    NONE = "none"
    """It cannot be written."""
    PARAMETER = "parameter"
    """Keeps a value that later actions use."""
    ACTS = "acts"
    """Does something at once; no motion."""
    MOVES = "moves"
    """Gives an axis a motion, prepares one, or starts what may give one, such as a program."""


class Condition(enum.Enum):
    """The meaning of a value of a status, at a glance."""

    OFF = "off"
    REST = "rest"
    MOVING = "moving"
    WARNING = "warning"
    ERROR = "error"


class EventSeverity(enum.Enum):
    INFORMATION = "information"
    WARNING = "warning"
    """Something was not done as it was commanded, or may go wrong next."""
    ALARM = "alarm"
    """Something has failed."""


class Access(enum.Enum):
    READ = "r"
    WRITE = "w"
    BOTH = "rw"


class PinDirection(enum.Enum):
    INPUT = "input"
    OUTPUT = "output"
    BOTH = "input and output"


@dataclass(frozen=True, slots=True)
class Limits:
    """Permitted numbers from ``low`` to ``high``; None is open. ``is_low_excluded``: above ``low`` only."""

    low: float | None = None
    high: float | None = None
    is_low_excluded: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisDescription:
    number: int
    name: str
    """``M1``."""
    unit: str
    """Unit of its positions; velocities are in it per second."""
    pulses_per_unit: float | None
    """None where it is not known: of a device without its configuration."""
    round_p: int | None = None
    """The shown position is a number of pulses from -round_p/2 to round_p/2 - 1, and begins anew beyond; None: it does not."""
    positions: Limits | None = None
    """To which it can be sent; None where that is not known, as below."""
    distances: Limits | None = None
    """By which it can be moved at once."""
    velocities: Limits | None = None
    """That it can be commanded to make, with their sign."""
    velocity_point: str | None = None
    """Path of the point with the velocity of moves to positions; None where there is none, or that is not known."""
    ramp_points: tuple[str, ...] = ()
    """Paths of the points with the acceleration and deceleration of these moves."""
    limit_codes: tuple[int, int] | None = None
    """Numbers of its status where it stands at the limit in the negative and in the positive direction."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Pin:
    name: str
    direction: PinDirection
    is_analog: bool = False
    """Whether it has more levels than 0 and 1, such as volts."""
    unit: str = ""
    limits: Limits = Limits(0, 1)
    is_active_low: bool = False
    """Whether 0 is the level that means something: of lines that rest high."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PointAddress:
    """Where a point is on a wire."""

    space: str
    """``holding register``, ``coil``, ``input``; ``command`` of a chip."""
    place: int | str
    """Address counted from 0, or the text of the command."""
    words: int = 1
    """Number of addresses that the value takes."""
    type: str = ""
    """How it lies there: ``BIT``, ``WORD``, ``DINT``, ``REAL``, ``REAL/DINT``."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """A value that can be read or written."""

    path: str
    """As programs and conditions name it, after the name of the controller: ``M1.position``, ``M1_POS_ABS``."""
    meaning: str
    type: str
    unit: str = ""
    limits: Limits | None = None
    """Limits of what may be written; None where nothing may."""
    values: Mapping[int, str]
    """Texts of enumerated values."""
    conditions: Mapping[int, Condition] = field(default_factory=dict)
    """Meanings of the values of a status."""
    access: Access
    effect: PointEffect
    addresses: tuple[PointAddress, ...] = ()
    source: str
    """Section of the manual, or id of an assumption."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Argument:
    name: str
    type: str
    unit: str = ""
    limits: Limits | None = None
    values: tuple[int | str, ...] = ()
    """All that is permitted, where it is no range."""
    is_optional: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandDescription:
    name: str
    code: str
    """Code that is sent: the letter of a chip, the name of a register."""
    meaning: str
    arguments: tuple[Argument, ...] = ()
    effect: PointEffect
    source: str


class FactType(enum.Enum):
    """Type of a field of an event, or of a detail of the state."""

    WHOLE = "whole number"
    NUMBER = "number"
    TRUTH = "true or false"
    TEXT = "text"
    WHOLES = "whole numbers"
    NAMED = "whole numbers by name"


@dataclass(frozen=True, slots=True, kw_only=True)
class FactDescription:
    """A field of an event, beside its moment and text."""

    name: str
    type: FactType
    unit: str = ""
    is_optional: bool = False
    """Whether there are events of the code without it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EventDescription:
    """Something that the controller reports."""

    code: str
    meaning: str
    facts: tuple[FactDescription, ...] = ()
    severity: EventSeverity = EventSeverity.INFORMATION
    stops_motor: bool | None = None
    """Whether a motor stops with it; None where that depends, and for what has nothing to do with motors."""


@dataclass(frozen=True, slots=True)
class Detail:
    """A fact of the present state that only this kind of controller has."""

    name: str
    meaning: str
    type: FactType
    unit: str = ""
    is_brief: bool = False
    """Whether short views show it, too."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Datasheet:
    kind: str
    """The name of the kind of controller: ``mic488``."""
    title: str
    variant: str
    """Firmware, or type of a chip."""
    axes: tuple[AxisDescription, ...]
    pins: tuple[Pin, ...]
    points: tuple[Point, ...]
    commands: tuple[CommandDescription, ...]
    events: tuple[EventDescription, ...]
    program_actions: tuple[str, ...] = ()
    """Actions on its program: ``start``, ``pause``, ``stop``; empty where it has none."""
    end_switches_off: bool = False
    """Whether the end of its program switches drives and outputs off."""
    details: tuple[Detail, ...] = ()
    """Details of its state (`steptwin.controllerstate`)."""
    also_change: Mapping[str, tuple[str, ...]] | None = None
    """By the name of a pin or an axis: other parts of the state (`steptwin.controllerstate.StateReader`) that may change with its
    level or its motion; pins and axes that are not named change nothing else. None: any part may change."""

    def point(self, path: str) -> Point:
        """Raises `KeyError` for a point that is not there."""
        for found in self.points:
            if found.path.upper() == path.upper():
                return found
        raise KeyError(path)
