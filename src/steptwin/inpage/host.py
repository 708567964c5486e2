"""The twin's worker of a page: a world and its studio, in one event loop, without sockets, threads and files."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
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
from steptwin.live.clock import Clock
from steptwin.live.pace import Pace
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.studio.shownworld import ShownWorld
from steptwin.live.world import LiveWorld
from steptwin.live.world_control import WorldControl
from steptwin.studio.hub import Hub
from steptwin.studio.viewers import Viewers

SLICE_NS: Nanos = 20 * MILLISECOND
"""Longest real time for which the world advances at once: a stop waits no longer for it."""


class PageTwin:
    """A world that goes on in a page. Everybody there is an engineer: nobody else reaches it."""

    def __init__(
        self,
        page: Page,
        name: str,
        text: str,
        files: Mapping[str, bytes | memoryview],
        clock: Callable[[], Nanos] = time.monotonic_ns,
    ) -> None:
        """``text``: a description; ``files``: those that it names. Raises `WorldError` for a wrong description."""
        self.world = world = World.from_toml(text, {file: bytes(content) for file, content in files.items()}, name=name)
        world.trace.let_go()
        self._text = text
        live = LiveWorld(world)
        realtime = RealTimeDriver(live, Clock(wall_ns=clock, begin=world.now), SLICE_NS)
        self.pace = Pace(live, realtime, live.show, has_clients=False)
        shown = ShownWorld(live, realtime, self.pace, WorldControl(realtime, live, self.pace, None))
        around = shown.surroundings(
            gate=AccessGate(open_to=Role.ENGINEER),
            audit=Audit(wall_clock),
            program=__version__,
            on_internal=partial(report, page),
        )
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

    def begin(self) -> None:
        """Time goes from now on."""
        self.pace.begin(1.0)


def open_twin(page: Page, name: str, text: str, files: Mapping[str, bytes | memoryview]) -> PageTwin | None:
    """A twin whose time goes; None where its description is wrong, after the page was given the reason."""
    try:
        twin = PageTwin(page, name, text, files)
    except Misuse as error:
        page.refused(str(error))
        return None
    twin.begin()
    return twin
