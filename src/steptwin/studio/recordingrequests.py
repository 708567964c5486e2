"""Requests for what is recorded of a world, to be saved, exported and viewed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Protocol, TypeAlias

from steptwin.access.roles import KEEP, LOOK
from steptwin.fields import Meaning
from steptwin.jsonvalues import FLAG, MOMENT, TEXT, WHOLE, list_of, members, or_null
from steptwin.studio.requesttype import request


class Recordings(Protocol):
    """Recordings of one world. Awaits only `steptwin.later.Later`."""

    async def to_json(self) -> Mapping[str, object]:
        """As `_RECORDINGS`."""
        ...

    async def save(self, name: str | None) -> Mapping[str, object]:
        """Raises `Misuse`, and `Refusal` where there is a file of that name."""
        ...

    def place(self, file: str) -> str:
        """The absolute path at which the request ``save`` may write ``file``; a recording may be there already. Raises `Misuse`
        for a place outside of the folder of the world, `Refusal` for another file."""
        ...

    async def view(self, name: str) -> str:
        """The address of the page. Raises `Misuse`, `Refusal`."""
        ...

    async def file(self, name: str) -> str:
        """The path of a saved recording, ``NAME.json``, or of what is made of it: ``NAME.vcd``. Raises `Misuse`, `Refusal`."""
        ...


_SAVED = members(
    {
        "name": {**TEXT, "description": "Of the file, without .json."},
        "bytes": WHOLE,
        "saved": {**TEXT, "description": "Wall clock, ISO 8601."},
        "until_ns": MOMENT,
    }
)
_RECORDING = members(
    {
        "until_ns": MOMENT,
        "inputs": WHOLE,
        "most_inputs": WHOLE,
        "bytes": WHOLE,
        "most_bytes": WHOLE,
        "is_full": {**FLAG, "description": "Whether it has ended for want of room."},
        "file": {**or_null(TEXT), "description": "Where it is written at the end of the studio."},
    }
)
_PAST = members({"from_ns": MOMENT, "states": WHOLE, "inputs": WHOLE, "most_inputs": WHOLE})
_TRACE = members(
    {
        "kind": {"enum": ["none", "ring", "file"]},
        "file": or_null(TEXT),
        "records": or_null(WHOLE),
        "most_records": or_null(WHOLE),
        "from_ns": {**or_null(MOMENT), "description": "Of the oldest record of a ring."},
    }
)
_RECORDINGS = members(
    {
        "recording": {**or_null(_RECORDING), "description": "Inputs from outside since the beginning; null: none is recorded."},
        "past": {**or_null(_PAST), "description": "What show_moment can show."},
        "trace": {**_TRACE, "description": "What happened, as --trace keeps it."},
        "folder": {**TEXT, "description": "Where recordings are saved."},
        "saved": {**list_of(_SAVED), "description": "Sessions there, the newest first."},
        "formats": {**list_of(TEXT), "description": "What GET /api/recordings/NAME.FORMAT makes of them."},
    }
)


@request("recordings", LOOK, "What is recorded of the world, and which recordings are saved.", _RECORDINGS)
@dataclass(frozen=True, slots=True)
class ReadRecordings:
    pass


@request("save_recording", KEEP, "Save the recording up to now as a file beside the world. Nothing changes in the world.", _SAVED)
@dataclass(frozen=True, slots=True)
class SaveRecording:
    name: Annotated[str | None, Meaning("Of the file, without .json; the world and the time of day without.")] = None


@request(
    "view_recording",
    KEEP,
    "Open a saved recording as a page of its own, as steptwin studio FILE --view does; at a loopback address only.",
    members({"url": TEXT}),
)
@dataclass(frozen=True, slots=True)
class ViewRecording:
    name: Annotated[str, Meaning("Of a saved recording.")]


RecordingRequest: TypeAlias = ReadRecordings | SaveRecording | ViewRecording
