"""The commands for devices, against a served twin, as people type them."""

from __future__ import annotations

import json
import os
import pty
import signal
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from shell import Shell
from tests.conftest import STEPTWIN

from steptwin.cli.device import SuspensionDetector, format_value, print_started, table
from steptwin.drivers import Mic488
from steptwin.errors import Refusal
from steptwin.live.ports import FoundPort
from steptwin.mic488.registers import register_map


@given(st.floats(width=32, allow_nan=False))
@example(0.1)
def test_a_real_is_shown_with_the_digits_it_has(value: float) -> None:
    real = struct.unpack("<f", struct.pack("<f", value))[0]
    assert struct.pack("<f", float(format_value(real))) == struct.pack("<f", real) or abs(real) < 1e-37


def test_a_real_is_shown_as_people_write_it() -> None:
    reals = [struct.unpack("<f", struct.pack("<f", value))[0] for value in (10.13, 0.1, -9.999999, 100.0, 123456.79)]
    assert [format_value(real) for real in reals] == ["10.13", "0.1", "-9.999999", "100", "123456.79"]


def test_somebody_at_a_terminal_is_told_that_it_moves(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    print_started(["M1"])
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    print_started(["M1", "M3"])
    assert capsys.readouterr() == ("", "M1, M3 under way; Ctrl-C stops\n")


@pytest.fixture
def twin(serve: Callable[..., Any], shell: Shell, monkeypatch: pytest.MonkeyPatch) -> Any:
    twin = serve("--demo")
    monkeypatch.setenv("STEPTWIN_DEVICE", f"tcp://127.0.0.1:{twin.tcp_port},timeout=60")
    return twin


def test_a_session(twin: Any, shell: Shell) -> None:
    assert shell("enable", "1", "M2") == ""
    assert shell("set", "M1_ACC=2000", "M1_DEC=2000", "out3=on", "DATA_TYPE=real").splitlines() == [
        "M1_ACC     2000  u/s²",
        "M1_DEC     2000  u/s²",
        "out3         ON",
        "DATA_TYPE     0  REAL",
    ]
    assert shell("move", "1=3", "--velocity", "200") == "M1: target reached at 3 u\n"
    assert shell("move", "M1=-1", "2=0.5", "--by").splitlines()[0] == "M1: target reached at 2 u"
    assert shell("move", "1=-100") == "M1: stopped at limit L at -10 u\n"
    assert shell.code == 1
    assert json.loads(shell("home", "1=-50", "--json"))[0]["reason"] == "target reached"
    assert "released at" in shell("jog", "2=5", "--seconds", "0.2")
    jogged = json.loads(shell("jog", "2=-5", "--seconds", "0.5", "--json"))
    assert jogged["reason"] == "released"
    assert jogged["after_s"] >= 0.5
    assert shell.code == 0
    assert shell("get", "M1_POS_ACT", "OUT3", "M1_STATUS").splitlines() == [
        "M1_POS_ACT   0  u",
        "OUT3        ON",
        "M1_STATUS    4  position reached",
    ]
    assert shell("stop") == shell("disable") == ""
    lines = shell("info").splitlines()
    assert lines[0].startswith("MIC488, unit 1 at tcp://127.0.0.1:")
    assert lines[-1] == "outputs on: OUT3"
    data = json.loads(shell("info", "--json"))
    assert (data["firmware"], data["program"], data["axes"][0]["meaning"], data["outputs"][2]) == ("1.70", "stopped", "off", True)


def test_a_command_that_was_suspended_before_a_motion_does_not_move(monkeypatch: pytest.MonkeyPatch) -> None:
    time = [0.0]
    monkeypatch.setattr("steptwin.cli.device.time.monotonic", lambda: time[0])
    held_up = SuspensionDetector()
    for _ in range(3):
        time[0] += 15.0
        held_up.check()
    time[0] += 3600.0
    with pytest.raises(Refusal, match="not moved: the command was suspended, or delayed by the line, for 3600 s; repeat it"):
        held_up.check()


def test_reading(twin: Any, shell: Shell) -> None:
    assert shell("get", "USER_REGISTER[0-2]", "USER_REGISTER[10-13]:real").count("\n") == 5
    assert json.loads(shell("get", "m1_acc", "M1_STATUS", "--json")) == {
        "m1_acc": {"value": 50.0, "unit": "u/s²"},
        "M1_STATUS": {"value": 0, "meaning": "off"},
    }
    looks = shell("watch", "M1_ACC", "OUT1", "--count", "2", "--hz", "50").splitlines()
    assert looks[0] == "    time_s  M1_ACC u/s²        OUT1"
    assert [look[10:] for look in looks[1:]] == ["           50         OFF"] * 2
    assert [json.loads(line)["M4_STATUS"] for line in shell("watch", "--json", "--count", "2").splitlines()] == [0, 0]
    shell("set", "M1_ACC=10.11")
    assert shell("get", "M1_ACC") == "M1_ACC  10.11  u/s²\n"
    assert shell("watch", "M1_ACC", "--count", "1").splitlines()[1].split()[1] == "10.11"
    assert json.loads(shell("watch", "M1_ACC", "--json", "--count", "1"))["M1_ACC"] == 10.11
    assert json.loads(shell("get", "M1_ACC", "--json"))["M1_ACC"]["value"] == 10.11
    shell("set", "M1_ACC=50")
    address = str(register_map("1.70").of("ACC", 1).address)
    words = f"hr:{address}-{int(address) + 1}:hex"
    coil = f"co:{register_map('1.70').of('OUT', 2).address}"
    assert [line.split() for line in shell("get", address, f"hr:{address}:real", words, coil, "di:5000").splitlines()] == [
        ["M1_ACC", "50", "u/s²"],
        [f"hr:{address}:real", "50"],
        [f"hr:{address}:hex", "0000h"],
        [f"hr:{int(address) + 1}:hex", "4248h"],
        [coil, "OFF"],
        ["di:5000", "OFF"],
    ]
    assert "exception 02" in shell("get", "hr:60000") + shell.errors
    assert shell.code == 1
    shell("get", "M1_ACC", "--log-frames")
    assert "unit 1: read M1_ACC = 50 u/s²" in shell.errors


MISTAKES: list[tuple[list[str], int, str]] = [
    (["get", "M1_POS_AKT"], 2, "did you mean M1_POS_ACT"),
    (["get", "10021"], 2, "is the second word of"),
    (["get", "9999"], 2, "hr:9999 reads it all the same"),
    (["get", "hr:10020:float"], 2, "expected ADDRESS"),
    (["get", "X*"], 2, "'X*' matches no register"),
    (["set", "M1_ACC"], 2, "expected NAME=VALUE"),
    (["set", "M1_ACC=much"], 2, "'much' is not a number"),
    (["set", "IN3=1"], 2, "IN3 can only be read"),
    (["move", "5=1"], 2, "'5' is not an axis"),
    (["move", "1=1", "M1=2"], 2, "M1 is given twice"),
    (["move", "1"], 2, "expected AXIS=NUMBER"),
    (["move", "1=5"], 1, "M1 of unit 1 is switched off: enable it first"),
    (["jog", "1=5"], 2, "no terminal, so no key can end the jog"),
    (["jog", "1=5", "--seconds", "-1"], 2, "--seconds -1: permitted are more than 0"),
    (["jog", "1=5", "--seconds", "nan"], 2, "--seconds: 'nan' is not a number"),
    (["move", "1=5", "--timeout", "-1"], 2, "a time to wait of -1 s is outside 0 to 1000000 s"),
    (["home", "1=5", "--timeout", "nan"], 2, "--timeout: 'nan' is not a number"),
    (["watch", "--hz", "0"], 2, "--hz 0: permitted are more than 0"),
    (["watch", "--count", "0"], 2, "--count 0: permitted"),
]


def test_what_is_told_of_mistakes(twin: Any, shell: Shell) -> None:
    for arguments, code, text in MISTAKES:
        shell(*arguments)
        assert text in shell.errors
        assert shell.code == code


def test_who_does_not_answer(twin: Any, shell: Shell, monkeypatch: pytest.MonkeyPatch) -> None:
    shell("info", "--device", f"tcp://127.0.0.1:{twin.tcp_port},unit=9")
    assert "gateway target failed to respond" in shell.errors
    shell("info", "--device", f"rtu-tcp://127.0.0.1:{twin.rtu_tcp_port},unit=9,timeout=0.01")
    assert "no answer to 'unit 9: read the control registers of firmware" in shell.errors
    assert "If it is an M1486, put ',kind=m1486' behind the address" in shell.errors
    monkeypatch.delenv("STEPTWIN_DEVICE")
    monkeypatch.setattr("steptwin.live.twins.running", list)
    shell("info")
    assert (shell.code, "no twin is running: start one with 'steptwin serve mic488 --demo'" in shell.errors) == (1, True)


def test_an_interrupted_command_stops_the_axis(twin: Any) -> None:
    place = f"tcp://127.0.0.1:{twin.tcp_port}"
    with Mic488(place, timeout_s=5.0) as mic:
        mic.enable(1)
        for number in (signal.SIGINT, signal.SIGTERM):
            with subprocess.Popen([STEPTWIN, "move", "1=200", "-d", place], stderr=subprocess.PIPE, text=True) as command:
                while mic.axis(1).status() != 3:
                    assert command.poll() is None
                command.send_signal(number)
                assert command.stderr is not None
                assert "stopped: M1" in command.stderr.read()
            assert command.returncode == 130
            assert mic.axis(1).status() == 1
        check_that_a_key_ends_a_jog(place)


def check_that_a_key_ends_a_jog(place: str) -> None:
    master, slave = pty.openpty()
    arguments = [STEPTWIN, "jog", "1=5", "--hold", "2", "-d", place]
    with subprocess.Popen(arguments, stdin=slave, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as command:
        assert command.stderr is not None
        assert command.stdout is not None
        assert command.stderr.readline() == "M1 runs at 5 u/s; any key stops it\n"
        os.write(master, b" ")
        assert command.stdout.read().startswith("M1: released at ")
    assert command.returncode == 0
    os.close(master)
    os.close(slave)


# ---------------------------------------------------------------------- without a device


def test_tables() -> None:
    assert table([("a", "1", "mm"), ("bb", "-12.5", "")], ("name", "value", "unit")) == (
        "name  value  unit\na         1  mm\nbb    -12.5"
    )
    assert table([]) == ""


# ---------------------------------------------------------------------- looking for devices, sessions


def test_scanning(twin: Any, shell: Shell) -> None:
    pty_path, tcp = str(twin.pty), f"tcp://127.0.0.1:{twin.tcp_port}"
    found = json.loads(shell("scan", pty_path, tcp, "--units", "1-2", "--baud", "9600,38400", "--json"))
    assert [(f["address"], f["baud"], f["unit"], f["firmware"]) for f in found] == [
        (pty_path, 9600, 1, "1.70"),
        (tcp, None, 1, "1.70"),
    ]
    assert shell("scan", tcp.removeprefix("tcp://"), "--units", "1").split() == [tcp, "unit", "1", "MIC488,", "firmware", "1.70"]
    shell("scan", tcp, "--units", "2,3")
    assert (shell.code, shell.errors) == (1, f"no device responded on {tcp}\n")
    shell("scan", "/dev/none")
    assert (shell.code, "cannot open serial port /dev/none" in shell.errors) == (1, True)
    for units in ("0", "5-2", "x", "1-300"):
        shell("scan", tcp, "--units", units)
        assert (shell.code, f"--units {units}" in shell.errors) == (2, True)


def test_ports(shell: Shell, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("steptwin.live.ports.serial_ports", lambda: [FoundPort("/dev/ttyUSB7", "FTDI (0403:6001)")])
    monkeypatch.setattr("steptwin.live.ports.twin_ports", lambda: [FoundPort("/run/mic488", "twin mic488")])
    assert shell("ports").splitlines() == ["/dev/ttyUSB7  FTDI (0403:6001)", "/run/mic488   twin mic488"]
    assert json.loads(shell("ports", "--json"))[0] == {"address": "/dev/ttyUSB7", "what": "FTDI (0403:6001)"}


def test_the_ports_of_twins_are_listed_wherever_they_lie(serve: Callable[..., Any], tmp_path: Path) -> None:
    twin, other = serve(), serve("--name", "other", "--pty", str(tmp_path / "line"))
    listed = [json.loads(each.command("ports", "--json").stdout)[-1] for each in (twin, other)]
    assert listed == [
        {"address": str(twin.pty), "what": "twin mic488, Modbus RTU"},
        {"address": str(tmp_path / "line"), "what": "twin other, Modbus RTU"},
    ]


def test_the_ports_of_this_system_can_be_listed(shell: Shell) -> None:
    shell("ports", "--json")
    assert shell.code == 0


def test_a_terminal_on_a_pipe(twin: Any) -> None:
    lines = "M1_EN = on\nM1_ACC=1000  # fast\nM1_POS_ABS=2\nwait 1\n\nM1_POS_ACT OUT1\nraw 03 27 24 00 02\nhelp\nstop\nquit\nM9\n"
    place = f"tcp://127.0.0.1:{twin.tcp_port},timeout=60"
    run = subprocess.run([STEPTWIN, "terminal", "-d", place], input=lines, capture_output=True, text=True, check=False)
    assert run.stdout.splitlines()[:4] == ["M1: target reached, 2", "M1_POS_ACT = 2 u", "OUT1 = OFF", "answer: 03 04 00 00 40 00"]
    assert (run.stderr, run.returncode) == ("", 0)
    run = subprocess.run([STEPTWIN, "terminal", "-d", place], input="M9\nM1_ACC\n", capture_output=True, text=True, check=False)
    assert (run.stdout, run.returncode, "named 'M9'" in run.stderr) == ("", 2, True)


def test_recording_and_comparing(twin: Any, shell: Shell, tmp_path: Path) -> None:
    session, one, two = tmp_path / "s.txt", str(tmp_path / "one.jsonl"), str(tmp_path / "two.jsonl")
    session.write_text("set M1_EN=1\nset M1_ACC=1000\nset M1_POS_ABS=1\nwait 1\nget M2_ACC\n")
    shell("record", str(session), "-o", one)
    shell("set", "M2_ACC=7")
    Path(two).write_text(shell("record", str(session)))
    assert shell("diff", one, two) == "step 5, get M2_ACC: M2_ACC: 50.0 | 7.0\n"
    assert shell.code == 1
    assert shell("diff", one, two, "--tolerance", "50") == ""
    assert shell.code == 0
    assert json.loads(shell("diff", one, two, "--json")) == [
        {"step": 5, "line": "get M2_ACC", "what": "M2_ACC", "one": 50.0, "two": 7.0}
    ]
    session.write_text("set M1_VEL_ABS=5\nwait 1\n")
    shell("record", str(session))
    assert (shell.code, "all axes were stopped" in shell.errors) == (1, True)
    assert shell("get", "M1_VEL_ACT").split()[1] == "0"
    shell("set", "M1_VEL_ABS=5", "M2_EN=on")
    kept = Path(one).read_text()
    session.write_text("get M1_ACC\nset M1_ACC=abc\n")
    shell("record", str(session), "-o", one)
    assert (shell.code, shell.errors) == (2, f"steptwin: {session}: line 2: 'set M1_ACC=abc': 'abc' is not a number\n")
    shell("set", "M1_STOP=on", "M2_ACC=-1")
    assert (shell.code, "M2_ACC = -1 u/s²: permitted > 0" in shell.errors) == (2, True)
    assert shell("get", "M1_VEL_ACT").split()[1] == "5"
    assert Path(one).read_text() == kept
    shell("diff", one, str(tmp_path / "none"))
    assert (shell.code, "cannot read" in shell.errors) == (2, True)


def test_what_cannot_be_downloaded(shell: Shell, tmp_path: Path) -> None:
    program = tmp_path / "machine.prg"
    program.write_text("EOP\n")
    shell("send", str(program))
    assert shell.code == 1
    assert "protocol of the MIC488 is not documented" in shell.errors
    assert "steptwin build" in shell.errors
