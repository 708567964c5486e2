"""Requests in bursts with pauses, very often: a port executes what a reader finds that was written from the rule (MIC-15)."""

from __future__ import annotations

import random
from itertools import pairwise

from burst_reader import GAP, UNIT, BurstReader, checksum
from soak import scaled

from steptwin.controller import MILLISECOND, SECOND
from steptwin.wire.slave import RtuSlavePort

SHORT_PAUSES = [0, 0, 0, MILLISECOND, 10 * MILLISECOND, GAP - 1]
LONG_PAUSES = [
    GAP,
    *(n * MILLISECOND for n in (25, 40, 45, 150, 219, 220, 221, 1000, 1900)),
    2 * SECOND,
    2 * SECOND + 1,
    3 * SECOND,
]
PAUSES = SHORT_PAUSES + LONG_PAUSES
PROBE = bytes((3, 0x0F, 0xF0, 0, 1))


class Executed:
    """A device that answers everything and keeps what it has executed."""

    def __init__(self) -> None:
        self.pdus: list[bytes] = []

    def execute(self, pdu: bytes, now: int) -> bytes:
        self.pdus.append(pdu)
        return bytes((pdu[0] | 0x80, 4))


class Line:
    """Frames, halves of frames, frames in frames and noise, in deliveries with pauses between them."""

    def __init__(self, seed: int) -> None:
        self.chance = random.Random(seed)
        self.number = 0

    def short(self) -> bytes:
        """A request whose data are its number."""
        self.number += 1
        unit = self.chance.choice([UNIT, UNIT, UNIT, UNIT, 0, 9])
        function = self.chance.choice([3, 5, 6, 6])
        body = bytes((unit, function)) + (self.number & 0xFFFF).to_bytes(2, "big") + self.chance.randbytes(2)
        return body + checksum(body)

    def long(self) -> bytes:
        """A request or a response of another unit, some with frames in its data."""
        data = b"".join(
            self.chance.choice([self.short(), self.chance.randbytes(self.chance.randrange(20)), bytes(self.chance.randrange(20))])
            for _ in range(self.chance.randrange(1, 7))
        )[:240]
        data += bytes(len(data) % 2)
        head = bytes((self.chance.choice([UNIT, UNIT, 0, 9]), 16, 0, 100, 0, len(data) // 2, len(data)))
        body = self.chance.choice([head, head, bytes((9, 3, len(data)))]) + data
        return body + checksum(body)

    def item(self) -> bytes:
        chance, kind = self.chance, self.chance.randrange(12)
        frame = self.long() if kind % 2 else self.short()
        if kind < 8:
            return frame
        if kind < 10:
            kept = chance.randrange(1, len(frame))
            return frame[: kept - (frame[kept:] == bytes((UNIT,)))]  # otherwise the next request would complete it
        if kind < 11:
            place = chance.randrange(len(frame))
            return frame[:place] + bytes((frame[place] ^ 1 << chance.randrange(8),)) + frame[place + 1 :]
        body = bytes((UNIT, chance.choice([0x41, 0x64]))) + chance.randbytes(chance.randrange(1, 6))
        beginnings = bytes((chance.choice([5, UNIT]),)) * chance.choice([chance.randrange(4), chance.randrange(600)])
        noise = chance.randbytes(chance.randrange(1, 12))
        return chance.choice([noise, bytes((255,)), beginnings or b"\0", body + checksum(body)])

    def pieces(self, item: bytes) -> list[bytes]:
        """Whole mostly; in two or three; around a frame in its data; byte by byte."""
        chance = self.chance
        places = chance.choice([[], [], [chance.randrange(len(item))], sorted(chance.randrange(len(item)) for _ in "ab")])
        if chance.randrange(30) == 0:
            places = list(range(len(item)))
        inner = item.find(bytes((UNIT, 6)), 3)
        if inner > 0 and chance.randrange(3) == 0:
            places = chance.choice([[inner], [inner, inner + 8], [inner + 8], [7, inner]])
        edges = [0, *sorted(min(place, len(item)) for place in places), len(item)]
        return [item[a:b] for a, b in pairwise(edges) if a < b]

    def deliveries(self) -> list[tuple[int, bytes]]:
        """The pause before each delivery of an item, and its bytes."""
        chance = self.chance
        pieces = self.pieces(self.item())
        inside = chance.choice(PAUSES)
        first, *rest = pieces
        return [
            (chance.choice(PAUSES), first),
            *((chance.choice([inside, inside, inside, chance.choice(PAUSES)]), p) for p in rest),
        ]


def test_mic_15_requests_in_bursts_with_pauses_are_those_of_an_own_reader() -> None:
    """Everything that the port executes, in its order; and after any noise a request with silence around it, each time."""
    line, reader, device = Line(20261128), BurstReader(), Executed()
    port = RtuSlavePort({UNIT: device})
    traffic: list[tuple[int, bytes]] = []
    size, full, probes = 0, scaled(1_000_000), 0
    while size < full:
        new = line.deliveries()
        if line.chance.randrange(8) == 0:
            body = bytes((UNIT,)) + PROBE
            new += [(line.chance.choice([GAP, 30 * MILLISECOND, SECOND]), body + checksum(body)), (GAP, b"\xff"), (GAP, b"\xff")]
            probes += 1
        traffic += new
        size += sum(len(data) for _, data in new)
    traffic.append((10 * SECOND, b"\xff"))

    now = 0
    for pause, data in traffic:
        while (due := port.deadline()) is not None and due <= now + pause:
            port.to_send(due)
        now += pause
        port.exchange(data, now)

    bursts: list[tuple[int, bytes, list[int]]] = []
    for pause, data in traffic:
        if pause >= GAP or not bursts:
            bursts.append((pause, data, [0] * len(data)))
        else:
            before, held, pauses = bursts[-1]
            bursts[-1] = (before, held + data, [*pauses, pause, *[0] * (len(data) - 1)])
    for (before, held, pauses), (after, *_) in zip(bursts, [*bursts[1:], (10 * SECOND,)], strict=True):
        reader.burst(held, pauses, before, after)

    expected = [frame[1:-2] for frame in reader.frames if frame[0] == UNIT or (frame[0] == 0 and frame[1] in (5, 6, 15, 16))]
    expected = [pdu for pdu in expected if 0 < pdu[0] < 0x80]
    assert device.pdus == expected
    assert device.pdus.count(PROBE) == probes
    print(f"{size} bytes, {len(bursts)} bursts, {len(expected)} requests executed, {probes} of {probes} probes answered")
