"""Permissions of the clients of a gateway: the roles of `steptwin.access`, by tokens."""

from __future__ import annotations

import asyncio
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from steptwin.access.commands import PERMITS
from steptwin.access.roles import LOOK, Role
from steptwin.datasheet import PointEffect
from steptwin.errors import Refusal, SteptwinError
from steptwin.gateways.contract import GatewaySubject
from steptwin.simulation.script.steps import Request, Write
from steptwin.subject.commands import Command, Home, Move, ReadState, StopAxes, command_to_json, type_of
from steptwin.subject.contract import ControllerDescription, Result
from steptwin.subject.dispatch import code_of
from steptwin.subject.events import Event
from steptwin.subject.payloads import NOT_ENABLED, InputPayload, StatusPayload
from steptwin.subject.subscriptions import Filter, Subscription
from steptwin.tracing import span
from steptwin.wire.rtu import BROADCAST


def address_text(address: object) -> str:
    """``HOST:PORT`` of a socket."""
    return ":".join(map(str, address[:2])) if isinstance(address, tuple | list) else str(address)


class NotPermitted(Refusal):
    """The role of a client is not high enough."""


class Ignored(Refusal):
    """The controller has accepted a command and does nothing, because its drive is off. ``result`` is its answer."""

    result: Result | None = None


MOST_EVENTS = 256
"""The most events of one command."""
IGNORED = "ignored: not enabled"
"""Its outcome in the audit log."""
LOOKS_AT_DRIVE, BETWEEN_LOOKS_S = 6, 0.05
"""So often is it seen whether a drive is on before a motion is refused: what switches it on may be on its way."""
UNDER_WAY_S = 1.0
"""Time-out for the outcome of a motion that was written to a twin over its line."""
MOVING = (Move, Home, Write, Request)
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

    async def do(self, subject: GatewaySubject, wanted: Command, needed: Role | None = None) -> Result:
        """``needed``: the role for it, if not that of its name. A raw request is answered as the controller does it, also if that
        ignores it. Raises `NotPermitted`, `Misuse`, `Refusal` and `LineFailure`."""
        try:
            with self.audited(subject, wanted):
                name = type_of(wanted).name
                self.check_role(name, PERMITS[name].role if needed is None else needed)
                return await _done(subject, wanted)
        except Ignored as ignored:
            if isinstance(wanted, Request) and ignored.result is not None:
                return ignored.result
            raise

    @contextmanager
    def audited(self, subject: GatewaySubject, wanted: Command) -> Generator[None]:
        """Record a command in the audit log of ``subject``, with what becomes of it within. Who looks is not recorded."""
        outcome, name = "internal", type_of(wanted).name
        try:
            with span(f"gateway {name}", {"command": name, "client": str(self), "role": self.role.title}):
                yield
            outcome = "done"
        except SteptwinError as error:
            outcome = IGNORED if isinstance(error, Ignored) else code_of(error)
            raise
        finally:
            if subject.audit is not None and (isinstance(wanted, StopAxes) or PERMITS[type_of(wanted).name] != LOOK):
                fields = command_to_json(wanted)
                subject.audit(self, str(fields.pop("do")), fields, outcome)

    def refused(self, subject: GatewaySubject, do: str, fields: Mapping[str, object], why: str = "misuse") -> None:
        """Record what never became a command: ``do`` says what was asked for."""
        if subject.audit is not None:
            subject.audit(self, do, fields, why)

    def check(self, wanted: Command) -> None:
        """Raises `NotPermitted`."""
        name = type_of(wanted).name
        self.check_role(name, PERMITS[name].role)

    def check_role(self, name: str, needed: Role) -> None:
        """Raises `NotPermitted` for what ``name`` stands for."""
        if self.role < needed:
            raise NotPermitted(f"{name} is for the role {needed.title}; {self.name} has the role {self.role.title}")


async def _done(subject: GatewaySubject, wanted: Command) -> Result:
    """Raises `Ignored` for what a controller has not done although it has accepted it."""
    if not isinstance(wanted, MOVING):
        return await subject.do(wanted)
    axes = frozenset({str(wanted.axis)}) if isinstance(wanted, Move | Home) else None
    subscription = subject.subscribe(Filter(frozenset({"status", "input"}), _controllers(subject, wanted), axes), MOST_EVENTS)
    try:
        if isinstance(wanted, Move | Home):
            await _check_drive(subject, wanted, subscription)
        result = await subject.do(wanted)
        event = await _drive_off(subject, wanted, subscription, result.number)
        if event is not None:
            ignored = Ignored(f"{event.controller}: {event.text}: switch its drive on first")
            ignored.result = result
            raise ignored
        return result
    finally:
        subscription.close()


def _controllers(subject: GatewaySubject, wanted: Move | Home | Write | Request) -> frozenset[str]:
    match wanted:
        case Write(values=values):
            return frozenset(one[0] for one in values)
        case Request(line=line, unit=unit):
            parts = subject.description.controllers
            return frozenset(part.name for part in parts if part.line == line and unit in (part.unit, BROADCAST))
        case Move() | Home():
            return frozenset({wanted.controller})


async def _drive_off(subject: GatewaySubject, wanted: Command, subscription: Subscription, number: int) -> Event | None:
    """The event of a controller that has ignored a motion of the command with this number, None if there is none."""
    loop = asyncio.get_running_loop()
    end = loop.time() + UNDER_WAY_S
    while True:
        for event in subscription.take().events:
            # What was due before has happened before it; a world does it at once.
            if event.number > number and isinstance(event.payload, StatusPayload) and event.payload.code == NOT_ENABLED:
                return event
        if not isinstance(wanted, Write) or loop.time() >= end or not await _is_under_way(subject, wanted):
            return None
        await asyncio.sleep(BETWEEN_LOOKS_S)


async def _is_under_way(subject: GatewaySubject, wanted: Write) -> bool:
    """Whether a twin on a line, which may take its time, is sent a motion of an axis whose drive is off."""
    for part in subject.description.controllers:
        axes = set() if part.is_real or part.line is None else _moved(part, wanted)
        if axes:
            state: Any = (await subject.do(ReadState(part.name))).value
            if any(one["enabled"] is False for one in state["axes"] if one["number"] in axes):
                return True
    return False


def _moved(part: ControllerDescription, wanted: Write) -> set[int]:
    """The axes of a controller to whose registers motions are written; a switch that is written 0 moves nothing."""
    found: set[int] = set()
    moving = {point.path: point for point in part.datasheet.points if point.effect is PointEffect.MOVES}
    for controller, register, value in wanted.values:
        point = moving.get(register.upper())
        if controller == part.name and point is not None and (value or point.type != "switch"):
            found.update(axis.number for axis in part.datasheet.axes if point.path.startswith(f"{axis.name}_"))
    return found


async def _check_drive(subject: GatewaySubject, wanted: Move | Home, subscription: Subscription) -> None:
    """Raises `Ignored` for a twin on a line whose drive is off, because its answer may come later, and `Refusal` after a stop."""
    part = next((one for one in subject.description.controllers if one.name == wanted.controller), None)
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
        missed, events = subscription.take()
        if missed or any(isinstance(one.payload, InputPayload) and one.payload.what == "stop" for one in events):
            raise Refusal(f"{type_of(wanted).name} was not sent: a stop was requested meanwhile")
    raise Ignored(f"{part.name}: M{wanted.axis} is not enabled: switch its drive on first")
