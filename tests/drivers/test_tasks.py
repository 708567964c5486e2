"""Lines shared by tasks: nobody gets the answer of another, a stop goes first, a lost connection is made again."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable, Generator, Mapping

import pytest
from host_rig import INTERVAL, TIMEOUT, Fault, Wire, async_driver, driver, fill, run_virtual, task_line, thread_line
from line_rig import MemoryEndpoint, MemoryTransport

from steptwin.controller import MILLISECOND, SECOND
from steptwin.drivers import LineLost, Mic488, NoAnswer, Overtaken
from steptwin.drivers.blocking import finish
from steptwin.drivers.exchange import Job
from steptwin.drivers.modbus import ModbusQuery, words
from steptwin.errors import LineFailure, Misuse
from steptwin.tracing import traced_by
from steptwin.wire.pdu import ReadRequest


def test_tasks_share_a_line_and_each_gets_its_own_answers() -> None:
    wire = Wire()
    fill(wire)

    async def main() -> None:
        async with async_driver(task_line(wire), wire) as mic:

            async def read(start: int) -> None:
                for number in range(start, 400, 20):
                    assert await mic.registers(number, 2) == (number, number + 1)

            await asyncio.gather(*(read(start) for start in range(20)))

    run_virtual(wire, main())


def test_a_stop_waits_for_one_exchange_and_the_pace_at_most() -> None:
    """Twenty tasks keep the line full. From the call of stop to the frame on the line passes less than 10 ms and an exchange."""
    wire = Wire(latency=3 * MILLISECOND)
    line = task_line(wire)
    waits: list[int] = []

    async def main() -> None:
        async with async_driver(line, wire) as mic:
            await mic.enable()

            async def poll() -> None:
                while True:
                    await mic.status()

            async def move() -> None:
                while True:
                    await mic.axis(2).move_to(1.0)
                    await mic.axis(2).move_to(-1.0)

            others = [asyncio.create_task(poll()) for _ in range(16)] + [asyncio.create_task(move()) for _ in range(4)]
            for number in range(20):
                await mic.axis(1).move_velocity(5.0)
                await asyncio.sleep(0.0137 * (number % 7))
                asked = line.now()
                await mic.axis(1).stop()
                waits.append(
                    next(at for at, frame in wire.sent if at >= asked and frame[1:4] == bytes.fromhex("05 07 D4")) - asked
                )
                assert not wire.moving()
            for task in others:
                task.cancel()
            await asyncio.gather(*others, return_exceptions=True)

    run_virtual(wire, main())
    exchange = 2 * wire.latency + MILLISECOND
    assert len(waits) == 20
    assert max(waits) <= INTERVAL + exchange
    # Everybody else waited for twenty exchanges.
    assert max(waits) < 20 * INTERVAL / 10


def test_a_motion_called_before_a_stop_does_not_begin_after_it() -> None:
    wire = Wire()
    line = task_line(wire)

    async def main() -> None:
        async with async_driver(line, wire) as mic:
            await mic.enable()
            motion = asyncio.create_task(mic.axis(1).move_to(5.0))
            other = asyncio.create_task(mic.axis(2).move_to(5.0))
            await asyncio.sleep(0)  # both have asked for the control registers
            await mic.axis(1).stop()
            with pytest.raises(Overtaken, match="M1_POS_ABS = 5 mm' was not sent: a stop was requested meanwhile"):
                await motion
            await other

    run_virtual(wire, main())
    wire.rest()
    assert (wire.position(1), wire.position(2)) == (0, 500)


def test_a_cancelled_task_leaves_the_line_usable() -> None:
    wire = Wire()
    fill(wire)

    async def main() -> None:
        async with async_driver(task_line(wire, interval=0), wire) as mic:
            running, waiting = (asyncio.create_task(mic.registers(n, 1)) for n in (1, 2))
            await asyncio.sleep(0.0002)
            running.cancel()
            waiting.cancel()
            assert await mic.registers(3, 1) == (3,)
            assert [frame[2:4] for _, frame in wire.sent[-2:]] == [b"\0\1", b"\0\3"]

    run_virtual(wire, main())


def test_a_lost_connection_is_made_again_for_those_who_wait() -> None:
    wire = Wire(tcp=True)
    fill(wire)
    line = task_line(wire)

    async def main() -> None:
        async with async_driver(line, wire) as mic:
            reads = [asyncio.create_task(mic.registers(n, 1)) for n in range(5)]
            await asyncio.sleep(0.0002)
            endpoint = line._endpoint
            assert isinstance(endpoint, MemoryEndpoint)
            assert endpoint.transport is not None
            lost, begin = endpoint.transport, line.now()
            lost.lose(ConnectionResetError(104, "Connection reset by peer"))
            assert await asyncio.gather(*reads) == [(n,) for n in range(5)]
            assert line.now() - begin < 10 * INTERVAL, "at once, not when the time-out is over"
            lost._protocol.data_received(b"HTTP/1.0 400 Bad Request\r\n")  # what an old connection says is not heard
            assert await mic.registers(7, 1) == (7,)

    run_virtual(wire, main())
    assert wire.opened == 2


def test_a_connection_that_cannot_be_made_again_is_told_to_all_who_wait() -> None:
    wire = Wire(tcp=True)
    line = task_line(wire)

    async def main() -> None:
        async with async_driver(line, wire) as mic:
            reads = [asyncio.create_task(mic.registers(n, 1)) for n in range(3)]
            await asyncio.sleep(0.0002)
            wire.gone = "refused"
            endpoint = line._endpoint
            assert isinstance(endpoint, MemoryEndpoint)
            assert endpoint.transport is not None
            endpoint.transport.lose()
            errors = await asyncio.gather(*reads, return_exceptions=True)
            assert [str(error) for error in errors] == ["cannot open memory: refused"] * 3
            wire.gone = None
            assert await mic.registers(9, 1) == (0,)

    run_virtual(wire, main())


def test_what_is_no_modbus_ends_the_connection_and_a_new_one_serves() -> None:
    wire = Wire(tcp=True)
    line = task_line(wire)

    async def main() -> None:
        async with async_driver(line, wire) as mic:
            endpoint = line._endpoint
            assert isinstance(endpoint, MemoryEndpoint)
            useless = endpoint.transport
            assert useless is not None
            wire.inject(b"HTTP/1.0 400 Bad Request\r\n")
            assert await mic.registers(0, 1) == (0,)
            assert useless.is_closing()

    run_virtual(wire, main())
    assert wire.opened == 2


def test_closing_tells_those_who_wait() -> None:
    wire = Wire()
    line = task_line(wire)

    async def main() -> None:
        mic = async_driver(line, wire)
        await mic.open()
        read = asyncio.create_task(mic.registers(0, 1))
        await asyncio.sleep(0.0002)
        await line.close()
        with pytest.raises(LineLost, match="the line memory was closed"):
            await read
        with pytest.raises(Misuse, match="closed"):
            await mic.registers(0, 1)

    run_virtual(wire, main())


def test_a_blocking_driver_on_an_event_loop_is_refused() -> None:
    wire = Wire()
    with pytest.raises(RuntimeError, match="use the asynchronous driver"):
        finish(asyncio.sleep(0))
    assert isinstance(driver(wire), Mic488)


def test_the_answers_of_two_units_are_kept_apart() -> None:
    wire = Wire(units=(1, 2))
    wire.twins[1].user[0], wire.twins[2].user[0] = 11, 22
    line = thread_line(wire)
    one, two = (Mic488(line, unit, firmware="1.70") for unit in (1, 2))
    assert [(one.registers(0, 1), two.registers(0, 1)) for _ in range(3)] == [((11,), (22,))] * 3
    # Each has its own pace: frames to different units follow each other closely.
    moments = [at for at, _ in wire.sent]
    assert moments[-1] - moments[0] < 5 * INTERVAL - 5 * MILLISECOND
    assert words(b"\3\2\0\1") == (1,)
    assert SECOND // INTERVAL == 100
    assert issubclass(NoAnswer, LineFailure)


def test_timers_do_not_pile_up() -> None:
    """Each exchange moves the time at which something is to be done next."""
    wire = Wire()

    async def main() -> int:
        async with async_driver(task_line(wire), wire) as mic:
            most = 0
            for _ in range(60):
                await mic.positions()
                timers = asyncio.get_running_loop()._scheduled  # type: ignore[attr-defined]
                most = max(most, sum(not timer.cancelled() for timer in timers))
            return most

    assert run_virtual(wire, main()) <= 4


def test_a_line_that_is_closed_while_it_waits_for_an_answer_gives_up_in_time_when_it_is_opened_again() -> None:
    wire = Wire()
    line = task_line(wire)

    async def main() -> None:
        await line.open()
        wire.severed = True
        for _ in range(2):
            asked = asyncio.create_task(line.exchange(Job(ModbusQuery(1, ReadRequest(3, 0, 1)), TIMEOUT)))
            await asyncio.sleep(0.01)
            await line.close()
            with pytest.raises(LineLost):
                await asked
            await line.open()
        begin = line.now()
        with pytest.raises(NoAnswer):
            await line.exchange(Job(ModbusQuery(1, ReadRequest(3, 0, 1)), TIMEOUT))
        assert line.now() - begin == pytest.approx(TIMEOUT, abs=INTERVAL)

    run_virtual(wire, main())


class Slow(MemoryEndpoint):
    """It takes a second to open, and may never say that it has been closed."""

    is_silent = False

    async def connect(self, make: Callable[[], asyncio.Protocol]) -> MemoryTransport:
        await asyncio.sleep(1.0)
        transport = await super().connect(make)
        if self.is_silent:
            transport.close = lambda: None  # type: ignore[method-assign]
        return transport


def test_a_line_that_is_closed_while_it_is_opened_is_not_open() -> None:
    wire = Wire()
    line = task_line(wire)
    line._endpoint = endpoint = Slow(wire)

    async def main() -> None:
        opening = asyncio.create_task(line.open())
        await asyncio.sleep(0.5)
        await line.close()
        await opening
        assert endpoint.transport is not None
        assert endpoint.transport.is_closing()

    run_virtual(wire, main())


@pytest.mark.parametrize(("is_silent", "seconds"), [(False, 0.0), (True, 1.0)])
def test_the_other_end_is_given_a_second_to_close(is_silent: bool, seconds: float) -> None:
    wire = Wire()
    line = task_line(wire)
    line._endpoint = endpoint = Slow(wire)
    endpoint.is_silent = is_silent

    async def main() -> None:
        await line.open()
        begin = line.now()
        await line.close()
        assert line.now() - begin == round(seconds * SECOND)
        assert endpoint.transport is not None
        assert endpoint.transport.is_closing()

    run_virtual(wire, main())


@pytest.mark.parametrize("ticks", range(6))
def test_a_task_that_is_cancelled_while_it_waits_for_a_lock_does_not_keep_it(ticks: int) -> None:
    """Whether it has just been given the lock or not."""
    line = task_line(Wire())
    entered: list[str] = []
    said: list[int] = []

    async def enter(name: str) -> None:
        async with line.lock("turn", lambda: said.append(line.now())):
            entered.append(name)

    async def main() -> None:
        async with line.lock("turn"):
            waiting = asyncio.create_task(enter("cancelled"))
            await asyncio.sleep(3.5)
        for _ in range(ticks):
            await asyncio.sleep(0)
        if waiting.done():
            return
        waiting.cancel()
        with pytest.raises(asyncio.CancelledError):
            await waiting
        assert entered == []
        await enter("another")
        assert entered == ["another"]

    run_virtual(Wire(), main())
    assert len(said) == 3, "each second"


def test_a_line_counts_what_it_has_sent_and_what_failed() -> None:
    wire = Wire()
    line = task_line(wire)

    async def main() -> None:
        async with line as entered:
            assert entered is line
            assert line.counts == (0, 0)
            await line.exchange(Job(ModbusQuery(1, ReadRequest(3, 10020, 2)), TIMEOUT))
            wire.severed = True
            with pytest.raises(NoAnswer):
                await line.exchange(Job(ModbusQuery(1, ReadRequest(3, 10020, 2)), TIMEOUT, most_attempts=2))
            assert line.counts == (3, 2)
        with pytest.raises(Misuse, match="the line memory is closed"):
            await line.exchange(Job(ModbusQuery(1, ReadRequest(3, 10020, 2)), TIMEOUT))

    run_virtual(wire, main())


def test_an_exchange_is_traced_with_its_failed_attempts() -> None:
    wire = Wire()
    line = task_line(wire)
    spans: list[tuple[object, ...]] = []

    class Noted:
        def set_attribute(self, name: str, value: object) -> None:
            spans.append((name, value))

    @contextlib.contextmanager
    def tracer(name: str, attributes: Mapping[str, object], is_part: bool) -> Generator[Noted]:
        spans.append((name, dict(attributes), is_part))
        yield Noted()

    async def main() -> None:
        async with line:
            await line.exchange(Job(ModbusQuery(1, ReadRequest(3, 10020, 2)), TIMEOUT))
            assert spans == []
            wire.put(Fault("to twin", 0, "drop"))
            with traced_by(tracer):
                answer = await line.exchange(Job(ModbusQuery(1, ReadRequest(3, 10020, 2)), TIMEOUT, most_attempts=2))
            assert words(answer) == (0, 0)

    run_virtual(wire, main())
    assert spans == [
        ("line memory", {"line": "memory", "request": "unit 1: 03 27 24 00 02"}, True),
        ("failed_attempts", 1),
    ]


def test_a_line_that_is_closed_while_it_is_opened_again_stays_closed() -> None:
    wire = Wire()
    line = task_line(wire)
    endpoint = Slow(wire)

    async def main() -> None:
        await line.open()
        line._endpoint = endpoint
        assert line._transport is not None
        line._transport.lose()  # type: ignore[attr-defined]
        asking = asyncio.create_task(line.exchange(Job(ModbusQuery(1, ReadRequest(3, 10020, 2)), TIMEOUT)))
        await asyncio.sleep(0.5)
        await line.close()
        with pytest.raises(LineLost, match="the line memory was closed"):
            await asking
        await asyncio.sleep(2.0)
        assert endpoint.transport is None

    run_virtual(wire, main())
