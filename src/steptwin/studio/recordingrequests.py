"""Requests for what is recorded of a world, to be saved, exported and viewed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Protocol, TypeAlias

from steptwin.access.roles import KEEP, LOOK
from steptwin.fields import Meaning
from steptwin.jsonvalues import JsonForm, Moment
from steptwin.studio.requesttype import request


@dataclass(frozen=True, slots=True)
class RecordingFile:
    """A saved recording."""

    name: Annotated[str, "Of the file, without .json."]
    bytes: int
    saved: Annotated[str, "Wall clock, ISO 8601."]
    until_ns: Moment


@dataclass(frozen=True, slots=True)
class RecordingState:
    """Extent of a recording, and its limits."""

    until_ns: Moment
    inputs: int
    most_inputs: int
    bytes: int
    most_bytes: int
    is_full: Annotated[bool, "Whether it has ended for want of room."]
    file: Annotated[str | None, "Where it is written at the end of the studio."]


@dataclass(frozen=True, slots=True)
class PastState:
    """Extent of the past that is kept."""

    from_ns: Moment
    states: int
    inputs: int
    most_inputs: int


@dataclass(frozen=True, slots=True)
class TraceState:
    """A trace, which is kept in a ring or in a file."""

    kind: Annotated[str, JsonForm({"enum": ["none", "ring", "file"]})]
    file: str | None
    records: int | None
    most_records: int | None
    from_ns: Annotated[Moment | None, "Of the oldest record of a ring."]


@dataclass(frozen=True, slots=True)
class RecordingsOfWorld:
    """Recordings of a world."""

    recording: Annotated[RecordingState | None, "Inputs from outside since the beginning; null: none is recorded."]
    past: Annotated[PastState | None, "What show_moment can show."]
    trace: Annotated[TraceState, "What happened, as --trace keeps it."]
    folder: Annotated[str | None, "Where recordings are saved; null: each becomes a download of the browser."]
    saved: Annotated[tuple[RecordingFile, ...], "Sessions there, the newest first."]
    formats: Annotated[tuple[str, ...], "What GET /api/recordings/NAME.FORMAT makes of them."]
    most_bytes: Annotated[int | None, "Of a file that is chosen on the page to be viewed; null: none is."] = None


class Recordings(Protocol):
    """Recordings of one world. Awaits only `steptwin.later.Later`."""

    async def list(self) -> RecordingsOfWorld: ...

    async def save(self, name: str | None) -> RecordingFile:
        """Raises `Misuse`, and `Refusal` where there is a file of that name."""
        ...


class RecordingFiles(Protocol):
    """Recordings of one world as files in its folder. Awaits only `steptwin.later.Later`."""

    def place(self, file: str) -> str:
        """The absolute path at which the request ``save`` may write ``file``; a recording may be there already. Raises `Misuse`
        for a place outside of the folder of the world, `Refusal` for another file."""
        ...

    async def view(self, name: str) -> str | None:
        """The address of the page; None where it is shown in place of the world. Raises `Misuse`, `Refusal`."""
        ...

    async def file(self, name: str) -> str:
        """The path of a saved recording, ``NAME.json``, or of what is made of it: ``NAME.vcd``. Raises `Misuse`, `Refusal`."""
        ...


@request("recordings", LOOK, "What is recorded of the world, and which recordings are saved.", RecordingsOfWorld)
@dataclass(frozen=True, slots=True)
class ReadRecordings:
    pass


@request(
    "save_recording",
    KEEP,
    "Save the recording up to now as a file beside the world, or as a download of the browser that has the world in its page. "
    "Nothing changes in the world.",
    RecordingFile,
)
@dataclass(frozen=True, slots=True)
class SaveRecording:
    name: Annotated[str | None, Meaning("Of the file, without .json; the world and the time of day without.")] = None


@dataclass(frozen=True, slots=True)
class ViewAddress:
    """The address of a page."""

    url: Annotated[str | None, "null: it is shown in place of the world."]


@request(
    "view_recording",
    KEEP,
    "Open a saved recording as a page of its own, as steptwin studio FILE --view does; at a loopback address only. A studio in a "
    "page shows one that was chosen there in place of its world.",
    ViewAddress,
)
@dataclass(frozen=True, slots=True)
class ViewRecording:
    name: Annotated[str, Meaning("Of a saved recording.")]


RecordingRequest: TypeAlias = ReadRecordings | SaveRecording
RecordingFileRequest: TypeAlias = ViewRecording
