"""How values of a description are read: each function gives the value, or raises `Misuse` with what is permitted."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from math import isnan
from typing import Any, Generic, TypeAlias, TypeVar

from steptwin.controller import SECOND
from steptwin.durations import duration
from steptwin.errors import Misuse
from steptwin.nearmiss import NearMiss
from steptwin.simulation.toml.addresses import parse_address

MOST = 1e300
"""Numbers beyond it would overflow in products."""

T = TypeVar("T")

Terminal: TypeAlias = tuple[str, str]
"""Controller and pin, as a description names them."""


@dataclass(frozen=True, slots=True)
class ValueReader(Generic[T]):
    """How a value is read, and what is permitted, in words."""

    read: Callable[[Any], T]
    permitted: str
    words: tuple[str, ...] = ()
    """Those that it may consist of, if they are few."""

    def __call__(self, value: Any) -> T:
        return self.read(value)


def permitting(what: str, words: tuple[str, ...] = ()) -> Callable[[Callable[[Any], T]], ValueReader[T]]:
    """Says what the decorated function takes."""
    return lambda read: ValueReader(read, what, words)


@dataclass(frozen=True, slots=True)
class NamesInSpace(ValueReader[T]):
    """Names of elements with a place in space. One of ``words`` may stand for a name."""


def naming_in_space(what: str, words: tuple[str, ...] = ()) -> Callable[[Callable[[Any], T]], NamesInSpace[T]]:
    """Says what the decorated function takes, which reads names of elements with a place in space."""
    return lambda read: NamesInSpace(read, what, words)


@permitting("text")
def text_value(value: Any) -> str:
    if not isinstance(value, str) or not value.strip():
        raise Misuse(f"{value!r}: expected a text{' that is not empty' if isinstance(value, str) else ''}")
    return value


@permitting("list of texts")
def texts(value: Any) -> tuple[str, ...]:
    if not isinstance(value, list):
        raise Misuse(f"{value!r}: expected a list of texts")
    return tuple(map(text_value, value))


@permitting("HOST:PORT")
def address_value(value: Any) -> str:
    """HOST:PORT as it is written; whether it may be reached by others is decided where it is opened."""
    parse_address(text_value(value), listen_any=True)
    return value


_NAME = re.compile(r"[A-Za-z_][\w-]*\Z", re.ASCII)


@permitting("name")
def name_value(value: Any) -> str:
    if not isinstance(value, str) or not _NAME.match(value):
        raise Misuse(f"{value!r} is not a name: expected a letter from A to Z, then letters, digits, '-' and '_'")
    return value


_NUMERIC = re.compile(r"\s*[-+]?[0-9.]+\s*[A-Za-z/²µ%·]*\s*\Z")
"""A number as text, perhaps with a unit."""


@permitting("true or false")
def flag(value: Any) -> bool:
    if not isinstance(value, bool):
        raise Misuse(f"{value!r}: expected true or false")
    return value


@dataclass(frozen=True, slots=True)
class Number:
    """A number from ``least`` (not itself with ``above``) to ``most``."""

    least: float | None = None
    most: float | None = None
    above: bool = False

    @property
    def permitted(self) -> str:
        low = "" if self.least is None else f" above {self.least:g}" if self.above else f" from {self.least:g}"
        return f"number{low}{'' if self.most is None else f' to {self.most:g}'}"

    def __call__(self, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or (isinstance(value, float) and isnan(value)):
            is_quoted = isinstance(value, str) and _NUMERIC.match(value) is not None
            raise Misuse(f"{value!r}: expected a number{', without quotes and unit' if is_quoted else ''}")
        if abs(value) > MOST:
            least, most = -MOST if self.least is None else self.least, MOST if self.most is None else self.most
            raise Misuse(f"{value!r}: permitted are {Number(least, most, self.above).permitted.replace('number', 'numbers', 1)}")
        low = self.least is not None and (value <= self.least if self.above else value < self.least)
        if low or (self.most is not None and value > self.most):
            raise Misuse(f"{value!r}: permitted are {self.permitted.replace('number', 'numbers', 1)}")
        return float(value)


def number(least: float | None = None, most: float | None = None, *, above: bool = False) -> Number:
    return Number(least, most, above)


@dataclass(frozen=True, slots=True)
class WholeNumber:
    """A whole number from ``least`` to ``most``."""

    least: int
    most: int

    @property
    def permitted(self) -> str:
        return f"whole number from {self.least} to {self.most}"

    def __call__(self, value: Any) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not self.least <= value <= self.most:
            raise Misuse(f"{value!r}: permitted are whole numbers from {self.least} to {self.most}")
        return value


def whole(least: int, most: int) -> WholeNumber:
    return WholeNumber(least, most)


@dataclass(frozen=True, slots=True)
class Word:
    """One of a few words."""

    words: tuple[str, ...]

    @property
    def permitted(self) -> str:
        return ", ".join(self.words)

    def __call__(self, value: Any) -> str:
        if value not in self.words:
            near = self.near(value)
            hint = "" if near is None else f" (did you mean {near!r}?)"
            raise Misuse(f"{value!r}{hint}: permitted are {self.permitted}")
        return value

    def near(self, value: object) -> str | None:
        """The word that was probably meant: the one in another case, or a near one."""
        if not isinstance(value, str):
            return None
        same = next((word for word in self.words if word.lower() == value.lower()), None)
        return same or NearMiss().of(value, self.words)


def word(*words: str) -> Word:
    return Word(words)


@permitting("0 and more, in us, ms, s, min or h")
def time_value(value: Any) -> int:
    return duration(value)


@permitting("more than 0, in us, ms, s, min or h")
def positive_time(value: Any) -> int:
    found = duration(value)
    if found == 0:
        raise Misuse(f"{value!r}: must be more than 0")
    return found


@permitting("1 s to 3600 s, whole seconds")
def whole_seconds(value: Any) -> int:
    """ns, of a time in seconds from 1 s to an hour."""
    found = duration(value)
    if not SECOND <= found <= 3600 * SECOND or found % SECOND:
        raise Misuse(f"{value!r}: permitted are whole seconds from 1s to 3600s")
    return found


@permitting("[low, high]")
def pair(value: Any) -> tuple[float, float]:
    if not isinstance(value, list) or len(value) != 2:
        raise Misuse(f"{value!r}: expected [low, high]")
    low, high = (number()(item) for item in value)
    if low >= high:
        raise Misuse(f"{value!r}: the first must be below the second")
    return low, high


@permitting("[[x, y], ...], x growing")
def points(value: Any) -> tuple[tuple[float, float], ...]:
    if not isinstance(value, list) or not value or any(not isinstance(item, list) or len(item) != 2 for item in value):
        raise Misuse(f"{value!r}: expected [[x, y], [x, y], ...]")
    found = tuple((number()(x), number()(y)) for x, y in value)
    if any(a[0] >= b[0] for a, b in pairwise(found)):
        raise Misuse(f"{value!r}: the first numbers must grow")
    return found


DIGITAL_INPUT, ANALOG_INPUT, OUTPUT = "digital input", "analog input", "output"
"""Kinds of terminals."""


@permitting("CONTROLLER.PIN")
def pin_name(value: Any) -> tuple[str, str]:
    """``CONTROLLER.PIN``."""
    controller, dot, pin = value.partition(".") if isinstance(value, str) else ("", "", "")
    if not dot or not controller or not pin:
        raise Misuse(f"{value!r}: expected CONTROLLER.PIN, such as 'table.IN3'")
    return controller, pin.upper()


_AXIS = re.compile(r"M([1-9][0-9]{0,3})\Z")


def axis_number(name: str) -> int:
    """The number of the axis ``M1``, ``M2`` and so on; 0 if this is not a name of an axis."""
    found = _AXIS.match(name)
    return int(found[1]) if found is not None else 0


@dataclass(frozen=True, slots=True)
class PinOf:
    """``CONTROLLER.PIN`` or ``ELEMENT.TERMINAL``, a terminal of a kind; a list of them where there may be several."""

    kind: str
    most: int = 1

    @property
    def permitted(self) -> str:
        there = f"{self.kind}: CONTROLLER.PIN" + ("" if self.kind == ANALOG_INPUT else " or ELEMENT.TERMINAL")
        return there if self.most == 1 else f"{there}, or a list of up to {self.most}"

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

    @property
    def permitted(self) -> str:
        return f"name of a {self.element}" if self.element[0] not in "aeiou" else f"name of an {self.element}"

    def __call__(self, value: Any) -> str:
        return name_value(value)


@naming_in_space("name of an element with a place in space")
def frame_name(value: Any) -> str:
    """The name of an element that carries others."""
    return name_value(value)


INPUT_PIN = PinOf(DIGITAL_INPUT)
OUTPUT_PIN = PinOf(OUTPUT)
"""Pin that drives an input."""
