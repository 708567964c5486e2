"""Opens the gateways of a world or of devices, beside its lines."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from steptwin.gateways import make_gateway
from steptwin.gateways.contract import GatewaySubject
from steptwin.live.server import EndPoint, Server
from steptwin.live.world import LiveWorld
from steptwin.live.world_control import WorldControl
from steptwin.subject.commands import Command, Jog
from steptwin.subject.contract import Description, Reading, Result
from steptwin.subject.following import Filter, Following
from steptwin.subject.jogs import Held, WorldJogs
from steptwin.world.gateways import GatewaySpec


async def open_gateways(
    server: Server, specs: Iterable[GatewaySpec], folder: Path, subject: GatewaySubject, *, listen_any: bool
) -> None:
    """Open those of a file in ``folder``. Raises `Misuse` or `LineFailure` for one that cannot be opened."""
    for spec in specs:
        gateway = make_gateway(spec, subject, folder)
        details = await gateway.open(listen_any=listen_any)
        place = str(details.get("url") or f"{details['host']}:{details['port']}")
        server.join(gateway, EndPoint(spec.kind, place, gateway.protocol, details))


class LiveWorldSubject:
    """A live world for gateways: it answers at once."""

    def __init__(self, control: WorldControl, live: LiveWorld) -> None:
        self._control = control
        self._live = live

    @property
    def description(self) -> Description:
        return self._control.description

    def read(self, *points: str) -> tuple[Reading, ...]:
        return self._control.read(*points)

    async def do(self, wanted: Command, /) -> Result:
        return self._control.do(wanted)

    async def begin_jog(self, wanted: Jog, /) -> Held:
        if not isinstance(self._live.companion, WorldJogs):
            self._live.companion = WorldJogs(self._live.subject, self._control.at_present)
        return await self._live.companion.begin(wanted)

    def follow(self, what: Filter, bound: int) -> Following:
        return self._control.follow(what, bound)
