"""Requests as annotated dataclasses: each attribute declares its field, from which it is read, checked, written and described::

    @dataclass(frozen=True)
    class Advance:
        duration: Annotated[Nanos | None, Meaning("How long.", TIME, unit="ns", name="for_ns")] = None

Moments and durations are whole nanoseconds as decimal text, which every JSON reader keeps exactly; a number is taken too.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from inspect import Parameter, signature
from math import inf
from operator import attrgetter
from types import NoneType
from typing import Annotated, Any, TypeAlias, get_args, get_origin, get_type_hints

from steptwin.datatypes import format_short
from steptwin.durations import LONGEST_NS
from steptwin.errors import Misuse
from steptwin.jsonvalues import Schema
from steptwin.messages import NONE, Message, text_of
from steptwin.nearmiss import NearMiss

LONGEST_TEXT = 4096
"""Characters of a text; the longest that are meant are paths."""
MOST_ITEMS = 1000
"""Most items of a list or a table."""
FASTEST, SLOWEST = 1000.0, 0.001
"""Virtual seconds in a second."""

MISSING: Any = dataclasses.MISSING
"""The default of a field that has to be given."""


@dataclass(frozen=True, slots=True)
class ValueType:
    """A type of value. ``read`` raises `Misuse`; ``to_json`` is its reverse; ``what`` is what is expected, in words."""

    what: str
    schema: Schema
    read: Callable[[Any], Any]
    to_json: Callable[[Any], Any] = lambda value: value


@dataclass(frozen=True, slots=True)
class Meaning:
    """The annotation of an attribute that is a field: its text for users, and what its type does not say.

    ``form``: how it is read; texts, flags, numbers and lists of names need none. ``name``: in JSON, where that is another one.
    """

    text: str
    form: ValueType | None = None
    unit: str = ""
    name: str | None = None


@dataclass(frozen=True, slots=True)
class Field:
    """A field of a request: its name in JSON, and ``key``, the attribute that has its value."""

    name: str
    form: ValueType
    meaning: str
    default: Any
    unit: str
    key: str

    @property
    def is_required(self) -> bool:
        return self.default is MISSING

    def schema(self) -> dict[str, object]:
        text = f"{self.meaning} [{self.unit}]" if self.unit else self.meaning
        return {**self.form.schema, "description": text}


def fields_of(kind: type) -> tuple[Field, ...]:
    """The fields of a dataclass or a named tuple.

    Raises `TypeError` for an attribute without a `Meaning`, one whose type needs a form, and one that may be None but has
    another default.
    """
    hints = get_type_hints(kind, include_extras=True)
    defaults = _defaults(kind)
    return tuple(_field(f"{kind.__name__}.{name}", name, hint, defaults[name]) for name, hint in hints.items())


def _defaults(kind: Any) -> Mapping[str, Any]:
    if not dataclasses.is_dataclass(kind):
        given = {name: one.default for name, one in signature(kind).parameters.items()}
        return {name: MISSING if default is Parameter.empty else default for name, default in given.items()}
    return {one.name: _default(one) for one in dataclasses.fields(kind)}


def _default(attribute: dataclasses.Field[Any]) -> Any:
    factory: Any = attribute.default_factory
    return attribute.default if factory is MISSING else factory()


def _field(place: str, key: str, hint: Any, default: Any) -> Field:
    inner, *notes = get_args(hint) if get_origin(hint) is Annotated else (hint,)
    meaning = next((one for one in notes if isinstance(one, Meaning)), None)
    if meaning is None:
        raise TypeError(f"{place} has no meaning")
    types = [one for one in get_args(inner) if one is not NoneType] if NoneType in get_args(inner) else [inner]
    if (types != [inner]) is not (default is None):
        raise TypeError(f"{place}: None is the default of what may be None, and of nothing else")
    form = meaning.form or _FORMS.get(types[0])
    if form is None:
        raise TypeError(f"{place} needs a form: {inner}")
    return Field(meaning.name or key, form, meaning.text, default, meaning.unit, key)


@dataclass(frozen=True, slots=True)
class RequestType:
    """A type of request: its name, its class with the fields of it, and its text for users."""

    name: str
    kind: Callable[..., Any]
    meaning: str
    fields: tuple[Field, ...]

    def read(self, given: Mapping[str, object]) -> Any:
        """The request with fields as in JSON. Raises `Misuse`."""
        return self.kind(**read_fields(self.name, self.fields, given))


UNKNOWN_FIELD = Message("fields.unknown-field", "{place}: no field {name}{hint}; fields are {names}")
FIELD_IS_MISSING = Message("fields.field-is-missing", "{place}: {name} is missing, expected {what}: {meaning}")
WRONG_FIELD = Message("fields.wrong-field", "{place}: {name}: {problem}")


def read_fields(place: str, fields: tuple[Field, ...], given: Mapping[str, object]) -> dict[str, Any]:
    """The values that are given, by attribute. Raises `Misuse` for unknown, missing and wrong fields, with ``place``."""
    known = list(map(attrgetter("name"), fields))
    for name in given:
        if name not in known:
            hint = NearMiss().hint(name, known)
            raise Misuse(UNKNOWN_FIELD(place=place, name=format_short(name), hint=hint, names=known or NONE()))
    values: dict[str, Any] = {}
    for field in fields:
        value = given.get(field.name)
        if value is None and field.default is MISSING:
            raise Misuse(FIELD_IS_MISSING(place=place, name=field.name, what=field.form.what, meaning=field.meaning))
        if value is None and (field.name not in given or field.default is None):
            continue
        try:
            values[field.key] = field.form.read(value)
        except Misuse as error:
            raise Misuse(WRONG_FIELD(place=place, name=field.name, problem=text_of(error))) from None
    return values


WRONG_VALUE = Message("fields.wrong-value", "{value}: expected {expected}")


def wrong(value: object, form: str) -> Misuse:
    return Misuse(WRONG_VALUE(value=format_short(value), expected=form))


# ---------------------------------------------------------------------- forms


_NUL_OR_SURROGATE, _SURROGATE = re.compile("[\0\ud800-\udfff]"), re.compile("[\ud800-\udfff]")
TEXT_TOO_LONG = Message("fields.text-too-long", "a text of {count} characters: permitted are at most {most}")
TEXT_HAS_NUL_OR_SURROGATES = Message("fields.text-has-nul-or-surrogates", "{value}: a text takes neither NUL nor surrogates")


def check_text(value: str) -> str:
    """Raises `Misuse` for a text that is too long, or has characters which no file name and no line takes."""
    if len(value) > LONGEST_TEXT:
        raise Misuse(TEXT_TOO_LONG(count=len(value), most=LONGEST_TEXT))
    if _NUL_OR_SURROGATE.search(value):
        raise Misuse(TEXT_HAS_NUL_OR_SURROGATES(value=format_short(value)))
    return value


def _text(value: Any) -> str:
    if not isinstance(value, str) or not value.strip():
        raise wrong(value, TEXT.what)
    return check_text(value)


A_TEXT = Message("fields.a-text", "a text")
TEXT = ValueType(A_TEXT(), {"type": "string", "minLength": 1, "maxLength": LONGEST_TEXT}, _text)


LONGEST_PROGRAM = 170_000
"""Characters of a program; the longest that are meant have 4000 lines."""


TEXT_HAS_SURROGATES = Message("fields.text-has-surrogates", "a text takes no surrogates")


def _program(value: Any) -> str:
    if not isinstance(value, str):
        raise wrong(value, PROGRAM.what)
    if len(value) > LONGEST_PROGRAM:
        raise Misuse(TEXT_TOO_LONG(count=len(value), most=LONGEST_PROGRAM))
    if _SURROGATE.search(value):
        raise Misuse(TEXT_HAS_SURROGATES())
    return value


PROGRAM = ValueType(A_TEXT(), {"type": "string", "maxLength": LONGEST_PROGRAM}, _program)


def _flag(value: Any) -> bool:
    if not isinstance(value, bool):
        raise wrong(value, FLAG.what)
    return value


TRUE_OR_FALSE = Message("fields.true-or-false", "true or false")
FLAG = ValueType(TRUE_OR_FALSE(), {"type": "boolean"}, _flag)


A_NUMBER = Message("fields.a-number", "a number from {least:g} to {most:g}")
A_WHOLE_NUMBER = Message("fields.a-whole-number", "a whole number from {least} to {most}")


def number(least: float = -1e300, most: float = 1e300) -> ValueType:
    """A finite number from ``least`` to ``most``."""
    what = A_NUMBER(least=least, most=most)

    def read(value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not least <= value <= most:
            raise wrong(value, what)
        return float(value)

    return ValueType(what, {"type": "number", "minimum": least, "maximum": most}, read)


def whole(least: int, most: int) -> ValueType:
    what = A_WHOLE_NUMBER(least=least, most=most)

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


NANOSECONDS = Message("fields.nanoseconds", "whole nanoseconds from 0 to {most}, as decimal text or a number")
TIME = ValueType(
    NANOSECONDS(most=LONGEST_NS),
    {"anyOf": [{"type": "string", "pattern": "^[0-9]{1,20}$"}, {"type": "integer", "minimum": 0, "maximum": LONGEST_NS}]},
    read_time,
    str,
)


def _names(value: Any) -> tuple[str, ...]:
    if not isinstance(value, list) or len(value) > MOST_ITEMS:
        raise wrong(value, NAMES.what)
    return tuple(map(_text, value))


TEXTS = Message("fields.texts", "a list of texts")
NAMES = ValueType(TEXTS(), {"type": "array", "items": TEXT.schema, "maxItems": MOST_ITEMS}, _names, list)


def choice(*words: str) -> ValueType:
    what = " or ".join(map(repr, words))

    def read(value: Any) -> str:
        if value not in words:
            raise wrong(value, what)
        return value

    return ValueType(what, {"enum": list(words)}, read)


A_LIST_OF = Message("fields.a-list-of", "a list of {what}s: {names}")
UNKNOWN_NAME = Message("fields.unknown-name", "no {what} {name}{hint}; there are {names}")


def choices(words: Iterable[str], what: str) -> ValueType:
    """A list of some of ``words``."""
    known = tuple(words)

    def read(value: Any) -> tuple[str, ...]:
        for name in _names(value):
            if name not in known:
                raise Misuse(
                    UNKNOWN_NAME(what=what, name=format_short(name), hint=NearMiss().hint(name, known), names=list(known))
                )
        return tuple(value)

    return ValueType(A_LIST_OF(what=what, names=list(known)), {"type": "array", "items": {"enum": list(known)}}, read, list)


LONGEST_ID = 200


def _id(value: Any) -> object:
    if isinstance(value, str) and 0 < len(value) <= LONGEST_ID and value.isprintable():
        return value
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) < 1 << 63:
        return value
    raise wrong(value, ID.what)


AN_ID = Message("fields.an-id", "a text of at most {most} characters, or a whole number below 2^63")
ID = ValueType(
    AN_ID(most=LONGEST_ID),
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


HEXADECIMAL = Message("fields.hexadecimal", "bytes as hexadecimal digits")
HEX = ValueType(HEXADECIMAL(), {"type": "string", "pattern": "^([0-9A-Fa-f]{2} ?)+$"}, _hex, lambda data: data.hex())


NO_8_BIT_CHARACTER = Message("fields.no-8-bit-character", "{text!r} is not an 8-bit character")


def _characters(value: Any) -> bytes:
    if not isinstance(value, str) or not 0 < len(value) <= LONGEST_DATA:
        raise wrong(value, CHARACTERS.what)
    try:
        return value.encode("latin-1")
    except UnicodeEncodeError as error:
        raise Misuse(NO_8_BIT_CHARACTER(text=value[error.start])) from None


ONE_BYTE_EACH = Message("fields.one-byte-each", "characters, one byte each")
CHARACTERS = ValueType(
    ONE_BYTE_EACH(),
    {"type": "string", "minLength": 1, "maxLength": LONGEST_DATA},
    _characters,
    lambda data: data.decode("latin-1"),
)


def _speed(value: Any) -> float:
    if value == "max":
        return inf
    if isinstance(value, bool) or not isinstance(value, int | float) or not SLOWEST <= value <= FASTEST:
        raise wrong(value, SPEED.what)
    return float(value)


A_SPEED = Message("fields.a-speed", "a number from {slowest:g} to {fastest:g}, or 'max'")
SPEED = ValueType(
    A_SPEED(slowest=SLOWEST, fastest=FASTEST),
    {"anyOf": [{"type": "number", "minimum": SLOWEST, "maximum": FASTEST}, {"const": "max"}]},
    _speed,
    lambda speed: "max" if speed == inf else speed,
)

_FORMS: Mapping[object, ValueType] = {str: TEXT, bool: FLAG, float: number(), tuple[str, ...]: NAMES}
"""By type, where it says all."""
AxisNumber: TypeAlias = Annotated[int, Meaning("The number of an axis.", whole(1, 64))]
ControllerName: TypeAlias = Annotated[str, Meaning("The name of a controller.")]
