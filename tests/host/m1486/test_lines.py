"""Two chips on one line, shared by threads and tasks: each gets its own answers, both move at once, a stop goes first."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable

import pytest
from chip_rig import ChipWire, chip_line, chip_task_line, run_in

from steptwin.errors import Misuse, SteptwinError
from steptwin.host import Overtaken
from steptwin.host.m1486 import M1486, AsyncM1486, ChipReason
from steptwin.machine import MILLISECOND, SECOND

KNOWN = {"start_stop": 200, "acceleration": 5000, "velocity": 1000, "profile": 25000, "microstep": 1, "qualification": 1}


def in_threads(*tasks: Callable[[], object]) -> list[Exception]:
    """Run them at once; what they raised."""
    raised: list[Exception] = []

    def guarded(task: Callable[[], object]) -> None:
        try:
            task()
        except (AssertionError, SteptwinError) as error:
            raised.append(error)

    threads = [threading.Thread(target=guarded, args=(task,)) for task in tasks]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
        assert not thread.is_alive()
    return raised


def test_threads_share_a_line_with_two_chips() -> None:
    wire = ChipWire("B", (0, 7))
    line = chip_line(wire)
    chips = {address: M1486(line, address, variant="B") for address in (0, 7)}
    for address, chip in chips.items():
        chip.open()
        wire.chips[address].unit.variable = 1000 + address

    def use(address: int) -> None:
        chip = chips[address]
        for number in range(1, 4):
            assert chip.variable() == 1000 + address
            chip.move_by(10.0 + address)
            assert chip.wait().ok
            assert chip.counter() == 64 * number * (10 + address)

    assert in_threads(lambda: use(0), lambda: use(7)) == []
    assert (wire.true(0), wire.true(7)) == (64 * 30, 64 * 51)


def test_tasks_move_two_chips_at_the_same_time() -> None:
    """Known settings: each wait leaves the line to the other until its motion is to be over."""
    wire = ChipWire("B", (0, 7))
    line = chip_task_line(wire)
    both = [False]

    async def use(address: int) -> None:
        chip = AsyncM1486(line, address, variant="B", steps_per_unit=200.0, unit="turn")
        await chip.open()
        await chip.configure(**KNOWN)
        await chip.move_by(10.0)
        both[0] |= wire.moving(0) and wire.moving(7)
        end = await chip.wait()
        assert (end.reason, end.position, end.unit) == (ChipReason.TARGET, 10.0, "turn")

    async def main() -> None:
        await line.open()
        await asyncio.gather(use(0), use(7))
        await line.close()

    begin = wire.now
    run_in(wire, main())
    assert both[0]
    assert wire.now - begin < 2 * 2.2 * SECOND
    assert (wire.true(0), wire.true(7)) == (128_000, 128_000)


def test_a_stop_goes_before_a_wait_that_keeps_the_line() -> None:
    """While one task waits for chip 0, without knowing how long, another stops chip 7 and then chip 0: 100 ms for both."""
    wire = ChipWire("B", (0, 7))
    line = chip_task_line(wire)

    async def main() -> None:
        await line.open()
        chip, other = AsyncM1486(line, 0), AsyncM1486(line, 7)
        await chip.open()
        await other.open()
        await other.run(1)
        await chip.run(1)
        waiting = asyncio.create_task(chip.wait(60.0, check=False))
        await asyncio.sleep(1.0)
        begin = line.now()
        await other.stop()
        await chip.stop()
        assert line.now() - begin < 100 * MILLISECOND
        end = await waiting
        assert end.reason is ChipReason.STOPPED
        assert end.position == wire.true(0) / 64
        assert not wire.moving(7)
        assert await other.position() == wire.true(7) / 64
        await line.close()

    run_in(wire, main())


def test_a_move_that_waits_for_the_line_is_not_begun_after_a_stop() -> None:
    wire = ChipWire("B", (0, 7))
    line = chip_task_line(wire)

    async def main() -> None:
        await line.open()
        chip = AsyncM1486(line, 7)
        await chip.open()
        moving = asyncio.create_task(chip.move_by(100.0))
        await asyncio.sleep(0.05)  # it reads the counter
        await chip.stop()
        with pytest.raises(Overtaken, match="'chip 7: r' was not sent: a stop was given meanwhile"):
            await moving
        await line.close()

    run_in(wire, main())
    assert wire.true(7) == 0


def test_a_chip_without_address_is_alone() -> None:
    line = chip_line(ChipWire("B", (0, 7)))
    M1486(line, 7)
    with pytest.raises(Misuse, match="a chip without address has to be the only one on its line"):
        M1486(line)
