"""What a viewer can ask for beside the commands of a subject: one table, and the reading of both.

A request is as at the control endpoint: ``{"do": NAME, FIELD: VALUE, ..., "id": ANY}``. The commands of a subject stand in
`steptwin.subject.commands`; `jog` has another answer here, because it is a lease.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

from steptwin.access.commands import PERMITS
from steptwin.access.roles import ACT, LOOK, ROLES, SERVICE, TAKE, Permit
from steptwin.diagnostics import Severity
from steptwin.errors import Misuse
from steptwin.machine import Nanos
from steptwin.messages import Message
from steptwin.nearmiss import NearMiss
from steptwin.plaintypes import shown
from steptwin.simulation.kinds.registry import KINDS as CONTROLLERS
from steptwin.studio.branchrequests import BRANCHES, BranchRequest
from steptwin.studio.campaignrequests import CAMPAIGNS, CampaignRequest
from steptwin.studio.devicerequests import OF_DEVICES, DeviceRequest
from steptwin.studio.drawingrequests import DRAWINGS, DrawingRequest
from steptwin.studio.plantrequests import PLANT, PlantRequest
from steptwin.studio.recordingrequests import RECORDINGS, RecordingRequest
from steptwin.studio.requestrow import NOTHING, RequestRow
from steptwin.studio.shapes import MOMENT
from steptwin.studio.toolrequests import TOOLS, ToolRequest
from steptwin.studio.workrequests import WORKS, WorkRequest
from steptwin.subject.commands import COMMANDS, CommandRow
from steptwin.subject.fields import FLAG, NAMES, PROGRAM, TEXT, TIME, Field, Schema, choices, number, read_fields, whole
from steptwin.subject.payloads import KINDS
from steptwin.subject.shapes import members

FASTEST_RATE = 30.0
"""Updates in a second of the wall clock."""
MOST_ENTRIES = 1000
"""Of the audit log in one answer."""

# ---------------------------------------------------------------------- the values


@dataclass(frozen=True, slots=True)
class Hello:
    """The first request of a viewer, with its token and name."""

    token: str | None = None
    name: str | None = None
    lang: str | None = None


@dataclass(frozen=True, slots=True)
class Resync:
    """Requests the whole state again."""


@dataclass(frozen=True, slots=True)
class WatchPoints:
    """Subscribes to the values of points."""

    points: tuple[str, ...]
    rate: float = 10.0


@dataclass(frozen=True, slots=True)
class Unwatch:
    watch: int


@dataclass(frozen=True, slots=True)
class TakeControl:
    """Takes control; with ``over`` also from another viewer."""

    over: bool = False


@dataclass(frozen=True, slots=True)
class ReleaseControl:
    """Releases control."""


@dataclass(frozen=True, slots=True)
class Renew:
    """Renews the lease of a jog."""

    lease: int


@dataclass(frozen=True, slots=True)
class LetGo:
    """Ends a jog."""

    lease: int


@dataclass(frozen=True, slots=True)
class ShowMoment:
    """Shows a moment of the past; None: the present."""

    moment: Nanos | None


@dataclass(frozen=True, slots=True)
class ReadPastEvents:
    """What happened between two moments of the past."""

    begin: Nanos
    end: Nanos
    kinds: tuple[str, ...] | None = None


@dataclass(frozen=True, slots=True)
class GoBack:
    """Returns the world itself to the moment that is shown."""


@dataclass(frozen=True, slots=True)
class ReadMemory:
    """Requests what a text takes of the memory at a place."""

    machine: str
    place: str
    text: str


@dataclass(frozen=True, slots=True)
class ReadTraffic:
    """Requests how much each line has carried."""


@dataclass(frozen=True, slots=True)
class ReadAudit:
    """Requests entries of the audit log."""

    most: int = 100


@dataclass(frozen=True, slots=True)
class ListPrograms:
    """Requests the list of program texts of controllers."""


@dataclass(frozen=True, slots=True)
class ReadProgram:
    """Requests one program text."""

    machine: str
    place: str


@dataclass(frozen=True, slots=True)
class ListPorts:
    """The serial ports of the computer on which the studio runs."""


@dataclass(frozen=True, slots=True)
class Connect:
    """Adds a device as a machine of the subject."""

    address: str
    name: str | None = None


@dataclass(frozen=True, slots=True)
class Disconnect:
    """Removes a device."""

    machine: str


StudioRequest: TypeAlias = (
    Hello
    | Resync
    | WatchPoints
    | Unwatch
    | TakeControl
    | ReleaseControl
    | Renew
    | LetGo
    | ShowMoment
    | ReadPastEvents
    | GoBack
    | ReadAudit
    | ReadTraffic
    | ReadMemory
    | ListPrograms
    | ReadProgram
    | ToolRequest
    | WorkRequest
    | RecordingRequest
    | BranchRequest
    | DrawingRequest
    | PlantRequest
    | CampaignRequest
    | DeviceRequest
    | ListPorts
    | Connect
    | Disconnect
)
"""Another kind of request is a class, its row here, and what does it in `steptwin.studio.session`."""

# ---------------------------------------------------------------------- the table


_TEXT: Schema = {"type": "string"}
_WHOLE: Schema = {"type": "integer"}
_LEASE = Field("lease", whole(1, 2**53), "The number in the answer to jog.")

LEASE: Schema = members({"lease": _WHOLE, "lasts_ms": {**_WHOLE, "description": "Renew it in a third of this. [ms]"}})
"""The answer to jog."""

_PROGRAM: Mapping[str, object] = {
    "machine": _TEXT,
    "place": {**_TEXT, "description": "Unlike all others of the machine, such as program 0."},
    "name": {**_TEXT, "description": "Of the file."},
    "language": {"enum": [language.name for kind in CONTROLLERS.values() for language in kind.languages]},
    "address": {**_TEXT, "description": "At the editor server."},
    "empty": {"type": "boolean", "description": "Whether nothing is there yet."},
    "running": {"type": "boolean"},
    "line": {
        "anyOf": [_WHOLE, {"type": "null"}],
        "description": "Of the present statement, from 1, while it runs or is paused; null where that is not known.",
    },
}
_FINDING: Schema = members(
    {
        **dict.fromkeys(("line", "column", "end_line", "end_column"), _WHOLE),
        "severity": {"enum": [one.value for one in Severity]},
        "code": _TEXT,
        "message": _TEXT,
        "hint": {"anyOf": [_TEXT, {"type": "null"}]},
    }
)

_EVENT: Schema = {"$ref": "#/$defs/(event)"}
_MOST: Schema = {"anyOf": [_WHOLE, {"type": "null"}], "description": "Null: the memory of the other parts limits it."}
_LINE = members(
    {
        "line": _TEXT,
        "clients": {**_WHOLE, "description": "Network connections, and serial ports and pseudo terminals that are open."},
        "requests": {**_WHOLE, "description": "Whole requests; of characters, lines."},
        "errors": {**_WHOLE, "description": "Exceptions and lost requests; of characters, those lost on the wire."},
        "unframed": {**_WHOLE, "description": "Bytes that belonged to no frame."},
    }
)

_ROWS = (
    RequestRow(
        "hello",
        Hello,
        LOOK,
        "The first request of a connection. Its answer is followed by the whole state.",
        members({"viewer": _WHOLE, "name": _TEXT, "role": {"enum": list(ROLES)}}),
        (
            Field("token", TEXT, "Where the studio asks for one.", None),
            Field("name", TEXT, "What others see.", None),
            Field("lang", TEXT, "Language of the page, such as en or pl.", None),
        ),
        is_of_connection=True,
    ),
    RequestRow("resync", Resync, LOOK, "The whole state once more, with seq 0.", NOTHING, is_of_connection=True),
    RequestRow(
        "watch",
        WatchPoints,
        LOOK,
        "Values of points, sent whenever they have changed.",
        members(
            {
                "watch": _WHOLE,
                "points": {
                    "type": "array",
                    "items": members({"point": _TEXT, "unit": _TEXT}),
                    "description": "In the order of their indices.",
                },
            }
        ),
        (
            Field("points", NAMES, "Points, as for read."),
            Field("rate", number(0.1, FASTEST_RATE), "At most this often.", 10.0, "1/s"),
        ),
        is_of_connection=True,
    ),
    RequestRow(
        "unwatch",
        Unwatch,
        LOOK,
        "No more values.",
        NOTHING,
        (Field("watch", whole(1, 2**53), "The number in the answer to watch."),),
        is_of_connection=True,
    ),
    RequestRow(
        "take_control",
        TakeControl,
        TAKE,
        "Take control. A viewer that acts while control is free takes it, too.",
        NOTHING,
        (Field("over", FLAG, "Also from a viewer who holds it.", False),),
    ),
    RequestRow("release_control", ReleaseControl, LOOK, "Hold control no more; jogs of this viewer end.", NOTHING),
    RequestRow("renew", Renew, ACT, "A jog goes on for as long as its lease lasts from now.", LEASE, (_LEASE,)),
    RequestRow("let_go", LetGo, LOOK, "A jog ends: its axis stops with its ramp.", NOTHING, (_LEASE,)),
    RequestRow(
        "look",
        ShowMoment,
        LOOK,
        "Look at a moment of the past while the world goes on. The message past and values of all watches follow. Until the "
        "present is looked at again, state, read, pins, encoders, faults and programs are of that moment, and nothing can be "
        "changed but by stop.",
        {"anyOf": [members({"time_ns": MOMENT, "from_ns": MOMENT}), {"type": "null"}]},
        (Field("to_ns", TIME, "Which moment; the present without.", None, "ns", "moment"),),
        is_of_connection=True,
    ),
    RequestRow(
        "past_events",
        ReadPastEvents,
        LOOK,
        "What happened between two moments of the past, at most a minute apart. plans, state and faults are those of the first "
        "moment. Of more than 10000 events the last ones, without these; from_ns is then the moment of the first event.",
        members(
            {
                "from_ns": MOMENT,
                "to_ns": MOMENT,
                "state": {"type": "object", "additionalProperties": {"$ref": "#/$defs/(state)"}, "description": "As in hello."},
                "faults": {"type": "array", "items": {"type": "object"}},
                "plans": {"type": "array", "items": _EVENT},
                "events": {"type": "array", "items": _EVENT},
            }
        ),
        (
            Field("from_ns", TIME, "The first moment, or the begin of the past that is kept.", unit="ns", attribute="begin"),
            Field("to_ns", TIME, "The last moment.", unit="ns", attribute="end"),
            Field("kinds", choices(KINDS, "kind of event"), "Kinds of events, as for follow.", None),
        ),
    ),
    RequestRow(
        "go_back",
        GoBack,
        ACT,
        "The world itself goes back to the moment that this viewer looks at; time stands there. What happened since is undone.",
        NOTHING,
        is_of_connection=True,
    ),
    RequestRow(
        "programs",
        ListPrograms,
        LOOK,
        "The program memories of controllers: each place, and what is there.",
        {"type": "array", "items": members(_PROGRAM)},
    ),
    RequestRow(
        "program_text",
        ReadProgram,
        LOOK,
        "One of these texts, with what the checker of its language finds in it.",
        members({**_PROGRAM, "text": _TEXT, "diagnostics": {"type": "array", "items": _FINDING}}),
        (Field("machine", TEXT, "Of a controller."), Field("place", TEXT, "As in the answer to programs.")),
    ),
    RequestRow(
        "program_memory",
        ReadMemory,
        LOOK,
        "What a text would take of the program memory at a place, and what is permitted. Empty for a text with errors.",
        {"type": "array", "items": members({"what": _TEXT, "used": _WHOLE, "most": _MOST, "unit": _TEXT})},
        (
            Field("machine", TEXT, "Of a controller."),
            Field("place", TEXT, "As in the answer to programs."),
            Field("text", PROGRAM, "The text; it is not downloaded."),
        ),
    ),
    RequestRow(
        "ports",
        ListPorts,
        LOOK,
        "The serial ports of the computer on which the studio runs, and the pseudo terminals of running twins.",
        {"type": "array", "items": members({"address": _TEXT, "what": _TEXT})},
    ),
    RequestRow(
        "connect",
        Connect,
        SERVICE,
        "A device becomes a machine here. Nothing moves by it, and no setting is changed.",
        members({"machine": _TEXT}),
        (
            Field("address", TEXT, "As after --device: /dev/ttyUSB0,unit=2, tcp://192.168.0.9,config=machine.cfg."),
            Field("name", TEXT, "Of the machine; its kind without one.", None),
        ),
    ),
    RequestRow(
        "disconnect",
        Disconnect,
        SERVICE,
        "A device is no machine here any more: jogs end, other motions and its program go on.",
        NOTHING,
        (Field("machine", TEXT, "Of a device."),),
    ),
    RequestRow(
        "traffic",
        ReadTraffic,
        LOOK,
        "How much each line of the world has carried since its beginning. Counted at present, also while the past is looked at.",
        members({"time_ns": MOMENT, "lines": {"type": "array", "items": _LINE}}),
    ),
    RequestRow(
        "audit",
        ReadAudit,
        SERVICE._replace(control=False),
        "Who did what, the newest last.",
        {
            "type": "array",
            "items": members(
                {
                    "at": {**_TEXT, "description": "Wall clock, ISO 8601."},
                    "time_ns": {**_TEXT, "description": "Virtual time, as decimal text [ns]"},
                    "viewer": _TEXT,
                    "role": {"enum": list(ROLES)},
                    "do": _TEXT,
                    "fields": {"type": "object"},
                    "outcome": {"enum": ["done", "misuse", "refusal", "failure", "internal"]},
                }
            ),
        },
        (Field("most", whole(1, MOST_ENTRIES), "Entries.", 100),),
    ),
)

REQUESTS: Mapping[str, RequestRow] = {
    row.name: row for row in (*_ROWS, *TOOLS, *WORKS, *RECORDINGS, *BRANCHES, *DRAWINGS, *PLANT, *CAMPAIGNS, *OF_DEVICES)
}
ALL: Mapping[str, RequestRow | CommandRow] = {**COMMANDS, **REQUESTS}
"""Every request by name."""
OF_THE_PAST = frozenset({"look", "go_back", "past_events"})
"""What needs a past that is kept."""
OF_RECORDINGS = frozenset(row.name for row in RECORDINGS)
"""What needs a world whose sessions are kept."""
OF_BRANCHES = frozenset(row.name for row in BRANCHES)
"""What needs a world."""
IN_THE_PAST = OF_THE_PAST | {"breakpoint", "clear_breakpoint", "stop_on", "step_program", "run", "look_at", "branch"}
"""What changes something and is possible while the past is looked at: a debugger goes forwards from there, too."""
OF_DRAWINGS = frozenset(row.name for row in DRAWINGS)
"""What needs a world."""
OF_PLANT = frozenset(row.name for row in PLANT)
"""What needs a world."""
WITH_TOKEN = frozenset({"connect", *(row.name for row in WORKS)})
"""Requests that reach devices, or describe them: they need a token also where nothing else does."""
OF_CAMPAIGNS = frozenset(row.name for row in CAMPAIGNS)
"""What needs a world of a file."""
OF_CONNECTION = frozenset({"follow", "unfollow", *(row.name for row in _ROWS if row.is_of_connection)})


UNKNOWN_REQUEST = Message("studio.unknown-request", "no request {name}{hint}; requests are {names}")


def check_name(name: str) -> None:
    """Raises `Misuse` for what is no request."""
    if name not in ALL:
        raise Misuse(UNKNOWN_REQUEST(name=shown(name), hint=NearMiss().hint(name, ALL), names=list(ALL)))


def read_request(row: RequestRow, given: Mapping[str, object]) -> StudioRequest:
    """The request of a row with fields as in JSON. Raises `Misuse`."""
    return row.kind(**read_fields(row.name, row.fields, given))


def permit_of(name: str) -> Permit:
    """What the request called ``name`` needs."""
    return REQUESTS[name].permit if name in REQUESTS else PERMITS[name]
