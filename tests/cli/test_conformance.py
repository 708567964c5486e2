"""A served controller and one in a world are the same machine: one suite, asked of both ways of making a twin.

What differs is listed in `KNOWN`, with the reason; an entry that no longer differs fails, so the list can only shrink.
"""

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
from pathlib import Path
from typing import Any

import pytest

from steptwin.errors import SteptwinError
from steptwin.live.control import ask
from steptwin.mic488.registermap import Space
from steptwin.mic488.registers import register_map

STEPTWIN = str(Path(sys.executable).with_name("steptwin"))
LIMIT_S = 60.0

WORLDS = {
    "mic488": """
[[line]]
name = "bus"
tcp = "127.0.0.1:0"
rtu_tcp = "127.0.0.1:0"
rfc2217 = "127.0.0.1:0"
gap = 5
pty = "pty"
[[mic488]]
name = "twin"
line = "bus"
vision = "127.0.0.1:0"
""",
    "m1486": """
[[line]]
name = "bus"
kind = "m1486"
tcp = "127.0.0.1:0"
rfc2217 = "127.0.0.1:0"
pty = "pty"
[[m1486]]
name = "F"
line = "bus"
variant = "A"
""",
}
SERVED = {
    "mic488": [
        *("--tcp", "127.0.0.1:0", "--rtu-tcp", "127.0.0.1:0", "--rfc2217", "127.0.0.1:0"),
        *("--gap", "5", "--pty", "pty", "--vision", "127.0.0.1:0"),
    ],
    "m1486": ["--tcp", "127.0.0.1:0", "--rfc2217", "127.0.0.1:0", "--pty", "pty"],
}


class Twin:
    """One way of making a twin, by the real command."""

    def __init__(self, kind: str, way: str, directory: Path) -> None:
        self.kind = kind
        self.directory = directory
        self.environment = {**os.environ, "XDG_RUNTIME_DIR": str(directory), "COLUMNS": "200", "TERM": "dumb"}
        self.environment.pop("STEPTWIN_DEVICE", None)
        (directory / "twin.toml").write_text(WORLDS[kind])
        begin = ["serve", kind, *SERVED[kind]] if way == "serve" else ["up", "twin.toml"]
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

    def command(self, *arguments: str) -> tuple[int, str, str]:
        ended = subprocess.run(
            [STEPTWIN, *arguments], cwd=self.directory, env=self.environment, capture_output=True, text=True, check=False
        )
        return ended.returncode, ended.stdout, ended.stderr

    def asked(self, **request: object) -> object:
        """The answer of the control endpoint, or the kind and text of its error."""
        try:
            return ask("twin", request)
        except SteptwinError as error:
            return type(error).__name__, str(error)

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


def bare(answer: object) -> object:
    """Without what is known to differ: names of machines before pins, occasions of faults, words of errors."""
    match answer:
        case dict():
            return {str(name).rpartition(".")[2]: value for name, value in answer.items() if name != "seen"}
        case list():
            return [bare(element) for element in answer]
        case (kind, _):
            return kind
    return answer


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
    return told, twin.settled("03271a0001", "01 03 02 00 04"), twin.pdu("0327240002"), without_time(twin.asked(do="state"))


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
    return without_time(twin.asked(do="state"))


def pins(twin: Twin) -> object:
    asked: list[dict[str, Any]] = [{}, {"IN1": 1}, {"in2": 1, "AIN1": 4.5}, {"IN99": 1}, {"IN1": 2}, {"AIN1": 11}, {"IN1": "x"}]
    told = [bare(twin.asked(do="pin", set=changes)) for changes in asked]
    return told, twin.settled("0213880014", "01 02 03 03 00 00")  # both have passed their filters


def names_of_pins(twin: Twin) -> object:
    shown = twin.asked(do="pin", set={"IN1": 0})
    assert isinstance(shown, dict)
    return list(shown)


def encoders(twin: Twin) -> object:
    asked: list[dict[str, Any]] = [{}, {"1": 40}, {"9": 1}, {"1": 1.5}]
    return [bare(twin.asked(do="encoder", set=changes)) for changes in asked]


def coupling_of_encoders(twin: Twin) -> object:
    return [twin.asked(do="encoder", set={"1": word}) for word in ("blocked", "drive", "nothing")]


def requests_for_units(twin: Twin) -> object:
    return without_time(twin.asked(do="state", unit=1)) == without_time(twin.asked(do="state")), twin.asked(do="state", unit=9)


