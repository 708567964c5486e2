"""The fields of commands: type, unit, range; from JSON, to JSON, and as JSON Schema.

Moments and durations are whole nanoseconds as decimal text, which every JSON reader keeps exactly; a number is taken too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from math import inf
from typing import Any

from steptwin.durations import LONGEST_NS
from steptwin.errors import Misuse
from steptwin.nearmiss import NearMiss
from steptwin.plaintypes import shown
from steptwin.simulation.faults import Fault
from steptwin.simulation.faults import read as read_fault
from steptwin.simulation.toml.values import pin_name

LONGEST_TEXT = 4096
"""Characters of a text; the longest that are meant are paths."""
MOST_ITEMS = 1000
"""Of a list or a table."""
FASTEST, SLOWEST = 1000.0, 0.001
"""Virtual seconds in a second."""

MISSING: Any = object()
"""The default of a field that has to be given."""

Schema = Mapping[str, object]


@dataclass(frozen=True, slots=True)
class ValueType:
    """A type of value. ``read`` raises `Misuse`; ``plain`` is its reverse; ``what`` is what is expected, in words."""

    what: str
    schema: Schema
    read: Callable[[Any], Any]
    plain: Callable[[Any], Any] = lambda value: value


@dataclass(frozen=True, slots=True)
class Field:
    """``attribute``: its name in the command, where that is another one."""

    name: str
    form: ValueType
    meaning: str
    default: Any = MISSING
    unit: str = ""
    attribute: str | None = None

    @property
    def is_required(self) -> bool:
        return self.default is MISSING

    @property
    def key(self) -> str:
        return self.attribute or self.name

    def schema(self) -> dict[str, object]:
        text = f"{self.meaning} [{self.unit}]" if self.unit else self.meaning
        return {**self.form.schema, "description": text}


def read_fields(place: str, fields: Iterable[Field], given: Mapping[str, object]) -> dict[str, Any]:
    """The values of ``fields`` by attribute. Raises `Misuse` for unknown, missing and wrong ones, with ``place``."""
    fields = list(fields)
    known = [field.name for field in fields]
    for name in given:
        if name not in known:
            hint = NearMiss().hint(name, known)
            raise Misuse(f"{place}: no field {shown(name)}{hint}; fields are {', '.join(known) or 'none'}")
    values: dict[str, Any] = {}
    for field in fields:
        value = given.get(field.name)
        if value is None and field.is_required:
            raise Misuse(f"{place}: {field.name} is missing, expected {field.form.what}: {field.meaning}")
        if value is None and (field.name not in given or field.default is None):
            values[field.key] = field.default
            continue
        try:
            values[field.key] = field.form.read(value)
        except Misuse as error:
            raise Misuse(f"{place}: {field.name}: {error}") from None
    return values


def wrong(value: object, form: str) -> Misuse:
    return Misuse(f"{shown(value)}: expected {form}")


# ---------------------------------------------------------------------- forms


def check_text(value: str) -> str:
    """Raises `Misuse` for a text that is too long, or has characters which no file name and no line takes."""
    if len(value) > LONGEST_TEXT:
        raise Misuse(f"a text of {len(value)} characters: permitted are at most {LONGEST_TEXT}")
    if any(c == "\0" or "\ud800" <= c <= "\udfff" for c in value):
        raise Misuse(f"{shown(value)}: a text takes neither NUL nor surrogates")
    return value


def _text(value: Any) -> str:
    if not isinstance(value, str) or not value.strip():
        raise wrong(value, TEXT.what)
    return check_text(value)


TEXT = ValueType("a text", {"type": "string", "minLength": 1, "maxLength": LONGEST_TEXT}, _text)


LONGEST_PROGRAM = 170_000
"""Characters of a program; the longest that are meant have 4000 lines."""


def _program(value: Any) -> str:
    if not isinstance(value, str):
        raise wrong(value, PROGRAM.what)
    if len(value) > LONGEST_PROGRAM:
        raise Misuse(f"a text of {len(value)} characters: permitted are at most {LONGEST_PROGRAM}")
    if any("\ud800" <= c <= "\udfff" for c in value):
        raise Misuse("a text takes no surrogates")
    return value


PROGRAM = ValueType("a text", {"type": "string", "maxLength": LONGEST_PROGRAM}, _program)


def _flag(value: Any) -> bool:
    if not isinstance(value, bool):
        raise wrong(value, FLAG.what)
    return value


FLAG = ValueType("true or false", {"type": "boolean"}, _flag)


def number(least: float = -1e300, most: float = 1e300) -> ValueType:
    """A finite number from ``least`` to ``most``."""
    what = f"a number from {least:g} to {most:g}"

    def read(value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not least <= value <= most:
            raise wrong(value, what)
        return float(value)

    return ValueType(what, {"type": "number", "minimum": least, "maximum": most}, read)


def whole(least: int, most: int) -> ValueType:
    what = f"a whole number from {least} to {most}"

    def read(value: Any) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
            raise wrong(value, what)
        return value

    return ValueType(what, {"type": "integer", "minimum": least, "maximum": most}, read)


_DIGITS = 20


def read_time(value: Any) -> int:
    """Nanoseconds from JSON. Raises `Misuse`."""
    if isinstance(value, str) and len(value) <= _DIGITS and value.isascii() and value.isdigit():
        value = int(value)
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= LONGEST_NS:
        raise wrong(value, TIME.what)
    return value


TIME = ValueType(
    f"whole nanoseconds from 0 to {LONGEST_NS}, as decimal text or a number",
    {"anyOf": [{"type": "string", "pattern": "^[0-9]{1,20}$"}, {"type": "integer", "minimum": 0, "maximum": LONGEST_NS}]},
    read_time,
    str,
)


def _levels(value: Any) -> tuple[tuple[str, str, float], ...]:
    if not isinstance(value, dict) or not 0 < len(value) <= MOST_ITEMS:
        raise wrong(value, LEVELS.what)
    level = number()
    return tuple((*pin_name(check_text(name)), level.read(one)) for name, one in value.items())


LEVELS = ValueType(
    '{"MACHINE.NAME": NUMBER, ...}',
    {
        "type": "object",
        "minProperties": 1,
        "maxProperties": MOST_ITEMS,
        "additionalProperties": {"type": "number"},
        "propertyNames": {"pattern": "^[^.]+[.].+$", "maxLength": LONGEST_TEXT},
    },
    _levels,
    lambda levels: {f"{machine}.{name}": value for machine, name, value in levels},
)


def _names(value: Any) -> tuple[str, ...]:
    if not isinstance(value, list) or len(value) > MOST_ITEMS:
        raise wrong(value, NAMES.what)
    return tuple(map(_text, value))


NAMES = ValueType("a list of texts", {"type": "array", "items": TEXT.schema, "maxItems": MOST_ITEMS}, _names, list)


def choice(*words: str) -> ValueType:
    what = " or ".join(map(repr, words))

    def read(value: Any) -> str:
        if value not in words:
            raise wrong(value, what)
        return value

    return ValueType(what, {"enum": list(words)}, read)


def choices(words: Iterable[str], what: str) -> ValueType:
    """A list of some of ``words``."""
    known = tuple(words)

    def read(value: Any) -> tuple[str, ...]:
        for name in _names(value):
            if name not in known:
                raise Misuse(f"no {what} {shown(name)}{NearMiss().hint(name, known)}; there are {', '.join(known)}")
        return tuple(value)

    return ValueType(f"a list of {what}s: {', '.join(known)}", {"type": "array", "items": {"enum": list(known)}}, read, list)


LONGEST_ID = 200


def _id(value: Any) -> object:
    if isinstance(value, str) and 0 < len(value) <= LONGEST_ID and value.isprintable():
        return value
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) < 1 << 63:
        return value
    raise wrong(value, ID.what)


ID = ValueType(
    f"a text of at most {LONGEST_ID} characters, or a whole number below 2^63",
    {"type": ["string", "integer"], "minLength": 1, "maxLength": LONGEST_ID},
    _id,
)
LONGEST_DATA = 4096


def _hex(value: Any) -> bytes:
    try:
        data = bytes.fromhex(value) if isinstance(value, str) and len(value) <= 3 * LONGEST_DATA else None
    except ValueError:
        data = None
    if not data:
        raise wrong(value, HEX.what)
    return data


HEX = ValueType(
    "bytes as hexadecimal digits", {"type": "string", "pattern": "^([0-9A-Fa-f]{2} ?)+$"}, _hex, lambda data: data.hex()
)


def _characters(value: Any) -> bytes:
    if not isinstance(value, str) or not 0 < len(value) <= LONGEST_DATA:
        raise wrong(value, CHARACTERS.what)
    try:
        return value.encode("latin-1")
    except UnicodeEncodeError as error:
        raise Misuse(f"{value[error.start]!r} is not an 8-bit character") from None


CHARACTERS = ValueType(
    "characters, one byte each",
    {"type": "string", "minLength": 1, "maxLength": LONGEST_DATA},
    _characters,
    lambda data: data.decode("latin-1"),
)


def _fault(value: Any) -> Fault:
    return read_fault(_text(value))


FAULT = ValueType("a fault such as 'crc unit=1 nth=3'", TEXT.schema, _fault, str)


def _speed(value: Any) -> float:
    if value == "max":
        return inf
    if isinstance(value, bool) or not isinstance(value, int | float) or not SLOWEST <= value <= FASTEST:
        raise wrong(value, SPEED.what)
    return float(value)


SPEED = ValueType(
    f"a number from {SLOWEST:g} to {FASTEST:g}, or 'max'",
    {"anyOf": [{"type": "number", "minimum": SLOWEST, "maximum": FASTEST}, {"const": "max"}]},
    _speed,
    lambda speed: "max" if speed == inf else speed,
)
