"""Records and their fields, as the protocols of EPICS serve them: Channel Access (`channels`), PV Access (`pvchannels`)."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import NamedTuple, Protocol, TypeAlias

from steptwin.datasheet import Limits
from steptwin.errors import Misuse

FieldValue: TypeAlias = int | float | str
"""Value of a field; where it has states, the number of one."""


class FieldType(enum.Enum):
    DOUBLE = "double"
    LONG = "long"
    SHORT = "short"
    STRING = "string"
    STATES = "states"


class FieldQuantity(enum.Enum):
    """Quantity of a number, which gives its unit and its limits."""

    PURE = "a number"
    VALUE = "the value of a point"
    USER = "position of the user"
    DIAL = "position of the dial"
    LENGTH = "distance"
    VELOCITY = "velocity"
    ACCELERATION = "acceleration"
    TIME = "time"


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldRow:
    """A field of a record. ``states``: the texts of its values."""

    name: str
    meaning: str
    type: FieldType
    is_writable: bool = False
    states: tuple[str, ...] = ()
    quantity: FieldQuantity = FieldQuantity.PURE


class Putter(NamedTuple):
    """Who puts a value: as it says of itself, and where it is."""

    user: str
    host: str
    circuit: object
    """The connection, another for each; its text says where the client is."""


class AlarmKind(enum.Enum):
    NO_ALARM = "no alarm"
    STATE = "the status of the controller or axis"
    COMM = "the controller does not answer"
    UDF = "not known"
    HIGH = "too large for the field"


class AlarmSeverity(enum.IntEnum):
    NO_ALARM = 0
    MINOR = 1
    MAJOR = 2
    INVALID = 3


class RecordAlarm(NamedTuple):
    kind: AlarmKind
    severity: AlarmSeverity


NO_ALARM = RecordAlarm(AlarmKind.NO_ALARM, AlarmSeverity.NO_ALARM)
NOT_KNOWN = RecordAlarm(AlarmKind.UDF, AlarmSeverity.INVALID)
LOST = RecordAlarm(AlarmKind.COMM, AlarmSeverity.INVALID)
TOO_LARGE = RecordAlarm(AlarmKind.HIGH, AlarmSeverity.INVALID)


class Record(Protocol):
    """Record behind its channels."""

    @property
    def precision(self) -> int: ...

    @property
    def alarm(self) -> RecordAlarm: ...

    @property
    def at_s(self) -> float:
        """When its values were so: the wall clock, s since 1970."""
        ...

    def unit_of(self, row: FieldRow) -> str: ...

    def limits_of(self, row: FieldRow) -> Limits | None:
        """At present; None where there are none, or they are not known."""
        ...

    def field(self, name: str) -> FieldRow | None:
        """None where the record does not have it."""
        ...

    def value(self, name: str) -> FieldValue: ...

    async def put(self, who: Putter, name: str, value: FieldValue) -> None:
        """Returns when everything that follows from it is over. Raises `SteptwinError`."""
        ...

    async def refresh(self) -> None:
        """Give fields their present values."""
        ...

    def attach(self, name: str, channel: FieldChannel) -> None: ...

    def detach(self, name: str, channel: FieldChannel) -> None: ...


class FieldChannel(Protocol):
    """Shows a field to clients of a protocol."""

    async def show(self) -> None:
        """Publish what has changed."""
        ...


DEFAULT_FIELD = "VAL"


class RecordBase:
    """The channels through which clients see a record."""

    def __init__(self) -> None:
        self._channels: dict[str, list[FieldChannel]] = {}

    def attach(self, name: str, channel: FieldChannel) -> None:
        self._channels.setdefault(name, []).append(channel)

    def detach(self, name: str, channel: FieldChannel) -> None:
        self._channels[name].remove(channel)
        if not self._channels[name]:
            del self._channels[name]

    @property
    def is_asked_for(self) -> bool:
        return bool(self._channels)

    async def show(self) -> None:
        """Publish all fields that clients see."""
        for channel in [channel for channels in self._channels.values() for channel in channels]:
            await channel.show()


def found_field(records: dict[str, Record], name: str) -> tuple[Record, FieldRow]:
    """Record and field of ``RECORD`` or ``RECORD.FIELD``. Raises `KeyError` for what is not there."""
    of, _, field = name.partition(".")
    record = records[of]
    row = record.field(field or DEFAULT_FIELD)
    if row is None:
        raise KeyError(name)
    return record, row


def check_state(row: FieldRow, number: int) -> int:
    """The number of one of its states. Raises `Misuse`."""
    if not 0 <= number < len(row.states):
        raise Misuse(f"{row.name}: {number}: permitted are 0 to {len(row.states) - 1} ({', '.join(row.states)})")
    return number


def is_same(one: object, other: object) -> bool:
    """Whether two values are, of which NaN is one."""
    return one == other or (one != one and other != other)  # noqa: PLR0124


def ends_of(limits: Limits | None) -> tuple[float, float]:
    """As the protocols have them: 0 and 0 are none."""
    return (0.0, 0.0) if limits is None else (limits.low or 0.0, limits.high or 0.0)
