"""`serve`, `up` with the description that it prints, and a world in this process answer alike: one suite for all three."""

from __future__ import annotations

import json
import os
import signal
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Generator
from functools import cached_property
from pathlib import Path
from typing import Any

import pytest

from steptwin.cli import main
from steptwin.controller import MILLISECOND, SECOND
from steptwin.errors import LineFailure, Misuse, Refusal, SteptwinError
from steptwin.files.world import World
from steptwin.live.remote import RemoteSubject, ask
from steptwin.live.world import LiveWorld, PlacePort
from steptwin.mic488.registermap import Space
from steptwin.mic488.registers import register_map
from steptwin.subject.commands import read_command

STEPTWIN = str(Path(sys.executable).with_name("steptwin"))
LIMIT_S = 60.0

SERVED = {
    "mic488": [
        *("--tcp", "127.0.0.1:0", "--rtu-tcp", "127.0.0.1:0", "--rfc2217", "127.0.0.1:0"),
        *("--gap", "5", "--pty", "pty", "--vision", "127.0.0.1:0"),
    ],
    "m1486": ["--tcp", "127.0.0.1:0", "--rfc2217", "127.0.0.1:0", "--pty", "pty"],
}


def family(error: SteptwinError) -> str:
    return next(family.__name__ for family in (Misuse, Refusal, LineFailure) if isinstance(error, family))


class Twin:
    """One way of making a twin, by the real command."""

    def __init__(self, kind: str, way: str, directory: Path) -> None:
        self.kind = kind
        self.directory = directory
        self.environment = {**os.environ, "XDG_RUNTIME_DIR": str(directory), "COLUMNS": "200", "TERM": "dumb"}
        self.environment.pop("STEPTWIN_DEVICE", None)
        served = ["serve", kind, *SERVED[kind]]
        printed = subprocess.run([STEPTWIN, *served, "--print-world"], capture_output=True, text=True, check=True, cwd=directory)
        (directory / "twin.toml").write_text(printed.stdout)
        begin = served if way == "serve" else ["up", "twin.toml"]
        ready = directory / "ready.json"
        self._out = (directory / "out").open("w")
        self.process = subprocess.Popen(
            [STEPTWIN, *begin, "--name", "twin", "--ready-file", str(ready)],
            cwd=directory,
            env=self.environment,
            stdout=self._out,
            stderr=subprocess.STDOUT,
        )
        deadline = time.monotonic() + LIMIT_S
        while not ready.exists():
            assert self.process.poll() is None, (directory / "out").read_text()
            assert time.monotonic() < deadline, f"{way} {kind} is not ready after {LIMIT_S} s"
            time.sleep(0.01)
        self.ready = json.loads(ready.read_text())
        self._sockets: dict[str, socket.socket] = {}

    def command(self, *arguments: str) -> object:
        """The exit code of a command of the shell, in this process."""
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("sys.argv", ["steptwin", *arguments])
            patch.delenv("STEPTWIN_DEVICE", raising=False)
            try:
                main()
            except SystemExit as end:
                return end.code or 0
        return 0

    def asked(self, **request: object) -> object:
        """The answer of the control endpoint, or the kind and text of its error."""
        try:
            return ask("twin", read_command(request.pop("do"), request))
        except SteptwinError as error:
            return family(error), str(error)

    @cached_property
    def controller(self) -> str:
        with RemoteSubject("twin") as subject:
            return subject.description.controllers[0].name

    def set(self, levels: dict[str, Any]) -> object:
        return self.asked(do="set", levels={f"{self.controller}.{pin}": level for pin, level in levels.items()})

    def pins(self) -> object:
        return self.asked(do="pins", controller=self.controller)

    def state(self) -> object:
        return self.asked(do="state", controller=self.controller)

    def connection(self, kind: str) -> socket.socket:
        if kind not in self._sockets:
            (point,) = (point for point in self.ready["end_points"] if point["kind"] == kind)
            self._sockets[kind] = socket.create_connection((point["host"], point["port"]), LIMIT_S)
        return self._sockets[kind]

    def pdu(self, pdu: str, unit: int = 1) -> str:
        """The answer to a Modbus TCP request, both in hexadecimal."""
        data, line = bytes.fromhex(pdu), self.connection("tcp")
        line.sendall(struct.pack(">HHHB", 7, 0, len(data) + 1, unit) + data)
        header = self._read(line, 6)
        return self._read(line, struct.unpack(">H", header[4:])[0]).hex(" ")

    def settled(self, pdu: str, expected: str) -> str:
        """The answer to a request that is repeated until it is as expected, or for too long."""
        deadline = time.monotonic() + LIMIT_S / 6
        while (answer := self.pdu(pdu)) != expected and time.monotonic() < deadline:
            time.sleep(0.005)
        return answer

    def characters(self, text: str, answers: int) -> str:
        """The answer of chips to characters."""
        line = self.connection("tcp")
        line.sendall(text.encode())
        return self._read(line, answers).hex(" ")

    @staticmethod
    def _read(line: socket.socket, number: int) -> bytes:
        data = b""
        while len(data) < number:
            part = line.recv(number - len(data))
            assert part, f"the connection ended after {data.hex(' ')}"
            data += part
        return data

    def end(self, number: signal.Signals) -> int:
        self.close()
        self.process.send_signal(number)
        return self.process.wait(LIMIT_S)

    def close(self) -> None:
        for line in self._sockets.values():
            line.close()
        self._out.close()


