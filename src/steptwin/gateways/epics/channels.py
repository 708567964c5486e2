"""Channels of Channel Access: the fields of records as the library serves them."""

from __future__ import annotations

from contextvars import ContextVar
from typing import Any

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

from steptwin.errors import Misuse
from steptwin.gateways.epics.records import (
    FieldQuantity,
    FieldRow,
    FieldType,
    FieldValue,
    Putter,
    Record,
    RecordAlarm,
    check_state,
    ends_of,
    found_field,
    is_same,
)

LONGEST_TEXT = 39
LONGEST_UNIT = 7
"""Characters that the protocol has room for."""
_PUTTER: ContextVar[Putter] = ContextVar("putter")


class _RecordChannel(ChannelData):
    """A channel for a field: what clients put goes to the record, which then shows what came of it."""

    record: Record
    row: FieldRow
    shown_alarm: RecordAlarm

    def check_access(self, hostname: str, username: str) -> AccessRights:
        return AccessRights.READ | AccessRights.WRITE if self.row.is_writable else AccessRights.READ

    async def auth_write(self, hostname: str, username: str, *data: Any, user_address: object = None, **options: Any) -> Any:
        _PUTTER.set(Putter(username, hostname, user_address))
        return await super().auth_write(hostname, username, *data, user_address=user_address, **options)

    async def write(self, value: Any, **_: Any) -> None:
        """Called by the library for clients."""
        await self.record.put(_PUTTER.get(), self.row.name, self._given(self.preprocess_value(value)))

    def _given(self, value: Any) -> FieldValue:
        """Value that the library has read, as a number or text of Python. Raises `Misuse`."""
        row = self.row
        if row.type is not FieldType.STATES:
            return str(value) if row.type is FieldType.STRING else float(value) if row.type is FieldType.DOUBLE else int(value)
        if value in row.states:
            return row.states.index(value)
        if isinstance(value, str | bytes):
            raise Misuse(f"{row.name}: {value!r}: permitted are {', '.join(row.states)}")
        return check_state(row, int(value))

    async def read(self, data_type: Any) -> Any:
        await self.record.refresh()
        return await super().read(data_type)

    async def subscribe(self, queue: Any, sub_spec: Any, sub: Any) -> None:
        await self.record.refresh()
        await super().subscribe(queue, sub_spec, sub)

    async def show(self) -> None:
        """Publish the value of the record where it, its alarm or its limits are others."""
        value, alarm = _shown(self.row, self.record.value(self.row.name)), self.record.alarm
        limits = _limits(self.record, self.row)
        has_other_limits = any(getattr(self, name) != limit for name, limit in limits.items())
        if is_same(self.value, value) and alarm == self.shown_alarm and not has_other_limits:
            return
        if alarm != self.shown_alarm:
            self.shown_alarm = alarm
            own: Any = self.alarm
            await own.write(**_alarm(alarm), publish=False)
        if has_other_limits:
            await self.write_metadata(publish=False, **limits)
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
    if row.type is FieldType.STATES:
        return row.states[int(value)]
    return _text(str(value), LONGEST_TEXT) if row.type is FieldType.STRING else value


def _text(text: str, most: int) -> str:
    """As much of it as there is room for; the library's encoding lacks most letters."""
    return text.encode("latin-1", "replace").decode("latin-1")[:most]


def _alarm(alarm: RecordAlarm) -> dict[str, Any]:
    return {"status": AlarmStatus[alarm.kind.name], "severity": AlarmSeverity(alarm.severity.value)}


def _limits(record: Record, row: FieldRow) -> dict[str, float]:
    """Limits of display and control, as the library calls them."""
    if row.quantity is FieldQuantity.PURE or row.type in (FieldType.STRING, FieldType.STATES):
        return {}
    low, high = ends_of(record.limits_of(row))
    return {f"{side}_{kind}_limit": end for kind in ("disp", "ctrl") for side, end in (("lower", low), ("upper", high))}


def _channel_of(record: Record, row: FieldRow) -> _RecordChannel:
    options: dict[str, Any] = {"alarm": ChannelAlarm(**_alarm(record.alarm))}
    if row.type is FieldType.STATES:
        options["enum_strings"] = row.states
    elif row.type is not FieldType.STRING:
        options |= {"units": _text(record.unit_of(row), LONGEST_UNIT), **_limits(record, row)}
    if row.type is FieldType.DOUBLE:
        options["precision"] = record.precision
    value = _shown(row, record.value(row.name))
    channel = _KINDS[row.type](value=value, timestamp=record.at_s, reported_record_type="steptwin", **options)
    channel.record, channel.row, channel.shown_alarm = record, row, record.alarm
    record.attach(row.name, channel)
    return channel


class PvDatabase(dict[str, _RecordChannel]):
    """Channels by name, ``RECORD`` or ``RECORD.FIELD``, made when a client asks for them."""

    def __init__(self, records: dict[str, Record]) -> None:
        super().__init__()
        self._records = records

    def __missing__(self, name: str) -> _RecordChannel:
        record, row = found_field(self._records, name)
        whole = f"{name.partition('.')[0]}.{row.name}"
        found = self[name] = _channel_of(record, row) if name == whole else self[whole]
        return found
