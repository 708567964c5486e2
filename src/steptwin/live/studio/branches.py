"""Branches of the world that a studio shows: studios of their own, in processes of their own."""

from __future__ import annotations

import asyncio
import pickle
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import NamedTuple

from steptwin.controller import MILLISECOND, Nanos
from steptwin.errors import Misuse, Refusal
from steptwin.eventloop import later
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.studio.options import StudioOptions
from steptwin.live.studio.processes import ChildProcesses, Process
from steptwin.live.timetravel import WorldTimeTravel
from steptwin.live.world import LiveWorld
from steptwin.messages import NONE, Message
from steptwin.simulation.scheduler.trace import Mark
from steptwin.simulation.world.snapshot import SimulationSnapshot
from steptwin.studio.branchrequests import Branch

MOST_BRANCHES = 4
MODULE = "steptwin.live.studio.branch"


@dataclass(frozen=True, slots=True)
class BranchStart:
    """Start of a branch, which its process reads from its standard input, pickled. ``source`` is the name of the description."""

    own: StudioOptions
    ready_file: Path
    name: str
    source: str
    snapshot: SimulationSnapshot


class _OpenBranch(NamedTuple):
    process: Process
    shown: Branch


BRANCH_FROM_ELSEWHERE = Message(
    "live.branch-from-elsewhere",
    "a branch is reached from the computer of the studio only: there is none while others can reach it",
)
TOO_MANY_BRANCHES = Message("live.too-many-branches", "too many branches: the limit is {most}; end one")
BRANCH = Message("live.branch", "branch {number}")
UNKNOWN_BRANCH = Message("live.unknown-branch", "no branch {branch}: open are {names}")


class WorldBranches:
    """See `steptwin.studio.branchrequests.Branches`. A `Link` of the server. ``own``: how their pages are served; None: they
    cannot be reached, so there are none."""

    def __init__(
        self, live: LiveWorld, realtime: RealTimeDriver, time_travel: WorldTimeTravel, own: StudioOptions | None
    ) -> None:
        self._live = live
        self._realtime = realtime
        self._time_travel = time_travel
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
            self._realtime.enter()
            snapshot = await self._time_travel.state_at(self._live.now if moment is None else moment)
            number = next(self._numbers)
            branch = await later(asyncio.to_thread(self._begin, self._own, number, snapshot))
        finally:
            self._starting -= 1
        self._open[number] = branch
        return branch.shown

    def _begin(self, own: StudioOptions, number: int, snapshot: SimulationSnapshot) -> _OpenBranch:
        """Blocks until its page is there. Its trace and its inputs begin anew: nothing of the past is recorded there."""
        spec, ready = self._live.world.spec, self._processes.folder / f"{number}.ready.json"
        name = f"{spec.name}, branch {number} from {snapshot.now // MILLISECOND / 1000:.3f} s"
        begun = BranchStart(own, ready, name, spec.text.source.name, replace(snapshot, inputs=(), trace=Mark(())))
        process = self._processes.start(MODULE, given=pickle.dumps(begun))
        return _OpenBranch(process, Branch(number, snapshot.now, self._processes.url(process, ready, BRANCH(number=number))))

    async def end(self, branch: int) -> None:
        found = self._running().pop(branch, None)
        if found is None:
            raise Misuse(UNKNOWN_BRANCH(branch=branch, names=list(self._open) or NONE()))
        await later(asyncio.to_thread(self._processes.end, found.process))

    async def close(self) -> None:
        await asyncio.to_thread(self._processes.close)
