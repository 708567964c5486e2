"""Types and units of variables in the terms of OPC UA."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from functools import cache
from typing import Any

from asyncua import ua

from steptwin.datasheet import Limits
from steptwin.gateways.points import PointType, PointValue

VARIANTS: Mapping[PointType, ua.VariantType] = {
    PointType.TRUTH: ua.VariantType.Boolean,
    PointType.WHOLE: ua.VariantType.Int64,
    PointType.NUMBER: ua.VariantType.Double,
    PointType.TEXT: ua.VariantType.String,
}
ZEROS: Mapping[PointType, PointValue] = {
    PointType.TRUTH: False,
    PointType.WHOLE: 0,
    PointType.NUMBER: 0.0,
    PointType.TEXT: "",
}
"""Values of variables before their first."""

_UNECE = {
    "mm": "MMT",
    "cm": "CMT",
    "m": "MTR",
    "mm/s": "C16",
    "cm/s": "2M",
    "m/s": "MTS",
    "rev/s": "RPS",
    "degree": "DD",
    "degree/s": "E96",
    "s": "SEC",
    "V": "VLT",
    "bit": "A99",
    "byte": "AD",
    "bit/s": "B10",
}
"""UNECE Recommendation 20. Pulses and microsteps have no code there."""
UNECE_URI = "http://www.opcfoundation.org/UA/units/un/cefact"
OWN_URI = "urn:steptwin:units"


@cache
def standard(number: Any) -> ua.NodeId:
    """A node of OPC UA itself, such as ``ua.ObjectIds.Server``."""
    return ua.NodeId(number)


def status(code: Any) -> ua.StatusCode:
    """Status for one of ``ua.StatusCodes``."""
    return ua.StatusCode(code)


def engineering_unit(unit: str) -> ua.EUInformation:
    """OPC 10000-8, 5.6.3: the id of a UNECE unit is its code as a number; -1 for a unit that is not among them."""
    code = _UNECE.get(unit)
    found = ua.EUInformation()
    found.NamespaceUri = OWN_URI if code is None else UNECE_URI
    found.UnitId = -1 if code is None else int.from_bytes(code.encode(), "big")
    found.DisplayName = ua.LocalizedText(unit)
    found.Description = ua.LocalizedText(unit)
    return found


def value_range(limits: Limits) -> ua.Range | None:
    """None where a limit is open."""
    if limits.low is None or limits.high is None:
        return None
    return ua.Range(float(limits.low), float(limits.high))


def data_value(value: PointValue, kind: PointType, moment: datetime, *, is_answered: bool = True) -> ua.DataValue:
    """With the moment at which it was the present one. ``is_answered``: whether its controller answers."""
    at: Any = moment
    if value is None:
        code = ua.StatusCodes.BadNoData if is_answered else ua.StatusCodes.BadNoCommunication
        return ua.DataValue(ua.Variant(), status(code), at)
    if kind is PointType.TRUTH:
        value = bool(value)
    elif kind is PointType.NUMBER:
        value = float(value)
    return ua.DataValue(ua.Variant(value, VARIANTS[kind]), SourceTimestamp=at)


def number_of(variant: ua.Variant | None, kind: PointType) -> float | None:
    """A value that a client writes; None for another type."""
    if variant is None or isinstance(variant.Value, list | tuple):
        return None
    value = variant.Value
    if kind is PointType.TRUTH:
        return float(value) if isinstance(value, bool) else None
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None
