"""What clients of a gateway may do: the roles of `steptwin.access`, by tokens."""

from __future__ import annotations

import asyncio
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from steptwin.access.commands import PERMITS
from steptwin.access.roles import LOOK, Role
from steptwin.errors import Refusal, SteptwinError
from steptwin.gateways.contract import GatewaySubject
from steptwin.subject.commands import Command, Home, Move, ReadState, StopAxes, plain_command, row_of
from steptwin.subject.contract import Result
from steptwin.subject.dispatch import code_of
from steptwin.subject.following import Filter, Following
from steptwin.subject.payloads import InputPayload, StatusPayload
from steptwin.tracing import span
from steptwin.world.script import Write


def address_text(address: object) -> str:
    """``HOST:PORT`` of a socket."""
    return ":".join(map(str, address[:2])) if isinstance(address, tuple | list) else str(address)


class NotPermitted(Refusal):
    """The role of a client is not high enough."""


class Ignored(Refusal):
    """The controller has accepted a command and does nothing, because its drive is off."""


MOST_EVENTS = 256
"""The most events of one command."""
IGNORED = "ignored: not enabled"
"""Its outcome in the audit log."""
NOT_ENABLED = "drive-off"
"""The event of a controller that ignores a command (`steptwin.datasheet.Datasheet.events`)."""
LOOKS_AT_DRIVE, BETWEEN_LOOKS_S = 6, 0.05
"""So often is it seen whether a drive is on before a motion is refused: what switches it on may be on its way."""
MOVING = (Move, Home, Write)
"""Commands that a controller may ignore; a jog is refused, and devices are asked by their drivers first."""


@dataclass(frozen=True, slots=True)
class GatewayClient:
    """A client that has been admitted."""

    name: str
    role: Role
    place: str = ""
    """The protocol, and where it is as far as that is known."""

    def __str__(self) -> str:
        return f"{self.name} ({self.place})"

    async def do(self, subject: GatewaySubject, wanted: Command) -> Result:
        """Raises `NotPermitted`, `Misuse`, `Refusal` and `LineFailure`."""
        with self.noted(subject, wanted):
            self.check(wanted)
            return await _done(subject, wanted)

    @contextmanager
    def noted(self, subject: GatewaySubject, wanted: Command) -> Generator[None]:
        """Record a command in the audit log of ``subject``, with what becomes of it within. Who looks is not recorded."""
        outcome, name = "internal", row_of(wanted).name
        try:
            with span(f"gateway {name}", {"command": name, "client": str(self), "role": self.role.title}):
                yield
            outcome = "done"
        except SteptwinError as error:
            outcome = IGNORED if isinstance(error, Ignored) else code_of(error)
            raise
        finally:
            if subject.audit is not None and (isinstance(wanted, StopAxes) or PERMITS[row_of(wanted).name] != LOOK):
                fields = plain_command(wanted)
                subject.audit(self, str(fields.pop("do")), fields, outcome)

    def refused(self, subject: GatewaySubject, do: str, fields: Mapping[str, object], why: str = "misuse") -> None:
        """Record what never became a command: ``do`` says what was asked for."""
        if subject.audit is not None:
            subject.audit(self, do, fields, why)

    def check(self, wanted: Command) -> None:
        """Raises `NotPermitted`."""
        name = row_of(wanted).name
        self.check_role(name, PERMITS[name].role)

    def check_role(self, name: str, needed: Role) -> None:
        """Raises `NotPermitted` for what ``name`` stands for."""
        if self.role < needed:
            raise NotPermitted(f"{name} is for the role {needed.title}; {self.name} has the role {self.role.title}")


async def _done(subject: GatewaySubject, wanted: Command) -> Result:
    """Raises `Ignored` for what a controller has not done although it has accepted it."""
    if not isinstance(wanted, MOVING):
        return await subject.do(wanted)
    axis = str(wanted.axis) if isinstance(wanted, Move | Home) else None
    machines = frozenset(one[0] for one in wanted.values) if isinstance(wanted, Write) else frozenset({wanted.machine})
    axes = None if axis is None else frozenset({axis})
    following = subject.follow(Filter(frozenset({"status", "input"}), machines, axes), MOST_EVENTS)
    try:
        if isinstance(wanted, Move | Home):
            await _check_drive(subject, wanted, following)
        result = await subject.do(wanted)
        for event in following.take().events:
            # What was due before has happened before it; a world does it at once.
            if event.number > result.number and isinstance(event.payload, StatusPayload) and event.payload.code == NOT_ENABLED:
                raise Ignored(f"{event.machine}: {event.text}: switch its drive on first")
        return result
    finally:
        following.close()


async def _check_drive(subject: GatewaySubject, wanted: Move | Home, following: Following) -> None:
    """Raises `Ignored` for a twin on a line whose drive is off, because its answer may come later, and `Refusal` after a stop."""
    part = next((one for one in subject.description.machines if one.name == wanted.machine), None)
    if part is None or part.is_real or part.line is None:
        return
    if not any(one.command == "enable" and one.axis == wanted.axis for one in part.takes):
        return
    for _ in range(LOOKS_AT_DRIVE):
        state: Any = (await subject.do(ReadState(part.name))).value
        drive = next(one for one in state["axes"] if one["number"] == wanted.axis)
        if drive["enabled"] is not False:
            return
        await asyncio.sleep(BETWEEN_LOOKS_S)
        missed, events = following.take()
        if missed or any(isinstance(one.payload, InputPayload) and one.payload.what == "stop" for one in events):
            raise Refusal(f"{row_of(wanted).name} was not sent: a stop was requested meanwhile")
    raise Ignored(f"{part.name}: M{wanted.axis} is not enabled: switch its drive on first")
