"""A world kept up with a clock does what the same world does in virtual time with the same inputs."""

from __future__ import annotations

import asyncio
import socket
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.errors import LineFailure, Misuse
from steptwin.files.export.tracefile import TraceFile
from steptwin.files.recording import load, recording_of
from steptwin.files.world import World
from steptwin.files.worldoptions import WorldRunOptions
from steptwin.live.clock import Clock
from steptwin.live.links import Feed
from steptwin.live.options import LiveOptions, UpOptions
from steptwin.live.pace import Pace
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.running import ClientPort, LiveWorld, up
from steptwin.live.world_control import WorldControl
from steptwin.simulation.script import steps as do
from steptwin.subject.subscriptions import filter_of
from steptwin.wire.crc import with_crc

EXAMPLES = Path(__file__).parents[2] / "examples" / "worlds"
READ_POSITION = bytes.fromhex("01 03 27 24 00 02 8e b4")


class Wall:
    """A clock that stands until it is set."""

    def __init__(self) -> None:
        self.now: Nanos = 0

    def __call__(self) -> Nanos:
        return self.now


class Client:
    """The other end of a link."""

    def __init__(self) -> None:
        self.heard = b""

    def write(self, data: bytes) -> None:
        self.heard += data


def started(wall: Wall, speed: float = 1.0) -> tuple[World, LiveWorld, RealTimeDriver]:
    live = LiveWorld(World.load(EXAMPLES / "feeder.toml"))
    return live.world, live, RealTimeDriver(live, Clock(speed, wall))


