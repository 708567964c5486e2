"""Requests of viewers beside the commands of a subject, and the reading of both.

A request is as at the control endpoint: ``{"do": NAME, FIELD: VALUE, ..., "id": ANY}``. The commands of a subject stand in
`steptwin.subject.commands`; `jog` has another answer here, because it is a lease.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, TypeAlias, get_args

from steptwin.access.audit import Entry
from steptwin.access.commands import PERMITS
from steptwin.access.roles import ACT, LOOK, ROLES, SERVICE, TAKE, Permit
from steptwin.controller import Nanos
from steptwin.datatypes import format_short
from steptwin.errors import Misuse
from steptwin.explain.model import MemoryUse
from steptwin.fields import PROGRAM, TIME, Meaning, RequestType, choices, number, whole
from steptwin.jsonvalues import TEXT, JsonForm, Moment, list_of, members, shape
from steptwin.messages import Message
from steptwin.nearmiss import NearMiss
from steptwin.simulation.world.worldprograms import ShownProgram, ShownProgramText
from steptwin.studio.branchrequests import BranchRequest, PlaceRequest
from steptwin.studio.campaignrequests import CampaignRequest, ChangeCampaign
from steptwin.studio.devicerequests import DeviceRequest
from steptwin.studio.drawingrequests import DrawingRequest
from steptwin.studio.recordingrequests import RecordingFileRequest, RecordingRequest
from steptwin.studio.requesttype import ViewerRequestType, declared, request
from steptwin.studio.servicerequests import ServiceRequest
from steptwin.studio.toolrequests import ToolRequest
from steptwin.studio.workrequests import WorkRequest
from steptwin.subject.commands import COMMANDS
from steptwin.subject.payloads import KINDS
from steptwin.subject.scene import WorkpieceState
from steptwin.subject.standing import StandingState

FASTEST_RATE = 30.0
"""Updates in a second of the wall clock."""
MOST_ENTRIES = 1000
"""Most entries of the audit log in one answer."""


@dataclass(frozen=True, slots=True)
class LeaseTerm:
    """The answer to jog."""

    lease: int
    lasts_ms: Annotated[int, "Renew it in a third of this. [ms]"]


@dataclass(frozen=True, slots=True)
class EnteredViewer:
    """The viewer of a connection."""

    viewer: int
    name: str
    role: Annotated[str, JsonForm({"enum": list(ROLES)})]


@dataclass(frozen=True, slots=True)
class WatchedPoint:
    point: str
    unit: str


@dataclass(frozen=True, slots=True)
class Watch:
    """A number of points whose values are sent."""

    watch: int
    points: Annotated[tuple[WatchedPoint, ...], "In the order of their indices."]


@dataclass(frozen=True, slots=True)
class KeptMoment:
    """A moment of the past that is shown, and the oldest that is kept."""

    time_ns: Moment
    from_ns: Moment


_EVENTS: TypeAlias = Annotated[Sequence[Mapping[str, object]], JsonForm(list_of({"$ref": "#/$defs/(event)"}))]


@dataclass(frozen=True, slots=True)
class PastEvents:
    """Events between two moments of the past."""

    from_ns: Moment
    to_ns: Moment
    state: Annotated[
        Mapping[str, object],
        JsonForm({"type": "object", "additionalProperties": {"$ref": "#/$defs/(state)"}}),
        "As in hello.",
    ]
    faults: Annotated[Sequence[Mapping[str, object]], JsonForm(list_of({"type": "object"}))]
    workpieces: Annotated[Sequence[Mapping[str, object]], JsonForm(list_of(shape(WorkpieceState)))]
    standing: Annotated[Sequence[Mapping[str, object]], JsonForm(list_of(shape(StandingState)))]
    plans: _EVENTS
    events: _EVENTS


_Port: TypeAlias = Annotated[Mapping[str, object], JsonForm(members({"address": TEXT, "what": TEXT}))]


@dataclass(frozen=True, slots=True)
class ConnectedDevice:
    controller: str


@dataclass(frozen=True, slots=True)
class LineUse:
    """Traffic of a line since its beginning."""

    line: str
    clients: Annotated[int, "Network connections, and serial ports and pseudo terminals that are open."]
    requests: Annotated[int, "Whole requests; of characters, lines."]
    errors: Annotated[int, "Exceptions and lost requests; of characters, those lost on the wire."]
    unframed: Annotated[int, "Bytes that belonged to no frame."]


@dataclass(frozen=True, slots=True)
class WorldTraffic:
    """Traffic of all lines up to a moment."""

    time_ns: Moment
    lines: tuple[LineUse, ...]


_Lease: TypeAlias = Annotated[int, Meaning("The number in the answer to jog.", whole(1, 2**53))]


@request(
    "hello",
    LOOK,
    "The first request of a connection. Its answer is followed by the whole state.",
    EnteredViewer,
    is_of_connection=True,
)
@dataclass(frozen=True, slots=True)
class Hello:
    token: Annotated[str | None, Meaning("Where the studio asks for one.")] = None
    name: Annotated[str | None, Meaning("What others see.")] = None
    lang: Annotated[str | None, Meaning("Language of the page, such as en or pl.")] = None
    kinds: Annotated[
        tuple[str, ...] | None,
        Meaning(
            "Kinds of events that are sent until the connection ends: all that the whole state does not have yet. Before a later "
            "subscribe some would be lost.",
            choices(KINDS, "kind of event"),
        ),
    ] = None


@request("resync", LOOK, "The whole state once more, with seq 0.", is_of_connection=True)
@dataclass(frozen=True, slots=True)
class Resync:
    pass


@request(
    "watch",
    LOOK,
    "Values of points, sent whenever they have changed.",
    Watch,
    is_of_connection=True,
)
@dataclass(frozen=True, slots=True)
class WatchPoints:
    points: Annotated[tuple[str, ...], Meaning("Points, as for read.")]
    rate: Annotated[float, Meaning("At most this often.", number(0.1, FASTEST_RATE), unit="1/s")] = 10.0


@request("unwatch", LOOK, "No more values.", is_of_connection=True)
@dataclass(frozen=True, slots=True)
class Unwatch:
    watch: Annotated[int, Meaning("The number in the answer to watch.", whole(1, 2**53))]


@request("take_control", TAKE, "Take control. A viewer that acts while control is free takes it, too.")
@dataclass(frozen=True, slots=True)
class TakeControl:
    over: Annotated[bool, Meaning("Also from a viewer who holds it.")] = False


@request("release_control", LOOK, "Hold control no more; jogs of this viewer end.")
@dataclass(frozen=True, slots=True)
class ReleaseControl:
    pass


@request("renew", ACT, "A jog goes on for as long as its lease lasts from now.", LeaseTerm)
@dataclass(frozen=True, slots=True)
class Renew:
    lease: _Lease


@request("let_go", LOOK, "A jog ends: its axis stops with its ramp.")
@dataclass(frozen=True, slots=True)
class LetGo:
    lease: _Lease


@request(
    "show_moment",
    LOOK,
    "Show a moment of the past to this viewer while the world goes on. The message past and values of all watches follow. "
    "Until the present is shown again, state, read, pins, encoders, faults and programs are of that moment, and nothing can "
    "be changed but by stop.",
    KeptMoment | None,
    is_of_connection=True,
)
@dataclass(frozen=True, slots=True)
class ShowMoment:
    moment: Annotated[Nanos | None, Meaning("Which moment; the present without.", TIME, unit="ns", name="to_ns")] = None


@request(
    "past_events",
    LOOK,
    "What happened between two moments of the past, at most a minute apart. plans, state and faults are those of the first "
    "moment. Of more than 10000 events the last ones, without these; from_ns is then the moment of the first event.",
    PastEvents,
)
@dataclass(frozen=True, slots=True)
class ReadPastEvents:
    begin: Annotated[Nanos, Meaning("The first moment, or the begin of the past that is kept.", TIME, unit="ns", name="from_ns")]
    end: Annotated[Nanos, Meaning("The last moment.", TIME, unit="ns", name="to_ns")]
    kinds: Annotated[tuple[str, ...] | None, Meaning("Kinds of events, as for subscribe.", choices(KINDS, "kind of event"))] = (
        None
    )


@request(
    "go_back",
    ACT,
    "The world itself goes back to the moment that is shown to this viewer; time stands there. What happened since is undone.",
    is_of_connection=True,
)
@dataclass(frozen=True, slots=True)
class GoBack:
    pass


@request(
    "programs",
    LOOK,
    "The program memories of controllers: each place, and what is there.",
    tuple[ShownProgram, ...],
)
@dataclass(frozen=True, slots=True)
class ListPrograms:
    pass


@request(
    "program_text",
    LOOK,
    "One of these texts, with what the checker of its language finds in it.",
    ShownProgramText,
)
@dataclass(frozen=True, slots=True)
class ReadProgram:
    controller: Annotated[str, Meaning("Of a controller.")]
    place: Annotated[str, Meaning("As in the answer to programs.")]


@request(
    "program_memory",
    LOOK,
    "What a text would take of the program memory at a place, and what is permitted. Empty for a text with errors.",
    tuple[MemoryUse, ...],
)
@dataclass(frozen=True, slots=True)
class ReadMemory:
    controller: Annotated[str, Meaning("Of a controller.")]
    place: Annotated[str, Meaning("As in the answer to programs.")]
    text: Annotated[str, Meaning("The text; it is not downloaded.", PROGRAM)]


@request(
    "ports",
    LOOK,
    "The serial ports of the computer on which the studio runs, and the pseudo terminals of running twins.",
    tuple[_Port, ...],
)
@dataclass(frozen=True, slots=True)
class ListPorts:
    pass


@request(
    "connect",
    SERVICE,
    "A device becomes a controller here. Nothing moves by it, and no setting is changed.",
    ConnectedDevice,
)
@dataclass(frozen=True, slots=True)
class Connect:
    address: Annotated[str, Meaning("As after --device: /dev/ttyUSB0,unit=2, tcp://192.168.0.9,config=machine.cfg.")]
    name: Annotated[str | None, Meaning("Of the controller; its kind without one.")] = None


@request("disconnect", SERVICE, "Remove a device: its jogs end, other motions and its program go on.")
@dataclass(frozen=True, slots=True)
class Disconnect:
    controller: Annotated[str, Meaning("Of a device.")]


@request(
    "traffic",
    LOOK,
    "How much each line of the world has carried since its beginning. Counted at present, also while the past is shown.",
    WorldTraffic,
)
@dataclass(frozen=True, slots=True)
class ReadTraffic:
    pass


@request(
    "audit",
    SERVICE._replace(control=False),
    "Who did what, the newest last.",
    tuple[Entry, ...],
)
@dataclass(frozen=True, slots=True)
class ReadAudit:
    most: Annotated[int, Meaning("Entries.", whole(1, MOST_ENTRIES))] = 100


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
    | ListPrograms
    | ReadProgram
    | ReadMemory
    | ListPorts
    | Connect
    | Disconnect
    | ReadTraffic
    | ReadAudit
    | ToolRequest
    | WorkRequest
    | RecordingRequest
    | RecordingFileRequest
    | BranchRequest
    | PlaceRequest
    | DrawingRequest
    | ServiceRequest
    | CampaignRequest
    | ChangeCampaign
    | DeviceRequest
)
"""In the order in which they are listed. Another request is a class, its place here, and what does it in
`steptwin.studio.viewersession`."""


def _names(union: Any) -> frozenset[str]:
    return frozenset(declared(kind).name for kind in get_args(union) or (union,))


REQUESTS: Mapping[str, ViewerRequestType] = {one.name: one for one in map(declared, get_args(StudioRequest))}
ALL: Mapping[str, RequestType] = {**COMMANDS, **REQUESTS}
"""Every request by name."""
OF_TIME_TRAVEL = frozenset({"show_moment", "go_back", "past_events"})
"""Requests that need a past that is kept."""
IN_THE_PAST = OF_TIME_TRAVEL | {"breakpoint", "clear_breakpoint", "stop_on", "step_program", "run", "look_at", "branch"}
"""Requests that change something and are possible while the past is shown: a debugger goes forwards from there, too."""
OF_RECORDINGS = _names(RecordingRequest)
"""Requests that need a world that is recorded."""
OF_RECORDING_FILES = _names(RecordingFileRequest)
"""Requests that need a folder for recordings, too."""
OF_BRANCHES, OF_DRAWINGS, OF_SERVICES = _names(BranchRequest), _names(DrawingRequest), _names(ServiceRequest)
"""Requests that need a world."""
OF_CAMPAIGNS = _names(CampaignRequest)
"""Requests that need a world of a file, or a page that is given a campaign with its world."""
OF_DEVICES = _names(DeviceRequest) | {"ports", "connect", "disconnect"}
"""Requests that need a computer to which devices are connected."""
OF_WORK = _names(WorkRequest)
"""Requests that need such a computer, and processes or threads."""
WITH_TOKEN = OF_WORK | {"connect"}
"""Requests that reach devices, or describe them: they need a token also where nothing else does."""
OF_CONNECTION = frozenset({"subscribe", "unsubscribe", *(one.name for one in REQUESTS.values() if one.is_of_connection)})


UNKNOWN_REQUEST = Message("studio.unknown-request", "no request {name}{hint}; requests are {names}")


def request_called(name: str) -> RequestType:
    """Raises `Misuse` for what is no request."""
    found = ALL.get(name)
    if found is None:
        raise Misuse(UNKNOWN_REQUEST(name=format_short(name), hint=NearMiss().hint(name, ALL), names=list(ALL)))
    return found


def permit_of(name: str) -> Permit:
    """Permission that the request called ``name`` needs."""
    return REQUESTS[name].permit if name in REQUESTS else PERMITS[name]
