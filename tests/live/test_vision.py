"""Records of a vision system on the RTU lines of a served controller and on a connection of their own."""

from __future__ import annotations

import struct

import pytest
from wbc_rig import loaded

from steptwin.errors import Misuse
from steptwin.files.programbanks import Banks
from steptwin.machine import Port
from steptwin.mic488.config import ControllerConfig
from steptwin.mic488.device import Mic488
from steptwin.mic488.vision import uses_vision
from steptwin.served.mic488 import LineOptions, Mic488Line, state_of
from steptwin.wire.crc import crc16

#: Copies each new record, with the number of records before it in $I0.
PICK = """\
MAIN:
WAIT VisionNew = 1
$I0 = $I0 + 1
$R2 = VisionNo
$R4 = VisionX
$R6 = VisionY
$R8 = VisionA
VisionNew = 0
JUMP MAIN
"""
RECORD = b"N7 X12.5 Y-3,25 A90\r\n"


def frame(pdu: bytes) -> bytes:
    body = b"\x01" + pdu
    return body + crc16(body).to_bytes(2, "little")


READ = frame(b"\x03" + struct.pack(">HH", 0, 10))


def served(text: str = PICK, options: LineOptions | None = None) -> tuple[Mic488Line, Mic488]:
    line = Mic488Line(ControllerConfig(), [1], "1.70", Banks({0: loaded(text)[0]}), options=options)
    device = line.devices[1]
    device.program.command(1, 0)
    device.touch()
    return line, device


def records(device: Mic488, now: int) -> tuple[int, list[float]]:
    device.advance(now)
    user = device.user
    return user[0], [struct.unpack("<f", user[n : n + 2])[0] for n in (2, 4, 6, 8)]


@pytest.mark.parametrize("options", [{}, {"frames": True}, {"timing": True}, {"timing": True, "frames": True}])
def test_wbc_15_records_and_frames_share_an_rtu_line(options: dict[str, bool]) -> None:
    line, device = served(options=LineOptions(**options))
    port = line.rtu_port("pty")
    answered, now = b"", 0
    for data in (READ, RECORD, READ, RECORD[:9], RECORD[9:], READ):
        now += 100_000_000
        answered += port.exchange(data, now)
        for _ in range(100):
            now += 1_000_000
            answered += b"".join(piece for _, piece in port.to_send(now))
    assert records(device, now) == (2, [7.0, 12.5, -3.25, 90.0])
    assert len(answered) == 3 * 25
    assert answered[:3] == b"\x01\x03\x14"


def test_wbc_15_a_vision_system_on_its_own_connection() -> None:
    line, device = served()
    port: Port = line.vision_port()
    assert (port.broken, port.deadline()) == (None, None)
    assert port.exchange(b"hello\r\nN1 X2 Y3 A4\nN2 X0 Y0 A", 5_000_000) == b""
    assert records(device, 100_000_000) == (1, [1.0, 2.0, 3.0, 4.0])
    port.exchange(b"-1\r", 200_000_000)
    assert records(device, 300_000_000) == (2, [2.0, 0.0, 0.0, -1.0])


def test_only_programs_that_ask_for_records_have_them_on_the_line() -> None:
    assert uses_vision(loaded(PICK)[0])
    assert uses_vision(loaded("VisionNew = 0\n")[0])
    assert not uses_vision(loaded("OUT1 = ON\nWAIT IN1 = ON\n")[0])


def test_a_vision_system_belongs_to_one_controller() -> None:
    line = Mic488Line(ControllerConfig(), [1, 2], "1.70", Banks({0: loaded(PICK)[0]}))
    with pytest.raises(Misuse, match="serve a single unit"):
        line.vision_port()
    line.rtu_port("pty").exchange(RECORD, 0)


def test_the_state_tells_where_a_program_is() -> None:
    _, device = served()
    device.advance(50_000_000)
    shown = state_of(device, 50_000_000)["program"]
    assert shown == {
        "state": "running",
        "program_bank": 0,
        "position_bank": 0,
        "file": "program",
        "line": 2,
        "text": "WAIT VisionNew = 1",
    }
    device.program.command(0, 50_000_000)
    assert "line" not in state_of(device, 50_000_000)["program"]  # type: ignore[operator]
