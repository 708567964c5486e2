"""Readers of streams never act on what may be the middle of something: the table in docs/architecture/streams.md.

Each row has an *outer* message that holds a whole *inner* one. Cut off anywhere, nothing of it is acted on, however long it is
waited; whole, in one piece or in two with a pause between them, it counts and its contents do not.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from io import BytesIO
from typing import Any, NamedTuple

import pytest
from register_bank import RegisterBank

from steptwin.baseprotocol import message_bytes, read_body
from steptwin.controller import MILLISECOND, SECOND
from steptwin.drivers.mic488.frames import FrameLog
from steptwin.drivers.mic488.listening import RtuListener, TcpListener
from steptwin.drivers.modbus import ModbusQuery, RtuMaster, TcpMaster
from steptwin.errors import Misuse
from steptwin.files.export.records import read_records
from steptwin.history.rows import read_batch
from steptwin.live.control import _Conversation
from steptwin.live.rfc2217 import Telnet
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.variants import variant
from steptwin.wire import mbap
from steptwin.wire.crc import with_crc
from steptwin.wire.gateway import ModbusGateway, ScriptPort, TcpGatewayPort
from steptwin.wire.line import SerialLine
from steptwin.wire.pdu import ReadRequest, WriteRegisterRequest
from steptwin.wire.slave import FrameDirection, RtuSlavePort, TcpSlavePort
from steptwin.wire.timed import LineTiming, TimedRtuSlavePort, TimedUnits

Read = Callable[[list[bytes]], list[Any]]
"""What is acted on of pieces with pauses of 40 ms between them and a long silence behind the last."""


class Reader(NamedTuple):
    read: Read
    outer: bytes
    inner: bytes
    """Acted on where it comes alone; empty where nothing can be inside."""
    takes_pauses: bool = True


def write_around(inner: bytes) -> bytes:
    """A request PDU that writes 40 registers whose data hold ``inner``."""
    return bytes.fromhex("10 01 2C 00 28 50") + (bytes(20) + inner).ljust(80, b"\0")


def ports(make: Callable[[RegisterBank], Any]) -> Read:
    def read(pieces: list[bytes]) -> list[Any]:
        bank = RegisterBank()
        port, now = make(bank), 0
        for piece in [*pieces, b""]:
            if piece:
                port.exchange(piece, now)
            until = now + (40 * MILLISECOND if piece else 5 * SECOND)
            while (due := port.deadline()) is not None and due <= until:
                port.to_send(due)
            now = until
        return [pdu for _, pdu in bank.executed]

    return read


def timed(bank: RegisterBank, *, strict: bool = False) -> TimedUnits:
    return TimedUnits({1: bank}, LineTiming(SerialLine(38400), strict=strict))


def heard(pieces: list[bytes]) -> list[Any]:
    words = FrameLog()
    frames: list[Any] = []
    words.sinks.append(frames.append)
    ear, now = RtuListener(words), 0
    for piece in pieces:
        ear.feed(piece, now)
        now += 40 * MILLISECOND
        while (due := ear.deadline()) is not None and due <= now:
            ear.expire(due)
    while (due := ear.deadline()) is not None:
        ear.expire(due)
    return [frame.raw for frame in frames if frame.raw]


def heard_over_tcp(pieces: list[bytes]) -> list[Any]:
    words = FrameLog(tcp=True)
    frames: list[Any] = []
    words.sinks.append(frames.append)
    ear = TcpListener(words)
    for piece in pieces:
        ear.feed(piece, 0, FrameDirection.IN)
    return [frame.raw for frame in frames]


def answered(master: RtuMaster | TcpMaster, query: ModbusQuery, pieces: list[bytes]) -> list[Any]:
    master.start(query, 0, urgent=False)
    return [answer for piece in pieces if (answer := master.receive(piece, 0)) is not None]


def from_late_answer(pieces: list[bytes]) -> list[Any]:
    """The answer to a write, while that to an earlier read is still to come."""
    master = RtuMaster()
    master.start(ModbusQuery(1, ReadRequest(3, 0, 40)), 0, urgent=False)
    master.abandon(0)
    return answered(master, _WRITE, pieces)


def from_chip(pieces: list[bytes]) -> list[Any]:
    chip = M1486Chip(variant("B"), address=0)
    for piece in pieces:
        chip.receive(piece, chip.now + 40 * MILLISECOND)
    chip.advance(chip.now + 5 * SECOND)
    return [event.text for event in chip.events if event.code != "power-on"]


def from_telnet(pieces: list[bytes]) -> list[Any]:
    telnet = Telnet()
    return [plain for piece in pieces if (plain := telnet.receive(piece)[0])]


class _Transport(asyncio.Transport):
    def set_write_buffer_limits(self, high: int | None = None, low: int | None = None) -> None: ...
    def write(self, data: Any) -> None: ...
    def close(self) -> None: ...
    def is_closing(self) -> bool:
        return False


def from_control(pieces: list[bytes]) -> list[Any]:
    asked: list[Any] = []

    class Subject:
        async def answer(self, wanted: Any) -> Any:
            asked.append(wanted)
            raise Misuse("no")

        do = answer

    async def talk() -> None:
        conversation = _Conversation(Subject(), set(), "")  # type: ignore[arg-type]
        conversation.connection_made(_Transport())
        for piece in pieces:
            conversation.data_received(piece)
        conversation.eof_received()
        await asyncio.sleep(0)
        conversation.connection_lost(None)

    asyncio.run(talk())
    return asked


def bodies(pieces: list[bytes]) -> list[Any]:
    stream, found = BytesIO(b"".join(pieces)), []
    try:
        while (body := read_body(stream)) is not None:
            found.append(body)
    except Misuse:
        return found
    return found


def unless_refused(read: Callable[[bytes], Any]) -> Read:
    def found(pieces: list[bytes]) -> list[Any]:
        try:
            return [read(b"".join(pieces))]
        except (Misuse, ValueError, TypeError):
            return []

    return found


_FRAME = with_crc(bytes.fromhex("01 06 00 64 66 66"))
_MBAP = mbap.encode_frame(7, 1, _FRAME[1:-2])
_WRITE = ModbusQuery(1, WriteRegisterRequest(100, 0x6666))
_MBAP_1 = mbap.encode_frame(1, 1, _FRAME[1:-2])
"""With the number of the first exchange of a driver."""
_AROUND = with_crc(b"\1" + write_around(_FRAME))
_AROUND_TCP = mbap.encode_frame(8, 1, write_around(_MBAP))
_ANSWER_AROUND = with_crc(b"\1\3\x50" + (bytes(20) + _FRAME).ljust(80, b"\0"))
_REQUEST = b'{"do":"describe"}'
_MESSAGE = message_bytes({"id": 1})

ROWS = {
    "RTU line": Reader(ports(lambda bank: RtuSlavePort({1: bank})), _AROUND, _FRAME),
    "RTU line with timing": Reader(ports(lambda bank: TimedRtuSlavePort(timed(bank))), _AROUND, _FRAME),
    "strict RTU line": Reader(
        ports(lambda bank: TimedRtuSlavePort(timed(bank, strict=True))), _AROUND, _FRAME, takes_pauses=False
    ),
    "scripts of a world": Reader(ports(lambda bank: ScriptPort(ModbusGateway(timed(bank)))), _AROUND, _FRAME),
    "sniff, RTU": Reader(heard, _AROUND, _FRAME),
    "Modbus TCP": Reader(ports(lambda bank: TcpSlavePort({1: bank})), _AROUND_TCP, _MBAP),
    "Modbus TCP gateway": Reader(ports(lambda bank: TcpGatewayPort(ModbusGateway(timed(bank)))), _AROUND_TCP, _MBAP),
    "sniff, Modbus TCP": Reader(heard_over_tcp, _AROUND_TCP, _MBAP),
    "driver, RTU, after a late answer": Reader(from_late_answer, _ANSWER_AROUND + _FRAME, _FRAME),
    "driver, Modbus TCP": Reader(
        lambda pieces: answered(TcpMaster(), _WRITE, pieces), mbap.encode_frame(9, 1, write_around(_MBAP_1)) + _MBAP_1, _MBAP_1
    ),
    "M1486": Reader(from_chip, b"; r\rv12800000\r", b"v12800000\r"),
    "RFC 2217": Reader(from_telnet, b"\xff\xfa\x2c\x00" + b"AA" + b"\xff\xf0" + b"A", b"A"),
    "control endpoint": Reader(
        from_control, b'{"do":"state","controller":"m","id":' + json.dumps(_REQUEST.decode()).encode() + b"}\n", _REQUEST + b"\n"
    ),
    "editor server and debug adapter": Reader(bodies, message_bytes({"text": _MESSAGE.decode()}), _MESSAGE),
    "spool of a history": Reader(unless_refused(read_batch), b'["[0]",1,2,3,false,[],[],[]]', b'["x",1,2,3,false,[],[],[]]'),
}


@pytest.mark.parametrize("name", ROWS)
def test_nothing_is_acted_on_that_may_be_the_middle_of_something(name: str) -> None:
    read, outer, inner, takes_pauses = ROWS[name]
    (alone,) = read([inner])
    (whole,) = read([outer])
    if outer.endswith(inner):  # what is inside the first message comes again behind it
        assert whole == alone
    else:
        assert whole != alone
    for cut in range(1, len(outer)):
        assert read([outer[:cut]]) == [], cut
        assert read([outer[:cut], outer[cut:]]) == ([whole] if takes_pauses else []), cut


@pytest.mark.parametrize("name", [name for name, row in ROWS.items() if row.outer is _AROUND])
def test_what_lies_inside_a_frame_is_never_acted_on_however_much_noise_is_around_it(name: str) -> None:
    """Each byte of the noise may begin a frame."""
    read, outer, _, takes_pauses = ROWS[name]
    whole = read([outer])
    for before in (1, 256, 300, 1000):
        for behind in range(0, 300, 12):
            assert read([b"\5" * before + outer + b"\5" * behind]) == (whole if takes_pauses else []), (before, behind)


def test_a_trace_that_is_cut_off_ends_with_its_last_whole_record() -> None:
    head = b'{"steptwin_trace":2,"title":"","machines":{},"axes":[],"until_ns":null,"digest":""}\n'
    assert list(read_records(BytesIO(head), "x").trace) == []
    for cut in range(1, len(head) - 1):
        with pytest.raises(Misuse):
            read_records(BytesIO(head[:cut]), "x")
    assert list(read_records(BytesIO(head + b'{"kind":"event"'), "x").trace) == []
