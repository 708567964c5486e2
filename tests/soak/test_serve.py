"""A world of `serve` holds as much after many requests as after few: ports, scheduler, events and the log of frames."""

from __future__ import annotations

import asyncio
import random
from collections.abc import Callable, Iterator
from itertools import count, islice, repeat
from typing import Any

import pytest
from held import Held, held
from soak import scaled
from virtual_loop import run_virtually

from steptwin.files.world import World
from steptwin.live.links import Feed
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.world import ClientPort, LiveWorld
from steptwin.live.world_frames import subscribe_to_frames
from steptwin.m1486.events import EVENTS_KEPT
from steptwin.simulation.describe.generated import LINE, Whole
from steptwin.simulation.describe.generated_m1486 import m1486_world
from steptwin.simulation.describe.generated_mic488 import mic488_world
from steptwin.wire.crc import crc16

REQUESTS = 1_000_000
PIECES = 150_000
"""Of typed text: about a million characters."""
FIRST = 6_000
"""Requests before the first count: they compile what is asked often and write the whole command memory."""


class Client:
    """Counts what it is sent and keeps nothing."""

    def __init__(self) -> None:
        self.received = 0

    def write(self, data: bytes) -> None:
        self.received += len(data)


Begin = Callable[[LiveWorld, RealTimeDriver], Callable[[bytes], None]]


def fill(live: LiveWorld) -> None:
    """Fill the stores whose size is bounded by a number, whatever requests have put there."""
    chips = [view.chip for view in live.world.m1486.values()]
    for controller in (*chips, *(view.device for view in live.world.mic488.values())):
        for _ in range(EVENTS_KEPT):
            controller.event("power-on", "an event", controller.now)


def small(text: str, files: dict[str, bytes] | None = None, *, watched: bool) -> LiveWorld:
    """A world of `serve`; ``watched``: its frames are put into words."""
    live = LiveWorld(World.from_toml(text, files, keep_trace=False, keep_inputs=False))
    live.world.stop_recording()
    if watched:
        subscribe_to_frames(live, lambda frame: None)
    return live


async def _grown(live: LiveWorld, begin: Begin, sent: Iterator[bytes], requests: int, pause_s: float) -> tuple[Held, Held]:
    """What is held after the first requests and after many more, each time when all work is done."""
    loop: Any = asyncio.get_running_loop()
    realtime = RealTimeDriver(live, loop.clock())
    live.world.trace.subscribers.append(lambda record: None)
    send = begin(live, realtime)
    realtime.start()

    async def level(requests: int) -> Held:
        for data in islice(sent, requests):
            send(data)
            await asyncio.sleep(pause_s)
        await asyncio.sleep(10.0)
        fill(live)  # the events that are kept are as long as those of the other level
        return held(live, realtime, send)

    levels = await level(FIRST), await level(requests)
    realtime.close()
    return levels


def assert_level(live: LiveWorld, begin: Begin, sent: Iterator[bytes], full: int, pause_s: float) -> None:
    requests = scaled(full)
    before, after = run_virtually(_grown(live, begin, sent, requests, pause_s))
    objects, size = after.objects - before.objects, after.bytes - before.bytes
    permitted = 500 + requests // 100
    assert objects < permitted, f"{objects} objects more after {requests} further requests: {before}, {after}"
    assert size < 100 * permitted, f"{size} bytes more after {requests} further requests: {before}, {after}"


# ---------------------------------------------------------------------- M1486

COMMANDS = b"f640 u20 u5 @3 :7 +9 ?14 c1 t1 k c75 xg R Q3 t41 t57 t44 f1;so \\ [ ] j3 i80h3 l3 e"
TYPED = [*(command + b"\r" for command in COMMANDS.split()), b"\xff\x00", b"f" * 90, b"\n"]


def characters(chance: random.Random) -> Iterator[bytes]:
    """What people and programs type, in pieces of any size; a loop that never ends is killed and begun anew."""
    while True:
        data = b"".join(chance.choices(TYPED, k=20))
        while data:
            size = chance.choice((1, 1, 2, 7, 40))
            yield data[:size]
            data = data[size:]


def to_chips(live: LiveWorld, realtime: RealTimeDriver) -> Callable[[bytes], None]:
    """A client that types and reads, one that has stopped reading."""
    feeds = [Feed(realtime, ClientPort(live, LINE, name, "raw"), Client()) for name in ("pty", "tcp-1")]
    feeds[1].is_read = False
    return feeds[0].take