Probe = Callable[[Twin], object]


def without_time(state: object) -> object:
    return {name: value for name, value in state.items() if name != "time_s"} if isinstance(state, dict) else state


# ---------------------------------------------------------------------- MIC488


def all_registers(twin: Twin) -> object:
    """Each register as it is after power-on."""
    functions = {Space.COIL: 1, Space.INPUT: 2, Space.HOLDING: 3}
    return {
        register.name: twin.pdu(f"{functions[register.space]:02x}{register.address:04x}{min(register.span, 100):04x}")
        for register in register_map("1.70")
        if register.reads
    }


def refused(twin: Twin) -> object:
    """Holes, registers that cannot be written, wrong quantities, unknown functions."""
    asked = [
        "030fff0001",
        "062710ffff",
        "0327100000",
        "030000007e",
        "10271000010455667788",
        "07",
        "11",
        "2b0e0100",
        "41",
        "0517700001",
    ]
    return {pdu: twin.pdu(pdu) for pdu in asked}


def units(twin: Twin) -> object:
    return {unit: twin.pdu("0100000001", unit) for unit in (0, 1, 2, 255)}


def motion(twin: Twin) -> object:
    """Drive 1 on, VMAX 100000, ACC and DEC so that 400 pulses take a moment, then the position and the state."""
    told = [twin.pdu("0507d0ff00"), twin.pdu("1027640002040000 43c8".replace(" ", ""))]
    return told, twin.settled("03271a0001", "01 03 02 00 04"), twin.pdu("0327240002"), without_time(twin.state())


def rtu_over_tcp(twin: Twin) -> object:
    line = twin.connection("rtu-tcp")
    line.sendall(bytes.fromhex("01030000000a c5cd".replace(" ", "")))
    return twin._read(line, 5).hex(" ")


def network_port(twin: Twin) -> object:
    """The rate of the line, and another that the client sets."""
    line = twin.connection("rfc2217")
    line.sendall(bytes.fromhex("fffa2c0100000000fff0"))
    rate = twin._read(line, 10).hex(" ")
    line.sendall(bytes.fromhex("fffa2c0100002580fff0"))
    changed = twin._read(line, 10).hex(" ")
    return rate, changed


def network_requests(twin: Twin) -> object:
    line = twin.connection("rfc2217")
    line.sendall(bytes.fromhex("01 03 27 24 00 02 8e b4"))
    return twin._read(line, 9).hex(" ")


def vision_records(twin: Twin) -> object:
    """Nothing is answered to them, nor to what is no record."""
    line = twin.connection("vision")
    line.sendall(b"N1 X12.5 Y-3 A90\r\nnonsense\r\n")
    return without_time(twin.state())


