"""Whether plain data from a file is of the types that values have."""

from __future__ import annotations

from math import isfinite
from types import UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints


def fits(value: Any, wanted: Any) -> bool:
    """Whether a value is of a type made of int, float (finite), str, bytes, bool, None, tuples and unions of them."""
    parts = get_args(wanted)
    if get_origin(wanted) in (Union, UnionType):
        return any(fits(value, part) for part in parts)
    if get_origin(wanted) is tuple:
        if not isinstance(value, tuple):
            return False
        parts = (parts[0],) * len(value) if parts[-1] is ... else parts
        return len(parts) == len(value) and all(map(fits, value, parts))
    if wanted is int:
        return isinstance(value, int) and not isinstance(value, bool)
    if wanted is float:
        return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)
    return isinstance(value, wanted)


def fitting(name: str, value: Any, wanted: Any) -> Any:
    """The value, if it is of the type ``wanted``; else raises `TypeError`."""
    if not fits(value, wanted):
        raise TypeError(f"{name} is {format_short(value)}")
    return value


def fields_fit(value: tuple[Any, ...]) -> bool:
    """Whether the fields of a named tuple are of the types it declares."""
    return all(map(fits, value, get_type_hints(type(value)).values()))


def format_short(value: object) -> str:
    """A value in a message, no longer than half a line."""
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
