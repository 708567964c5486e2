"""The pty link: its place in the file system, and programs that come and go."""

from __future__ import annotations

import asyncio
import os
import termios
import time
import tty
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

from steptwin.errors import LineFailure, Misuse
from steptwin.live import pty as module
from steptwin.live.clock import Clock
from steptwin.live.pty import PtyLink
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.mic488.config import ControllerConfig
from steptwin.mic488.device import Mic488Device
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.wire.line import SerialLine
from steptwin.wire.slave import RtuSlavePort
from steptwin.wire.timed import LineTiming, TimedRtuSlavePort, TimedUnits


@pytest.fixture(params=["epoll", "timer"], autouse=True)
def waiting(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both ways of waiting for the next program do the same."""
    monkeypatch.setattr(module, "HAS_EPOLL", request.param == "epoll")
    monkeypatch.setattr(module, "LOOK_S", 0.002)


INPUTS = bytes.fromhex("010213880008FD62")
INPUTS_ANSWER = bytes.fromhex("01020100A188")
POSITION = bytes.fromhex("0103272400028EB4")
POSITION_ANSWER = bytes.fromhex("010304 00000000 FA33".replace(" ", ""))


def on_link(path: Path, play: Callable[[PtyLink], Awaitable[Any]], *, timed: bool = False) -> Any:
    """Play a scene on an open link. The system passes a pty's bytes on in its own time, so this is real time."""

    async def scene() -> Any:
        link = make_link(path, timed=timed)
        await link.open()
        try:
            return await play(link)
        finally:
            await link.close()

    return asyncio.run(scene())


def make_link(path: Path, *, timed: bool = False) -> PtyLink:
    scheduler = Scheduler()
    devices = {1: Mic488Device(ControllerConfig())}
    scheduler.add("1", devices[1])
    units = TimedUnits(devices, LineTiming(SerialLine(38400)))
    return PtyLink(RealTimeDriver(scheduler, Clock()), path, lambda: TimedRtuSlavePort(units) if timed else RtuSlavePort(devices))


class Program:
    """What opens a serial line as programs do."""

    def __init__(self, path: Path) -> None:
        self.file = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)

    def send(self, data: bytes) -> None:
        os.write(self.file, data)

    async def receive(self, count: int, seconds: float = 60.0) -> bytes:
        """``count`` bytes, or what has come when the time is over."""
        data = b""
        deadline = time.monotonic() + seconds
        while len(data) < count and time.monotonic() < deadline:
            try:
                data += os.read(self.file, count - len(data))
            except BlockingIOError:
                await asyncio.sleep(0.001)
        return data

    def end(self) -> None:
        os.close(self.file)


async def ask(program: Program, request: bytes, answer: bytes) -> bytes:
    program.send(request)
    return await program.receive(len(answer))


# ---------------------------------------------------------------------- programs


def test_a_program_is_answered_and_so_is_the_next(tmp_path: Path) -> None:
    async def play(link: PtyLink) -> list[bytes]:
        answers = []
        for _ in range(3):
            program = Program(link.path)
            answers.append(await ask(program, INPUTS, INPUTS_ANSWER))
            program.end()
        return answers

    assert on_link(tmp_path / "line", play) == [INPUTS_ANSWER] * 3


def test_the_line_is_raw(tmp_path: Path) -> None:
    """03 would be Ctrl-C and 0D a new line to a terminal."""

    async def play(link: PtyLink) -> bytes:
        program = Program(link.path)
        write = bytes.fromhex("0106000A0D03ED59")
        answer = await ask(program, write, write)
        program.end()
        return answer

    assert on_link(tmp_path / "line", play) == bytes.fromhex("0106000A0D03ED59")


def test_a_program_that_left_echo_on_does_not_spoil_the_line_for_the_next(tmp_path: Path) -> None:
    async def play(link: PtyLink) -> bytes:
        first = Program(link.path)
        settings = termios.tcgetattr(first.file)
        settings[tty.LFLAG] |= termios.ECHO | termios.ICANON
        termios.tcsetattr(first.file, termios.TCSANOW, settings)
        first.end()
        await left(link)
        second = Program(link.path)
        answer = await ask(second, INPUTS, INPUTS_ANSWER)
        second.end()
        return answer

    assert on_link(tmp_path / "line", play) == INPUTS_ANSWER


async def left(link: PtyLink) -> None:
    """Let the link notice that nobody has the line open."""
    for _ in range(50):
        await asyncio.sleep(0.001)


def test_an_answer_that_was_not_read_is_not_there_for_the_next(tmp_path: Path) -> None:
    async def play(link: PtyLink) -> bytes:
        first = Program(link.path)
        first.send(POSITION)
        await left(link)
        first.end()
        await left(link)
        second = Program(link.path)
        answer = await ask(second, INPUTS, INPUTS_ANSWER)
        second.end()
        return answer

    assert on_link(tmp_path / "line", play) == INPUTS_ANSWER


def test_an_answer_still_on_its_way_is_not_there_for_the_next(tmp_path: Path) -> None:
    """With line timing it comes some milliseconds after its program has gone."""

    async def play(link: PtyLink) -> bytes:
        first = Program(link.path)
        first.send(POSITION)
        await asyncio.sleep(0.001)
        first.end()
        await left(link)
        second = Program(link.path)
        answer = await ask(second, INPUTS, INPUTS_ANSWER)
        second.end()
        return answer

    assert on_link(tmp_path / "line", play, timed=True) == INPUTS_ANSWER


