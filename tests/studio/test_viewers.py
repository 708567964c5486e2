"""Connections of viewers: what is written when, and to whom nothing more is written."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Iterable
from typing import Any

import pytest
from tests.support.studio_rig import Studio, check_message

from steptwin.machine import SECOND
from steptwin.studio.viewers import MOST_UNREAD, PATIENCE_S, ViewerConnection

PATIENCE_NS = int(PATIENCE_S * SECOND)


class Writer:
    """A connection whose other end reads when it is told to."""

    def __init__(self) -> None:
        self.writes: list[list[dict[str, Any]]] = []
        self.unread = 0
        self.is_aborted = False

    def write(self, texts: Iterable[str]) -> None:
        messages = [json.loads(text) for text in texts]
        for message in messages:
            check_message(message)
        self.writes.append(messages)

    def abort(self) -> None:
        self.is_aborted = True


class Viewer:
    """A viewer of the studio behind a writer, which watches the time and follows events."""

    def __init__(self, studio: Studio) -> None:
        self.studio = studio
        self.writer = Writer()
        self.tab = studio.open()
        self.connection = ViewerConnection(self.tab.session, self.writer, lambda: studio.now, studio.errors.append)
        self.tab.ok("watch", points=["time"], rate=30)
        self.tab.ok("follow", id=1)
        self.look()

    def look(self, after_ms: float = 100) -> list[dict[str, Any]]:
        """What is written at the next tick."""
        self.studio.run(after_ms)
        self.writer.writes.clear()
        self.connection.look(self.studio.now)
        return [message for messages in self.writer.writes for message in messages]


@pytest.fixture
def viewer() -> Viewer:
    return Viewer(Studio())


def kinds(messages: list[dict[str, Any]]) -> set[str]:
    return {name for message in messages for name in message} - {"seq", "time_ns", "missed"}


def test_all_messages_of_a_tick_are_one_write_and_none_is_none(viewer: Viewer) -> None:
    viewer.tab.ok("note", text="here")
    assert kinds(viewer.look(2000)) == {"values", "events", "clock", "control"}
    assert len(viewer.writer.writes) == 1
    assert viewer.look(0) == []
    assert viewer.writer.writes == []


def test_a_viewer_that_does_not_read_is_sent_nothing_more_and_the_present_when_it_reads_again(viewer: Viewer) -> None:
    viewer.writer.unread = MOST_UNREAD + 1
    for _ in range(20):
        viewer.tab.ok("note", text="missed by nobody")
        assert viewer.look() == []
    viewer.writer.unread = MOST_UNREAD
    written = viewer.look()
    (values,) = [message["values"] for message in written if "values" in message]
    assert values == {"1": [[0, pytest.approx(viewer.studio.value("time"), abs=1e-6)]]}
    (events,) = [message["events"] for message in written if "events" in message]
    assert len(events) == 20
    assert not viewer.writer.is_aborted


def test_the_connection_of_a_viewer_that_reads_nothing_for_long_ends(viewer: Viewer) -> None:
    viewer.writer.unread = MOST_UNREAD + 3
    viewer.look()
    began = viewer.studio.now
    while not viewer.writer.is_aborted:
        viewer.look()
    assert PATIENCE_NS < viewer.studio.now - began < PATIENCE_NS + SECOND


def test_one_that_reads_slowly_has_time(viewer: Viewer) -> None:
    for unread in range(MOST_UNREAD + 5, MOST_UNREAD, -1):
        viewer.writer.unread = unread
        viewer.look()
        viewer.look(PATIENCE_S * 900)
    assert not viewer.writer.is_aborted


def test_requests_of_one_that_does_not_read_its_answers_wait(viewer: Viewer) -> None:
    asked: list[str] = []

    async def receive() -> dict[str, Any]:
        if len(asked) == 3:
            return {"type": "websocket.disconnect"}
        asked.append("time")
        return {"type": "websocket.receive", "text": '{"do": "time"}'}

    async def send(message: Any) -> None:
        pytest.fail(f"sent {message}")

    async def serve() -> None:
        viewer.writer.unread = MOST_UNREAD + 1
        serving = asyncio.create_task(viewer.connection.serve(receive, send))
        for _ in range(5):
            await asyncio.sleep(0)
        assert len(asked) == 1
        viewer.writer.unread = 0
        viewer.look()
        await serving

    asyncio.run(serve())
    assert len(asked) == 3


def test_an_error_in_one_connection_ends_that_connection_only(viewer: Viewer, monkeypatch: pytest.MonkeyPatch) -> None:
    other = Viewer(viewer.studio)

    def fail(now: int) -> list[str]:
        raise ValueError(str(now))

    monkeypatch.setattr(viewer.tab.session, "take", fail)
    assert viewer.look() == []
    assert viewer.writer.is_aborted
    assert [type(error) for error in viewer.studio.errors] == [ValueError]
    assert kinds(other.look())
    assert not other.writer.is_aborted
