"""The command runs on systems other than Linux: here without everything that Windows lacks (``tests/support/other_system.py``).

Clients are independent: pymodbus, and pyserial for the network serial port.
"""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import serial
from pymodbus import FramerType
from pymodbus.client import ModbusTcpClient

ROOT = Path(__file__).parent.parent
COMMAND = [sys.executable, str(ROOT / "tests/support/other_system.py")]
READ_POSITION = bytes.fromhex("01 03 27 24 00 02 8E B4")
AT_ZERO = bytes.fromhex("01 03 04 00 00 00 00 FA 33")

Start = Callable[..., "Twin"]


class Twin:
    """A command that serves until Ctrl-C."""

    def __init__(self, directory: Path, *arguments: str) -> None:
        self.ready_file = directory / "ready.json"
        self.process = subprocess.Popen(
            [*COMMAND, *arguments, "--ready-file", str(self.ready_file)],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        assert self.process.stdout is not None
        self.printed = ""
        while "Ctrl-C ends" not in self.printed:
            line = self.process.stdout.readline()
            assert line, self.printed
            self.printed += line

    def port(self, kind: str) -> int:
        points = json.loads(self.ready_file.read_text("utf-8"))["end_points"]
        return next(point["port"] for point in points if point["kind"] == kind)

    def end(self) -> str:
        """What it printed besides."""
        self.process.send_signal(signal.SIGINT)
        text, _ = self.process.communicate(timeout=60)
        assert self.process.returncode == 0, text
        assert not self.ready_file.exists()
        return text


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    twins: list[Twin] = []

    def begin(*arguments: str) -> Twin:
        twins.append(Twin(tmp_path, *arguments))
        return twins[-1]

    yield begin
    for twin in twins:
        if twin.process.poll() is None:
            twin.process.kill()
            twin.process.communicate()


def run(*arguments: str | Path, code: int = 0, **environment: str) -> str:
    """What a command prints, errors included."""
    ended = subprocess.run(
        [*COMMAND, *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        stdin=subprocess.DEVNULL,
        text=True,
        errors="replace",
        check=False,
        env={**os.environ, **environment},
    )
    assert ended.returncode == code, ended.stdout
    assert "Traceback" not in ended.stdout
    return ended.stdout


def test_what_windows_lacks_is_missing() -> None:
    """Otherwise the others would show nothing."""
    script = (
        "from other_system import *; become_another_system(); import importlib\n"
        "for name in MODULES:\n"
        "    try: importlib.import_module(name)\n"
        "    except ImportError: print(name)\n"
        "print(any(hasattr(module, name) for module, names in NAMES for name in names))\n"
        "from steptwin.system import HAS_EPOLL, HAS_PTYS, user\n"
        "print(HAS_EPOLL, HAS_PTYS, user())\n"
    )
    ran = subprocess.run([sys.executable, "-c", script], cwd=ROOT / "tests/support", capture_output=True, text=True, check=True)
    assert ran.stdout.split() == ["termios", "fcntl", "resource", "pty", "tty", "grp", "pwd", "False", "False", "False", "None"]


@pytest.mark.filterwarnings("ignore:set(Daemon|Name):DeprecationWarning")  # pyserial's
def test_a_mic488_is_served_to_clients_on_every_network_link(start: Start) -> None:
    twin = start("serve", "mic488", "--demo", *(f"--{link}=127.0.0.1:0" for link in ("tcp", "rtu-tcp", "rfc2217")))
    with ModbusTcpClient("127.0.0.1", port=twin.port("tcp"), timeout=10, retries=0) as client:
        assert not client.write_registers(100, [1, 2, 65535], device_id=1).isError()
        refused = client.read_holding_registers(9000, count=1, device_id=1)
        assert (refused.isError(), refused.exception_code) == (True, 2)
    with ModbusTcpClient("127.0.0.1", port=twin.port("rtu-tcp"), framer=FramerType.RTU, timeout=10, retries=0) as client:
        assert client.read_holding_registers(99, count=5, device_id=1).registers == [0, 1, 2, 65535, 0]
    with serial.serial_for_url(f"rfc2217://127.0.0.1:{twin.port('rfc2217')}", baudrate=38400, timeout=10) as port:
        port.write(READ_POSITION)
        assert port.read(len(AT_ZERO)) == AT_ZERO
    assert re.fullmatch(r"ran for \d+\.\d{3} s\n", twin.end())


def test_drivers_reach_devices_over_networks_and_com_ports(start: Start) -> None:
    twin = start("serve", "mic488", "--demo", *(f"--{link}=127.0.0.1:0" for link in ("tcp", "rtu-tcp", "rfc2217")))
    device = f"tcp://127.0.0.1:{twin.port('tcp')}"
    run("enable", "1", "-d", device)
    assert "3" in run("move", "1=3", "-d", f"rtu-tcp://127.0.0.1:{twin.port('rtu-tcp')}")
    assert run("get", "M1_POS_ACT", "-d", f"rfc2217://127.0.0.1:{twin.port('rfc2217')}").split()[1] == "3"
    assert run("watch", "M1_POS_ACT", "--count", "2", "-d", device).count("3") >= 2
    com = f"127.0.0.1:{twin.port('rtu-tcp')}"
    assert run("get", "M1_POS_ACT", "-d", "COM3", OTHER_SYSTEM_COM3=com).split()[1] == "3"
    assert run("ports", OTHER_SYSTEM_COM3=com).startswith("COM3")
    assert "COM4" in run("get", "M1_POS_ACT", "-d", "COM4", code=1)


def test_m1486_chips_are_served(start: Start) -> None:
    twin = start("serve", "m1486", "--tcp=127.0.0.1:0")
    with socket.create_connection(("127.0.0.1", twin.port("tcp")), timeout=10) as line:
        line.sendall(b"[\ru20\ru16\ru15\r]\r")
        uploaded = b""
        while len(uploaded) < 3:
            uploaded += line.recv(3)
        assert uploaded == b"A\x01\x02"
    twin.end()


def test_a_twin_on_a_com_port(start: Start) -> None:
    """The wire is a connection, at whose other end a master asks."""
    with socket.create_server(("127.0.0.1", 0)) as wire:
        wire.settimeout(60)
        environment = {"OTHER_SYSTEM_COM3": f"127.0.0.1:{wire.getsockname()[1]}"}
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv(*environment.popitem())
            twin = start("serve", "mic488", "--serial", "COM3")
        master = wire.accept()[0]
        with master:
            master.settimeout(60)
            master.sendall(READ_POSITION)
            assert master.recv(100) == AT_ZERO
            twin.end()


def test_memory_lasts_and_has_one_owner(start: Start, tmp_path: Path) -> None:
    options = ("serve", "mic488", "--tcp=127.0.0.1:0", "--state", str(tmp_path / "memory"))
    twin = start(*options)
    with ModbusTcpClient("127.0.0.1", port=twin.port("tcp"), timeout=10, retries=0) as client:
        assert not client.write_register(1000, 4711, device_id=1).isError()
        assert not client.write_coil(2101, True, device_id=1).isError()
    assert "is in use by process" in run(*options, "--name", "other", code=2)
    twin.end()
    twin = start(*options)
    with ModbusTcpClient("127.0.0.1", port=twin.port("tcp"), timeout=10, retries=0) as client:
        assert not client.write_coil(2100, True, device_id=1).isError()
        assert client.read_holding_registers(1000, count=1, device_id=1).registers == [4711]
    twin.end()
    assert [path.name for path in (tmp_path / "memory").iterdir() if path.suffix == ".lock"] == []


def test_a_world_is_up_and_its_session_replays(start: Start, tmp_path: Path) -> None:
    world = tmp_path / "machine.toml"
    world.write_text('[[line]]\nname = "bus"\ntcp = "127.0.0.1:0"\n[[mic488]]\nname = "table"\nline = "bus"\n', "utf-8")
    recording = tmp_path / "session.json"
    twin = start("up", str(world), "--session", str(recording))
    with ModbusTcpClient("127.0.0.1", port=twin.port("tcp"), timeout=10, retries=0) as client:
        assert not client.write_coil(2000, True, device_id=1).isError()
    digest = twin.end().rpartition("digest ")[2].strip()
    assert digest in run("replay", recording)


def test_worlds_and_programs_run_and_their_traces_are_exported(tmp_path: Path) -> None:
    trace = tmp_path / "trace.jsonl"
    run("run", ROOT / "examples/worlds/feeder.toml", "--for", "5s", "--trace", trace)
    run("export", trace, "--to", "html", "--to", "vcd")
    assert (tmp_path / "trace.html").stat().st_size > 10_000
    assert (tmp_path / "trace.vcd").stat().st_size > 1000
    feeder = ROOT / "examples/mic488/feeder.prg"
    assert "virtual time" in run("run", feeder, "--config", feeder.with_suffix(".cfg"), "--for", "2s")
    assert "virtual time" in run("run", ROOT / "examples/m1486/example2.m1486")
    run("check", feeder)


def test_the_command_explains_itself() -> None:
    assert "serve" in run("--help")
    assert "M1_POS_ACT" in run("registers", "mic488")


def test_text_goes_to_pipes_whose_encoding_lacks_characters() -> None:
    """As pipes on Windows do."""
    printed = run("registers", "mic488", PYTHONIOENCODING="cp1252")
    assert "M1_POS_ACT" in printed
    run("registers", "mic488", "--format", "md", PYTHONIOENCODING="ascii")


def test_what_a_system_lacks_is_said_with_a_way_round(tmp_path: Path) -> None:
    refusal = "they exist on Linux and macOS only; use TCP, RTU over TCP or a network serial port (RFC 2217)"
    assert refusal in run("serve", "mic488", "--pty", tmp_path / "line", code=2)
    world = tmp_path / "machine.toml"
    world.write_text('[[line]]\nname = "bus"\npty = "line"\n[[mic488]]\nname = "table"\nline = "bus"\n', "utf-8")
    assert refusal in run("up", world, code=2)