def pins(twin: Twin) -> object:
    asked: list[dict[str, Any]] = [{}, {"IN1": 1}, {"in2": 1, "AIN1": 4.5}, {"IN99": 1}, {"IN1": 2}, {"AIN1": 11}, {"IN1": "x"}]
    told = [twin.set(changes) for changes in asked]
    return told, twin.pins(), twin.settled("0213880014", "01 02 03 03 00 00")  # both have passed their filters


def names_of_pins(twin: Twin) -> object:
    shown = twin.pins()
    assert isinstance(shown, dict)
    return list(shown)


def encoders(twin: Twin) -> object:
    turns = [twin.asked(do="turn", controller=twin.controller, axis=axis, counts=counts) for axis, counts in ((1, 40), (9, 1))]
    return turns, twin.asked(do="encoders", controller=twin.controller)


def coupling_of_encoders(twin: Twin) -> object:
    told = [twin.asked(do="couple", controller=twin.controller, axis=1, to=word) for word in ("blocked", "drive", "nothing")]
    return told, twin.asked(do="encoders", controller=twin.controller)


def requests_for_units(twin: Twin) -> object:
    return twin.asked(do="state", controller="nobody"), twin.asked(do="state", controller="")


def faults(twin: Twin) -> object:
    """Set, strike, list, clear; kinds and values that are none."""
    told = [twin.asked(do="fault", fault="exception code=6 nth=1"), twin.pdu("0100000001"), twin.asked(do="faults")]
    told += [twin.asked(do="fault", fault=text) for text in ("nonsense", "stuck pin=IN99 value=1", "crc nth=x")]
    told += [twin.asked(do="clear_fault", name=name) for name in ("nobody", "exception")]
    return [*told, twin.asked(do="faults")]


def occasions_of_faults(twin: Twin) -> object:
    twin.asked(do="fault", fault="crc nth=3")
    told = twin.asked(do="faults")
    twin.asked(do="clear_fault", name="crc")
    return told


def power_cycle(twin: Twin) -> object:
    twin.pdu("0507d0ff00")
    return twin.asked(do="power_cycle", controller=twin.controller), twin.pdu("0107d00001"), without_time(twin.state())


def known_requests(twin: Twin) -> object:
    return twin.asked(do="nonsense")


def wrong_requests(twin: Twin) -> object:
    asked: list[dict[str, Any]] = [
        {"do": "set", "levels": ["IN1"]},
        {"do": "state", "controller": []},
        {"do": "fault", "fault": 1},
    ]
    return [twin.asked(**request) for request in asked]


def shell_codes(twin: Twin) -> object:
    """Exit codes of commands for a running twin."""
    typed = [
        ["pin"],
        ["pin", "IN99=1"],
        ["state"],
        ["power-cycle"],
        ["fault", "nonsense"],
        ["fault"],
        ["state", "--device", "other"],
    ]
    return {" ".join(words): twin.command(*words) for words in typed}


def ready_file(twin: Twin) -> object:
    return sorted(twin.ready), [(point["kind"], sorted(point)) for point in twin.ready["end_points"]]


# ---------------------------------------------------------------------- M1486


def chip_answers(twin: Twin) -> object:
    """U7 … the variable, the position after a move, the echo of function 41."""
    # U1, U2, U3: position; U20 when the motor has stopped.
    return twin.characters("F640\rR\rU20\rU1\rU2\rU3\r", 4)


def chip_state(twin: Twin) -> object:
    return without_time(twin.state())


def chip_pins(twin: Twin) -> object:
    asked: list[dict[str, Any]] = [{}, {"B3": 0}, {"limit": 0}, {"B99": 1}, {"B3": 2}]
    return [twin.set(changes) for changes in asked], twin.pins()


def chip_power_cycle(twin: Twin) -> object:
    return twin.asked(do="power_cycle", controller=twin.controller), without_time(twin.state())


def chip_faults(twin: Twin) -> object:
    given = ("crc nth=3", "nonsense", "noise every=1000", "slip axis=1 counts=5")
    told = [twin.asked(do="fault", fault=text) for text in given]
    return [*told, twin.asked(do="faults")]


def chip_encoder(twin: Twin) -> object:
    return twin.asked(do="encoders", controller=twin.controller)


