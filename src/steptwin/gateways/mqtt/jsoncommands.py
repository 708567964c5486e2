"""Commands of the JSON face: who may give them, each once, and what is answered."""

from __future__ import annotations

import json
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from steptwin.access.roles import ROLES, Role
from steptwin.access.tokens import AccessGate
from steptwin.errors import Misuse, Refusal
from steptwin.files.tokenfiles import tokens_in
from steptwin.gateways.clients import GatewayClient
from steptwin.gateways.contract import GatewaySubject
from steptwin.gateways.leases import JogLeases
from steptwin.gateways.mqtt.options import MqttSpec
from steptwin.subject.commands import Command, Jog, StopAxes, type_of
from steptwin.subject.contract import Result
from steptwin.subject.dispatch import JsonObject, failure, read_message, respond

COMMANDS = (
    *("read", "pins", "state", "encoders", "faults", "time", "stop", "set", "press", "release", "put", "remove", "write", "turn"),
    *("enable", "move", "home", "jog", "program", "download", "note", "pause", "resume", "send", "request", "power_cycle"),
    *("fault", "clear_fault"),
)
"""Those of the control endpoint that are taken here: no files, no debugger."""
PROTOCOL = "MQTT"
"""The broker does not tell where its clients are."""
TOKEN, LEASE = "token", "lease_s"
"""Members of a request besides those of the command; a jog needs a lease."""
REPEATED_S = 60.0
"""A request with an id that is the same as one within this time is that one again."""
MOST_KEPT = 1000


class Doorkeeper:
    """Clients by their tokens."""

    def __init__(self, spec: MqttSpec, folder: Path) -> None:
        """Raises `Misuse` for a file of tokens that cannot be used."""
        self._gate: AccessGate | None = None
        if spec.tokens is not None:
            self._gate = AccessGate(tokens_in(folder / spec.tokens))
        role = Role.VIEWER if spec.role is None else ROLES[spec.role]  # whoever reaches the broker is not known, also on loopback
        self.anybody = GatewayClient("a client without token", role, PROTOCOL)

    def admit(self, token: object) -> GatewayClient:
        """Raises `Refusal` for a token that is wrong."""
        if token is None:
            return self.anybody
        if self._gate is None or not isinstance(token, str):
            raise Refusal("wrong token")
        role, name = self._gate.enter(token or " ")
        return GatewayClient(name or "", role, PROTOCOL)


@dataclass(frozen=True, slots=True)
class JsonRequest:
    """``sender``: what distinguishes one client from another, such as where it wants the answer."""

    payload: bytes
    is_retained: bool
    sender: tuple[object, ...] = ()


class JsonCommands:
    """Does requests for ``subject``. ``clock``: seconds that go on at their pace, whatever is done to the wall clock."""

    def __init__(self, subject: GatewaySubject, door: Doorkeeper, clock: Callable[[], float]) -> None:
        self._subject = subject
        self._door = door
        self._clock = clock
        self._leases = JogLeases(subject)
        self._kept: OrderedDict[object, tuple[float, JsonObject | None]] = OrderedDict()
        """Requests with an id, when they came and their answers; None while they are being done."""

    async def answer(self, request: JsonRequest) -> JsonObject | None:
        """None for a request that is being done already: its answer comes."""
        found: dict[str, Any] = {}
        try:
            message = read_message(request.payload)
            found = {"id": message["id"]} if isinstance(message.get("id"), str | int) else {}
            if request.is_retained:
                raise Refusal("a command is not retained: it would be done again by everybody who comes later")
            client = self._door.admit(message.pop(TOKEN, None))
            lease = message.pop(LEASE, None)
        except (Misuse, Refusal) as error:
            return {**found, **failure(error)}
        key = (request.sender, request.payload) if found and message["do"] != "stop" else None
        if key is not None:
            self._forget()
            if key in self._kept:
                return self._kept[key][1]
            self._kept[key] = self._clock(), None
        is_command = False

        async def do(wanted: Command, _: object) -> Result:
            nonlocal is_command
            is_command = True
            return await self._do(client, wanted, lease)

        answer = await respond(do, json.dumps(message).encode(), _ignore)
        if not is_command:
            fields = {name: value for name, value in message.items() if name != "do"}
            client.refused(self._subject, str(message["do"]), fields)
        if key is not None:
            self._kept[key] = self._clock(), answer
        return answer

    def _forget(self) -> None:
        while self._kept and (len(self._kept) >= MOST_KEPT or self._clock() - next(iter(self._kept.values()))[0] > REPEATED_S):
            self._kept.popitem(last=False)

    async def _do(self, client: GatewayClient, wanted: Command, lease: object) -> Result:
        name = type_of(wanted).name
        if name not in COMMANDS:
            raise Refusal(f"{name} is not taken over MQTT; taken are {', '.join(COMMANDS)}")
        if isinstance(wanted, Jog):
            if isinstance(lease, bool) or not isinstance(lease, int | float):
                raise Misuse(f"a jog needs {LEASE}: how long it goes on unless it is repeated, in s")
            await self._leases.jog(client.name, client, wanted, float(lease))
            return Result(None, 0, 0)
        if lease is not None:
            raise Misuse(f"{LEASE} is for a jog only")
        result = await client.do(self._subject, wanted)
        if isinstance(wanted, StopAxes):
            self._leases.stopped(wanted)
        return result

    def lost(self) -> None:
        """The broker is lost, and with it everybody who would renew a lease."""
        self._leases.close()


def _ignore(error: Exception) -> None:
    """The answer says it."""
