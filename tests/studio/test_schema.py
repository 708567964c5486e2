"""The schema that is kept beside the docs, from which the types of the page are made."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from steptwin.studio.messages import MESSAGES
from steptwin.studio.requests import ALL, OF_CONNECTION, REQUESTS, permit_of
from steptwin.studio.schema import schema, text
from steptwin.subject.commands import COMMANDS

SCHEMA = Path(__file__).parents[2] / "docs" / "studio.schema.json"
PAGE = SCHEMA.with_name("studio-protocol.md")


def test_the_schema_that_is_kept_is_that_of_the_tables() -> None:
    """`python -m steptwin.studio.schema > docs/studio.schema.json` writes it."""
    assert SCHEMA.read_text("utf-8") == text()


def test_the_schema_has_what_the_tables_have() -> None:
    found: Any = schema()
    for name, row in ALL.items():
        request = found["$defs"][name]
        assert set(request["properties"]) == {"do", "id", "version", *(field.name for field in row.fields)}
        assert request["x-role"] == permit_of(name).role.title
        assert request["x-rest"] is (name not in OF_CONNECTION)
    for name in MESSAGES:
        assert {"seq", name} <= set(found["$defs"][f"{name} message"]["properties"])


def test_no_request_of_the_studio_is_a_command_of_a_subject() -> None:
    assert set(REQUESTS) & set(COMMANDS) == set()


def test_every_reference_leads_somewhere() -> None:
    found: Any = schema()
    references = set()

    def look(value: Any) -> None:
        if isinstance(value, dict):
            if isinstance(value.get("$ref"), str):
                references.add(unquote(value["$ref"].removeprefix("#/$defs/")))
            for one in value.values():
                look(one)
        elif isinstance(value, list):
            for one in value:
                look(one)

    look(json.loads(json.dumps(found)))
    assert references <= set(found["$defs"])
    assert {"(event)", "(description)", "(answer)"} <= references


def test_the_page_explains_every_request_and_message() -> None:
    page = PAGE.read_text("utf-8")
    assert [name for name in (*REQUESTS, *MESSAGES) if f"`{name}`" not in page and name != "renew"] == []
