"""Requests for branches: worlds without ports that begin at a moment of the past of the world that is shown. A studio in a page
shows them, and recordings, in place of that world."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Protocol, TypeAlias

from steptwin.access.roles import KEEP, LOOK
from steptwin.controller import Nanos
from steptwin.fields import TIME, Meaning, whole
from steptwin.jsonvalues import Moment
from steptwin.studio.requesttype import request


@dataclass(frozen=True, slots=True)
class Branch:
    """An open branch."""

    branch: int
    from_ns: Annotated[Moment, "Where it began. Virtual time, as decimal text [ns]"]
    url: Annotated[
        str | None, "Of its page; the token there is the one of here. null: show_branch shows it instead of this world."
    ]


class Branches(Protocol):
    """Branches of one world. Awaits only `steptwin.later.Later`."""

    def list(self) -> Sequence[Branch]: ...

    async def start(self, moment: Nanos | None) -> Branch:
        """Raises `Misuse` for a moment that is not kept, `Refusal`, and `LineFailure` where it does not start."""
        ...

    async def end(self, branch: int) -> None:
        """Raises `Misuse` where there is no such branch."""
        ...


@request("branches", LOOK, "The branches of the world that are open.", tuple[Branch, ...])
@dataclass(frozen=True, slots=True)
class ListBranches:
    pass


@request(
    "start_branch",
    KEEP,
    "Begin another world, without ports, in the state of a moment of the past. It is a studio of its own, in which time "
    "stands at first. Nothing changes in the world here.",
    Branch,
)
@dataclass(frozen=True, slots=True)
class StartBranch:
    moment: Annotated[Nanos | None, Meaning("Which moment; the present without.", TIME, unit="ns", name="at_ns")] = None


@request("end_branch", KEEP, "End a branch; what is in it is lost.")
@dataclass(frozen=True, slots=True)
class EndBranch:
    branch: Annotated[int, Meaning("Its number.", whole(1, 2**53))]


@request(
    "show_branch",
    KEEP,
    "Show a branch in place of this world, whose time stands until it is shown again. Every viewer has to connect again.",
)
@dataclass(frozen=True, slots=True)
class ShowBranch:
    branch: Annotated[int, Meaning("Its number.", whole(1, 2**53))]


@request("leave_world", LOOK, "Show the world again from which this branch was begun, or this recording opened.")
@dataclass(frozen=True, slots=True)
class LeaveWorld:
    pass


PlaceRequest: TypeAlias = ShowBranch | LeaveWorld
BranchRequest: TypeAlias = ListBranches | StartBranch | EndBranch
