"""The interface of gateways."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from steptwin.subject.commands import Command, Jog
from steptwin.subject.contract import Description, Reading, Result
from steptwin.subject.following import Filter, Following
from steptwin.subject.jogs import Held


class GatewaySubject(Protocol):
    """What gateways see: a world, or devices. Answers of devices come later."""

    @property
    def description(self) -> Description: ...

    def read(self, *points: str) -> tuple[Reading, ...]:
        """Values known at present. `Misuse` for points that are not there."""
        ...

    async def do(self, wanted: Command, /) -> Result:
        """Execute a command. Raises `SteptwinError` for a refusal or a failure of a line."""
        ...

    async def begin_jog(self, wanted: Jog, /) -> Held:
        """A jog that goes on while it is extended (`Held.lasts_ns`). Raises as `do`."""
        ...

    def follow(self, what: Filter, bound: int) -> Following: ...


class Gateway(Protocol):
    """A gateway in the event loop of its subject."""

    @property
    def protocol(self) -> str:
        """Its name for people."""
        ...

    async def open(self, *, listen_any: bool) -> Mapping[str, object]:
        """Listen; the end point for programs, with ``host``, ``port`` and, where there is one, ``url``.

        Raises `Misuse` for an address that is not permitted, `LineFailure` for one that cannot be used.
        """
        ...

    async def close(self) -> None: ...
