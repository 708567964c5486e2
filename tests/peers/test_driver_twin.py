"""The drivers against served twins, over every link, in real time and in processes of their own."""

from __future__ import annotations

import asyncio
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from typing import Any

import pytest

from steptwin.drivers import AsyncMic488, LineLost, Mic488, ModbusLine, Reason, Unconfirmed
from steptwin.mic488.status import AxisStatus


def place(twin: Any, way: str) -> str:
    return {
        "pty": str(twin.pty),
        "tcp": f"tcp://127.0.0.1:{twin.tcp_port}",
        "rtu-tcp": f"rtu-tcp://127.0.0.1:{twin.rtu_tcp_port}",
    }[way]


@pytest.mark.parametrize("way", ["pty", "rtu-tcp"])
def test_a_session(serve: Callable[..., Any], way: str) -> None:
    with Mic488(place(serve("--demo"), way), timeout_s=60.0) as mic:
        mic.enable(1, 2)
        mic.axis(1).set_ramp(acc=1000.0, dec=1000.0, velocity=100.0)
        mic.axis(1).move_to(5.0)
        assert mic.axis(1).wait().position_u == 5.0
        with mic.axis(2).jog(5.0, hold_s=2.0) as jog:
            assert jog.hold()
            assert mic.axis(2).velocity() > 0.0
        assert mic.axis(2).wait().ok
        mic.axis(2).home(-20.0)
        assert mic.axis(2).wait().reason is Reason.TARGET
        assert mic.status().axes == (AxisStatus.REACHED, AxisStatus.REACHED, AxisStatus.OFF, AxisStatus.OFF)


def test_a_session_of_tasks(serve: Callable[..., Any]) -> None:
    twin = serve("--demo")

    async def main() -> None:
        async with AsyncMic488(place(twin, "tcp"), timeout_s=60.0) as mic:
            await mic.enable()
            await asyncio.gather(*(mic.axis(n).set_ramp(acc=1000.0, dec=1000.0, velocity=100.0) for n in (1, 2, 3, 4)))

            async def there_and_back(axis: int) -> None:
                for target in (3.0, 0.0):
                    await mic.axis(axis).move_to(target)
                    assert (await mic.axis(axis).wait()).position_u == target

            await asyncio.gather(*(there_and_back(axis) for axis in (1, 2, 3, 4)))

    asyncio.run(main())


def test_two_controllers_and_two_threads_on_one_line(serve: Callable[..., Any]) -> None:
    twin = serve("--demo", "--units", "1,2")
    failed: list[BaseException] = []

    def use(mic: Mic488, word: int) -> None:
        try:
            for number in range(30):
                mic.user.words.write(number, word)
                assert mic.user.words.read(number) == word
        except BaseException as error:  # noqa: BLE001
            failed.append(error)

    with ModbusLine(place(twin, "pty")) as line:
        drivers = [Mic488(line, unit, timeout_s=60.0) for unit in (1, 2)]
        for mic in drivers:
            mic.open()
        threads = [threading.Thread(target=use, args=(mic, 100 + mic.unit)) for mic in drivers]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert failed == []
        assert [mic.user.words.read(7) for mic in drivers] == [101, 102]


JOG = """
import sys
from steptwin.drivers import Mic488
with Mic488(sys.argv[1]) as mic:
    mic.enable(1)
    with mic.axis(1).jog(5.0, hold_s=2.0) as jog:
        while jog.hold():
            print(flush=True)
"""


def test_a_client_that_is_killed_leaves_the_axis_stopping(serve: Callable[..., Any]) -> None:
    twin = serve("--demo")
    with subprocess.Popen([sys.executable, "-c", JOG, place(twin, "pty")], stdout=subprocess.PIPE, text=True) as client:
        assert client.stdout is not None
        for _ in range(3):
            assert client.stdout.readline() == "\n"
        client.send_signal(signal.SIGKILL)
        client.wait()
    with Mic488(place(twin, "tcp"), observe=True, timeout_s=60.0) as mic:
        killed_at = mic.axis(1).position()
        assert killed_at > 0.0
        end = mic.axis(1).wait(check=False)
        assert end.position_u is not None
        # At most what it goes in the hold time, and to brake.
        assert end.position_u - killed_at <= 5.0 * 2.0 + 5.0**2 / (2 * 50.0) + 0.02
        assert mic.axis(1).status() == AxisStatus.REACHED


def test_a_twin_that_ends_during_a_jog(serve: Callable[..., Any]) -> None:
    """The line is gone: the driver says that the controller cannot be reached, and what it does then."""
    twin = serve("--demo")
    with Mic488(place(twin, "tcp")) as mic:
        mic.enable(1)
        jog = mic.axis(1).jog(5.0, hold_s=1.0)
        jog.__enter__()
        assert jog.hold()
        twin.end()
        with pytest.raises(Unconfirmed, match=r"cannot be held any more: .*connection.*It stops by itself, at most 5.25 u"):  # noqa: PT012
            while jog.hold():
                pass
        with pytest.raises(LineLost, match="connection refused"):
            mic.positions()
