"""A world in real time: what a request costs, and what is recorded of it."""

from __future__ import annotations

import asyncio
import sys
from collections import Counter
from collections.abc import Callable
from types import FrameType

import pytest

from steptwin.controller import MILLISECOND, SECOND
from steptwin.errors import Misuse
from steptwin.files.recording import recording_of
from steptwin.files.world import World
from steptwin.live.batches import batches
from steptwin.live.clock import Clock
from steptwin.live.links import Feed
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.sharedreads import share_reads
from steptwin.live.world import ClientPort, LiveWorld, VisionPort
from steptwin.live.world_frames import subscribe_to_frames
from steptwin.mic488.config import ControllerConfig
from steptwin.mic488.device import Mic488Device
from steptwin.simulation.faults import Faults, FaultyPort
from steptwin.simulation.faults import LineProtocol as FaultLine
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.inputs import Bytes, See
from steptwin.wire.frameline import FrameLine
from steptwin.wire.slave import FrameDirection, TcpSlavePort

LINE = '[[line]]\nname = "bus"\ntcp = "127.0.0.1:0"\n[[mic488]]\nname = "twin"\nline = "bus"\n'
READ = bytes.fromhex("00 01 00 00 00 06 01 03 27 24 00 0a")
UNFRAMED = "9 bytes that belong to no frame"
MORE_CALLS = 8
"""Of a read through a world: the world around the scheduler, the place, its line."""


class Client:
    def __init__(self) -> None:
        self.heard = b""

    def write(self, data: bytes) -> None:
        self.heard += data


def calls(work: Callable[[], object]) -> Counter[str]:
    """The Python functions that are called meanwhile, by name."""
    found: Counter[str] = Counter()

    def note(frame: FrameType, event: str, _: object) -> None:
        if event == "call":
            found[frame.f_code.co_qualname] += 1

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        work()
    finally:
        sys.setprofile(before)
    return found


def test_a_read_through_a_world_takes_few_more_calls_than_one_of_a_served_controller() -> None:
    async def run() -> None:
        world = World.from_toml(LINE)
        world.stop_recording()
        live = LiveWorld(world)
        realtime = RealTimeDriver(live, Clock())
        live.share_reads(realtime)
        scheduler, device = Scheduler(), Mic488Device(ControllerConfig(), "1.70")
        scheduler.add("twin", device)
        served = RealTimeDriver(scheduler, Clock())
        port = FaultyPort(TcpSlavePort(share_reads({1: device}, served)), "tcp-1", Faults(), FaultLine.TCP)
        clients = Client(), Client()
        feeds = Feed(served, port, clients[0]), Feed(realtime, ClientPort(live, "bus", "tcp-1", "tcp"), clients[1])
        for one, feed in zip((served, realtime), feeds, strict=True):
            one.start()
            feed.take(READ)  # connects
        few, many = (calls(lambda feed=feed: feed.take(READ)) for feed in feeds)
        assert clients[0].heard == clients[1].heard != b""
        assert many.total() <= few.total() + MORE_CALLS, many - few
        for one in (served, realtime):
            one.close()

    asyncio.run(run())


def test_a_request_visits_no_other_scheduler() -> None:
    controllers = "".join(f'[[mic488]]\nname = "other-{i}"\n' for i in range(20))
    live = LiveWorld(World.from_toml(LINE + controllers))
    port = ClientPort(live, "bus", "tcp-1", "tcp")
    live.deadline()

    def read() -> None:
        live.advance(live.now + MILLISECOND)
        port.exchange(READ, live.now)
        live.deadline()

    read()
    found = calls(read)
    assert found["Mic488Device.execute"] == 1
    assert found["Scheduler.deadline"] + found["Scheduler.advance"] < 5, found


def test_what_is_due_in_many_schedulers_is_done_when_it_is_due() -> None:
    """Outputs that a script sets run along wires with delays, each in a scheduler of its own."""
    pairs = "".join(
        f'[[mic488]]\nname = "a{i}"\n[[wire]]\nfrom = "a{i}.OUT1"\nto = "a{i}.IN1"\ndelay = "{7 + 5 * i % 11} ms"\n'
        for i in range(8)
    )
    steps = ", ".join(f'{{ write = {{ "a{i}.OUT1" = 1 }} }}' for i in range(8))
    text = pairs + f'[[script]]\nname = "s"\nat = "3 ms"\nsteps = [{steps}]\n'
    alone, kept_up = World.from_toml(text), World.from_toml(text)
    live = LiveWorld(kept_up)
    moments = []
    while (due := live.deadline()) is not None and due < 100 * MILLISECOND:
        live.advance(due)
        moments.append(due)
    live.advance(100 * MILLISECOND)
    kept_up.sync_all()
    alone.run(for_="100 ms")
    assert list(alone.trace) == list(kept_up.trace)
    edges = {record.time for record in alone.trace.edges() if record.time}
    assert len(edges) > 5
    assert edges <= set(moments)


