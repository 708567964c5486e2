"""The commands for devices against a served M1486, as people type them."""

from __future__ import annotations

import json
import socket
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tests.conftest import STEPTWIN, until

from steptwin.controller import MILLISECOND
from steptwin.drivers.address import parse_device
from steptwin.drivers.m1486 import unit
from steptwin.errors import Misuse

PROGRAM = "[\n@1\nf640\nr\nw100\nd\nr\nj1\n]\n"


def test_an_address_says_what_kind_of_device_is_meant() -> None:
    address = parse_device("/dev/ttyUSB0,chip=b,variant=E1")
    assert (address.kind, address.number, address.variant, address.baud, address.timeout) == ("m1486", 11, "E1", 4800, 0.5)
    assert parse_device("tcp://h:1,kind=m1486,baud=300").baud == 300
    assert parse_device("tcp://h:1").kind == "mic488"
    for text in ("h,kind=plc", "h,kind=mic488,chip=3", "h,chip=3,unit=2", "h,chip=x"):
        with pytest.raises(Misuse):
            parse_device(text)


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Chips of these tests answer at once or not at all, so what is typed again need not wait for a noisy line."""
    monkeypatch.setattr(unit, "PAUSES_NS", (0, 40 * MILLISECOND, 100 * MILLISECOND))


def test_a_chip_from_the_command_line(serve_m1486: Callable[..., Any], tmp_path: Path) -> None:
    twin = serve_m1486("--variant", "B", "--chain", "0,7")
    device = f"{twin.pty},chip=7"

    def run(*arguments: str, code: int = 0, place: str = device) -> str:
        done = twin.command(*arguments, "--device", place)
        assert done.returncode == code, done.stderr
        return done.stdout or done.stderr

    assert run("info").startswith(
        f"M1486B, chip 7 at {twin.pty}\nposition 0 step (0 min. microsteps)\nnot read, because questions overwrite"
    )
    run("set", "V=2000", "A=50000", "VARIABLE=77", "FLAG83=on", "B6=off", "F52=off", "POSITION=10")
    values = json.loads(run("get", "position", "variable", "flags", "functions", "--json"))
    assert [values[name]["value"] for name in ("POSITION", "VARIABLE", "FLAGS")] == [10.0, 77, "83"]
    assert "52" not in values["FUNCTIONS"]["value"]
    assert run("move", "1=40").startswith("chip 7: came to rest at 40 step (target 40 step; its duration is not known")
    assert "'7' is not an axis: permitted are 1, or M1" in run("move", "7=40", code=2)
    assert "'2' is not an axis: permitted are 1, or M1" in run("move", "1=40", "2=3", code=2)
    assert "a time to wait of -1 s is outside" in run("move", "1=40", "--timeout", "-1", code=2)
    assert run("watch", "position", "--count", "1").splitlines()[1].split()[1] == "40"
    assert "is not a value of an M1486: permitted are POSITION" in run("get", "M1_POS_ACT", code=2)
    assert "an M1486 has no enable" in run("enable", "1", code=2)
    assert "V = 30000: M1486B takes 16 to 20 000 step/s" in run("set", "V=30000", code=2)

    program = tmp_path / "toandfro.m1486"
    program.write_text(PROGRAM)
    assert run("send", str(program)) == (
        f"{program} is in the M1486B and was started by its ]: the motor may move; 'steptwin stop --program' ends it\n"
    )
    assert "does not answer yet" in run("info", code=1, place=f"{device},variant=B,timeout=0.2")
    run("stop", "--program")
    assert run("get", "counter").startswith("COUNTER")
    program.write_text("v99999\n")
    assert "error M110: V 99 999 is out of range" in run("send", str(program), code=2)


def test_homing_seeking_and_jogging(serve_m1486: Callable[..., Any]) -> None:
    twin = serve_m1486("--variant", "B")

    def run(*arguments: str, code: int = 0) -> str:
        done = twin.command(*arguments, "--device", "m1486")
        assert done.returncode == code, done.stderr
        return done.stdout or done.stderr

    run("move", "1=40")
    late = twin.command("home", "1=-B3", "--timeout", "0.5", "--device", "m1486")
    assert (late.returncode, late.stderr) == (1, "stopped: timeout\n")
    run("pin", "B3=0")
    assert run("seek", "1=+B3").startswith("chip F: line reached at ")
    assert run("home", "1=-B3") == "chip F: line reached at 0 step\n"
    assert run("get", "POSITION") == "POSITION  0  step\n"
    jogged = json.loads(run("jog", "1=200", "--seconds", "0.5", "--json"))
    assert jogged["ok"]
    assert 20 <= jogged["position"] <= 100
    assert run("get", "POSITION").split()[1] == f"{jogged['position']:g}"
    for arguments, message in (
        (("home", "1=-B3", "--no-wait"), "--no-wait is not possible for an M1486: the command sets"),
        (("home", "1=-20"), "expected the direction and the line of an M1486, such as 1=-B8 or 1=+B8"),
        (("home", "1=B3"), "expected the direction and the line of an M1486, such as 1=-B8 or 1=+B8"),
        (("home", "2=-B3"), "an M1486 has one axis: expected 1=-B8"),
        (("seek", "1=+B22"), "the line to seek = 22: M1486B takes 1 to 21"),
        (("jog", "1=5", "--seconds", "1"), "velocity = 5: M1486B takes 16 to 20 000 step/s"),
        (("jog", "1=50", "--seconds", "1", "--hold", "9"), "--hold 9: permitted are 0.2 to 2 s"),
    ):
        assert message in run(*arguments, code=2)


def test_a_jog_that_is_killed_ends_by_itself_and_the_position_is_right(serve_m1486: Callable[..., Any]) -> None:
    twin = serve_m1486("--variant", "B")
    arguments = [STEPTWIN, "jog", "1=100", "--seconds", "600", "-d", f"tcp://127.0.0.1:{twin.tcp_port},kind=m1486"]
    with subprocess.Popen(arguments, stderr=subprocess.DEVNULL) as command:
        until(lambda: twin.state()["axes"][0]["position"] > 0, "the motor has moved")
        command.kill()
    until(lambda: twin.state()["axes"][0]["status"]["text"] == "at rest", "the move has ended")
    state = twin.state()
    assert state["details"]["counter_valid"]
    assert state["details"]["counter"] == state["axes"][0]["position"]


def test_seek_is_no_command_of_a_mic488(serve: Callable[..., Any]) -> None:
    refused = serve("--demo").command("seek", "1=-B3")
    assert (refused.returncode, refused.stderr) == (2, "steptwin: a MIC488 has no seek\n")


def test_a_program_for_several_chips(serve_m1486: Callable[..., Any], tmp_path: Path) -> None:
    """The file says who gets what; only what stands before its first X needs a chip in the address."""
    twin = serve_m1486("--variant", "B", "--chain", "0,7")
    program = tmp_path / "both.m1486"

    def sent(text: str, address: str) -> tuple[int, str]:
        program.write_text(text)
        done = twin.command("send", str(program), "-d", f"{twin.pty},{address}")
        return done.returncode, done.stdout or done.stderr

    started = " and was started by its ]: the motor may move; 'steptwin stop --program' ends it"
    assert sent("x0\n[\nf640\nr\n]\nx7\n[\nb64\nr\n]\n", "kind=m1486") == (
        0,
        f"{program} is in chips 0, 7 (M1486B){started}\n",
    )
    assert sent("f64\nr\nx0\nr\n", "chip=7")[0] == 0
    code, told = sent("f64\nr\nx0\nr\n", "kind=m1486")
    assert (code, "the commands before its first X need a chip" in told) == (2, True)
    counters = [twin.command("get", "counter", "-d", f"{twin.pty},chip={chip}").stdout for chip in "07"]
    assert [counter.split()[1] for counter in counters] == ["1280", "0"]
    code, told = sent("x3\nr\n", "kind=m1486,timeout=0.2")
    assert (code, "chip 3 does not echo" in told) == (1, True)
    assert sent("xg\nr\n", "kind=m1486")[0] == 2


def test_scanning(serve_m1486: Callable[..., Any], serve: Callable[..., Any]) -> None:
    """Both kinds of device, and a server of Modbus TCP, which hangs up when it hears characters."""
    chips, controller = serve_m1486("--variant", "B", "--chain", "1,B"), serve("--demo")
    places = [str(chips.pty), f"tcp://127.0.0.1:{chips.tcp_port}", f"tcp://127.0.0.1:{controller.tcp_port}"]

    def scan(*arguments: str) -> subprocess.CompletedProcess[str]:
        return chips.command("scan", *arguments)

    found = json.loads(scan(*places, "--units", "1", "--baud", "2400,4800", "--json").stdout)
    assert [(f["address"], f["baud"], f["kind"], f.get("chip"), f.get("variant"), f.get("unit")) for f in found] == [
        (places[0], 2400, "m1486", 1, "B", None),
        (places[0], 2400, "m1486", 11, "B", None),
        (places[1], None, "m1486", 1, "B", None),
        (places[1], None, "m1486", 11, "B", None),
        (places[2], None, "mic488", None, None, 1),
    ]
    assert scan(places[0]).stdout.splitlines()[1] == f"{places[0]}  4800  chip B  M1486B"
    alone = scan(str(controller.pty), "--kind", "m1486")
    assert (alone.returncode, alone.stderr) == (1, f"no device responded on {controller.pty}\n")
    assert scan(places[2], "--kind", "mic488", "--units", "1").returncode == 0


def test_info_without_a_kind_leaves_nothing_in_front_of_the_next_command(serve_m1486: Callable[..., Any]) -> None:
    twin = serve_m1486("--variant", "B")
    place = f"tcp://127.0.0.1:{twin.tcp_port}"
    for address in (place, f"rtu-{place}"):
        run = twin.command("info", "-d", f"{address},kind=mic488")
        assert run.returncode == 1
        assert "If it is an M1486, put ',kind=m1486' behind the address" in run.stderr
        with socket.create_connection(("127.0.0.1", twin.tcp_port)) as line:
            line.sendall(b"u20\r")
            line.settimeout(60.0)
            assert line.recv(1) == b"B"


def test_a_terminal_on_a_pipe(serve_m1486: Callable[..., Any]) -> None:
    """As the manual has the commands, for whichever chip; a script ends with the first thing that goes wrong."""
    twin = serve_m1486("--variant", "B", "--chain", "0,7")

    def terminal(script: str, device: str) -> tuple[int, list[str], str]:
        done = twin.command("terminal", "-d", device, script=script)
        return done.returncode, done.stdout.splitlines(), done.stderr

    position = "32H  U2 position, middle byte: 50"
    script = "v2000 ; fast\nf12800\nr\nu2\nx0\nu2\nt41\nu17\nt57\nu15\nwait\nquit\nr\n"
    for place in (str(twin.pty), f"tcp://127.0.0.1:{twin.tcp_port}"):
        code, lines, errors = terminal(script, f"{place},chip=7")
        assert (code, errors) == (0, "")
        assert lines == [
            position,
            "00H  U2 position, middle byte: 0",
            "02H  U17 functions 40 to 47: ON 41",
            "7FH  the input buffer is empty",
            "02H  U15 driver interface: Step & Direction",
            "7FH  the input buffer is empty",
            "42H  U20 type letter in ASCII: M1486B",
        ]
        position = "64H  U2 position, middle byte: 100"
        terminal("c57\nc41\n", f"{place},chip=0")
    code, lines, errors = terminal("v99999\nr\n", f"{twin.pty},kind=m1486")
    assert (code, lines, "V99999 is out of range" in errors) == (2, [], True)
    code, lines, errors = terminal("m1\ng+\nr\nf6400000\nf6400000\nf6400000\nf6400000\n", f"{twin.pty},chip=7")
    assert (code, "5EH  no room in the input buffer: a character is lost" in lines) == (1, True)
    assert "'wait' before it waits for that" in errors
    assert terminal("k\n", f"{twin.pty},chip=7")[0] == 0
    assert twin.command("stop", "-d", f"{twin.pty},chip=7").returncode == 0
