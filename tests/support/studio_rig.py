"""A studio in memory: a world in virtual time, and viewers without sockets. Wall clock and virtual time go together."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from textwrap import dedent
from typing import Any

import jsonschema_rs

from steptwin.access.audit import Audit
from steptwin.access.control import Viewer
from steptwin.access.roles import Role
from steptwin.access.tokens import AccessGate, Token
from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.devices.composite import CompositeSubject
from steptwin.devices.worldmember import WorldMember
from steptwin.errors import Misuse, Refusal
from steptwin.files.world import World
from steptwin.simulation.world.worldprograms import WorldPrograms, configuration_text
from steptwin.studio.hub import Hub
from steptwin.studio.schema import schema
from steptwin.studio.surroundings import PresentMoment, Surroundings
from steptwin.studio.timetravel import TimeTravel
from steptwin.studio.viewersession import ViewerSession
from steptwin.subject.commands import VERSION
from steptwin.subject.jogs import WorldJogs
from steptwin.subject.world import WorldSubject

WORLD = """
    [world]
    name = "hall"
    [[line]]
    name = "bus"
    kind = "modbus"
    [[mic488]]
    name = "table"
    line = "bus"
    [mic488.M1]
    unit = "mm"
    gear = 100.0
    acc = 400.0
    dec = 400.0
    vel = 40.0
    [mic488.M2]
    unit = "mm"
    gear = 100.0
    [[line]]
    name = "chips"
    kind = "m1486"
    [[m1486]]
    name = "drum"
    line = "chips"
    address = 7
    [[button]]
    name = "go"
    to = "table.IN4"
