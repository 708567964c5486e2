"""Values in JSON, made from annotations: how a value of a type is written, read and described.

A dataclass and a named tuple are objects with their fields, an enumeration is its value, a tuple a list. ``Annotated`` says what
a type does not: a text is the description of a field, a `JsonForm` another form of its values, `UNWRITTEN` that JSON has no such
member.
"""

from __future__ import annotations

import enum
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cache, partial
from types import NoneType, UnionType
from typing import Annotated, Any, TypeAlias, TypeVar, Union, get_args, get_origin, get_type_hints

from steptwin.messages import read_message_text, with_messages

T = TypeVar("T")
Schema: TypeAlias = Mapping[str, object]
_Change: TypeAlias = "Callable[[Any], Any] | None"


@dataclass(frozen=True, slots=True, eq=False)
class JsonForm:
    """``schema`` of the values; ``to_json`` writes one, ``read`` is its reverse. None: it is the same in JSON."""

    schema: Schema
    read: _Change = None
    to_json: _Change = None


def to_json(value: Any) -> Any:
    """A value of a dataclass as JSON has values, or of another type whose form its value shows."""
    kind = type(value)
    if kind in _PLAIN:
        return value
    if _has_fields(kind):
        return _form_of_class(kind).to_json(value)  # pyrefly: ignore[not-callable]
    if isinstance(value, enum.Enum):
        return value.value
    if isinstance(value, Mapping):
        return {str(key): to_json(item) for key, item in value.items()}
    return [to_json(item) for item in value] if isinstance(value, tuple | list) else value


def _has_fields(kind: Any) -> bool:
    return is_dataclass(kind) or hasattr(kind, "_fields")


def read(kind: type[T], data: Any) -> T:
    """The value of a dataclass in JSON. Raises `TypeError`, `ValueError` or `LookupError` for what `to_json` does not give."""
    return _form_of_class(kind).read(data)  # pyrefly: ignore[not-callable]


def shape(kind: Any) -> dict[str, object]:
    """JSON Schema of a type. Raises `TypeError` for one that has no form in JSON."""
    return dict(form_of(kind).schema)


# ---------------------------------------------------------------------- schemas


TEXT: Schema = {"type": "string"}
WHOLE: Schema = {"type": "integer"}
NUMBER: Schema = {"type": "number"}
FLAG: Schema = {"type": "boolean"}
MOMENT: Schema = {"type": "string", "pattern": "^[0-9]{1,20}$", "description": "Virtual time, as decimal text [ns]"}


def or_null(schema: Schema) -> dict[str, object]:
    return {"anyOf": [schema, {"type": "null"}]}


def list_of(schema: Schema) -> dict[str, object]:
    return {"type": "array", "items": schema}


def members(properties: Mapping[str, object], *optional: str) -> dict[str, object]:
    """An object with exactly these members; those named may be absent."""
    return {
        "type": "object",
        "properties": dict(properties),
        "required": [name for name in properties if name not in optional],
        "additionalProperties": False,
    }


def with_sentences(properties: Mapping[str, object], *texts: str, lists: Iterable[str] = ()) -> dict[str, object]:
    """An object as `steptwin.messages.with_messages` writes it: the members ``texts`` and ``lists`` may be texts of messages."""
    sentence = {"$ref": "#/$defs/(sentence)"}
    several = {"type": "array", "items": {"anyOf": [sentence, {"type": "null"}]}}
    found: dict[str, object] = {**dict.fromkeys(texts, sentence), **dict.fromkeys(lists, several)}
    return members({**properties, "messages": members(found, *found)}, "messages")


# ---------------------------------------------------------------------- forms

Moment: TypeAlias = Annotated[int, JsonForm(MOMENT, int, str)]
"""Whole nanoseconds, which are decimal text in JSON."""
Hexadecimal: TypeAlias = Annotated[bytes, JsonForm(TEXT, bytes.fromhex, bytes.hex)]
_SENTENCE = JsonForm(TEXT)
Sentence: TypeAlias = Annotated[str, _SENTENCE]
"""The text of a message, which the page shows in its language: `steptwin.messages.with_messages`."""
UNWRITTEN = JsonForm({})
"""The annotation of a field that is no member in JSON."""