def test_without_a_recording_watchers_see_events_and_nothing_is_kept() -> None:
    world = World.from_toml(LINE + '[[event]]\nat = "1 ms"\nsteps = [{ note = "now" }]\n')
    world.stop_recording()
    seen: list[str] = []
    world.trace.subscribers.append(lambda record: seen.append(record.kind))
    live = LiveWorld(world)
    ClientPort(live, "bus", "tcp-1", "tcp").exchange(READ, live.now)
    live.advance(2 * MILLISECOND)
    assert "event" in seen
    assert "frame" not in seen
    assert (list(world.trace), world.inputs) == ([], [])
    with pytest.raises(Misuse, match="nothing is recorded of this world: it has no digest"):
        world.trace.digest()


def test_clients_that_are_served_together_share_what_they_read() -> None:
    async def run() -> None:
        world = World.from_toml(LINE)
        live = LiveWorld(world)
        realtime = RealTimeDriver(live, Clock(wall_ns=lambda: 0))
        live.share_reads(realtime)
        clients = [Client() for _ in range(3)]
        feeds = [Feed(realtime, ClientPort(live, "bus", f"tcp-{i}", "tcp"), client) for i, client in enumerate(clients)]
        realtime.start()
        batches().current = 7
        assert calls(lambda: [feed.take(READ) for feed in feeds])["Mic488Device.execute"] == 1
        write = bytes.fromhex("00 01 00 00 00 06 01 05 17 70 ff 00")
        # A write of one may change what the next one reads; the first read is still that of all.
        assert calls(lambda: [feed.take(request) for feed in feeds for request in (READ, write)])["Mic488Device.execute"] == 5
        assert len({client.heard for client in clients}) == 1
        batches().current = 0
        realtime.close()

    asyncio.run(run())


def test_reads_of_scripts_are_not_shared() -> None:
    """Scripts read at many moments while a real-time driver brings the world to one."""

    async def run() -> None:
        world = World.from_toml(LINE)
        live = LiveWorld(world)
        wall = [0]
        realtime = RealTimeDriver(live, Clock(wall_ns=lambda: wall[0]))
        live.share_reads(realtime)
        answers: list[bytes | None] = []

        def operator() -> do.Steps:
            request = do.Request("bus", 1, bytes.fromhex("02 1388 0001"), SECOND)
            answers.append((yield request))
            yield do.Set((("twin", "IN1", 1.0),))
            yield do.Wait(100 * MILLISECOND)
            answers.append((yield request))

        world.script(operator)
        wall[0] = SECOND
        realtime.enter()
        realtime.close()
        assert answers == [bytes.fromhex("02 01 00"), bytes.fromhex("02 01 01")]

    asyncio.run(run())


def test_records_of_a_vision_system_are_inputs_of_the_session() -> None:
    world = World.from_toml(LINE)
    live = LiveWorld(world)
    live.advance(MILLISECOND)
    port = VisionPort(live, "twin")
    assert [port.exchange(data, live.now) for data in (b"N1 X12.5 Y-3 ", b"A90\r\nnonsense\r\n")] == [b"", b""]
    live.advance(2 * MILLISECOND)
    assert [(given.time, given.what) for given in world.inputs] == [(MILLISECOND, See("twin", 1.0, 12.5, -3.0, 90.0))]
    recording = recording_of(world)
    again = recording.replay()
    assert again.trace.digest() == recording.digest
    assert again.mic488["twin"].device.snapshot() == world.mic488["twin"].device.snapshot()


@pytest.mark.parametrize("timing", ["off", "real", "strict"])
def test_frames_of_a_world_are_shown_in_words(timing: str) -> None:
    """Requests, answers and bytes that belong to no frame, on Modbus TCP and RTU."""
    world = World.from_toml(LINE if timing == "off" else LINE.replace("tcp =", f'timing = "{timing}"\ngap = 5\ntcp ='))
    world.stop_recording()
    live = LiveWorld(world)
    shown: list[FrameLine] = []
    subscribe_to_frames(live, shown.append)
    places = ClientPort(live, "bus", "tcp-1", "tcp"), ClientPort(live, "bus", "rtu-1", "rtu")
    for number, data in ((0, READ), (1, bytes.fromhex("01 03 27 24 00 02 8e b4")), (1, b"line noise"), (0, READ)):
        live.advance(live.now + 100 * MILLISECOND)
        places[number].exchange(data, live.now)
        live.advance(live.now + 90 * MILLISECOND)
    told = [(frame.link, frame.direction, frame.meaning[:15]) for frame in shown]
    noise = told.pop(4)
    position = "read M1_POS_ACT"
    asked = [(link, way, position) for link in ("tcp-1", "rtu-1", "tcp-1") for way in (FrameDirection.IN, FrameDirection.OUT)]
    assert told == asked
    # Its last letter may begin a frame; the controller drops the burst.
    assert (noise[0], shown[4].meaning) == ("rtu-1", UNFRAMED.replace("9", "10") if timing == "strict" else UNFRAMED)