"""
ENGINEER, OPERATOR, VIEWER = "engineer-0123456789", "operator-0123456789", "viewer-0123456789"
TOKENS = (Token(Role.ENGINEER, "anna", ENGINEER), Token(Role.OPERATOR, "piotr", OPERATOR), Token(Role.VIEWER, "hall", VIEWER))
_SCHEMA: dict[str, Any] = json.loads(json.dumps(schema()))
SENT = jsonschema_rs.Draft202012Validator(_SCHEMA)
ANSWERS = {
    name.removesuffix(" answer"): jsonschema_rs.Draft202012Validator({**found, "$defs": _SCHEMA["$defs"]})
    for name, found in _SCHEMA["$defs"].items()
    if name.endswith(" answer")
}
TICK_NS: Nanos = SECOND // 30


def check_message(message: object) -> None:
    """Against the schema, whatever it is that the studio sent."""
    SENT.validate(message)


def check_answer(name: str, message: dict[str, Any]) -> None:
    check_message(message)
    if name in ANSWERS and "ok" in message:
        ANSWERS[name].validate(message["ok"])


class NoWork:
    def scan(self, places: Any, kind: str, units: str, baud: str | None, timeout: float) -> None:
        raise Misuse("there are no lines here")

    def verify(self, address: str, *, write: bool) -> None:
        raise Misuse("there are no lines here")

    last = None

    def cancel(self) -> None:
        return None


class NoConnections:
    """To devices."""

    kinds = ({"kind": "mic488", "model": "MIC488", "options": "unit=N", "is_searched": True},)

    async def ports(self) -> Sequence[Mapping[str, object]]:
        return ({"address": "/dev/ttyUSB0", "what": "serial port"},)

    async def connect(self, address: str, name: str | None) -> str:
        raise Refusal(f"no device is at {address}")

    async def disconnect(self, controller: str) -> None:
        raise Misuse(f"no device is called {controller!r}; there is none")

    async def settings(self, controller: str) -> str:
        raise Misuse(f"no device is called {controller!r}; there is none")

    async def configuration(self, controller: str) -> None:
        raise Misuse(f"no device is called {controller!r}; there is none")

    async def shadow(self, controller: str, *, on: bool) -> None:
        raise Misuse(f"no device is called {controller!r}; there is none")

    def shadow_of(self, controller: str, after: Nanos) -> None:
        raise Misuse(f"no device is called {controller!r}; there is none")


class Studio:
    """The world, its hub and time."""

    def __init__(
        self,
        text: str = WORLD,
        *,
        tokens: bool = False,
        gate: AccessGate | None = None,
        files: Mapping[str, bytes] | None = None,
        time_travel: Callable[[Studio], TimeTravel] | None = None,
    ) -> None:
        self.world = World.from_toml(dedent(text), files)
        self.subject = WorldSubject(self.world)
        self.jogs = WorldJogs(self.subject)
        self.speed = 1.0
        self.errors: list[Exception] = []
        gate = gate or (AccessGate(TOKENS) if tokens else AccessGate(open_to=Role.ENGINEER))
        around = Surroundings(
            moment=lambda: PresentMoment(self.world.now, running=True, speed=self.speed),
            gate=gate,
            audit=Audit(lambda: "2026-01-01T00:00:00Z"),
            program="0",
            programs=WorldPrograms(self.world),
            configuration=partial(configuration_text, self.world),
            time_travel=None if time_travel is None else time_travel(self),
            connections=NoConnections(),
            work=NoWork(),
            on_internal=self.errors.append,
        )
        world = WorldMember(self.subject, self.subject.subscribers, self.jogs)
        shown = CompositeSubject(world, lambda: self.world.now, self.subject.numbering)
        self.hub = Hub(shown, shown, around)
        self.now: Nanos = 5 * SECOND
        """Of the wall clock."""
        self.tabs: list[Tab] = []

    def open(self, name: str | None = None, token: str | None = None, **fields: object) -> Tab:
        """A viewer that has said hello, and has the state."""
        tab = Tab(self)
        tab.ok("hello", **{key: value for key, value in (("name", name), ("token", token)) if value is not None}, **fields)
        tab.read()
        return tab

    def rest(self, role: Role = Role.ENGINEER) -> ViewerSession:
        return ViewerSession(self.hub, "REST", entered=Viewer(self.hub.number(), "REST", role))

    def run(self, for_ms: float) -> None:
        """Virtual time at its speed; jogs end at their moments, the hub ticks 30 times a second."""
        end = self.now + round(for_ms * MILLISECOND)
        while self.now < end:
            step = min(TICK_NS, end - self.now)
            self.now += step
            self._advance(self.world.now + round(step * self.speed))
            self.hub.tick(self.now)

    def _advance(self, to: Nanos) -> None:
        while (due := self.jogs.deadline()) is not None and due <= to:
            self.world.advance(max(due, self.world.now))
            self.world.sync_all()
            self.jogs.advance(self.world.now)
        self.world.advance(to)
        self.world.sync_all()

    def value(self, point: str) -> float:
        (reading,) = self.subject.read(point)
        assert reading.value is not None
        return reading.value


class Tab:
    """A connection. What comes is checked against the schema, and its numbers."""

    def __init__(self, studio: Studio) -> None:
        self.studio = studio
        self.session = ViewerSession(studio.hub, "127.0.0.1")
        self.messages: list[dict[str, Any]] = []
        self._seq = -1
        self._id = 0

    def ask(self, name: str, /, **fields: object) -> dict[str, Any]:
        self._id += 1
        version = {"version": VERSION} if name == "hello" else {}
        text = json.dumps({"do": name, "id": self._id, **version, **fields})
        answer = json.loads(json.dumps(self.session.receive(text, self.studio.now).result()))
        check_answer(name, answer)
        assert answer["id"] == fields.get("id", self._id)
        return answer

    def ok(self, name: str, /, **fields: object) -> Any:
        answer = self.ask(name, **fields)
        assert "error" not in answer, answer
        return answer["ok"]

    def error(self, name: str, /, **fields: object) -> tuple[str, str]:
        """Code and message."""
        answer = self.ask(name, **fields)
        assert "error" in answer, answer
        return answer["error"]["code"], answer["error"]["message"]

    def read(self) -> list[dict[str, Any]]:
        """What has been sent since the last time."""
        found = [json.loads(text) for text in self.session.take(self.studio.now)]
        for message in found:
            check_message(message)
            self._seq = 0 if "hello" in message else self._seq + 1
            assert message["seq"] == self._seq
        self.messages += found
        return found

    def newest(self, member: str) -> Any:
        """The last content of a kind of message."""
        return next(message[member] for message in reversed(self.messages) if member in message)

    def close(self) -> None:
        self.session.close()
