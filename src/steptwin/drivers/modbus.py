"""The Modbus master: requests, as RTU frames or behind an MBAP header. Pure."""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import NamedTuple

from steptwin.controller import MICROSECOND, MILLISECOND, SECOND, Nanos
from steptwin.drivers.exchange import LineLost, SendNext
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.wire import mbap, pdu, rtu
from steptwin.wire.crc import crc16
from steptwin.wire.line import SerialLine
from steptwin.wire.slave import FrameCallback, FrameDirection

QUIET_NS: Nanos = rtu.BURSTY_GAP_NS
"""Silence after a failed exchange before the line is used again, ns."""
NOISE_NS: Nanos = 200 * MILLISECOND
"""Longest wait for that silence, ns."""
LATE_NS: Nanos = 5 * SECOND
"""Time after which a late answer can no longer arrive, ns."""
LEAST_GAP_NS: Nanos = 1750 * MICROSECOND
"""Silence before a frame above 19200 bit/s (Modbus over serial line V1.02, section 2.5.1.1); below it 3.5 characters."""
HELD_BYTES = 2 * rtu.MAX_FRAME

_EXCEPTION_FRAME = 5


class ModbusQuery:
    """A Modbus request to a unit. ``describe`` gives its text; ``changes`` is false for reads only."""

    __slots__ = (
        "_describe",
        "_rtu_frame",
        "changes",
        "device",
        "function",
        "head",
        "pdu",
        "request",
        "rtu_head",
        "rtu_size",
        "size",
        "tcp_tail",
    )

    def __init__(self, unit: int, request: pdu.ModbusRequest, describe: Callable[[bytes], str] | None = None) -> None:
        self.device = unit
        self.request = request
        self.pdu = pdu.encode_request(request)
        self.function = request.function
        self.changes = request.function not in pdu.READS
        self._describe = describe
        match request:
            case pdu.ReadRequest(function, _, count):
                payload = (count + 7) // 8 if function in pdu.BIT_READS else 2 * count
                self.head = bytes((function, payload))
                self.size = 2 + payload
            case pdu.WriteRegistersRequest():
                self.head, self.size = self.pdu[:5], 5
            case _:
                self.head, self.size = self.pdu, 5
        self.rtu_head = bytes((unit,)) + self.head
        self.rtu_size = self.size + 3
        self._rtu_frame: bytes | None = None
        self.tcp_tail = (len(self.pdu) + 1).to_bytes(4, "big") + bytes((unit,)) + self.pdu
        """The Modbus TCP frame without its transaction number."""

    @property
    def rtu_frame(self) -> bytes:
        frame = self._rtu_frame
        if frame is None:
            frame = self._rtu_frame = rtu.encode_frame(self.device, self.pdu)
        return frame

    def __str__(self) -> str:
        text = self.pdu.hex(" ") if self._describe is None else self._describe(self.pdu)
        return f"unit {self.device}: {text}"

    def answered_by(self, answer: bytes) -> bool:
        """Whether a PDU is a positive answer to this request, judged by its bytes."""
        return len(answer) == self.size and answer.startswith(self.head)


class _LateAnswer(NamedTuple):
    """A late answer that may still arrive."""

    query: ModbusQuery
    until: Nanos


