"""Requests for gateways and the history beside a world: who is connected, and what has been kept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeAlias

from steptwin.access.roles import LOOK
from steptwin.durations import LONGEST_NS
from steptwin.machine import SECOND
from steptwin.studio.requestrow import RequestRow
from steptwin.subject.fields import NAMES, Field, Schema, number, whole
from steptwin.subject.shapes import members


@dataclass(frozen=True, slots=True)
class ReadGateways:
    """The gateways of the world, and who uses them."""


@dataclass(frozen=True, slots=True)
class ReadHistory:
    """What the history has: runs and points."""


@dataclass(frozen=True, slots=True)
class ReadHistoryValues:
    """Values of points in a stretch of a run. ``run``: its number, negative ones count from the last. Seconds since its begin."""

    points: tuple[str, ...]
    run: int = -1
    from_s: float = 0.0
    to_s: float | None = None


@dataclass(frozen=True, slots=True)
class CompareHistory:
    """What differs between the same stretch of two runs."""

    run: int
    other: int
    points: tuple[str, ...] = ()
    from_s: float = 0.0
    to_s: float | None = None


@dataclass(frozen=True, slots=True)
class ReadHistoryWrites:
    """What programs have written and clients have commanded in a stretch of a run."""

    run: int = -1
    from_s: float = 0.0
    to_s: float | None = None


PlantRequest: TypeAlias = ReadGateways | ReadHistory | ReadHistoryValues | CompareHistory | ReadHistoryWrites


class PlantRecords(Protocol):
    """Of one world. Awaits only `steptwin.later.Later`."""

    def gateways(self) -> Sequence[Mapping[str, object]]:
        """As `_GATEWAY`."""
        ...

    async def history(self) -> Mapping[str, object] | None:
        """As `_HISTORY`; None without a history. Raises `LineFailure` where its database does not answer."""
        ...

    async def values(self, points: Sequence[str], run: int, begin_s: float, end_s: float | None) -> Mapping[str, object]:
        """As `_VALUES`. Raises `Misuse`, `Refusal`, `LineFailure`."""
        ...

    async def compare(
        self, points: Sequence[str], runs: tuple[int, int], begin_s: float, end_s: float | None
    ) -> Sequence[Mapping[str, object]]:
        """As `_DIFFERENCE`. Raises as `values`."""
        ...

    async def writes(self, run: int, begin_s: float, end_s: float | None) -> Sequence[Mapping[str, object]]:
        """As `_WRITE`, the last `MOST_WRITES`. Raises as `values`."""
        ...


_TEXT: Schema = {"type": "string"}
_WHOLE: Schema = {"type": "integer"}
_FLAG: Schema = {"type": "boolean"}
_NUMBER: Schema = {"type": "number"}
_NUMBER_OR_NULL: Schema = {"type": ["number", "null"]}
_VALUE: Schema = {"type": ["number", "string", "null"], "description": "Null: not known."}


def _list(schema: Schema) -> Schema:
    return {"type": "array", "items": schema}


_CLIENT = members(
    {
        "name": _TEXT,
        "place": {**_TEXT, "description": "Where it is, as far as that is known."},
        "role": _TEXT,
        "follows": {**_list(_TEXT), "description": "Values that it is sent when they change, by the names of the protocol."},
    }
)
_GATEWAY = members(
    {
        "kind": {**_TEXT, "description": "The name of its table: opcua, history."},
        "protocol": _TEXT,
        "place": {**_TEXT, "description": "Its address."},
        "is_up": _FLAG,
        "text": {**_TEXT, "description": "Its state in words, such as why it is not up."},
        "shown": {"type": ["integer", "null"], "description": "How many values it shows; null where that is no fixed number."},
        "clients": _list(_CLIENT),
    }
)
_RUN = members(
    {
        "run": _WHOLE,
        "subject": _TEXT,
        "is_virtual": {**_FLAG, "description": "Whether its moments are virtual ones, of twins."},
        "began": {**_TEXT, "description": "Wall clock, ISO 8601."},
        "length_s": _NUMBER,
        "is_over": {**_FLAG, "description": "False while it goes on, and where its process was killed."},
    }
)
_POINT = members({"point": _TEXT, "unit": _TEXT, "is_text": _FLAG})
_HISTORY = members({"database": _TEXT, "runs": _list(_RUN), "points": _list(_POINT)})
_SERIES = members(
    {
        "point": _TEXT,
        "unit": _TEXT,
        "is_text": _FLAG,
        "is_motion": {
            **_FLAG,
            "description": "Whether values change between moments, too; otherwise each holds until the next.",
        },
        "is_thinned": {**_FLAG, "description": "Whether it has been read in equal steps, because there are too many values."},
        "at_s": {**_list(_NUMBER), "description": "Since the begin of the run."},
        "values": _list(_VALUE),
    }
)
_VALUES = members({"run": _WHOLE, "from_s": _NUMBER, "to_s": _NUMBER, "series": _list(_SERIES)})
_DIFFERENCE = members(
    {
        "point": _TEXT,
        "unit": _TEXT,
        "most": {**_NUMBER_OR_NULL, "description": "How far the two are apart at most; null for texts and unknown values."},
        "at_s": {**_NUMBER, "description": "Since the begin of the stretch."},
        "values": _list(_VALUE),
    }
)

_WRITE = members(
    {
        "at_s": {**_NUMBER, "description": "Since the begin of the run."},
        "source": {
            **_TEXT,
            "description": "Who it was: an address, the owner of a certificate, a viewer, a client of a gateway, script.",
        },
        "machine": {**_TEXT, "description": "The controller, or the line; empty for what is about neither."},
        "what": {**_TEXT, "description": "What was written or commanded, in words."},
        "outcome": {**_TEXT, "description": "done, misuse, refusal, failure, internal; sent or empty where there is no answer."},
    }
)

MOST_POINTS = 8
"""That are read at once."""
MOST_WRITES = 200
"""That are given at once."""
_RUN_NUMBER = whole(-(2**31), 2**31)
LONGEST_S = LONGEST_NS / SECOND
_STRETCH = (
    Field("from_s", number(0.0, LONGEST_S), "Begin of the stretch, since that of the run.", 0.0, "s"),
    Field("to_s", number(0.0, LONGEST_S), "End of the stretch; that of the run without.", None, "s"),
)

PLANT = (
    RequestRow("gateways", ReadGateways, LOOK, "The gateways of the world, and who uses them.", _list(_GATEWAY)),
    RequestRow(
        "history",
        ReadHistory,
        LOOK,
        "Runs and points that the history beside the world has kept; null where there is none.",
        {"anyOf": [_HISTORY, {"type": "null"}]},
    ),
    RequestRow(
        "history_values",
        ReadHistoryValues,
        LOOK,
        "Values of points in a stretch of a run that has been kept, for a picture: of motions the ends of their parts, and about "
        "800 positions between; at most 4000 of each point.",
        _VALUES,
        (
            Field("points", NAMES, f"Names as in the answer to history, at most {MOST_POINTS}."),
            Field("run", _RUN_NUMBER, "Number of the run; -1 is the last one.", -1),
            *_STRETCH,
        ),
    ),
    RequestRow(
        "compare_history",
        CompareHistory,
        LOOK,
        "The points that differ between the same stretch of two runs, the greatest difference first.",
        _list(_DIFFERENCE),
        (
            Field("run", _RUN_NUMBER, "Number of a run; -1 is the last one."),
            Field("other", _RUN_NUMBER, "Number of the run that it is compared with."),
            Field("points", NAMES, "Only these; all without.", ()),
            *_STRETCH,
        ),
    ),
    RequestRow(
        "history_writes",
        ReadHistoryWrites,
        LOOK,
        f"What programs have written over lines and clients have commanded in a stretch of a run; the last {MOST_WRITES}.",
        _list(_WRITE),
        (Field("run", _RUN_NUMBER, "Number of the run; -1 is the last one.", -1), *_STRETCH),
    ),
)