_PLAIN: Mapping[object, JsonForm] = {
    str: JsonForm(TEXT),
    int: JsonForm(WHOLE),
    float: JsonForm(NUMBER),
    bool: JsonForm(FLAG),
    NoneType: JsonForm({"type": "null"}),
    object: JsonForm({}),
}


def form_of(hint: Any) -> JsonForm:
    """The form of a type: plain types, enumerations, tuples, mappings, unions, dataclasses of them.

    Raises `TypeError` for another one.
    """
    origin, inner = get_origin(hint), get_args(hint)
    if origin is Annotated:
        form = next((one for one in inner[1:] if isinstance(one, JsonForm)), None) or form_of(inner[0])
        described = next((one for one in inner[1:] if isinstance(one, str)), None)
        return form if described is None else replace(form, schema={**form.schema, "description": described})
    if hint in _PLAIN:
        return _PLAIN[hint]
    if origin in (Union, UnionType):
        return _either([form_of(one) for one in inner], is_optional=NoneType in inner and len(inner) == 2)
    if origin in (tuple, list):
        return _list(form_of(inner[0]), origin)
    if origin is Mapping:
        return _table(inner[0], form_of(inner[1]))
    if isinstance(hint, type) and issubclass(hint, enum.Enum):
        return JsonForm({"enum": [one.value for one in hint]}, hint, lambda value: value.value)
    if _has_fields(hint):
        return _form_of_class(hint)
    raise TypeError(f"{hint} has no form in JSON")


def _either(forms: list[JsonForm], *, is_optional: bool) -> JsonForm:
    schema = {"anyOf": [one.schema for one in forms]}
    if is_optional:
        some = next(one for one in forms if one is not _PLAIN[NoneType])
        return JsonForm(schema, _unless_none(some.read), _unless_none(some.to_json))
    if all(one.to_json is None for one in forms):
        return JsonForm(schema)
    return JsonForm(schema, lambda value: tuple(value) if isinstance(value, list) else value, to_json)


def _unless_none(change: _Change) -> _Change:
    return None if change is None else lambda value: None if value is None else change(value)


def _list(item: JsonForm, kind: Any) -> JsonForm:
    one, write = item.read, item.to_json
    return JsonForm(
        list_of(item.schema),
        kind if one is None else lambda values: kind(map(one, values)),
        list if write is None else lambda values: list(map(write, values)),
    )


def _table(key: Any, item: JsonForm) -> JsonForm:
    one, write = item.read or _same, item.to_json or _same
    schema = {"type": "object", "additionalProperties": item.schema}
    if key is str and item.read is item.to_json is None:
        return JsonForm(schema, dict, dict)
    return JsonForm(
        schema,
        lambda table: {key(name): one(value) for name, value in table.items()},
        lambda table: {str(name): write(value) for name, value in table.items()},
    )


def _same(value: Any) -> Any:
    return value


@cache
def _form_of_class(kind: Any) -> JsonForm:
    hints = get_type_hints(kind, include_extras=True)
    names = [one.name for one in fields(kind)] if is_dataclass(kind) else kind._fields
    forms = {name: form for name in names if (form := form_of(hints[name])) is not UNWRITTEN}
    texts = [name for name, form in forms.items() if form is _SENTENCE]
    lists = [name for name in forms if hints[name] == tuple[Sentence, ...]]
    shape_of = partial(with_sentences, lists=lists) if texts or lists else members
    reads = [(name, form.read) for name, form in forms.items()]
    writes = [(name, form.to_json) for name, form in forms.items()]

    def write(value: Any) -> dict[str, Any]:
        found = {name: getattr(value, name) if to is None else to(getattr(value, name)) for name, to in writes}
        return with_messages(found) if texts or lists else found

    def read_fields(data: Mapping[str, Any]) -> Any:
        if "messages" in data:
            data = {**data, **{name: read_message_text(data, name) for name in data["messages"]}}
        return kind(**{name: data[name] if of is None else of(data[name]) for name, of in reads if name in data})

    return JsonForm(shape_of({name: form.schema for name, form in forms.items()}, *texts), read_fields, write)