@settings(max_examples=12, deadline=None)
@given(
    looks=st.lists(st.tuples(st.integers(1, 900), st.sampled_from(["look", "bus", "chips", "press", "pin"])), max_size=12),
    speed=st.sampled_from([0.5, 1.0, 10.0]),
)
def test_live_and_virtual_give_the_same_trace(looks: list[tuple[int, str]], speed: float) -> None:
    async def run() -> World:
        wall = Wall()
        world, live, realtime = started(wall, speed)
        bus, chips = ClientPort(live, "bus", "tcp-1", "rtu"), ClientPort(live, "chips", "raw-1", "raw")
        hand = WorldControl(realtime, live, Pace(live, realtime, lambda _: None, has_clients=True), list)
        realtime.clock.run(speed)
        for pause, what in looks:
            # Less than what counts as held up: nothing here runs the loop between.
            for _ in range(pause // 100 + 1):
                wall.now += 100 * MILLISECOND
                now = realtime.enter()
                realtime.leave()
            if what == "bus":
                bus.exchange(READ_POSITION, now)
            elif what == "chips":
                chips.exchange(b"x3\rf640\rr\r", now)
            elif what == "press":
                hand.do(do.Press("start"))
            elif what == "pin":
                hand.do(do.Set((("table", "IN8", pause % 2),)))
        realtime.close()
        return world

    world = asyncio.run(run())
    recording = recording_of(world)
    again = recording.replay()
    assert again.trace.digest() == recording.digest
    assert list(again.trace) == list(world.trace)


def test_answers_come_to_the_client_when_the_line_has_carried_them() -> None:
    async def run() -> None:
        wall = Wall()
        world, live, realtime = started(wall)
        client, port = Client(), ClientPort(live, "bus", "rtu-1", "rtu")
        feed = Feed(realtime, port, client)
        wall.now = 20 * SECOND
        realtime.enter()
        feed.take(READ_POSITION)
        assert client.heard == b""
        wall.now += 10 * MILLISECOND
        realtime.enter()
        await asyncio.sleep(0)
        assert client.heard == with_crc(bytes.fromhex("01 03 04 00 00 43 16"))
        feed.close()
        realtime.close()
        assert [type(given.what).__name__ for given in world.inputs] == ["Bytes", "Leave"]

    asyncio.run(run())


STOPPING = """
    [[mic488]]
    name = "a"
    [[script]]
    name = "first"
    steps = [{ wait = "1 s" }, { stop = "enough" }]
    [[script]]
    name = "second"
    repeat = 1000
    steps = [{ wait = "300 ms" }, { note = "tick" }]
"""


def test_in_a_studio_a_script_that_stops_is_reported_and_time_goes_on() -> None:
    live = LiveWorld(World.from_toml(STOPPING))
    told = live.subject.subscribe(filter_of(["status"]), 9)
    live.advance(5 * SECOND)
    assert recording_of(live.world).replay().trace.digest() == live.world.trace.digest()
    assert (live.now, live.world.stopped) == (5 * SECOND, None)
    assert [(event.time, event.text) for event in told.take().events] == [(SECOND, "a script would end the run here: enough")]


def test_a_script_that_stops_a_live_world_stops_it_for_all() -> None:
    live = LiveWorld(World.from_toml(STOPPING))
    stops: list[Nanos] = []
    live.on_stop = lambda: stops.append(live.now)
    live.advance(SECOND - 1)
    assert stops == []
    live.advance(3 * SECOND)
    live.advance(4 * SECOND)
    assert set(stops) == {SECOND}
    assert (live.now, live.deadline()) == (SECOND, None)


def arguments(tmp_path: Path, text: str) -> UpOptions:
    world = tmp_path / "stopping.toml"
    world.write_text(text)
    return UpOptions(
        world=world,
        run=WorldRunOptions(session=tmp_path / "s.json"),
        live=LiveOptions(speed="1000", trace=str(tmp_path / "t.jsonl")),
    )


def test_a_script_ends_the_command(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    options = arguments(tmp_path, STOPPING)
    assert up(options)
    told = capfd.readouterr().out.splitlines()
    assert told[-3:-1] == [f"wrote {options.run.session}", f"wrote {options.live.trace}"]
    assert told[-1].startswith("ran for 1.000 s, 0 inputs, ended by: enough, digest ")
    assert load(tmp_path / "s.json").until == SECOND


def test_a_world_can_begin_with_faults(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    options = arguments(tmp_path, STOPPING)
    options = replace(options, run=replace(options.run, fault=("lost-steps machine=a axis=1 pulses=64 at_s=0.5",)))
    assert up(options)
    assert "lost-steps: M1 loses 64 pulses" in capfd.readouterr().out
    recording = load(tmp_path / "s.json")
    assert len(recording.inputs) == 1
    assert recording.replay().trace.digest() == recording.digest
    with pytest.raises(Misuse, match="axis = 9"):
        up(replace(options, run=WorldRunOptions(fault=("stall machine=a axis=9",))))


def test_a_trace_that_cannot_be_written_leaves_the_session(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(file: TraceFile, _: object) -> None:
        file._file.close()
        raise Misuse("cannot write the trace: no space left on device")

    monkeypatch.setattr("steptwin.live.running.TraceFile.close", full)
    options = arguments(tmp_path, STOPPING)
    with pytest.raises(Misuse, match="no space left on device"):
        up(options)
    assert load(tmp_path / "s.json").until == SECOND


def test_what_did_not_begin_overwrites_nothing(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        line = f'[[line]]\nname = "chips"\nkind = "m1486"\ntcp = "127.0.0.1:{taken.getsockname()[1]}"\n'
        options = arguments(tmp_path, STOPPING + line + '[[m1486]]\nname = "b"\nline = "chips"\n')
        for path in (options.run.session, options.live.trace):
            assert path is not None
            Path(path).write_text("yesterday")
        with pytest.raises(LineFailure, match="in use"):
            up(options)
    assert [path.read_text() for path in tmp_path.glob("?.json*")] == ["yesterday"] * 2


@pytest.mark.parametrize(
    ("speed", "message"),
    [
        ("-1", "permitted are 0 \\(paused\\), 0.001 to 1000"),
        ("fast", "permitted are 0"),
        ("max", "line 'bus' has external clients"),
    ],
)
def test_speeds_that_cannot_be_are_misuse(speed: str, message: str) -> None:
    with pytest.raises(Misuse, match=message):
        up(UpOptions(world=EXAMPLES / "feeder.toml", live=LiveOptions(speed=speed)))


def test_a_world_wakes_up_by_itself() -> None:
    async def run() -> None:
        live = LiveWorld(World.load(EXAMPLES / "lift.toml"))
        noted = asyncio.Event()
        live.world.trace.subscribers.append(lambda record: noted.set() if record.subject == "note" else None)
        realtime = RealTimeDriver(live, Clock(1000.0))
        Pace(live, realtime, lambda _: None, has_clients=False).begin(1000.0)
        await asyncio.wait_for(noted.wait(), 60)
        assert live.world.now > 0
        realtime.close()

    asyncio.run(run())
