"""Lines shared by threads: nobody gets the answer of another, a stop goes first, a lost port is opened again."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from itertools import pairwise

import pytest
from host_rig import INTERVAL, TIMEOUT, Wire, driver, fill, run_virtual, task_line, thread_line
from line_rig import MemoryChannel, MemoryEndpoint, in_threads

from steptwin.drivers import LineLost, NoAnswer, Overtaken, Unconfirmed
from steptwin.drivers.blocking import finish
from steptwin.drivers.exchange import Job
from steptwin.drivers.modbus import ModbusQuery, words
from steptwin.drivers.permission import Permission
from steptwin.errors import Misuse
from steptwin.wire.pdu import ReadRequest, WriteCoilRequest

M1_STOP = WriteCoilRequest(2004, True)


def test_threads_share_a_line_and_each_gets_its_own_answers() -> None:
    wire = Wire()
    fill(wire)
    mic = driver(wire)
    counts = [0] * 4

    def read(start: int) -> None:
        for number in range(start, 400, 4):
            assert mic.registers(number, 2) == (number, number + 1)
            counts[start] += 1

    assert in_threads(*(lambda start=start: read(start) for start in range(4))) == []
    assert counts == [100] * 4


def test_frames_are_paced_however_many_threads_ask() -> None:
    wire = Wire()
    mic = driver(wire)
    assert in_threads(*(lambda: [mic.positions() for _ in range(20)] for _ in range(4))) == []
    moments = [moment for moment, _ in wire.sent]
    assert len(moments) > 80
    assert min(b - a for a, b in pairwise(moments)) >= INTERVAL


def test_a_stop_from_another_thread_goes_before_whatever_waits() -> None:
    """While a thread waits for its answer, others come to wait in a known order; the stop comes last and goes first."""
    wire = Wire()
    mic = driver(wire)
    mic.enable()
    engine = mic._driver.line._engine  # type: ignore[attr-defined]
    heard, go_on = threading.Event(), threading.Event()

    def hold() -> None:
        if not engine.in_flight:  # the pause after the frame before
            return
        wire.before_read = None
        heard.set()
        assert go_on.wait(60)

    def come(task: Callable[[], object], ready: Callable[[], object]) -> threading.Thread:
        thread = threading.Thread(target=task)
        thread.start()
        deadline = time.monotonic() + 60.0
        while not ready():
            assert time.monotonic() < deadline, "it does not come to wait"
            time.sleep(0.001)
        return thread

    wire.before_read = hold
    wire.sent.clear()
    threads = [come(lambda: mic.registers(7, 1), heard.is_set)]
    for number in range(1, 6):
        threads.append(come(lambda number=number: mic.registers(number, 1), lambda n=number: len(engine._waiting) == n))  # noqa: PERF401
    threads.append(come(mic.axis(1).stop, lambda: engine._urgent))
    go_on.set()
    for thread in threads:
        thread.join(60)
    assert [frame[1:4].hex() for _, frame in wire.sent] == ["030007", "0507d4", *(f"03000{n}" for n in range(1, 6))]


def test_a_waiting_motion_is_not_begun_after_a_stop() -> None:
    """Submitted by hand, so that the order is certain: a read, a motion guarded as drivers guard it, a stop."""
    wire = Wire()
    mic = driver(wire)
    mic.enable()
    line = thread_line(wire)
    finish(line.open())
    stopped = [False]
    engine = line._engine
    permission = Permission(wire.clock, TIMEOUT, lambda: stopped[0])
    move = ModbusQuery(1, WriteCoilRequest(2008, True))
    motion: Job[ModbusQuery, bytes] = Job(move, TIMEOUT, most_attempts=3, permission=permission)
    engine.submit(motion)
    stopped[0] = True
    finish(line.exchange(Job(ModbusQuery(1, M1_STOP), TIMEOUT, urgent=True)))
    finish(line.exchange(Job(ModbusQuery(1, ReadRequest(3, 0, 1)), TIMEOUT)))
    with pytest.raises(Overtaken):
        motion.result()
    assert [frame[:4].hex() for _, frame in wire.sent[-2:]] == ["010507d4", "01030000"]
    assert not wire.moving()


def test_a_line_that_cannot_be_opened_says_so_when_it_is_opened() -> None:
    wire = Wire()
    wire.gone = "no such port"
    with pytest.raises(LineLost, match="cannot open memory: no such port"):
        finish(thread_line(wire).open())
    with pytest.raises(LineLost, match="cannot open memory: no such port"):
        run_virtual(wire, task_line(wire).open())


def test_a_line_that_nobody_has_opened_is_opened_by_the_first_exchange() -> None:
    wire = Wire()
    assert words(finish(thread_line(wire).exchange(Job(ModbusQuery(1, ReadRequest(3, 0, 1)), TIMEOUT)))) == (0,)
    assert words(run_virtual(wire, task_line(wire).exchange(Job(ModbusQuery(1, ReadRequest(3, 0, 1)), TIMEOUT)))) == (0,)
    assert wire.opened == 2


class Held(MemoryEndpoint):
    """A port that one program has at a time."""

    def __init__(self, wire: Wire) -> None:
        super().__init__(wire)
        self.free = 1

    def open(self) -> MemoryChannel:
        self.free -= 1
        assert self.free == 0, "it is open already"
        channel = super().open()

        def close() -> None:
            self.free += 1

        channel.close = close  # type: ignore[method-assign]
        return channel


def test_a_port_is_given_back_when_its_line_is_closed_or_lost() -> None:
    wire = Wire()
    line = thread_line(wire)
    line._endpoint = endpoint = Held(wire)
    for _ in range(2):
        finish(line.open())
        finish(line.open())
        finish(line.close())
        assert endpoint.free == 1
    finish(line.open())
    wire.gone = "unplugged"
    with pytest.raises(LineLost):
        finish(line.exchange(Job(ModbusQuery(1, ReadRequest(3, 0, 1)), TIMEOUT)))
    wire.gone = None
    endpoint.free = 1
    finish(line.exchange(Job(ModbusQuery(1, ReadRequest(3, 0, 1)), TIMEOUT)))
    assert endpoint.free == 0


def test_a_line_that_is_closed_during_an_exchange_ends_it() -> None:
    """From another thread, while this one waits for its answer."""
    wire = Wire()
    line = thread_line(wire)
    finish(line.open())
    wire.severed = True
    waited = []
    waiting: Job[ModbusQuery, bytes] = Job(ModbusQuery(1, ReadRequest(3, 1, 1)), TIMEOUT)  # of a third thread

    def close() -> None:
        waited.append(line._engine.in_flight)
        line._engine.submit(waiting)
        wire.before_read = None
        finish(line.close())

    wire.before_read = close
    with pytest.raises(LineLost, match="the line memory was closed"):
        finish(line.exchange(Job(ModbusQuery(1, ReadRequest(3, 0, 1)), TIMEOUT)))
    assert waited == [True]
    assert not line._engine.busy
    assert waiting.done
    with pytest.raises(LineLost, match="the line memory was closed"):
        waiting.result()


def test_a_thread_that_waits_for_a_lock_says_so_again_and_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("steptwin.drivers.threads.LOCK_SLICE_S", 0.001)
    line = thread_line(Wire())
    said = threading.Semaphore(0)
    entered = threading.Event()

    async def enter() -> None:
        async with line.lock("turn", said.release):
            entered.set()

    async def hold() -> None:
        async with line.lock("turn"):
            thread.start()
            for _ in range(3):
                assert said.acquire(timeout=60)
            assert not entered.is_set()

    thread = threading.Thread(target=lambda: finish(enter()))
    finish(hold())
    thread.join(60)
    assert entered.is_set()
    finish(enter())  # it was given back


def test_what_is_refused_is_refused_at_once_whoever_else_waits() -> None:
    """A job of another thread has the pause of its device before it; this thread has nothing to wait for."""
    wire = Wire()
    line = thread_line(wire)
    finish(line.open())
    finish(line.exchange(Job(ModbusQuery(1, ReadRequest(3, 0, 1)), TIMEOUT)))
    line._engine.submit(Job(ModbusQuery(1, ReadRequest(3, 1, 1)), TIMEOUT))
    asked = wire.now
    with pytest.raises(Overtaken):
        finish(line.exchange(Job(ModbusQuery(1, M1_STOP), TIMEOUT, permission=Permission(wire.clock, TIMEOUT, lambda: True))))
    assert wire.now == asked


def test_an_interrupted_call_leaves_the_line_usable() -> None:
    wire = Wire()
    fill(wire)
    mic = driver(wire)

    def interrupt(data: bytes) -> None:
        wire.before_each = None
        raise KeyboardInterrupt

    wire.before_each = interrupt
    with pytest.raises(KeyboardInterrupt):
        mic.registers(5, 1)
    assert mic.registers(8, 1) == (8,)


def test_a_closed_line_is_not_used() -> None:
    wire = Wire()
    mic = driver(wire)
    finish(mic._driver.line.close())
    with pytest.raises(Misuse, match="the line memory is closed"):
        mic.positions()
    finish(mic._driver.line.open())
    assert mic.positions() == (0.0, 0.0, 0.0, 0.0)


def test_a_lost_port_is_opened_again_by_the_next_call() -> None:
    wire = Wire()
    mic = driver(wire)
    assert wire.opened == 1
    wire.gone = "serial port memory is gone: unplugged"
    with pytest.raises(LineLost, match="cannot open memory"):
        mic.positions()
    wire.gone = None
    assert mic.positions() == (0.0, 0.0, 0.0, 0.0)
    assert wire.opened == 2


def test_a_port_that_goes_during_a_read_is_opened_again_at_once() -> None:
    wire = Wire()
    mic = driver(wire)

    def unplug(data: bytes) -> None:
        wire.before_each = None
        raise LineLost("unplugged")

    wire.before_each = unplug
    assert mic.positions() == (0.0, 0.0, 0.0, 0.0)
    assert wire.opened == 2


def test_a_motion_that_may_not_be_repeated_is_in_doubt_when_the_port_goes() -> None:
    wire = Wire()
    mic = driver(wire)
    mic.enable()

    def unplug(data: bytes) -> None:
        if data[1] == 16:
            wire.before_each = None
            raise LineLost("unplugged")

    wire.before_each = unplug
    with pytest.raises(LineLost, match="it is unknown whether 'unit 1: write M1_POS_REL = 3 mm' was executed") as caught:
        mic.axis(1).move_by(3.0)
    assert caught.value.uncertain


def test_nobody_there_says_so() -> None:
    wire = Wire()
    mic = driver(wire)
    wire.severed = True
    with pytest.raises(NoAnswer) as caught:
        mic.positions()
    assert str(caught.value) == (
        "memory: no answer to 'unit 1: read M1_POS_ACT … M4_POS_ACT' within 0.3 s, tried 3 times; nothing was received"
    )


def test_what_cannot_be_told_to_stop_is_said() -> None:
    wire = Wire()
    mic = driver(wire)
    mic.enable()
    mic.axis(1).move_velocity(5.0)
    wire.severed = True
    for stop in (mic.axis(1).stop, mic.stop_all, mic.axis(1).disable, mic.program.stop):
        with pytest.raises(Unconfirmed, match=r"could not be (stopped|switched off): the controller cannot be reached"):
            stop()
    wire.severed = False
    mic.stop_all()
    assert not wire.moving()


def test_a_line_counts_what_it_has_sent_and_what_failed() -> None:
    wire = Wire()
    line = thread_line(wire)
    finish(line.open())
    query = ModbusQuery(1, ReadRequest(3, 10020, 2))
    assert words(finish(line.exchange(Job(query, TIMEOUT)))) == (0, 0)
    wire.severed = True
    with pytest.raises(NoAnswer):
        finish(line.exchange(Job(query, TIMEOUT, most_attempts=2)))
    assert line.counts == (3, 2)


def test_a_port_that_goes_while_late_bytes_are_discarded_is_opened_again() -> None:
    """After a lost answer the line is emptied before the next request."""
    wire = Wire()
    mic = driver(wire)
    wire.severed = True
    with pytest.raises(NoAnswer):
        mic.positions()
    wire.severed = False

    def unplug() -> None:
        wire.before_read = None
        raise LineLost("unplugged")

    wire.before_read = unplug
    assert mic.positions() == (0.0, 0.0, 0.0, 0.0)
    assert wire.opened == 2
