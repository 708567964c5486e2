"""Payloads of Sparkplug B as bytes, also against sparkplug-payload."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from node_client import NodeClient

from steptwin.errors import Misuse
from steptwin.gateways.mqtt.sparkplugcodec import (
    SparkplugMetric,
    SparkplugPayload,
    SparkplugProperty,
    SparkplugType,
    decode_payload,
    encode_payload,
)

U64 = st.integers(0, 2**64 - 1)
TEXT = st.text(st.characters(exclude_categories=["Cs"]), max_size=20)
VALUES: dict[SparkplugType, st.SearchStrategy[Any]] = {
    **{
        kind: st.integers(-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
        for kind, bits in zip(list(SparkplugType)[:4], (8, 16, 32, 64), strict=True)
    },
    **{kind: st.integers(0, 2**bits - 1) for kind, bits in zip(list(SparkplugType)[4:8], (8, 16, 32, 64), strict=True)},
    SparkplugType.FLOAT: st.floats(width=32, allow_nan=False),
    SparkplugType.DOUBLE: st.floats(allow_nan=False),
    SparkplugType.BOOLEAN: st.booleans(),
    SparkplugType.STRING: TEXT,
    SparkplugType.DATETIME: U64,
    SparkplugType.TEXT: TEXT,
    SparkplugType.UUID: TEXT,
    SparkplugType.BYTES: st.binary(max_size=20),
}


@st.composite
def properties(draw: st.DrawFn) -> SparkplugProperty:
    kind = draw(st.sampled_from([kind for kind in SparkplugType if kind is not SparkplugType.BYTES]))
    return SparkplugProperty(kind, draw(st.none() | VALUES[kind]))


@st.composite
def metrics(draw: st.DrawFn) -> SparkplugMetric:
    kind = draw(st.sampled_from(list(SparkplugType)))
    return SparkplugMetric(
        name=draw(st.none() | TEXT),
        alias=draw(st.none() | U64),
        timestamp=draw(st.none() | U64),
        type=kind,
        value=draw(st.none() | VALUES[kind]),
        is_historical=draw(st.booleans()),
        properties=draw(st.dictionaries(TEXT, properties(), max_size=3)),
    )


@given(st.none() | U64, st.lists(metrics(), max_size=4), st.none() | st.integers(0, 255))
def test_what_is_encoded_is_decoded(timestamp: int | None, found: list[SparkplugMetric], seq: int | None) -> None:
    payload = SparkplugPayload(timestamp=timestamp, metrics=tuple(found), seq=seq)
    assert decode_payload(encode_payload(payload)) == payload


@given(st.binary(max_size=60))
def test_any_bytes_are_a_payload_or_refused(data: bytes) -> None:
    with suppress(Misuse):
        assert isinstance(decode_payload(data), SparkplugPayload)


def test_the_bytes_of_the_specification_of_protocol_buffers() -> None:
    """Field numbers by hand: 6.4 of the specification; encoding by protobuf.dev: 150 is 96 01, a text has its length."""
    metric = SparkplugMetric(name="a", alias=150, timestamp=1, type=SparkplugType.INT32, value=-1)
    encoded = encode_payload(SparkplugPayload(timestamp=150, metrics=(metric,), seq=0))
    inner = "0a0161 109601 1801 2003 50ffffffff0f".replace(" ", "")
    assert encoded.hex() == f"089601 12{len(inner) // 2:02x}{inner} 1800".replace(" ", "")
    double = SparkplugMetric(type=SparkplugType.DOUBLE, value=1.0)
    assert encode_payload(SparkplugPayload(metrics=(double,))).hex() == "120b 200a 69 000000000000f03f".replace(" ", "")


@pytest.mark.parametrize("wrong", ["08", "0a05", "12ff", "0b", "ff" * 11, "120162ff"])
def test_what_is_cut_off_is_refused(wrong: str) -> None:
    with pytest.raises(Misuse, match="no payload of Sparkplug B"):
        decode_payload(bytes.fromhex(wrong))


def test_a_text_that_is_not_utf_8_is_refused() -> None:
    with pytest.raises(Misuse, match="a text is not UTF-8"):
        decode_payload(bytes.fromhex("12030a01ff"))


def test_a_value_of_another_type_is_refused() -> None:
    for kind, value in (
        (SparkplugType.INT32, "x"),
        (SparkplugType.BOOLEAN, 1),
        (SparkplugType.STRING, 1.0),
        (SparkplugType.DOUBLE, True),
    ):
        with pytest.raises(Misuse, match=f"not a value of the type {kind.name}"):
            encode_payload(SparkplugPayload(metrics=(SparkplugMetric(name="x", type=kind, value=value),)))


VECTORS = [
    ("Int8", SparkplugType.INT8, -7),
    ("Int32", SparkplugType.INT32, -(2**31)),
    ("UInt16", SparkplugType.UINT16, 65535),
    ("UInt32", SparkplugType.UINT32, 2**32 - 1),
    ("Float", SparkplugType.FLOAT, 1.5),
    ("Double", SparkplugType.DOUBLE, -0.1),
    ("Boolean", SparkplugType.BOOLEAN, False),
    ("String", SparkplugType.STRING, "µm/s Ω"),
    ("Int64", SparkplugType.INT64, 2**40),
    ("Double", SparkplugType.DOUBLE, None),
]


def test_sparkplug_payload_says_the_same(require_peer: Callable[[str], str], tmp_path: Path) -> None:
    with NodeClient(require_peer("node"), "sparkplug.js", tmp_path) as client:
        theirs = [
            {"name": f"m{number}", "alias": number, "type": word, "value": value, "timestamp": 1_700_000_000_000}
            for number, (word, _, value) in enumerate(VECTORS)
        ]
        hexadecimal = client("encode", payload={"timestamp": 1_700_000_000_001, "seq": 200, "metrics": theirs})
        found = decode_payload(bytes.fromhex(hexadecimal))
        assert (found.timestamp, found.seq) == (1_700_000_000_001, 200)
        assert [(one.name, one.alias, one.type, one.value) for one in found.metrics] == [
            (f"m{number}", number, kind, value) for number, (_, kind, value) in enumerate(VECTORS)
        ]
        unit = {"engUnit": SparkplugProperty(SparkplugType.STRING, "mm"), "engLow": SparkplugProperty(SparkplugType.DOUBLE, -2.5)}
        ours = tuple(
            SparkplugMetric(name=f"m{number}", type=kind, value=value, is_historical=number == 1, properties=unit)
            for number, (_, kind, value) in enumerate(VECTORS)
            if kind is not SparkplugType.UINT32  # which that library writes and reads as a long, unlike the specification
        )
        back = client("decode", hex=encode_payload(SparkplugPayload(metrics=ours, seq=255)).hex())
        assert back["seq"] == 255
        assert [(one["name"], one["value"], one["historical"]) for one in back["metrics"]] == [
            (one.name, one.value, one.is_historical) for one in ours
        ]
        assert back["metrics"][0]["properties"] == {"engUnit": "mm", "engLow": -2.5}
        client("close")
