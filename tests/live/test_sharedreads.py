"""Reads are shared while nothing can have changed, and not a request longer."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from steptwin.controller import Nanos
from steptwin.live.batches import batches
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.sharedreads import share_reads
from steptwin.mic488.device import Mic488Device

Run = Callable[..., Any]
Make = Callable[[], tuple[RealTimeDriver, Mic488Device]]

READ_USER, WRITE_USER = bytes.fromhex("0300640001"), bytes.fromhex("100064000102002a")
READ_OUT, OUT_ON = bytes.fromhex("0117700001"), bytes.fromhex("051770ff00")
READ_POSITION = bytes.fromhex("0327240002")


class Counted:
    def __init__(self, device: Mic488Device) -> None:
        self.executed = 0
        self._device = device

    def execute(self, pdu: bytes, now: Nanos) -> bytes:
        self.executed += 1
        return self._device.execute(pdu, now)


def in_scene(run: Run, make_realtime: Make, play: Callable[[RealTimeDriver, Mic488Device, Counted, Any], Any]) -> Any:
    async def scene() -> Any:
        realtime, device = make_realtime()
        counted = Counted(device)
        (shared,) = share_reads({1: counted}, realtime).values()
        try:
            return play(realtime, device, counted, shared)
        finally:
            realtime.close()

    return run(scene())


def test_within_a_batch_a_read_is_executed_once(run: Run, make_realtime: Make) -> None:
    def play(realtime: RealTimeDriver, device: Mic488Device, counted: Counted, shared: Any) -> tuple[set[bytes], int, int]:
        batches().current = 1
        answers = {shared.execute(READ_USER, realtime.enter()) for _ in range(3)}
        once = counted.executed
        batches().current = 2
        shared.execute(READ_USER, realtime.enter())
        batches().current = 0
        return answers, once, counted.executed

    assert in_scene(run, make_realtime, play) == ({bytes.fromhex("03020000")}, 1, 2)


def test_without_a_batch_every_read_is_executed(run: Run, make_realtime: Make) -> None:
    def play(realtime: RealTimeDriver, device: Mic488Device, counted: Counted, shared: Any) -> int:
        for _ in range(3):
            shared.execute(READ_USER, realtime.enter())
        return counted.executed

    assert in_scene(run, make_realtime, play) == 3


def test_what_is_written_is_read(run: Run, make_realtime: Make) -> None:
    def play(realtime: RealTimeDriver, device: Mic488Device, counted: Counted, shared: Any) -> list[bytes]:
        batches().current = 1
        answers = [
            shared.execute(pdu, realtime.enter()) for pdu in (READ_USER, READ_OUT, WRITE_USER, READ_USER, OUT_ON, READ_OUT)
        ]
        batches().current = 0
        return answers

    user, out, _, written, _, on = in_scene(run, make_realtime, play)
    assert (user, written) == (bytes.fromhex("03020000"), bytes.fromhex("0302002a"))
    assert (out, on) == (bytes.fromhex("010100"), bytes.fromhex("010101"))


def test_what_signals_settle_to_is_read(run: Run, make_realtime: Make) -> None:
    """Something other than a request changes the controller within a batch, and the scheduler is told."""

    def play(realtime: RealTimeDriver, device: Mic488Device, counted: Counted, shared: Any) -> list[bytes]:
        batches().current = 1
        answers = [shared.execute(READ_OUT, realtime.enter())]
        device.command(lambda now: device.set_output(0, True, now), device.now)
        realtime.leave()
        answers.append(shared.execute(READ_OUT, realtime.enter()))
        batches().current = 0
        return answers

    assert in_scene(run, make_realtime, play) == [bytes.fromhex("010100"), bytes.fromhex("010101")]


def test_a_batch_happens_at_one_moment(run: Run, make_realtime: Make) -> None:
    async def scene() -> tuple[Nanos, Nanos, Nanos]:
        realtime, _ = make_realtime()
        loop: Any = asyncio.get_running_loop()
        batches().current = 1
        first = realtime.enter()
        loop.hold_up(0.001)
        second = realtime.enter()
        batches().current = 2
        third = realtime.enter()
        batches().current = 0
        realtime.close()
        return first, second, third

    first, second, third = run(scene())
    assert first == second
    assert third == first + 1_000_000
