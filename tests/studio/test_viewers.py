"""Connections of viewers: what is sent when, and to whom nothing more is sent."""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import Awaitable, Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest
from tests.support.studio_rig import Studio, check_message
from virtual_loop import run_virtually

from steptwin.studio.servicerequests import ShownGateway, WorldServices
from steptwin.studio.viewers import MOST_UNSENT, PATIENCE_S, ViewerConnection

ASKED = {"type": "websocket.receive", "text": '{"do": "time"}'}


class Viewer:
    """A viewer of the studio, which watches the time, follows events, and reads as long as ``reads`` is set."""

    def __init__(self, studio: Studio) -> None:
        self.studio = studio
        self.sent: list[dict[str, Any]] = []
        self.reads = asyncio.Event()
        self.reads.set()
        self.requests: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        self.tab = studio.open()
        self.connection = ViewerConnection(self.tab.session, lambda: studio.now, studio.errors.append)
        self.tab.ok("watch", points=["time"], rate=30)
        self.tab.ok("subscribe", id=1)
        self.serving = asyncio.create_task(self.connection.serve(self.requests.get, self._send))

    async def _send(self, message: Any) -> None:
        await self.reads.wait()
        self.sent.append(json.loads(message["text"]))
        check_message(self.sent[-1])

    async def look(self, after_ms: float = 100) -> list[dict[str, Any]]:
        """What is sent at the next tick."""
        self.studio.run(after_ms)
        self.sent.clear()
        self.connection.look(self.studio.now)
        for _ in range(3):
            await asyncio.sleep(0)
        return list(self.sent)

    async def fill(self) -> None:
        """Let more wait than is sent to a viewer that does not read."""
        self.reads.clear()
        for _ in range(MOST_UNSENT // 4000 + 1):
            self.tab.ok("note", text="x" * 4000)
        await self.look()


class Remote(Viewer):
    """What follows a long message waits until it has been read, as in uvicorn."""

    async def _send(self, message: Any) -> None:
        await super()._send(message)
        if len(message["text"]) > MOST_UNSENT:
            self.reads.clear()


def with_viewer(story: Callable[[Viewer], Awaitable[None]], kind: type[Viewer] = Viewer) -> None:
    async def told() -> None:
        viewer = kind(Studio())
        viewer.requests.put_nowait(ASKED)  # the connection notices that it has entered
        await viewer.look()
        await asyncio.sleep(1)
        await story(viewer)
        viewer.serving.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await viewer.serving

    run_virtually(told())


def kinds(messages: list[dict[str, Any]]) -> set[str]:
    return {name for message in messages for name in message} - {"seq", "time_ns", "missed"}


def test_messages_of_a_tick_and_none_where_nothing_has_changed() -> None:
    async def story(viewer: Viewer) -> None:
        viewer.tab.ok("note", text="here")
        assert kinds(await viewer.look(2000)) == {"values", "events", "clock", "control"}
        assert await viewer.look(0) == []

    with_viewer(story)


def test_a_viewer_that_does_not_read_is_sent_nothing_more_and_the_present_when_it_reads_again() -> None:
    async def story(viewer: Viewer) -> None:
        await viewer.fill()
        for _ in range(20):
            viewer.tab.ok("note", text="missed by nobody")
            assert await viewer.look() == []
        viewer.reads.set()
        for _ in range(5):
            await asyncio.sleep(0)
        written = await viewer.look()
        (values,) = [message["values"] for message in written if "values" in message]
        assert values == {"1": [[0, pytest.approx(viewer.studio.value("time"), abs=1e-6)]]}
        (events,) = [message["events"] for message in written if "events" in message]
        assert len(events) == 20

    with_viewer(story)


def test_the_connection_of_a_viewer_that_reads_nothing_for_long_ends() -> None:
    async def story(viewer: Viewer) -> None:
        await viewer.fill()
        began = asyncio.get_running_loop().time()
        await viewer.serving
        assert asyncio.get_running_loop().time() - began == pytest.approx(PATIENCE_S, abs=0.1)

    with_viewer(story)


def test_one_that_reads_slowly_has_time() -> None:
    async def story(viewer: Viewer) -> None:
        await viewer.fill()
        for _ in range(3):
            await asyncio.sleep(0.9 * PATIENCE_S)
            viewer.reads.set()
            await asyncio.sleep(0)
            viewer.reads.clear()
            viewer.tab.ok("note", text="more")
            await viewer.look()
        assert not viewer.serving.done()

    with_viewer(story)


def test_one_that_reads_a_long_message_has_more_time() -> None:
    async def story(viewer: Viewer) -> None:
        for _ in range(10 * MOST_UNSENT // 4096):
            viewer.tab.ok("note", text="x" * 4096)
        await viewer.look()
        await viewer.look()
        assert not viewer.reads.is_set()
        await asyncio.sleep(10 * PATIENCE_S)
        assert not viewer.serving.done()
        await viewer.serving

    with_viewer(story, Remote)


def test_requests_of_one_that_does_not_read_its_answers_wait() -> None:
    async def story(viewer: Viewer) -> None:
        await viewer.fill()
        for _ in range(3):
            viewer.requests.put_nowait(ASKED)
        for _ in range(5):
            await asyncio.sleep(0)
        assert viewer.requests.qsize() == 2
        viewer.reads.set()
        for _ in range(20):
            await asyncio.sleep(0)
        assert viewer.requests.empty()
        viewer.requests.put_nowait({"type": "websocket.disconnect"})
        await viewer.serving

    with_viewer(story)


def test_an_error_in_one_connection_ends_that_connection_only(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(now: int) -> list[str]:
        raise ValueError(str(now))

    async def story(viewer: Viewer) -> None:
        other = Viewer(viewer.studio)
        monkeypatch.setattr(viewer.tab.session, "take", fail)
        assert await viewer.look() == []
        await viewer.serving
        assert [type(error) for error in viewer.studio.errors] == [ValueError]
        assert kinds(await other.look())
        assert not other.serving.done()
        other.serving.cancel()

    with_viewer(story)


SPACE = """
[[mic488]]
name = "c"
[[conveyor]]
name = "belt"
length = 100
speed = 50
run = "c.OUT1"
feed_every = "1 s"
workpiece = [20, 20, 20]
at = [0, 0, 50]
"""


def test_a_viewer_is_sent_the_workpieces_when_one_comes_or_goes_and_not_while_they_move() -> None:
    studio = Studio(SPACE)
    tab = studio.open()

    def sent() -> list[list[dict[str, Any]]]:
        tab.read()
        return [message["workpieces"] for message in tab.messages if "workpieces" in message]

    assert tab.newest("hello")["workpieces"] == []
    studio.run(1100)
    ((piece,),) = sent()
    assert (piece["name"], piece["on"], [one["signal"] for one in piece["moves"]]) == ("belt.1", "belt", ["belt.travel"])
    tab.ok("write", values={"c.OUT1": 1})
    studio.run(500)
    assert len(sent()) == 1
    late = studio.open()
    (there,) = late.newest("hello")["workpieces"]
    assert there == piece
    studio.run(3000)
    assert [[one["name"] for one in found] for found in sent()[1:]] == [["belt.3", "belt.4"]]


def test_a_viewer_that_comes_later_has_the_events_from_before_and_is_sent_what_stands() -> None:
    studio = Studio()
    first = studio.open()
    assert first.newest("hello")["events"] == []
    first.ok("fault", fault="stuck pin=IN1 value=1 machine=table")
    studio.run(300)
    first.read()
    (there,) = first.newest("standing")
    assert (there["kind"], there["name"], there["question"]) == ("fault", "table.IN1", "table.IN1")
    first.ok("press", button="go")
    late = studio.open()
    hello = late.newest("hello")
    assert [event["kind"] for event in hello["events"]] == ["fault", "button"]
    assert hello["events_from_ns"] == "0"
    assert hello["standing"][0] == there
    sent = len(first.messages)
    studio.run(2000)
    first.read()
    assert [name for message in first.messages[sent:] for name in message if name == "standing"] == []


def test_a_gateway_that_is_down_stands_since_it_was_up_last() -> None:
    studio = Studio()
    shown = ShownGateway(
        "mqtt", "MQTT", "mqtt://127.0.0.1:1", is_up=False, text="refused", shown=1, has_clients=False, clients=()
    )
    gateways = [shown]
    services = SimpleNamespace(gateways=lambda: gateways)
    studio.hub.around = replace(studio.hub.around, services=cast("WorldServices", services))

    def down(standing: list[dict[str, Any]]) -> list[tuple[str, str, str | None]]:
        return [(one["name"], one["text"], one["since_ns"]) for one in standing if one["kind"] == "gateway"]

    tab = studio.open()
    assert down(tab.newest("hello")["standing"]) == [("mqtt", "refused", None)]
    gateways[:] = [replace(shown, is_up=True)]
    studio.run(300)
    tab.read()
    assert down(tab.newest("standing")) == []
    gateways[:] = [shown]
    studio.run(300)
    tab.read()
    ((_, _, since),) = down(tab.newest("standing"))
    assert since is not None
    assert 300_000_000 <= int(since) <= 600_000_000
