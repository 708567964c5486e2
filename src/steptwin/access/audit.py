"""The audit log: clients, commands and outcomes; the last entries are kept."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Protocol

from steptwin.access.roles import ROLES, Role
from steptwin.controller import Nanos
from steptwin.jsonvalues import JsonForm, Moment

MOST_ENTRIES = 10_000
LONGEST_FIELDS = 1000
"""Characters of the fields of an entry; of more the long values are left out."""
LONGEST_VALUE = 200


class Acting(Protocol):
    """Who gives commands: a viewer of the studio, or a client of a gateway. As text: the name, and where it is."""

    @property
    def role(self) -> Role | None:
        """None of one who proves no role that is known."""
        ...


class CommandLog(Protocol):
    """The audit log at the present moment of a subject."""

    def __call__(self, who: Acting, do: str, fields: Mapping[str, object], outcome: str, /) -> None: ...


@dataclass(frozen=True, slots=True)
class Entry:
    """A command of a client, and its outcome; ``sent`` where there is no answer."""

    at: Annotated[str, "Wall clock, ISO 8601."]
    time_ns: Moment
    viewer: str
    role: Annotated[str, JsonForm({"enum": ["none", *ROLES]})]
    do: str
    fields: Mapping[str, object]
    outcome: Annotated[str, JsonForm({"enum": ["done", "misuse", "refusal", "failure", "internal", "sent"]})]

    def __str__(self) -> str:
        return (
            f"{self.viewer}: {' '.join([self.do, *(f'{name}={value}' for name, value in self.fields.items())])}: {self.outcome}"
        )


def _short(value: object) -> object:
    """Value of a field for the log: texts that are too long, such as programs, are only counted."""
    text = str(value)
    return value if len(text) <= LONGEST_VALUE else f"({len(text)} characters)"


class Audit:
    """``clock`` gives the wall clock as text; ``sink`` is the first of `subscribers`, to keep entries elsewhere."""

    def __init__(self, clock: Callable[[], str], sink: Callable[[Entry], None] | None = None) -> None:
        self._entries: deque[Entry] = deque(maxlen=MOST_ENTRIES)
        self._clock = clock
        self.subscribers = [] if sink is None else [sink]
        """Called with every entry."""

    def add(self, viewer: Acting, time: Nanos, do: str, fields: Mapping[str, object], outcome: str) -> None:
        kept = fields if len(str(fields)) <= LONGEST_FIELDS else {name: _short(value) for name, value in fields.items()}
        role = "none" if viewer.role is None else viewer.role.title
        entry = Entry(self._clock(), time, str(viewer), role, do, kept, outcome)
        self._entries.append(entry)
        for subscriber in self.subscribers:
            subscriber(entry)

    def last(self, most: int) -> list[Entry]:
        """The newest last."""
        return list(self._entries)[-most:]
