"""Payloads of Sparkplug B: Protocol Buffers, with the field numbers of the specification (3.0, 6.4 and appendix).

The encoding is written here: a payload has three levels and seven kinds of values, while the library needs generated code and a
compiler that makes it.
"""

from __future__ import annotations

import enum
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

from steptwin.errors import Misuse

SparkplugValue: TypeAlias = bool | int | float | str | bytes | None
MOST_METRICS = 10_000
_VARINT, _FIXED64, _BYTES, _FIXED32 = 0, 1, 2, 5
"""Wire types."""


class SparkplugType(enum.IntEnum):
    INT8 = 1
    INT16 = 2
    INT32 = 3
    INT64 = 4
    UINT8 = 5
    UINT16 = 6
    UINT32 = 7
    UINT64 = 8
    FLOAT = 9
    DOUBLE = 10
    BOOLEAN = 11
    STRING = 12
    DATETIME = 13
    TEXT = 14
    UUID = 15
    BYTES = 17


_SIGNED = {SparkplugType.INT8, SparkplugType.INT16, SparkplugType.INT32, SparkplugType.INT64}
_SHORT = {
    SparkplugType.INT8,
    SparkplugType.INT16,
    SparkplugType.INT32,
    SparkplugType.UINT8,
    SparkplugType.UINT16,
    SparkplugType.UINT32,
}
_LONG = {SparkplugType.INT64, SparkplugType.UINT64, SparkplugType.DATETIME}
_TEXTS = {SparkplugType.STRING, SparkplugType.TEXT, SparkplugType.UUID}
_INT, _LONG_INT, _FLOAT, _DOUBLE, _TRUTH, _TEXT = range(6)
"""Places of the fields of a value, which follow each other from 10 in a metric and from 3 in a property."""
_METRIC_VALUES, _PROPERTY_VALUES, _METRIC_BYTES = 10, 3, 17


@dataclass(frozen=True, slots=True)
class SparkplugProperty:
    type: SparkplugType
    value: SparkplugValue


@dataclass(frozen=True, slots=True, kw_only=True)
class SparkplugMetric:
    """``timestamp``: ms since 1970, UTC. Of a command, what the sender has left out is None."""

    name: str | None = None
    alias: int | None = None
    timestamp: int | None = None
    type: SparkplugType | None
    value: SparkplugValue
    """None: it is null."""
    is_historical: bool = False
    properties: Mapping[str, SparkplugProperty] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class SparkplugPayload:
    timestamp: int | None = None
    metrics: tuple[SparkplugMetric, ...] = ()
    seq: int | None = None
    """0 to 255."""


# ---------------------------------------------------------------------- to bytes


def encode_payload(payload: SparkplugPayload) -> bytes:
    parts: list[bytes] = []
    if payload.timestamp is not None:
        parts.append(_whole(1, payload.timestamp))
    parts += [_block(2, _metric(metric)) for metric in payload.metrics]
    if payload.seq is not None:
        parts.append(_whole(3, payload.seq))
    return b"".join(parts)


def _metric(metric: SparkplugMetric) -> bytes:
    parts: list[bytes] = []
    if metric.name is not None:
        parts.append(_block(1, metric.name.encode()))
    if metric.alias is not None:
        parts.append(_whole(2, metric.alias))
    if metric.timestamp is not None:
        parts.append(_whole(3, metric.timestamp))
    if metric.type is not None:
        parts.append(_whole(4, metric.type))
    if metric.is_historical:
        parts.append(_whole(5, 1))
    if metric.value is None:
        parts.append(_whole(7, 1))
    if metric.properties:
        keys = b"".join(_block(1, key.encode()) for key in metric.properties)
        values = b"".join(_block(2, _property(one)) for one in metric.properties.values())
        parts.append(_block(9, keys + values))
    if metric.value is not None:
        if metric.type is None:
            raise Misuse(f"{metric.name}: a value has a type")
        parts.append(_value(metric.type, metric.value, _METRIC_VALUES))
    return b"".join(parts)


def _property(one: SparkplugProperty) -> bytes:
    if one.value is None:
        return _whole(1, one.type) + _whole(2, 1)
    return _whole(1, one.type) + _value(one.type, one.value, _PROPERTY_VALUES)


def _value(kind: SparkplugType, value: bool | float | str | bytes, first: int) -> bytes:
    """``first``: the number of the first field of values."""
    match value:
        case bool() if kind is SparkplugType.BOOLEAN:
            return _whole(first + _TRUTH, int(value))
        case int() if kind in _SHORT and not isinstance(value, bool):
            return _whole(first + _INT, value & 0xFFFF_FFFF)
        case int() if kind in _LONG and not isinstance(value, bool):
            return _whole(first + _LONG_INT, value & 0xFFFF_FFFF_FFFF_FFFF)
        case int() | float() if kind is SparkplugType.FLOAT and not isinstance(value, bool):
            return _key(first + _FLOAT, _FIXED32) + struct.pack("<f", value)
        case int() | float() if kind is SparkplugType.DOUBLE and not isinstance(value, bool):
            return _key(first + _DOUBLE, _FIXED64) + struct.pack("<d", value)
        case str() if kind in _TEXTS:
            return _block(first + _TEXT, value.encode())
        case bytes() if kind is SparkplugType.BYTES and first == _METRIC_VALUES:
            return _block(_METRIC_BYTES, value)
    raise Misuse(f"{value!r} is not a value of the type {kind.name}")


