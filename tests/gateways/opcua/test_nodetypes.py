"""Types and units in the terms of OPC UA."""

from __future__ import annotations

from datetime import UTC, datetime

import pytest
from asyncua import ua

from steptwin.datasheet import Limits
from steptwin.gateways.opcua.nodetypes import UNECE_URI, data_value, engineering_unit, number_of, value_range
from steptwin.gateways.points import PointType

NOW = datetime(2026, 1, 2, tzinfo=UTC)


@pytest.mark.parametrize(("unit", "number"), [("mm", 5066068), ("mm/s", 4403510), ("degree", 17476), ("s", 5457219)])
def test_units_of_unece(unit: str, number: int) -> None:
    """Numbers from the OPC Foundation's list UNECE_to_OPCUA."""
    found = engineering_unit(unit)
    assert (found.UnitId, found.NamespaceUri, found.DisplayName.Text) == (number, UNECE_URI, unit)


def test_a_unit_of_our_own() -> None:
    found = engineering_unit("microstep")
    assert (found.UnitId, found.DisplayName.Text) == (-1, "microstep")
    assert found.NamespaceUri != UNECE_URI


def test_a_range_has_two_ends() -> None:
    found = value_range(Limits(-5, 10.5))
    assert found is not None
    assert (found.Low, found.High) == (-5.0, 10.5)
    assert value_range(Limits(0, None)) is value_range(Limits(None, 0)) is None


def test_unknown_values_have_a_status_code() -> None:
    absent = data_value(None, PointType.NUMBER, NOW)
    silent = data_value(None, PointType.NUMBER, NOW, is_answered=False)
    codes = [code.StatusCode.name for code in (absent, silent) if code.StatusCode is not None]
    assert codes == ["BadNoData", "BadNoCommunication"]
    assert absent.SourceTimestamp == silent.SourceTimestamp == NOW


@pytest.mark.parametrize(
    ("value", "kind", "expected"),
    [(1.0, PointType.TRUTH, True), (3, PointType.NUMBER, 3.0), (3, PointType.WHOLE, 3), ("ok", PointType.TEXT, "ok")],
)
def test_values(value: float | str, kind: PointType, expected: object) -> None:
    found = data_value(value, kind, NOW).Value
    assert found is not None
    assert found.Value == expected
    assert type(found.Value) is type(expected)


def test_values_that_clients_write() -> None:
    assert number_of(ua.Variant(True), PointType.TRUTH) == 1.0
    assert number_of(ua.Variant(2.5), PointType.NUMBER) == 2.5
    assert number_of(ua.Variant(2, ua.VariantType.Int16), PointType.NUMBER) == 2.0
    for wrong in (None, ua.Variant("2"), ua.Variant([1.0]), ua.Variant(True)):
        assert number_of(wrong, PointType.NUMBER) is None
    assert number_of(ua.Variant(1), PointType.TRUTH) is None
