"""Opens the gateways and the history of a world or of devices, beside its lines."""

from __future__ import annotations

import gc
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from steptwin.access.audit import Audit, CommandLog
from steptwin.controller import Nanos
from steptwin.extras import missing
from steptwin.gateways.contract import GatewaySubject, HistoryValues, OpenGateway
from steptwin.gateways.kinds import make_gateway
from steptwin.gateways.sampling import SharedSamples
from steptwin.history.options import HistorySpec
from steptwin.live.server import EndPoint, Server
from steptwin.live.world import LiveWorld
from steptwin.live.world_control import WorldControl
from steptwin.services import Services
from steptwin.simulation.describe.servicetables import HISTORY
from steptwin.simulation.kinds.lines import LineTraffic
from steptwin.subject.commands import Command, Jog, type_of
from steptwin.subject.contract import Description, Reading, Result
from steptwin.subject.events import Event
from steptwin.subject.jogs import ExtendableJog, WorldJogs
from steptwin.subject.subscriptions import Filter, Subscription
from steptwin.tracing import span

if TYPE_CHECKING:
    from steptwin.history.keeper import HistoryKeeper


class KeptSubject(GatewaySubject, Protocol):
    """A subject that gets its history."""

    history: HistoryValues | None
    audit: CommandLog | None


@contextmanager
def without_collections() -> Generator[None]:
    """Suspend the garbage collector. Libraries of gateways make half a million objects that stay: to look through them again and
    again took a third of a start, 1.7 s of a core with all of them."""
    is_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if is_on:
            gc.enable()


async def open_gateways(
    server: Server,
    services: Services,
    folder: Path,
    subject: KeptSubject,
    audit: Audit | None,
    *,
    listen_any: bool,
) -> list[OpenGateway]:
    """Open those of a description in ``folder``. The history keeps the entries of ``audit``.

    Raises `Misuse` or `LineFailure` for one that cannot be opened.
    """
    opened: list[OpenGateway] = []
    if services.history is not None:
        keeper = _make_keeper(services.history, subject, folder)
        details = await keeper.open(listen_any=listen_any, notice=server.notice)
        server.join(keeper, EndPoint(HISTORY, str(details["url"]), keeper.protocol, details))
        opened.append(OpenGateway(HISTORY, str(details["url"]), keeper))
        subject.history = keeper.history
        if audit is not None:
            audit.subscribers.append(keeper.log)
    with without_collections():
        for spec in services.gateways:
            gateway = make_gateway(spec, subject, folder)
            details = await gateway.open(listen_any=listen_any, notice=server.notice)
            place = str(details.get("url") or f"{details['host']}:{details['port']}")
            server.join(gateway, EndPoint(spec.kind, place, gateway.protocol, details))
            opened.append(OpenGateway(spec.kind, place, gateway))
    return opened


def _make_keeper(spec: HistorySpec, subject: GatewaySubject, folder: Path) -> HistoryKeeper:
    try:
        from steptwin.history.keeper import HistoryKeeper
    except ImportError:
        raise missing(f"[{HISTORY}]", HISTORY) from None
    return HistoryKeeper(spec, subject, folder)


def command_log_of(audit: Audit | None, now: Callable[[], Nanos]) -> CommandLog | None:
    """Log of commands of gateways that enters them into ``audit``, at the moment that ``now`` gives."""
    if audit is None:
        return None
    return lambda who, do, fields, outcome: audit.add(who, now(), do, fields, outcome)


class LiveWorldSubject:
    """A live world for gateways: it answers at once."""

    def __init__(self, control: WorldControl, live: LiveWorld) -> None:
        self.history: HistoryValues | None = None
        self.audit: CommandLog | None = None
        self._control = control
        self._live = live
        self.samples = SharedSamples(self)

    @property
    def description(self) -> Description:
        return self._control.description

    def read(self, *points: str) -> tuple[Reading, ...]:
        return self._control.read(*points)

    async def do(self, wanted: Command, /) -> Result:
        name = type_of(wanted).name
        with span(f"twin {name}", {"command": name}, is_part=True) as traced_span:
            result = self._control.do(wanted)
            traced_span.set_attribute("time_ns", result.time)
            traced_span.set_attribute("number", result.number)
        return result

    async def begin_jog(self, wanted: Jog, /) -> ExtendableJog:
        if not isinstance(self._live.external_actor, WorldJogs):
            self._live.external_actor = WorldJogs(self._live.subject, self._control.at_present)
        return await self._live.external_actor.begin_jog(wanted)

    def subscribe(self, what: Filter, bound: int) -> Subscription:
        return self._control.subscribe(what, bound)

    def traffic(self) -> Mapping[str, LineTraffic]:
        return {name: line.traffic for name, line in self._live.world.lines.items()}

    def plans(self, what: Filter) -> list[Event]:
        return self._control.plans(what)