def test_characters_of_a_world_are_shown_with_the_line_where_there_are_several() -> None:
    chips = '[[line]]\nname = "chips"\nkind = "m1486"\n[[m1486]]\nname = "F"\nline = "chips"\nvariant = "A"\n'
    world = World.from_toml(LINE + chips)
    live = LiveWorld(world)
    shown: list[str] = []
    subscribe_to_frames(live, lambda line: shown.append(f"{line.link} {line.meaning}"))
    ClientPort(live, "chips", "tcp-1", "raw").exchange(b"U1\r", live.now)
    live.advance(SECOND)
    ClientPort(live, "bus", "tcp-1", "tcp").exchange(READ, live.now)
    assert shown[:2] == ["chips/tcp-1 U1  Upload 1", "chips/line U1 position, low byte = 0"]
    assert shown[2].startswith("bus/tcp-1 read M1_POS_ACT")


@pytest.mark.parametrize(("given", "nanoseconds"), [("0.75", 750_000), ("5", 5_000_000), ('"2 ms"', 2_000_000)])
def test_a_line_gives_up_noise_after_its_gap(given: str, nanoseconds: int) -> None:
    world = World.from_toml(LINE.replace("tcp =", f"gap = {given}\ntcp ="))
    live = LiveWorld(world)
    ClientPort(live, "bus", "rtu-1", "rtu").exchange(b"\x01", live.now)
    assert live.deadline() == nanoseconds


@pytest.mark.parametrize("gap", ["0", "-1", "10001", '"11 s"', "true"])
def test_gaps_that_cannot_be_are_errors_of_the_description(gap: str) -> None:
    with pytest.raises(Misuse, match="gap"):
        World.from_toml(LINE.replace("tcp =", f"gap = {gap}\ntcp ="))


def test_a_real_serial_port_has_the_gap_of_a_uart() -> None:
    world = World.from_toml(LINE.replace("tcp =", "baud = 9600\ntcp ="))
    line = world.lines["bus"]
    assert (line.baud, line.is_timed) == (9600, False)
    live = LiveWorld(world)
    live.advance(SECOND)
    port = ClientPort(live, "bus", "serial", "serial")
    port.exchange(b"\x01\x03", live.now)
    assert live.deadline() == SECOND + 750_000


@pytest.mark.parametrize("kind", ["tcp", "rtu"])
def test_reads_that_change_nothing_are_not_recorded(kind: str) -> None:
    """Neither in the recording nor in the trace; the recording replays to the same digest all the same. Writes are in both."""
    read = READ if kind == "tcp" else bytes.fromhex("01 03 27 24 00 02 8e b4")
    write = bytes.fromhex("00 01 00 00 00 06 01 05 07 d0 ff 00")
    world = World.from_toml(LINE)
    live = LiveWorld(world)
    shown: list[FrameLine] = []
    subscribe_to_frames(live, shown.append)
    port, writer = ClientPort(live, "bus", f"{kind}-1", kind), ClientPort(live, "bus", "tcp-2", "tcp")
    for step in range(20):
        live.advance(live.now + 10 * MILLISECOND)
        assert port.exchange(read, live.now)
        if step == 10:
            writer.exchange(write, live.now)
    assert [given.what.data for given in world.inputs if isinstance(given.what, Bytes)] == [write]
    assert [record.subject for record in world.trace.frames()] == ["tcp-2/in", "tcp-2/out"]
    assert len(shown) == 42
    recording = recording_of(world)
    assert recording.replay().trace.digest() == recording.digest


def test_a_read_in_pieces_or_under_a_fault_is_recorded() -> None:
    world = World.from_toml(LINE)
    live = LiveWorld(world)
    port = ClientPort(live, "bus", "tcp-1", "tcp")
    port.exchange(READ[:5], live.now)
    port.exchange(READ[5:], live.now)
    port.exchange(READ, live.now)
    world.fault("exception code=6 nth=2")
    port.exchange(READ, live.now)
    assert [len(given.what.data) for given in world.inputs if isinstance(given.what, Bytes)] == [5, 7, 12]
    recording = recording_of(world)
    assert recording.replay().trace.digest() == recording.digest
