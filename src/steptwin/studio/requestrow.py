"""A request of a viewer, as a row of the table of requests (`steptwin.studio.requests`)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from steptwin.access.roles import Permit
from steptwin.subject.fields import Field, Schema

NOTHING: Schema = {"type": "null"}


@dataclass(frozen=True, slots=True)
class RequestRow:
    """A request: its name, its class, what it needs, its fields, and the schema of its answer."""

    name: str
    kind: Callable[..., Any]
    permit: Permit
    meaning: str
    answer: Schema
    fields: tuple[Field, ...] = ()
    is_of_connection: bool = False
    """Whether it is about what is sent to its connection, and so means nothing over REST."""