def faults(twin: Twin) -> object:
    """Set, strike, list, clear; kinds and values that are none."""
    told = [twin.asked(do="fault", set=["exception code=6 nth=1"]), twin.pdu("0100000001"), twin.asked(do="fault")]
    told += [twin.asked(do="fault", set=[text]) for text in ("nonsense", "stuck pin=IN99 value=1", "crc nth=x")]
    return [bare(answer) for answer in [*told, twin.asked(do="fault", clear=["nobody"]), twin.asked(do="fault", clear=True)]]


def occasions_of_faults(twin: Twin) -> object:
    told = twin.asked(do="fault", set=["crc nth=3"])
    twin.asked(do="fault", clear=True)
    return told


def power_cycle(twin: Twin) -> object:
    twin.pdu("0507d0ff00")
    return twin.asked(do="power-cycle"), twin.pdu("0107d00001"), without_time(twin.asked(do="state"))


def known_requests(twin: Twin) -> object:
    return twin.asked(do="nonsense")


def wrong_requests(twin: Twin) -> object:
    asked: list[dict[str, Any]] = [{"do": "pin", "set": ["IN1"]}, {"do": "state", "unit": []}, {"do": "fault", "set": 1}]
    return [bare(twin.asked(**request)) for request in asked]


def shell_codes(twin: Twin) -> object:
    """Exit codes of commands for a running twin."""
    typed = [
        ["pin"],
        ["pin", "IN99=1"],
        ["state"],
        ["power-cycle"],
        ["fault", "nonsense"],
        ["fault"],
        ["state", "--twin", "other"],
    ]
    return {" ".join(words): twin.command(*words)[0] for words in typed}


def ready_file(twin: Twin) -> object:
    return sorted(twin.ready), [(point["kind"], sorted(point)) for point in twin.ready["end_points"]]


# ---------------------------------------------------------------------- M1486


def chip_answers(twin: Twin) -> object:
    """U7 … the variable, the position after a move, the echo of function 41."""
    # U1, U2, U3: position; U20 when the motor has stopped.
    return twin.characters("F640\rR\rU20\rU1\rU2\rU3\r", 4)


def chip_state(twin: Twin) -> object:
    return without_time(twin.asked(do="state"))


def chip_pins(twin: Twin) -> object:
    asked: list[dict[str, Any]] = [{}, {"B3": 0}, {"limit": 0}, {"B99": 1}, {"B3": 2}]
    return [bare(twin.asked(do="pin", set=changes)) for changes in asked]


def chip_power_cycle(twin: Twin) -> object:
    return twin.asked(do="power-cycle"), without_time(twin.asked(do="state"))


def chip_faults(twin: Twin) -> object:
    given = ("crc nth=3", "nonsense", "noise every=1000", "slip axis=1 counts=5")
    told = [twin.asked(do="fault", set=[text]) for text in given]
    return [bare(answer) for answer in [*told, twin.asked(do="fault"), twin.asked(do="fault", clear=True)]]


def chip_encoder(twin: Twin) -> object:
    return twin.asked(do="encoder", set={})


def chip_shell_codes(twin: Twin) -> object:
    typed = ["pin", "pin B99=1", "state", "power-cycle", "encoder", "fault nonsense", "fault"]
    return {words: twin.command(*words.split())[0] for words in typed}


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

_NAMES = "a world names machines and asks by name, a served line asks by unit or address"
_TIME = "only a world can be paused, stepped and saved"

KNOWN: dict[tuple[str, str], str] = {
    ("mic488", "names_of_pins"): _NAMES,
    ("mic488", "requests_for_units"): _NAMES,
    (
        "mic488",
        "coupling_of_encoders",
    ): "what turns an encoder of a world is in its description; sessions record no other",
    ("mic488", "occasions_of_faults"): "only served controllers count the occasions of a fault",
    ("mic488", "known_requests"): _TIME,
    ("m1486", "known_requests"): _TIME,
    ("m1486", "chip_encoder"): "chips that are served do not know the request; the exit code is the same",
}


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


def test_both_ways_answer_alike(twins: tuple[Twin, Twin], monkeypatch: pytest.MonkeyPatch) -> None:
    served, up = twins
    differing, equal = {}, []
    for probe in PROBES[served.kind]:
        told = []
        for twin in (served, up):
            monkeypatch.setenv("XDG_RUNTIME_DIR", str(twin.directory))
            told.append(probe(twin))
        if told[0] != told[1]:
            differing[probe.__name__] = told
        else:
            equal.append(probe.__name__)
    unexpected = {name: told for name, told in differing.items() if (served.kind, name) not in KNOWN}
    text = "\n".join(f"{name}\n  serve: {told[0]}\n  up:    {told[1]}" for name, told in unexpected.items())
    assert not unexpected, f"these differ, and are not in KNOWN:\n{text}"
    assert [name for name in equal if (served.kind, name) in KNOWN] == [], "these do not differ any more: remove them from KNOWN"
