"""Two chips on one line, shared by threads and tasks: each gets its own answers, both move at once, a stop goes first."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from typing import Any

import pytest
from chip_rig import BAUD, ChipWire, Fault, chip_line, chip_task_line
from line_rig import MemoryEndpoint, at_every_address, in_threads, run_virtual

from steptwin.controller import MILLISECOND, SECOND
from steptwin.drivers import Overtaken
from steptwin.drivers.blocking import finish
from steptwin.drivers.m1486 import (
    M1486,
    AsyncM1486,
    ChipReason,
    M1486Line,
    NoEcho,
    PositionUnknown,
    Restarted,
    watching,
)
from steptwin.drivers.m1486.identify import SearchLine, end_line, searching, select_all
from steptwin.drivers.m1486.lines import AsyncM1486Line, ThreadM1486Line, described
from steptwin.drivers.m1486.unit import SLICE_NS
from steptwin.drivers.threads import ThreadLine
from steptwin.errors import Misuse

KNOWN = {"start_stop": 200, "acceleration": 5000, "velocity": 1000, "profile": 25000, "microstep": 1, "qualification": 1}


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


def test_a_line_is_open_as_long_as_its_block() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        with M1486Line(address) as line:
            assert line.place == address
            device, _ = server.accept()
            device.settimeout(60)
        with device:
            assert device.recv(1) == b"", "the connection was closed"


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
    run_virtual(wire, main())
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

    run_virtual(wire, main())


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
        with pytest.raises(Overtaken, match="'chip 7: r' was not sent: a stop was requested meanwhile"):
            await moving
        await line.close()

    run_virtual(wire, main())
    assert wire.true(7) == 0


def test_a_chip_without_address_is_alone() -> None:
    line = chip_line(ChipWire("B", (0, 7)))
    M1486(line, 7)
    with pytest.raises(Misuse, match="a chip without address has to be the only one on its line"):
        M1486(line)


# ---------------------------------------------------------------------- why each move ended


def moving(wire: ChipWire, *steps: float) -> list[M1486]:
    """Drivers of the chips, each told to move so far."""
    line = chip_line(wire)
    chips = [M1486(line, address) for address in wire.chips]
    for chip in chips:
        chip.open()
        chip.configure(**KNOWN)
    for chip, distance in zip(chips, steps, strict=True):
        chip.move_by(distance)
    return chips


def limit(wire: ChipWire, address: int) -> Callable[[], None]:
    return lambda: wire.chips[address].set_pin("LIMIT", 0, wire.now)


@pytest.mark.parametrize("kind", ["A", "B"])
@pytest.mark.parametrize("stopped", [0, 7])
@pytest.mark.parametrize("after", [0.05, 0.5, 1.2, 1.7])
def test_each_of_two_moves_says_why_it_ended(kind: str, stopped: int, after: float) -> None:
    """The same move of both, so that their ends are as close as can be; LIMIT stops one of them."""
    wire = ChipWire(kind, (0, 7))
    chips = moving(wire, 2000.0, -2000.0)
    wire.at(after, limit(wire, stopped))
    ends = {chip.address: chip.wait(check=False) for chip in chips}
    assert ends[stopped].reason is ChipReason.EARLY, ends
    assert ends[7 - stopped].reason is ChipReason.TARGET, ends
    assert abs(wire.true(7 - stopped)) == 128_000
    assert chips[0].counter() == 128_000  # M-16: what it was told


@pytest.mark.parametrize("after", [0.3, 1.5])
def test_moves_of_different_length_say_why_they_ended_whoever_is_waited_for_first(after: float) -> None:
    """The short one ends while the long one is waited for."""
    wire = ChipWire("B", (1, 2, 3))
    chips = moving(wire, 4000.0, 1900.0, 1500.0)
    wire.at(after, limit(wire, 2))
    ends = [chip.wait(check=False) for chip in chips]
    assert [end.reason for end in ends] == [ChipReason.TARGET, ChipReason.EARLY, ChipReason.TARGET]
    with pytest.raises(PositionUnknown):
        chips[1].position()
    assert (chips[0].position(), chips[2].position()) == (4000.0, 1500.0)


@pytest.mark.parametrize("kind", ["C", "E1"])
@pytest.mark.parametrize("stopped", [(1, 2, 3), (), (2,), (1, 3)])
def test_three_at_once(kind: str, stopped: tuple[int, ...]) -> None:
    """E types take half a second for whatever they are told or asked."""
    wire = ChipWire(kind, (1, 2, 3))
    chips = moving(wire, 30_000.0, 30_000.0, 30_000.0)
    for address in stopped:
        wire.at(1.0, limit(wire, address))
    ends = [chip.wait(check=False) for chip in chips]
    in_doubt = [end.address for end in ends if end.reason is ChipReason.CAME_TO_REST]
    assert not in_doubt or kind == "E1", "while one of them is read for 3 s, the end of another passes"
    for end in ends:
        expected = ChipReason.EARLY if end.address in stopped else ChipReason.TARGET
        assert end.reason is expected or end.address in in_doubt
    for address in stopped:
        wire.chips[address].set_pin("LIMIT", 1, wire.now)
    for chip in chips:
        chip.move_by(-10.0)
    assert all(chip.wait().ok for chip in chips)


def test_tasks_that_wait_for_their_chips_are_told_why_each_ended() -> None:
    """A third chip is used meanwhile: the line is kept from it only where a move is about to end."""
    wire = ChipWire("B", (0, 7, 9))
    line = chip_task_line(wire)
    ends = {}
    asked = [0]

    async def use(address: int) -> None:
        chip = AsyncM1486(line, address)
        await chip.open()
        await chip.configure(**KNOWN)
        await chip.move_by(4000.0)
        ends[address] = await chip.wait(check=False)

    async def ask() -> None:
        chip = AsyncM1486(line, 9)
        await chip.open()
        while len(ends) < 2:
            assert await chip.counter() == 0
            asked[0] += 1
            await asyncio.sleep(0.05)

    async def main() -> None:
        await line.open()
        wire.at(2.0, limit(wire, 7))
        await asyncio.gather(use(0), use(7), ask())
        await line.close()

    run_virtual(wire, main())
    assert (ends[0].reason, ends[7].reason) == (ChipReason.TARGET, ChipReason.EARLY)
    assert asked[0] > 5


@pytest.mark.parametrize("after", [n / 10 for n in range(0, 14, 2)])
def test_the_end_of_a_block_is_heard_while_the_end_of_a_move_is_watched(after: float) -> None:
    wire = ChipWire("B", (0, 7))
    line = chip_task_line(wire)
    x, y = (AsyncM1486(line, address, variant="B") for address in (0, 7))

    async def wait() -> ChipReason:
        return (await x.wait()).reason

    async def block() -> ChipReason:
        await asyncio.sleep(after)
        return (await y.run_block(["w100", "f640", "r"])).reason

    async def main() -> tuple[ChipReason, ChipReason]:
        await x.open()
        await y.open()
        await x.configure(**KNOWN)
        await x.move_by(1000.0)
        moved, done = await asyncio.gather(wait(), block())
        return moved, done

    moved, done = run_virtual(wire, main())
    assert done is ChipReason.DONE
    assert moved is ChipReason.TARGET or (moved is ChipReason.CAME_TO_REST and after == 0.8), "the block is typed just then"


def test_a_chip_that_is_late_or_stopped_does_not_hold_up_the_others() -> None:
    wire = ChipWire("B", (0, 7, 9))
    chips = moving(wire, 2000.0, 2500.0, 3000.0)
    wire.at(1.0, limit(wire, 0))
    wire.sleep(1.2)
    chips[1].stop()
    ends = [chip.wait(check=False) for chip in chips]
    assert [end.reason for end in ends] == [ChipReason.EARLY, ChipReason.STOPPED, ChipReason.TARGET]


def test_a_chip_held_by_limit_is_overdue_and_the_other_arrives() -> None:
    """Function 51 OFF: its program stands still until LIMIT is high again."""
    wire = ChipWire("B", (0, 7))
    line = chip_line(wire)
    chips = [M1486(line, 0), M1486(line, 7)]
    for chip in chips:
        chip.open()
        chip.configure(**KNOWN)
    chips[0].set_function(51, False)
    for chip in chips:
        chip.move_by(1000.0)
    wire.at(0.5, limit(wire, 0))
    assert chips[0].wait(check=False).reason is ChipReason.OVERDUE
    assert chips[1].wait(check=False).reason is ChipReason.TARGET
    wire.chips[0].set_pin("LIMIT", 1, wire.now)
    assert chips[0].counter() == 64_000


def test_a_chip_that_is_absent_or_off_makes_no_other_one_restarted() -> None:
    """Nobody echoes the selection of a chip while the one selected before is not there."""
    wire = ChipWire("B", (0, 7))
    line = chip_line(wire)
    x, y = M1486(line, 0), M1486(line, 7)
    x.open()
    y.open()
    y.configure(**KNOWN)
    y.move_by(20.0)
    y.wait()
    known = y.settings
    with pytest.raises(NoEcho, match="chip 5 does not echo"):
        M1486(line, 5).open()
    assert y.position() == 20.0
    x.flags()
    wire.chips[0].power_off(wire.now)
    assert y.position() == 20.0
    with pytest.raises(NoEcho, match="chip 0 does not echo"):
        x.flags()
    assert y.position() == 20.0
    assert y.settings == known
    wire.chips[0].power_cycle(wire.now)
    with pytest.raises(Restarted, match="chip 0 was"):
        x.flags()
    wire.chips[7].power_cycle(wire.now)
    with pytest.raises(Restarted, match="chip 7 was"):
        y.position()
    assert x.flags() == y.flags()


def test_an_answer_that_is_lost_is_asked_for_again() -> None:
    wire = ChipWire("B", (0, 7))
    chips = moving(wire, 2000.0, 2000.0)
    wire.at(2.0, lambda: wire.put(Fault("to host", 0, "drop")))
    assert [chip.wait().reason for chip in chips] == [ChipReason.TARGET] * 2
    assert wire.faults[0].met
    assert [chip.counter() for chip in chips] == [128_000] * 2


def test_a_letter_too_many_is_not_that_of_the_next_move() -> None:
    """A letter comes doubled, when the first of two moves ends; the other one ends a little later."""
    wire = ChipWire("B", (0, 7))
    chips = moving(wire, 1000.0, 1100.0)
    motion = chips[0]._driver._unit.shared.motion
    assert motion is not None
    wire.sleep((motion.end - wire.now) / SECOND - 0.02)
    wire.put(Fault("to host", len("x0|u20|"), "double"))
    reasons = [chip.wait(check=False).reason for chip in chips]
    assert reasons == [ChipReason.CAME_TO_REST, ChipReason.TARGET], "the first one was asked too late to know"
    assert wire.faults[0].met


def test_a_watch_ends_at_its_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    """It looks every 20 ms: the second watch has its limit at a moment at which the first one looked."""
    looks: list[int] = []
    original = watching._Watch._waited_for

    def noted(self: watching._Watch) -> list[watching._Mover]:
        looks.append(self._own.line.now())
        return original(self)

    monkeypatch.setattr(watching._Watch, "_waited_for", noted)

    def watched(limit: int | None = None) -> int:
        wire = ChipWire("B", (0, 7))
        unit = moving(wire, 1000.0, 1000.0)[0]._driver._unit
        motion = unit.shared.motion
        assert motion is not None
        finish(watching.watch(unit, motion, motion.end if limit is None else limit))
        return wire.now

    watched()
    limit = next(one for one, later in pairwise(looks) if later - one == SLICE_NS)
    assert watched(limit) == limit


def test_a_chip_that_was_reset_meanwhile_is_watched_no_more() -> None:
    """A stop has found out so, while the watch asked another chip."""
    wire = ChipWire("B", (0, 7))
    chips = moving(wire, 1000.0, 1000.0)
    motion, other = chips[0]._driver._unit.shared.motion, chips[1]._driver._unit.shared
    assert motion is not None
    wire.sleep((motion.end - wire.now) / SECOND - 0.02)  # both are to be asked now
    asked: list[bytes] = []

    def forget(data: bytes) -> None:
        asked.append(data)
        if data == b"u20":
            other.forget()

    wire.before_each = forget
    assert chips[0].wait().ok
    assert b"x7" not in asked


def test_trouble_with_one_chip_is_told_to_who_waits_for_it() -> None:
    wire = ChipWire("B", (0, 7))
    chips = moving(wire, 2000.0, 2000.0)
    wire.at(1.0, lambda: wire.chips[7].power_cycle(wire.now))
    assert chips[0].wait().ok
    with pytest.raises(Restarted, match="chip 7 was switched off or reset meanwhile"):
        chips[1].wait()
    assert chips[0].counter() == 128_000


def test_waiting_for_the_line_is_no_suspension() -> None:
    """A block of one chip keeps the line for half a minute; the move of another waits for it, and begins."""
    wire = ChipWire("B", (0, 7))
    line = chip_task_line(wire)
    one, two = AsyncM1486(line, 0), AsyncM1486(line, 7)

    async def main() -> None:
        await one.open()
        await two.open()
        await two.configure(microstep=1)
        block = asyncio.create_task(one.run_block(["f640", "r", "w30000"]))
        await asyncio.sleep(1.0)
        began = wire.now
        await two.move_by(10.0)
        assert wire.now - began > 25 * SECOND
        assert (await two.wait()).ok
        assert (await block).ok

    run_virtual(wire, main())
    assert (wire.true(0), wire.true(7)) == (640, 640)


@pytest.mark.parametrize("is_shared", [True, False])
def test_a_driver_for_tasks_closes_the_line_of_its_own_only(monkeypatch: pytest.MonkeyPatch, is_shared: bool) -> None:
    wire = ChipWire("B", (7,))
    at_every_address(monkeypatch, wire)

    async def main() -> bool:
        line = chip_task_line(wire) if is_shared else AsyncM1486Line("memory")
        async with AsyncM1486(line if is_shared else "memory", 7) as chip:
            transport = chip.line._transport  # type: ignore[attr-defined]
        closed = transport.is_closing()
        await line.close()
        return bool(closed)

    assert run_virtual(wire, main()) is not is_shared


@pytest.mark.parametrize("make", [AsyncM1486Line, ThreadM1486Line, partial(SearchLine, baud=4800)])
def test_a_line_has_the_place_of_its_address(make: Callable[[str], Any]) -> None:
    assert make("tcp://127.0.0.1:5022").place == "tcp://127.0.0.1:5022"
    with pytest.raises(Misuse, match=r"'tcp://127\.0\.0\.1' names no port: expected tcp://HOST:PORT, such as tcp://"):
        make("tcp://127.0.0.1")


def test_a_driver_for_tasks_is_open_inside_its_block() -> None:
    """A line that is shared stays open."""
    wire = ChipWire("B", (7,))
    line = chip_task_line(wire)

    async def main() -> None:
        async with AsyncM1486(line, 7) as chip:
            assert chip.variant.name == "B"
            assert await chip.counter() == 0
        assert await chip.counter() == 0

    run_virtual(wire, main())


def test_foreign_bytes_on_a_line_are_ended_without_selecting_a_chip() -> None:
    wire = ChipWire("B", (3, 7))
    wire.send(b"x7\rv12")
    wire.sleep(0.1)
    endpoint: Any = MemoryEndpoint(wire)
    line = ThreadLine(endpoint, searching(endpoint, BAUD), clock=wire.clock, sleeping=wire.sleep)
    finish(end_line(line))
    wire.sleep(0.1)
    assert (wire.chips[7].drive.velocity, wire.chips[7].receiver.waiting) == (1000, 0)  # V12 is out of range
    assert [chip.receiver.is_listening for chip in wire.chips.values()] == [False, True]
    finish(select_all(line))
    wire.sleep(0.1)
    assert [chip.receiver.is_listening for chip in wire.chips.values()] == [True, True]


@pytest.mark.parametrize(
    ("data", "text"),
    [(b"f12800\r", "f12800 CR"), (b"\x7f", "7FH"), (b"\x99r\r", "99H r CR"), (b"\x1f ~\x7f", "1FH  ~ 7FH"), (b"", "")],
)
def test_bytes_of_a_log_are_text(data: bytes, text: str) -> None:
    assert described(data) == text
