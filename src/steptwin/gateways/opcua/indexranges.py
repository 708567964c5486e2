"""Parts of arrays and texts (NumericRange, OPC 10000-4, 7.27)."""

from __future__ import annotations

import re
from dataclasses import replace

from asyncua import ua

_FORM = re.compile(r"(\d{1,10})(?::(\d{1,10}))?")


def check_range(text: str | None) -> None:
    """Raises `ua.UaStatusCodeError` for what is not a range."""
    for dimension in (text or "0").split(","):
        _bounds(dimension)


def _bounds(text: str) -> tuple[int, int]:
    """The first and the last index."""
    found = _FORM.fullmatch(text)
    if found is None:
        raise ua.UaStatusCodeError(ua.StatusCodes.BadIndexRangeInvalid)
    first = int(found[1])
    if found[2] is None:
        return first, first
    last = int(found[2])
    if last <= first:
        raise ua.UaStatusCodeError(ua.StatusCodes.BadIndexRangeInvalid)
    return first, last


def part_of(value: ua.DataValue, text: str | None) -> ua.DataValue:
    """The part ``text`` of a value, all of it without one. The status says what is not a range, or where there is nothing."""
    if not text:
        return value
    try:
        check_range(text)
        return replace(value, Value=_part(value.Value, text)) if value.StatusCode is None or value.StatusCode.is_good() else value
    except ua.UaStatusCodeError as error:
        return ua.DataValue(ua.Variant(), ua.StatusCode(error.code))


def _part(variant: ua.Variant | None, text: str) -> ua.Variant:
    whole = None if variant is None else variant.Value
    if variant is None or not isinstance(whole, list | str | bytes) or "," in text:
        raise ua.UaStatusCodeError(ua.StatusCodes.BadIndexRangeNoData)
    first, last = _bounds(text)
    if first >= len(whole):
        raise ua.UaStatusCodeError(ua.StatusCodes.BadIndexRangeNoData)
    return ua.Variant(whole[first : last + 1], variant.VariantType, is_array=variant.is_array)
