"""A branch of a live world: where it begins, and its world."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from steptwin.controller import MILLISECOND, Nanos
from steptwin.errors import Misuse
from steptwin.files.world import World
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.timetravel import WorldTimeTravel
from steptwin.live.world import LiveWorld, send_away
from steptwin.messages import NONE, Message
from steptwin.simulation.describe.blueprint import Blueprint
from steptwin.simulation.describe.description import read_world
from steptwin.simulation.describe.includes import given_files
from steptwin.simulation.scheduler.trace import Mark
from steptwin.simulation.world.snapshot import SimulationSnapshot

MOST_BRANCHES = 4
TOO_MANY_BRANCHES = Message("live.too-many-branches", "too many branches: the limit is {most}; end one")
UNKNOWN_BRANCH = Message("live.unknown-branch", "no branch {branch}: open are {names}")


def unknown_branch(branch: int, open_ones: Iterable[int]) -> Misuse:
    return Misuse(UNKNOWN_BRANCH(branch=branch, names=list(open_ones) or NONE()))


@dataclass(frozen=True, slots=True)
class BranchState:
    """Where a branch begins. ``source`` is the name of the description. Its trace and its inputs begin anew: nothing of the past
    is recorded there."""

    name: str
    source: str
    snapshot: SimulationSnapshot

    def world(self) -> World:
        """Its world, with no programs on its lines."""
        text, seed, overrides, files = self.snapshot.description
        spec = read_world(self.source, text, seed, overrides, given_files(files))
        world = World(Blueprint(replace(spec, name=self.name), files), keep_trace=False, keep_inputs=False, at=self.snapshot)
        send_away(world)
        return world


def without_past(snapshot: SimulationSnapshot) -> SimulationSnapshot:
    """The same state, in which the trace and the inputs begin."""
    return replace(snapshot, inputs=(), trace=Mark(()))


class BranchPoint:
    """Moments of ``live`` from which branches begin."""

    def __init__(self, live: LiveWorld, realtime: RealTimeDriver, time_travel: WorldTimeTravel) -> None:
        self._live = live
        self._realtime = realtime
        self._time_travel = time_travel

    async def state(self, number: int, moment: Nanos | None) -> BranchState:
        """That of the branch with a number; the present without ``moment``. Raises as `WorldTimeTravel.state_at`."""
        self._realtime.enter()
        snapshot = await self._time_travel.state_at(self._live.now if moment is None else moment)
        spec = self._live.world.spec
        name = f"{spec.name}, branch {number} from {snapshot.now // MILLISECOND / 1000:.3f} s"
        return BranchState(name, spec.text.source.name, without_past(snapshot))
