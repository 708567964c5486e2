"""The twin's worker of a page: worlds and their studios, in one event loop, without sockets, threads and files."""

from __future__ import annotations

import asyncio
import json
import pickle
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Protocol

from steptwin.access.roles import Role
from steptwin.controller import Nanos
from steptwin.devices.composite import CompositeSubject
from steptwin.errors import Misuse, Refusal
from steptwin.files.world import World
from steptwin.inpage.branches import PageBranches
from steptwin.inpage.campaigns import TEMPLATE, CampaignPage, PageCampaigns
from steptwin.inpage.connections import Connections, Page
from steptwin.inpage.linked import LinkedTexts
from steptwin.inpage.pagestudio import PageStudio
from steptwin.inpage.recordings import PageRecordings
from steptwin.live.studio.branched import without_past
from steptwin.live.studio.recorded import Replayed
from steptwin.messages import Message
from steptwin.simulation.describe.blueprint import Blueprint
from steptwin.simulation.describe.description import read_world
from steptwin.simulation.describe.includes import given_files
from steptwin.simulation.world.model import WORLD
from steptwin.studio.surroundings import Connections as DeviceConnections
from steptwin.studio.viewers import AsgiReceive, AsgiScope, AsgiSend
from steptwin.subject.payloads import StatusPayload

KEPT_S = 1.0
"""A state is given to the page so often, in real time."""
NOT_BESIDE_DEVICES = Message(
    "inpage.not-beside-devices",
    "another world cannot be shown while devices are connected: Stop all would not reach them from there. Disconnect them first",
)


class TwinPage(Page, CampaignPage, Protocol):
    """Messages to the page of a twin."""


class PageTwin:
    """The machine of a page, its branches, and a recording that is viewed: one of them is shown. Everybody is an engineer, for
    nobody else reaches it; in a recording nothing can be changed."""

    def __init__(
        self,
        page: TwinPage,
        name: str,
        text: str,
        files: Mapping[str, bytes | memoryview],
        clock: Callable[[], Nanos] = time.monotonic_ns,
        kept: bytes | None = None,
        campaign: str | None = None,
    ) -> None:
        """``text``: a description; ``files``: those that it names; ``kept``: a state of this twin that the page was given, from
        which it goes on instead, unrecorded, for its beginning is not known; ``campaign``: the text of one that belongs to it.
        Raises `WorldError` for a wrong description."""
        contents = {file: bytes(content) for file, content in files.items()}
        self.world = world = World.from_toml(text, contents, name=name) if kept is None else _world_at(name, kept)
        self._page = page
        self._clock = clock
        self._name = name
        self._text = text
        self._begins_at = 1.0 if kept is None else 0.0
        self._machine = self._shown = machine = PageStudio(world, page, clock)
        self.hub = machine.hub
        self.subject: CompositeSubject = machine.subject
        recordings = PageRecordings(machine, page, self._check_devices, self._view)
        self.campaigns = campaigns = PageCampaigns(page, campaign or TEMPLATE.format(world=f"{name}.toml"), self._files)
        self.hub.around = replace(
            self.hub.around,
            recordings=recordings,
            recording_files=recordings,
            campaigns=campaigns,
            campaign_texts=campaigns,
        )
        self._offer_branches(machine)
        self.connections = Connections(self._serve, page)
        self._linked = LinkedTexts(world.blueprint.files, self.hub.around.programs)

    async def _serve(self, scope: AsgiScope, receive: AsgiReceive, send: AsgiSend) -> None:
        await self._shown.serve(scope, receive, send)

    def texts(self) -> Mapping[str, bytes]:
        """Texts of the programs of what is shown, by address, for an editor server."""
        return self._shown.texts()

    def link(self) -> str:
        """Description and programs of the machine at present as JSON, as a link has them; ``refused``: why it has none."""
        try:
            return json.dumps({"description": self._text, "programs": self._linked.linked()})
        except Misuse as error:
            return json.dumps({"refused": str(error)})

    def _files(self) -> Mapping[str, bytes]:
        return {f"{self._name}.toml": self._text.encode(), **self._linked.files()}

    def offer(self, connections: DeviceConnections) -> None:
        """Devices can be connected to the machine from now on; viewers are told."""
        self.hub.around = replace(self.hub.around, connections=connections)
        self.hub.descriptions += 1

    def begin(self) -> None:
        """Time goes from now on; it stands at a state that was kept, for what came after it may happen again."""
        self._machine.pace.begin(self._begins_at)
        self._keep()

    def hide(self, is_hidden: bool) -> None:
        """Stop time because the page is hidden; when it is seen again, time goes on if it went before."""
        self._shown.hide(is_hidden)

    # ------------------------------------------------------------------ worlds in place of the machine

    def _offer_branches(self, studio: PageStudio) -> None:
        branches = PageBranches(studio, partial(self._branch, studio), lambda: self._machine.opened)
        studio.hub.around = replace(
            studio.hub.around, branches=branches, show_branch=lambda number: self._show(branches.studio(number))
        )

    def _branch(self, above: PageStudio, world: World) -> PageStudio:
        studio = PageStudio(world, self._page, self._clock)
        self._offer_branches(studio)
        studio.hub.around = replace(studio.hub.around, leave_world=lambda: self._show(above))
        return studio

    def _view(self, found: Replayed) -> None:
        """Show a recording; it ends when it is left."""
        world, snapshots, differs = found
        above, studio = self._shown, PageStudio(world, self._page, self._clock, role=Role.VIEWER, snapshots=snapshots)
        if differs:
            studio.live.subject.publish(world.now, WORLD, StatusPayload("replay-differs", differs))

        def leave() -> None:
            self._show(above)
            studio.end()

        studio.hub.around = replace(studio.hub.around, leave_world=leave)
        self._show(studio)

    def _show(self, studio: PageStudio) -> None:
        self._check_devices()
        self._shown.hide(True)
        self._shown = studio
        studio.hide(False)
        self._page.swapped()

    def _check_devices(self) -> None:
        """Raises `Refusal` where there are any."""
        if self.subject.has_devices:
            raise Refusal(NOT_BESIDE_DEVICES())

    # ------------------------------------------------------------------ states for the page

    def _keep(self) -> None:
        state = without_past(self.world.snapshot(with_inputs=False))
        self._machine.leave()
        self._page.keep(pickle.dumps(state))
        asyncio.get_running_loop().call_later(KEPT_S, self._keep)


def _world_at(name: str, kept: bytes) -> World:
    state = pickle.loads(kept)  # pickled by `PageTwin._keep`; only the page has had it since
    text, seed, overrides, files = state.description
    return World(Blueprint(read_world(name, text, seed, overrides, given_files(files)), files), keep_inputs=False, at=state)


def open_twin(
    page: TwinPage,
    name: str,
    text: str,
    files: Mapping[str, bytes | memoryview],
    kept: bytes | None = None,
    campaign: str | None = None,
) -> PageTwin | None:
    """A twin that can be used; None where its description is wrong, after the page was given the reason."""
    try:
        twin = PageTwin(page, name, text, files, kept=kept and bytes(kept), campaign=campaign)
    except Misuse as error:
        page.refused(str(error))
        return None
    twin.begin()
    return twin
