"""Declaration of the requests of a viewer, and of their fields (`steptwin.fields`)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

from steptwin.access.roles import Permit
from steptwin.fields import RequestType, fields_of
from steptwin.jsonvalues import JsonForm, form_of

_Kind = TypeVar("_Kind")


@dataclass(frozen=True, slots=True)
class ViewerRequestType(RequestType):
    """A request of a viewer: what it needs, and the form of its answer in JSON."""

    permit: Permit
    answer: JsonForm
    is_of_connection: bool
    """Whether it is about what is sent to its connection, and so means nothing over REST."""


_TYPES: dict[object, ViewerRequestType] = {}


def request(
    name: str, permit: Permit, meaning: str, answer: Any = None, *, is_of_connection: bool = False
) -> Callable[[type[_Kind]], type[_Kind]]:
    """Declares a request: a dataclass whose attributes are its fields. ``answer``: the type of the value in its answer.

    Raises `TypeError` as `fields_of` and `steptwin.jsonvalues.form_of`.
    """

    form = form_of(type(None) if answer is None else answer)

    def declare(kind: type[_Kind]) -> type[_Kind]:
        _TYPES[kind] = ViewerRequestType(name, kind, meaning, fields_of(kind), permit, form, is_of_connection)
        return kind

    return declare


def declared(kind: type) -> ViewerRequestType:
    """The declaration of a class of requests. Raises `KeyError` for one that has none."""
    return _TYPES[kind]
