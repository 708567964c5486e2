"""What saves work for clients of a line changes nothing, whoever looks on: shared reads, batches, reads that are not recorded,
whole requests without the framer, and the world that is not visited where nothing is due."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import ExitStack
from typing import NamedTuple
from unittest.mock import patch

from hypothesis import example, given, settings
from hypothesis import strategies as st

from steptwin.controller import MILLISECOND
from steptwin.files.recording import recording_of
from steptwin.files.world import World
from steptwin.live.batches import batches
from steptwin.live.clock import Clock
from steptwin.live.links import Feed
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.world import ClientPort, LiveWorld
from steptwin.simulation.kinds.mic488.line import ModbusBus
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.world.inputs import Bytes
from steptwin.simulation.world.snapshot import RecordedInput
from steptwin.wire import mbap
from steptwin.wire.crc import with_crc
from steptwin.wire.pdu import READS
from steptwin.wire.slave import FrameDirection, RtuSlavePort, TcpSlavePort

TEXT = """
[[line]]
name = "bus"
tcp = "127.0.0.1:0"
[[mic488]]
name = "a"
line = "bus"
program = "p.prg"
[[mic488]]
name = "b"
line = "bus"
unit = 2
[[wire]]
from = "a.OUT1"
to = "b.IN1"
[[wire]]
from = "b.OUT1"
to = "a.IN2"
delay = "3 ms"
"""
PROGRAM = b"A:\nWAIT $I0 = 1\nOUT1 = ON\nDELAY 0.004\nOUT1 = OFF\n$I0 = 0\nJUMP A\n"
REQUESTS = tuple(
    bytes.fromhex(text)
    for text in (
        "02 1388 0010",
        "03 2724 0008",
        "01 1770 0008",
        "05 1770 ff00",
        "05 1770 0000",
        "06 0000 0001",
        "06 2713 0001",
        "06 2713 0000",
        "03 0000 0002",
        "03 ffff 0001",
    )
)
"""Reads of inputs, positions, outputs and user registers, also where there are none; OUT1, user register 0, the program."""
KINDS = ("tcp", "rtu", "tcp")
OBSERVERS = ("inputs", "records", "frames", "condition")


class Batch(NamedTuple):
    """What comes at one moment."""

    pause_ms: int
    requests: list[tuple[int, int, int]]
    """Client, unit, number of the request."""
    observers: set[str]
    """Those that come, or go."""


class Seen(NamedTuple):
    answers: tuple[bytes, ...]
    writes: list[tuple[int, str, bytes]]
    """Requests that watchers of inputs have seen and that are no reads."""
    sent: list[tuple[int, str, bytes]]
    """Those that were there to be seen."""
    frames: list[tuple[int, str, FrameDirection, bytes]]
    framed: list[tuple[int, str, FrameDirection, bytes]]
    """The requests that were there to be seen in frames."""
    edges: list[tuple[int, str, str, object]]
    state: str


class Client:
    def __init__(self) -> None:
        self.heard = b""

    def write(self, data: bytes) -> None:
        self.heard += data


class Frames:
    def __init__(self, found: list[tuple[int, str, FrameDirection, bytes]]) -> None:
        self._found = found

    def frame(self, now: int, client: str, direction: FrameDirection, data: bytes) -> None:
        self._found.append((now, client, direction, data))

    def unframed(self, now: int, client: str, count: int) -> None:
        """There is none."""


def join(name: str, world: World, found: Seen) -> Callable[[], None]:
    """Let an observer look on; how it leaves."""

    def noted(given: RecordedInput) -> None:
        what = given.what
        if isinstance(what, Bytes) and what.data and what.data[7 if what.place.startswith("tcp") else 1] not in READS:
            found.writes.append((given.time, what.place, what.data))

    if name == "inputs":
        world.input_subscribers.append(noted)
        return lambda: world.input_subscribers.remove(noted)
    if name == "frames":
        frames, line = Frames(found.frames), world.lines["bus"]
        line.subscribe_to_frames(frames)
        return lambda: line.unsubscribe_from_frames(frames)
    if name == "records":
        seen: list[TraceRecord] = []
        world.trace.subscribers.append(seen.append)
        return lambda: world.trace.subscribers.remove(seen.append)
    world.holds(world.condition("a.USER_REGISTER[0] > 0 and b.IN1"))
    return lambda: None


def played(given_batches: list[Batch], *, shortcuts: bool, records: bool) -> Seen:
    """What the clients and observers see. ``records``: with trace and recording, which is replayed."""
    found = Seen((), [], [], [], [], [], "")

    async def run() -> Seen:
        world = World.from_toml(TEXT, {"p.prg": PROGRAM}, keep_trace=records, keep_inputs=records)
        if not records:
            world.stop_recording()
        live, wall = LiveWorld(world), [0]
        realtime = RealTimeDriver(live, Clock(wall_ns=lambda: wall[0]))
        if shortcuts:
            live.share_reads(realtime)
        ports = [ClientPort(live, "bus", f"{kind}-{number}", kind) for number, kind in enumerate(KINDS)]
        clients = [Client() for _ in KINDS]
        feeds = [Feed(realtime, port, client) for port, client in zip(ports, clients, strict=True)]
        realtime.start()
        world.trace.subscribers.append(
            lambda one: found.edges.append((one.time, one.controller, one.subject, one.value)) if one.kind == "edge" else None
        )
        there: dict[str, Callable[[], None]] = {}
        for number, batch in enumerate(given_batches):
            wall[0] += batch.pause_ms * MILLISECOND
            for name in sorted(batch.observers):
                if name in there:
                    there.pop(name)()
                else:
                    there[name] = join(name, world, found)
            batches().current = number + 1 if shortcuts else 0
            for client, unit, request in batch.requests:
                pdu = REQUESTS[request]
                data = mbap.encode_frame(request, unit, pdu) if KINDS[client] == "tcp" else with_crc(bytes((unit,)) + pdu)
                feeds[client].take(data)
                sent = world.now, f"{KINDS[client]}-{client}", data
                if "inputs" in there and pdu[0] not in READS:
                    found.sent.append(sent)
                if "frames" in there:
                    found.framed.append((*sent[:2], FrameDirection.IN, data))
            batches().current = 0
        wall[0] += 50 * MILLISECOND
        realtime.enter()
        realtime.close()
        world.sync_all()
        if records:
            assert recording_of(world).replay().trace.digest() == world.trace.digest()
        state = repr([world.kind(name).state(controller, world.now) for name, controller in world.controllers.items()])
        return found._replace(answers=tuple(client.heard for client in clients), state=state)

    with ExitStack() as stack:
        if not shortcuts:
            stack.enter_context(patch.object(ModbusBus, "is_idle_read", lambda line, place, data: False))
            stack.enter_context(patch.object(LiveWorld, "advance", LiveWorld._advance))
            stack.enter_context(patch.object(RtuSlavePort, "exchange", by_framer_rtu))
            stack.enter_context(patch.object(TcpSlavePort, "exchange", by_framer_tcp))
        return asyncio.run(run())


def by_framer_rtu(port: RtuSlavePort, data: bytes, now: int) -> bytes:
    return port._execute(port._framer.feed(data, now, now), now)


def by_framer_tcp(port: TcpSlavePort, data: bytes, now: int) -> bytes:
    return b"".join(port._answer(frame.raw, now) for frame in port._framer.feed(data))


PAUSES = st.sampled_from((0, 1, 3, 20))
ASKED = st.tuples(st.integers(0, len(KINDS) - 1), st.integers(1, 3), st.integers(0, len(REQUESTS) - 1))
WATCHING = st.sets(st.sampled_from(OBSERVERS), max_size=2)


@settings(max_examples=20, deadline=None)
@given(
    given_batches=st.lists(st.builds(Batch, PAUSES, st.lists(ASKED, min_size=2, max_size=8), WATCHING), min_size=4, max_size=10),
    records=st.booleans(),
)
@example(given_batches=[Batch(1, [(0, 1, 0)], set()), Batch(1, [(0, 1, 5)], {"inputs"})], records=False)
def test_clients_and_observers_see_the_same_with_and_without_shortcuts(given_batches: list[Batch], records: bool) -> None:
    quick, general = (played(given_batches, shortcuts=shortcuts, records=records) for shortcuts in (True, False))
    assert quick == general
    assert quick.writes == quick.sent
    assert [frame for frame in quick.frames if frame[2] is FrameDirection.IN] == quick.framed
