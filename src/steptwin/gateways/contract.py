"""The interface of gateways."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from datetime import datetime
from typing import NamedTuple, Protocol

from steptwin.access.audit import CommandLog
from steptwin.gateways.sampling import SharedSamples
from steptwin.simulation.kinds.lines import LineTraffic
from steptwin.subject.commands import Jog
from steptwin.subject.contract import AsyncSubject
from steptwin.subject.jogs import ExtendableJog


class HistoryValue(NamedTuple):
    """A value that held from a moment on; None: it was not known."""

    at: datetime
    value: float | str | None


class OpenGateway(NamedTuple):
    """A gateway that has been opened."""

    kind: str
    """The name of its table: ``opcua``, ``history``."""
    place: str
    """Its address for people."""
    gateway: Gateway


class HistoryValues(Protocol):
    """The values that a history has kept."""

    async def values(self, point: str, begin: datetime | None, end: datetime | None, most: int | None) -> list[HistoryValue]:
        """Values of ``CONTROLLER.POINT``, oldest first: the one at ``begin``, the others up to ``end``; at most ``most``.

        Raises `Misuse` for what has not been kept, `LineFailure`.
        """
        ...


class GatewaySubject(AsyncSubject, Protocol):
    """Subject of gateways: a world, or devices. Answers of devices come later."""

    @property
    def samples(self) -> SharedSamples:
        """Shared part of the samplers of its gateways."""
        ...

    @property
    def history(self) -> HistoryValues | None:
        """None where no history is kept."""
        ...

    @property
    def audit(self) -> CommandLog | None:
        """None where commands are not recorded."""
        ...

    async def begin_jog(self, wanted: Jog, /) -> ExtendableJog:
        """A jog that goes on while it is extended (`ExtendableJog.lasts_ns`). Raises as `do`."""
        ...

    def traffic(self) -> Mapping[str, LineTraffic]:
        """Traffic on each line, by its name; that of a device by ``NAME.line``."""
        ...


class ClientState(NamedTuple):
    """A program that uses a gateway."""

    name: str
    place: str
    """Where it is, as far as that is known."""
    role: str
    """Its title; empty where the protocol has no clients with roles."""
    follows: tuple[str, ...] = ()
    """The values that it is sent when they change, by the names of the protocol."""


class GatewayState(NamedTuple):
    """The present state of a gateway."""

    is_up: bool
    text: str
    """In words, such as why it is not up."""
    shown: int | None = None
    """How many values it shows; None where that is no fixed number."""
    clients: tuple[ClientState, ...] | None = None
    """None where they are those of a broker or database, which alone knows them."""


class Gateway(Protocol):
    """A gateway in the event loop of its subject."""

    @property
    def protocol(self) -> str:
        """Its name for people."""
        ...

    async def open(self, *, listen_any: bool, notice: Callable[[str], None]) -> Mapping[str, object]:
        """Listen, or connect; ``notice`` is called with what a user has to know later.

        The end point for programs, with ``host``, ``port`` and, where there is one, ``url``.

        Raises `Misuse` for an address that is not permitted, `LineFailure` for one that cannot be used.
        """
        ...

    def state(self) -> GatewayState: ...

    async def close(self) -> None: ...
