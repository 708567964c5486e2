"""Durations and inputs of a run in virtual time as a user writes them: ``90s``, ``IN3=1@2s,AIN1=4.2@500ms``."""

from __future__ import annotations

import re
from decimal import Decimal
from typing import NamedTuple

from steptwin.errors import Misuse
from steptwin.machine import MICROSECOND, MILLISECOND, SECOND, Nanos

_UNITS: dict[str, Nanos] = {"us": MICROSECOND, "ms": MILLISECOND, "s": SECOND, "min": 60 * SECOND, "h": 3600 * SECOND}
_LONGEST_H = 366 * 24
_DURATION = re.compile(r"(\d{1,30}(?:\.\d{1,30})?|\.\d{1,30}) *([a-z]*)\Z", re.ASCII)
_INPUT = re.compile(r"([\w.&]+) *= *(-?\d+(?:\.\d+)?) *@ *(.+)\Z", re.ASCII)


class TimedInput(NamedTuple):
    """``pin`` takes ``value`` at the moment ``time``."""

    time: Nanos
    pin: str
    value: float


def parse_duration(text: str, option: str) -> Nanos:
    """``10s``, ``1.5 s``, ``500ms``, ``2min``, ``1h``; a bare number is in seconds. Raises `Misuse` in the name of ``option``."""
    return _nanoseconds(text, f"{option} {text}")


def parse_inputs(text: str, option: str = "--input") -> list[TimedInput]:
    """``PIN=VALUE@TIME`` separated by commas, in the order in which they come. Pins are not looked up. Raises `Misuse`."""
    inputs: list[TimedInput] = []
    for part in filter(None, map(str.strip, text.split(","))):
        match = _INPUT.match(part)
        if match is None:
            raise Misuse(f"{option} {part}: expected PIN=VALUE@TIME, such as IN3=1@2s or AIN1=4.2@500ms")
        inputs.append(TimedInput(_nanoseconds(match[3], f"{option} {part}"), match[1].upper(), float(match[2])))
    return sorted(inputs, key=lambda each: each.time)


def _nanoseconds(text: str, place: str) -> Nanos:
    match = _DURATION.match(text.strip().lower())
    unit = _UNITS.get(match[2] or "s") if match else None
    if match is None or unit is None:
        raise Misuse(f"{place}: expected a time with {', '.join(_UNITS)}, such as 90s or 500ms")
    duration = int(Decimal(match[1]) * unit)
    if duration > _LONGEST_H * _UNITS["h"]:
        raise Misuse(f"{place}: permitted are 0 to {_LONGEST_H} h")
    return duration
