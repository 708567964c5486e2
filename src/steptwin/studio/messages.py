"""Messages that the studio sends without being asked: one table of messages with their members."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from steptwin.access.roles import ROLES
from steptwin.fields import Schema
from steptwin.jsonvalues import FLAG, MOMENT, NUMBER, TEXT, WHOLE, list_of, members, or_null, shape
from steptwin.subject.commands import VERSION
from steptwin.subject.scene import WorkpieceState
from steptwin.subject.standing import StandingState

_COUNT: Schema = {"type": "integer", "minimum": 0}
SPEED: Schema = {
    "anyOf": [NUMBER, {"const": "max"}],
    "description": "Virtual seconds in a second; the one at which time will be resumed while it is paused.",
}


CONTROL = or_null(members({"viewer": WHOLE, "name": TEXT}))
LEASES: Schema = {
    "type": "array",
    "items": members(
        {
            "lease": WHOLE,
            "viewer": WHOLE,
            "controller": TEXT,
            "axis": WHOLE,
            "velocity": {**NUMBER, "description": "[units of the data sheet/s]"},
        }
    ),
}
EVENTS: Schema = {"type": "array", "items": {"$ref": "#/$defs/(event)"}}
_MAY: Schema = list_of(TEXT)
_PRESENT: Mapping[str, Schema] = {
    "state": {
        "type": "object",
        "additionalProperties": {"$ref": "#/$defs/(state)"},
        "description": "By controller, as the answer to state; empty for a device.",
    },
    "faults": {"type": "array", "items": {"type": "object"}, "description": "As the answer to faults."},
    "plans": {"type": "array", "items": {"$ref": "#/$defs/(event)"}, "description": "Present plans of all axes."},
    "workpieces": list_of(shape(WorkpieceState)),
    "standing": list_of(shape(StandingState)),
}
CLOCK = members({"time_ns": MOMENT, "running": FLAG, "speed": SPEED})


@dataclass(frozen=True, slots=True)
class MessageRow:
    """A message: the member that it is known by, what that is, and the other members but ``seq``."""

    name: str
    meaning: str
    content: Schema
    others: Mapping[str, Schema] = field(default_factory=dict)

    def schema(self) -> dict[str, object]:
        seq = {**_COUNT, "description": "Counts the messages to this viewer from hello on, which has 0."}
        found = members({"seq": seq, **self.others, self.name: self.content})
        return {**found, "description": self.meaning}


_ROWS = (
    MessageRow(
        "hello",
        "The whole state, after hello and resync.",
        members(
            {
                "version": {"const": VERSION},
                "program": {**TEXT, "description": "Version of steptwin."},
                "viewer": {**WHOLE, "description": "Number of this viewer."},
                "name": TEXT,
                "role": {"enum": list(ROLES)},
                "may": {**_MAY, "description": "Names of requests that can be done here by this role."},
                "with_token": {**_MAY, "description": "Names of requests for which this viewer would have to give a token."},
                "control": CONTROL,
                "viewers": {**_COUNT, "description": "How many there are."},
                "leases": LEASES,
                "number": {**_COUNT, "description": "Events with greater numbers are news."},
                "time_ns": MOMENT,
                "pace": members({"running": FLAG, "speed": SPEED}),
                "virtual": {
                    "type": "boolean",
                    "description": "Whether all controllers are twins; a device gives samples, not plans.",
                },
                "device_kinds": {
                    "type": "array",
                    "items": members(
                        {
                            "kind": {**TEXT, "description": "As in an address: kind=m1486."},
                            "model": TEXT,
                            "options": {**TEXT, "description": "Of an address, such as unit=N, config=FILE."},
                            "is_searched": {"type": "boolean", "description": "Whether scan can search for it."},
                        }
                    ),
                    "description": "Kinds of devices that connect and scan take; an address without a kind is of the first one.",
                },
                "description": {"$ref": "#/$defs/(description)"},
                **_PRESENT,
                "events": {**EVENTS, "description": "The newest that people read, the oldest of them first."},
                "events_from_ns": {**MOMENT, "description": "From when on these are all that there were. [ns]"},
            }
        ),
    ),
    MessageRow(
        "events",
        "What has happened, of what the viewer subscribes to; each event once.",
        EVENTS,
        {"time_ns": MOMENT, "missed": {**_COUNT, "description": "Events before these that were dropped."}},
    ),
    MessageRow(
        "values",
        "By the number of a watch as text: [index, value] of the points that have changed; null for unknown.",
        {
            "type": "object",
            "additionalProperties": {
                "type": "array",
                "items": {
                    "type": "array",
                    "prefixItems": [WHOLE, {"type": ["number", "null"]}],
                    "minItems": 2,
                    "maxItems": 2,
                },
            },
        },
        {"time_ns": MOMENT},
    ),
    MessageRow("clock", "The present moment: once a second, and whenever time is paused or resumed.", CLOCK),
    MessageRow(
        "past",
        "The moment of the past that is shown to this viewer from now on; null for the present. Events go on as they happen.",
        or_null(
            members(
                {
                    "time_ns": MOMENT,
                    "from_ns": {**MOMENT, "description": "The oldest moment that is kept. [ns]"},
                    "may": {**_MAY, "description": "Names of requests that can be done while the past is shown."},
                    **_PRESENT,
                }
            )
        ),
    ),
    MessageRow("control", "Who holds control from now on.", CONTROL),
    MessageRow("viewers", "How many viewers there are now.", _COUNT),
    MessageRow("leases", "The jogs that are held now.", LEASES),
    MessageRow(
        "workpieces",
        "The workpieces in space, after any came, went or was carried by something else.",
        list_of(shape(WorkpieceState)),
    ),
    MessageRow(
        "standing",
        "What stands now, after any change: programs that wait, alarms, elements, faults, gateways that are not up.",
        list_of(shape(StandingState)),
    ),
    MessageRow("lost", "The connection to the device is lost, and why; null when it is there again.", or_null(TEXT)),
)

MESSAGES: Mapping[str, MessageRow] = {row.name: row for row in _ROWS}
