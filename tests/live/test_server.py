"""A server from start to end: what it leaves behind, what it says, and when it cannot go on."""

from __future__ import annotations

import asyncio
import json
import os
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

from steptwin.errors import LineFailure, Misuse, Runaway
from steptwin.files.world import World
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.server import Server, clear_ready_file
from steptwin.live.transports import TRANSPORTS
from steptwin.mic488.config import ControllerConfig
from steptwin.mic488.device import Mic488Device
from steptwin.subject.world import WorldSubject
from steptwin.wire.slave import TcpSlavePort

Run = Callable[..., Any]
Make = Callable[[], tuple[RealTimeDriver, Mic488Device]]


def serving(run: Run, make_realtime: Make, play: Callable[[Server, list[str]], Awaitable[Any]]) -> Any:
    async def scene() -> Any:
        told: list[str] = []
        server = Server(make_realtime()[0], told.append)
        try:
            return await play(server, told)
        finally:
            await server.close()

    return run(scene())


def port() -> TcpSlavePort:
    return TcpSlavePort({1: Mic488Device(ControllerConfig())})


# ---------------------------------------------------------------------- ready file


def test_the_ready_file_names_every_end_point_and_is_gone_at_the_end(run: Run, make_realtime: Make, tmp_path: Path) -> None:
    path = tmp_path / "new" / "ready.json"

    async def play(server: Server, told: list[str]) -> Any:
        server.introduce("twin", lambda: [{"name": "table"}], tmp_path / "machine.toml")
        await server.open_control(WorldSubject(World.from_toml("[[mic488]]\nname = 'a'\n")))
        await server.open(TRANSPORTS["pty"], str(tmp_path / "line"), "Modbus RTU", port, line="bus")
        await server.open(TRANSPORTS["tcp"], "127.0.0.1:0", "Modbus TCP", port)
        server.write_ready_file(path)
        return json.loads(path.read_text())

    ready = serving(run, make_realtime, play)
    pty, tcp = ready.pop("end_points")
    controllers = [{"name": "table"}]
    assert ready == {"name": "twin", "pid": os.getpid(), "file": str(tmp_path / "machine.toml"), "controllers": controllers}
    assert pty == {"kind": "pty", "protocol": "Modbus RTU", "path": str(tmp_path / "line"), "line": "bus"}
    assert tcp.pop("port") > 0
    assert tcp == {"kind": "tcp", "protocol": "Modbus TCP", "host": "127.0.0.1", "line": None}
    assert list(tmp_path.rglob("*")) == [tmp_path / "new"]


def test_the_ready_file_of_another_server_is_left_to_it(run: Run, make_realtime: Make, tmp_path: Path) -> None:
    path = tmp_path / "ready.json"

    async def play(server: Server, told: list[str]) -> None:
        server.write_ready_file(path)
        path.write_text("two")

    serving(run, make_realtime, play)
    assert path.read_text() == "two"


def test_a_ready_file_that_cannot_be_written(run: Run, make_realtime: Make, tmp_path: Path) -> None:
    async def play(server: Server, told: list[str]) -> None:
        with pytest.raises(LineFailure, match=f"cannot write the ready file {tmp_path}: "):
            server.write_ready_file(tmp_path)

    serving(run, make_realtime, play)
    assert list(tmp_path.iterdir()) == []


def ready_file(path: Path, pid: int) -> Path:
    path.write_text(json.dumps({"name": "twin", "pid": pid, "end_points": []}))
    return path


def test_what_a_dead_server_left_is_removed(tmp_path: Path) -> None:
    path = ready_file(tmp_path / "ready.json", 2**22 + 1)  # above the highest process id
    clear_ready_file(path)
    assert not path.exists()


def test_what_a_living_server_wrote_stays(tmp_path: Path) -> None:
    path = ready_file(tmp_path / "ready.json", os.getppid())
    clear_ready_file(path)
    assert path.exists()


def test_clearing_a_ready_file_that_is_not_there_changes_nothing(tmp_path: Path) -> None:
    clear_ready_file(tmp_path / "ready.json")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("content", [b"precious", b"[1]", b"{}", b'{"end_points": 1, "pid": "x"}', b"\xff", b""])
def test_any_other_file_is_left_alone(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "notes.txt"
    path.write_bytes(content)
    with pytest.raises(Misuse, match=f"{path} exists and is not a ready file: choose another --ready-file"):
        clear_ready_file(path)
    assert path.read_bytes() == content


def test_a_directory_is_no_ready_file(tmp_path: Path) -> None:
    with pytest.raises(Misuse, match=f"{tmp_path} cannot be a ready file: cannot read .*: it is a directory"):
        clear_ready_file(tmp_path)


# ---------------------------------------------------------------------- ending


def test_everything_is_closed_though_one_link_fails_to(run: Run, make_realtime: Make, tmp_path: Path) -> None:
    class Stubborn:
        async def close(self) -> None:
            raise LineFailure("will not close")

    async def play(server: Server, told: list[str]) -> None:
        await server.open(TRANSPORTS["pty"], str(tmp_path / "line"), "Modbus RTU", port)
        server._links.append(Stubborn())
        server.write_ready_file(tmp_path / "ready.json")

    with pytest.raises(LineFailure, match="will not close"):
        serving(run, make_realtime, play)
    assert list(tmp_path.iterdir()) == []


def test_controllers_that_cannot_go_on_end_the_server(run: Run, make_realtime: Make) -> None:
    async def play(server: Server, told: list[str]) -> None:
        def loop_of_wires() -> None:
            raise Runaway("signals did not settle")

        asyncio.get_running_loop().call_soon(loop_of_wires)
        with pytest.raises(LineFailure, match="signals did not settle"):
            await server.until_ended()

    serving(run, make_realtime, play)


def test_a_mistake_of_ours_is_one_line_and_the_server_goes_on(run: Run, make_realtime: Make) -> None:
    async def play(server: Server, told: list[str]) -> list[str]:
        def mistake() -> None:
            _ = {}["gone"]

        asyncio.get_running_loop().call_soon(mistake)
        asyncio.get_running_loop().call_exception_handler({"message": "accept", "exception": OSError(24, "Too many open files")})
        asyncio.get_running_loop().call_exception_handler({"message": "something odd"})
        await asyncio.sleep(0.1)
        return told

    accept, odd, mistake = serving(run, make_realtime, play)
    assert (accept, odd) == ("accept: too many open files", "something odd")
    assert mistake.startswith("internal error, please report it: KeyError: 'gone' (")
    assert "test_server.py:" in mistake


def test_the_same_notice_comes_once_a_second(run: Run, make_realtime: Make) -> None:
    async def play(server: Server, told: list[str]) -> list[str]:
        for _ in range(100):
            server.notice("again")
            server.notice("and again")
            await asyncio.sleep(0.03)
        return told

    assert serving(run, make_realtime, play) == ["again", "and again"] * 3


def test_a_lag_is_told(run: Run, make_realtime: Make) -> None:
    async def play(server: Server, told: list[str]) -> list[str]:
        loop: Any = asyncio.get_running_loop()
        server.realtime._arm(1_000_000)
        loop.hold_up(61.25)
        server.realtime.enter()
        return told

    assert serving(run, make_realtime, play) == [
        "this process did not run for 61.2 s; the time of the twin stood still meanwhile"
    ]
