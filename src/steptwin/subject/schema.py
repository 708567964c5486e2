"""JSON Schema of the messages of the control endpoint, made from the table of commands."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import fields
from typing import Any, get_type_hints

from steptwin.controllerstate import ControllerState
from steptwin.datasheet import Datasheet
from steptwin.fields import LONGEST_ID, Field
from steptwin.jsonvalues import MOMENT, TEXT, members, or_null, shape, with_sentences
from steptwin.simulation.script.command import CommandType
from steptwin.subject.commands import COMMANDS, VERSION
from steptwin.subject.contract import Description
from steptwin.subject.controls import ControlDescription
from steptwin.subject.payloads import PAYLOADS

DIALECT = "https://json-schema.org/draft/2020-12/schema"
_ID = {"type": ["string", "integer", "null"], "maxLength": LONGEST_ID, "description": "Comes back with the answer."}
_NUMBER = {"type": "integer", "minimum": 1, "description": "Commands and events are numbered together."}
_NUMBER_OF_EVENT = {**_NUMBER, "minimum": 0, "description": "Commands and events are numbered together; 0: a plan from before."}
_TEXT_OR_NULL = {"type": ["string", "null"]}


def schema() -> dict[str, object]:
    """Schema of requests, with those of answers and events under ``$defs``."""
    requests = {row.name: _request(row) for row in COMMANDS.values()}
    return {
        "$schema": DIALECT,
        "title": f"steptwin control endpoint, version {VERSION}: a request is one line of JSON",
        "oneOf": [{"$ref": f"#/$defs/{name}"} for name in COMMANDS],
        "$defs": {**requests, **definitions(), "(message)": _message()},
    }


def definitions() -> dict[str, dict[str, object]]:
    """Schemas of what is sent, by the names under which schemas of messages refer to it."""
    return {
        "(sentence)": _sentence(),
        "(answer)": _answer(),
        "(event)": _event(),
        "(description)": _description(),
        "(state)": _state(),
    }


def _sentence() -> dict[str, object]:
    """As `with_messages` writes it."""
    found = members({"id": TEXT, "values": {"type": "object"}})
    return {**found, "description": "A message without its text. A value with a text is a message itself."}


def _request(row: CommandType) -> dict[str, object]:
    return request_schema(row.name, f"{row.meaning} Answer: {row.answer}.", row.fields)


def request_schema(name: str, meaning: str, fields: Iterable[Field]) -> dict[str, object]:
    """Schema of a request with these fields."""
    fields = list(fields)
    properties = {field.name: _field_schema(field) for field in fields}
    return {
        "type": "object",
        "description": meaning,
        "properties": {"do": {"const": name}, "id": _ID, "version": {"const": VERSION}, **properties},
        "required": ["do", *(field.name for field in fields if field.is_required)],
        "additionalProperties": False,
    }


def _field_schema(field: Field) -> dict[str, object]:
    """Null is as if an optional field were not there."""
    schema = field.schema()
    if field.is_required:
        return schema
    described = schema.pop("description")
    return {**or_null(schema), "description": described}


def _answer() -> dict[str, object]:
    code = {"enum": ["misuse", "refusal", "failure", "internal"]}
    error = with_sentences({"code": code, "message": TEXT}, "message")
    return {
        "type": "object",
        "description": "Every request has exactly one.",
        "properties": {"id": _ID, "ok": {}, "number": _NUMBER, "time_ns": MOMENT, "error": error},
        "oneOf": [{"required": ["ok", "number", "time_ns"]}, {"required": ["error"]}],
    }


def _event() -> dict[str, object]:
    status = {"code": TEXT, "axis": _TEXT_OR_NULL, "facts": {"type": "object"}}
    own: Mapping[str, Any] = {kind: shape(payload)["properties"] for kind, payload in PAYLOADS.items() if kind != "status"}
    return {"oneOf": [_event_of(kind, own.get(kind, status)) for kind in PAYLOADS]}


def _event_of(kind: str, given: Mapping[str, object]) -> dict[str, object]:
    head = {"number": _NUMBER_OF_EVENT, "time_ns": MOMENT, "controller": {"type": "string"}, "kind": {"const": kind}}
    cause = {"type": ["integer", "null"], "minimum": 1, "description": "The command or the event that led to it."}
    text = {"type": "string", "description": "As text; it adds nothing to the rest."}
    shapes: Mapping[str, Any] = given
    words = [name for name in ("words", "what", "text") if shapes.get(name, text).get("type") == "string"]
    return with_sentences({**head, **given, "cause": cause, "text": text}, *words)


def _message() -> dict[str, object]:
    return {
        "type": "object",
        "description": "An event, after the answer to subscribe, with its id.",
        "properties": {"id": _ID, "event": {"$ref": "#/$defs/(event)"}, "missed": {"type": "integer", "minimum": 1}},
        "required": ["event"],
    }


def _description() -> dict[str, object]:
    """As `Description.to_json` writes it."""
    controller = with_sentences(
        {
            "name": TEXT,
            "datasheet": {"type": "integer", "minimum": 0, "description": "Index of its data sheet."},
            "line": _TEXT_OR_NULL,
            "unit": {"type": ["integer", "null"], "description": "Slave address, or address of a chip."},
            "controls": {
                "type": "array",
                "items": TEXT,
                "description": "Which of enable, move, home, jog, stop, program it takes.",
            },
            "takes": {
                "type": "array",
                "items": shape(ControlDescription),
                "description": "The same for each axis, and with axis null for the whole controller, with their arguments.",
            },
            "real": {"type": "boolean", "description": "A device: it gives samples instead of plans, and may move something."},
            "moved": {"type": "boolean", "description": "Encoders of it may turn without an event of it."},
            "no_twin": {
                "type": "string",
                "description": "Why a studio can put no twin beside this device; empty if it can while the device is at rest.",
            },
        },
        "no_twin",
    )
    own: Mapping[str, object] = {
        "controllers": {"type": "array", "items": controller},
        "datasheets": {"type": "array", "items": shape(Datasheet)},
    }
    hints = get_type_hints(Description)
    rest = {field.name: shape(hints[field.name]) for field in fields(Description) if field.name not in own}
    return {**members({**rest, **own}), "description": "What there is; another one when devices come or go."}


def _state() -> dict[str, object]:
    """The answer to ``state``."""
    return {**shape(ControllerState), "description": "What is not known is null. The data sheet describes the details."}


def text() -> str:
    """The schema as it is kept in the documentation."""
    return json.dumps(schema(), indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    print(text(), end="")  # noqa: T201  for programs in other languages: docs/control.md
