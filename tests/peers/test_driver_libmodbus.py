"""The drivers against a slave that nobody here wrote: libmodbus with the addresses of a MIC488."""

from __future__ import annotations

import asyncio
import contextlib
import os
import select
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from steptwin.drivers import AsyncMic488, Mic488, ModbusRefusal, Reason
from steptwin.wire.pdu import ReadRequest

SOURCE = Path(__file__).with_name("slave.c")


class NullModem:
    """Two ptys whose masters are joined: one end for each program."""

    def __init__(self) -> None:
        pairs = [os.openpty() for _ in range(2)]
        self._masters = [master for master, _ in pairs]
        self._slaves = [slave for _, slave in pairs]
        self.ends = [os.ttyname(slave) for slave in self._slaves]
        self._stop, self._stopper = os.pipe()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        one, two = self._masters
        while self._stop not in (ready := select.select([one, two, self._stop], [], [])[0]):
            for master in ready:
                os.write(two if master == one else one, os.read(master, 4096))

    def close(self) -> None:
        os.write(self._stopper, b"x")
        self._thread.join()
        for number in [*self._masters, *self._slaves, self._stop, self._stopper]:
            os.close(number)


@pytest.fixture(scope="module")
def program(
    require_peer: Callable[[str], str], require_library: Callable[[str], list[str]], tmp_path_factory: pytest.TempPathFactory
) -> str:
    out = tmp_path_factory.mktemp("c") / "slave"
    compiler = [require_peer("cc"), "-std=gnu99", "-Wall", "-Werror", "-O1"]
    subprocess.run([*compiler, str(SOURCE), "-o", str(out), *require_library("libmodbus")], check=True)
    return str(out)


@pytest.fixture(params=["tcp", "rtu"])
def address(program: str, request: pytest.FixtureRequest) -> Iterator[str]:
    with ExitStack() as stack:
        arguments = [request.param, "-"]
        where = "tcp://127.0.0.1:{}"
        if request.param == "rtu":
            cable = NullModem()
            stack.callback(cable.close)
            arguments = ["rtu", cable.ends[0]]
            where = cable.ends[1]
        slave = stack.enter_context(subprocess.Popen([program, *arguments], stdout=subprocess.PIPE, text=True))
        stack.callback(slave.kill)
        assert slave.stdout is not None
        yield where.format(slave.stdout.readline().strip())


def test_a_session(address: str) -> None:
    with Mic488(address, timeout_s=60.0) as mic:
        assert mic.firmware == "1.70"
        mic.enable(1, 2)
        assert mic.status().axes == (1, 1, 0, 0)
        mic.axis(2).move_to(12.5)
        end = mic.axis(2).wait()
        assert (end.reason, end.position_u) == (Reason.TARGET, 12.5)
        assert mic.positions() == (0.0, 12.5, 0.0, 0.0)
        mic.set_output(3, True)
        assert mic.outputs() == (False, False, True, False, False, False, False, False)
        mic.user.reals.write_many(100, [1.5, -2.5, 1e6])
        assert mic.user.reals.read_many(100, 3) == [1.5, -2.5, 1e6]
        mic.user.dints.write(200, -70000)
        assert mic.user.words.read_many(200, 2) == [0xEE90, 0xFFFE]
        mic.axis(3).set_ramp(acc=5.0)
        kept = mic.take_snapshot()
        mic.axis(3).set_ramp(acc=7.0)
        assert [str(change) for change in mic.restore_snapshot(kept, dry_run=True)] == ["M3_ACC: 7 → 5"]
        with pytest.raises(ModbusRefusal, match="exception 02"):
            mic.request(ReadRequest(3, 11999, 2))


def test_a_session_of_several_tasks(address: str) -> None:
    async def main() -> None:
        async with AsyncMic488(address, timeout_s=60.0) as mic:
            await mic.enable()

            async def use(axis: int) -> None:
                for target in range(5):
                    await mic.axis(axis).move_to(float(target))
                    assert (await mic.axis(axis).wait()).position_u == target

            await asyncio.gather(*(use(axis) for axis in (1, 2, 3, 4)))
            assert await mic.positions() == (4.0,) * 4

    asyncio.run(main())


def test_it_is_found_again_after_the_connection_was_closed(program: str) -> None:
    with contextlib.ExitStack() as stack:
        slave = stack.enter_context(subprocess.Popen([program, "tcp", "-"], stdout=subprocess.PIPE, text=True))
        stack.callback(slave.kill)
        assert slave.stdout is not None
        mic = Mic488(f"tcp://127.0.0.1:{slave.stdout.readline().strip()}", timeout_s=60.0)
        for _ in range(3):
            with mic:
                assert len(mic.positions()) == 4