def _varint(number: int) -> bytes:
    found = bytearray()
    while number > 0x7F:
        found.append(number & 0x7F | 0x80)
        number >>= 7
    found.append(number)
    return bytes(found)


def _key(number: int, wire: int) -> bytes:
    return _varint(number << 3 | wire)


def _whole(number: int, value: int) -> bytes:
    return _key(number, _VARINT) + _varint(value)


def _block(number: int, data: bytes) -> bytes:
    return _key(number, _BYTES) + _varint(len(data)) + data


# ---------------------------------------------------------------------- from bytes


def decode_payload(data: bytes) -> SparkplugPayload:
    """Fields that are not known are skipped. Raises `Misuse` for what is no payload."""
    timestamp: int | None = None
    seq: int | None = None
    metrics: list[SparkplugMetric] = []
    for number, value in _fields(data):
        match number, value:
            case 1, int():
                timestamp = value
            case 2, bytes():
                if len(metrics) >= MOST_METRICS:
                    raise Misuse(f"a payload with more than {MOST_METRICS} metrics")
                metrics.append(_read_metric(value))
            case 3, int():
                seq = value
    return SparkplugPayload(timestamp=timestamp, metrics=tuple(metrics), seq=seq)


def _read_metric(data: bytes) -> SparkplugMetric:
    found = dict(_fields(data))  # of a field that comes twice the last one counts
    name, alias, timestamp = found.get(1), found.get(2), found.get(3)
    kind = _type(found.get(4))
    return SparkplugMetric(
        name=_text(name) if isinstance(name, bytes) else None,
        alias=alias if isinstance(alias, int) else None,
        timestamp=timestamp if isinstance(timestamp, int) else None,
        type=kind,
        value=None if found.get(7) else _read_value(found, kind, _METRIC_VALUES),
        is_historical=bool(found.get(5)),
        properties=_read_properties(found.get(9)),
    )


def _read_properties(data: object) -> dict[str, SparkplugProperty]:
    if not isinstance(data, bytes):
        return {}
    keys: list[str] = []
    values: list[SparkplugProperty] = []
    for number, value in _fields(data):
        if number == 1 and isinstance(value, bytes):
            keys.append(_text(value))
        elif number == 2 and isinstance(value, bytes):
            found = dict(_fields(value))
            kind = _type(found.get(1))
            if kind is None:  # a set of properties in properties, which nothing here uses
                kind = SparkplugType.STRING
            values.append(SparkplugProperty(kind, None if found.get(2) else _read_value(found, kind, _PROPERTY_VALUES)))
    return dict(zip(keys, values, strict=False))


def _read_value(found: Mapping[int, int | float | bytes], kind: SparkplugType | None, first: int) -> SparkplugValue:
    """In whichever of its fields it is: senders differ in where they put a UInt32."""
    places = [place for place in range(6) if first + place in found]
    if not places:
        data = found.get(_METRIC_BYTES) if first == _METRIC_VALUES else None
        return data if isinstance(data, bytes) else None
    value = found[first + places[-1]]
    match places[-1], value:
        case 0 | 1, int():
            bits = 32 if places[-1] == _INT else 64
            is_signed = kind in _SIGNED or (kind is None and bits == 64)
            return value - (1 << bits) if is_signed and value >> (bits - 1) else value
        case 2 | 3, float():
            return value
        case 4, int():
            return bool(value)
        case 5, bytes():
            return _text(value)
    raise Misuse("a value has another type than its field")


def _type(value: object) -> SparkplugType | None:
    return SparkplugType(value) if value in set(SparkplugType) else None


def _text(data: bytes) -> str:
    try:
        return data.decode()
    except UnicodeDecodeError:
        raise Misuse("a text is not UTF-8") from None


def _fields(data: bytes) -> Iterator[tuple[int, int | float | bytes]]:
    """Their numbers and values. Raises `Misuse`."""
    at = 0
    while at < len(data):
        key, at = _read_varint(data, at)
        number, wire = key >> 3, key & 7
        if wire == _VARINT:
            value, at = _read_varint(data, at)
            yield number, value
            continue
        size = {_FIXED64: 8, _FIXED32: 4}.get(wire)
        if wire == _BYTES:
            size, at = _read_varint(data, at)
        if size is None or number == 0:
            raise Misuse(f"no payload of Sparkplug B: a field of wire type {wire}")
        block = data[at : at + size]
        if len(block) < size:
            raise Misuse(f"no payload of Sparkplug B: it ends after {len(block)} of {size} bytes")
        at += size
        yield number, block if wire == _BYTES else struct.unpack("<d" if wire == _FIXED64 else "<f", block)[0]


def _read_varint(data: bytes, at: int) -> tuple[int, int]:
    value = 0
    for shift in range(0, 70, 7):
        if at >= len(data):
            raise Misuse("no payload of Sparkplug B: it ends in a number")
        byte = data[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value & 0xFFFF_FFFF_FFFF_FFFF, at
    raise Misuse("no payload of Sparkplug B: a number of more than 10 bytes")
