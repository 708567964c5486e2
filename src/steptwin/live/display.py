"""The output of a running world: lines of text, or a live view on a terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from steptwin.files.world import World
from steptwin.live.output import Output
from steptwin.live.server import EndPoint, Server
from steptwin.live.world import LiveWorld
from steptwin.live.world_frames import subscribe_to_frames
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.world.records import ALL, Selection


class Display(Protocol):
    """The output of a running world."""

    def notice(self, text: str) -> None:
        """Show a notice."""
        ...

    def begin(self, head: Sequence[str], announcement: Mapping[str, object], past: Sequence[TraceRecord] = ()) -> None:
        """Show what is served (`banner`, and `Server.announcement`), the records so far, and all further ones."""
        ...

    async def show(self, server: Server) -> None:
        """Show the world until the server ends."""
        ...


class Lines:
    """Prints records and notices as lines, and with ``frames`` every frame."""

    def __init__(self, live: LiveWorld, output: Output, *, frames: bool, selection: Selection = ALL) -> None:
        self._live = live
        self._output = output
        self._selection = selection
        if frames:
            subscribe_to_frames(live, output.frame)

    def notice(self, text: str) -> None:
        self._output.notice(text)

    def begin(self, head: Sequence[str], announcement: Mapping[str, object], past: Sequence[TraceRecord] = ()) -> None:
        self._output.begin(head, announcement)
        for record in filter(self._selection.shows, past):
            self._output.record(record)
        self._live.world.trace.subscribers.append(self._print)

    async def show(self, server: Server) -> None:
        await server.until_ended()

    def _print(self, record: TraceRecord) -> None:
        if self._selection.shows(record):
            self._output.record(record)


class Notices:
    """Display of the head and of notices, without records. With ``frames`` every frame."""

    def __init__(self, live: LiveWorld, output: Output, *, frames: bool) -> None:
        self._output = output
        if frames:
            subscribe_to_frames(live, output.frame)

    def notice(self, text: str) -> None:
        self._output.notice(text)

    def begin(self, head: Sequence[str], announcement: Mapping[str, object], past: Sequence[TraceRecord] = ()) -> None:
        self._output.begin(head, announcement)

    async def show(self, server: Server) -> None:
        await server.until_ended()


def banner(world: World, end_points: Sequence[EndPoint], remarks: Sequence[str]) -> list[str]:
    """The first lines: world, end points, remarks."""
    width = max((len(end_point.protocol) for end_point in end_points), default=0)
    places = [f"  {end_point.protocol:<{width}}  {end_point.place}" for end_point in end_points]
    return [title_of(world), *places, *(f"  {remark}" for remark in remarks), "Ctrl-C ends"]


def title_of(world: World) -> str:
    """The name of the world and its controllers, in a line."""
    titles = {name: _titled(world, name) for name in world.controllers}
    if len(titles) == 1:
        return f"{world.spec.name}: {next(iter(titles.values()))}"
    return "; ".join([world.spec.name, *(f"{name}: {title}" for name, title in titles.items())])


def _titled(world: World, name: str) -> str:
    kind, on = world.kind(name), world.objects.line_of.get(name)
    where = {} if on is None else kind.announced(world.controllers[name], on[1])
    return ", ".join([kind.model, *(f"{key} {value}" for key, value in where.items() if key != "kind")])


def remarks_on(world: World, *, listen_any: bool) -> list[str]:
    """Remarks about risks: open addresses, memory that is not kept."""
    found = [remark for name, controller in world.controllers.items() for remark in world.kind(name).remarks(name, controller)]
    if listen_any:
        found.append("the lines have no authentication: any client that reaches these addresses can move the axes")
    lasting = {name: world.kind(name).keeps_memory(controller) for name, controller in world.controllers.items()}
    where = world.state
    if where is None and any(lasting.values()):
        found.append("non-volatile memory is lost at the end of this process (--state DIR keeps it)")
    elif where is not None:
        found += [f"{name} has no non-volatile memory: {where} keeps nothing of it" for name in lasting if not lasting[name]]
    return found
