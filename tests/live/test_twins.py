"""Which device is meant by a name, a file or an address, with what twins announce made up here."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from steptwin.drivers.kind import DeviceAddress
from steptwin.errors import LineFailure, Misuse
from steptwin.live import twins
from steptwin.live.twins import find_controller, find_device, running_twins

MACHINE = {
    "name": "machine",
    "pid": 7,
    "file": "/plant/machine.toml",
    "controllers": [
        {"name": "table", "kind": "mic488", "line": "bus", "unit": 1, "firmware": "1.70", "axes": []},
        {
            "name": "drum",
            "kind": "mic488",
            "line": "bus",
            "unit": 2,
            "firmware": "1.40",
            "axes": [{"unit": "mm", "pulses_per_unit": 200.0}],
        },
        {"name": "left", "kind": "m1486", "line": "chips", "chip": "7", "variant": "E1", "axes": []},
        {"name": "right", "kind": "m1486", "line": "chips", "chip": "A", "variant": "E1", "axes": []},
        {"name": "alone", "kind": "mic488", "line": None, "axes": []},
    ],
    "end_points": [
        {"kind": "pty", "protocol": "Modbus RTU, bus", "line": "bus", "path": "/run/bus"},
        {"kind": "vision", "protocol": "vision records", "line": None, "host": "127.0.0.1", "port": 6001},
        {"kind": "tcp", "protocol": "Modbus TCP, bus", "line": "bus", "host": "0.0.0.0", "port": 6000},
        {"kind": "rfc2217", "protocol": "network port, chips", "line": "chips", "host": "::1", "port": 6002},
    ],
}
DEMO = {
    "name": "mic488",
    "pid": 8,
    "file": None,
    "controllers": [{"name": "mic488", "kind": "mic488", "line": "modbus", "unit": 3, "firmware": "1.70", "axes": []}],
    "end_points": [
        {"kind": "rtu-tcp", "protocol": "RTU over TCP", "line": "modbus", "host": "127.0.0.1", "port": 5021},
        {"kind": "tcp", "protocol": "Modbus TCP", "line": "modbus", "host": "127.0.0.1", "port": 5020},
    ],
}
CABLE = {
    "name": "cable",
    "pid": 9,
    "file": None,
    "controllers": [{"name": "cable", "kind": "m1486", "line": "m1486", "chip": "F", "variant": "A", "axes": []}],
    "end_points": [{"kind": "serial", "protocol": "M1486 line", "line": "m1486", "device": "/dev/ttyUSB0", "baud": 9600}],
}


@pytest.fixture(autouse=True)
def run(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The twins that run in a test; none at first. Asking one that is suspended fails."""

    def set_running(*announced: Mapping[str, Any], suspended: tuple[str, ...] = ()) -> None:
        known = {each["name"]: each for each in announced}

        def ask(name: str, request: object, *, timeout_s: float) -> object:
            if name in suspended:
                raise LineFailure("suspended")
            return known[name]

        monkeypatch.setattr(twins, "running", lambda: [*known])
        monkeypatch.setattr(twins, "ask", ask)

    set_running()
    return set_running


def test_what_twins_announce(run: Any) -> None:
    run(MACHINE, DEMO, suspended=("mic488",))
    (machine,) = running_twins()
    assert (machine.name, machine.pid, machine.file) == ("machine", 7, Path("/plant/machine.toml"))
    assert machine.places == {"tcp://127.0.0.1:6000": "bus", "rfc2217://[::1]:6002": "chips", "/run/bus": "bus"}
    assert [(each.full_name, each.selection, each.places) for each in machine.controllers] == [
        ("machine.table", "unit=1", ("tcp://127.0.0.1:6000", "/run/bus")),
        ("machine.drum", "unit=2", ("tcp://127.0.0.1:6000", "/run/bus")),
        ("machine.left", "chip=7", ("rfc2217://[::1]:6002",)),
        ("machine.right", "chip=A", ("rfc2217://[::1]:6002",)),
        ("machine.alone", "", ()),
    ]


def mic488(place: str, unit: int = 1, firmware: str | None = None) -> DeviceAddress:
    return DeviceAddress(place, "mic488", unit, 38400, 0.3, firmware)


def m1486(place: str, chip: int | None = None, variant: str | None = None) -> DeviceAddress:
    return DeviceAddress(place, "m1486", chip, 4800, 0.5, variant)


DRUM = replace(mic488("tcp://127.0.0.1:6000", 2, "1.40"), scales=(("mm", 200.0),))
DEMO_AT = mic488("tcp://127.0.0.1:5020", 3, "1.70")
RIGHT = m1486("rfc2217://[::1]:6002", 10, "E1")