@pytest.mark.parametrize("is_timed", [False, True], ids=["untimed", "timed"])
@pytest.mark.parametrize("watched", [False, True], ids=["unwatched", "watched"])
def test_characters_to_m1486_chips(is_timed: bool, watched: bool) -> None:
    whole = Whole(name="soak", line={"timing": "real" if is_timed else "off"})
    live = small(m1486_world(whole, [0, 7], {"variant": "B"}), watched=watched)
    assert_level(live, to_chips, characters(random.Random(2)), PIECES, 0.02 if is_timed else 0.004)


def test_a_chip_that_sends_to_nobody() -> None:
    """A character in 10 ms, and nobody is on the line; the log of characters is not wanted."""
    program = {"p.m1486": b"[\n@1\nw10\nu20\nc1\nt1\nj1\n]"}
    live = small(m1486_world(Whole(name="soak"), [15], {"variant": "B", "program": "p.m1486"}), program, watched=False)

    def nobody(live: LiveWorld, realtime: RealTimeDriver) -> Callable[[bytes], None]:
        return lambda data: None

    assert_level(live, nobody, repeat(b""), REQUESTS, 0.012)


# ---------------------------------------------------------------------- MIC488


def pdus(chance: random.Random) -> Iterator[bytes]:
    """Reads and writes at any address, permitted or not, functions that are none."""
    while True:
        function = chance.choice((1, 2, 3, 3, 4, 5, 6, 16, 16, 17, 22, 99))
        address = chance.choice((0, 10, 100, 110, 1000, 1010, 5000, chance.randrange(0x10000))).to_bytes(2, "big")
        if function == 16:
            count = chance.choice((1, 2, 4))
            yield bytes((16,)) + address + bytes((0, count, 2 * count)) + chance.randbytes(2 * count)
        else:
            yield bytes((function,)) + address + chance.choice((b"\x00\x01", b"\x00\x02", b"\xff\x00", chance.randbytes(2)))


def rtu_requests(chance: random.Random) -> Iterator[bytes]:
    """Frames for units that are there, not there and all, some of them damaged or cut."""
    for pdu in pdus(chance):
        frame = bytes((chance.choice((1, 1, 1, 2, 9, 0)),)) + pdu
        frame += crc16(frame).to_bytes(2, "little")
        yield chance.choice((frame, frame, frame, frame, frame[:-1], frame + b"\x55", chance.randbytes(9)))


def tcp_requests(chance: random.Random) -> Iterator[bytes]:
    for number, pdu in enumerate(pdus(chance)):
        head = (number & 0xFFFF).to_bytes(2, "big") + b"\x00\x00" + (len(pdu) + 1).to_bytes(2, "big")
        yield head + bytes((chance.choice((1, 2, 9)),)) + pdu


def one_client(kind: str) -> Begin:
    def begin(live: LiveWorld, realtime: RealTimeDriver) -> Callable[[bytes], None]:
        live.share_reads(realtime)
        return Feed(realtime, ClientPort(live, LINE, f"{kind}-1", kind), Client()).take

    return begin


@pytest.mark.parametrize("frames", [False, True], ids=["unwatched", "watched"])
@pytest.mark.parametrize("kind", ["tcp", "rtu", "timed-rtu"])
def test_requests_to_mic488_controllers(kind: str, frames: bool) -> None:
    chance = random.Random(3)
    whole = Whole(name="soak", line={"timing": "real" if kind == "timed-rtu" else "off"})
    live = small(mic488_world(whole, [1, 2], {}, demo=True), watched=frames)
    place, requests = ("tcp", tcp_requests) if kind == "tcp" else ("rtu", rtu_requests)
    assert_level(live, one_client(place), requests(chance), REQUESTS, 0.010)


@pytest.mark.parametrize("kind", ["mic488", "m1486"])
def test_clients_that_come_and_go(kind: str) -> None:
    chance, numbers = random.Random(4), count(1)

    def begin(live: LiveWorld, realtime: RealTimeDriver) -> Callable[[bytes], None]:
        def visit(data: bytes) -> None:
            place = ClientPort(live, LINE, f"tcp-{next(numbers)}", "raw" if kind == "m1486" else "tcp")
            feed = Feed(realtime, place, Client())
            feed.take(data)
            feed.close()

        return visit

    if kind == "m1486":
        live = small(m1486_world(Whole(name="soak"), [15], {"variant": "B"}), watched=True)
        sent, full = characters(chance), PIECES
    else:
        live = small(mic488_world(Whole(name="soak"), [1], {}), watched=True)
        sent, full = tcp_requests(chance), REQUESTS
    assert_level(live, begin, sent, full, 0.002)