def chip_shell_codes(twin: Twin) -> object:
    typed = ["pin", "pin B99=1", "state", "power-cycle", "encoder", "fault nonsense", "fault"]
    return {words: twin.command(*words.split()) for words in typed}


PROBES: dict[str, tuple[Probe, ...]] = {
    "mic488": (
        ready_file,
        all_registers,
        refused,
        units,
        rtu_over_tcp,
        network_requests,
        network_port,
        vision_records,
        motion,
        pins,
        names_of_pins,
        encoders,
        coupling_of_encoders,
        requests_for_units,
        faults,
        occasions_of_faults,
        power_cycle,
        known_requests,
        wrong_requests,
        shell_codes,
    ),
    "m1486": (
        ready_file,
        chip_state,
        chip_answers,
        network_port,
        chip_pins,
        chip_faults,
        chip_encoder,
        chip_power_cycle,
        known_requests,
        wrong_requests,
        chip_shell_codes,
    ),
}

OUTSIDE = (ready_file, rtu_over_tcp, network_requests, network_port, vision_records, shell_codes, chip_shell_codes)
"""Those that need a process: addresses, other links, the shell."""


class InProcess(Twin):
    """A world of the printed description in this process, in virtual time."""

    def __init__(self, kind: str, text: str) -> None:
        self.kind = kind
        self.live = LiveWorld(World.from_toml(text))
        self.port = PlacePort(self.live, "bus", "tcp-1", "tcp" if kind == "mic488" else "raw")

    @cached_property
    def controller(self) -> str:
        return self.live.subject.description.controllers[0].name

    def asked(self, **request: object) -> object:
        try:
            return json.loads(json.dumps(self.live.subject.do(read_command(request.pop("do"), request)).value))
        except SteptwinError as error:
            return family(error), str(error)

    def pdu(self, pdu: str, unit: int = 1) -> str:
        data = bytes.fromhex(pdu)
        return self.port.exchange(struct.pack(">HHHB", 7, 0, len(data) + 1, unit) + data, self.live.now)[6:].hex(" ")

    def settled(self, pdu: str, expected: str) -> str:
        while (answer := self.pdu(pdu)) != expected and self.live.now < LIMIT_S * SECOND:
            self.live.advance(self.live.now + MILLISECOND)
        return answer

    def characters(self, text: str, answers: int) -> str:
        data = self.port.exchange(text.encode(), self.live.now)
        while len(data) < answers:
            self.live.advance(self.live.now + MILLISECOND)
            data += b"".join(piece for _, piece in self.port.to_send(self.live.now))
        return data.hex(" ")


@pytest.fixture(scope="module", params=list(PROBES))
def twins(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Generator[tuple[Twin, Twin]]:
    made: list[Twin] = []
    try:
        made += [Twin(request.param, way, tmp_path_factory.mktemp(way)) for way in ("serve", "up")]
        yield made[0], made[1]
        # Ctrl-C and SIGTERM end both ways with 0, and nothing is left.
        assert [twin.end(number) for twin, number in zip(made, (signal.SIGINT, signal.SIGTERM), strict=True)] == [0, 0]
        left = [sorted(path.name for path in twin.directory.rglob("*") if not path.is_dir()) for twin in made]
        assert left == [["out", "twin.toml"]] * 2
    finally:
        for twin in made:
            twin.process.kill()
            twin.process.wait()
            twin.close()


def test_all_ways_answer_alike(twins: tuple[Twin, Twin], monkeypatch: pytest.MonkeyPatch) -> None:
    served, up = twins
    here = InProcess(served.kind, (up.directory / "twin.toml").read_text())
    differing: list[str] = []
    for probe in PROBES[served.kind]:
        shown: dict[str, object] = {}
        for way, twin in (("serve", served), ("up", up)):
            monkeypatch.setenv("XDG_RUNTIME_DIR", str(twin.directory))
            shown[way] = probe(twin)
        if probe not in OUTSIDE:
            shown["World"] = probe(here)
        if any(answer != shown["serve"] for answer in shown.values()):
            differing.append("\n".join([probe.__name__, *(f"  {way}: {answer}" for way, answer in shown.items())]))
    assert not differing, "\n".join(["these differ:", *differing])
