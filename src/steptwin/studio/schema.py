"""JSON Schema of everything that goes over the WebSocket of the studio, made from the tables of requests and messages."""

from __future__ import annotations

import json

from steptwin.fields import Field
from steptwin.jsonvalues import shape
from steptwin.studio.messages import MESSAGES
from steptwin.studio.requests import OF_CONNECTION, REQUESTS, LeaseTerm, permit_of
from steptwin.subject.commands import COMMANDS, VERSION
from steptwin.subject.schema import DIALECT, definitions, request_schema


def schema() -> dict[str, object]:
    """Schema of what the studio sends. Under ``$defs`` are requests by their name, their answers as ``NAME answer``, messages as
    ``NAME message``."""
    defs = definitions()
    requests = {name: _request(name) for name in (*COMMANDS, *REQUESTS)}
    answers = {f"{name} answer": answer for name, answer in answer_schemas().items()}
    messages = {f"{row.name} message": row.schema() for row in MESSAGES.values()}
    return {
        "$schema": DIALECT,
        "title": f"steptwin studio, version {VERSION}: a message is a JSON text",
        "anyOf": [{"$ref": "#/$defs/(answer)"}, *({"$ref": f"#/$defs/{name.replace(' ', '%20')}"} for name in messages)],
        "$defs": {
            "(request)": {"oneOf": [{"$ref": f"#/$defs/{name}"} for name in requests]},
            **{name: defs[name] for name in ("(sentence)", "(answer)", "(event)", "(description)", "(state)")},
            **requests,
            **answers,
            **messages,
        },
    }


def _request(name: str) -> dict[str, object]:
    row = REQUESTS.get(name)
    meaning, fields = (row.meaning, row.fields) if row is not None else _of_subject(name)
    permit = permit_of(name)
    found = request_schema(name, meaning, fields)
    if name == "hello":
        found = {**found, "required": ["do", "version"]}
    return {**found, "x-role": permit.role.title, "x-control": permit.control, "x-rest": name not in OF_CONNECTION}


def _of_subject(name: str) -> tuple[str, tuple[Field, ...]]:
    row = COMMANDS[name]
    meaning = f"{row.meaning} Answer: {row.answer}."
    return (f"{row.meaning} A lease, which has to be renewed." if name == "jog" else meaning), row.fields


def answer_schemas() -> dict[str, object]:
    """Schemas of the answers to requests; those of other commands of a subject are described in words."""
    return {"jog": shape(LeaseTerm), **{row.name: row.answer.schema for row in REQUESTS.values()}}


def text() -> str:
    """The schema as it is kept in the documentation."""
    return json.dumps(schema(), indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    print(text(), end="")  # noqa: T201  python -m steptwin.studio.schema > docs/studio.schema.json