@pytest.mark.parametrize(
    ("text", "device", "controller"),
    [
        ("mic488", DEMO_AT, ("mic488", None)),
        ("mic488,timeout=2", replace(DEMO_AT, timeout=2.0), ("mic488", "mic488")),
        ("machine.drum", DRUM, ("machine", "drum")),
        ("machine.DRUM", DRUM, ("machine", "drum")),
        ("machine,unit=2", DRUM, ("machine", "drum")),
        ("/plant/machine.toml,unit=2", DRUM, ("machine", "drum")),
        ("127.0.0.1:6000,unit=2,firmware=1.40", DRUM, ("machine", "drum")),
        ("machine.right", RIGHT, ("machine", "right")),
        ("machine,chip=a", RIGHT, ("machine", "right")),
        ("127.0.0.1:5021,unit=3", mic488("rtu-tcp://127.0.0.1:5021", 3), ("mic488", "mic488")),
        ("localhost:5020", mic488("tcp://127.0.0.1:5020"), ("mic488", None)),
        ("tcp://localhost:5020", mic488("tcp://127.0.0.1:5020"), ("mic488", None)),
    ],
)
def test_a_running_twin_is_found(run: Any, text: str, device: DeviceAddress, controller: tuple[str, str | None]) -> None:
    run(MACHINE, DEMO)
    assert find_device(text) == device
    assert find_controller(text) == controller


def test_the_only_twin_needs_no_name(run: Any) -> None:
    run(DEMO)
    assert find_device(None) == DEMO_AT
    assert find_controller(None) == ("mic488", None)


def test_a_whole_line_of_chips(run: Any) -> None:
    run(MACHINE)
    assert find_device("machine,kind=m1486", whole_line=True) == m1486("rfc2217://[::1]:6002", None, "E1")
    with pytest.raises(Misuse, match=r"machine has several controllers: .* machine\.left \(m1486 chip=7\), machine\.right"):
        find_device("machine,kind=m1486")


def test_the_pty_of_a_twin_says_what_is_there(run: Any, tmp_path: Path) -> None:
    line, link = os.openpty(), tmp_path / "line"
    link.symlink_to(os.ttyname(line[1]))
    run({**CABLE, "end_points": [{"kind": "pty", "protocol": "M1486 line", "line": "m1486", "path": str(link)}]})
    for place in (str(link), os.ttyname(line[1])):
        assert find_device(place) == m1486(place)
        assert find_device(f"{place},kind=mic488").kind == "mic488"
    for number in line:
        os.close(number)


@pytest.mark.parametrize("text", ["/dev/ttyUSB0", "COM3", "./line", "tcp://192.168.0.7:502", "rfc2217://gateway:4000"])
def test_addresses_of_devices_pass_as_they_are(run: Any, text: str) -> None:
    """No twin is asked: one that is suspended would delay a stop."""
    run(DEMO, suspended=("mic488",))
    assert find_device(f"{text},unit=2") == mic488(text, 2)


def test_a_host_and_a_port_are_modbus_tcp() -> None:
    assert find_device("192.168.0.7:502").place == "tcp://192.168.0.7:502"


def test_a_file_with_the_name_of_no_twin_is_a_port(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "line").touch()
    assert find_device("line").place == "line"


@pytest.mark.parametrize(
    ("text", "error", "message"),
    [
        (None, Misuse, "several twins are running: name one with --device \\(-d\\): machine, mic488, cable"),
        (
            "machine",
            Misuse,
            "machine has several controllers: .* machine.table \\(mic488 unit=1\\), .*machine.alone \\(mic488\\)",
        ),
        ("machine.lid", Misuse, "machine has no controller 'lid': there are table, drum, left, right, alone"),
        ("mic488,unit=4", Misuse, "no controller fits its options: there are mic488 \\(mic488 unit=3\\)"),
        ("machine.alone", LineFailure, "machine.alone is on no line .*: its description gives it no line"),
        ("cable", LineFailure, "line 'm1486' has no pty and no network address; name a serial port at the other end"),
        ("mic489", LineFailure, "no twin named 'mic489' is running: running twins are machine, mic488, cable; a serial port"),
        ("other.toml", LineFailure, "no running twin was started from other.toml: .* 'steptwin up other.toml' starts one"),
    ],
)
def test_what_is_not_found(run: Any, text: str | None, error: type[Exception], message: str) -> None:
    run(MACHINE, DEMO, CABLE)
    with pytest.raises(error, match=message):
        find_device(text)


def test_without_any_twin() -> None:
    with pytest.raises(LineFailure, match="no twin is running: start one with 'steptwin serve mic488 --demo'"):
        find_device(None)
    with pytest.raises(LineFailure, match="no twin named 'mic488' is running: no twin is running; start one"):
        find_device("mic488")


def test_a_device_is_no_twin(run: Any) -> None:
    run(DEMO)
    with pytest.raises(
        Misuse, match="/dev/ttyUSB0 is not a running twin, and this command is for twins: running twins are mic488"
    ):
        find_controller("/dev/ttyUSB0")
