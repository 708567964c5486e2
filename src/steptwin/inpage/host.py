"""The twin's worker of a page: a world and its studio, in one event loop, without sockets, threads and files."""

from __future__ import annotations

import asyncio
import json
import pickle
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

from steptwin import __version__
from steptwin.access.audit import Audit
from steptwin.access.roles import Role
from steptwin.access.tokens import AccessGate
from steptwin.controller import MILLISECOND, Nanos
from steptwin.errors import Misuse
from steptwin.files.auditfile import wall_clock
from steptwin.files.world import World
from steptwin.inpage.connections import Connections, Page, report
from steptwin.inpage.linked import LinkedTexts
from steptwin.inpage.recordings import PageRecordings
from steptwin.live.clock import Clock
from steptwin.live.pace import Pace
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.studio.shownworld import ShownWorld
from steptwin.live.world import LiveWorld
from steptwin.live.world_control import WorldControl
from steptwin.simulation.describe.blueprint import Blueprint
from steptwin.simulation.describe.description import read_world
from steptwin.simulation.describe.includes import given_files
from steptwin.simulation.scheduler.trace import Mark
from steptwin.studio.hub import Hub
from steptwin.studio.surroundings import Connections as DeviceConnections
from steptwin.studio.viewers import Viewers

SLICE_NS: Nanos = 20 * MILLISECOND
"""Longest real time for which the world advances at once: a stop waits no longer for it."""
KEPT_S = 1.0
"""A state is given to the page so often, in real time."""


class PageTwin:
    """A world that goes on in a page. Everybody there is an engineer: nobody else reaches it."""

    def __init__(
        self,
        page: Page,
        name: str,
        text: str,
        files: Mapping[str, bytes | memoryview],
        clock: Callable[[], Nanos] = time.monotonic_ns,
        kept: bytes | None = None,
    ) -> None:
        """``text``: a description; ``files``: those that it names; ``kept``: a state of this twin that the page was given, from
        which it goes on instead, unrecorded, for its beginning is not known. Raises `WorldError` for a wrong description."""
        contents = {file: bytes(content) for file, content in files.items()}
        self.world = world = World.from_toml(text, contents, name=name) if kept is None else _world_at(name, kept)
        world.trace.let_go()
        self._page = page
        self._text = text
        self._begins_at = 1.0 if kept is None else 0.0
        self._stands_hidden = False
        self._live = live = LiveWorld(world)
        self._realtime = realtime = RealTimeDriver(live, Clock(wall_ns=clock, begin=world.now), SLICE_NS)
        self.pace = Pace(live, realtime, live.show, has_clients=False)
        shown = ShownWorld(live, realtime, self.pace, WorldControl(realtime, live, self.pace, None))
        around = shown.surroundings(
            gate=AccessGate(open_to=Role.ENGINEER),
            audit=Audit(wall_clock),
            program=__version__,
            on_internal=partial(report, page),
            recordings=PageRecordings(live, page, realtime.enter, self._leave),
        )
        self.subject = shown.subject
        self.hub = Hub(shown.subject, shown.subject, around)
        self.connections = Connections(Viewers(self.hub, clock).serve, page)
        self.texts: Callable[[], Mapping[str, bytes]] = around.programs.files
        """Texts of the programs at present, by address, for an editor server."""
        self._linked = LinkedTexts(world.blueprint.files, around.programs)

    def link(self) -> str:
        """Description and programs at present as JSON, as a link has them; ``refused`` is why it cannot have them."""
        try:
            return json.dumps({"description": self._text, "programs": self._linked.present()})
        except Misuse as error:
            return json.dumps({"refused": str(error)})

    def offer(self, connections: DeviceConnections) -> None:
        """Devices can be connected from now on; viewers are told."""
        self.hub.around = replace(self.hub.around, connections=connections)
        self.hub.descriptions += 1

    def begin(self) -> None:
        """Time goes from now on; it stands at a state that was kept, for what came after it may happen again."""
        self.pace.begin(self._begins_at)
        self._keep()

    def hide(self, is_hidden: bool) -> None:
        """Stop time because the page is hidden; when it is seen again, time goes on if it went before."""
        if is_hidden and not self.pace.is_paused:
            self._stands_hidden = True
            self.pace.pause()
        elif not is_hidden and self._stands_hidden:
            self._stands_hidden = False
            self.pace.resume()

    def _keep(self) -> None:
        state = replace(self.world.snapshot(with_inputs=False), trace=Mark(()))  # as a branch begins: without a past
        self._leave()
        self._page.keep(pickle.dumps(state))
        asyncio.get_running_loop().call_later(KEPT_S, self._keep)

    def _leave(self) -> None:
        """The world has been looked at as a whole."""
        self._live.is_dirty = True
        self._realtime.leave()


def _world_at(name: str, kept: bytes) -> World:
    state = pickle.loads(kept)  # pickled by `PageTwin._keep`; only the page has had it since
    text, seed, overrides, files = state.description
    return World(Blueprint(read_world(name, text, seed, overrides, given_files(files)), files), keep_inputs=False, at=state)


def open_twin(
    page: Page, name: str, text: str, files: Mapping[str, bytes | memoryview], kept: bytes | None = None
) -> PageTwin | None:
    """A twin that can be used; None where its description is wrong, after the page was given the reason."""
    try:
        twin = PageTwin(page, name, text, files, kept=kept and bytes(kept))
    except Misuse as error:
        page.refused(str(error))
        return None
    twin.begin()
    return twin
