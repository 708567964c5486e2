"""A line between two others: everything passes unchanged, and everything is told."""

from __future__ import annotations

import asyncio
import os
import socket
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest
from shell import Shell
from typer.testing import CliRunner
from virtual_loop import run_virtually

from steptwin.cli import app
from steptwin.drivers.kind import Decoder
from steptwin.drivers.lineaddress import LineAddress, parse_line_address
from steptwin.drivers.m1486.decoder import M1486Decoder
from steptwin.drivers.mic488.decoder import ModbusDecoder
from steptwin.errors import LineFailure, Misuse
from steptwin.live.sniff import Tap, sniff
from steptwin.simulation.toml.addresses import Address
from steptwin.wire.crc import with_crc
from steptwin.wire.frameline import FrameLine

READ, ANSWER = bytes.fromhex("01 03 27 24 00 02 8E B4"), bytes.fromhex("01 03 04 00 00 41 48 CA 55")
ANYWHERE = Address("127.0.0.1", 0)


async def device(answer: Callable[[bytes], bytes]) -> tuple[asyncio.Server, int]:
    """Somebody who answers each piece he hears."""

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while data := await reader.read(1000):
            writer.write(answer(data))
        writer.close()

    server = await asyncio.start_server(serve, "127.0.0.1", 0)
    return server, server.sockets[0].getsockname()[1]


def told(frames: list[FrameLine]) -> list[str]:
    return [f"{frame.direction.name} {frame.meaning}" for frame in frames]


async def enough(frames: list[FrameLine], count: int) -> None:
    while len(frames) < count:  # noqa: ASYNC110
        await asyncio.sleep(0.001)


async def through(scheme: str, decoder: Decoder, answers: dict[bytes, bytes]) -> None:
    """A client asks through a tap and hears what the device says."""
    server, port = await device(answers.__getitem__)
    ready: asyncio.Future[str] = asyncio.get_running_loop().create_future()
    place = parse_line_address(f"{scheme}://127.0.0.1:{port}", 38400)
    tap = asyncio.create_task(sniff(place, decoder, listen=ANYWHERE, ready=ready.set_result))
    reader, writer = await asyncio.open_connection("127.0.0.1", int((await ready).rpartition(":")[2]))
    for asked, answer in answers.items():
        writer.write(asked)
        assert await reader.readexactly(len(answer)) == answer
    writer.close()
    await writer.wait_closed()
    tap.cancel()
    await asyncio.gather(tap, return_exceptions=True)
    server.close()


def test_modbus_passes_and_is_told() -> None:
    frames: list[FrameLine] = []
    asyncio.run(through("rtu-tcp", ModbusDecoder(frames.append, "1.70", tcp=False), {READ: ANSWER}))
    assert told(frames) == ["IN unit 1: read M1_POS_ACT", "OUT unit 1: read M1_POS_ACT = 12.5 u"]


def test_modbus_tcp_passes_and_is_told() -> None:
    frames: list[FrameLine] = []
    asked, answer = bytes.fromhex("0007 0000 0006 01 03 2724 0002"), bytes.fromhex("0007 0000 0007 01 03 04 0000 4148")
    asyncio.run(through("tcp", ModbusDecoder(frames.append, "1.70", tcp=True), {asked: answer}))
    assert told(frames) == ["IN unit 1: read M1_POS_ACT", "OUT unit 1: read M1_POS_ACT = 12.5 u"]


def test_a_silence_ends_although_the_clock_goes_on_in_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """As on Windows, where timers come before the clock has gone on."""
    frames: list[FrameLine] = []
    unknown = with_crc(bytes.fromhex("01 41 01 02 03"))

    async def play() -> None:
        loop = asyncio.get_running_loop()
        steps = SimpleNamespace(monotonic_ns=lambda: int(loop.time() / 0.016) * 16_000_000)
        monkeypatch.setattr("steptwin.live.sniff.time", steps)
        tap = Tap(ModbusDecoder(frames.append, "1.70", tcp=False), is_relay=False)
        tap.data_received(unknown)
        await asyncio.sleep(1.0)

    run_virtually(play())
    assert [frame.raw for frame in frames] == [unknown]


