"""Branches of a world of a page, each of which is shown in its place."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from steptwin.controller import Nanos
from steptwin.errors import Refusal
from steptwin.files.world import World
from steptwin.inpage.pagestudio import PageStudio
from steptwin.live.studio.branched import MOST_BRANCHES, TOO_MANY_BRANCHES, unknown_branch
from steptwin.studio.branchrequests import Branch


class PageBranches:
    """See `steptwin.studio.branchrequests.Branches`. ``open_world`` makes the studio of a branch; ``opened`` counts those of
    all worlds, which share the memory of the page."""

    def __init__(self, studio: PageStudio, open_world: Callable[[World], PageStudio], opened: Callable[[], int]) -> None:
        self._studio = studio
        self._open_world = open_world
        self._opened = opened

    def list(self) -> Sequence[Branch]:
        return [Branch(number, one.begin, None) for number, one in self._studio.branches.items()]

    async def start(self, moment: Nanos | None) -> Branch:
        if self._opened() >= MOST_BRANCHES:
            raise Refusal(TOO_MANY_BRANCHES(most=MOST_BRANCHES))
        studio = self._studio
        number = next(studio.numbers)
        state = await studio.point.state(number, moment)
        studio.branches[number] = self._open_world(state.world())
        return Branch(number, state.snapshot.now, None)

    async def end(self, branch: int) -> None:
        self.studio(branch)
        self._studio.branches.pop(branch).end()

    def studio(self, branch: int) -> PageStudio:
        """Raises `Misuse` where there is no such branch."""
        found = self._studio.branches.get(branch)
        if found is None:
            raise unknown_branch(branch, self._studio.branches)
        return found
