"""Channels: the fields of records as the library serves them."""

from __future__ import annotations

import asyncio
import enum
from collections.abc import Sequence
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, TypeAlias

from caproto import (
    AccessRights,
    AlarmSeverity,
    AlarmStatus,
    ChannelAlarm,
    ChannelData,
    ChannelDouble,
    ChannelEnum,
    ChannelInteger,
    ChannelShort,
    ChannelString,
)

from steptwin.datasheet import Limits
from steptwin.errors import Misuse

FieldValue: TypeAlias = int | float | str
"""Of a field with states the number of one."""


class FieldType(enum.Enum):
    DOUBLE = "double"
    LONG = "long"
    SHORT = "short"
    STRING = "string"
    STATES = "states"


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldRow:
    """A field of a record. ``states``: the texts of its values."""

    name: str
    meaning: str
    type: FieldType
    is_writable: bool = False
    states: tuple[str, ...] = ()
    has_unit: bool = False
    """Whether it is in the unit of the record."""


class Putter(NamedTuple):
    """Who puts a value: as it says of itself, and where it is."""

    user: str
    host: str
    circuit: object
    """The connection; another for each."""


class RecordAlarm(NamedTuple):
    status: AlarmStatus
    severity: AlarmSeverity


NO_ALARM = RecordAlarm(AlarmStatus.NO_ALARM, AlarmSeverity.NO_ALARM)
NOT_KNOWN = RecordAlarm(AlarmStatus.UDF, AlarmSeverity.INVALID_ALARM)
LOST = RecordAlarm(AlarmStatus.COMM, AlarmSeverity.INVALID_ALARM)


class Record(Protocol):
    """What is behind the channels of a record."""

    @property
    def unit(self) -> str: ...

    @property
    def precision(self) -> int: ...

    @property
    def limits(self) -> Limits | None: ...

    @property
    def alarm(self) -> RecordAlarm: ...

    @property
    def at_s(self) -> float:
        """When its values were so: the wall clock, s since 1970."""
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


MONITORS_S = 0.03
"""The library answers at once, but collects monitors for 10 ms: who learns that a put is over has seen the values of its end."""
_PUTTER: ContextVar[Putter] = ContextVar("putter")


class _RecordChannel(ChannelData):
    """A channel for a field: what clients put goes to the record, which then shows what came of it."""

    record: Record
    row: FieldRow

    def check_access(self, hostname: str, username: str) -> AccessRights:
        return AccessRights.READ | AccessRights.WRITE if self.row.is_writable else AccessRights.READ

    async def auth_write(self, hostname: str, username: str, *data: Any, user_address: object = None, **options: Any) -> Any:
        _PUTTER.set(Putter(username, hostname, user_address))
        return await super().auth_write(hostname, username, *data, user_address=user_address, **options)

    async def write(self, value: Any, **_: Any) -> None:
        """Called by the library for clients."""
        await self.record.put(_PUTTER.get(), self.row.name, self._given(self.preprocess_value(value)))
        await asyncio.sleep(MONITORS_S)

    def _given(self, value: Any) -> FieldValue:
        """What the library has read, as a number or text of Python. Raises `Misuse`."""
        row = self.row
        if row.type is not FieldType.STATES:
            return str(value) if row.type is FieldType.STRING else float(value) if row.type is FieldType.DOUBLE else int(value)
        number = row.states.index(value) if value in row.states else -1 if isinstance(value, str | bytes) else int(value)
        if not 0 <= number < len(row.states):
            raise Misuse(f"{row.name}: {value}: permitted are {', '.join(row.states)}")
        return number

    async def read(self, data_type: Any) -> Any:
        await self.record.refresh()
        return await super().read(data_type)

    async def subscribe(self, queue: Any, sub_spec: Any, sub: Any) -> None:
        await self.record.refresh()
        await super().subscribe(queue, sub_spec, sub)

    async def show(self) -> None:
        """Publish the value of the record where it is another one."""
        value = _shown(self.row, self.record.value(self.row.name))
        alarm = self.record.alarm
        own: Any = self.alarm
        before = RecordAlarm(own.status, own.severity)
        if self.value == value and alarm == before:
            return
        if alarm != before:
            await own.write(status=alarm.status, severity=alarm.severity, publish=False)
        await super().write(value, verify_value=False, update_fields=False, timestamp=self.record.at_s)


class _Double(_RecordChannel, ChannelDouble):
    pass


class _Long(_RecordChannel, ChannelInteger):
    pass


class _Short(_RecordChannel, ChannelShort):
    pass


class _String(_RecordChannel, ChannelString):
    pass


class _States(_RecordChannel, ChannelEnum):
    pass


_KINDS: dict[FieldType, type[Any]] = {
    FieldType.DOUBLE: _Double,
    FieldType.LONG: _Long,
    FieldType.SHORT: _Short,
    FieldType.STRING: _String,
    FieldType.STATES: _States,
}


def _shown(row: FieldRow, value: FieldValue) -> FieldValue:
    return row.states[int(value)] if row.type is FieldType.STATES else value


def channel_of(record: Record, row: FieldRow) -> _RecordChannel:
    options: dict[str, Any] = {"alarm": ChannelAlarm(status=record.alarm.status, severity=record.alarm.severity)}
    if row.type is FieldType.STATES:
        options["enum_strings"] = row.states
    elif row.type is not FieldType.STRING and row.has_unit:
        options["units"] = record.unit
        if record.limits is not None:
            low, high = record.limits.low or 0.0, record.limits.high or 0.0
            for kind in ("disp", "ctrl"):
                options |= {f"lower_{kind}_limit": low, f"upper_{kind}_limit": high}
    if row.type is FieldType.DOUBLE:
        options["precision"] = record.precision
    value = _shown(row, record.value(row.name))
    channel = _KINDS[row.type](value=value, timestamp=record.at_s, reported_record_type="steptwin", **options)
    channel.record, channel.row = record, row
    return channel


DEFAULT_FIELD = "VAL"


class RecordBase:
    """The channels of a record, made when a client asks for them."""

    def __init__(self) -> None:
        self._channels: dict[str, _RecordChannel] = {}

    def channel(self: Any, name: str) -> _RecordChannel:
        """Raises `KeyError` for a field that is not there."""
        found = self._channels.get(name)
        if found is None:
            row = self.field(name)
            if row is None:
                raise KeyError(name)
            found = self._channels[name] = channel_of(self, row)
        return found

    @property
    def is_asked_for(self) -> bool:
        return bool(self._channels)

    async def show(self, names: Sequence[str] | None = None) -> None:
        """Publish fields, all of them without ``names``."""
        for name in list(self._channels) if names is None else names:
            if name in self._channels:
                await self._channels[name].show()


class PvDatabase(dict[str, _RecordChannel]):
    """Channels by name, ``RECORD`` or ``RECORD.FIELD``."""

    def __init__(self, records: dict[str, RecordBase]) -> None:
        super().__init__()
        self._records = records

    def __missing__(self, name: str) -> _RecordChannel:
        record, _, field = name.partition(".")
        found = self[name] = self._records[record].channel(field or DEFAULT_FIELD)
        return found
