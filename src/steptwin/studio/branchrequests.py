"""Requests for branches: worlds without ports that begin at a moment of the past of the world that is shown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeAlias

from steptwin.access.roles import KEEP, LOOK
from steptwin.machine import Nanos
from steptwin.studio.requestrow import NOTHING, RequestRow
from steptwin.studio.shapes import MOMENT
from steptwin.subject.fields import TIME, Field, Schema, whole
from steptwin.subject.shapes import members


@dataclass(frozen=True, slots=True)
class ListBranches:
    """The branches that are open."""


@dataclass(frozen=True, slots=True)
class StartBranch:
    """Opens a branch from a moment of the past, or from the present."""

    moment: Nanos | None = None


@dataclass(frozen=True, slots=True)
class EndBranch:
    """Ends a branch."""

    branch: int


BranchRequest: TypeAlias = ListBranches | StartBranch | EndBranch


class Branches(Protocol):
    """Of one world. Awaits only `steptwin.later.Later`."""

    def plain(self) -> Sequence[Mapping[str, object]]:
        """As `_BRANCH`."""
        ...

    async def start(self, moment: Nanos | None) -> Mapping[str, object]:
        """Raises `Misuse` for a moment that is not kept, `Refusal`, and `LineFailure` where it does not start."""
        ...

    async def end(self, branch: int) -> None:
        """Raises `Misuse` where there is no such branch."""
        ...


_BRANCH: Schema = members(
    {
        "branch": {"type": "integer"},
        "from_ns": {**MOMENT, "description": "Where it began. Virtual time, as decimal text [ns]"},
        "url": {"type": "string", "description": "Of its page; the token there is the one of here."},
    }
)

BRANCHES = (
    RequestRow("branches", ListBranches, LOOK, "The branches of the world that are open.", {"type": "array", "items": _BRANCH}),
    RequestRow(
        "start_branch",
        StartBranch,
        KEEP,
        "Begin another world, without ports, in the state of a moment of the past. It is a studio of its own, in which time "
        "stands at first. Nothing changes in the world here.",
        _BRANCH,
        (Field("at_ns", TIME, "Which moment; the present without.", None, "ns", "moment"),),
    ),
    RequestRow(
        "end_branch",
        EndBranch,
        KEEP,
        "End a branch; what is in it is lost.",
        NOTHING,
        (Field("branch", whole(1, 2**53), "Its number."),),
    ),
)
