"""A control endpoint of a subject that is only asked, and its clients."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable
from inspect import signature
from typing import Any

from steptwin.errors import Misuse, Refusal
from steptwin.later import Later
from steptwin.live.control import ControlEndpoint
from steptwin.motion.profile import at_rest
from steptwin.simulation.script import steps as do
from steptwin.simulation.toml.addresses import Address
from steptwin.subject import commands as command
from steptwin.subject.contract import UNKNOWN, Description, Reading, Result
from steptwin.subject.events import Event
from steptwin.subject.payloads import EdgePayload, PlanPayload
from steptwin.subject.subscriptions import Filter, Subscription, Subscriptions


class Desk:
    """A subject that is only asked: notes come back, one of them later, some are refused, one breaks it; a step
    to 9 has two parts."""

    def __init__(self) -> None:
        self.description = Description("desk", ())
        self.later = Later[None]()
        self.subscribers = Subscriptions()
        self.done = 0

    def do(self, wanted: command.Command) -> Result:
        self.done += 1
        match wanted:
            case do.Note("refuse"):
                raise Misuse("not permitted: 7")
            case do.Note("deny"):
                raise Refusal("not now")
            case do.Note("break"):
                raise KeyError("x")
            case do.Note(text):
                return Result({"note": text}, 5, self.done)
            case command.Pause():
                return Result("x" * 1_000_000, 5, self.done)
            case command.Advance(9):
                return Result({"events": [{"number": one} for one in range(600)], "missed": 3, "to_ns": "9"}, 5, self.done)
            case command.Advance(None, 9):
                return Result({"events": [{"number": one} for one in range(600, 1200)], "missed": 4}, 9, self.done)
        return Result(None, 5, self.done)

    def read(self, *points: str) -> tuple[Reading, ...]:
        return tuple(Reading(point, None, "", UNKNOWN) for point in points)

    async def answer(self, wanted: command.Command) -> Result:
        if wanted == do.Note("later"):
            self.later = Later[None]()
            await self.later
        return self.do(wanted)

    def subscribe(self, what: Filter, bound: int) -> Subscription:
        return self.subscribers.subscribe(what, bound)

    def plans(self, what: Filter) -> list[Event]:
        return [Event(0, 5, "a", PlanPayload("1", at_rest(0, 7), 0))]

    def workpieces(self) -> tuple[()]:
        return ()

    def standing(self) -> tuple[()]:
        return ()

    def happen(self, count: int = 1) -> None:
        for number in range(count):
            self.subscribers.publish(Event(number, number, "a", EdgePayload("IN1", 1.0)))


def ok(text: str, number: int = 1) -> dict[str, object]:
    return {"ok": {"note": text}, "number": number, "time_ns": "5"}


def misuse(text: str) -> dict[str, object]:
    return {"error": {"code": "misuse", "message": text}}


async def turns() -> None:
    """Let the loop finish what it has begun with connections that come and go."""
    for _ in range(5):
        await asyncio.sleep(0)


def served(play: Callable[..., Awaitable[Any]], name: str = "twin", address: Address | None = None) -> Any:
    async def scene() -> Any:
        desk = Desk()
        endpoint = ControlEndpoint(name, desk, address)
        await endpoint.open()
        try:
            return await (play(endpoint, desk) if len(signature(play).parameters) == 2 else play(endpoint))
        finally:
            await turns()
            await endpoint.close()
            await turns()

    return asyncio.run(scene())


def read_answer(line: bytes) -> Any:
    """An answer without the ids of its messages, which tests/test_messages.py tries."""
    answer = json.loads(line)
    answer.get("error", {}).pop("messages", None)
    return answer


async def answers_to(endpoint: ControlEndpoint, *parts: bytes) -> list[Any]:
    """The answers to what a client sends before it sends no more."""
    reader, writer = await asyncio.open_unix_connection(str(endpoint.path))
    for part in parts:
        writer.write(part)
        await writer.drain()
        await asyncio.sleep(0)
    writer.write_eof()
    answers = list(map(read_answer, (await reader.read()).splitlines()))
    writer.close()
    return answers


async def answer_to(endpoint: ControlEndpoint, *parts: bytes) -> Any:
    (answer,) = await answers_to(endpoint, *parts)
    return answer
