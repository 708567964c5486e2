"""Durations and inputs of a run in virtual time as a user writes them: ``90s``, ``IN3=1@2s,AIN1=4.2@500ms``."""

from __future__ import annotations

import re
from typing import NamedTuple

from steptwin.controller import Nanos
from steptwin.durations import duration
from steptwin.errors import Misuse

_INPUT = re.compile(r"([\w.&]+) *= *(-?\d+(?:\.\d+)?) *@ *(.+)\Z", re.ASCII)
_NUMBER = re.compile(r"\d+(\.\d+)?", re.ASCII)


class TimedInput(NamedTuple):
    """``pin`` takes ``value`` at the moment ``time``."""

    time: Nanos
    pin: str
    value: float


def parse_duration(text: str, option: str) -> Nanos:
    """``10s``, ``1.5 s``, ``500ms``, ``2min``, ``1h``; a bare number is in seconds, as numbers in descriptions are.

    Raises `Misuse` in the name of ``option``.
    """
    try:
        return duration(f"{text.strip()}s" if _NUMBER.fullmatch(text.strip()) else text)
    except Misuse as error:
        raise Misuse(f"{option}: {error}") from None


def parse_inputs(text: str, option: str = "--input") -> list[TimedInput]:
    """``PIN=VALUE@TIME`` separated by commas, in the order in which they come. Pins are not looked up. Raises `Misuse`."""
    inputs: list[TimedInput] = []
    for part in filter(None, map(str.strip, text.split(","))):
        match = _INPUT.match(part)
        if match is None:
            raise Misuse(f"{option} {part}: expected PIN=VALUE@TIME, such as IN3=1@2s or AIN1=4.2@500ms")
        inputs.append(TimedInput(parse_duration(match[3], f"{option} {part}"), match[1].upper(), float(match[2])))
    return sorted(inputs, key=lambda each: each.time)
