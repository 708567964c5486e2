"""Requests for branches: worlds without ports that begin at a moment of the past of the world that is shown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Protocol, TypeAlias

from steptwin.access.roles import KEEP, LOOK
from steptwin.controller import Nanos
from steptwin.fields import TIME, Meaning, Schema, whole
from steptwin.jsonvalues import MOMENT, TEXT, WHOLE, list_of, members
from steptwin.studio.requesttype import request


class Branches(Protocol):
    """Branches of one world. Awaits only `steptwin.later.Later`."""

    def to_json(self) -> Sequence[Mapping[str, object]]:
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
        "branch": WHOLE,
        "from_ns": {**MOMENT, "description": "Where it began. Virtual time, as decimal text [ns]"},
        "url": {**TEXT, "description": "Of its page; the token there is the one of here."},
    }
)


@request("branches", LOOK, "The branches of the world that are open.", list_of(_BRANCH))
@dataclass(frozen=True, slots=True)
class ListBranches:
    pass


@request(
    "start_branch",
    KEEP,
    "Begin another world, without ports, in the state of a moment of the past. It is a studio of its own, in which time "
    "stands at first. Nothing changes in the world here.",
    _BRANCH,
)
@dataclass(frozen=True, slots=True)
class StartBranch:
    moment: Annotated[Nanos | None, Meaning("Which moment; the present without.", TIME, unit="ns", name="at_ns")] = None


@request("end_branch", KEEP, "End a branch; what is in it is lost.")
@dataclass(frozen=True, slots=True)
class EndBranch:
    branch: Annotated[int, Meaning("Its number.", whole(1, 2**53))]


BranchRequest: TypeAlias = ListBranches | StartBranch | EndBranch
