"""Branches of the world that a studio shows: studios of their own, in processes of their own."""

from __future__ import annotations

import asyncio
import pickle
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import NamedTuple

from steptwin.controller import Nanos
from steptwin.errors import Refusal
from steptwin.eventloop import later
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.studio.branched import MOST_BRANCHES, TOO_MANY_BRANCHES, BranchPoint, BranchState, unknown_branch
from steptwin.live.studio.options import StudioOptions
from steptwin.live.studio.processes import ChildProcesses, Process
from steptwin.live.timetravel import WorldTimeTravel
from steptwin.live.world import LiveWorld
from steptwin.messages import Message
from steptwin.studio.branchrequests import Branch

MODULE = "steptwin.live.studio.branch"


@dataclass(frozen=True, slots=True)
class BranchStart:
    """Start of a branch, which its process reads from its standard input, pickled."""

    own: StudioOptions
    ready_file: Path
    state: BranchState


class _OpenBranch(NamedTuple):
    process: Process
    shown: Branch


BRANCH_FROM_ELSEWHERE = Message(
    "live.branch-from-elsewhere",
    "a branch is reached from the computer of the studio only: there is none while others can reach it",
)
BRANCH = Message("live.branch", "branch {number}")


class WorldBranches:
    """See `steptwin.studio.branchrequests.Branches`. A `Link` of the server. ``own``: how their pages are served; None: they
    cannot be reached, so there are none."""

    def __init__(
        self, live: LiveWorld, realtime: RealTimeDriver, time_travel: WorldTimeTravel, own: StudioOptions | None
    ) -> None:
        self._point = BranchPoint(live, realtime, time_travel)
        self._own = own
        self._processes = ChildProcesses()
        self._open: dict[int, _OpenBranch] = {}
        self._starting = 0
        self._numbers = count(1)

    def list(self) -> Sequence[Branch]:
        return [branch.shown for branch in self._running().values()]

    def _running(self) -> dict[int, _OpenBranch]:
        """Without those that have ended by themselves."""
        self._open = {number: branch for number, branch in self._open.items() if branch.process.poll() is None}
        return self._open

    async def start(self, moment: Nanos | None) -> Branch:
        if self._own is None:
            raise Refusal(BRANCH_FROM_ELSEWHERE())
        if len(self._running()) + self._starting >= MOST_BRANCHES:
            raise Refusal(TOO_MANY_BRANCHES(most=MOST_BRANCHES))
        self._starting += 1
        try:
            number = next(self._numbers)
            state = await self._point.state(number, moment)
            branch = await later(asyncio.to_thread(self._begin, self._own, number, state))
        finally:
            self._starting -= 1
        self._open[number] = branch
        return branch.shown

    def _begin(self, own: StudioOptions, number: int, state: BranchState) -> _OpenBranch:
        """Blocks until its page is there."""
        ready = self._processes.folder / f"{number}.ready.json"
        process = self._processes.start(MODULE, given=pickle.dumps(BranchStart(own, ready, state)))
        url = self._processes.url(process, ready, BRANCH(number=number))
        return _OpenBranch(process, Branch(number, state.snapshot.now, url))

    async def end(self, branch: int) -> None:
        found = self._running().pop(branch, None)
        if found is None:
            raise unknown_branch(branch, self._open)
        await later(asyncio.to_thread(self._processes.end, found.process))

    async def close(self) -> None:
        await asyncio.to_thread(self._processes.close)