class RtuMaster:
    """RTU frames on a line whose answers carry no number.

    A late answer looks like the answer to a later request of the same kind. Devices answer in order; so before such a request a
    *marker* is sent, a read whose answer differs in length from all late ones: once it is answered, no late answer can arrive.
    A repeated request needs none, because either answer is correct.

    ``serial`` is None if bytes take no time. Adapters that echo the bytes sent are detected at the first read.
    """

    __slots__ = (
        "_asked", "_busy_until", "_gap_ns", "_held", "_late_answers", "_serial", "_then", "echo", "free_ns", "on_frame",
    )  # fmt: skip

    def __init__(self, serial: SerialLine | None = None, *, on_frame: FrameCallback | None = None) -> None:
        self._serial = serial
        self._gap_ns = 0 if serial is None else max(LEAST_GAP_NS, serial.duration(7) // 2)
        self.on_frame = on_frame
        self.echo = False
        """Whether the adapter echoes the bytes sent."""
        self._late_answers: list[_LateAnswer]
        self._asked: ModbusQuery | None
        self._then: ModbusQuery | None
        self.free_ns: Nanos
        self._busy_until: Nanos
        self.reset()

    def reset(self) -> None:
        self._late_answers = []
        self._asked = None
        self._then = None  # what a marker was sent for
        self._held = b""
        self.free_ns = 0
        self._busy_until = 0  # how long noise can keep the line

    @property
    def wary(self) -> bool:
        return bool(self._late_answers)

    def allowance_ns(self, request: ModbusQuery) -> Nanos:
        return (
            0 if self._serial is None else self._serial.duration(len(request.rtu_frame) + max(request.rtu_size, _EXCEPTION_FRAME))
        )

    # ------------------------------------------------------------------ asking

    def start(self, request: ModbusQuery, now: Nanos, *, urgent: bool) -> bytes:
        self._held = b""
        # A stop is sent at once; the answer of an earlier stop is equivalent.
        if self._late_answers and not urgent and self._could_be_confused(request, now):
            self._then = request
            request = self._marker(request.device)
        return self._send(request, now)

    def _send(self, query: ModbusQuery, now: Nanos) -> bytes:
        self._asked = query
        if self.on_frame is not None:
            self.on_frame(now, FrameDirection.IN, query.rtu_frame)
        return query.rtu_frame

    def _could_be_confused(self, request: ModbusQuery, now: Nanos) -> bool:
        self._late_answers = [owed for owed in self._late_answers if owed.until > now]
        return any(
            owed.query is not request and owed.query.device == request.device and owed.query.function == request.function
            for owed in self._late_answers
        )

    def _marker(self, unit: int) -> ModbusQuery:
        taken = {owed.query.rtu_size for owed in self._late_answers if owed.query.function == pdu.READ_HOLDING_REGISTERS}
        count = next((n for n in range(1, pdu.MAX_REGISTERS) if 2 * n + 5 not in taken), pdu.MAX_REGISTERS)
        return ModbusQuery(
            unit, pdu.ReadRequest(pdu.READ_HOLDING_REGISTERS, 0, count), lambda _: "a read to find out what is still to come"
        )

    # ------------------------------------------------------------------ hearing

    def receive(self, data: bytes, now: Nanos) -> bytes | SendNext | None:
        asked = self._asked
        if asked is None:
            return None
        held = self._held + data if self._held else data
        if len(held) == asked.rtu_size and not self.echo and held.startswith(asked.rtu_head) and crc16(held) == 0:
            frame = held
        else:
            frame = self._found(asked, held)
            if frame is None:
                self._held = held[-HELD_BYTES:]
                return None
        if self.on_frame is not None:
            self.on_frame(now, FrameDirection.OUT, frame)
        self.free_ns = now + self._gap_ns
        self._held = b""
        self._asked = None
        if self._late_answers:
            self._settle(asked)
        then, self._then = self._then, None
        if then is not None:
            return SendNext(self._send(then, now), may_wait=True)
        answer = frame[1:-2]
        if answer[0] != asked.function:
            raise pdu.ModbusException(asked.function, answer[1])
        return answer

    def _found(self, asked: ModbusQuery, held: bytes) -> bytes | None:
        """The answer to ``asked`` in the received bytes, possibly behind other bytes."""
        start = 0
        sent = asked.rtu_frame
        if not asked.changes and held.startswith(sent):
            self.echo = True  # no answer to a read repeats it
        if self.echo:
            if len(held) < len(sent):
                return None
            if held.startswith(sent):
                start = len(sent)
        first = bytes((asked.device,))
        refused = asked.function | pdu.REFUSED
        while (start := held.find(first, start)) >= 0 and start + _EXCEPTION_FRAME <= len(held):
            function = held[start + 1]
            size = 0
            if function == asked.function and held.startswith(asked.rtu_head, start):
                size = asked.rtu_size
            elif function == refused and self._then is None:  # a marker is known by its length only
                size = _EXCEPTION_FRAME
            if size and start + size <= len(held) and crc16(held[start : start + size]) == 0:
                return held[start : start + size]
            if self._late_answers and not size and (late := self._late_at(held, start)):
                if start + late > len(held):
                    return None  # what looks like the answer may be data of this one
                start += late
            else:
                start += 1
        return None

    def _late_at(self, held: bytes, start: int) -> int:
        """Length of a late answer that begins at ``start``, whole or not; 0 if none does."""
        for query in (owed.query for owed in self._late_answers):
            whole = held[start : start + query.rtu_size]
            if whole.startswith(query.rtu_head) and (len(whole) < query.rtu_size or crc16(whole) == 0):
                return query.rtu_size
        return 0

    def _settle(self, asked: ModbusQuery) -> None:
        """Forget earlier requests to the device after ``asked`` was answered, unless this was the answer to one of them."""
        of_device = [owed for owed in self._late_answers if owed.query.device == asked.device]
        if self._then is not None or all(owed.query.function != asked.function for owed in of_device):
            self._late_answers = [owed for owed in self._late_answers if owed.query.device != asked.device]

    def abandon(self, now: Nanos) -> bytes:
        received, self._held = self._held, b""
        if self._asked is not None:
            self._late_answers.append(_LateAnswer(self._asked, now + LATE_NS))
            self._asked = None
        self._then = None
        self.free_ns = now + QUIET_NS
        self._busy_until = now + NOISE_NS
        if received and self.on_frame is not None:
            self.on_frame(now, FrameDirection.OUT, received)
        return received

    def stray(self, data: bytes, now: Nanos) -> None:
        if now < self._busy_until:
            self.free_ns = min(now + QUIET_NS, self._busy_until)


class TcpMaster:
    """Modbus TCP frames. Answers carry the number of their request, so late ones are recognised and ignored.

    An answer with the right number to another request, as some gateways send, is ignored, too: it does not show what the device
    has done. ``place``: the address, for messages.
    """

    __slots__ = ("_asked", "_framer", "_no_answer", "_number", "_number_bytes", "_place", "on_frame")

    free_ns: Nanos = 0
    wary = False

    def __init__(self, place: str = "the connection", *, on_frame: FrameCallback | None = None) -> None:
        self.on_frame = on_frame
        self._place = place
        self._number = 0
        self._number_bytes = b"\0\0"
        self._asked: ModbusQuery | None
        self.reset()

    def reset(self) -> None:
        self._asked = None
        self._no_answer = b""  # what came instead of an answer
        self._framer = mbap.TcpFramer()

    def allowance_ns(self, request: ModbusQuery) -> Nanos:
        return 0

    def start(self, request: ModbusQuery, now: Nanos, *, urgent: bool) -> bytes:
        self._number = self._number + 1 & 0xFFFF
        self._number_bytes = self._number.to_bytes(2, "big")
        self._asked = request
        self._no_answer = b""
        frame = self._number_bytes + request.tcp_tail
        if self.on_frame is not None:
            self.on_frame(now, FrameDirection.IN, frame)
        return frame

    def receive(self, data: bytes, now: Nanos) -> bytes | None:
        asked = self._asked
        if asked is None:
            self._feed(data)
            return None
        if len(data) == asked.size + 7 and not self._framer.held and data[:2] == self._number_bytes and data[6] == asked.device:
            answer = data[7:]
            if asked.answered_by(answer) and data[2:6] == (len(answer) + 1).to_bytes(4, "big"):
                if self.on_frame is not None:
                    self.on_frame(now, FrameDirection.OUT, data)
                self._asked = None
                return answer
        for frame in self._feed(data):
            if self.on_frame is not None:
                self.on_frame(now, FrameDirection.OUT, frame.raw)
            if frame.transaction == self._number and frame.unit == asked.device:
                answer = frame.pdu
                if asked.answered_by(answer):
                    self._asked = None
                    return answer
                if answer[0] == asked.function | pdu.REFUSED and len(answer) == 2:
                    self._asked = None
                    raise pdu.ModbusException(asked.function, answer[1])
            self._no_answer = frame.raw
        return None

    def _feed(self, data: bytes) -> list[mbap.TcpFrame]:
        frames = self._framer.feed(data)
        if self._framer.broken is not None:
            raise LineLost(NO_MODBUS(place=self._place, problem=self._framer.broken))
        return frames

    def abandon(self, now: Nanos) -> bytes:
        self._asked = None
        return self._no_answer + self._framer.held

    def stray(self, data: bytes, now: Nanos) -> None:
        self._feed(data)


def words(answer: bytes) -> tuple[int, ...]:
    """The registers in the answer to a read of holding registers."""
    return struct.unpack_from(f">{answer[1] // 2}H", answer, 2)


def bits(answer: bytes, count: int) -> list[bool]:
    """The first ``count`` states in the answer to a read of bits."""
    return pdu.unpack_bits(answer[2:], count)


NO_MODBUS = Message("drivers.no-modbus", "{place}: what came is not Modbus TCP ({problem})")
WRONG_UNIT = Message("drivers.wrong-unit", "unit {unit} is outside {least} to {most}")


def check_unit(unit: int, *, tcp: bool) -> None:
    """Raises `Misuse` for a unit that sends no answers."""
    least, most = (0, 255) if tcp else (1, rtu.MAX_UNIT)
    if not least <= unit <= most:
        raise Misuse(WRONG_UNIT(unit=unit, least=least, most=most))
