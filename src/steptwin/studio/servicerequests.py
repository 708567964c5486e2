"""Requests for gateways and the history beside a world: who is connected, and what has been kept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Protocol, TypeAlias

from steptwin.access.roles import LOOK
from steptwin.controller import SECOND
from steptwin.durations import LONGEST_NS
from steptwin.fields import Meaning, Schema, number, whole
from steptwin.jsonvalues import FLAG, NUMBER, TEXT, WHOLE, list_of, members, or_null
from steptwin.studio.requesttype import request


class WorldServices(Protocol):
    """History of one world. Awaits only `steptwin.later.Later`."""

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


_NUMBER_OR_NULL: Schema = {"type": ["number", "null"]}
_VALUE: Schema = {"type": ["number", "string", "null"], "description": "Null: not known."}


_CLIENT = members(
    {
        "name": TEXT,
        "place": {**TEXT, "description": "Where it is, as far as that is known."},
        "role": TEXT,
        "follows": {**list_of(TEXT), "description": "Values that it is sent when they change, by the names of the protocol."},
    }
)
_GATEWAY = members(
    {
        "kind": {**TEXT, "description": "The name of its table: opcua, history."},
        "protocol": TEXT,
        "place": {**TEXT, "description": "Its address."},
        "is_up": FLAG,
        "text": {**TEXT, "description": "Its state in words, such as why it is not up."},
        "shown": {"type": ["integer", "null"], "description": "How many values it shows; null where that number is not fixed."},
        "has_clients": {**FLAG, "description": "Whether it knows its clients; those of a broker or database only that knows."},
        "clients": list_of(_CLIENT),
    }
)
_RUN = members(
    {
        "run": WHOLE,
        "subject": TEXT,
        "is_virtual": {**FLAG, "description": "Whether its moments are virtual ones, of twins."},
        "began": {**TEXT, "description": "Wall clock, ISO 8601."},
        "length_s": NUMBER,
        "is_over": {**FLAG, "description": "False while it goes on, and where its process was killed."},
    }
)
_POINT = members({"point": TEXT, "unit": TEXT, "is_text": FLAG})
_HISTORY = members({"database": TEXT, "runs": list_of(_RUN), "points": list_of(_POINT)})
_SERIES = members(
    {
        "point": TEXT,
        "unit": TEXT,
        "is_text": FLAG,
        "is_motion": {
            **FLAG,
            "description": "Whether values change between moments, too; otherwise each holds until the next.",
        },
        "is_thinned": {**FLAG, "description": "Whether it has been read in equal steps, because there are too many values."},
        "at_s": {**list_of(NUMBER), "description": "Since the begin of the run."},
        "values": list_of(_VALUE),
    }
)
_VALUES = members({"run": WHOLE, "from_s": NUMBER, "to_s": NUMBER, "series": list_of(_SERIES)})
_DIFFERENCE = members(
    {
        "point": TEXT,
        "unit": TEXT,
        "most": {**_NUMBER_OR_NULL, "description": "How far the two are apart at most; null for texts and unknown values."},
        "at_s": {**NUMBER, "description": "Since the begin of the interval."},
        "values": list_of(_VALUE),
    }
)

_WRITE = members(
    {
        "at_s": {**NUMBER, "description": "Since the begin of the run."},
        "source": {
            **TEXT,
            "description": "Who it was: an address, the owner of a certificate, a viewer, a client of a gateway, script.",
        },
        "controller": {**TEXT, "description": "The controller, or the line; empty for what is about neither."},
        "what": {**TEXT, "description": "What was written or commanded, in words."},
        "outcome": {**TEXT, "description": "done, misuse, refusal, failure, internal; sent or empty where there is no answer."},
    }
)

MOST_POINTS = 8
"""That are read at once."""
MOST_WRITES = 200
"""That are given at once."""
_RUN_NUMBER = whole(-(2**31), 2**31)
LONGEST_S = LONGEST_NS / SECOND
_SECONDS = number(0.0, LONGEST_S)
_Begin: TypeAlias = Annotated[float, Meaning("Begin of the interval, since that of the run.", _SECONDS, unit="s")]
_End: TypeAlias = Annotated[float | None, Meaning("End of the interval; that of the run without.", _SECONDS, unit="s")]


@request("gateways", LOOK, "The gateways of the world, and who uses them.", list_of(_GATEWAY))
@dataclass(frozen=True, slots=True)
class ReadGateways:
    pass


@request(
    "history",
    LOOK,
    "Runs and points that the history beside the world has kept; null where there is none.",
    or_null(_HISTORY),
)
@dataclass(frozen=True, slots=True)
class ReadHistory:
    pass


@request(
    "history_values",
    LOOK,
    "Values of points in an interval of a run that has been kept, for a picture: of motions the ends of their parts, and about "
    "800 positions between; at most 4000 of each point.",
    _VALUES,
)
@dataclass(frozen=True, slots=True)
class ReadHistoryValues:
    points: Annotated[tuple[str, ...], Meaning(f"Names as in the answer to history, at most {MOST_POINTS}.")]
    run: Annotated[int, Meaning("Number of the run; -1 is the last one.", _RUN_NUMBER)] = -1
    from_s: _Begin = 0.0
    to_s: _End = None


@request(
    "compare_history",
    LOOK,
    "The points that differ between the same interval of two runs, the greatest difference first.",
    list_of(_DIFFERENCE),
)
@dataclass(frozen=True, slots=True)
class CompareHistory:
    run: Annotated[int, Meaning("Number of a run; -1 is the last one.", _RUN_NUMBER)]
    other: Annotated[int, Meaning("Number of the run that it is compared with.", _RUN_NUMBER)]
    points: Annotated[tuple[str, ...], Meaning("Only these; all without.")] = ()
    from_s: _Begin = 0.0
    to_s: _End = None


@request(
    "history_writes",
    LOOK,
    f"What programs have written over lines and clients have commanded in an interval of a run; the last {MOST_WRITES}.",
    list_of(_WRITE),
)
@dataclass(frozen=True, slots=True)
class ReadHistoryWrites:
    run: Annotated[int, Meaning("Number of the run; -1 is the last one.", _RUN_NUMBER)] = -1
    from_s: _Begin = 0.0
    to_s: _End = None


ServiceRequest: TypeAlias = ReadGateways | ReadHistory | ReadHistoryValues | CompareHistory | ReadHistoryWrites