def test_the_m1486_passes_and_is_told() -> None:
    frames: list[FrameLine] = []
    asyncio.run(through("rtu-tcp", M1486Decoder(frames.append, "A"), {b"U1\r": b"\x2a", b"+100\r": b"\x5e"}))
    assert [frame.raw for frame in frames] == [b"U1\r", b"\x2a", b"+100\r", b"\x5e"]
    assert frames[0].meaning == "U1  Upload 1"
    assert frames[1].meaning.startswith("U1 ")
    assert frames[1].meaning.endswith(" = 42")
    assert frames[2].meaning == "+100  Add 100"
    assert frames[3].meaning == "no room in the input buffer: a character is lost"


def test_listening_only() -> None:
    """Both directions come from one wire, and the end of the line is told."""
    frames: list[FrameLine] = []
    master, slave = os.openpty()

    async def main() -> None:
        place = parse_line_address(os.ttyname(slave), 38400)
        decoder = ModbusDecoder(frames.append, "1.70", tcp=False)

        def ready(where: str) -> None:
            assert where == f"listening on {os.ttyname(slave)}"
            os.write(master, READ + ANSWER + b"\xff")

        tap = asyncio.create_task(sniff(place, decoder, ready=ready))
        await enough(frames, 3)
        os.close(master)
        with pytest.raises(LineFailure, match="was lost"):
            await tap

    asyncio.run(main())
    os.close(slave)
    assert told(frames)[:2] == ["IN unit 1: read M1_POS_ACT", "OUT unit 1: read M1_POS_ACT = 12.5 u"]
    assert frames[2].meaning == "no frame: 1 byte"


def test_standing_in_a_line_with_a_pty(tmp_path: Path) -> None:
    frames: list[FrameLine] = []

    async def main() -> None:
        server, port = await device(lambda data: ANSWER)
        ready = asyncio.Event()
        place = parse_line_address(f"rtu-tcp://127.0.0.1:{port}", 38400)
        decoder = ModbusDecoder(frames.append, "1.70", tcp=False)
        tap = asyncio.create_task(sniff(place, decoder, pty=tmp_path / "tty", ready=lambda where: ready.set()))
        await ready.wait()
        terminal = os.open(tmp_path / "tty", os.O_RDWR | os.O_NOCTTY)
        os.write(terminal, READ)
        await enough(frames, 2)
        assert await asyncio.to_thread(os.read, terminal, 100) == ANSWER
        os.close(terminal)
        tap.cancel()
        await asyncio.gather(tap, return_exceptions=True)
        server.close()

    asyncio.run(main())
    assert not (tmp_path / "tty").exists()


def test_a_connection_cannot_be_listened_to() -> None:
    place = parse_line_address("tcp://127.0.0.1:1", 38400)
    with pytest.raises(Misuse, match="use a relay, --listen HOST:PORT"):
        asyncio.run(sniff(place, ModbusDecoder(print, "1.70", tcp=True)))


def test_a_device_that_cannot_be_reached() -> None:
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        place = parse_line_address(f"rtu-tcp://127.0.0.1:{s.getsockname()[1]}", 38400)
    with pytest.raises(LineFailure, match="connection refused"):
        asyncio.run(sniff(place, ModbusDecoder(print, "1.70", tcp=False), listen=ANYWHERE))


def test_options_of_another_language_and_unknown_languages(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    shell = Shell(monkeypatch, capsys)
    for options, problem in (
        (("--language", "canopen"), "--language canopen: permitted are modbus, m1486"),
        (("--variant", "B"), "--variant is not for a MIC488"),
        (("--language", "m1486", "--firmware", "1.70"), "--firmware is not for an M1486"),
        (("--firmware", "9"), "unknown firmware '9'"),
    ):
        shell("sniff", "/dev/none", *options)
        assert (shell.code, problem in shell.errors) == (2, True)


def test_tcp_is_the_raw_line_of_an_m1486(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """As in every other command; so a pseudo terminal stands in it, too."""
    places: list[bool] = []

    async def taken(place: LineAddress, decoder: object, **options: object) -> None:
        places.append(place.framed)
        assert options["pty"] == tmp_path / "tty"

    monkeypatch.setattr("steptwin.live.sniff.sniff", taken)
    for language in ("m1486", "modbus"):
        done = CliRunner().invoke(app, ["sniff", "tcp://127.0.0.1:1", "--pty", str(tmp_path / "tty"), "--language", language])
        assert done.exit_code == 0, done.output
    assert places == [False, True]
