"""Requests for gateways and the history beside a world: who is connected, and what has been kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Protocol, TypeAlias

from steptwin.access.roles import LOOK
from steptwin.controller import SECOND
from steptwin.durations import LONGEST_NS
from steptwin.fields import Meaning, number, whole
from steptwin.jsonvalues import JsonForm
from steptwin.studio.requesttype import request

_Value: TypeAlias = Annotated[object, JsonForm({"type": ["number", "string", "null"]}), "Null: not known."]


@dataclass(frozen=True, slots=True)
class GatewayClient:
    """A program that uses a gateway."""

    name: str
    place: Annotated[str, "Where it is, as far as that is known."]
    role: str
    follows: Annotated[tuple[str, ...], "Values that it is sent when they change, by the names of the protocol."]


@dataclass(frozen=True, slots=True)
class ShownGateway:
    """A gateway of the world, and who uses it."""

    kind: Annotated[str, "The name of its table: opcua, history."]
    protocol: str
    place: Annotated[str, "Its address."]
    is_up: bool
    text: Annotated[str, "Its state in words, such as why it is not up."]
    shown: Annotated[int | None, "How many values it shows; null where that number is not fixed."]
    has_clients: Annotated[bool, "Whether it knows its clients; those of a broker or database only that knows."]
    clients: tuple[GatewayClient, ...]


@dataclass(frozen=True, slots=True)
class HistoryRun:
    """A run that has been kept."""

    run: int
    subject: str
    is_virtual: Annotated[bool, "Whether its moments are virtual ones, of twins."]
    began: Annotated[str, "Wall clock, ISO 8601."]
    length_s: float
    is_over: Annotated[bool, "False while it goes on, and where its process was killed."]


@dataclass(frozen=True, slots=True)
class HistoryPoint:
    """A point whose values have been kept."""

    point: str
    unit: str
    is_text: bool


@dataclass(frozen=True, slots=True)
class HistoryContents:
    """Runs and points of a history."""

    database: str
    runs: tuple[HistoryRun, ...]
    points: tuple[HistoryPoint, ...]


@dataclass(frozen=True, slots=True)
class HistorySeries:
    """Values of a point."""

    point: str
    unit: str
    is_text: bool
    is_motion: Annotated[bool, "Whether values change between moments, too; otherwise each holds until the next."]
    is_thinned: Annotated[bool, "Whether it has been read in equal steps, because there are too many values."]
    at_s: Annotated[tuple[float, ...], "Since the begin of the run."]
    values: tuple[_Value, ...]


@dataclass(frozen=True, slots=True)
class HistoryInterval:
    """Values of points in an interval of a run."""

    run: int
    from_s: float
    to_s: float
    series: tuple[HistorySeries, ...]


@dataclass(frozen=True, slots=True)
class HistoryDifference:
    """A point that differs between two runs."""

    point: str
    unit: str
    most: Annotated[float | None, "How far the two are apart at most; null for texts and unknown values."]
    at_s: Annotated[float, "Since the begin of the interval."]
    values: tuple[_Value, ...]


@dataclass(frozen=True, slots=True)
class HistoryWrite:
    """A write of a program, or a command of a client."""

    at_s: Annotated[float, "Since the begin of the run."]
    source: Annotated[str, "Who it was: an address, the owner of a certificate, a viewer, a client of a gateway, script."]
    controller: Annotated[str, "The controller, or the line; empty for what is about neither."]
    what: Annotated[str, "What was written or commanded, in words."]
    outcome: Annotated[str, "done, misuse, refusal, failure, internal; sent or empty where there is no answer."]


class WorldServices(Protocol):
    """History of one world. Awaits only `steptwin.later.Later`."""

    def gateways(self) -> Sequence[ShownGateway]: ...

    async def history(self) -> HistoryContents | None:
        """None without a history. Raises `LineFailure` where its database does not answer."""
        ...

    async def values(self, points: Sequence[str], run: int, begin_s: float, end_s: float | None) -> HistoryInterval:
        """Raises `Misuse`, `Refusal`, `LineFailure`."""
        ...

    async def compare(
        self, points: Sequence[str], runs: tuple[int, int], begin_s: float, end_s: float | None
    ) -> Sequence[HistoryDifference]:
        """Raises as `values`."""
        ...

    async def writes(self, run: int, begin_s: float, end_s: float | None) -> Sequence[HistoryWrite]:
        """The last `MOST_WRITES`. Raises as `values`."""
        ...


MOST_POINTS = 8
"""That are read at once."""
MOST_WRITES = 200
"""That are given at once."""
_RUN_NUMBER = whole(-(2**31), 2**31)
LONGEST_S = LONGEST_NS / SECOND
_SECONDS = number(0.0, LONGEST_S)
_Begin: TypeAlias = Annotated[float, Meaning("Begin of the interval, since that of the run.", _SECONDS, unit="s")]
_End: TypeAlias = Annotated[float | None, Meaning("End of the interval; that of the run without.", _SECONDS, unit="s")]


@request("gateways", LOOK, "The gateways of the world, and who uses them.", tuple[ShownGateway, ...])
@dataclass(frozen=True, slots=True)
class ReadGateways:
    pass


@request(
    "history",
    LOOK,
    "Runs and points that the history beside the world has kept; null where there is none.",
    HistoryContents | None,
)
@dataclass(frozen=True, slots=True)
class ReadHistory:
    pass


@request(
    "history_values",
    LOOK,
    "Values of points in an interval of a run that has been kept, for a picture: of motions the ends of their parts, and about "
    "800 positions between; at most 4000 of each point.",
    HistoryInterval,
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
    tuple[HistoryDifference, ...],
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
    tuple[HistoryWrite, ...],
)
@dataclass(frozen=True, slots=True)
class ReadHistoryWrites:
    run: Annotated[int, Meaning("Number of the run; -1 is the last one.", _RUN_NUMBER)] = -1
    from_s: _Begin = 0.0
    to_s: _End = None


ServiceRequest: TypeAlias = ReadGateways | ReadHistory | ReadHistoryValues | CompareHistory | ReadHistoryWrites