def test_half_a_frame_is_not_there_for_the_next(tmp_path: Path) -> None:
    async def play(link: PtyLink) -> bytes:
        first = Program(link.path)
        first.send(bytes.fromhex("0110 0000 0078 F0".replace(" ", "")))  # 240 bytes are to follow
        first.end()
        await left(link)
        second = Program(link.path)
        answer = await ask(second, INPUTS, INPUTS_ANSWER)
        second.end()
        return answer

    assert on_link(tmp_path / "line", play) == INPUTS_ANSWER


def test_a_quick_program_loses_nothing_when_the_one_before_is_noticed_to_have_left(tmp_path: Path) -> None:
    async def play(link: PtyLink) -> list[bytes]:
        answers = []
        for _ in range(100):
            program = Program(link.path)
            answers.append(await ask(program, INPUTS, INPUTS_ANSWER))
            program.end()
        return answers

    assert on_link(tmp_path / "line", play) == [INPUTS_ANSWER] * 100


def test_a_program_that_never_reads_does_not_stop_the_loop(tmp_path: Path) -> None:
    async def play(link: PtyLink) -> bytes:
        deaf = Program(link.path)
        for _ in range(200):
            try:
                deaf.send(POSITION * 20)
            except BlockingIOError:
                await asyncio.sleep(0)
        await left(link)
        deaf.end()
        await left(link)
        second = Program(link.path)
        answer = await ask(second, INPUTS, INPUTS_ANSWER)
        second.end()
        return answer

    assert on_link(tmp_path / "line", play) == INPUTS_ANSWER


def test_nobody_there_costs_nothing(tmp_path: Path) -> None:
    async def play(link: PtyLink) -> float:
        before = time.process_time()
        await asyncio.sleep(0.5)
        return time.process_time() - before

    assert on_link(tmp_path / "line", play) < 0.2


# ---------------------------------------------------------------------- the path


def open_and_close(path: Path) -> None:
    async def play(link: PtyLink) -> None:
        assert link.path.is_symlink()
        assert os.readlink(link.path).startswith("/dev/pts/")

    on_link(path, play)


def test_the_link_and_its_directory_are_made_and_the_link_is_gone_at_the_end(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "line"
    open_and_close(path)
    assert list(path.parent.iterdir()) == []


def test_what_a_killed_twin_left_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "line"
    master, somebody_elses = os.openpty()
    # Its number under /dev/pts has been given to somebody else since.
    path.symlink_to(os.ttyname(somebody_elses))
    (tmp_path / ".line.lock").write_text("123456\n")
    open_and_close(path)
    os.close(master)
    os.close(somebody_elses)
    assert list(tmp_path.iterdir()) == []


def test_a_link_that_leads_nowhere_any_more_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "line"
    path.symlink_to("/dev/pts/98765")
    open_and_close(path)
    assert list(tmp_path.iterdir()) == []


def refused(path: Path, text: str) -> None:
    async def scene() -> None:
        link = make_link(path)
        with pytest.raises(Misuse, match=f"^{path} {text}.*: choose another --pty$"):
            await link.open()
        await link.close()

    asyncio.run(scene())


def test_what_somebody_else_put_there_is_left_alone(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("precious")
    refused(file, "exists and is not a link to a pseudo terminal")
    assert file.read_text() == "precious"

    link = tmp_path / "link"
    link.symlink_to(file)
    refused(link, f"is an existing link to {file}")
    assert link.readlink() == file

    refused(tmp_path, "exists and is not a link")


def test_the_link_of_another_program_to_a_living_pty_is_left_alone(tmp_path: Path) -> None:
    """socat makes such links too."""
    path = tmp_path / "line"
    master, slave = os.openpty()
    path.symlink_to(os.ttyname(slave))
    refused(path, f"is an existing link to {os.ttyname(slave)}")
    assert path.readlink() == Path(os.ttyname(slave))
    os.close(master)
    os.close(slave)


def test_a_path_has_one_twin(tmp_path: Path) -> None:
    async def play(link: PtyLink) -> tuple[str, bytes]:
        second = make_link(link.path)
        with pytest.raises(Misuse) as refusal:
            await second.open()
        await second.close()
        program = Program(link.path)
        answer = await ask(program, INPUTS, INPUTS_ANSWER)
        program.end()
        return str(refusal.value), answer

    path = tmp_path / "line"
    text, answer = on_link(path, play)
    assert text == f"{path} is the pseudo terminal of process {os.getpid()}: choose another --pty"
    assert answer == INPUTS_ANSWER


def test_a_link_somebody_replaced_meanwhile_is_left_to_him(tmp_path: Path) -> None:
    path = tmp_path / "line"

    async def play(link: PtyLink) -> None:
        path.unlink()
        path.write_text("his")

    on_link(path, play)
    assert path.read_text() == "his"


def test_a_place_where_no_link_can_be_made(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    path = tmp_path / "file" / "line"

    async def scene() -> None:
        with pytest.raises(LineFailure, match=f"cannot make a pseudo terminal at {path}: "):
            await make_link(path).open()

    asyncio.run(scene())
