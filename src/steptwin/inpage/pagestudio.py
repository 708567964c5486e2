"""One of the worlds of a page, with its studio. One of them is shown, and only that one goes on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from itertools import count

from steptwin import __version__
from steptwin.access.audit import Audit
from steptwin.access.roles import Role
from steptwin.access.tokens import AccessGate
from steptwin.controller import MILLISECOND, Nanos
from steptwin.files.auditfile import wall_clock
from steptwin.files.world import World
from steptwin.inpage.connections import Page, report
from steptwin.live.clock import Clock
from steptwin.live.pace import Pace
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.studio.branched import BranchPoint
from steptwin.live.studio.shownworld import ShownWorld
from steptwin.live.world import LiveWorld
from steptwin.live.world_control import WorldControl
from steptwin.simulation.world.snapshotlog import SnapshotLog
from steptwin.studio.hub import Hub
from steptwin.studio.viewers import Viewers

SLICE_NS: Nanos = 20 * MILLISECOND
"""Longest real time for which the world advances at once: a stop waits no longer for it."""


class PageStudio:
    """A studio of ``world``, in which time stands at first. ``role``: what its viewers may; ``snapshots``: its past where it
    has one already."""

    def __init__(
        self,
        world: World,
        page: Page,
        clock: Callable[[], Nanos],
        *,
        role: Role = Role.ENGINEER,
        snapshots: SnapshotLog | None = None,
    ) -> None:
        world.trace.let_go()
        self.world = world
        self.branches: dict[int, PageStudio] = {}
        self.numbers = count(1)
        """Numbers of the branches that are made from here."""
        self.begin: Nanos = world.now
        self._stands = False
        """Whether time stands because it is not shown."""
        self.live = live = LiveWorld(world)
        self.realtime = realtime = RealTimeDriver(live, Clock(wall_ns=clock, begin=world.now), SLICE_NS)
        self.pace = Pace(live, realtime, live.show, has_clients=False)
        control = WorldControl(realtime, live, self.pace, None)
        shown = ShownWorld(live, realtime, self.pace, control, snapshots=snapshots)
        self._time_travel = shown.time_travel
        self.point = BranchPoint(live, realtime, shown.time_travel)
        around = shown.surroundings(
            gate=AccessGate(open_to=role), audit=Audit(wall_clock), program=__version__, on_internal=partial(report, page)
        )
        self.subject = shown.subject
        self.hub = Hub(shown.subject, shown.subject, around)
        self.serve = Viewers(self.hub, clock).serve
        self.texts: Callable[[], Mapping[str, bytes]] = around.programs.files
        """Texts of the programs at present, by address, for an editor server."""

    @property
    def opened(self) -> int:
        """The number of its branches, and of theirs."""
        return sum(1 + one.opened for one in self.branches.values())

    def hide(self, is_hidden: bool) -> None:
        """Stop time because nobody sees it; when it is seen again, time goes on if it went before."""
        if is_hidden and not self.pace.is_paused:
            self._stands = True
            self.pace.pause()
        elif not is_hidden and self._stands:
            self._stands = False
            self.pace.resume()

    def end(self) -> None:
        """It is shown no more, nor are its branches."""
        for one in self.branches.values():
            one.end()
        self._time_travel.end()
        self.pace.close()
        self.realtime.close()

    def leave(self) -> None:
        """The world has been looked at as a whole."""
        self.live.is_dirty = True
        self.realtime.leave()
