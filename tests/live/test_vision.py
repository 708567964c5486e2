"""Records of a vision system on the RTU lines of a controller and on a connection of their own."""

from __future__ import annotations

import struct
from functools import partial

import pytest
from mic488_rig import loaded

from steptwin.controller import MILLISECOND, Port
from steptwin.controllerstate import ProgramActivity, StateProgram
from steptwin.files.world import World
from steptwin.live.world import ClientPort, LiveWorld, VisionPort
from steptwin.mic488.present import state_of
from steptwin.mic488.vision import uses_vision
from steptwin.simulation.describe.generated import LINE, Whole
from steptwin.simulation.describe.generated_mic488 import mic488_world
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


def running(units: tuple[int, ...] = (1,), timing: str = "off") -> LiveWorld:
    """Controllers that run the program."""
    text = mic488_world(Whole(name="vision", line={"timing": timing}), units, {"program": "pick.prg"})
    live = LiveWorld(World.from_toml(text, {"pick.prg": PICK.encode()}))
    for view in live.world.mic488.values():
        view.device.command(partial(view.device.program.command, 1), 0)
    live.is_dirty = True
    return live


def records(live: LiveWorld) -> tuple[int, list[float]]:
    (view,) = live.world.mic488.values()
    live.advance(live.now + 100 * MILLISECOND)
    live.world.sync_all()
    user = view.device.user
    return user[0], [struct.unpack("<f", user[n : n + 2])[0] for n in (2, 4, 6, 8)]


@pytest.mark.parametrize("timing", ["off", "real"])
def test_wbc_15_records_and_frames_share_an_rtu_line(timing: str) -> None:
    live = running(timing=timing)
    port = ClientPort(live, LINE, "pty", "rtu")
    answered = b""
    for data in (READ, RECORD, READ, RECORD[:9], RECORD[9:], READ):
        live.advance(live.now + 100 * MILLISECOND)
        answered += port.exchange(data, live.now)
        for _ in range(100):
            live.advance(live.now + MILLISECOND)
            answered += b"".join(piece for _, piece in port.to_send(live.now))
    assert records(live) == (2, [7.0, 12.5, -3.25, 90.0])
    assert len(answered) == 3 * 25
    assert answered[:3] == b"\x01\x03\x14"


def test_wbc_15_a_vision_system_on_its_own_connection() -> None:
    live = running()
    port: Port = VisionPort(live, "mic488")
    assert (port.broken, port.deadline()) == (None, None)
    assert port.exchange(b"hello\r\nN1 X2 Y3 A4\nN2 X0 Y0 A", live.now) == b""
    assert records(live) == (1, [1.0, 2.0, 3.0, 4.0])
    port.exchange(b"-1\r", live.now)
    assert records(live) == (2, [2.0, 0.0, 0.0, -1.0])


def test_only_programs_that_ask_for_records_have_them_on_the_line() -> None:
    assert uses_vision(loaded(PICK)[0])
    assert uses_vision(loaded("VisionNew = 0\n")[0])
    assert not uses_vision(loaded("OUT1 = ON\nWAIT IN1 = ON\n")[0])


def test_a_vision_system_belongs_to_one_controller() -> None:
    """On a line of several a record is noise."""
    live = running(units=(1, 2))
    ClientPort(live, LINE, "pty", "rtu").exchange(RECORD, live.now)
    live.advance(live.now + 100 * MILLISECOND)
    live.world.sync_all()
    assert [view.device.user[0] for view in live.world.mic488.values()] == [0, 0]


def test_the_state_tells_where_a_program_is() -> None:
    live = running()
    live.advance(50 * MILLISECOND)
    live.world.sync_all()
    device = live.world.mic488["mic488"].device
    assert state_of(device, live.now).program == StateProgram(
        state=ProgramActivity.RUNNING,
        text="running at line 2: WAIT VisionNew = 1",
        file="pick.prg",
        line=2,
        statement="WAIT VisionNew = 1",
        variables={},
    )
    device.program.command(0, live.now)
    ended = state_of(device, live.now).program
    assert (ended.state, ended.line, ended.statement) == (ProgramActivity.STOPPED, None, None)
