"""A world that is up for weeks keeps nothing of what its clients ask, unless a recording was asked for."""

from __future__ import annotations

import gc
import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path

import pytest
from soak import scaled

from steptwin.controller import MILLISECOND
from steptwin.errors import Misuse
from steptwin.files.recording import load, save
from steptwin.files.world import World
from steptwin.live import world as live_world_module
from steptwin.live.world import ClientPort, LiveWorld
from steptwin.simulation.kinds.lines import SCRIPTS
from steptwin.simulation.kinds.mic488.line import ModbusBus
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.inputs import Bytes

EXAMPLES = Path(__file__).parents[2] / "examples" / "worlds"
READ_RTU = bytes.fromhex("01 03 27 24 00 02 8e b4")
READ_TCP = bytes.fromhex("00 01 00 00 00 06 01 03 27 24 00 02")
REQUESTS = 1_000_000
WARM_UP = 2000
FEW_BLOCKS = 200
"""Caches fill up a little; one block for each request would be 10 000 in the shortest of runs."""


def blocks() -> int:
    gc.collect()
    return sys.getallocatedblocks()


def grown(work: Callable[[], None], times: int) -> int:
    """How many blocks of memory more there are after so many rounds of work."""
    for _ in range(WARM_UP):
        work()
    before = blocks()
    for _ in range(times):
        work()
    return blocks() - before


def live_world(*, keep_inputs: bool = False) -> LiveWorld:
    text = Path(__file__).with_name("feeder.toml").read_text().replace('timing = "real"', 'timing = "off"')
    files = {path.name: path.read_bytes() for path in EXAMPLES.iterdir() if path.is_file() and path.suffix != ".toml"}
    return LiveWorld(World.from_toml(text, files, keep_trace=False, keep_inputs=keep_inputs))


@contextmanager
def clients(live: LiveWorld) -> Generator[Callable[[], None]]:
    """Work of clients on every line, a moment after the other."""
    tcp, rtu = ClientPort(live, "bus", "tcp-1", "tcp"), ClientPort(live, "bus", "rtu-1", "rtu")
    raw = ClientPort(live, "chips", "raw-1", "raw")
    now = live.now

    def work() -> None:
        nonlocal now
        now += 10 * MILLISECOND
        live.advance(now)
        assert len(tcp.exchange(READ_TCP, now)) == 13
        rtu.exchange(READ_RTU, now)
        raw.exchange(b"q", now)
        for port in (tcp, rtu, raw):
            port.to_send(now)

    yield work
    for port in (tcp, rtu, raw):
        port.close()


def test_clients_that_ask_leave_nothing_behind() -> None:
    live = live_world()
    with clients(live) as work:
        assert grown(work, scaled(10 * REQUESTS) // 3 + 1) < FEW_BLOCKS
    assert live.world.inputs == []


def test_answers_that_scripts_do_not_fetch_are_dropped() -> None:
    live = live_world()
    step = do.Write((("table", "USER_REGISTER[10]", 1.0),))
    for _ in range(scaled(REQUESTS // 10)):
        live.apply_input(step)
        live.advance(live.now + 20 * MILLISECOND)
    line = live.world.lines["bus"]
    assert isinstance(line, ModbusBus)
    assert (len(line.clients[SCRIPTS].received), line.master.answers, line.master.deadline()) == (0, {}, None)


def test_a_recorded_session_ends_where_it_is_full(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(live_world_module, "MOST_INPUTS", 300)
    told: list[str] = []
    live = live_world(keep_inputs=True)
    live = LiveWorld(live.world, told.append)
    with clients(live) as work:
        for _ in range(320):
            work()
    recording = live.recording()
    assert told == [f"the recording is full and ends at {recording.until / 10**9:g} s, after 300 inputs"]
    assert len(recording.inputs) == 300
    assert live.world.inputs == []
    save(recording, tmp_path / "s.json")
    assert load(tmp_path / "s.json").replay().trace.digest() == recording.digest


def test_a_recorded_session_is_bounded_in_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_world_module, "MOST_INPUT_BYTES", 10_000)
    live = live_world(keep_inputs=True)
    for _ in range(40):
        live.apply_input(Bytes("chips", "raw-1", "raw", b" " * 1000))
    assert len(live.recording().inputs) == 10


def test_without_a_session_there_is_none_to_save() -> None:
    with pytest.raises(Misuse, match="this world is not recorded: start it with --session FILE"):
        live_world().recording()


def test_clients_that_come_and_go_leave_nothing_behind() -> None:
    live = live_world()

    def work() -> None:
        port = ClientPort(live, "bus", "tcp-1", "tcp")
        port.exchange(READ_TCP, live.now)
        port.close()

    assert grown(work, scaled(REQUESTS // 10)) < FEW_BLOCKS
