"""A studio that is open for eight hours of a busy world stays as large as it is: the service, and the page in a browser."""

from __future__ import annotations

import gc
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from soak import factor, scaled
from studio_page import Studio as OpenStudio
from studio_page import button, show
from tests.studio.conftest import TABLE, StudioWorld, browser, start_studio
from tests.support.studio_rig import Studio, Tab

__all__ = ["browser", "start_studio"]  # fixtures

HOURS = 8
SPEED = 100.0
FEW_OBJECTS = 300
"""Caches fill up a little."""
MOST_HEAP = 60_000_000
"""Of the page, after a collection, bytes."""
MOST_GROWTH = 30_000_000
"""Of the resident memory of the service after the first eighth, bytes."""
BUSY = (
    TABLE
    + """
    [[script]]
    name = "on"
    steps = [{ write = { "table.M1_EN" = 1 } }]
    [[script]]
    name = "go"
    at = "1 s"
    repeat = 100000000
    steps = [
      { write = { "table.M1_POS_ABS" = 40, "table.OUT1" = 1 } }, { wait = "2 s" },
      { write = { "table.M1_POS_ABS" = 0, "table.OUT1" = 0 } }, { wait = "2 s" },
    ]
"""
)


def objects() -> int:
    for _ in range(3):
        gc.collect()
    return len(gc.get_objects())


def resident(pid: int) -> int:
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


def look(tab: Tab) -> None:
    """What a page asks for when it is opened."""
    tab.ok("subscribe", kinds=["plan", "edge", "status"], id="events")
    tab.ok("watch", points=["table.M1.position", "table.M1.status", "time"], rate=10)


def busy(studio: Studio, tab: Tab, seconds: int) -> None:
    """A page that stays; one that comes, does something and goes, ten times."""
    for part in range(10):
        visitor = studio.open()
        look(visitor)
        for _ in range(max(1, seconds // 10)):
            studio.run(1000)
            for one in (tab, visitor):
                one.read()
                one.messages.clear()
        visitor.ok("write", values={"table.USER_REGISTER[1]": part})
        visitor.close()


def test_viewers_of_a_busy_world_leave_nothing_behind() -> None:
    studio = Studio(BUSY)
    studio.world.stop_recording()
    studio.speed = SPEED
    tab = studio.open()
    look(tab)
    length = scaled(round(HOURS * 3600 / SPEED))
    busy(studio, tab, max(20, length // 10))
    before = objects()
    busy(studio, tab, max(20, length))
    assert objects() - before < FEW_OBJECTS
    assert studio.errors == []


def test_a_long_session_takes_no_more_memory_than_a_short_one() -> None:
    """10^5 messages of a viewer that watches, follows, jogs and reads, and one that never reads."""
    studio = Studio()
    tab, silent = studio.open(), studio.open()
    for one in (tab, silent):
        one.ok("subscribe", id=1, bound=100)
        one.ok("watch", points=["table.M1.position", "time"], rate=30)
    tab.ok("enable", controller="table", axis=1)

    def busy(times: int) -> None:
        for n in range(times):
            tab.ok("move", controller="table", axis=1, to=n % 50)
            watch = tab.ok("watch", points=[f"table.M{n % 4 + 1}.position"])["watch"]
            tab.ok("subscribe", id="x", kinds=["edge"])
            studio.run(40)  # fewer requests than are permitted
            tab.read()
            tab.messages.clear()
            tab.ok("unsubscribe", subscription="x")
            tab.ok("unwatch", watch=watch)
            visitor = studio.open()
            visitor.ok("subscribe", id=n, kinds=["plan"])
            visitor.close()

    studio.world.stop_recording()
    busy(20)
    before = objects()
    busy(scaled(100_000) // 8)
    # The audit log has room for 10 000 entries; the rest is as it was.
    entries = len(studio.hub.around.audit.last(10**6))
    assert objects() - before < 6 * entries + 2000
    assert studio.errors == []


@pytest.fixture
def studio_world() -> StudioWorld:
    return StudioWorld(BUSY)


def test_a_page_of_a_busy_world_stays_as_large_as_it_is(
    start_studio: Callable[..., Any], browser: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    process = start_studio("--speed", str(SPEED))
    studio = OpenStudio(process, browser)
    page = studio.page(panel="Scope")
    button(page, "Open beside").click()
    page.get_by_label("Panel", exact=True).last.select_option(label="Axes")
    session = page.context.new_cdp_session(page)
    found, service = [], []
    part_s = HOURS * 3600 / SPEED * factor() / 8
    for _ in range(8):
        page.wait_for_timeout(max(500.0, part_s * 1000))
        session.send("HeapProfiler.collectGarbage")
        found.append(int(session.send("Runtime.getHeapUsage")["usedSize"]))
        counted = session.send("Memory.getDOMCounters")
        service.append(resident(process.process.pid))
    show(page, "Overview")
    with capsys.disabled():
        print(json.dumps({"heap": found, "dom": counted, "service": service}))
    assert max(found) < MOST_HEAP
    assert counted["nodes"] < 20_000
    assert max(service) - service[0] < MOST_GROWTH
    studio.close()
    assert studio.complaints == []
