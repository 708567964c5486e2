"""JSON Schema of the messages of the control endpoint, made from the table of commands."""

from __future__ import annotations

import json

from steptwin.subject.commands import COMMANDS, VERSION, CommandRow
from steptwin.subject.events import KINDS
from steptwin.subject.fields import LONGEST_ID

DIALECT = "https://json-schema.org/draft/2020-12/schema"
_ID = {"type": ["string", "integer", "null"], "maxLength": LONGEST_ID, "description": "Comes back with the answer."}
_MOMENT = {"type": "string", "pattern": "^[0-9]{1,20}$", "description": "Virtual time, as decimal text [ns]"}
_NUMBER = {"type": "integer", "minimum": 1, "description": "Commands and events are numbered together."}


def schema() -> dict[str, object]:
    """Of requests, with those of answers and events under ``$defs``."""
    return {
        "$schema": DIALECT,
        "title": f"steptwin control endpoint, version {VERSION}: a request is one line of JSON",
        "oneOf": [{"$ref": f"#/$defs/{name}"} for name in COMMANDS],
        "$defs": {**{row.name: _request(row) for row in COMMANDS.values()}, "(answer)": _answer(), "(event)": _event()},
    }


def _request(row: CommandRow) -> dict[str, object]:
    fields = {field.name: _or_null(field.schema(), is_required=field.is_required) for field in row.fields}
    return {
        "type": "object",
        "description": f"{row.meaning} Answer: {row.answer}.",
        "properties": {"do": {"const": row.name}, "id": _ID, "version": {"const": VERSION}, **fields},
        "required": ["do", *(field.name for field in row.fields if field.is_required)],
        "additionalProperties": False,
    }


def _or_null(schema: dict[str, object], *, is_required: bool) -> dict[str, object]:
    """Null is as if the field were not there."""
    if is_required:
        return schema
    described = schema.pop("description")
    return {"anyOf": [schema, {"type": "null"}], "description": described}


def _answer() -> dict[str, object]:
    error = {
        "type": "object",
        "properties": {
            "code": {"enum": ["misuse", "refusal", "failure", "internal"]},
            "message": {"type": "string"},
        },
        "required": ["code", "message"],
    }
    return {
        "type": "object",
        "description": "Every request has exactly one.",
        "properties": {"id": _ID, "ok": {}, "number": _NUMBER, "time_ns": _MOMENT, "error": error},
        "oneOf": [{"required": ["ok", "number", "time_ns"]}, {"required": ["error"]}],
    }


def _event() -> dict[str, object]:
    event = {
        "type": "object",
        "properties": {
            "number": _NUMBER,
            "time_ns": _MOMENT,
            "machine": {"type": "string"},
            "kind": {"enum": list(KINDS)},
            "cause": {**_NUMBER, "type": ["integer", "null"], "description": "The command or the event that led to it."},
            "text": {"type": "string", "description": "As text; it adds nothing to the rest."},
        },
        "required": ["number", "time_ns", "machine", "kind", "cause", "text"],
    }
    return {
        "type": "object",
        "description": "After the answer to follow, with its id.",
        "properties": {"id": _ID, "event": event, "missed": {"type": "integer", "minimum": 1}},
        "required": ["event"],
    }


def text() -> str:
    """The schema as it is kept in the documentation."""
    return json.dumps(schema(), indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    print(text(), end="")  # noqa: T201  python -m steptwin.subject.schema > docs/control.schema.json
