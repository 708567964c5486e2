"""Machines in real time, here in virtual real time: they act when something is due and lag when the process is held up."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.live.realtimedriver import LONGEST_DELAY_NS, LONGEST_WAIT_S, RealTimeDriver
from steptwin.m1486.check import check
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.eeprom import image_of
from steptwin.m1486.variants import variant
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.status import AxisStatus
from steptwin.simulation.scheduler.scheduler import Scheduler

Make = Callable[[], tuple[RealTimeDriver, Mic488Device]]
Run = Callable[..., Any]

MOVE_NS = 2 * SECOND
"""1000 imp with ACC = DEC = VMAX = 1000: a second up, a second down."""


def start_move(realtime: RealTimeDriver, device: Mic488Device) -> None:
    def start(now: Nanos) -> None:
        device.axes[0].enable(now)
        device.axes[0].move_to(1000, now)

    device.command(start, realtime.enter())
    realtime.leave()


def test_a_move_ends_by_itself_though_nobody_looks(run: Run, make_realtime: Make) -> None:
    async def scene() -> tuple[AxisStatus, Nanos]:
        realtime, device = make_realtime()
        start_move(realtime, device)
        await asyncio.sleep(2.5)
        realtime.close()
        return device.axes[0].status, device.now

    status, last_advanced = run(scene())
    assert status is AxisStatus.REACHED
    assert MOVE_NS <= last_advanced < MOVE_NS + MILLISECOND


def test_what_a_machine_does_by_itself_is_done_though_nothing_is_ever_sent(run: Run) -> None:
    """A stored file runs from power-up; so do faults with a time, programs of a MIC488, anything that begins without input."""

    async def scene() -> list[tuple[str, Nanos]]:
        loop: Any = asyncio.get_running_loop()
        image = image_of(check("[\nw300\nu20\nw300\nu16\n]").program, variant("B"))
        chip, scheduler = M1486Chip(variant("B"), image=image), Scheduler()
        done: list[tuple[str, Nanos]] = []
        chip.on_event = lambda event: done.append((event.text, loop.now_ns // MILLISECOND))
        scheduler.add("F", chip)
        realtime = RealTimeDriver(scheduler, loop.clock())
        realtime.start()
        await asyncio.sleep(2.0)
        realtime.close()
        return done

    assert run(scene()) == [("waits 300 ms", 0), ("U20 sends 42H", 300), ("waits 300 ms", 301), ("U16 sends 01H", 601)]


def test_a_stopped_clock_sets_no_timer(run: Run, make_realtime: Make) -> None:
    """Time that stands for longer than the longest timer is no delay."""

    async def scene() -> tuple[list[Nanos], Nanos]:
        realtime, device = make_realtime()
        lags: list[Nanos] = []
        realtime.on_lag = lags.append
        realtime.clock.stop(0)
        start_move(realtime, device)
        await asyncio.sleep(2 * LONGEST_WAIT_S)
        realtime.clock.run(1.0)
        realtime.start()
        await asyncio.sleep(1.0)
        now = realtime.enter()
        realtime.close()
        return lags, now

    assert run(scene()) == ([], SECOND)


def test_at_rest_nothing_wakes_up(run: Run, make_realtime: Make) -> None:
    async def scene() -> Nanos:
        realtime, device = make_realtime()
        realtime.enter()
        realtime.leave()
        await asyncio.sleep(100.0)
        return device.now

    assert run(scene()) == 0


def test_an_earlier_deadline_wakes_earlier(run: Run, make_realtime: Make) -> None:
    async def scene() -> tuple[AxisStatus, list[bool]]:
        realtime, device = make_realtime()
        start_move(realtime, device)
        await asyncio.sleep(0.1)
        device.set_pin("IN1", 1.0, realtime.enter())
        realtime.leave()
        await asyncio.sleep(0.011)  # the filter takes 10 ms
        seen = device.inputs.filtered[:1]
        await asyncio.sleep(2.0)
        realtime.close()
        return device.axes[0].status, list(seen)

    assert run(scene()) == (AxisStatus.REACHED, [True])


def held_up(
    run: Run, make_realtime: Make, seconds: float, then: Callable[[RealTimeDriver], object]
) -> tuple[list[Nanos], Nanos, AxisStatus]:
    """A process is held up for ``seconds`` one second into a move; ``then`` is what happens first when it goes on."""

    async def scene() -> tuple[list[Nanos], Nanos, AxisStatus]:
        realtime, device = make_realtime()
        lags: list[Nanos] = []
        realtime.on_lag = lags.append
        start_move(realtime, device)
        await asyncio.sleep(1.0)
        asyncio.get_running_loop().hold_up(seconds)  # type: ignore[attr-defined]
        then(realtime)
        await asyncio.sleep(0)
        now, status = realtime.enter(), device.axes[0].status
        realtime.close()
        return lags, now, status

    return run(scene())


def test_held_up_time_does_not_pass_for_the_controllers(run: Run, make_realtime: Make) -> None:
    lags, now, status = held_up(run, make_realtime, 3600.0, RealTimeDriver.enter)
    assert lags == [3599 * SECOND]
    assert (now, status) == (MOVE_NS, AxisStatus.REACHED)


def test_the_timer_notices_as_well_as_a_client(run: Run, make_realtime: Make) -> None:
    lags, now, status = held_up(run, make_realtime, 3600.0, lambda realtime: None)
    assert lags == [3599 * SECOND]
    assert (now, status) == (MOVE_NS, AxisStatus.REACHED)


def test_a_short_delay_is_caught_up_with(run: Run, make_realtime: Make) -> None:
    seconds = 1.0 + LONGEST_DELAY_NS / SECOND
    lags, now, status = held_up(run, make_realtime, seconds, RealTimeDriver.enter)
    assert lags == []
    assert (now, status) == (2 * SECOND + LONGEST_DELAY_NS, AxisStatus.REACHED)


def test_what_is_short_on_the_wall_is_long_where_time_runs_fast(run: Run, make_realtime: Make) -> None:
    async def scene() -> tuple[list[Nanos], Nanos]:
        realtime, device = make_realtime()
        realtime.clock.run(20.0)
        lags: list[Nanos] = []
        realtime.on_lag = lags.append
        start_move(realtime, device)
        asyncio.get_running_loop().hold_up(0.4)  # type: ignore[attr-defined]
        now = realtime.enter()
        realtime.close()
        return lags, now

    assert run(scene()) == ([], 8 * SECOND)


def test_time_in_which_nothing_was_due_has_passed(run: Run, make_realtime: Make) -> None:
    async def scene() -> tuple[list[Nanos], Nanos]:
        realtime, _ = make_realtime()
        lags: list[Nanos] = []
        realtime.on_lag = lags.append
        realtime.enter()
        realtime.leave()
        asyncio.get_running_loop().hold_up(3600.0)  # type: ignore[attr-defined]
        return lags, realtime.enter()

    assert run(scene()) == ([], 3600 * SECOND)


def test_time_never_goes_back_when_a_delay_follows_a_look_after_the_deadline(run: Run, make_realtime: Make) -> None:
    """The timer is late, a client has been served meanwhile, and then the process is held up."""

    async def scene() -> tuple[Nanos, Nanos]:
        realtime, device = make_realtime()
        start_move(realtime, device)
        loop: Any = asyncio.get_running_loop()
        loop.hold_up(2.3)
        seen = realtime.enter()
        loop.hold_up(10.0)
        return seen, realtime.enter()

    seen, after = run(scene())
    assert (seen, after) == (2_300_000_000, 2_300_000_000)


def test_a_closed_cell_wakes_no_more(run: Run, make_realtime: Make) -> None:
    async def scene() -> Nanos:
        realtime, device = make_realtime()
        start_move(realtime, device)
        realtime.close()
        await asyncio.sleep(10.0)
        return device.now

    assert run(scene()) == 0
