"""JSON Schema of frozen dataclasses as `steptwin.datasheet.plain` writes them, made from their annotations."""

from __future__ import annotations

import enum
import types
from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from typing import Any, Union, get_args, get_origin, get_type_hints

from steptwin.fields import Schema

TEXT: Schema = {"type": "string"}
WHOLE: Schema = {"type": "integer"}
NUMBER: Schema = {"type": "number"}
FLAG: Schema = {"type": "boolean"}
MOMENT: Schema = {"type": "string", "pattern": "^[0-9]{1,20}$", "description": "Virtual time, as decimal text [ns]"}

_PLAIN: Mapping[object, dict[str, object]] = {
    str: {"type": "string"},
    int: {"type": "integer"},
    float: {"type": "number"},
    bool: {"type": "boolean"},
    type(None): {"type": "null"},
}


def shape(kind: Any) -> dict[str, object]:
    """Schema of the type ``kind``: plain types, enumerations, tuples of one type, mappings, unions, dataclasses of them.

    Raises `TypeError` for another one.
    """
    if kind in _PLAIN:
        return dict(_PLAIN[kind])
    origin, inner = get_origin(kind), get_args(kind)
    if origin in (Union, types.UnionType):
        return {"anyOf": [shape(one) for one in inner]}
    if origin is tuple:
        return {"type": "array", "items": shape(inner[0])}
    if origin is Mapping:
        return {"type": "object", "additionalProperties": shape(inner[1])}
    if isinstance(kind, type) and issubclass(kind, enum.Enum):
        return {"enum": [one.value for one in kind]}
    if not is_dataclass(kind):
        raise TypeError(f"{kind} has no shape in JSON")
    hints = get_type_hints(kind)
    names = [field.name for field in fields(kind)]
    return members({name: shape(hints[name]) for name in names})


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
