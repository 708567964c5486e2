"""Requests for what is recorded of a world: its session, to be saved, exported and looked at."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol, TypeAlias

from steptwin.access.roles import KEEP, LOOK
from steptwin.studio.requestrow import RequestRow
from steptwin.studio.shapes import MOMENT
from steptwin.subject.fields import TEXT, Field, Schema
from steptwin.subject.shapes import members


@dataclass(frozen=True, slots=True)
class ReadRecordings:
    """What is recorded, and which sessions have been saved."""


@dataclass(frozen=True, slots=True)
class SaveRecording:
    """Saves the session up to now."""

    name: str | None = None


@dataclass(frozen=True, slots=True)
class ViewRecording:
    """Opens a saved session as a page of its own."""

    name: str


RecordingRequest: TypeAlias = ReadRecordings | SaveRecording | ViewRecording


class Recordings(Protocol):
    """Of one world. Awaits only `steptwin.later.Later`."""

    async def plain(self) -> Mapping[str, object]:
        """As `_RECORDINGS`."""
        ...

    async def save(self, name: str | None) -> Mapping[str, object]:
        """Raises `Misuse`, and `Refusal` where there is a file of that name."""
        ...

    def place(self, file: str) -> str:
        """The absolute path at which the request ``save`` may write ``file``; a session may be there already. Raises `Misuse`
        for a place outside of the folder of the world, `Refusal` for another file."""
        ...

    async def view(self, name: str) -> str:
        """The address of the page. Raises `Misuse`, `Refusal`."""
        ...

    async def file(self, name: str) -> str:
        """The path of a saved session, ``NAME.json``, or of what is made of it: ``NAME.vcd``. Raises `Misuse`, `Refusal`."""
        ...


_TEXT: Schema = {"type": "string"}
_WHOLE: Schema = {"type": "integer"}


def _or_null(schema: Schema) -> Schema:
    return {"anyOf": [schema, {"type": "null"}]}


_SAVED = members(
    {
        "name": {**_TEXT, "description": "Of the file, without .json."},
        "bytes": _WHOLE,
        "saved": {**_TEXT, "description": "Wall clock, ISO 8601."},
        "until_ns": MOMENT,
    }
)
_SESSION = members(
    {
        "until_ns": MOMENT,
        "inputs": _WHOLE,
        "most_inputs": _WHOLE,
        "bytes": _WHOLE,
        "most_bytes": _WHOLE,
        "is_full": {"type": "boolean", "description": "Whether it has ended for want of room."},
        "file": {**_or_null(_TEXT), "description": "Where it is written at the end of the studio."},
    }
)
_PAST = members({"from_ns": MOMENT, "states": _WHOLE, "inputs": _WHOLE, "most_inputs": _WHOLE})
_TRACE = members(
    {
        "kind": {"enum": ["none", "ring", "file"]},
        "file": _or_null(_TEXT),
        "records": _or_null(_WHOLE),
        "most_records": _or_null(_WHOLE),
        "from_ns": {**_or_null(MOMENT), "description": "Of the oldest record of a ring."},
    }
)
_RECORDINGS = members(
    {
        "session": {**_or_null(_SESSION), "description": "Inputs from outside since the beginning; null: none is recorded."},
        "past": {**_or_null(_PAST), "description": "What look can show."},
        "trace": {**_TRACE, "description": "What happened, as --trace keeps it."},
        "folder": {**_TEXT, "description": "Where sessions are saved."},
        "saved": {"type": "array", "items": _SAVED, "description": "Sessions there, the newest first."},
        "formats": {"type": "array", "items": _TEXT, "description": "What GET /api/recordings/NAME.FORMAT makes of them."},
    }
)
_NAME = Field("name", TEXT, "Of a saved session.")

RECORDINGS = (
    RequestRow("recordings", ReadRecordings, LOOK, "What is recorded of the world, and which sessions are saved.", _RECORDINGS),
    RequestRow(
        "save_recording",
        SaveRecording,
        KEEP,
        "Save the session up to now as a file beside the world. Nothing changes in the world.",
        _SAVED,
        (Field("name", TEXT, "Of the file, without .json; the world and the time of day without.", None),),
    ),
    RequestRow(
        "view_recording",
        ViewRecording,
        KEEP,
        "Open a saved session as a page of its own, as steptwin studio FILE --view does; at a loopback address only.",
        members({"url": _TEXT}),
        (_NAME,),
    ),
)
