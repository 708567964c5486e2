"""A feed gives answers when the port has them ready: at once, or when the wire would."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest

from steptwin.controller import MILLISECOND, Nanos
from steptwin.live.links import Feed
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.mic488.device import Mic488Device
from steptwin.wire.line import SerialLine
from steptwin.wire.slave import RtuSlavePort
from steptwin.wire.timed import LineTiming, TimedRtuSlavePort, TimedUnits

Run = Callable[..., Any]
Make = Callable[[], tuple[RealTimeDriver, Mic488Device]]

REQUEST = bytes.fromhex("010213880008FD62")
ANSWER = bytes.fromhex("01020100A188")
CHARACTER_NS = 10 * 1_000_000_000 / 38400
TURNAROUND_NS = 750_000
FIRST_ANSWER_NS = 8 * CHARACTER_NS + TURNAROUND_NS + 6 * CHARACTER_NS


class Wire:
    """Takes down what is written and when."""

    def __init__(self, realtime: RealTimeDriver) -> None:
        self.realtime = realtime
        self.written: list[tuple[Nanos, bytes]] = []

    def write(self, data: bytes) -> None:
        self.written.append((self.realtime.clock.now(), data))


def feed(make_realtime: Make, *, timed: bool) -> tuple[Feed, Wire]:
    realtime, device = make_realtime()
    wire = Wire(realtime)
    port = TimedRtuSlavePort(TimedUnits({1: device}, LineTiming(SerialLine(38400)))) if timed else RtuSlavePort({1: device})
    return Feed(realtime, port, wire), wire


def test_without_line_timing_the_answer_is_there_at_once(run: Run, make_realtime: Make) -> None:
    async def scene() -> list[tuple[Nanos, bytes]]:
        link, wire = feed(make_realtime, timed=False)
        link.take(REQUEST[:3])
        link.take(REQUEST[3:])
        link.close()
        return wire.written

    assert run(scene()) == [(0, ANSWER)]


def test_real_line_timing_takes_the_time_of_the_characters(run: Run, make_realtime: Make) -> None:
    async def scene() -> list[tuple[Nanos, bytes]]:
        link, wire = feed(make_realtime, timed=True)
        link.take(REQUEST)
        await asyncio.sleep(1.0)
        link.close()
        return wire.written

    ((when, what),) = run(scene())
    assert what == ANSWER
    assert when == pytest.approx(FIRST_ANSWER_NS, abs=1000)


def test_mic_32_real_line_timing_gives_a_hundred_answers_a_second(run: Run, make_realtime: Make) -> None:
    async def scene() -> list[Nanos]:
        link, wire = feed(make_realtime, timed=True)
        for answers in range(1, 41):
            link.take(REQUEST)
            while len(wire.written) < answers:  # noqa: ASYNC110 - as a master that polls its port
                await asyncio.sleep(0.0005)
        link.close()
        return [when for when, _ in wire.written]

    times = run(scene())
    gaps = [two - one for one, two in pairwise(times)]
    assert gaps == [pytest.approx(10 * MILLISECOND, abs=2000)] * 39


def test_mic_32_what_arrives_while_a_request_is_served_is_lost(run: Run, make_realtime: Make) -> None:
    async def scene() -> int:
        link, wire = feed(make_realtime, timed=True)
        link.take(REQUEST * 40)
        await asyncio.sleep(10.0)
        link.close()
        return len(wire.written)

    # They arrive one each 2.1 ms; one is served until its response has left, which a controller does once in 10 ms.
    assert run(scene()) == 9


def test_a_frame_is_given_up_for_a_request_after_the_gap_without_a_further_byte(run: Run, make_realtime: Make) -> None:
    """The request might be data of what looks like a longer one; only time tells."""

    async def scene() -> list[tuple[Nanos, bytes]]:
        link, wire = feed(make_realtime, timed=False)
        link.take(bytes.fromhex("0110 0000 0010 20".replace(" ", "")) + REQUEST)
        await asyncio.sleep(0.1)
        link.take(REQUEST)
        await asyncio.sleep(1.0)
        link.close()
        return wire.written

    assert run(scene()) == [(120 * MILLISECOND, ANSWER)]


def test_a_closed_feed_answers_no_more(run: Run, make_realtime: Make) -> None:
    async def scene() -> list[tuple[Nanos, bytes]]:
        link, wire = feed(make_realtime, timed=True)
        link.take(REQUEST)
        link.close()
        await asyncio.sleep(1.0)
        return wire.written

    assert run(scene()) == []
