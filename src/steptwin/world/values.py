"""How values of a description are read: each function gives the value, or raises `Misuse` with what is permitted."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from math import isnan
from typing import Any

from steptwin.durations import duration
from steptwin.errors import Misuse
from steptwin.machine import SECOND
from steptwin.nearmiss import NearMiss
from steptwin.world.addresses import parse_address

MOST = 1e300
"""Numbers beyond it would overflow in products."""


def text_value(value: Any) -> str:
    if not isinstance(value, str) or not value.strip():
        raise Misuse(f"{value!r}: expected a text{' that is not empty' if isinstance(value, str) else ''}")
    return value


def texts(value: Any) -> tuple[str, ...]:
    if not isinstance(value, list):
        raise Misuse(f"{value!r}: expected a list of texts")
    return tuple(map(text_value, value))


def address_value(value: Any) -> str:
    """HOST:PORT as it is written; whether it may be reached by others is decided where it is opened."""
    parse_address(text_value(value), listen_any=True)
    return value


_NAME = re.compile(r"[A-Za-z_][\w-]*\Z", re.ASCII)


def name_value(value: Any) -> str:
    if not isinstance(value, str) or not _NAME.match(value):
        raise Misuse(f"{value!r} is not a name: expected a letter from A to Z, then letters, digits, '-' and '_'")
    return value


_NUMERIC = re.compile(r"\s*[-+]?[0-9.]+\s*[A-Za-z/²µ%·]*\s*\Z")
"""A number as text, perhaps with a unit."""


def flag(value: Any) -> bool:
    if not isinstance(value, bool):
        raise Misuse(f"{value!r}: expected true or false")
    return value


def number(least: float | None = None, most: float | None = None, *, above: bool = False) -> Callable[[Any], float]:
    """A number from ``least`` (not itself with ``above``) to ``most``."""

    def read(value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or (isinstance(value, float) and isnan(value)):
            is_quoted = isinstance(value, str) and _NUMERIC.match(value) is not None
            raise Misuse(f"{value!r}: expected a number{', without quotes and unit' if is_quoted else ''}")
        if abs(value) > MOST:
            raise Misuse(f"{value!r}: permitted are numbers from {-MOST:g} to {MOST:g}")
        low = least is not None and (value <= least if above else value < least)
        if low or (most is not None and value > most):
            bounds = (f"above {least:g}" if above else f"from {least:g}") if least is not None else ""
            raise Misuse(f"{value!r}: permitted are numbers {bounds}{f' to {most:g}' if most is not None else ''}")
        return float(value)

    return read


def whole(least: int, most: int) -> Callable[[Any], int]:
    def read(value: Any) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
            raise Misuse(f"{value!r}: permitted are whole numbers from {least} to {most}")
        return value

    return read


@dataclass(frozen=True, slots=True)
class Word:
    """One of a few words."""

    words: tuple[str, ...]

    def __call__(self, value: Any) -> str:
        if value not in self.words:
            near = self.near(value)
            hint = "" if near is None else f" (did you mean {near!r}?)"
            raise Misuse(f"{value!r}{hint}: permitted are {', '.join(self.words)}")
        return value

    def near(self, value: object) -> str | None:
        """The word that was probably meant: the one in another case, or a near one."""
        if not isinstance(value, str):
            return None
        same = next((word for word in self.words if word.lower() == value.lower()), None)
        return same or NearMiss().of(value, self.words)


def word(*words: str) -> Word:
    return Word(words)


def time_value(value: Any) -> int:
    return duration(value)


def positive_time(value: Any) -> int:
    found = duration(value)
    if found == 0:
        raise Misuse(f"{value!r}: must be more than 0")
    return found


def whole_seconds(value: Any) -> int:
    """ns, of a time in seconds from 1 s to an hour."""
    found = duration(value)
    if not SECOND <= found <= 3600 * SECOND or found % SECOND:
        raise Misuse(f"{value!r}: permitted are whole seconds from 1s to 3600s")
    return found


def pair(value: Any) -> tuple[float, float]:
    if not isinstance(value, list) or len(value) != 2:
        raise Misuse(f"{value!r}: expected [low, high]")
    low, high = (number()(item) for item in value)
    if low >= high:
        raise Misuse(f"{value!r}: the first must be below the second")
    return low, high


def points(value: Any) -> tuple[tuple[float, float], ...]:
    if not isinstance(value, list) or not value or any(not isinstance(item, list) or len(item) != 2 for item in value):
        raise Misuse(f"{value!r}: expected [[x, y], [x, y], ...]")
    found = tuple((number()(x), number()(y)) for x, y in value)
    if any(a[0] >= b[0] for a, b in pairwise(found)):
        raise Misuse(f"{value!r}: the first numbers must grow")
    return found


DIGITAL_INPUT, ANALOG_INPUT, OUTPUT = "digital input", "analog input", "output"
"""Kinds of terminals."""


def pin_name(value: Any) -> tuple[str, str]:
    """``MACHINE.PIN``."""
    machine, dot, pin = value.partition(".") if isinstance(value, str) else ("", "", "")
    if not dot or not machine or not pin:
        raise Misuse(f"{value!r}: expected MACHINE.PIN, such as 'table.IN3'")
    return machine, pin.upper()


_AXIS = re.compile(r"M([1-9][0-9]{0,3})\Z")


def axis_number(name: str) -> int:
    """The number of the axis ``M1``, ``M2`` and so on; 0 if this is no name of an axis."""
    found = _AXIS.match(name)
    return int(found[1]) if found is not None else 0


@dataclass(frozen=True, slots=True)
class PinOf:
    """``MACHINE.PIN`` or ``ELEMENT.TERMINAL``, a terminal of a kind; a list of them where there may be several."""

    kind: str
    most: int = 1

    def __call__(self, value: Any) -> Any:
        """One name, or a tuple of names with ``most`` > 1."""
        if self.most == 1:
            return pin_name(value)
        names = value if isinstance(value, list) else [value]
        if not 1 <= len(names) <= self.most:
            raise Misuse(f"{len(names)} terminals: permitted are 1 to {self.most}")
        return tuple(pin_name(name) for name in names)


@dataclass(frozen=True, slots=True)
class NameOf:
    """The name of an element of a kind."""

    element: str

    def __call__(self, value: Any) -> str:
        return name_value(value)


INPUT_PIN = PinOf(DIGITAL_INPUT)
OUTPUT_PIN = PinOf(OUTPUT)
"""What drives an input."""
